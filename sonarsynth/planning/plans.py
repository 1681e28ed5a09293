"""The plan of a recipe: every choice made, and nothing computed."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from sonarsynth.conventions import Floats, counted, depth
from sonarsynth.description import FieldError
from sonarsynth.description.memory import SHARD_COPIES, frame_bytes, frames_together
from sonarsynth.environment.absorption import DepthAbsorption
from sonarsynth.environment.sea import Profile
from sonarsynth.geometry.motion import pose
from sonarsynth.imaging.beam_envelopes import envelope_delays
from sonarsynth.planning.choices import Choices
from sonarsynth.planning.measured.absorption_error import StraightPaths, mean_absorption, passed_by, shape_error
from sonarsynth.planning.measured.chorus_reach import band_frequencies, chorus_reach
from sonarsynth.planning.measured.distant_chorus import DistantChorus, distant_chorus
from sonarsynth.planning.measured.ray_bending import propagation
from sonarsynth.planning.notes.scene_checks import check_shrimp, read_inputs
from sonarsynth.planning.plan_tables import Omission, Stage, as_html, as_text
from sonarsynth.propagation import Propagation
from sonarsynth.receiver import Elements, elements
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.rising_bottom import with_sources
from sonarsynth.recipe.scene import Frame, Scene
from sonarsynth.signals.chorus.chorus_arrivals import ChorusReach
from sonarsynth.signals.chorus.chorus_synthesis import check_length
from sonarsynth.sources import Source
from sonarsynth.state import Medium


@dataclass(frozen=True, eq=False)
class PulseDurations:
    """How long pulses are (s), before and after their collapse, over the whole aperture."""

    before: float
    after: float
    echo_before: float  # the part that the echo window must hold
    echo_after: float
    clear: float  # after the direct arrival: no echo window begins earlier, unless the direct pulse is taken out
    foot: float  # either side: what is farther out may be cut off an echo
    direct: float = 0.0  # either side of its peak: as long as a direct pulse is loud at a hydrophone
    late: float = 0.0  # root mean square delay, in ranging, of echoes that motion makes longest or shortest


@dataclass(frozen=True, eq=False)
class Windows:
    """When each frame listens; times on the clock of the frame."""

    start: Floats  # (frame,) s: first sample, a whole number of sampling intervals; NaN of a frame not looked at
    samples: int
    echo_start: float  # s after the direct arrival
    echo_stop: float  # s after the direct arrival
    supports: PulseDurations
    disturbed: int  # of the frames looked at: in whose echo window other snaps, or their echoes, are heard as well
    direct_removed: bool = False  # the direct pulse is taken out of what the image is made of
    cut: bool = False  # more of some echo than its feet is outside of the echo window
    tight: tuple[int, ...] = ()  # frames of the dataset whose echoes come soonest, and latest

    @property
    def echo(self) -> tuple[float, float]:
        """The echo window (start, stop): s after the direct arrival."""
        return self.echo_start, self.echo_stop

    @property
    def echo_duration(self) -> float:
        """Length (s) of the echo window."""
        return self.echo_stop - self.echo_start


@dataclass(frozen=True)
class Errors:
    """What a plan's choices err by."""

    expansion: float = float("nan")  # of signals, relative: of expanding paths over the array, and of faint ones
    uncut: float = float("nan")  # the same, where the array is not cut into subarrays
    synthesis: float = float("nan")  # of signals, relative to their peak
    ranging: float = float("nan")  # m: of the method that turns delays into places
    image: float = float("nan")  # dB: of the energy of beams, root mean square within 20 dB of the brightest


