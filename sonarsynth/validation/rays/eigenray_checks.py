"""The eigenray search against computations that share no code with it: error against run time.

Layers, of one speed and of one gradient among them, against rays followed leg by leg in long doubles, of which a dense
fan counts the rays of every family; the canonical profile of Munk, whose layers have an error of their own, against the
ray equations of the smooth profile, integrated.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import evenly
from sonarsynth.equations.rays import ray_solutions
from sonarsynth.equations.rays.ray_solutions import CAUSTIC
from sonarsynth.validation.rays import ray_cases
from sonarsynth.validation.rays.ray_cases import Case
from sonarsynth.validation.rays.ray_matching import errors, miscounted, nearest, rays_of, worst
from sonarsynth.validation.references.rays.exact_rays import exact_rays
from sonarsynth.validation.references.rays.followed_rays import count_rays
from sonarsynth.validation.references.rays.shooting import munk, shooting_rays
from sonarsynth.validation.run_time import timed
from sonarsynth.validation.validation_rows import Row

if TYPE_CHECKING:
    from sonarsynth.equations.rays.ray_solutions import Eigenrays


FOLLOWED, FAN = "rays followed in long doubles", "a dense fan"
SMOOTH = "DOP853, smooth profile"
BATCH = 2e-3  # s: a search is timed on at least so much
COST = "us a ray"  # CPU time of one core for one ray, in the complete search of the whole case


def ray_accuracy(quick: bool = False) -> list[Row]:
    """Errors and run times in every case; quick: fewer pairs."""
    return [*_layered(quick), *_smooth(quick)]


def search(case: Case) -> tuple[Eigenrays, float]:
    """All eigenrays of a case, and the CPU time of one of them (us), on a batch."""
    water = ray_solutions.water(case.depth, case.speed, case.bottom)

    def run(copies: int) -> Eigenrays:
        start, end, distance = (np.tile(v, copies) for v in (case.start, case.end, case.distance))
        return ray_solutions.eigenrays(water, start, end, distance, case.vertices, case.reflections)

    eigenrays, once = timed(lambda: run(1), 2)
    copies = max(1, min(10_000, round(BATCH / max(once, 1e-6))))
    _, seconds = timed(lambda: run(copies), 5)
    return eigenrays, 1e6 * seconds / (copies * max(1, len(eigenrays.pair)))


def _counts(case: Case, rays: int) -> dict[str, int]:
    """Pairs of ends that were searched, and rays that were compared."""
    return {"pairs": len(case.start), "rays": rays}


def _layered(quick: bool) -> Iterator[Row]:
    """Rows of the rays found, made exact, and of the fan that counts them."""
    for case in ray_cases.layered(quick):
        eigenrays, cost = search(case)
        rays = rays_of(eigenrays)
        ends = (case.start, case.end, case.distance)
        water = ray_solutions.water(case.depth, case.speed, case.bottom)
        wrong = miscounted(rays, count_rays(water, *ends, case.vertices, case.reflections))
        yield Row(case.name, FAN, "count", "rays", 0.0, float(wrong), cost, COST, _counts(case, len(rays.pair)))
        keep = np.array(evenly(len(rays.pair), case.check))
        selected, trusted = rays.select(keep), np.asarray(eigenrays.flag[keep] != CAUSTIC)
        exact = exact_rays(water, selected, eigenrays.slowness[keep], *ends)
        differing = float(sum(a != b for a, b in zip(selected.families, exact.families, strict=True)))
        columns = cost, COST, _counts(case, len(keep))
        yield Row(case.name, FOLLOWED, "family", "wrong", 0.0, differing, *columns)
        for quantity, (unit, error, bound) in errors(selected, exact, trusted, case.bounds).items():
            yield Row(case.name, FOLLOWED, quantity, unit, bound, error, *columns)


def _smooth(quick: bool) -> Iterator[Row]:
    """What the layers that stand for a smooth profile cost in travel time, whatever the search does.

    Every ray of the smooth profile is compared with the nearest in time of its family. Amplitudes are not: layers have
    kinks, and where a ray turns near one there are caustics, and rays, that the smooth profile has not.
    """
    distance, ends = 5e4 if quick else 1e5, ray_cases.MUNK_ENDS
    exact = shooting_rays(munk(), ray_cases.MUNK_START, ends, distance, ray_cases.MUNK_VERTICES)
    for tolerance in (1e-4, 1e-5) if quick else (1e-4, 1e-5, 1e-6):
        case = ray_cases.munk_case(tolerance, distance)
        eigenrays, cost = search(case)
        i, j = nearest(rays_of(eigenrays), exact)
        counts = _counts(case, len(exact.pair))
        missed = float(len(exact.pair) - len(j))
        yield Row(case.name, SMOOTH, "missed", "rays", 0.0, missed, cost, COST, counts, ray_cases.MUNK)
        error = np.abs(eigenrays.travel_time[i] - exact.travel_time[j])
        largest, bound = worst(error, tolerance * np.maximum(1, exact.turning[j]))
        yield Row(case.name, SMOOTH, "time", "s", bound, largest, cost, COST, counts, ray_cases.MUNK)
