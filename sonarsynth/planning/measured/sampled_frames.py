"""Which frames a plan looks at: all of them, or so many of a large dataset that the look stays short."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

from sonarsynth.conventions import evenly
from sonarsynth.description import FieldError
from sonarsynth.environment.sea import Profile
from sonarsynth.planning.notes.scene_checks import check_frame, check_shrimp, read_inputs
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import Frame, Scene

MAX_SAMPLED_FRAMES = 2000
"""Frames that a plan looks at; of a larger dataset so many, spread evenly, first and last steps among them."""
SEQUENCE_SAMPLES = 8
"""Sequences of such a dataset whose variations are also looked at one by one at their ends."""
MAX_SEQUENCE_SAMPLES = 200
"""Scenes with a variation at an end, at most."""


@dataclass(frozen=True, eq=False)
class SampledScene:
    """Frames of one scene."""

    scene: Scene
    profile: Profile
    frames: tuple[Frame, ...]
    real: bool = True  # False: no sequence, but a scene with a variation at its end


def sample_frames(recipe: Recipe) -> tuple[SampledScene, ...]:
    """The frames to look at, each checked: everything in the water, every file there, all scenes alike in shape.

    Raises FieldError that names the field, the frame and the values of the sequence.
    """
    steps = sampled_frames(recipe)
    looks = []
    for sequence, chosen_steps in steps.items():
        with recipe.spanned.naming(sequence):
            scene = recipe.scene_of(sequence)
            check_alike(recipe.described, scene)
            profile = read_inputs(scene)
            check_shrimp(scene)
            frames = tuple(recipe.frame(recipe.first_frame(sequence) + step)[1] for step in chosen_steps)
            for frame in frames:
                check_frame(scene, frame)
        looks.append(SampledScene(scene, profile, frames))
    if sum(len(look.frames) for look in looks) < recipe.frames:
        looks += islice(_ends(recipe), MAX_SEQUENCE_SAMPLES)
    return tuple(looks)


def sampled_frames(recipe: Recipe) -> dict[int, list[int]]:
    """Steps to look at of each sequence."""
    count = recipe.sequences
    if recipe.frames <= MAX_SAMPLED_FRAMES:
        return {sequence: list(range(recipe.steps(sequence))) for sequence in range(count)}
    frames_each = min(max(MAX_SAMPLED_FRAMES // count, 2), int(recipe.spanned.steps.max()))
    sequences = evenly(count, MAX_SAMPLED_FRAMES // frames_each)
    return {sequence: evenly(recipe.steps(sequence), frames_each) for sequence in sequences}


def _ends(recipe: Recipe) -> Iterator[SampledScene]:
    """Scenes with each variation at its ends: they bound the windows, and need not be good."""
    for sequence in evenly(recipe.sequences, SEQUENCE_SAMPLES):
        for scene in recipe.spanned.extremes(sequence):
            try:
                profile = read_inputs(scene)
                frames = tuple(scene.frame(step) for step in evenly(scene.trajectory.frames, 3))
                for frame in frames:
                    check_frame(scene, frame)
            except FieldError:
                continue
            yield SampledScene(scene, profile, frames, real=False)


def check_alike(first: Scene, second: Scene) -> None:
    """Raises FieldError unless two scenes have targets of the same names, and as many sources: the store's axes.

    Of the second, bodies of populations have been drawn: these come and go.
    """
    world, others = ("scene", "world"), second.world
    drawn = {name for population in first.world.populations for name in population.slots}
    described = tuple(target for target in others.targets if target.name not in drawn)
    for field, own, more in (
        ("targets", first.world.targets, described),
        ("sources", first.world.sources, others.sources),
    ):
        if len(own) != len(more):
            raise FieldError((*world, field), f"all sequences must have equally many: {len(own)} and {len(more)}")
    for i, (a, b) in enumerate(zip(first.world.targets, described, strict=True)):
        if a.name != b.name:
            raise FieldError(
                (*world, "targets", i, "name"), f"must be the same in all sequences: '{a.name}' and '{b.name}'"
            )
