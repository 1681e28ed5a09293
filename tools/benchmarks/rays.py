"""`tools/bench rays`: one core; eigenrays by the complete search, and a scene's facets to its array. Prints JSON.

Each with its error: of the search against arithmetic of 50 digits, of the batch against the search.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from sonarsynth import planning
from sonarsynth.conventions import depth
from sonarsynth.equations.arrays.apertures import aperture_terms
from sonarsynth.equations.rays import ray_continuation, ray_solutions
from sonarsynth.planning import Plan
from sonarsynth.propagation.refracted import Refracted
from sonarsynth.randomness import stream
from sonarsynth.recipe import reading
from sonarsynth.tracing.expansion.array_expansion import array_expansion
from sonarsynth.tracing.expansion.wavefront_polynomials import sphere
from sonarsynth.tracing.facet_paths import FacetPaths, facet_paths
from sonarsynth.validation.rays.ray_cases import random_layers
from sonarsynth.validation.rays.ray_matching import rays_of
from sonarsynth.validation.references.rays.mpmath_layers import Layers, exact_rays

RECIPE = Path(__file__).resolve().parents[2] / "configs" / "remus.yaml"
WATER = "scene.world.environment.sound_speed={kind: thermocline}"
LAYERS = (1, 5, 50)
FAMILIES = {"direct family": (1, 0), "two vertices": (2, 2)}
BOTTOM_DEPTH = 100.0  # m
RECEIVERS = 500
SOURCES = 40
CHECKED = 60
FACETS = 400
"""Facets that the complete search joins with every sensor; the others' times are measured on all of them."""


def median(function: Callable[[], Any], repeats: int = 7) -> tuple[Any, float]:
    """Result and median CPU seconds of a call, after one call that compiles."""
    result = function()
    seconds = []
    for _ in range(repeats):
        began = time.process_time()
        result = function()
        seconds.append(time.process_time() - began)
    return result, float(np.median(seconds))


def bench(index: int = 32) -> dict[str, Any]:
    """The complete search in random layers, and one frame of the remus scene in a tropical thermocline."""
    plan = planning.plan(reading.load(RECIPE, [WATER]))
    return {
        "search": [searched(layers, name, *most) for layers in LAYERS for name, most in FAMILIES.items()],
        "facets_to_array": {
            "scene": "configs/remus.yaml, tropical thermocline",
            "frame": index,
            "direct family": batch(plan, index, 0),
            "two bounces": batch(plan, index, 2),
        },
    }


def searched(layers: int, family: str, vertices: int, reflections: int) -> dict[str, Any]:
    """Microseconds an eigenray, receivers one at a time and 500 at a time, from sources all over the water."""
    nodes = random_layers(layers, BOTTOM_DEPTH, 5.0)
    water = ray_solutions.water(*nodes, BOTTOM_DEPTH)
    rng = stream(1, "bench", "rays", layers)
    sources, receivers = rng.uniform(0.0, BOTTOM_DEPTH, SOURCES), rng.uniform(0.0, BOTTOM_DEPTH, RECEIVERS)
    distance = np.geomspace(10.0, 3e3, RECEIVERS)

    def many() -> list[ray_solutions.Eigenrays]:
        return [ray_solutions.eigenrays(water, z, receivers, distance, vertices, reflections) for z in sources]

    def single() -> list[ray_solutions.Eigenrays]:
        ends = zip(receivers[::10], distance[::10], strict=True)
        return [ray_solutions.eigenrays(water, sources[:1], z, r, vertices, reflections) for z, r in ends]

    found, seconds = median(many)
    alone, seconds_alone = median(single)
    first = found[0]
    some = np.unique(np.linspace(0, len(first.pair) - 1, CHECKED).astype(int))
    got = rays_of(first).select(some)
    start = np.full(RECEIVERS, sources[0])
    exact = exact_rays(Layers(water.depth, water.speed), got, first.slowness[some], start, receivers, distance)
    sound = first.flag[some] != ray_solutions.CAUSTIC
    return {
        "layers": layers,
        "family": family,
        "rays_a_pair": sum(len(f.pair) for f in found) / (SOURCES * RECEIVERS),
        "us_an_eigenray_500_receivers": 1e6 * seconds / sum(len(f.pair) for f in found),
        "us_an_eigenray_one_receiver_a_call": 1e6 * seconds_alone / max(1, sum(len(f.pair) for f in alone)),
        "largest_time_error_s": float(np.abs(got.travel_time - exact.travel_time).max()),
        "largest_relative_amplitude_error": float(np.abs(got.amplitude / exact.amplitude - 1.0)[sound].max()),
    }


