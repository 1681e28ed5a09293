"""A stretch of the sound of a recipe without targets and listed snaps, by the code that makes its frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sonarsynth.conventions import depth
from sonarsynth.evaluation.soundscape.sound import (
    BLOCK,
    FEWEST_BLOCKS,
    LEAST_SECONDS,
    MOST_SAMPLES,
    ArrivalElevations,
    NothingHeard,
    Sound,
    listeners,
    model_notes,
)
from sonarsynth.pipeline.frame_chorus import frame_chorus, with_chorus
from sonarsynth.pipeline.synthesis import digitise
from sonarsynth.planning import Plan, Windows
from sonarsynth.planning.measured.ray_bending import propagation
from sonarsynth.planning.notes.scene_checks import check_shrimp, read_inputs
from sonarsynth.planning.plans import PulseDurations
from sonarsynth.products import Signals
from sonarsynth.receiver import PositionTable, elements
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import Frame

LONGEST_BLOCK = 1 << 18
"""Samples."""


def listening_plan(recipe: Recipe, seconds: float = 1.0) -> Plan:
    """The plan of so much sound of the first sequence of a recipe, at a few hydrophones, without errors of sensors.

    Raises FieldError as `planning.plan` does, NothingHeard where the recipe has neither chorus nor noise, or so many
    seconds of it are too many samples.
    """
    scene = recipe.scene_of(0)
    world, sonar = scene.world, scene.sonar
    silent = world.chorus is None or world.chorus.rate == 0.0
    if silent and not world.environment.noises:
        raise NothingHeard(
            "the recipe has neither scene.world.chorus nor scene.world.environment.noise: there is no soundscape"
        )
    array = elements(sonar.array)
    used = listeners(array, np.ones(array.count, bool))
    if not seconds >= LEAST_SECONDS:
        raise NothingHeard(f"{seconds:g} s are too short to measure: make {LEAST_SECONDS:g} s at least")
    if (total := seconds * sonar.sampling_frequency * len(used)) > MOST_SAMPLES:
        raise NothingHeard(
            f"{seconds:g} s at {len(used)} hydrophones are {total:.3g} samples, more than {MOST_SAMPLES:.3g}: make less"
        )
    table = PositionTable(positions=tuple(map(tuple, array.position[used].tolist())), face=array.face)
    scene = replace(scene, sonar=replace(sonar, array=table, sensor_errors=None), world=replace(world, targets=()))
    alone = Recipe(seed=recipe.seed, accuracy=recipe.accuracy, scene=scene)
    profile = read_inputs(scene)
    check_shrimp(scene)
    rate = sonar.sampling_frequency
    samples = int(min(min(BLOCK, seconds / FEWEST_BLOCKS) * rate, LONGEST_BLOCK))
    none = PulseDurations(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    windows = Windows(np.zeros(scene.trajectory.frames), samples, 0.0, samples / rate, none, 0)
    paths = propagation(scene, profile, (recipe.frame(0)[1],), recipe.accuracy.signal)
    return Plan(alone, frozenset({"signals"}), profile, paths, windows)


def made_sound(plan: Plan, first: Frame, seconds: float) -> Sound:
    """So much of the sound that a sonar at rest hears from a frame on; `plan` is that of `listening_plan`."""
    sonar, samples = plan.scene.sonar, plan.windows.samples
    long = samples / sonar.sampling_frequency
    count = max(round(seconds / long), 2)
    pressure = np.empty((count, plan.elements.count, samples), np.float32)
    sines, energies = [], []
    for number in range(count):
        moment = replace(first.moment, time=first.time + number * long, bodies=())
        frame = replace(
            first, step=first.step + number, moment=moment, sonar_velocity=np.zeros(3), sonar_motion=None, index=0
        )
        quiet = Signals(np.zeros((plan.elements.count, samples), np.float32), 0.0, sonar.sampling_frequency, 0.0, 0, 0)
        arrivals = frame_chorus(plan, frame)
        pressure[number] = digitise(plan, frame, with_chorus(plan, frame, quiet, arrivals)).pressure
        if arrivals is not None:
            inside = arrivals.select((arrivals.delay >= 0.0) & (arrivals.delay < long))
            sines.append(first.sonar_pose.turn_to_world(inside.direction)[:, 2])
            energies.append(inside.gain**2 * 10.0 ** (-inside.absorption / 10.0))
    angles = ArrivalElevations(np.concatenate(sines), np.concatenate(energies), None, count * long) if sines else None
    return Sound(
        pressure=pressure,
        sampling_frequency=sonar.sampling_frequency,
        position=plan.elements.position,
        running=True,
        band=(sonar.band.low, sonar.band.high),
        arrivals=angles,
        notes=_notes(plan),
    )


def _notes(plan: Plan) -> tuple[str, ...]:
    description = (
        f"{plan.elements.count} hydrophones at rest at {depth(plan.recipe.frame(0)[1].sonar_pose.position):.3g} m, "
        "without targets, listed snaps and errors of sensors"
    )
    return (description, *model_notes(plan.scene))
