"""Triangles cut along the edges of a view in azimuth and elevation.

The azimuths within +-a, a < 90 degrees, are between two planes through the z axis: s = x sin a -+ y cos a >= 0. The
elevations within +-e are outside two cones: s = hypot(x, y) sin e -+ z cos e >= 0. Along an edge s is linear for a
plane and convex for a cone, so that an edge with both ends out of view has no part in it.
"""

from __future__ import annotations

import math

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Bools, Floats, Ints

SIDES = 4
MOST = 3 + 2 * SIDES
"""Corners of a triangle cut four times, and room to spare."""
HALVINGS = 60


@compiled
def depth_in_view(p: Floats, side: int, half: Floats) -> float:
    """How far (m) a point (xyz) is on the inner side of one of the four edges of a view; half: sines and cosines."""
    if side < 2:
        return float(p[0] * half[0] + (1 - 2 * side) * p[1] * half[1])
    return float(math.sqrt(p[0] * p[0] + p[1] * p[1]) * half[2] + (5 - 2 * side) * p[2] * half[3])


@compiled
def cross(a: Floats, b: Floats, side: int, half: Floats, out: Floats) -> None:
    """Where the edge from a, in view, to b, out of it, leaves."""
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        for i in range(3):
            out[i] = a[i] + middle * (b[i] - a[i])
        if depth_in_view(out, side, half) >= 0.0:
            low = middle
        else:
            high = middle


@compiled
def cut(corner: Floats, count: int, side: int, half: Floats, clipped: Floats) -> int:
    """The part (corner, xyz) of a polygon on the inner side of one edge of the view: how many corners."""
    size = 0
    for i in range(count):
        a, b = corner[i], corner[(i + 1) % count]
        a_in = depth_in_view(a, side, half) >= 0.0
        if a_in:
            clipped[size] = a
            size += 1
        if a_in != (depth_in_view(b, side, half) >= 0.0):
            if a_in:
                cross(a, b, side, half, clipped[size])
            else:
                cross(b, a, side, half, clipped[size])
            size += 1
    return size


@compiled
def widen(p: Floats, slopes: Floats) -> None:
    """Widen bounds (4,) on the tangents of azimuth and elevation by a point at x >= 0, but for rounding."""
    across, up = p[1] / abs(p[0]), p[2] / math.sqrt(p[0] * p[0] + p[1] * p[1])
    slopes[0], slopes[1] = min(slopes[0], across), max(slopes[1], across)
    slopes[2], slopes[3] = min(slopes[2], up), max(slopes[3], up)


@compiled
def steepest(points: Floats, a: int, b: int, out: Floats) -> bool:
    """The point between two of some (point, xyz) where the elevation of an edge is extreme, if there is one."""
    x, y, z = points[a, 0], points[a, 1], points[a, 2]
    d0, d1, d2 = points[b, 0] - x, points[b, 1] - y, points[b, 2] - z
    square, along, across = x * x + y * y, x * d0 + y * d1, d0 * d0 + d1 * d1
    rate, part = d2 * along - z * across, z * along - d2 * square
    if not (0.0 < part < rate or rate < part < 0.0):
        return False
    t = part / rate
    out[0], out[1], out[2] = x + t * d0, y + t * d1, z + t * d2
    return True


@compiled
def whole(corner: Floats, count: int, side: int, half: Floats) -> bool:
    """Whether all corners of a polygon are on the inner side of an edge of the view."""
    inner = True
    for i in range(count):
        inner &= depth_in_view(corner[i], side, half) >= 0.0
    return inner


@compiled
def bounds(corners: Floats, faces: Ints, azimuth: float, elevation: float, out: Floats) -> tuple[bool, bool]:
    """Bounds (4,) in azimuth and elevation (rad) of triangles (facet, 3) of points (vertex, xyz) within +-azimuth and
    +-elevation, in `out`; whether any part is in that view, and whether any is out of it."""
    half = np.array([np.sin(azimuth), np.cos(azimuth), np.sin(elevation), np.cos(elevation)])
    polygon, clipped, extreme = np.empty((MOST, 3)), np.empty((MOST, 3)), np.empty(3)
    slopes = np.array([np.inf, -np.inf, np.inf, -np.inf])
    inside, outside = False, False
    for f in range(len(faces)):
        for i in range(3):
            polygon[i] = corners[faces[f, i]]
        count = 3
        for side in range(SIDES):
            if whole(polygon, count, side, half):
                continue
            outside = True
            count = cut(polygon, count, side, half, clipped)
            polygon, clipped = clipped, polygon
        for i in range(count):
            inside = True
            widen(polygon[i], slopes)
            if steepest(polygon, i, (i + 1) % count, extreme):
                widen(extreme, slopes)
                outside |= depth_in_view(extreme, 2, half) < 0.0 or depth_in_view(extreme, 3, half) < 0.0
    for i in range(4):
        edge = azimuth if i < 2 else elevation
        out[i] = min(max(math.atan(slopes[i]), -edge), edge)
    return inside, outside


