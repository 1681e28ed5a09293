"""Rays between two points in water of layers, by images: closed forms and one root, with the spreading of the tube.

A ray by surface and bottom is a ray without reflections in the water and its mirror images, one above the other; depth
u in that stack is `unfolded`. Where the speed is linear in depth a ray is a circle. Between two levels of speeds a and
b, `dz` apart, with p = cos(grazing)/c and s = sin(grazing) at each,

    X = p (a + b) dz/(s_a + s_b),    T = (2/g) arsinh(g S/(2 sqrt(a b))),  S^2 = X^2 + dz^2

and on from a level to where it turns, and back, X = 2 s/(p g), T = (2/g) arsinh(s/(p c)). The unknown is the sine at
the fastest level of the ray, counted negative where the ray goes on beyond that level and turns. Amplitude by
conservation of power in the tube of rays (Jensen, Kuperman, Porter and Schmidt 2011, Computational Ocean Acoustics,
section 3.3), with dX for the change of the horizontal distance X by the sine sigma at the fastest level of speed c_f,

    A^2 = c_start c_end/(c_f^2 r |dX/dsigma|) |sigma|/(s_start s_end).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.validation.references.rays.layers_crossed import Water, crossed

if TYPE_CHECKING:
    from sonarsynth.validation.references.rays.layers_crossed import Crossed

ROUNDS = 60
CLOSE = 1e-13
"""Of the distance: rays come as close as that to where they should."""


class Family(NamedTuple):
    """How a ray is reflected: how often, and which boundary comes first."""

    bounces: int = 0
    down: bool = True

    def image(self, depth: Floats, bottom: float) -> Floats:
        """Unfolded depth (m) of the image of the end."""
        n, even = self.bounces, self.bounces % 2 == 0
        if self.down:
            return n * bottom + depth if even else (n + 1) * bottom - depth
        return depth - n * bottom if even else -(n - 1) * bottom - depth

    @property
    def bottom(self) -> int:
        """Reflections at the bottom."""
        return (self.bounces + 1) // 2 if self.down else self.bounces // 2


def families(bounces: int) -> list[Family]:
    """All with at most so many reflections."""
    return [Family(n, down) for n in range(bounces + 1) for down in ((True, False) if n else (True,))]


def source_families(bounces: int, depth: float, bottom: float, back: bool = False) -> list[tuple[Family, int]]:
    """Those of rays from a source at this depth (m), or back to it, and how many reflections of each count: one at the
    source itself, which lies on a boundary, does not, where any are followed."""
    found = []
    for family in families(bounces + (bounces > 0)):
        at_bottom = family.down == (family.bounces % 2 == 1) if back else family.down
        own = family.bounces > 0 and depth == (bottom if at_bottom else 0.0)
        found += [(family, family.bounces - own)] if family.bounces - own <= bounces else []
    return found


STEEPEST = 1e-6
"""Cosine that rays have at least: the sine of steeper ones, which are followed as these, is 1 to all digits."""


@dataclass(frozen=True, eq=False)
class Rays:
    """A ray for each pair of points; NaN where there is none."""

    time: Floats  # (ray,) s
    length: Floats  # (ray,) m
    spreading: Floats  # (ray,) 1/m
    departure: Floats  # (ray, xyz) unit vectors of travel, world
    arrival: Floats  # (ray, xyz)
    cosine: Floats  # (ray,) p = cos(grazing)/c, s/m
    level: Floats  # (ray, 2) unfolded depths of the ends
    sine: Floats  # (ray,) at the start, down positive in the unfolded water

    def select(self, rows: Bools | Ints) -> Rays:
        """Some of them."""
        return Rays(*(getattr(self, f.name)[rows] for f in fields(self)))


def rays(water: Water, start: Floats, end: Floats, family: Family) -> Rays:
    """The ray of a family between points (ray, xyz) of the world, z up, without more turning points than one.

    NaN too where all rays cross a level faster than both ends and turn beyond one of them: those are not looked for.
    """
    away = end[:, :2] - start[:, :2]
    first = -start[:, 2]
    last = family.image(-end[:, 2], water.bottom)
    r = np.maximum(np.hypot(away[:, 0], away[:, 1]), np.maximum(STEEPEST * np.abs(last - first), 1e-12))
    if np.ptp(water.speed) == 0.0:
        p, slope, sums = _straight(water, r, first, last)
    else:
        p, slope, sums = _bent(water, r, first, last)
    time, length, spreading = sums
    c1, c2 = water.at(first), water.at(-end[:, 2])
    level = away / r[:, None]
    fold = -1.0 if family.bounces % 2 else 1.0
    departure = np.column_stack([level * (p * c1)[:, None], -slope[0]])
    arrival = np.column_stack([level * (p * c2)[:, None], -fold * slope[1]])
    return Rays(time, length, spreading, departure, arrival, p, np.column_stack([first, last]), slope[0])


Found = tuple[Floats, tuple[Floats, Floats], tuple[Floats, Floats, Floats]]
"""p, signed sines at both ends, and time, length and spreading of rays."""


def _straight(water: Water, r: Floats, first: Floats, last: Floats) -> Found:
    length = np.hypot(r, last - first)
    c, sine = water.speed[0], (last - first) / length
    return r / length / c, (sine, sine), (length / c, length, 1.0 / length)


def _bent(water: Water, r: Floats, first: Floats, last: Floats) -> Found:
    pieces = crossed(water, first, last)
    sigma = _root(pieces, r)
    x, slope = pieces.distance(sigma)
    p = pieces.cosine(sigma)
    time = pieces.time(sigma) + p * (r - x)  # stationary: an error of the root counts twice over
    s1, s2 = pieces.sines(sigma)
    size = pieces.ends[0] * pieces.ends[1] / pieces.fastest**2
    tube = r * np.abs(slope) * np.where(pieces.narrow, np.maximum(s1, s2), s1 * s2 / np.maximum(np.abs(sigma), 1e-300))
    return p, pieces.signed(sigma, s1, s2), (time, pieces.length(sigma), np.sqrt(size / tube))


def _root(pieces: Crossed, r: Floats) -> Floats:
    """Sines at the fastest level whose rays cover distances r (ray,): Newton's, on 1/X, within a bracket."""
    low, high = pieces.lowest(), np.ones(len(r))
    sigma = np.clip(pieces.rise / np.hypot(pieces.rise, r), low, 1.0 - 1e-9)
    for _ in range(ROUNDS):
        x, slope = pieces.distance(sigma)
        far = x > r
        low, high = np.where(far, sigma, low), np.where(far, high, sigma)
        if (np.abs(x - r) <= CLOSE * r).all():
            break
        with np.errstate(divide="ignore", invalid="ignore"):
            step = sigma - (1.0 / x - 1.0 / r) / (-slope / x**2)
        sigma = np.where((step > low) & (step < high), step, 0.5 * (low + high))
    # the sine of a ray that is nearly vertical has few digits of its cosine: it misses by a part of its length
    return np.where(np.abs(x - r) <= 1e-9 * np.hypot(pieces.rise, r), sigma, np.nan)
