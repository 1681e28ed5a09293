"""Eigenrays against independent slow computations: 50 digits on random layers, and a dense fan of rays."""

from __future__ import annotations

from itertools import pairwise

import mpmath as mp
import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.equations.rays import ray_solutions


def random_water(rng: np.random.Generator, layers: int, spread: float) -> ray_solutions.Water:
    """A random profile of a bottom at 100 m; some layers of one speed, some jumps."""
    depth = np.sort(rng.uniform(0.0, 100.0, layers))
    speed = 1500.0 + spread * rng.normal(size=layers)
    if layers > 3 and rng.random() < 0.5:
        speed[2] = speed[1]
    if layers > 4 and rng.random() < 0.5:
        depth[4] = depth[3]
    return ray_solutions.water(depth, speed, 100.0)


def exact_speed(water: ray_solutions.Water, depth: float, below: bool) -> mp.mpf:
    """Speed just below or just above a depth, to all digits."""
    z = [mp.mpf(float(d)) for d in water.depth]
    c = [mp.mpf(float(s)) for s in water.speed]
    for i in range(len(z) - 1):
        if (z[i] <= depth < z[i + 1]) if below else (z[i] < depth <= z[i + 1]):
            return c[i] + (c[i + 1] - c[i]) * (depth - z[i]) / (z[i + 1] - z[i])
    raise AssertionError(depth)


def exact_layers(water: ray_solutions.Water, top: mp.mpf, bottom: mp.mpf) -> list[tuple[mp.mpf, mp.mpf, mp.mpf]]:
    """(thickness, speed at top, speed at bottom) of the layers between two depths."""
    cuts = [top, *[mp.mpf(float(d)) for d in np.unique(water.depth) if top < d < bottom], bottom]
    return [(b - a, exact_speed(water, a, True), exact_speed(water, b, False)) for a, b in pairwise(cuts) if b > a]


def exact_sums(p: mp.mpf, layers: list[tuple[mp.mpf, mp.mpf, mp.mpf]]) -> tuple[mp.mpf, mp.mpf, mp.mpf]:
    """Range, travel time and arc length of a ray through layers by the textbook's forms, which cancel: 50 digits."""
    x = t = s = mp.mpf(0)
    for dz, c1, c2 in layers:
        s1, s2 = (mp.sqrt(abs(1 - (p * c) ** 2)) for c in (c1, c2))
        if c1 == c2:
            x, t, s = x + dz * p * c1 / s1, t + dz / (c1 * s1), s + dz / s1
            continue
        g = (c2 - c1) / dz
        x += (s1 - s2) / (p * g)
        t += mp.log(c2 / c1 * (1 + s1) / (1 + s2)) / g
        s += (mp.acos(p * c1) - mp.acos(mp.mpf(min(p * c2, 1)))) / (p * g)
    return x, t, s


def exact_path(
    water: ray_solutions.Water, p: mp.mpf, start: float, end: float, turn: float
) -> tuple[mp.mpf, mp.mpf, mp.mpf]:
    """Range, time and length of the ray with slowness p between two depths; turn: turning depth, roughly, or NaN."""
    top, bottom = mp.mpf(min(start, end)), mp.mpf(max(start, end))
    total = np.array(exact_sums(p, exact_layers(water, top, bottom)))
    if np.isnan(turn):
        return tuple(total)
    down = turn > bottom
    i = max(np.flatnonzero(water.depth < turn)) if down else min(np.flatnonzero(water.depth > turn)) - 1
    z1, z2, c1, c2 = (mp.mpf(float(v)) for v in (*water.depth[i : i + 2], *water.speed[i : i + 2]))
    vertex = z1 + (1 / p - c1) * (z2 - z1) / (c2 - c1)
    beyond = exact_layers(water, bottom, vertex) if down else exact_layers(water, vertex, top)
    return tuple(total + 2 * np.array(exact_sums(p, beyond)))


