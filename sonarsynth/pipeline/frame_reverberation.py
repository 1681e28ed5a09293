"""The reverberation of a frame: scatterers as they reach the array, and what the hydrophones hear of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sonarsynth.pipeline.stage_times import mark_stage
from sonarsynth.pipeline.synthesis import true_elements
from sonarsynth.planning import Plan, frame_start
from sonarsynth.planning.measured.reverberation_levels import frame_scatterers
from sonarsynth.planning.reverberation_rows import REVERBERATION
from sonarsynth.products import Signals
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals.pulse_sums.reverberation_synthesis import reverberation_pressure
from sonarsynth.tracing.reverberation.reverberation_arrivals import ReverberationArrivals


def frame_reverberation(plan: Plan, frame: Frame) -> ReverberationArrivals | None:
    """What bottom, surface and water scatter in a frame; `plan` is that of its sequence. None where nothing does."""
    if plan.scene.world.reverberation is None:
        return None
    return frame_scatterers(plan, frame, frame_start(plan, frame))


def with_reverberation(plan: Plan, frame: Frame, signals: Signals, arrivals: ReverberationArrivals | None) -> Signals:
    """Signals with the reverberation; `plan` is that of the frame's sequence."""
    if arrivals is None or not len(arrivals.delay):
        return signals
    mark_stage("synthesise")
    pressure = reverberation_pressure(
        arrivals,
        arrivals.emission,
        frame.moment.snaps,
        true_elements(plan, frame),
        plan.scene.sonar,
        plan.absorption,
        signals.start,
        signals.pressure.shape[1],
    )
    mark_stage(REVERBERATION)
    return replace(signals, pressure=np.asarray(signals.pressure + pressure))
