"""A scene: the world, the sonar in it, when frames are taken, and the methods that simulate and process them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from annotated_types import Ge, Gt, Le, MaxLen
from pydantic import Field, ValidationInfo, field_validator

from sonarsynth.conventions import Decibels, Floats, PositiveSeconds, Seconds
from sonarsynth.description import FieldError, description
from sonarsynth.environment.reverberation import Reverberation
from sonarsynth.environment.scatterers import ScattererField
from sonarsynth.environment.sea import Environment
from sonarsynth.geometry import Pose
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.motion import Motion, Still, Track, pose, velocity
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.imaging import AutoBeamforming, Beamformer
from sonarsynth.products import DIRECT
from sonarsynth.propagation import AutoTracing, Tracing
from sonarsynth.randomness import stream
from sonarsynth.ranging import AutoPlacing, Cancelling, Locator, Peaks, Picking, Placing, SensorDelays
from sonarsynth.receiver import Sonar
from sonarsynth.recipe.populations.population import Population
from sonarsynth.scattering import MirrorLobe, Scatterers, Scattering
from sonarsynth.signals import AutoSynthesis, Synthesis
from sonarsynth.sources import Source
from sonarsynth.sources.chorus import Chorus
from sonarsynth.sources.noise_source import NoiseSource
from sonarsynth.sources.sound_source import SoundSource
from sonarsynth.state import Emission, WorldState
from sonarsynth.targets.relief import Relief
from sonarsynth.targets.target import Target

MOST = 500
"""Targets of a scene; snaps of a frame."""


@description
class World:
    """What there is."""

    environment: Environment
    """The water, its surface and its bottom."""
    targets: tuple[Target, ...] = ()
    """Bodies in the water."""
    sources: tuple[Source, ...] = ()
    """What makes the sound."""
    scatterers: Annotated[tuple[ScattererField, ...], MaxLen(100)] = ()
    """What scatters sound and belongs to no target: pieces of the bottom, stones."""
    noise_sources: tuple[NoiseSource, ...] = ()
    """What sounds all the time from one place, and lights nothing: ships, animals."""
    relief: Relief | None = None
    """What of the bottom rises over its mean plane; left out: it is flat."""
    populations: Annotated[tuple[Population, ...], MaxLen(100)] = ()
    """Targets that are drawn anew for each sequence."""
    chorus: Chorus | None = None
    """All the other snaps of the sea, which are heard but light nothing; left out: there are none."""
    reverberation: Reverberation | None = None
    """What bottom, surface and water scatter of the sound of the sources; left out: nothing but `scatterers` does."""

    @field_validator("targets")
    @classmethod
    def _check_names(cls, targets: tuple[Target, ...]) -> tuple[Target, ...]:
        names = set[str]()
        for target in targets:
            if target.name == DIRECT:
                raise ValueError(f"no target can be called '{DIRECT}': in the link budget that is the path without one")
            if target.name in names:
                raise ValueError(f"two targets are called '{target.name}'")
            names.add(target.name)
        return targets

    @field_validator("populations")
    @classmethod
    def _check_population_names(cls, listed: tuple[Population, ...], info: ValidationInfo) -> tuple[Population, ...]:
        taken = {target.name: target.name for target in info.data.get("targets", ())} | {DIRECT: DIRECT}
        for population in listed:
            for name in (population.name, *population.slots):
                if name in taken:
                    raise ValueError(f"'{name}' of population '{population.name}' is the name of '{taken[name]}' too")
                taken[name] = population.name
        if len(info.data.get("targets", ())) + sum(population.most for population in listed) > MOST:
            raise ValueError(f"more than {MOST} targets with those of the recipe")
        return listed

    @property
    def target_names(self) -> tuple[str, ...]:
        """Names of all targets that may be there: those of the recipe, then those of populations."""
        drawn = (name for population in self.populations for name in population.slots)
        return (*(target.name for target in self.targets), *drawn)

    @field_validator("targets", "sources")
    @classmethod
    def _check_count(cls, several: tuple[Any, ...], info: ValidationInfo) -> tuple[Any, ...]:
        snaps = info.field_name == "sources"
        count = sum(len(source.times) for source in several) if snaps else len(several)
        if count > MOST:
            raise ValueError(f"{count} {'snaps' if snaps else 'targets'} are more than {MOST}")
        return several


@description
class Trajectory:
    """When frames are taken, and how the sonar moves."""

    frames: Annotated[int, Ge(1), Le(10_000_000)] = 1
    """Number of frames."""
    interval: PositiveSeconds = 0.1
    """Time from one frame to the next."""
    start: Seconds = 0.0
    """Time of the first frame since the start of the motions."""
    sonar: Motion = Still(position=(0.0, 0.0, -5.0), heading=0.5 * np.pi)
    """How the sonar moves and looks. Left out: at rest 5 m deep, looking east; motions without a heading look north."""

    def time(self, step: int) -> float:
        """Time (s) of a frame since the start of the motions."""
        return self.start + step * self.interval


@description
class Physics:
    """How the scene is simulated."""

    tracing: Tracing = Field(default_factory=AutoTracing)
    """How sound travels."""
    scattering: Scattering = Field(default_factory=MirrorLobe)
    """How facets scatter it, of targets that do not say so themselves."""
    subarrays: Literal["auto", "sensors"] | Annotated[int, Ge(1), Le(100_000)] = "auto"
    """Parts that the array is cut into: paths are traced to the middle of each and expanded from there to its
    hydrophones. `sensors`: each by itself; `auto`: as few as accuracy allows. Of images: `processing.beamforming`."""
    occlusion: Literal["auto", "centre", "sensors"] = "auto"
    """From where bodies hide facets: from the middle of the array (or part) for all, or from each sensor by itself.
    `auto`: the latter where the accuracy of the recipe asks for it."""
    dynamic_range: Literal["auto"] | Annotated[Decibels, Gt(0), Le(300)] = "auto"
    """The faintest echoes of each target are left out, all of them together this far below the whole echo."""
    synthesis: Synthesis = Field(default_factory=AutoSynthesis)
    """How signals are made from arrivals."""
    doppler: bool = True
    """Whether targets and sonar move while sound is under way; false: all is where it is at the frame's instant."""