@compiled
def shows_outer_side(corners: Floats, a: int, b: int, c: int) -> bool:
    """Whether the origin sees the side of a triangle of points (vertex, xyz) on which a, b, c are counter-clockwise."""
    x = corners[a, 1] * corners[b, 2] - corners[a, 2] * corners[b, 1]
    y = corners[a, 2] * corners[b, 0] - corners[a, 0] * corners[b, 2]
    z = corners[a, 0] * corners[b, 1] - corners[a, 1] * corners[b, 0]
    return bool(corners[c, 0] * x + corners[c, 1] * y + corners[c, 2] * z < 0.0)


@compiled
def apart(points: Floats) -> bool:
    """Whether the origin is beside the box of some points (point, xyz); not where any is NaN."""
    for x in range(3):
        low, high = np.inf, -np.inf
        for n in range(len(points)):
            if math.isnan(points[n, x]):
                return False
            low, high = min(low, points[n, x]), max(high, points[n, x])
        if low >= 0.0 or high <= 0.0:
            return True
    return False


@compiled
def boxes_ahead(corners: Floats, faces: Ints, outside: bool, boxes: Floats) -> None:
    """Write bounds (facet, 4) in azimuth and elevation (rad) of the part of each triangle (facet, 3) of points (vertex,
    xyz) that is ahead, x > 0; NaN where none is, or a corner is NaN, or, `outside`, its outer side is not seen."""
    seen, extreme = np.full((len(corners), 2), np.nan), np.empty(3)
    for f in range(len(faces)):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        if outside and not shows_outer_side(corners, i, j, k):
            boxes[f, 0] = boxes[f, 1] = boxes[f, 2] = boxes[f, 3] = np.nan
            continue
        for v in (i, j, k):
            if math.isnan(seen[v, 0]):
                x, y, z = corners[v, 0], corners[v, 1], corners[v, 2]
                seen[v, 0], seen[v, 1] = math.atan(y / abs(x)), math.atan(z / math.sqrt(x * x + y * y))
        if not (corners[i, 0] > 0.0 and corners[j, 0] > 0.0 and corners[k, 0] > 0.0):
            box_of_part_ahead(corners, faces[f], boxes[f])
            continue
        low, high = min(seen[i, 1], seen[j, 1], seen[k, 1]), max(seen[i, 1], seen[j, 1], seen[k, 1])
        for a, b in ((i, j), (j, k), (k, i)):
            if steepest(corners, a, b, extreme):
                up = math.atan(extreme[2] / math.hypot(extreme[0], extreme[1]))
                low, high = min(low, up), max(high, up)
        boxes[f, 0], boxes[f, 1] = min(seen[i, 0], seen[j, 0], seen[k, 0]), max(seen[i, 0], seen[j, 0], seen[k, 0])
        boxes[f, 2], boxes[f, 3] = low, high


@compiled
def box_of_part_ahead(corners: Floats, face: Ints, box: Floats) -> None:
    """As `boxes_ahead`, of one facet (3,) that is not ahead as a whole."""
    polygon, clipped, extreme = corners[face], np.empty((MOST, 3)), np.empty(3)
    count = cut(polygon, 3, 0, np.array([1.0, 0.0]), clipped) if np.isfinite(polygon).all() else 0
    slopes, furthest = np.array([np.inf, -np.inf, np.inf, -np.inf]), 0.0
    for i in range(count):
        furthest = max(furthest, clipped[i, 0])
        widen(clipped[i], slopes)
        if steepest(clipped, i, (i + 1) % count, extreme):
            widen(extreme, slopes)
    for i in range(4):
        box[i] = math.atan(slopes[i]) if furthest > 0.0 else np.nan


