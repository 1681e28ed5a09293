"""What the water does to sound on its way: the description of absorption turned into numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from sonarsynth.acoustics import seawater
from sonarsynth.acoustics.ranges import noted
from sonarsynth.conventions import Floats
from sonarsynth.world.environment import Absorption


def absorption_db_per_m(absorption: Absorption, frequency: npt.ArrayLike, depth: npt.ArrayLike) -> Floats:
    """Absorption (dB/m) at frequencies (Hz) and depths (m, positive down), broadcast together.

    Outside the range of the formula too, without a warning: `absorption_notes` are for that.
    """
    with noted():
        return _formula(absorption, frequency, depth)


def absorption_notes(absorption: Absorption, frequency: npt.ArrayLike, depth: npt.ArrayLike) -> tuple[str, ...]:
    """Where a description's formula is used outside its range, one line each, with the formula that holds there."""
    with noted() as notes:
        _formula(absorption, frequency, depth)
    if not notes:
        return ()
    other: Literal["francois_garrison", "ainslie_mccolm"] = (
        "ainslie_mccolm" if absorption.formula == "francois_garrison" else "francois_garrison"
    )
    with noted() as others:
        _formula(replace(absorption, formula=other), frequency, depth)
    return tuple(note if others else f"{note}; {other} holds there" for note in notes)


def _formula(absorption: Absorption, frequency: npt.ArrayLike, depth: npt.ArrayLike) -> Floats:
    water = (absorption.temperature, absorption.salinity)
    match absorption.formula:
        case "francois_garrison":
            return seawater.francois_garrison(frequency, *water, depth, absorption.ph)
        case "ainslie_mccolm":
            return seawater.ainslie_mccolm(frequency, *water, depth, absorption.ph)
        case "none":
            return np.zeros(np.broadcast_shapes(np.shape(frequency), np.shape(depth)))
