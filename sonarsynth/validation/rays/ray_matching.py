"""What is compared of rays, how rays of two computations are matched, and how far apart they are."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints

if TYPE_CHECKING:
    from sonarsynth.equations.rays.ray_solutions import Eigenrays

Family = tuple[int, int, int, int, int]
"""Pair; launched up (1), level (0) or down (-1); surface, bottom and turning points."""


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays as any computation of them gives them, in any order. Grazing angles of travel (rad), up positive."""

    pair: Ints  # (ray,)
    travel_time: Floats  # (ray,) s
    start_angle: Floats  # (ray,) rad
    end_angle: Floats  # (ray,) rad
    amplitude: Floats  # (ray,) 1/m
    surface: Ints  # (ray,)
    bottom: Ints  # (ray,)
    turning: Ints  # (ray,)

    def select(self, keep: Bools | Ints) -> Rays:
        """The rays picked by a mask or by indices (ray,)."""
        rows: dict[str, Any] = {name: value[keep] for name, value in vars(self).items()}
        return Rays(**rows)

    @property
    def vertices(self) -> Ints:
        """(ray,) surface, bottom and turning points together."""
        return self.surface + self.bottom + self.turning

    @property
    def families(self) -> list[Family]:
        """(ray,) which family each belongs to."""
        launch = np.sign(self.start_angle).astype(int)
        columns = (self.pair, launch, self.surface, self.bottom, self.turning)
        return list(zip(*(column.tolist() for column in columns), strict=True))


def rays_of(eigenrays: Eigenrays) -> Rays:
    """Eigenrays as they are compared: angles from sine and cosine, so that none is ill-conditioned."""
    return Rays(
        pair=eigenrays.pair,
        travel_time=eigenrays.travel_time,
        start_angle=np.arctan2(eigenrays.start_sine, eigenrays.slowness * eigenrays.start_speed),
        end_angle=np.arctan2(eigenrays.end_sine, eigenrays.slowness * eigenrays.end_speed),
        amplitude=eigenrays.amplitude,
        surface=eigenrays.surface,
        bottom=eigenrays.bottom,
        turning=eigenrays.turning,
    )


def miscounted(computed: Rays, exact: Counter[Family]) -> int:
    """Rays missed and rays invented, over all families."""
    families = Counter(computed.families)
    return (exact - families).total() + (families - exact).total()


def nearest(computed: Rays, exact: Rays) -> tuple[Ints, Ints]:
    """Indices (computed, exact) of each exact ray that has one of its family, and of the nearest of them in time."""
    both = []
    of_family: dict[Family, list[int]] = {}
    for i, family in enumerate(computed.families):
        of_family.setdefault(family, []).append(i)
    for j, family in enumerate(exact.families):
        if family in of_family:
            late = np.abs(computed.travel_time[of_family[family]] - exact.travel_time[j])
            both.append((of_family[family][int(np.argmin(late))], j))
    columns = np.array(both, int).reshape(-1, 2)
    return columns[:, 0], columns[:, 1]


@dataclass(frozen=True, eq=False)
class Bounds:
    """Errors that a case is allowed."""

    time: float = 1e-13
    """s; or `relative_time` of the travel time where that is more: float64 resolves no better."""
    relative_time: float = 2e-15
    angle: float = 1e-9
    """rad"""
    amplitude: float = 1e-6
    """Relative, for rays that are not near a caustic."""


def worst(error: Floats, bound: Floats) -> tuple[float, float]:
    """Error and bound where their ratio is largest; NaN for an error that is none; (0, bound) without rays."""
    if len(error) == 0:
        return 0.0, float(np.max(bound, initial=0.0))
    wrong = np.flatnonzero(np.isnan(error))
    i = int(wrong[0]) if len(wrong) else int(np.argmax(error / bound))
    return float(error[i]), float(bound[i])


def errors(computed: Rays, exact: Rays, trusted: Bools, bounds: Bounds) -> dict[str, tuple[str, float, float]]:
    """Unit, worst error and its bound of each quantity of matched rays; trusted (ray,): not near a caustic."""
    count = len(computed.pair)
    time = np.abs(computed.travel_time - exact.travel_time)
    angle = np.maximum(np.abs(computed.start_angle - exact.start_angle), np.abs(computed.end_angle - exact.end_angle))
    amplitude = np.abs(computed.amplitude / exact.amplitude - 1.0)[trusted]
    of_time = np.maximum(bounds.time, bounds.relative_time * exact.travel_time)
    return {
        "time": ("s", *worst(time, of_time)),
        "angle": ("rad", *worst(angle, np.full(count, bounds.angle))),
        "amplitude": ("1", *worst(amplitude, np.full(len(amplitude), bounds.amplitude))),
    }
