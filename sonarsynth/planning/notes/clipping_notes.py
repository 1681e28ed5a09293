"""Whether snaps are too loud for the converter: heard in some of the frames that a plan looks at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sonarsynth.conventions import depth, evenly
from sonarsynth.planning.measured.sampled_arrivals import behind_baffle, context_of, reception_of
from sonarsynth.planning.measured.sampled_frames import SampledScene
from sonarsynth.planning.plans import Plan
from sonarsynth.receiver.sensor_errors import drawn_errors
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals import channel_errors
from sonarsynth.signals.auto_synthesis import DEFAULT_ERROR, deposit_for
from sonarsynth.tracing.arrivals import trace

HEARD = 8
"""Frames that are heard, at most."""


def clipping_notes(plan: Plan, looks: Sequence[SampledScene]) -> list[str]:
    """In how many frames the snaps of the recipe exceed the full scale of the converter, and by how much at most."""
    if plan.scene.sonar.converter is None or not plan.sizes["emission"]:
        return []
    frames = [frame for look in looks if look.real for frame in look.frames if frame.moment.snaps]
    heard = [frames[n] for n in evenly(len(frames), HEARD)]
    over = np.array([excess(plan.at(frame.index), frame) for frame in heard])
    if not np.any(over > 0.0):
        return []
    return [
        f"snaps clip in {np.count_nonzero(over > 0.0)} of {len(heard)} frames that were heard, by up to "
        f"{over.max():.1f} dB: signals and levels are then too low (scene.sonar.converter.full_scale)"
    ]


def excess(plan: Plan, frame: Frame) -> float:
    """Level (dB) of the largest pressure of the direct pulses of a frame over the full scale of the converter; without
    echoes, noise and chorus. `plan` is that of the frame's sequence, whose sonar has a converter."""
    sonar = plan.scene.sonar
    assert sonar.converter is not None
    arrivals = trace(replace(context_of(plan, frame), bodies=(), laws=()), plan.propagation)
    heard = behind_baffle(arrivals, sonar)
    signals = deposit_for(DEFAULT_ERROR).signals(heard, frame.moment.snaps, reception_of(plan, frame))
    if sonar.sensor_errors is not None:
        drawn = drawn_errors(sonar.sensor_errors, plan.elements.count, frame.seed, frame.key)
        speed = float(plan.profile.at(depth(frame.sonar_pose.position)))
        signals = channel_errors.respond(signals, drawn, speed)
    peak = float(np.abs(signals.pressure).max(initial=0.0))
    return float(20.0 * np.log10(max(peak, 1e-300) / sonar.converter.full_scale))
