"""What the water does to sound on its way: the description of absorption turned into numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats, Ints
from sonarsynth.environment.sea import Absorption
from sonarsynth.equations.rays import path_means
from sonarsynth.equations.water import seawater
from sonarsynth.equations.water.formula_ranges import noted


def absorption_db_per_m(absorption: Absorption, frequency: npt.ArrayLike, depth: npt.ArrayLike) -> Floats:
    """Absorption (dB/m) at frequencies (Hz) and depths (m, positive down), broadcast together.

    Outside the range of the formula too, without a warning: `absorption_notes` are for that.
    """
    with noted():
        return _formula(absorption, frequency, depth)


NODES = 513
"""Depths that absorption is taken at: linear in between, it errs by 4e-6 of itself in 12 km of water."""


@dataclass(frozen=True, eq=False)
class DepthAbsorption:
    """Absorption at one frequency at every depth: each path loses its mean over the depths that it passes."""

    depth: Floats  # (node,) m, from the surface to the bottom
    value: Floats  # (node,) dB/m

    @staticmethod
    def of(absorption: Absorption, frequency: float, bottom: float) -> DepthAbsorption:
        """That of a description at a frequency (Hz), in water so deep (m)."""
        depth = np.linspace(0.0, bottom, NODES)
        return DepthAbsorption(depth, absorption_db_per_m(absorption, frequency, depth))

    def along(self, start: Floats, end: Floats, climb: Floats, bounces: Ints) -> Floats:
        """Mean (path,) in dB/m along straight rays from depths start to end (path,) m, exact between the nodes.

        climb (path,): upward component of the unit vector in which each leaves; bounces (path,): how often it is
        reflected, at bottom and surface in turn. Bent rays are taken to pass the depths of straight ones.
        """
        out = np.empty(len(start))
        ends = np.broadcast_to(start, out.shape), np.broadcast_to(end, out.shape)
        path_means.straight_means(*ends, climb, bounces, self.value, self._integral, float(self.depth[1]), out)
        return out

    @cached_property
    def _integral(self) -> Floats:
        """(node,) dB: of the value, from the surface down."""
        return np.append(0.0, np.cumsum(0.5 * (self.value[1:] + self.value[:-1]) * self.depth[1]))

    @property
    def mean(self) -> float:
        """Mean (dB/m) over all depths."""
        return float(self._integral[-1] / self.depth[-1])


def absorption_notes(absorption: Absorption, frequency: npt.ArrayLike, depth: npt.ArrayLike) -> tuple[str, ...]:
    """Where a description's formula is used outside its range, one line each, with the formula that holds there."""
    with noted() as notes:
        _formula(absorption, frequency, depth)
    if not notes:
        return ()
    alternative: Literal["francois_garrison", "ainslie_mccolm"] = (
        "ainslie_mccolm" if absorption.formula == "francois_garrison" else "francois_garrison"
    )
    with noted() as others:
        _formula(replace(absorption, formula=alternative), frequency, depth)
    return tuple(note if others else f"{note}; {alternative} holds there" for note in notes)


def _formula(absorption: Absorption, frequency: npt.ArrayLike, depth: npt.ArrayLike) -> Floats:
    water = (absorption.temperature, absorption.salinity)
    match absorption.formula:
        case "francois_garrison":
            return seawater.francois_garrison(frequency, *water, depth, absorption.ph)
        case "ainslie_mccolm":
            return seawater.ainslie_mccolm(frequency, *water, depth, absorption.ph)
        case "none":
            return np.zeros(np.broadcast_shapes(np.shape(frequency), np.shape(depth)))
