"""Rays in stiff and extreme water, against circles, images, Snell and Fermat.

In one gradient g rays are the geodesics of hyperbolic space with the metric ds/c: between points d apart with sound
speeds c1, c2 the travel time is t = (2/g) asinh(g d/(2 sqrt(c1 c2))), spheres of travel time have the area
4 pi (sinh(g t)/g)^2, and so the amplitude is g/(sqrt(c1 c2) sinh(g t)): both hold for g = 0.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import minimize_scalar

from sonarsynth.conventions import Floats
from sonarsynth.equations.rays import ray_solutions
from sonarsynth.validation.extremes.outcomes import Case, CaseResult, holds, off, relative, together

if TYPE_CHECKING:
    from sonarsynth.equations.rays.ray_solutions import Eigenrays

C = 1500.0


def found(
    depth: tuple[float, ...],
    speed: tuple[float, ...],
    ends: tuple[float, float, float],
    vertices: int = 1,
    hits: int = 0,
) -> Eigenrays:
    """Rays between the ends (depth, depth, distance; m) in water down to the last node."""
    water = ray_solutions.water(np.array(depth), np.array(speed), depth[-1])
    start, end, distance = (np.array([x]) for x in ends)
    return ray_solutions.eigenrays(water, start, end, distance, vertices, hits)


def circle(g: float, start_speed: float, end_speed: float, distance: float) -> tuple[float, float]:
    """Travel time (s) and amplitude (1/m) of the ray that joins two points of sound speeds (m/s), d (m) apart."""
    mean = np.sqrt(start_speed * end_speed)
    half = np.arcsinh(g * distance / (2.0 * mean)) if g else 0.0
    time = 2.0 * half / g if g else distance / mean
    return float(time), float(g / (mean * np.sinh(2.0 * half)) if g else 1.0 / (mean * time))


def _gradients() -> CaseResult:
    results = []
    for g in (0.0, *(sign * 10.0**k for k in range(-12, 5) for sign in (1.0, -1.0))):
        bottom = min(1e3, 800.0 / abs(g)) if g else 1e3
        for a, b, share in ((0.4, 0.6, 0.1), (0.6, 0.4, 0.3), (0.5, 0.5, 0.2)):
            ends = (a * bottom, b * bottom, share * bottom)
            rays = found((0.0, bottom), (C, C + g * bottom), ends)
            exact = circle(g, C + g * ends[0], C + g * ends[1], float(np.hypot(ends[2], ends[1] - ends[0])))
            if not len(rays.pair):
                return CaseResult(f"no ray for {g:g} /s", False)
            errors = rays.travel_time[0] / exact[0] - 1.0, rays.amplitude[0] / exact[1] - 1.0
            results.append((off(errors[0], 1e-14, what="time"), off(errors[1], 1e-11, what="amplitude")))
    return together(*(tuple(result[i] for result in results) for i in (0, 1)))


def _snell(heights: Floats, speeds: Floats, distance: float) -> float:
    """Travel time (s) through layers of one speed each: the least over the slowness, which bisection finds."""
    low, high = 0.0, 1.0 / float(speeds.max())
    for _ in range(200):
        p = 0.5 * (low + high)
        cosine = np.sqrt(np.maximum((1.0 - p * speeds) * (1.0 + p * speeds), 1e-300))
        low, high = (low, p) if float((heights * p * speeds / cosine).sum()) > distance else (p, high)
    # Legendre: T = p x + sum h sqrt(1/c^2 - p^2), stationary in p
    return float(p * distance + (heights * np.sqrt((1.0 - p * speeds) * (1.0 + p * speeds)) / speeds).sum())


def _layers() -> CaseResult:
    def errors(speeds: Floats) -> list[CaseResult]:
        out = []
        for thick in (1e-6, 1e-3, 1.0, 1e3, 1e4):
            top, below = 200.0, 300.0
            z = (0.0, top, top, top + thick, top + thick, top + thick + below)
            heights = np.array([50.0, thick, 120.0])
            for share in (1e-3, 0.3, 1.0):
                distance = share * float(heights.sum())
                rays = found(z, tuple(np.repeat(speeds, 2)), (top - 50.0, top + thick + 120.0, distance))
                out.append(relative(rays.travel_time[:1], [_snell(heights, speeds, distance)], 1e-13))
        return out

    return together(errors(np.array([C, 1480.0, 1530.0])), errors(np.array([C, 1700.0, 1495.0])))


def _fermat(z: float, bottom: float, speeds: tuple[float, float, float], ends: tuple[float, float, float]) -> float:
    """Least travel time (s) through a kink at depth z: two arcs that meet there, at the place that takes least."""
    above, below = (speeds[1] - speeds[0]) / z, (speeds[2] - speeds[1]) / (bottom - z)
    start, end = speeds[0] + above * ends[0], speeds[1] + below * (ends[1] - z)

    def time(x: float) -> float:
        upper = circle(above, start, speeds[1], float(np.hypot(x, z - ends[0])))[0]
        return upper + circle(below, speeds[1], end, float(np.hypot(ends[2] - x, ends[1] - z)))[0]

    return float(minimize_scalar(time, bounds=(0.0, ends[2]), method="bounded", options={"xatol": 1e-9}).fun)


def _kinks() -> CaseResult:
    results = []
    for speeds in ((1540.0, 1500.0, 1530.0), (1480.0, 1520.0, 1490.0), (1500.0, 1500.0, 1900.0)):
        for distance in (1.0, 30.0, 90.0):
            ends = (12.0, 71.0, distance)
            rays = found((0.0, 40.0, 100.0), speeds, ends)
            results.append(off(np.abs(rays.travel_time / _fermat(40.0, 100.0, speeds, ends) - 1.0).min(), 1e-13))
    return together(results)


def _interfaces() -> CaseResult:
    z, results = (0.0, 30.0, 30.0, 80.0), []
    for speeds in ((C, C, 1540.0, 1540.0), (1540.0, 1540.0, C, C)):
        for start, end in ((30.0, 60.0), (60.0, 30.0), (30.0, 10.0), (10.0, 30.0), (0.0, 30.0), (30.0, 80.0)):
            for distance in (0.0, 1e-3, 12.0):
                rays = found(z, speeds, (start, end, distance))
                speed = speeds[0] if min(start, end) < 30.0 else speeds[2]
                exact = np.hypot(distance, start - end) / speed
                results.append(off(rays.travel_time[:1] / exact - 1.0, 1e-14))
    return together(results)


def _vertical() -> CaseResult:
    rays = found((0.0, 100.0, 300.0), (1540.0, C, 1560.0), (10.0, 250.0, 0.0), 3, 3)
    exact = 90.0 / 40.0 * np.log(1536.0 / C) * 100.0 / 90.0 + 200.0 / 60.0 * np.log(1545.0 / C)
    straight = np.all(rays.slowness == 0.0) and np.all(np.abs(rays.start_sine) == 1.0)
    return together(
        relative(rays.travel_time[:1], [exact], 1e-14, "time"),
        holds(straight and np.isfinite(rays.amplitude).all(), f"{len(rays.pair)} rays, all of sine +-1"),
    )


def _horizontal() -> CaseResult:
    level = found((0.0, 100.0), (C, C), (40.0, 40.0, 700.0))
    axis = found((0.0, 40.0, 100.0), (1520.0, C, 1530.0), (40.0, 40.0, 7.0))
    arcs = [circle(g, C, C, 7.0)[0] for g in (-0.5, 0.5)]
    return together(
        relative(level.travel_time, [700.0 / C], 1e-15, "level"),
        holds(bool((level.start_sine == 0.0).all()), "its sine is 0"),
        relative(np.sort(axis.travel_time), np.sort(arcs), 1e-14, "on an axis, an arc above and one below:"),
    )


def _turning() -> CaseResult:
    """Speed falls with depth: the circle that touches the surface is centred where it would be 0, R down."""
    g, bottom, z = 0.3, 100.0, 40.0
    R = C / g
    limit = 2.0 * np.sqrt(z * (2.0 * R - z))
    counts, times = [], []
    for step in (-1e-6, -1e-9, 0.0, 1e-9, 1e-6):
        rays = found((0.0, bottom), (C, C - g * bottom), (z, z, limit * (1.0 + step)), 1, 1)
        near = rays.upper < 1.0
        counts.append(int(near.sum()))
        exact = circle(g, C - g * z, C - g * z, limit * (1.0 + step))[0]
        turned = near & (rays.turning == 1)
        times += [off(rays.travel_time[turned] / exact - 1.0, 1e-13)] if turned.any() else []
    sane = counts[0] == counts[1] == 2 and counts[2] in (0, 1, 2) and counts[3] == counts[4] == 0
    return together(holds(sane, f"{counts} rays by the surface"), times)


def _coincident() -> CaseResult:
    results = []
    for z in (0.0, 20.0, 50.0):
        rays = found((0.0, 50.0), (C, C), (z, z, 0.0), 2, 2)
        same = rays.flag == ray_solutions.COINCIDENT
        flagged = same.sum() == 1 and np.isnan(rays.start_sine[same]).all() and np.isinf(rays.amplitude[same]).all()
        results.append(
            holds(
                flagged and ray_solutions.REASONS[ray_solutions.COINCIDENT].startswith("the ends"),
                "flagged once, no direction",
            )
        )
        images = sorted(x for x in (2.0 * z, 2.0 * (50.0 - z), 100.0, 100.0) if x > 0)
        results.append(relative(rays.travel_time[~same] * C, images, 1e-14, "its images"))
    return together(results)


def _ranges() -> CaseResult:
    results = []
    for depth, a, b in ((100.0, 31.0, 62.0), (5000.0, 800.0, 4200.0)):
        for distance in (0.0, 1e-3, 1.0, 1e3, 1e5):
            rays = found((0.0, depth), (C, C), (a, b, distance), 2, 2)
            climbs = np.array([a - b, a + b, 2 * depth - a - b, 2 * depth + a - b, 2 * depth - a + b])
            exact = np.sort(np.hypot(climbs, distance)) / C
            results.append(relative(rays.travel_time, exact, 1e-15))
            results.append(relative(rays.amplitude, 1.0 / (C * exact), 1e-12))
    far = found((0.0, 3000.0), (C, C + 3.0), (1500.0, 2000.0, 1e5))
    arc = circle(1e-3, C + 1.5, C + 2.0, float(np.hypot(1e5, 500.0)))
    bent = relative(far.travel_time, [arc[0]], 1e-14, "bent over 100 km: time")
    return together(results, bent, relative(far.amplitude, [arc[1]], 1e-10, "amplitude"))


FOLD = 30.0, 10.0, 18.0, 0.5
"""Depth (m) of the foot of a uniform layer, two points in it, and the gradient below (1/s)."""


def _caustic() -> CaseResult:
    """Down through the uniform layer and back: X = H/u + 2 (c/g) u, u the tangent of the angle; least at a fold."""
    foot, a, b, g = FOLD
    H, bend = 2.0 * foot - a - b, 2.0 * C / g
    fold = 2.0 * np.sqrt(H * bend)
    results, loud = [], []
    for step in (1e-2, 1e-4, 1e-8):
        X = fold * (1.0 + step)
        root = np.sqrt(X * X - fold * fold)
        u = np.array([(X + root) / (2.0 * bend), 2.0 * H / (X + root)])
        times = np.sort(H / C * np.hypot(1.0, u) / u + 2.0 / g * np.arctanh(u / np.hypot(1.0, u)))
        rays = found((0.0, foot, 400.0), (C, C, C + g * (400.0 - foot)), (a, b, X))
        turned = rays.turning == 1
        dark = found((0.0, foot, 400.0), (C, C, C + g * (400.0 - foot)), (a, b, fold * (1.0 - step)))
        results.append(relative(np.sort(rays.travel_time[turned]), times, 1e-13, "two rays, times"))
        results.append(holds(sorted(rays.caustics[turned]) == [0, 1], "one has passed the caustic"))
        results.append(holds(not (dark.turning == 1).any(), "none on the dark side"))
        loud.append(rays.amplitude[turned].mean())
        flags = rays.flag[turned]
    named = holds(
        bool((flags == ray_solutions.CAUSTIC).all()) and np.isfinite(loud).all(), "finite and flagged beside it"
    )
    return together(results, named, off(np.diff(np.log10(loud)) - [0.5, 1.0], 0.03, "decades", "growth as step^-1/4"))


def _shadow() -> CaseResult:
    """The last ray into depth touches the surface: two arcs of the same circle; beyond, none."""
    g, bottom, a, b = 0.3, 100.0, 40.0, 30.0
    limit = sum(np.sqrt(z * (2.0 * C / g - z)) for z in (a, b))
    lit, dark = (found((0.0, bottom), (C, C - g * bottom), (a, b, limit * (1.0 + s)), 3, 0) for s in (-1e-7, 1e-7))
    exact = circle(g, C - g * a, C - g * b, float(np.hypot(limit * (1.0 - 1e-7), a - b)))[0]
    near = off(np.abs(lit.travel_time / exact - 1.0).min() if len(lit.pair) else np.nan, 1e-13, what="last ray")
    return together(near, holds(len(dark.pair) == 0, "no ray 1e-7 beyond"))


def _deep() -> CaseResult:
    g, bottom, results = 0.0163, 11e3, []
    for a, b, distance in ((0.0, bottom, 0.0), (0.0, bottom, 100.0), (10.0, 10.9e3, 8e3), (bottom, 0.0, 1e4)):
        rays = found((0.0, bottom), (C, C + g * bottom), (a, b, distance))
        arc = circle(g, C + g * a, C + g * b, float(np.hypot(distance, a - b)))
        results += [relative(rays.travel_time[:1], arc[:1], 1e-14), relative(rays.amplitude[:1], arc[1:], 1e-11)]
    return together(results)


CIRCLES = "time to 1e-14 and amplitude to 1e-11 of the circle through both ends"
CASES = (
    Case("gradients of 0, +-1e-12 to +-1e4 /s", CIRCLES, _gradients),
    Case("layers of 1 um to 10 km, with jumps", "time by Snell's law, to 1e-13", _layers),
    Case("kinks", "the least time over where two arcs meet, to 1e-13", _kinks),
    Case("source or sensor on an interface", "straight on the side of the other end, to 1e-14", _interfaces),
    Case("exactly vertical rays", "time by logarithms of speeds, to 1e-14; sines of 1", _vertical),
    Case("exactly horizontal rays", "level where uniform; both arcs on an axis; to 1e-14", _horizontal),
    Case("rays turning exactly at the surface", "turned and reflected just short of it, none beyond", _turning),
    Case("source = receiver", "flagged with a reason; images at their distances", _coincident),
    Case("ranges of 0, 1 mm to 100 km", "images, to 1e-15; a bent one on its circle", _ranges),
    Case("a caustic", "both roots of the closed form, flagged near it; none on the dark side", _caustic),
    Case("a shadow zone", "a ray up to the circle that touches the surface, none beyond", _shadow),
    Case("11 km deep", CIRCLES, _deep),
)
