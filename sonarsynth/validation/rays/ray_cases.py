"""The waters and the pairs of ends in which the search for eigenrays is checked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import Munk, Thermocline
from sonarsynth.randomness import stream
from sonarsynth.validation.rays.ray_matching import Bounds

SEED = 3
TIGHT, LOOSE = Bounds(), Bounds(time=1e-12)


@dataclass(frozen=True, eq=False)
class Case:
    """Water, and pairs of ends to be joined by rays with up to so many vertices and reflections."""

    name: str
    depth: Floats  # (node,) m, from the surface to the bottom
    speed: Floats  # (node,) m/s
    start: Floats  # (pair,) m
    end: Floats  # (pair,) m
    distance: Floats  # (pair,) m
    vertices: int
    reflections: int
    bounds: Bounds = TIGHT
    check: int = 60
    """Rays that are compared, evenly taken."""

    @property
    def bottom(self) -> float:
        """Depth of the bottom (m)."""
        return float(self.depth[-1])


def drawn(
    name: str,
    nodes: tuple[Floats, Floats],
    nearest: float,
    farthest: float,
    pairs: int,
    vertices: int,
    *,
    reflections: int,
    bounds: Bounds = TIGHT,
    check: int = 60,
) -> Case:
    """A case with ends all over the water, at distances (m) spread evenly in their logarithm."""
    rng = stream(SEED, "accuracy", "rays", name)
    start, end = rng.uniform(0.0, float(nodes[0][-1]), (2, pairs))
    distance = np.geomspace(nearest, farthest, pairs)
    return Case(name, *nodes, start, end, distance, vertices, reflections, bounds, check)


def cut(nodes: tuple[Floats, Floats], bottom: float) -> tuple[Floats, Floats]:
    """The nodes of a profile down to the bottom (m)."""
    above = nodes[0] < bottom
    speed = np.append(nodes[1][above], np.interp(bottom, *nodes))
    return np.append(nodes[0][above], bottom), speed


def random_layers(count: int, bottom: float, spread: float) -> tuple[Floats, Floats]:
    """Layers between nodes at random depths (m), their speeds spread (m/s) about 1500 m/s."""
    rng = stream(SEED, "accuracy", "layers", count)
    depth = np.concatenate([[0.0], np.sort(rng.uniform(0.0, bottom, count - 1)), [bottom]])
    return depth, 1500.0 + spread * rng.normal(size=count + 1)


def noisy_cast(bottom: float, step: float) -> tuple[Floats, Floats]:
    """A cast every `step` (m) down to the bottom: a thermocline, with noise of 0.05 m/s from node to node."""
    rng = stream(SEED, "accuracy", "cast")
    depth = np.linspace(0.0, bottom, round(bottom / step) + 1)
    smooth = 1538.0 - 8.0 / (1.0 + np.exp(-(depth - 0.4 * bottom) / (0.05 * bottom))) + 0.0163 * depth
    return depth, smooth + 0.05 * rng.normal(size=len(depth))


DUCT = np.array([0.0, 40.0, 60.0, 100.0]), np.array([1520.0, 1500.0, 1502.0, 1530.0])
JUMP = np.array([0.0, 30.0, 30.0, 70.0, 70.0, 100.0]), np.array([1510.0, 1505.0, 1515.0, 1490.0, 1486.0, 1495.0])


def layered(quick: bool) -> Iterator[Case]:
    """Layers: one of one speed, one of one gradient (that of pressure and its opposite, that of a sharp thermocline,
    and hardly any), few, many, a thermocline, a duct, jumps, a noisy cast."""
    many, few = (6, 8) if quick else (40, 120)
    for name, bottom, farthest in (("isovelocity", 100.0, 1e4), ("isovelocity, 100 km", 5000.0, 1e5)):
        nodes = np.array([0.0, bottom]), np.full(2, 1500.0)
        yield drawn(name, nodes, 0.01 * farthest, farthest, many, 4, reflections=4, check=few)
    for slope, bottom, farthest in ((0.0163, 4e3, 6e4), (-0.0163, 4e3, 6e4), (-4.3, 20.0, 300.0), (1e-6, 100.0, 1e4)):
        nodes = np.array([0.0, bottom]), np.array([1500.0, 1500.0 + slope * bottom])
        yield drawn(f"gradient {slope:g} /s", nodes, 0.01 * farthest, farthest, many, 6, reflections=6, check=few)
    yield drawn("3 layers", random_layers(3, 100.0, 5.0), 10.0, 3e3, many, 4, reflections=4, check=few)
    yield drawn("5 layers", random_layers(5, 100.0, 5.0), 10.0, 3e3, many, 4, reflections=4, check=few)
    yield drawn(
        "50 layers", random_layers(50, 200.0, 5.0), 10.0, 3e3, many, 3, reflections=3, bounds=LOOSE, check=few // 2
    )
    yield drawn("thermocline", cut(Thermocline().nodes, 20.0), 1.0, 500.0, many, 4, reflections=4, check=few)
    yield drawn("duct", DUCT, 50.0, 5e3, many, 8, reflections=1, check=few)
    yield drawn("jumps", JUMP, 10.0, 5e3, many, 4, reflections=4, check=few)
    cast = noisy_cast(100.0, 2.0 if quick else 0.5)
    yield drawn("noisy cast", cast, 10.0, 1e3, many // 2, 3, reflections=2, bounds=LOOSE, check=few // 4)


MUNK = "Munk, over the layers' tolerance"
MUNK_START, MUNK_ENDS, MUNK_VERTICES = 1000.0, np.array([310.0, 800.0, 1310.0, 2000.0]), 12  # m, m


def munk_case(tolerance: float, distance: float) -> Case:
    """The canonical profile in layers to a tolerance (s) at each turning point, joined over a distance (m)."""
    same = np.full(len(MUNK_ENDS), MUNK_START), MUNK_ENDS, np.full(len(MUNK_ENDS), distance)
    layers = cut(Munk(tolerance=tolerance).nodes, 5000.0)
    return Case(f"Munk, layers to {tolerance:g} s", *layers, *same, MUNK_VERTICES, 0)
