"""Straight rays with reflections: each is straight in water mirrored at surface and bottom."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints, depth


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
