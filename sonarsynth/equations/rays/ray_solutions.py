"""Eigenrays in horizontally layered water: the rays that join two points, found completely and to rounding.

Sound speed is linear between nodes; two nodes at one depth are a jump, taken as the limit of a thin layer (a ray turns
in it where the thin layer would turn it). Method: `ray_in_layer` (one layer), `ray_chain` (sums over layers),
`ray_families` (which sums), `ray_search` (their roots).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from sonarsynth.conventions import Floats, Ints

GOOD: Final = 0
COINCIDENT: Final = 1
CAUSTIC: Final = 2
PASSED: Final = 3
REASONS: Final[dict[int, str]] = {
    GOOD: "good",
    COINCIDENT: "the ends coincide: no direction, no finite amplitude",
    CAUSTIC: "near a caustic: 20 dB or more above spherical spreading, where ray theory overestimates",
    PASSED: "passed a caustic: its phase of a quarter period is not in the amplitude",
}
"""What the flag of a ray means."""

TOLERANCE = 1e-9  # m: ends this little outside the water are on its boundary


@dataclass(frozen=True, eq=False)
class Water:
    """Sound speed (m/s) at depths (m) from the surface to the bottom, linear between; two equal depths are a jump."""

    depth: Floats  # (node,) from 0 to the bottom
    speed: Floats  # (node,)


@dataclass(frozen=True, eq=False)
class Eigenrays:
    """Rays between pairs of points, sorted by pair, then by travel time. Sines of grazing angles: up positive."""

    pair: Ints  # (ray,)
    travel_time: Floats  # (ray,) s
    length: Floats  # (ray,) m
    slowness: Floats  # (ray,) s/m: p = cos(grazing angle)/c, the horizontal slowness
    start_sine: Floats  # (ray,) NaN for coincident ends
    end_sine: Floats  # (ray,)
    start_speed: Floats  # (ray,) m/s
    end_speed: Floats  # (ray,) m/s
    amplitude: Floats  # (ray,) 1/m: pressure at the end over that at 1 m from the start
    upper: Floats  # (ray,) m: depth of its upper vertex, a turning depth or 0 at the surface; NaN without one
    lower: Floats  # (ray,) m: depth of its lower vertex, a turning depth or that of the bottom; NaN without one
    surface: Ints  # (ray,) reflections from the surface
    bottom: Ints  # (ray,) reflections from the bottom
    turning: Ints  # (ray,) turning points
    caustics: Ints  # (ray,) caustics passed
    flag: Ints  # (ray,) see REASONS


def water(depth: Floats, speed: Floats, bottom_depth: float) -> Water:
    """The water down to the bottom (m) of a profile at nodes (m, m/s), constant beyond its ends.

    Raises ValueError for nodes that are not finite or not in order, for a speed or a bottom depth that is not positive.
    """
    z, c = np.asarray(depth, float), np.asarray(speed, float)
    if z.ndim == 1 == c.ndim:
        return _water(z.tobytes(), c.tobytes(), float(bottom_depth))
    raise ValueError("a profile needs as many speeds as depths, and one at least")


@lru_cache(maxsize=64)
def _water(depth: bytes, speed: bytes, bottom_depth: float) -> Water:
    """The same, cached: every batch of rays asks for it."""
    z, c = np.frombuffer(depth), np.frombuffer(speed)
    if z.shape != c.shape or len(z) == 0:
        raise ValueError("a profile needs as many speeds as depths, and one at least")
    if not (np.isfinite(z).all() and np.isfinite(c).all() and np.isfinite(bottom_depth)):
        raise ValueError("a profile and the bottom depth must be finite numbers")
    if (np.diff(z) < 0).any() or (c <= 0).any() or bottom_depth <= 0:
        raise ValueError("a profile needs depths that do not decrease, positive speeds and a bottom below the surface")
    inside = (z > 0) & (z < bottom_depth)
    at_surface, at_bottom = np.interp([0.0, bottom_depth], z, c)
    at_bottom = (
        c[np.searchsorted(z, bottom_depth)] if bottom_depth in z else at_bottom
    )  # a jump on the bottom: its upper side
    return Water(
        np.concatenate([[0.0], z[inside], [bottom_depth]]), np.concatenate([[at_surface], c[inside], [at_bottom]])
    )


def within(water: Water, depth: Floats, name: str) -> Floats:
    """Depths, those within rounding of surface or bottom put on it; raises ValueError naming the first one outside."""
    z = np.asarray(depth, float)
    bottom_depth = water.depth[-1]
    if z.size and z.min() >= 0.0 and z.max() <= bottom_depth:
        return z
    wrong = ~((z >= -TOLERANCE) & (z <= bottom_depth + TOLERANCE))
    if wrong.any():
        i = int(np.argmax(wrong))
        raise ValueError(f"{name} {i} at depth {z.flat[i]:g} m is not in the water, which is {bottom_depth:g} m deep")
    return np.asarray(np.clip(z, 0.0, bottom_depth))


def eigenrays(
    water: Water, start: Floats, end: Floats, distance: Floats, vertices: int = 1, reflections: int = 0
) -> Eigenrays:
    """All rays from depths start (pair,) to depths end (pair,) at horizontal distances (pair,), in m.

    vertices: most turning points and reflections together; reflections: most from surface and bottom together. The
    default is the direct family. A pair may have no ray (a shadow zone), one or several. Travel times are right to
    about 1e-15 of themselves, and the search is complete (`ray_search`). A ray that turns exactly at an end counts
    once; an end on a jump is on the side of the other end, on the lower one if both are level. Raises ValueError for
    ends outside the water, distances that are not finite or negative, and negative numbers of vertices.
    """
    from sonarsynth.equations.rays import ray_batches as kernels

    z1, z2, r = np.broadcast_arrays(
        within(water, start, "start"), within(water, end, "end"), np.asarray(distance, float)
    )
    z1, z2, r = (np.ascontiguousarray(a) for a in (z1, z2, r))
    if r.size and not 0.0 <= r.min() <= r.max() < np.inf:
        raise ValueError("horizontal distances must be finite and not negative")
    if vertices < 0 or reflections < 0:
        raise ValueError("the most vertices and reflections of a ray cannot be negative")
    pairs, rows, first = [], [], 0
    room = (1 + min(2 * vertices, 4)) * len(r) + 64
    while first < len(r):
        pair, out = np.empty(room, np.int64), np.empty((room, kernels.FIELDS))
        count, reached = kernels.rays_of_pairs(
            water.depth, water.speed, z1, z2, r, vertices, min(reflections, vertices), first, pair, out
        )
        pairs.append(pair[:count])
        rows.append(out[:count])
        room = 2 * room if reached == first else max(64, 2 * (1 + vertices) * (len(r) - reached))
        first = reached
    pair = pairs[0] if len(pairs) == 1 else np.concatenate([np.empty(0, np.int64), *pairs])
    values, counts = kernels.in_columns(
        rows[0] if len(rows) == 1 else np.concatenate([np.empty((0, kernels.FIELDS)), *rows])
    )
    return Eigenrays(pair, *values, *counts)


def mean_slowness(water: Water, start: Floats, end: Floats) -> Floats:
    """Mean of 1/c (s/m) over the depths between start (pair,) and end (pair,): one over the harmonic mean speed."""
    from sonarsynth.equations.rays import ray_batches as kernels

    z1, z2 = np.broadcast_arrays(within(water, start, "start"), within(water, end, "end"))
    out = np.empty(z1.shape)
    kernels.mean_slowness(water.depth, water.speed, np.ascontiguousarray(z1), np.ascontiguousarray(z2), out)
    return out