@pytest.mark.parametrize(
    ("layers", "spread", "seed"), [(2, 5.0, 1), (6, 3.0, 2), (8, 20.0, 3), (12, 1e-3, 4), (5, 1e-9, 5)]
)
def test_times_lengths_and_slownesses_to_many_digits(layers: int, spread: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    seen = 0
    with mp.workdps(60):
        for _ in range(6):
            water = random_water(rng, layers, spread)
            start, end = rng.uniform(0, 100, (2, 6))
            distance = 10 ** rng.uniform(0, 4, 6)
            found = ray_solutions.eigenrays(water, start, end, distance)
            for i, pair in enumerate(found.pair):
                a, b, r = float(start[pair]), float(end[pair]), mp.mpf(float(distance[pair]))
                turn = float(np.fmax(found.upper, found.lower)[i])
                if np.min(np.abs(water.depth - turn), initial=np.inf) < 1e-7:
                    continue  # the turning layer is not certain at 1e-16
                p = mp.mpf(float(found.slowness[i]))

                def miss(
                    q: mp.mpf,
                    water: ray_solutions.Water = water,
                    a: float = a,
                    b: float = b,
                    turn: float = turn,
                    r: mp.mpf = r,
                ) -> mp.mpf:
                    return exact_path(water, q, a, b, turn)[0] - r

                step = p * mp.mpf("1e-18")
                for _ in range(4):  # Newton with a numerical slope
                    p -= miss(p) / ((miss(p + step) - miss(p)) / step)
                _, time, length = exact_path(water, p, a, b, turn)
                assert abs(found.travel_time[i] - time) <= 1e-13 * min(1, time) + 4e-16 * time
                assert abs(found.travel_time[i] / time - 1) < 3e-15
                assert abs(found.length[i] / length - 1) < 1e-9
                assert abs(found.slowness[i] / p - 1) < 1e-12
                seen += 1
    assert seen > 12


def fan_counts(water: ray_solutions.Water, start: float, end: float, distance: float) -> int:
    """How many rays a dense fan finds: sign changes of range - distance over v in every turning layer."""
    top, bottom = min(start, end), max(start, end)
    count = 0
    v = np.geomspace(1e-7, 1e7, 20001) * 1500.0
    z, c = insert(water, top, bottom)
    a, b = int(np.searchsorted(z, top, "right")) - 1, int(np.searchsorted(z, bottom, "left"))
    fastest = c[a : b + 1].max()
    if bottom > top:
        count += changes(full_range(v, fastest, z[a : b + 1], c[a : b + 1]) - distance)
    else:
        count += any(c[i] == c[i + 1] for i in range(len(z) - 1) if z[i] < z[i + 1] and z[i] <= top <= z[i + 1])
    for sign in (1, -1):
        zz, cc = (z, c) if sign == 1 else (-z[::-1], c[::-1])
        lo, hi = sorted((sign * top, sign * bottom))
        a, b = int(np.searchsorted(zz, lo, "right")) - 1, int(np.searchsorted(zz, hi, "right")) - 1
        fastest = cc[a : b + 1].max()
        for j in range(b, len(zz) - 1):
            if cc[j + 1] > fastest:
                extent = np.sqrt((cc[j + 1] - fastest) * (cc[j + 1] + fastest))
                w = extent * np.concatenate([np.geomspace(1e-9, 1e-2, 2001), np.linspace(0.01, 1.0, 40001)[1:]])
                x = full_range(w, fastest, zz[a : b + 1], cc[a : b + 1]) + 2 * full_range(
                    w, fastest, zz[b : j + 1], cc[b : j + 1]
                )
                x += (
                    2
                    * (zz[j + 1] - zz[j])
                    / (cc[j + 1] - cc[j])
                    * np.sqrt(w**2 + (fastest - cc[j]) * (fastest + cc[j]))
                )
                count += changes(x - distance)
                fastest = cc[j + 1]
    return count


def insert(water: ray_solutions.Water, top: float, bottom: float) -> tuple[Floats, Floats]:
    """The profile with nodes at the two ends."""
    z, c = water.depth, water.speed
    for end in {top, bottom} - set(z):
        i = int(np.searchsorted(z, end))
        c = np.insert(c, i, np.interp(end, water.depth, water.speed))
        z = np.insert(z, i, end)
    return z, c


def full_range(v: Floats, fastest: float, z: Floats, c: Floats) -> Floats:
    """Range through whole layers for rays of v = c_m tan(grazing angle at the fastest depth)."""
    h = np.sqrt(v[:, None] ** 2 + (fastest - c) * (fastest + c))
    return np.sum(np.diff(z) * (c[1:] + c[:-1]) / (h[:, 1:] + h[:, :-1]), axis=1)


def changes(x: Floats) -> int:
    return int(np.sum((x[1:] > 0) != (x[:-1] > 0)))


@pytest.mark.parametrize(("layers", "spread"), [(2, 5.0), (5, 5.0), (9, 10.0), (15, 2.0)])
def test_no_ray_is_missed_and_none_comes_twice(layers: int, spread: float) -> None:
    rng = np.random.default_rng(layers)
    multiple = 0
    for _ in range(12):
        water = random_water(rng, layers, spread)
        start, end = rng.uniform(0, 100, (2, 8))
        end[:2] = start[:2]
        distance = 10 ** rng.uniform(0.5, 3.7, 8)
        found = ray_solutions.eigenrays(water, start, end, distance)
        for i in range(8):
            mine = found.pair == i
            assert mine.sum() == fan_counts(water, start[i], end[i], distance[i])
            assert len(np.unique(np.round(found.slowness[mine], 14) * found.start_sine[mine])) == mine.sum()
            multiple += mine.sum() > 1
    assert multiple > 3 or layers == 2
