"""Drawing the bodies of populations: each where it fits, keyed so that nothing that comes after it changes it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats, evenly
from sonarsynth.description import FieldError
from sonarsynth.geometry import Pose
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.motion import pose
from sonarsynth.randomness import number, share, stream, uniforms
from sonarsynth.receiver import elements
from sonarsynth.recipe.populations.drawn_tracks import DRAWS, SequenceTimes
from sonarsynth.recipe.populations.population import Population
from sonarsynth.recipe.populations.regions import SonarView
from sonarsynth.recipe.rising_bottom import relief_of
from sonarsynth.recipe.variation.sobol_points import OF_VARIATIONS, sobol_shares
from sonarsynth.targets.relief import highest_within
from sonarsynth.targets.target import Target

if TYPE_CHECKING:
    from sonarsynth.recipe.scene import Scene

TRIES = 1000
"""Places that are tried for a body before there is said to be no room."""
OF_BODY = 6 + DRAWS + 2
"""Random numbers of a body: place, attitude, track, scale and model."""
TIMES = 9
"""Frames of a sequence that a place must do for, at most; first and last among them."""
ABOVE_BOTTOM = 1e-3
"""m between the bottom and the lowest point of what lies on it."""


@dataclass(frozen=True, eq=False)
class DrawnBodies:
    """The bodies of a sequence."""

    targets: tuple[Target, ...]
    tried: int  # places

    def put_in(self, scene: Scene) -> Scene:
        """The scene with these among its targets, in place of its populations."""
        if not scene.world.populations:
            return scene
        targets = (*scene.world.targets, *self.targets)
        return replace(scene, world=replace(scene.world, targets=targets, populations=()))


@dataclass(frozen=True, eq=False)
class _Ball:
    """A sphere that moves."""

    centre: Floats  # (time, xyz) m
    radius: float  # m

    def gap(self, other: _Ball) -> float:
        """Least distance (m) between the two at any time; negative where they meet."""
        apart = np.linalg.norm(self.centre - other.centre, axis=1).min(initial=np.inf)
        return float(apart) - self.radius - other.radius


@dataclass(frozen=True, eq=False)
class _MovingBox:
    """The box round a target of the recipe."""

    poses: tuple[Pose, ...]  # (time,)
    box: Floats  # (2, xyz) m, own frame

    def gap(self, other: _Ball) -> float:
        """Least distance (m) to a sphere at any time."""
        apart = np.inf
        for at_time, centre in zip(self.poses, other.centre, strict=True):
            local = at_time.to_body(centre)
            outside = np.maximum(np.maximum(self.box[0] - local, local - self.box[1]), 0.0)
            apart = min(apart, float(np.linalg.norm(outside)))
        return apart - other.radius


def draw(scene: Scene, seed: int, key: int | str, repeat: tuple[str, int]) -> DrawnBodies:
    """The bodies of the populations of a scene, that of the sequence of a key.

    repeat: its grid point, and which repeat of that it is. Raises FieldError where a population has no room, or
    a model no mesh.
    """
    sea = _Sea.of(scene, seed, key)
    bodies: list[Target] = []
    tried = 0
    for index, population in enumerate(scene.world.populations):
        base = number(seed, "population", key, population.name)
        even = _Even.of(scene, index, seed, repeat) if population.sobol else None
        fraction = even.count if even is not None else share(seed, "population", key, population.name, "count")
        count = _count(population, fraction)
        for slot in range(count):
            for attempt in range(TRIES):
                tried += 1
                draws = uniforms(base, slot, attempt, np.arange(OF_BODY))
                if even is not None and attempt == 0:
                    draws = even.of_body(slot)
                target = sea.tried(population, slot, draws)
                if target is not None:
                    bodies.append(target)
                    break
            else:
                raise FieldError(
                    ("scene", "world", "populations", index),
                    f"no room for body {slot + 1} of {count} in {TRIES} tries: it needs a larger region, or fewer or "
                    "smaller bodies",
                )
    return DrawnBodies(tuple(bodies), tried)


@dataclass(frozen=True)
class _Even:
    """What a population of a scene draws by a Sobol sequence."""

    seed: int
    repeat: tuple[str, int]  # grid point, and which of its repeats
    name: str
    first: int  # dimension

    @classmethod
    def of(cls, scene: Scene, index: int, seed: int, repeat: tuple[str, int]) -> _Even:
        """Of population number `index`: one that is added after it changes nothing."""
        before = sum(1 + OF_BODY * earlier.most for earlier in scene.world.populations[:index] if earlier.sobol)
        return cls(seed, repeat, scene.world.populations[index].name, OF_VARIATIONS + before)

    @property
    def count(self) -> float:
        """The draw of the number of bodies."""
        return float(self._shares([f"{self.name} count"], self.first)[0])

    def of_body(self, slot: int) -> Floats:
        """The draws (`OF_BODY`,) of the first place that is tried for a body."""
        return self._shares([f"{self.name} {slot} {n}" for n in range(OF_BODY)], self.first + 1 + OF_BODY * slot)

    def _shares(self, names: list[str], first: int) -> Floats:
        point, repeat = self.repeat
        return sobol_shares(self.seed, f"{point} populations", names, first, repeat)


def _count(population: Population, fraction: float) -> int:
    weights = population.weights or np.ones(population.most - population.least + 1)
    bounds = np.cumsum(weights)
    return population.least + int(np.searchsorted(bounds, fraction * bounds[-1], side="right"))


class _Sea:
    """What is in the water already, at some times of a sequence."""

    def __init__(self, scene: Scene, times: Floats, others: list[_Ball | _MovingBox]) -> None:
        self.scene, self.times, self.others = scene, times, others
        self.span = SequenceTimes(float(times[0]), float(times[-1]))
        beams = scene.sonar.beams
        middle = pose(scene.trajectory.sonar, self.span.middle)
        self.view = SonarView(middle, beams.azimuth_span, beams.elevation_span)

    @classmethod
    def of(cls, scene: Scene, seed: int, key: int | str) -> _Sea:
        """The targets of the recipe, the array, and the snaps."""
        trajectory, bottom = scene.trajectory, scene.world.environment.depth
        steps = evenly(trajectory.frames, TIMES)
        times = np.array([trajectory.time(step) for step in steps])
        sonar = np.array([pose(trajectory.sonar, t).position for t in times])
        others: list[_Ball | _MovingBox] = [_Ball(sonar, 0.5 * elements(scene.sonar.array).aperture)]
        for i, source in enumerate(scene.sources):
            snaps = [
                source.emissions(bottom, stream(seed, "snap", key, step, i), t)
                for step, t in zip(steps, times.tolist(), strict=True)
            ]
            for same_source in zip(*snaps, strict=False):
                others.append(_Ball(np.array([snap.position for snap in same_source]), 0.0))
        for target, mesh in zip(scene.world.targets, scene.meshes, strict=True):
            if mesh is relief_of(scene):
                continue  # bodies may be over it: `_ground`
            others.append(_MovingBox(tuple(pose(target.motion, t) for t in times), mesh.box))
        return cls(scene, times, others)

    def tried(self, population: Population, slot: int, draws: Floats) -> Target | None:
        """The body that draws make, which stays in the water for those after it; None where it does not fit."""
        position = population.region.place(draws[:3], self.view)
        if position is None:
            return None
        weights = np.cumsum([model.weight for model in population.models])
        number = int(np.searchsorted(weights, draws[-1] * weights[-1], side="right"))
        model = population.models[number]
        smallest, largest = model.scale
        attitude = population.orientation.attitude(draws[3:6])
        motion = population.track.motion(position, attitude, self.span, draws[6 : 6 + DRAWS])
        target = Target(
            name=population.slots[slot],
            shape=model.shape,
            motion=motion,
            scattering=model.scattering,
            category=model.category or population.name,
            clutter=population.clutter,
            scale=float(smallest * (largest / smallest) ** draws[-2]),
            mesh_scale=largest,
        )
        law = model.scattering or self.scene.physics.scattering
        try:
            mesh = target.base_mesh(law, self.scene.sonar.shortest_wavelength)
        except (ValueError, OSError) as error:
            at = ("scene", "world", "populations", self.scene.world.populations.index(population), "models", number)
            raise FieldError((*at, "shape"), str(error)) from None
        hull = target.scale * hull_of(mesh)
        if population.on_bottom:
            places = pose(motion, self.span.middle).to_world(hull)
            lowest, ground = float(places[:, 2].min()), self._ground(places)
            position = position + [0.0, 0.0, ground + ABOVE_BOTTOM - lowest]
            motion = population.track.motion(position, attitude, self.span, draws[6 : 6 + DRAWS])
            target = replace(target, motion=motion)
        poses = [pose(motion, t) for t in self.times.tolist()]
        ball = _round(mesh, target.scale, poses)
        apart = population.apart
        if not self._in_water(hull, poses) or any(other.gap(ball) < apart for other in self.others):
            return None
        self.others.append(ball)
        return target

    def _in_water(self, hull: Floats, poses: list[Pose]) -> bool:
        at_times = [at_time.to_world(hull) for at_time in poses]
        return all(float(p[:, 2].min()) > self._ground(p) and float(p[:, 2].max()) < 0.0 for p in at_times)

    def _ground(self, places: Floats) -> float:
        """z (m) of the highest ground in the circle round places (place, xyz)."""
        bottom, relief = -self.scene.world.environment.depth, relief_of(self.scene)
        if relief is None:
            return bottom
        centre = 0.5 * (places[:, :2].min(axis=0) + places[:, :2].max(axis=0))
        return bottom + highest_within(relief, centre, float(np.hypot(*(places[:, :2] - centre).T).max()))


def _round(mesh: Mesh, scale: float, poses: list[Pose]) -> _Ball:
    """The sphere round the box of a body at some times."""
    low, high = scale * mesh.box
    centre = np.array([at_time.to_world(0.5 * (low + high)) for at_time in poses])
    return _Ball(centre, 0.5 * float(np.linalg.norm(high - low)))


@lru_cache(maxsize=256)
def hull_of(mesh: Mesh) -> Floats:
    """Vertices (vertex, xyz) of a mesh that can be its highest or lowest: those of its convex hull."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.asarray(mesh.vertices[ConvexHull(mesh.vertices).vertices])
    except QhullError:  # flat
        return mesh.vertices
