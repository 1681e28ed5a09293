"""Families of rays that were found, paths by images in uniform water, and water to find rays in."""

from __future__ import annotations

import numpy as np

from sonarsynth.equations.rays import ray_solutions
from sonarsynth.validation.references.rays.followed_rays import Family


def family(found: ray_solutions.Eigenrays, i: int) -> Family:
    """The family of a found ray."""
    counts = int(found.surface[i]), int(found.bottom[i]), int(found.turning[i])
    return int(np.sign(found.start_sine[i])), *counts, int(np.sign(found.end_sine[i]))


def images(bottom_depth: float, start: float, end: float, reflections: int) -> list[tuple[int, int, int, int, float]]:
    """Paths in uniform water, shortest first: launch sign, surface, bottom, arrival sign, height gone (m)."""
    direct = int(np.sign(start - end))
    rows = [(direct, 0, 0, direct, abs(start - end))]
    for hits in range(1, reflections + 1):
        for up in (1, -1):
            last_up = up if hits % 2 else -up  # sense of travel before the last hit
            height = (
                (start if up > 0 else bottom_depth - start)
                + (hits - 1) * bottom_depth
                + (end if last_up > 0 else bottom_depth - end)
            )
            first, second = (hits + 1) // 2, hits // 2
            rows.append((up, first if up > 0 else second, second if up > 0 else first, -last_up, height))
    return sorted(rows, key=lambda row: row[4])


def random_water(rng: np.random.Generator, layers: int, spread: float) -> ray_solutions.Water:
    """A random profile over a bottom at 100 m; some layers of one speed, some jumps."""
    depth = np.sort(rng.uniform(0.0, 100.0, layers))
    speed = 1500.0 + spread * rng.normal(size=layers)
    if layers > 3 and rng.random() < 0.5:
        speed[2] = speed[1]
    if layers > 4 and rng.random() < 0.5:
        depth[4] = depth[3]
    return ray_solutions.water(depth, speed, 100.0)