@compiled
def bounds_of_whole(boxes: Floats, azimuth: float, elevation: float, inner: Bools, out: Floats) -> None:
    """Bounds (4,) of those of boxes (facet, 4) that are wholly within +-azimuth and +-elevation, in `out`: NaN of
    none; and write which."""
    low, high, lowest, highest = np.inf, -np.inf, np.inf, -np.inf
    for f in range(len(boxes)):
        a, b, c, d = boxes[f, 0], boxes[f, 1], boxes[f, 2], boxes[f, 3]
        inner[f] = a >= -azimuth and b <= azimuth and c >= -elevation and d <= elevation  # none is where they are NaN
        if inner[f]:
            low, high, lowest, highest = min(low, a), max(high, b), min(lowest, c), max(highest, d)
    out[0], out[1], out[2], out[3] = low, high, lowest, highest
    if not low <= high:
        out[:] = np.nan


@compiled
def under_arc(a: Floats, b: Floats) -> float:
    """Signed solid angle between the horizon and the arc of directions from a to b (xyz): the integral of the sine of
    elevation over azimuth."""
    level_a, level_b = math.hypot(a[0], a[1]), math.hypot(b[0], b[1])
    turn = math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])
    if turn == 0.0:
        return 0.0
    low = a[2] / (level_a + math.hypot(level_a, a[2]))  # tangent of half the elevation
    high = b[2] / (level_b + math.hypot(level_b, b[2]))
    return float(2.0 * math.atan(math.tan(0.5 * turn) * (low + high) / (1.0 + low * high)))


@compiled
def under_edge(a: Floats, b: Floats, half: Floats, ends: Floats) -> float:
    """As `under_arc`, of the part of an edge from a to b whose elevation is in view, and of the view's edge where that
    of a to b is beyond; half: as of `depth_in_view`."""
    square_sine, square_cosine = half[2] * half[2], half[3] * half[3]
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    # where the line meets the two cones: p t^2 + 2 q t + r = 0
    p = square_cosine * dz * dz - square_sine * (dx * dx + dy * dy)
    q = square_cosine * a[2] * dz - square_sine * (a[0] * dx + a[1] * dy)
    r = square_cosine * a[2] * a[2] - square_sine * (a[0] * a[0] + a[1] * a[1])
    t1, t2, discriminant = 1.0, 1.0, q * q - p * r
    if discriminant > 0.0:
        large = -(q + math.copysign(math.sqrt(discriminant), q))
        t1 = large / p if p != 0.0 else 1.0
        t2 = r / large if large != 0.0 else 1.0
    first, second = min(max(min(t1, t2), 0.0), 1.0), min(max(t1, t2, 0.0), 1.0)
    total, start = 0.0, 0.0
    for stop in (first, second, 1.0):
        if stop > start:
            for i in range(3):
                ends[0, i], ends[1, i] = a[i] + start * (b[i] - a[i]), a[i] + stop * (b[i] - a[i])
                ends[2, i] = 0.5 * (ends[0, i] + ends[1, i])
            if depth_in_view(ends[2], 2, half) >= 0.0 and depth_in_view(ends[2], 3, half) >= 0.0:
                total += under_arc(ends[0], ends[1])
            else:
                turn = math.atan2(
                    ends[0, 0] * ends[1, 1] - ends[0, 1] * ends[1, 0], ends[0, 0] * ends[1, 0] + ends[0, 1] * ends[1, 1]
                )
                total += math.copysign(half[2], ends[2, 2]) * turn
            start = stop
    return total


@compiled
def solid_angles(corners: Floats, faces: Ints, azimuth: float, elevation: float) -> tuple[float, float]:
    """Sums of the solid angles (sr) of triangles (facet, 3) of points (vertex, xyz) within +-azimuth and +-elevation,
    and of them whole. Source of the latter: Van Oosterom & Strackee (1983), IEEE Trans. Biomed. Eng. 30, 125, eq. 8."""
    half = np.array([np.sin(azimuth), np.cos(azimuth), np.sin(elevation), np.cos(elevation)])
    polygon, clipped, ends = np.empty((MOST, 3)), np.empty((MOST, 3)), np.empty((3, 3))
    inside, every = 0.0, 0.0
    for f in range(len(faces)):
        for i in range(3):
            polygon[i] = corners[faces[f, i]] / np.linalg.norm(corners[faces[f, i]])
        a, b, c = polygon[0], polygon[1], polygon[2]
        normal = np.array([b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]])
        triple, cosines = abs(a @ normal), 1.0 + a @ b + b @ c + c @ a
        every += 2.0 * math.atan2(triple, cosines)
        count = 3
        for side in range(2):
            if not whole(polygon, count, side, half):
                count = cut(polygon, count, side, half, clipped)
                polygon, clipped = clipped, polygon
        area = 0.0
        for i in range(count):
            area += under_edge(polygon[i], polygon[(i + 1) % count], half, ends)
        inside += abs(area)
    return inside, every
