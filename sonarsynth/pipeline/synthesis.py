"""What the hydrophones hear of a frame, from one expansion of its paths over the array or from one for each part; and
what the sonar makes of that: noise, converter."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import depth
from sonarsynth.pipeline.stage_times import mark_stage
from sonarsynth.planning import Plan, arrivals_of, frame_start
from sonarsynth.planning.noise_rows import part_names
from sonarsynth.products import Arrivals, Signals
from sonarsynth.randomness import stream
from sonarsynth.receiver.subarrays import Subarray, subarrays
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals import add_noise, convert


def frame_signals(plan: Plan, frame: Frame, arrivals: Arrivals) -> Signals:
    """Pressure at each hydrophone, without noise and converter; arrivals: those of the frame at the whole array.

    Where the array is cut into parts, paths are traced again to each of them. `outside` is that of the part that loses
    most. Raises ValueError for anything outside the water.
    """
    method, sonar, snaps = plan.choices.synthesis, plan.scene.sonar, frame.moment.snaps
    start, samples = frame_start(plan, frame), plan.windows.samples
    if plan.choices.subarrays == 1:
        return method.signals(arrivals, snaps, plan.elements, sonar, plan.absorption, start, samples)
    pressure, outside = np.zeros((plan.elements.count, samples), np.float32), 0
    for part in subarrays(plan.elements, plan.choices.subarrays):
        heard = subarray_signals(plan, frame, part)
        pressure[part.sensor], outside = heard.pressure, max(outside, heard.outside)
    return Signals(pressure, start, sonar.sampling_frequency, 0.0, 0, outside)


def subarray_signals(plan: Plan, frame: Frame, part: Subarray) -> Signals:
    """What a part of the array hears, of paths that are traced to it."""
    method, sonar, snaps = plan.choices.synthesis, plan.scene.sonar, frame.moment.snaps
    own, start = arrivals_of(plan, frame, part), frame_start(plan, frame)
    return method.signals(own, snaps, part.elements, sonar, plan.absorption, start, plan.windows.samples)


def digitise(plan: Plan, frame: Frame, signals: Signals) -> Signals:
    """Signals as the sonar has them: with ambient noise, through the converter; `plan` is that of the sequence.

    Each part of the noise has a stream of its own.
    """
    mark_stage("synthesise")
    sonar, pose = plan.scene.sonar, frame.sonar_pose
    sound_speed = float(plan.profile.at(depth(pose.position)))
    noises = plan.scene.world.environment.noises
    for number, (name, noise) in enumerate(zip(part_names(noises), noises, strict=True)):
        random = stream(frame.seed, "noise", frame.key, frame.step, *([number] if number else []))
        signals = add_noise(signals, noise, sonar, plan.elements, random, pose, sound_speed)
        mark_stage(name)
    return signals if sonar.converter is None else convert(signals, sonar.converter)
