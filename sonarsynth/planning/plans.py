"""The plan of a recipe: every choice made, and nothing computed."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.products import Paths
from sonarsynth.recipe import Recipe
from sonarsynth.scene import Scene
from sonarsynth.sonar import Elements, elements
from sonarsynth.tracing import Refracted, Straight
from sonarsynth.world.environment import Profile
from sonarsynth.world.water import absorption_db_per_m

PRODUCTS = ("signals", "image", "cloud")
"""What a build can be asked for; truth and ledger are always written."""


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
    echo_start: float  # s after the direct arrival
    echo_stop: float  # s after the direct arrival
    disturbed: int  # frames in whose echo window other snaps, or their echoes, are heard as well


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
    shard_frames: int = 1

    @property
    def scene(self) -> Scene:
        """The scene of the recipe."""
        return self.recipe.scene

    @cached_property
    def elements(self) -> Elements:
        """Elements of the array."""
        return elements(self.scene.sonar.array)

    @cached_property
    def digest(self) -> str:
        """Identity of the numbers that this plan makes, whatever the products: the recipe's digest."""
        return self.recipe.digest

    def absorption(self, frequency: np.ndarray | float) -> Floats:
        """Absorption in dB/m at frequencies (Hz), at mid depth."""
        environment = self.scene.world.environment
        return absorption_db_per_m(environment.absorption, frequency, 0.5 * environment.depth)

    def connect(self, start: Floats, end: Floats) -> Paths:
        """Rays between pairs of points in this plan's water, those of the direct family."""
        return replace(self.propagation, bounces=0).connect(
            self.profile, self.scene.world.environment.depth, start, end
        )

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
