"""What a scene needs: autos made concrete, windows, sizes, predicted cost, and what is left out with the bound on its error."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from sonarsynth.conventions import Floats, depth
from sonarsynth.description import FieldError
from sonarsynth.acoustics.spectra import pulse_support
from sonarsynth.products import Paths
from sonarsynth.recipe import Recipe
from sonarsynth.scene import Frame, Scene
from sonarsynth.sonar import Elements, elements
from sonarsynth.tracing import AutoTracing, Refracted, Straight
from sonarsynth.world.casts import profile_of
from sonarsynth.world.environment import Profile
from sonarsynth.world.meshes import mesh_of
from sonarsynth.world.water import absorption_db_per_m

PRODUCTS = ("signals", "image", "cloud")
"""What a build can be asked for; truth and ledger are always written."""

SHARD_BYTES = 64e6
"""A shard holds about this much of the largest array, and at most SHARD_FRAMES frames."""
SHARD_FRAMES = 8
MARGIN = 0.1e-3
"""Seconds added at both ends of every window: covers what straight rays leave out of an arrival time (< 2 us at 20 m in a
gradient of 4 per second; arrivals that still fall outside are counted in `/signals/outside`)."""


@dataclass(frozen=True)
class Stage:
    """One line of the plan."""

    stage: str
    method: str
    why: str
    error: str
    seconds: float  # predicted, one core, one frame
    bytes: int  # in the store, one frame


@dataclass(frozen=True)
class Omission:
    """Something that this scene does not need, and the bound on what leaving it out costs."""

    what: str
    why: str
    bound: str


@dataclass(frozen=True, eq=False)
class Windows:
    """When each frame listens; times on the clock of the frame."""

    start: Floats  # (frame,) s: first sample, a whole number of sampling intervals
    samples: int
    direct: Floats  # (frame,) s: predicted first direct arrival at the array centre
    echo_start: float  # s after the direct arrival
    echo_stop: float  # s after the direct arrival


@dataclass(frozen=True, eq=False)
class Plan:
    """A recipe with every choice made. Everything that a frame needs, and nothing that it computes."""

    recipe: Recipe
    products: frozenset[str]
    profile: Profile
    propagation: Straight | Refracted
    windows: Windows
    stages: tuple[Stage, ...] = ()
    left_out: tuple[Omission, ...] = ()
    warnings: tuple[str, ...] = ()
    sizes: dict[str, int] = field(default_factory=dict)
    shard_frames: int = SHARD_FRAMES

    @property
    def scene(self) -> Scene:
        return self.recipe.scene

    @cached_property
    def elements(self) -> Elements:
        """Elements of the array."""
        return elements(self.scene.sonar.array)

    @cached_property
    def digest(self) -> str:
        """Identity of the numbers that this plan makes: the recipe's digest and the products."""
        return self.recipe.digest

    def absorption(self, frequency: np.ndarray | float) -> Floats:
        """Absorption in dB/m at frequencies (Hz), at mid depth."""
        environment = self.scene.world.environment
        return absorption_db_per_m(environment.absorption, frequency, 0.5 * environment.depth)

    def connect(self, start: Floats, end: Floats) -> Paths:
        """Rays between pairs of points in this plan's water."""
        return self.propagation.connect(self.profile, self.scene.world.environment.depth, start, end)

    @property
    def predicted_seconds(self) -> float:
        """Seconds of one core for the whole dataset."""
        return self.recipe.frames * sum(s.seconds for s in self.stages)

    @property
    def predicted_bytes(self) -> int:
        """Bytes of the whole dataset before compression."""
        return self.recipe.frames * sum(s.bytes for s in self.stages)

    def as_json(self) -> dict[str, Any]:
        """The plan for a program: stages, left_out, predicted_seconds, predicted_bytes, sizes, windows."""
        return {
            "stages": [vars(s) for s in self.stages],
            "left_out": [vars(o) for o in self.left_out],
            "warnings": list(self.warnings),
            "predicted_seconds": self.predicted_seconds,
            "predicted_bytes": self.predicted_bytes,
            "sizes": self.sizes,
            "shard_frames": self.shard_frames,
            "window": {
                "samples": self.windows.samples,
                "echo_start": self.windows.echo_start,
                "echo_stop": self.windows.echo_stop,
            },
        }