@dataclass(frozen=True, eq=False, repr=False)
class Plan:
    """A recipe with every choice made. Everything that a frame needs, and nothing that it computes."""

    recipe: Recipe
    products: frozenset[str]
    profile: Profile
    propagation: Propagation
    windows: Windows
    choices: Choices = field(default_factory=Choices)
    errors: Errors = field(default_factory=Errors)
    stages: tuple[Stage, ...] = ()
    left_out: tuple[Omission, ...] = ()
    warnings: tuple[str, ...] = ()
    validity: tuple[str, ...] = ()  # where formulas and laws hold and do not, as the store has it
    sizes: dict[str, int] = field(default_factory=dict)
    shard_frames: int = 1
    sequence: int = 0  # whose scene, profile and propagation these are
    odds: str = ""  # of finding targets in frames that were tried; "": none were, or no target is in view
    sources: tuple[Source, ...] | None = None  # in the place of the recipe's (`other_sources`); None: those

    @cached_property
    def scene(self) -> Scene:
        """The scene of the sequence."""
        scene = self.recipe.scene_of(self.sequence)
        return scene if self.sources is None else with_sources(scene, self.sources)

    def frame(self, index: int) -> Frame:
        """Frame number `index`, which is one of the sequence."""
        step, key = index - self.recipe.first_frame(self.sequence), self.recipe.spanned.key(self.sequence)
        return self.scene.frame(step, index=index, trajectory=self.sequence, seed=self.recipe.seed, key=key)

    def at(self, index: int) -> Plan:
        """The plan for a frame: with the scene, the water and the propagation of its sequence. Raises FieldError."""
        sequence = self.recipe.sequence(index)
        return self if sequence == self.sequence else _of_sequence(self, sequence)

    @property
    def makes_sound(self) -> bool:
        """Whether a product is made of sound: truth and paths are there without."""
        return bool(self.products - {"paths"})

    @property
    def looked_at(self) -> int:
        """Frames that were looked at."""
        return int(np.isfinite(self.windows.start).sum())

    @cached_property
    def elements(self) -> Elements:
        """Elements of the array."""
        return elements(self.scene.sonar.array)

    @cached_property
    def digest(self) -> str:
        """Identity of the numbers that this plan makes, whatever the products: the recipe's digest."""
        return self.recipe.digest

    @property
    def beam_delays(self) -> Floats:
        """Delays (delay,) in s after the start of the echo window at which levels of beams are stored."""
        return envelope_delays(self.windows.echo_duration, self.scene.sonar)

    def absorption(self, frequency: np.ndarray | float) -> Floats:
        """Absorption in dB/m at frequencies (Hz): the mean over the depths of the sequence's paths.

        That gives the spectrum its shape; at the centre of the band each path has its own (`Medium.absorbed`).
        """
        return mean_absorption(self.scene.world.environment.absorption, self._path_depths, frequency)

    @property
    def medium(self) -> Medium:
        """The water of the sequence."""
        return Medium(self.scene.world.environment, self.profile, self._absorption_at_depths)

    @cached_property
    def _absorption_at_depths(self) -> DepthAbsorption:
        """Absorption at the centre of the band."""
        environment = self.scene.world.environment
        return DepthAbsorption.of(environment.absorption, self.scene.sonar.band.centre, environment.depth)

    @cached_property
    def chorus(self) -> ChorusReach | None:
        """How far the chorus of the sequence is heard; none without one. Raises FieldError where its snaps are too long
        to be made."""
        described, sonar = self.scene.world.chorus, self.scene.sonar
        if described is None:
            return None
        position = pose(self.scene.trajectory.sonar, self.scene.trajectory.time(0)).position
        reach = chorus_reach(self.scene, self.profile, position, self.absorption(band_frequencies(sonar)))
        if reach is None:
            return None
        try:
            model, width = described.snap.at_depth(self.medium.depth), float(described.widths.max())
            speed = float(self.profile.at(depth(position)))
            check_length(model, width, self.elements, sonar, speed, self.absorption)
        except ValueError as error:
            raise FieldError(("scene", "world", "chorus", "snap"), str(error)) from None
        return reach

    @cached_property
    def distant_chorus(self) -> DistantChorus | None:
        """What the chorus of the sequence brings from beyond its reach; none where that is left out."""
        position = pose(self.scene.trajectory.sonar, self.scene.trajectory.time(0)).position
        return distant_chorus(self.scene, self.profile, position, self.absorption, self.chorus)

    @cached_property
    def _path_depths(self) -> StraightPaths:
        """The depths of the paths of the sequence, in its first, middle and last frame."""
        first, count = self.recipe.first_frame(self.sequence), self.recipe.steps(self.sequence)
        steps = sorted({0, count // 2, count - 1})
        return passed_by([self.frame(first + step) for step in steps])

    @cached_property
    def absorption_error(self) -> float:
        """Largest error (dB) of any path, anywhere in the band, from the one shape of spectrum for all."""
        environment, band = self.scene.world.environment, self.scene.sonar.band
        ends, bounces = (band.low, band.high), self.propagation.bounces
        return shape_error(environment.absorption, self._path_depths, ends, environment.depth, bounces)

    @property
    def predicted_seconds(self) -> float:
        """Seconds of one core for the whole dataset, by counts of work; `schedule.predict` knows better."""
        return self.recipe.frames * sum(s.seconds for s in self.stages)

    @property
    def frames_together(self) -> int:
        """Frames that go through each stage together where a dataset is built."""
        return frames_together(self.sizes["sensor"] * self.sizes["sample"], self.scene.parts_kept)

    @property
    def memory_bytes(self) -> float:
        """Bytes of memory that a process takes to make its largest frame and to write a shard."""
        facets = sum(len(mesh.faces) for mesh in self.scene.meshes)
        shard = min(self.shard_frames, self.recipe.frames) * sum(stage.bytes for stage in self.stages)
        samples = self.sizes["sensor"] * self.sizes["sample"]
        return frame_bytes(facets, samples, self.scene.parts_kept) + SHARD_COPIES * shard

    @property
    def predicted_bytes(self) -> int:
        """Bytes of the whole dataset before compression."""
        return self.recipe.frames * sum(s.bytes for s in self.stages)

    def __repr__(self) -> str:
        products = ", ".join(sorted(self.products)) or "truth"
        return f"<Plan {self.recipe.title!r}: {self.recipe.frames} frames of {products}; print it for its stages>"

    def __str__(self) -> str:
        return as_text(*self._printed)

    def _repr_html_(self) -> str:
        return as_html(*self._printed)

    @property
    def _printed(self) -> tuple[str, tuple[Stage, ...], tuple[Omission, ...], list[str]]:
        lines = [f"note: {warning}" for warning in self.warnings]
        lines.append(", ".join(counted(count, name) for name, count in self.sizes.items()))
        if self.odds:
            lines.append(f"in frames that were tried: {self.odds}")
        elif "image" in self.products and self.scene.sound_parts:
            lines.append("odds of finding targets: schedule.predict(plan).tried(plan) makes some frames and says them")
        return self.recipe.title, self.stages, self.left_out, lines

    def as_json(self) -> dict[str, Any]:
        """The plan for a program: stages, left_out, predicted_seconds, predicted_bytes, sizes, windows.

        Seconds of one core by counts of work, bytes before compression: `sonarsynth plan --json` has those of
        `schedule.predict` in their place.
        """
        return {
            "stages": [vars(s) for s in self.stages],
            "left_out": [vars(o) for o in self.left_out],
            "warnings": list(self.warnings),
            "validity": list(self.validity),
            "predicted_seconds": self.predicted_seconds,
            "predicted_bytes": self.predicted_bytes,
            "memory_bytes": self.memory_bytes,
            "sizes": self.sizes,
            "choices": self.choices.as_json(),
            "errors": {name: None if np.isnan(value) else value for name, value in vars(self.errors).items()},
            "shard_frames": self.shard_frames,
            "window": {
                "samples": self.windows.samples,
                "echo_start": self.windows.echo_start,
                "echo_stop": self.windows.echo_stop,
            },
            "frames_looked_at": self.looked_at,
            **self.recipe.spanned.as_json(),
        }


@lru_cache(maxsize=16)
def _of_sequence(plan: Plan, sequence: int) -> Plan:
    with plan.recipe.spanned.naming(sequence):
        scene = plan.recipe.scene_of(sequence)
        profile = read_inputs(scene)
        check_shrimp(scene)
        first, last = plan.recipe.first_frame(sequence), plan.recipe.first_frame(sequence + 1) - 1
        ends = (plan.recipe.frame(first)[1], plan.recipe.frame(last)[1])
    paths = propagation(scene, profile, ends, plan.recipe.accuracy.signal)
    return replace(plan, sequence=sequence, profile=profile, propagation=paths)
