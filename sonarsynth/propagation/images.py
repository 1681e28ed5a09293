"""Straight rays with reflections: each is straight in water mirrored at surface and bottom."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints, depth
from sonarsynth.equations.rays.ray_solutions import TOLERANCE
from sonarsynth.products import Paths


@dataclass(frozen=True, eq=False)
class Image:
    """A way from one depth to another by surface and bottom, unfolded."""

    surface: int
    bottom: int
    climb: Floats  # (pair,) m: height that the unfolded ray gains, up positive, so that it starts in its direction
    turns: float  # -1 where it arrives with the vertical sense opposite to that in which it starts, else 1
    above: Floats  # (pair,) m that it crosses above the ends, between them and below them
    between: Floats
    below: Floats


def images(start: Floats, end: Floats, bottom_depth: float, bounces: int) -> list[Image]:
    """All paths from depths start to depths end (pair,) with at most `bounces` reflections; the straight one first."""
    climb, none = np.asarray(start - end, float), np.zeros(1)
    paths = [Image(0, 0, climb, 1.0, none, np.abs(climb), none)]
    if not bounces:
        return paths
    top, bottom = np.minimum(start, end), np.maximum(start, end)
    for n in range(1, bounces + 1):
        for down in (True, False):
            below = (n + 1) // 2 if down else n // 2
            surface = n - below
            towards = (start <= end) == down  # launched towards the depth of the other end
            passes = np.where(towards, 2 * (n // 2) + 1, 2 * ((n - 1) // 2) + 1)
            climbs = (2.0 * surface * top, passes * (bottom - top), 2.0 * below * (bottom_depth - bottom))
            climb = np.asarray((-1.0 if down else 1.0) * sum(climbs), float)
            paths.append(Image(surface, below, climb, 1.0 - 2.0 * (n % 2), *climbs))
    return paths


def lengths(start: Floats, end: Floats, bottom_depth: float, bounces: int) -> Floats:
    """Lengths (family, pair) m of all of `images` between points (pair, xyz) of the world."""
    x, y, z = (end - start).T
    ways = images(depth(start), depth(end), bottom_depth, bounces)[1:] if bounces else []
    return np.array([np.sqrt(x * x + y * y + climb * climb) for climb in (z, *(way.climb for way in ways))])


def family(surface: Ints, bottom: Ints, falls: Bools) -> Ints:
    """Which of `images` rays (ray,) are, by their reflections; falls: whether each that has as many from the surface as
    from the bottom starts, and arrives, downwards."""
    bounces = surface + bottom
    down = np.where(bounces % 2 == 1, bottom > surface, falls)
    return np.asarray(np.maximum(2 * bounces - down, 0))


def boundary_at(depth: float, bottom_depth: float) -> str:
    """Which boundary a point at a depth (m) lies on: surface, bottom, or neither ("")."""
    at_surface, at_bottom = abs(depth) <= TOLERANCE, abs(depth - bottom_depth) <= TOLERANCE
    return "bottom" if at_bottom else "surface" if at_surface else ""


def with_own_images(paths: Paths, source_depth: float, bottom_depth: float) -> tuple[Paths, Ints | slice]:
    """Paths from a source and, where it lies on a boundary, from its image there: each that leaves into the water, then
    the one that is reflected at the source first. And which of the given ones (path,) each is, or goes along with.

    The two are one place: ways of the image are followed as far as those of the source, with one reflection more. Those
    that `paths` have of it lack the last, and are left out. Depths in m.
    """
    own = boundary_at(source_depth, bottom_depth)
    if not own:
        return paths, slice(None)
    climb = paths.departure[:, 2] if own == "bottom" else -paths.departure[:, 2]
    leaves = (climb > 0.0) | ((climb == 0.0) & (getattr(paths, own) == 0))  # level ones go along the boundary
    along = np.repeat(np.flatnonzero(leaves), 2)
    both, image = paths.select(along), np.arange(len(along)) % 2 == 1
    x, y, z = both.departure.T
    grazing = np.where(image, np.arctan2(np.abs(z), np.hypot(x, y)), getattr(both, f"{own}_grazing"))
    departure = np.column_stack([x, y, np.where(image, -z, z)])
    return both.but(departure=departure, **{own: getattr(both, own) + image, f"{own}_grazing": grazing}), along
