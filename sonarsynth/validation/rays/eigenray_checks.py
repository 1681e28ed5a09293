"""The eigenray search against computations that share no code with it: error against run time.

Isovelocity water against image sources; one gradient against its circles; layers against arithmetic of 50 digits, with
a dense fan that counts the rays of every family; the canonical profile of Munk, whose layers have an error of their
own, against the ray equations of the smooth profile, integrated.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Bools
from sonarsynth.equations.rays import ray_solutions
from sonarsynth.equations.rays.ray_solutions import CAUSTIC
from sonarsynth.validation.rays import ray_cases
from sonarsynth.validation.rays.ray_cases import Case
from sonarsynth.validation.rays.ray_matching import Rays, errors, matched, miscounted, nearest, rays_of, worst
from sonarsynth.validation.references.rays.mpmath_layers import Layers, exact_rays
from sonarsynth.validation.references.rays.one_gradient import gradient_rays
from sonarsynth.validation.references.rays.shooting import munk, shooting_rays
from sonarsynth.validation.references.rays.slowness_fan import count_rays
from sonarsynth.validation.validation_rows import Row

if TYPE_CHECKING:
    from sonarsynth.equations.rays.ray_solutions import Eigenrays
from sonarsynth.conventions import Floats


def image_rays(speed: float, bottom_depth: float, start: Floats, end: Floats, distance: Floats, bounces: int) -> Rays:
    """Every ray with up to `bounces` reflections between depths start and end (pair,) m at distances (pair,) m.

    The receiver is mirrored in the boundaries that the ray meets, the last one first (e.g. Jensen, Kuperman, Porter and
    Schmidt 2011, Computational Ocean Acoustics, section 2.4.4). speed in m/s, bottom in m.
    """
    rows = []
    for down_first in (True, False):
        for count in range(bounces + 1):
            if count == 0 and not down_first:
                continue
            at_bottom = (np.arange(count) % 2 == 0) == down_first
            image = np.array(end, float)
            for bottom_hit in at_bottom[::-1]:
                image = 2.0 * bottom_depth - image if bottom_hit else -image
            rise = start - image
            length = np.hypot(distance, rise)
            angle = np.arctan2(rise, distance)
            last = angle if count % 2 == 0 else -angle
            rows.append(
                [
                    length / speed,
                    angle,
                    last,
                    1.0 / length,
                    *(np.full(len(rise), np.sum(hits)) for hits in (~at_bottom, at_bottom)),
                ]
            )
    time, first, last, amplitude, surface, bottom = (np.concatenate(column) for column in zip(*rows, strict=True))
    none = np.zeros(len(time), int)
    pair = np.tile(np.arange(len(start)), len(rows))
    return Rays(pair, time, first, last, amplitude, surface.astype(int), bottom.astype(int), none, none)


IMAGES, CIRCLES = "image sources", "circles, 40 digits"
MANY_DIGITS, FAN = "50 digits", "a dense fan"
SMOOTH = "DOP853, smooth profile"
REPEATS = 5
BATCH = 2e-3  # s: a search is timed on at least so much
COST = "us a ray"  # CPU time of one core for one ray, in the complete search of the whole case


def ray_accuracy(quick: bool = False) -> list[Row]:
    """Errors and run times in every case; quick: fewer pairs. Raises ModuleNotFoundError without mpmath."""
    if find_spec("mpmath") is None:
        raise ModuleNotFoundError("the references for rays need mpmath: pip install 'sonarsynth[accuracy]'")
    return [
        *_isovelocity(quick),
        *_gradients(quick),
        *_layered(quick),
        *_smooth(quick),
    ]


def search(case: Case) -> tuple[Eigenrays, float]:
    """All eigenrays of a case, and the CPU time of one of them (us): the median of several runs, on a batch."""
    water = ray_solutions.water(case.depth, case.speed, case.bottom)

    def run(copies: int) -> tuple[Eigenrays, float]:
        start, end, distance = (np.tile(v, copies) for v in (case.start, case.end, case.distance))
        began = time.process_time()
        eigenrays = ray_solutions.eigenrays(water, start, end, distance, case.vertices, case.reflections)
        return eigenrays, time.process_time() - began

    eigenrays, _ = run(1)  # compiles
    _, once = run(1)
    copies = max(1, min(10_000, round(BATCH / max(once, 1e-6))))
    seconds = float(np.median([run(copies)[1] for _ in range(REPEATS)]))
    return eigenrays, 1e6 * seconds / (copies * max(1, len(eigenrays.pair)))


def _rows(case: Case, reference: str, cost: float, computed: Rays, exact: Rays, trusted: Bools) -> Iterator[Row]:
    """One row a quantity of matched rays."""
    counts = _counts(case, len(computed.pair))
    for quantity, (unit, error, bound) in errors(computed, exact, trusted, case.bounds).items():
        yield Row(case.name, reference, quantity, unit, bound, error, cost, COST, counts)


def _counts(case: Case, rays: int) -> dict[str, int]:
    """Pairs of ends that were searched, and rays that were compared."""
    return {"pairs": len(case.start), "rays": rays}


def _trusted(eigenrays: Eigenrays) -> Bools:
    return np.asarray(eigenrays.flag != CAUSTIC)


def _complete(case: Case, reference: str, cost: float, computed: Rays, exact: Rays, trusted: Bools) -> Iterator[Row]:
    """Rows of a reference that gives every ray."""
    wrong = miscounted(computed, Counter(exact.families))
    yield Row(case.name, reference, "count", "rays", 0.0, float(wrong), cost, COST, _counts(case, len(computed.pair)))
    i, j = matched(computed, exact)
    yield from _rows(case, reference, cost, computed.select(i), exact.select(j), trusted[i])


def _isovelocity(quick: bool) -> Iterator[Row]:
    for case in ray_cases.isovelocity(quick):
        eigenrays, cost = search(case)
        exact = image_rays(float(case.speed[0]), case.bottom, case.start, case.end, case.distance, case.vertices)
        yield from _complete(case, IMAGES, cost, rays_of(eigenrays), exact, _trusted(eigenrays))


def _gradients(quick: bool) -> Iterator[Row]:
    for case, water in ray_cases.gradients(quick):
        eigenrays, cost = search(case)
        rays = rays_of(eigenrays)
        keep = (rays.bottom if water.slope > 0 else rays.surface) == 0
        exact = gradient_rays(water, case.start, case.end, case.distance, case.vertices)
        yield from _complete(case, CIRCLES, cost, rays.select(keep), exact, _trusted(eigenrays)[keep])


def _thinned(case: Case, rays: Rays) -> np.ndarray:
    count = len(rays.pair)
    return np.unique(np.linspace(0, count - 1, min(count, case.check)).astype(int))


def _layered(quick: bool) -> Iterator[Row]:
    """Rows of the rays found, made exact, and of the fan that counts them."""
    for case in ray_cases.layered(quick):
        eigenrays, cost = search(case)
        rays = rays_of(eigenrays)
        ends = (case.start, case.end, case.distance)
        wrong = miscounted(rays, count_rays(case.depth, case.speed, *ends, case.vertices, case.reflections))
        yield Row(case.name, FAN, "count", "rays", 0.0, float(wrong), cost, COST, _counts(case, len(rays.pair)))
        keep = _thinned(case, rays)
        selected, trusted = rays.select(keep), _trusted(eigenrays)[keep]
        exact = exact_rays(Layers(case.depth, case.speed), selected, eigenrays.slowness[keep], *ends)
        differing = float(sum(a != b for a, b in zip(selected.families, exact.families, strict=True)))
        yield Row(case.name, MANY_DIGITS, "family", "wrong", 0.0, differing, cost, COST, _counts(case, len(keep)))
        yield from _rows(case, MANY_DIGITS, cost, selected, exact, trusted)


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
