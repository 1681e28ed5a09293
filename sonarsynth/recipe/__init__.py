"""A recipe: the seed, the scene, and which frames make the dataset. `frame(i)` is the only way to a frame."""

from __future__ import annotations

import hashlib
import json
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from annotated_types import Ge, Le
from pydantic import Discriminator, Tag, TypeAdapter

from sonarsynth.description import description, named_files
from sonarsynth.environment.noise import RecordedNoise
from sonarsynth.environment.readers import files_of
from sonarsynth.environment.sound_speed import Cast
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.recorded_track import RecordedTrack
from sonarsynth.propagation.ray_request import RayRequest
from sonarsynth.recipe.citation import Attribution
from sonarsynth.recipe.scene import Frame, Scene
from sonarsynth.recipe.sequences import MOST_SEQUENCES, Sequences
from sonarsynth.recipe.splits import Splits
from sonarsynth.recipe.tolerance import Accuracy
from sonarsynth.recipe.variation.grid import Axis, Zip, entry_tag
from sonarsynth.recipe.variation.mesh_variants import mesh_number, target_meshes
from sonarsynth.recipe.variation.named_paths import listed_values, numbered, numbered_variations
from sonarsynth.recipe.variation.random_variations import (
    Choice,
    Integers,
    LogUniform,
    Normal,
    Sobol,
    Uniform,
    Variation,
)
from sonarsynth.sources.noise_source import NoiseRecording
from sonarsynth.sources.snap_models import RecordedSnap
from sonarsynth.targets.shapes import MeshFile

__all__ = [
    "FILE_KINDS",
    "Accuracy",
    "Axis",
    "Choice",
    "Integers",
    "LogUniform",
    "Normal",
    "Recipe",
    "Sobol",
    "Splits",
    "Uniform",
    "Zip",
]

FILE_KINDS = frozenset(
    {cls.kind for cls in (MeshFile, Cast, RecordedSnap, NoiseRecording, RecordedNoise, RecordedTrack)}
)
"""Descriptions whose `path` names a file."""

Entry = Annotated[Annotated[Axis, Tag("axis")] | Annotated[Zip, Tag("zip")], Discriminator(entry_tag)]


