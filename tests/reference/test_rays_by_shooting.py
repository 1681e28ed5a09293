"""Eigenrays against rays shot by an integrator of differential equations, and caustics against ray tubes in time."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.rays import ray_solutions
from tests.ray_paths import random_water


def along(
    water: ray_solutions.Water, z: float, sine: float, p: np.longdouble, times: Floats
) -> tuple[Floats, Floats, Floats, Ints]:
    """Position (x, z), sine (down positive) and number of reflections at times of a ray: in each layer
    sine(t) = tanh(artanh(sine) - g t) (from d(sine)/dt = -g cos^2), all else by Snell's law. Long doubles.
    """
    depth, speed = water.depth.astype(np.longdouble), water.speed.astype(np.longdouble)
    x, clock, hits, w = np.longdouble(0), np.longdouble(0), 0, np.longdouble(sine)
    i = int(np.searchsorted(depth, z, "right" if sine > 0 else "left")) - 1
    out = np.full((3, len(times)), np.nan, np.longdouble)
    count = np.zeros(len(times), int)
    z = np.longdouble(z)
    while clock < times[-1]:
        thickness = depth[i + 1] - depth[i]
        if thickness == 0:
            beyond = 1 - (p * speed[i + 1 if w > 0 else i]) ** 2
            w = np.copysign(np.sqrt(beyond), w) if beyond > 0 else -w
            i += 1 if w > 0 else -1
            continue
        g = (speed[i + 1] - speed[i]) / thickness
        down = w > 0
        square = 1 - (p * speed[i + 1 if down else i]) ** 2
        turns = square <= 0
        down = down != turns
        after = np.sqrt(square) if not turns else np.sqrt(max(1 - (p * speed[i + 1 if down else i]) ** 2, 0))
        after = after if down else -after
        edge = depth[i + 1] if down else depth[i]
        last = (np.arctanh(w) - np.arctanh(after)) / g if g else (edge - z) / (w * speed[i])
        here = (times >= clock) & (times <= clock + last)
        t = times[here] - clock
        v = np.tanh(np.arctanh(w) - g * t) if g else np.full(len(t), w)
        out[0, here] = x + ((w - v) / (p * g) if g else p * speed[i] ** 2 * t)
        out[1, here] = z + (
            (np.sqrt((1 - v) * (1 + v)) - np.sqrt((1 - w) * (1 + w))) / (p * g) if g else w * speed[i] * t
        )
        out[2, here], count[here] = v, hits
        x += (w - after) / (p * g) if g else p * speed[i] ** 2 * last
        clock, z, w = clock + last, edge, after
        i += 1 if down else -1
        if not 0 <= i < len(depth) - 1:
            hits, w, i = hits + 1, -w, min(max(i, 0), len(depth) - 2)
    return out[0], out[1], out[2], count


@pytest.mark.parametrize(("layers", "spread", "seed"), [(3, 5.0, 1), (6, 10.0, 2), (9, 20.0, 3)])
def test_caustics_are_where_the_ray_tube_has_no_width(layers: int, spread: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    several = seen = 0
    for _ in range(6):
        water = random_water(rng, layers, spread)
        start, end = rng.uniform(0, 100, (2, 4))
        found = ray_solutions.eigenrays(water, start, end, 10 ** rng.uniform(2, 3.7, 4), 6, 3)
        for i in np.flatnonzero((found.turning > 0) & (found.flag != ray_solutions.CAUSTIC))[:12]:
            times = np.linspace(0, found.travel_time[i], 6001)[1:].astype(np.longdouble)
            c = np.longdouble(found.start_speed[i])
            angle = np.arctan2(-found.start_sine[i], np.cos(np.arcsin(found.start_sine[i]))).astype(np.longdouble)
            tube = []
            for tilt in (0, 1e-10):
                sine, p = np.sin(angle + tilt), np.cos(angle + tilt) / c
                tube.append(along(water, float(start[found.pair[i]]), sine, p, times))
            (x, z, w, hits), (x2, z2, _, hits2) = tube
            same = (hits == hits2) & np.isfinite(x) & np.isfinite(x2)
            width = ((x2 - x) * w - (z2 - z) * np.sqrt((1 - w) * (1 + w))) * (-1.0) ** hits
            signs = np.sign(width[same])
            assert same.mean() > 0.99
            assert abs(z[same][-1] - end[found.pair[i]]) < 1e-3
            assert (signs[1:] != signs[:-1]).sum() == found.caustics[i]
            several += found.caustics[i] > 1
            seen += 1
    assert seen > 15
    assert several >= 1
