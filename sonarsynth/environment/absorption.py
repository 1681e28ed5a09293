"""What the water does to sound on its way: the description of absorption turned into numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats, Ints
from sonarsynth.environment.sea import Absorption
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
LEVEL = 1e-4
"""m: over less depth a ray has the absorption where it starts."""


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
        reflected, at bottom and surface in turn: in water that is mirrored at both it goes straight on. Bent rays are
        taken to pass the depths of straight ones.
        """
        bottom, odd = self.depth[-1], bounces % 2
        mirrored = (1 - 2 * odd) * end + bottom * (np.where(climb < 0.0, 1, -1) * bounces + odd)
        deep = mirrored - start
        level = np.abs(deep) < LEVEL
        mean = (self._above(mirrored) - self._above(start)) / np.where(level, 1.0, deep)
        return np.asarray(np.where(level, np.interp(start, self.depth, self.value), mean))

    def _above(self, depth: Floats) -> Floats:
        """Integral (path,) in dB of the value from the surface down, through water mirrored at surface and bottom."""
        layer = np.floor(depth / self.depth[-1])
        down, whole = layer % 2 == 0, self._integral[-1]
        inside = np.abs(depth - self.depth[-1] * (layer + ~down))
        cell = np.clip(np.searchsorted(self.depth, inside) - 1, 0, NODES - 2)
        into, step = inside - self.depth[cell], self.depth[1]
        steeper = 0.5 * into * (self.value[cell + 1] - self.value[cell]) / step
        above = self._integral[cell] + into * (self.value[cell] + steeper)
        return np.asarray(layer * whole + np.where(down, above, whole - above))

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