@description
class Recipe:
    """A dataset: sequences of frames, drawn from one seed. The scene moves along its trajectory; a grid, variations and
    repeats make several sequences of it.
    """

    title: str = "sonarsynth dataset"
    """Title of the dataset, in a few words."""
    seed: Annotated[int, Ge(0)] = 0
    """Seed of everything that is drawn at random."""
    licence: str = "CC-BY-4.0"
    """Licence of the dataset (not of the software)."""
    dataset: Attribution = Attribution()
    """Who made it, how to cite it; changes no number, and is taken from the recipe when the store is begun."""
    accuracy: Accuracy = Accuracy()
    """How much the simulation may err; the planner chooses the cheapest methods that err no more."""
    scene: Scene
    """World, sonar, trajectory, physics and processing."""
    grid: tuple[Entry, ...] = ()
    """What the sequences span: every combination of the values of the entries, the last entry changing fastest."""
    variations: tuple[Variation, ...] = ()
    """What is drawn anew for each sequence."""
    repeats: Annotated[int, Ge(1), Le(MOST_SEQUENCES)] = 1
    """Sequences for each point of the grid."""
    splits: Splits | None = None
    """Shares of the sequences for training, validation and test; left out: all are for training."""
    rays: RayRequest | None = None
    """Rays to follow through the scene, for `sonarsynth rays`; they do not change the dataset."""

    @cached_property
    def spanned(self) -> Sequences:
        """The sequences."""
        world = self.scene.world
        grid, variations = numbered(world, self.grid), numbered_variations(world, self.variations)
        return Sequences(self.scene, self.seed, grid, variations, self.repeats, self.splits)

    @property
    def sequences(self) -> int:
        """Number of sequences of the whole dataset."""
        return self.spanned.count

    @property
    def frames(self) -> int:
        """Number of frames of the whole dataset."""
        return int(self.spanned.first_frames[-1])

    def first_frame(self, sequence: int) -> int:
        """Number of the first frame of a sequence."""
        return int(self.spanned.first_frames[sequence])

    def steps(self, sequence: int) -> int:
        """Number of frames of a sequence."""
        return int(self.spanned.steps[sequence])

    def sequence(self, index: int) -> int:
        """Which sequence a frame is of. Raises IndexError for a frame that is not there, TypeError for no number."""
        _must_be_whole(index)
        if not 0 <= index < self.frames:
            raise IndexError(f"frame {index} is outside 0..{self.frames - 1}")
        return int(np.searchsorted(self.spanned.first_frames, index, side="right")) - 1

    def scene_of(self, sequence: int) -> Scene:
        """Scene of a sequence. Raises IndexError outside 0..sequences-1, FieldError where it cannot be."""
        return self.spanned.scene(sequence)

    @cached_property
    def described(self) -> Scene:
        """The scene of the first sequence before its populations are drawn: what all sequences are like."""
        return self.spanned.described(0)

    @property
    def target_names(self) -> tuple[str, ...]:
        """Names of all targets that sequences may have: those of the recipe, then those of populations."""
        return self.described.world.target_names

    @property
    def meshes(self) -> dict[str, tuple[Mesh, ...]]:
        """The different meshes of each target of the recipe, and of each population, by its name. Raises FieldError."""
        return target_meshes(self.spanned)

    @property
    def mesh_groups(self) -> tuple[str, ...]:
        """Under which name of `meshes` those of each target are (target,)."""
        world = self.described.world
        drawn = (population.name for population in world.populations for _ in population.slots)
        return (*(target.name for target in world.targets), *drawn)

    def mesh_number(self, scene: Scene, target: int) -> int:
        """Which of its meshes a target of the scene of a sequence has."""
        return mesh_number(self.spanned, scene, target)

    @cached_property
    def categories(self) -> tuple[str, ...]:
        """What targets are called, in the order of the recipe."""
        world = self.described.world
        names = [target.category for target in world.targets]
        categories = (e for _, e in self.spanned.entries if any(path.endswith(".category") for path in e.path))
        names += [str(value.value) for entry in categories for value in listed_values(entry)]
        names += [p.category(n) for p in world.populations for n in range(len(p.models))]
        return tuple(dict.fromkeys(names))

    def frame(self, index: int) -> tuple[Scene, Frame]:
        """Scene and frame number `index`; raises IndexError outside 0..frames-1, FieldError where it cannot be."""
        sequence = self.sequence(index)
        scene = self.scene_of(sequence)
        key, step = self.spanned.key(sequence), index - self.first_frame(sequence)
        return scene, scene.frame(step, index=index, trajectory=sequence, seed=self.seed, key=key)

    def split(self, index: int) -> int:
        """Index into SPLITS of a frame; a sequence is never divided."""
        return int(self.spanned.split[self.sequence(index)])

    def as_json(self) -> dict[str, Any]:
        """The resolved recipe as plain JSON values."""
        value: dict[str, Any] = _ADAPTER.dump_python(self, mode="json")
        return value

    @cached_property
    def digest(self) -> str:
        """SHA-256 of everything in the recipe that decides numbers: descriptions, seed, and what the files hold.

        Where the files lie does not matter.
        """
        deciding = {name: value for name, value in self.as_json().items() if name not in ("rays", "dataset")}
        meshes = {name: [mesh.digest for mesh in variants] for name, variants in self.meshes.items()}
        text = json.dumps([_by_content(deciding), meshes], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def _must_be_whole(index: object) -> None:
    if not isinstance(index, int | np.integer) or isinstance(index, bool):
        raise TypeError(f"a frame is a whole number, not {index!r}")


def must_be_recipe(given: object, what: str) -> None:
    """Raise TypeError for what is no recipe, such as the path of one; what: is done with it, in a word."""
    if not isinstance(given, Recipe):
        raise TypeError(f"a recipe is {what}, not a {type(given).__name__}: sonarsynth.load reads one from a file")


def _by_content(value: Any) -> Any:
    """The same JSON value with the path of each file replaced by the digest of what it holds."""
    if isinstance(value, dict):
        path = value.get("path") if value.get("kind") in FILE_KINDS else None
        content = {"path": "+".join(map(named_files.digest, files_of(Path(path))))} if isinstance(path, str) else {}
        return {name: _by_content(v) for name, v in value.items()} | content
    return [_by_content(v) for v in value] if isinstance(value, list) else value


_ADAPTER: TypeAdapter[Recipe] = TypeAdapter(Recipe)