def plan(recipe: Recipe, products: frozenset[str] = frozenset(PRODUCTS)) -> Plan:
    """Resolve a recipe: check the scene at every frame, make every choice, and predict sizes and cost.

    Raises FieldError, naming the field, for a body above the surface or in the bed, a sonar or shrimp out of the
    water, or a missing or broken mesh or cast. No frame is rendered.
    """
    from sonarsynth.costs import left_out, stages

    scene = recipe.scene
    profile = _read_inputs(scene)
    times = np.array([scene.trajectory.time(i) for i in range(recipe.frames)])
    _check_positions(scene, recipe)
    tracing = scene.physics.tracing
    if isinstance(tracing, AutoTracing):
        propagation: Straight | Refracted = Straight() if profile.uniform else Refracted()
    else:
        propagation = tracing
    windows = lay_windows(recipe, profile)
    sizes = _sizes(recipe, windows)
    frame_bytes = sizes["sensor"] * sizes["sample"] * (2 if scene.sonar.converter else 4)
    shard = int(np.clip(SHARD_BYTES // max(frame_bytes, 1), 1, SHARD_FRAMES))
    made = Plan(recipe, products, profile, propagation, windows, sizes=sizes, shard_frames=shard)
    notes = tuple(f"{t.name}: {note}" for t in scene.world.targets for note in mesh_of(t.shape).notes)
    del times
    return Plan(
        recipe, products, profile, propagation, windows, stages(made), left_out(made), notes, sizes, shard
    )


def _sizes(recipe: Recipe, windows: Windows) -> dict[str, int]:
    scene = recipe.scene
    beams = scene.sonar.beams
    snaps = sum(len(s.snap_times) for s in scene.world.shrimp)
    return {
        "frame": recipe.frames,
        "sensor": elements(scene.sonar.array).count,
        "sample": windows.samples,
        "elevation": beams.elevations,
        "azimuth": beams.azimuths,
        "target": len(scene.world.targets),
        "snap": snaps,
    }


def _read_inputs(scene: Scene) -> Profile:
    """Read the cast and the meshes, so that a missing or broken file is known before anything is computed."""
    world = ("scene", "world")
    try:
        profile = profile_of(scene.world.environment.sound_speed)
    except (ValueError, OSError) as error:
        raise FieldError((*world, "environment", "sound_speed"), str(error)) from None
    for i, target in enumerate(scene.world.targets):
        try:
            mesh_of(target.shape)
        except (ValueError, OSError) as error:
            raise FieldError((*world, "targets", i, "shape"), str(error)) from None
    try:
        elements(scene.sonar.array)
    except ValueError as error:
        raise FieldError(("scene", "sonar", "array"), str(error)) from None
    return profile


def _check_positions(scene: Scene, recipe: Recipe) -> None:
    """Every body, the array and every shrimp must be in the water at every frame."""
    bed = scene.world.environment.depth
    for i, shrimp in enumerate(scene.world.shrimp):
        position = shrimp.position
        down = -position[2] if len(position) > 2 else bed - shrimp.height
        if not 0 <= down <= bed:
            raise FieldError(("scene", "world", "shrimp", i, "position"), f"depth {down:g} m is outside the water (0 to {bed:g} m)")
    reach = elements(scene.sonar.array).position
    for step in range(recipe.frames):
        _, frame = recipe.frame(step)
        _check_depth(("scene", "trajectory", "sonar"), "the array", frame.sonar_pose.to_world(reach), bed, frame)
        for i, body in enumerate(frame.moment.bodies):
            path = ("scene", "world", "targets", i, "motion")
            _check_depth(path, f"target '{body.name}'", body.pose.to_world(_hull(body.mesh)), bed, frame)


def _hull(mesh: Any) -> Floats:
    """Vertices that bound the mesh in every direction: all of them up to 20 000, else the corners of its box."""
    if len(mesh.vertices) <= 20_000:
        return np.asarray(mesh.vertices)
    low, high = mesh.box
    return np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


def _check_depth(path: tuple[str | int, ...], what: str, points: Floats, bed: float, frame: Frame) -> None:
    shallow, deep = float(depth(points).min()), float(depth(points).max())
    if shallow < 0:
        raise FieldError(path, f"{what} is {-shallow:.3g} m above the surface at frame {frame.index}")
    if deep > bed:
        raise FieldError(path, f"{what} is {deep - bed:.3g} m below the bed at frame {frame.index}")


def lay_windows(recipe: Recipe, profile: Profile) -> Windows:
    """The sample window and the echo window that hold every direct arrival and echo of every frame.

    From geometry alone: the delay of each facet's echo along straight lines at the slowness averaged over the depths
    between its ends, and the support of the filtered snap.
    """
    scene = recipe.scene
    sonar = scene.sonar
    before, after = pulse_support(sonar, {s.snap for s in scene.world.shrimp})
    spans = np.array([_span(recipe.frame(i)[1], profile) for i in range(recipe.frames)])  # (frame, direct, first, last)
    direct, first_echo, last_echo = spans.T
    gate = scene.processing.echo_window
    earliest = np.nanmin(first_echo - direct, initial=np.inf) - before - MARGIN
    latest = np.nanmax(last_echo - direct, initial=-np.inf) + after + MARGIN
    if not np.isfinite(earliest + latest):  # nothing echoes: listen for a moment after the snap
        earliest, latest = after, after + 2e-3
    start = gate.start if gate.start is not None else max(earliest, after)
    stop = gate.stop if gate.stop is not None else max(latest, start + 1e-3)
    if stop <= start:
        raise FieldError(("scene", "processing", "echo_window", "stop"), f"must be after start ({start:g} s)")
    rate = sonar.sampling_frequency
    first = np.floor((direct - before - MARGIN) * rate) / rate
    last = np.maximum(direct + after + MARGIN, direct + stop + MARGIN)
    samples = int(np.ceil(np.max(last - first) * rate)) + 1
    return Windows(first, samples, direct, float(start), float(stop))


def _span(frame: Frame, profile: Profile) -> tuple[float, float, float]:
    """First direct arrival, first echo and last echo (s) of a frame at the array centre; NaN where there is none."""
    array = frame.sonar_pose.position
    snaps = frame.moment.snaps
    if not snaps:
        return 0.0, np.nan, np.nan
    direct = [s.time + _straight_time(profile, s.position, array) for s in snaps]
    echoes = [
        s.time + _straight_time(profile, s.position, points) + _straight_time(profile, points, array)
        for s in snaps
        for points in (b.pose.to_world(b.mesh.centroid) for b in frame.moment.bodies)
    ]
    if not echoes:
        return float(min(direct)), np.nan, np.nan
    return float(min(direct)), float(min(e.min() for e in echoes)), float(max(e.max() for e in echoes))


def _straight_time(profile: Profile, a: Floats, b: Floats) -> Floats:
    """Travel time (...) along the straight lines a to b (..., xyz): distance times the mean slowness of their depths."""
    if profile.uniform:
        return np.asarray(np.linalg.norm(a - b, axis=-1) / profile.speed[0])
    grid = np.unique(np.concatenate([profile.depth, np.linspace(0.0, max(depth(a).max(), depth(b).max()) + 1.0, 200)]))
    slowness = 1.0 / profile.at(grid)
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (slowness[1:] + slowness[:-1]) * np.diff(grid))])
    za, zb = depth(a), depth(b)
    level_ray = np.abs(za - zb) < 1e-6
    rise = np.where(level_ray, 1.0, zb - za)
    mean = (np.interp(zb, grid, integral) - np.interp(za, grid, integral)) / rise
    return np.asarray(np.linalg.norm(a - b, axis=-1) * np.where(level_ray, 1.0 / profile.at(za), mean))