@description
class EchoWindow:
    """When the sonar listens for echoes, in seconds after the direct arrival of the snap.

    Left out, the planner takes the shortest window that holds the echoes of every frame, and in narrow bands and of
    long pulses noise to tell them from.
    """

    start: Annotated[Seconds, Ge(0)] | None = None
    """Begin of the window after the direct arrival."""
    stop: PositiveSeconds | None = None
    """End of the window after the direct arrival."""


@description
class Processing:
    """What the sonar does with what it hears."""

    echo_window: EchoWindow = Field(default_factory=EchoWindow)
    """When the sonar listens for echoes."""
    locating: Locator = Field(default_factory=SensorDelays)
    """How the snap is located."""
    cancelling: Cancelling | None = None
    """How the snap's own reflections are taken out of the signals before imaging; left out: they stay in."""
    direct_pulse: Literal["auto", "keep", "remove"] = "auto"
    """Whether the direct pulse of the loudest snap is taken out of the signals before imaging, and the echo window
    opens while it lasts. `auto`: where the echo window would otherwise cut echoes; `keep`: the window opens after it.
    But for `keep`, direct pulses of other located snaps are taken out wherever they are heard in the echo window."""
    beamforming: Beamformer = Field(default_factory=AutoBeamforming)
    """How the energy image is made."""
    picking: Picking = Field(default_factory=Peaks)
    """Which peaks of the beams are echoes."""
    placing: Placing = Field(default_factory=AutoPlacing)
    """How delays and directions become places."""
    max_points: Annotated[int, Ge(1), Le(1_000_000)] = 4096
    """Room for points of a frame in the store: the loudest are kept, and how many were left out is stored."""


