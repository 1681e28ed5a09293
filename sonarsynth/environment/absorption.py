"""What the water does to sound on its way: the description of absorption turned into numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.environment.sea import Absorption, Profile
from sonarsynth.equations.rays import path_means
from sonarsynth.equations.water import seawater
from sonarsynth.equations.water.formula_ranges import noted


def absorption_db_per_m(absorption: Absorption, frequency: npt.ArrayLike, depth: npt.ArrayLike) -> Floats:
    """Absorption (dB/m) at frequencies (Hz) and depths (m, positive down), broadcast together.

    Outside the range of the formula too, without a warning: `absorption_notes` are for that.
    """
    with noted():
        return _formula(absorption, frequency, depth)


ALIKE = 1e-3
"""dB: a ray over which the depths of the water can differ by no more is averaged along straight legs."""
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

    @cached_property
    def integral(self) -> Floats:
        """(node,) dB: of the value, from the surface down."""
        value = self.value
        return np.append(0.0, np.cumsum(0.5 * (value[1:] + value[:-1]) * np.diff(self.depth)))

    def lost(
        self, length: Floats, profile: Profile, start: Floats, end: Floats, climb: Floats, vertices: Ints
    ) -> Floats:
        """What is absorbed (path,) in dB along rays of some length (path,) m; the rest as of `along`. Off by `ALIKE` at
        most where that spares following them."""
        bent = length * np.ptp(self.value) > ALIKE
        return length * self.along(profile, start, end, climb, vertices, bent)

    def along(
        self, profile: Profile, start: Floats, end: Floats, climb: Floats, vertices: Ints, bent: Bools | None = None
    ) -> Floats:
        """Mean (path,) in dB/m along rays from depths start to end (path,) m.

        profile: what bends them, a uniform one if nothing does; climb (path,): upward component of the unit vector in
        which each leaves; vertices (path,): reflections and turning points; bent (path,): which are followed where they
        bend, all if left out.
        """
        out = np.empty(len(start))
        water, table = (profile.depth, profile.speed), (self.depth, self.value, self.integral)
        bent = np.full(len(start), not profile.uniform) if bent is None else bent & (not profile.uniform)
        path_means.means(start, end, climb, vertices, bent, float(self.depth[-1]), water, table, out)
        return out


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