def batch(plan: Plan, index: int, bounces: int) -> dict[str, Any]:
    """Nanoseconds a path from facet to hydrophone by search, by continuation and by wavefronts, and their errors."""
    scene, frame = plan.recipe.frame(index)
    environment, pose = scene.world.environment, frame.sonar_pose
    propagation, context = Refracted(bounces=bounces), planning.context_of(plan, frame)
    made = facet_paths(context, propagation)
    legs = made.legs
    some = np.unique(np.linspace(0, len(legs.row) - 1, FACETS).astype(int))
    position = pose.to_world(plan.elements.position)
    flat = position[None, :, :2] - legs.point[:, None, :2]
    distance, sensors = np.hypot(flat[..., 0], flat[..., 1]), len(position)
    water = ray_solutions.water(plan.profile.depth, plan.profile.speed, environment.depth)

    def search() -> ray_solutions.Eigenrays:
        start, end = np.repeat(depth(legs.point[some]), sensors), np.tile(depth(position), len(some))
        return ray_solutions.eigenrays(water, start, end, distance[some].ravel(), bounces + 1, bounces)

    found, seconds = median(search, 3)
    (time_on, gain_on), seconds_on = median(lambda: continued(water, made, position, distance))
    (delay, of_fronts), seconds_evaluate = median(lambda: expanded(plan, made))
    group = made.facets.owner[legs.row]
    _, seconds_fronts = median(lambda: array_expansion(legs, group, plan.medium, context.receiver, propagation))
    time_exact, gain_exact = of_legs(found, made, some, sensors, time_on)
    paths = len(legs.row) * sensors
    return {
        "legs": len(legs.row),
        "sensors": sensors,
        "search": {
            "ns_a_path": 1e9 * seconds / len(found.pair),
            "paths": len(found.pair),
            "pairs": len(some) * sensors,
            "not_there_share": float(np.isnan(time_exact).mean()),
        },
        "continuation": {
            "ns_a_path": 1e9 * seconds_on / paths,
            "given_up_share": float(np.isnan(time_on).mean()),
            "largest_time_error_s": largest(time_on[some] - time_exact),
            "largest_relative_amplitude_error": largest(gain_on[some] / gain_exact - 1.0),
        },
        "wavefronts": {
            "ns_a_path": 1e9 * (seconds_fronts + seconds_evaluate) / paths,
            "ns_a_path_fit": 1e9 * seconds_fronts / paths,
            "ns_a_path_evaluation": 1e9 * seconds_evaluate / paths,
            "largest_time_error_s": largest(delay[some] - time_exact),
            "median_time_error_s": float(np.nanmedian(np.abs(delay[some] - time_exact))),
            "its_own_estimate_s": largest(np.where(np.isfinite(of_fronts), of_fronts, np.nan)),
        },
    }


def continued(
    water: ray_solutions.Water, made: FacetPaths, position: np.ndarray, distance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Times (s) and amplitudes (leg, sensor) of the rays to every sensor, each from the one before, by depth."""
    legs = made.legs
    ends, place = np.unique(depth(position), return_inverse=True)
    order = np.argsort(place, kind="stable")
    start = depth(legs.point)
    p = np.hypot(legs.departure[:, 0], legs.departure[:, 1]) / np.interp(start, water.depth, water.speed)
    up, vertices = (legs.departure[:, 2] > 0).astype(np.int64), legs.bounces + legs.turning
    times, sines, gains = (np.empty((len(start), len(order))) for _ in range(3))
    ray_continuation.rays_nearby(
        water.depth, water.speed, start, p, up, vertices, place[order], ends,
        np.ascontiguousarray(distance[:, order]), times, sines, gains,
    )  # fmt: skip
    back = np.argsort(order)
    return times[:, back], gains[:, back]


def expanded(plan: Plan, made: FacetPaths) -> tuple[np.ndarray, np.ndarray]:
    """Times (leg, sensor) by the wavefronts of the product (`products.Arrivals`), and the errors that they state."""
    legs, over, elements = made.legs, made.fronts, plan.elements
    c = float(plan.profile.at(depth(made.context.receiver.pose.position)))
    farther = sphere(legs.direction, legs.radius, elements.position) / c
    terms = aperture_terms(elements.position, elements.aperture)
    return legs.travel_time[:, None] + farther + over.terms.delay @ terms.T, over.terms.error


def of_legs(
    found: ray_solutions.Eigenrays, made: FacetPaths, some: np.ndarray, sensors: int, near: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Times and amplitudes (leg, sensor) of the rays found that belong to some legs, or NaN: of their family, and
    nearest to a time (leg, sensor) where there are several."""
    legs = made.legs
    kind = np.stack([legs.surface, legs.bottom, legs.turning], axis=1)[some][found.pair // sensors]
    same = (kind == np.stack([found.surface, found.bottom, found.turning], axis=1)).all(axis=1)
    up = (legs.departure[some, 2] > 0)[found.pair // sensors]
    same &= (up == (found.start_sine > 0)) | (kind.sum(axis=1) == 0)
    off = np.abs(found.travel_time - near[some].ravel()[found.pair])
    keep = np.flatnonzero(same & np.isfinite(off))
    keep = keep[np.argsort(-off[keep], kind="stable")]  # the nearest is written last, and stays
    result = np.full((2, len(some) * sensors), np.nan)
    result[:, found.pair[keep]] = found.travel_time[keep], found.amplitude[keep]
    return result[0].reshape(len(some), sensors), result[1].reshape(len(some), sensors)


def largest(error: np.ndarray) -> float:
    """Largest |error|, NaN left out."""
    return float(np.nanmax(np.abs(error), initial=0.0))