@description
class Scene:
    """World, sonar, trajectory, physics and processing."""

    world: World
    """What there is."""
    sonar: Sonar = Field(default_factory=Sonar)
    """The sonar that listens."""
    trajectory: Trajectory = Field(default_factory=Trajectory)
    """When frames are taken, and how the sonar moves."""
    physics: Physics = Field(default_factory=Physics)
    """How the scene is simulated."""
    processing: Processing = Field(default_factory=Processing)
    """What the sonar does with what it hears."""

    @property
    def sources(self) -> tuple[SoundSource, ...]:
        """What makes the sound, what is mounted on the sonar with it."""
        return tuple(source.mounted_on(self.trajectory.sonar) for source in self.world.sources)

    @property
    def laws(self) -> tuple[Scattering, ...]:
        """How each target scatters."""
        return tuple(t.scattering or self.physics.scattering for t in self.world.targets)

    @property
    def meshes(self) -> tuple[Mesh, ...]:
        """What each target is traced with: kept by content, so that asking again costs nothing."""
        return tuple(self.mesh_of(i) for i in range(len(self.world.targets)))

    @property
    def sound_parts(self) -> tuple[str, ...]:
        """What echoes are heard against."""
        world = self.world
        present = {
            "chorus": world.chorus is not None,
            "reverberation": world.reverberation is not None or bool(world.scatterers),
            "noise": bool(world.environment.noises or world.noise_sources),
            "electronics": self.sonar.electronics is not None,
        }
        return tuple(name for name, is_present in present.items() if is_present)

    @property
    def parts_kept(self) -> int:
        """Parts of the sound of a frame that its signal to noise is taken of, echoes of each target by themselves."""
        return len(self.sound_parts) + len(self.world.targets) if self.sound_parts else 0

    def mesh_of(self, target: int) -> Mesh:
        """What a target is traced with. Raises ValueError, or OSError, where it has no mesh."""
        return self.world.targets[target].mesh(self.laws[target], self.sonar.shortest_wavelength)

    def moment(self, time: float, *, key: int | str = 0, step: int = 0, seed: int = 0) -> WorldState:
        """The world at a time (s), with the snaps that a frame of the sequence of this key, step and seed draws."""
        bodies = tuple(
            PlacedTarget(t.name, mesh, pose(t.motion, time), velocity(t.motion, time), t.motion, time)
            for t, mesh in zip(self.world.targets, self.meshes, strict=True)
        )
        bottom = self.world.environment.depth
        snaps: list[Emission] = []
        for i, source in enumerate(self.sources):
            snaps += source.emissions(bottom, stream(seed, "snap", key, step, i), time)
        loose = list[Scatterers]()
        for i, field in enumerate(self.world.scatterers):
            try:
                loose.append(field.checked_scatterers(bottom, stream(seed, "scatterers", key, i)))
            except ValueError as error:
                raise FieldError(("scene", "world", "scatterers", i), str(error)) from None
        return WorldState(time, bodies, tuple(snaps), scatterers=tuple(loose))

    def frame(
        self,
        step: int,
        *,
        index: int | None = None,
        trajectory: int = 0,
        seed: int = 0,
        key: int | str | None = None,
    ) -> Frame:
        """Frame `step` of this scene's trajectory; `key` of its random streams (left out: the trajectory)."""
        key = trajectory if key is None else key
        time = self.trajectory.time(step)
        return Frame(
            index=step if index is None else index,
            trajectory=trajectory,
            step=step,
            seed=seed,
            key=key,
            sonar_pose=pose(self.trajectory.sonar, time),
            sonar_velocity=velocity(self.trajectory.sonar, time),
            sonar_motion=self.trajectory.sonar,
            moment=self.moment(time, key=key, step=step, seed=seed),
        )


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame: the scene at one instant, and the keys of its random streams."""

    index: int  # in the dataset
    trajectory: int  # sequence
    step: int  # within the sequence
    seed: int
    key: int | str  # of the sequence: random streams are keyed (seed, name, key, step)
    sonar_pose: Pose
    sonar_velocity: Floats  # (xyz) m/s, world
    moment: WorldState
    sonar_motion: Motion | None = None  # None: it goes on at its velocity, and does not turn

    @property
    def sonar_track(self) -> Track:
        """Where the sonar is about the instant of the frame."""
        return Track(self.sonar_pose, self.sonar_velocity, self.sonar_motion, self.time)

    @property
    def time(self) -> float:
        """s since the start of the trajectory."""
        return self.moment.time
