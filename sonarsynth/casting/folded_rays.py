"""Straight rays folded at surface and bottom, compiled: which bodies they pass, and narrow cones that hold them."""

from __future__ import annotations

import math

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Bools, Floats, Ints

WIDEST = 0.4
"""rad: rays that lie in no narrower cone lie in none."""


@compiled(borrows=True)
def _pass_near(
    start: Floats, end: Floats, up: bool, bounces: int, bottom: float, skip: float, centre: Floats, within: float
) -> bool:
    """Whether a straight ray from start to end (xyz) with bounces comes within so many m of a point; arguments as of
    `may_meet`; skip: m along the ray from its start that do not count."""
    x0, y0, z0, n = start[0], start[1], start[2], bounces
    climb = end[2] - z0
    if n > 0:
        last_above = (n % 2 == 1) == up
        climb = (-z0 if up else bottom + z0) + (n - 1) * bottom + (-end[2] if last_above else bottom + end[2])
    dx, dy = end[0] - x0, end[1] - y0
    length = math.sqrt(dx * dx + dy * dy + climb * climb)
    done, z, sense = 0.0, z0, 1.0 if up or n == 0 else -1.0
    for k in range(n + 1):  # piece by piece between boundaries, fraction: of the whole path
        edge = 0.0 if sense > 0.0 else -bottom
        fraction = 1.0 if k == n or climb == 0.0 else min(done + abs(edge - z) / climb, 1.0)
        z_after = end[2] if k == n else edge
        first = max(done, min(fraction, skip / length if length > 0.0 else 1.0))
        if fraction > first or (k == n and first == done):
            along = (first - done) / (fraction - done) if fraction > done else 0.0
            ax, ay, az = x0 + first * dx, y0 + first * dy, z + along * (z_after - z)
            sx, sy, sz = (fraction - first) * dx, (fraction - first) * dy, z_after - az
            cx, cy, cz = centre[0] - ax, centre[1] - ay, centre[2] - az
            square = sx * sx + sy * sy + sz * sz
            t = min(max((cx * sx + cy * sy + cz * sz) / square, 0.0), 1.0) if square > 0.0 else 0.0
            ex, ey, ez = cx - t * sx, cy - t * sy, cz - t * sz
            if ex * ex + ey * ey + ez * ez <= within * within:
                return True
        done, z, sense = fraction, z_after, -sense
    return False


@compiled(borrows=True)
def _meets(
    start: Floats, end: Floats, up: bool, bounces: int, bottom: float, bow: float, centre: Floats, radius: Floats
) -> tuple[bool, float]:
    """`may_meet` of one ray."""
    far, first = False, 0.0
    for n in range(len(radius)):
        x, y, z = start[0] - centre[n, 0], start[1] - centre[n, 1], start[2] - centre[n, 2]
        leave = 2.0 * (radius[n] + bow) if math.sqrt(x * x + y * y + z * z) <= radius[n] else 0.0
        far = far or _pass_near(start, end, up, bounces, bottom, leave, centre[n], radius[n] + bow)
        first = max(first, leave)
    return far, first


@compiled
def may_meet(
    start: Floats, end: Floats, up: Bools, bounces: Ints, bottom: float, bow: Floats, centre: Floats, radius: Floats
) -> tuple[Bools, Floats]:
    """Which rays (ray,) may pass a body far from their start, and how far from it (m) others may still be in one.

    start, end (ray, xyz); up, bounces (ray,): how they leave, and their reflections from the surface z = 0 and the
    bottom z = -bottom (m); bow (ray,) m: how far they may be beside the straight line between their ends, unfolded;
    centre (body, xyz), radius (body,) m: of spheres about bodies.
    """
    far, first = np.empty(len(start), np.bool_), np.empty(len(start))
    for i in range(len(start)):
        far[i], first[i] = _meets(start[i], end[i], up[i], bounces[i], bottom, bow[i], centre, radius)
    return far, first


@compiled(borrows=True)
def _subtended(radius: float, distance: float) -> float:
    """Half of the angle (rad) that a ball is seen under; a right angle from within."""
    return math.asin(min(radius / max(distance, 1e-300), 1.0))


@compiled(borrows=True)
def _largest(upper: float, lower: float, node: Floats, curvature: Floats) -> float:
    """The largest curvature of layers that are met between two depths (m)."""
    largest = 0.0
    for k in range(max(int(np.searchsorted(node, upper)) - 1, 0), len(curvature)):
        if node[k] > lower:
            break
        largest = max(largest, curvature[k])
    return largest


@compiled
def ray_cones(
    start: Floats, end: Floats, departure: Floats, length: Floats, spread: Floats, bounces: Ints, turning: Ints,
    layers: tuple[Floats, Floats], sagitta: float, bottom: float, centre: Floats, radius: Floats,
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """Cones that hold rays and those beside them, as `occlusion.ray_cones.classify_rays` has them: slope, NaN where no
    cone is certain, and how far (m) along the departure bodies may be met, and surely would be if they close the cone,
    (ray,) each. layers: depths of their nodes (node,) m, and the largest curvature of rays in each (node - 1,) 1/m;
    sagitta (m): by how much chords may be beside rays; the rest as of `may_meet`."""
    curvature = 0.0
    for bend in layers[1]:
        curvature = max(curvature, bend)
    slope, reach, far = np.empty(len(start)), np.empty(len(start)), np.empty(len(start))
    for i in range(len(start)):
        longest, shortest, n, rise = length[i] + spread[i], length[i] - spread[i], bounces[i], departure[i, 2]
        wide = spread[i] + curvature * longest * longest / 8.0
        straight = n == 0 and curvature * shortest * shortest <= 8.0 * sagitta
        full, first = straight or (n > 0 and turning[i] > 0), 0.0
        if not full:
            full, first = _meets(start[i], end[i], rise > 0.0, n, bottom, wide, centre, radius)
        reach[i] = longest if full else min(first, longest)
        far[i] = 0.98 * (shortest if full else min(first - 2.0 * wide, shortest))
        angle = _subtended(spread[i], length[i]) + 0.5 * curvature * reach[i]
        if curvature > 0.0 and 0.0 < angle < WIDEST:  # of that cone, only the layers that it comes to bend rays
            aside, down = reach[i] * math.tan(angle), -reach[i] * rise
            upper, lower = -start[i, 2] + min(down, 0.0) - aside, -start[i, 2] + max(down, 0.0) + aside
            angle += 0.5 * reach[i] * (_largest(upper, lower, *layers) - curvature)
        if full:  # the line from end to end is in it as well
            x, y, z = end[i, 0] - start[i, 0], end[i, 1] - start[i, 1], end[i, 2] - start[i, 2]
            distance = math.sqrt(x * x + y * y + z * z)
            cx, cy = departure[i, 1] * z - rise * y, rise * x - departure[i, 0] * z
            cz = departure[i, 0] * y - departure[i, 1] * x
            off = math.sqrt(cx * cx + cy * cy + cz * cz)
            angle = max(angle, _subtended(off, distance) + _subtended(spread[i], distance))
        slope[i] = 1.02 * math.tan(min(angle, 0.5)) + 2e-5  # more than what casting may err by
        room = -start[i, 2] if rise > 0.0 else bottom + start[i, 2]
        bounced = n > 0 and (full or reach[i] * (abs(rise) + slope[i]) >= room or abs(rise) <= slope[i])
        if bounced or not angle <= WIDEST:
            slope[i] = math.nan
    return slope, reach, far
