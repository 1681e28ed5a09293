"""Eigenrays against rays shot by an integrator of differential equations, and caustics against ray tubes in time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.rays import ray_solutions
from tests.following import random_water


def munk(depth: Floats) -> Floats:
    """Munk (1974): the canonical deep channel."""
    scaled = 2 * (depth - 1300.0) / 1300.0
    return 1500.0 * (1 + 0.00737 * (scaled - 1 + np.exp(-scaled)))


def thermocline(depth: Floats) -> Floats:
    return 1540.0 - 2.5 * (1 + np.tanh((depth - 12.0) / 2.0)) + 0.016 * depth


def duct(depth: Floats) -> Floats:
    return 1500.0 + 0.02 * depth - 4.0 * np.exp(-(((depth - 60.0) / 15.0) ** 2))


def tabulated(profile: Callable[[Floats], Floats], bottom_depth: float, count: int) -> ray_solutions.Water:
    depth = np.linspace(0, bottom_depth, count)
    return ray_solutions.water(depth, profile(depth), bottom_depth)


def event(of: Callable[[Floats], float], direction: int, terminal: bool) -> Callable[[float, Floats], float]:
    def watch(_: float, y: Floats) -> float:
        return of(y)

    watch.direction, watch.terminal = direction, terminal  # type: ignore[attr-defined]
    return watch


def within_layer(
    state: Floats, top: float, low: float, c1: float, c2: float, end: float, final: bool, turns: bool
) -> tuple[int, Floats]:
    """Integrate x, z, angle (down positive), time, length to the next event: 0 top, 1 low, 2 turned, 3 at the end."""
    gradient = (c2 - c1) / (low - top)

    def motion(_: float, y: Floats) -> list[float]:
        c, cosine, sine = c1 + gradient * (y[1] - top), np.cos(y[2]), np.sin(y[2])
        return [cosine, sine, -gradient * cosine / c, 1 / c]

    watched = [event(lambda y: y[1] - top, -1, True), event(lambda y: y[1] - low, 1, True)]
    watched += [event(lambda y: y[2], 0, True)] if turns else [event(lambda _: 1.0, 0, False)]
    watched += [event(lambda y: y[1] - end, 0, True)] if final and state[1] != end else []
    scale = 0.2 * (low - top) / max(abs(np.sin(state[2])), 0.02)
    run = solve_ivp(motion, (0.0, 1e7), state, "DOP853", events=watched, rtol=3e-14, atol=1e-13, max_step=scale)
    which = next(i for i, t in enumerate(run.t_events) if len(t))
    assert which in (0, 1, 2, 3)
    state = run.y_events[which][0].copy()
    if which < 3:
        k, value = ((1, top), (1, low), (2, 0.0))[which]
        state[k] = value
    return which, np.append(state, run.t_events[which][0])


def shot(water: ray_solutions.Water, start: float, angle: float, counts: list[int], end: float) -> Floats:
    """Range, depth, angle, time and length where a ray passes the depth `end` after these reflections and turns."""
    state, length, seen, turns = np.array([0.0, start, angle, 0.0]), 0.0, [0, 0, 0], True
    layer = int(np.searchsorted(water.depth, start, "right" if angle > 0 else "left")) - 1
    while True:
        layer = min(max(layer, 0), len(water.depth) - 2)
        bounds = *water.depth[layer : layer + 2], *water.speed[layer : layer + 2]
        which, moved = within_layer(state, *bounds, end, seen == counts, turns)
        state, length, turns = moved[:4], length + moved[4], which != 2
        if which == 3 or (seen == counts and state[1] == end):
            return np.append(state, length)
        layer += (-1, 1, 0)[which]
        if which == 2:
            seen[2] += 1
        elif not 0 <= layer < len(water.depth) - 1:
            seen[which] += 1
            state[2] = -state[2]
        assert all(a <= b for a, b in zip(seen, counts, strict=True))


@pytest.mark.parametrize(
    ("profile", "bottom_depth", "count", "start", "end", "distance", "vertices"),
    [
        (thermocline, 25.0, 21, 9.0, 14.0, 300.0, 3),
        (duct, 150.0, 26, 55.0, 70.0, 2e3, 3),
        (munk, 5000.0, 21, 1000.0, 1300.0, 40e3, 3),
    ],
)
def test_an_integrator_shoots_to_the_same_end(
    profile: Callable[[Floats], Floats],
    bottom_depth: float,
    count: int,
    start: float,
    end: float,
    distance: float,
    vertices: int,
) -> None:
    water = tabulated(profile, bottom_depth, count)
    found = ray_solutions.eigenrays(water, np.array([start]), np.array([end]), np.array([distance]), vertices, vertices)
    assert len(found.pair) >= 2 * vertices
    for i in range(len(found.pair)):
        p = found.slowness[i]
        counts = [int(found.surface[i]), int(found.bottom[i]), int(found.turning[i])]
        angle = -np.arctan2(found.start_sine[i], p * found.start_speed[i])
        x, _, arrives, time, length = shot(water, start, angle, counts, end)
        assert abs(x - distance) < 1e-8 * distance
        assert abs(found.travel_time[i] - (time + p * (distance - x))) < 1e-11 * time
        assert abs(found.length[i] / length - 1) < 1e-8
        assert abs(arrives + np.arctan2(found.end_sine[i], p * found.end_speed[i])) < 1e-8


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
