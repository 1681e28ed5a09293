"""The reverberation of a frame: its paths to the array, and their pressure at the hydrophones."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from sonarsynth.conventions import NO_TARGET
from sonarsynth.pipeline.stage_times import mark_stage
from sonarsynth.pipeline.synthesis import true_elements
from sonarsynth.planning import Plan, frame_start
from sonarsynth.planning.measured.reverberation_levels import frame_scatterers
from sonarsynth.planning.reverberation_rows import REVERBERATION
from sonarsynth.products import Arrivals, Kind, Signals
from sonarsynth.products.array_expansion import ArrayExpansion
from sonarsynth.products.pulse_arrivals import ReverberationArrivals
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals.pulse_sums.reverberation_synthesis import reverberation_pressure


def frame_reverberation(plan: Plan, frame: Frame) -> ReverberationArrivals | None:
    """Paths by what scatters in bottom, surface and water; `plan` is that of the frame's sequence. None without any."""
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
        frame.moment.snaps,
        true_elements(plan, frame),
        plan.scene.sonar,
        plan.absorption,
        signals.start,
        signals.pressure.shape[1],
    )
    mark_stage(REVERBERATION)
    return replace(signals, pressure=np.asarray(signals.pressure + pressure))


def scattered_paths(plan: Plan, arrivals: Arrivals, scattered: ReverberationArrivals | None) -> Arrivals | None:
    """Reverberation in the form of arrivals with spherical wavefronts, for the labels of points."""
    if scattered is None or not len(scattered.delay):
        return None
    count, length = len(scattered.delay), scattered.length + scattered.before
    loss = length * float(plan.absorption(np.array([arrivals.centre]))[0])
    nothing = {
        n: np.zeros((count, *v.shape[1:]), v.dtype) for n, v in vars(arrivals).items() if isinstance(v, np.ndarray)
    }
    known: dict[str, Any] = {
        "delay": scattered.delay,
        "direction": scattered.direction,
        "radius": scattered.length,
        "length": length,
        "amplitude": scattered.gain * 10.0 ** (-loss / 20.0),
        "absorption": loss,
        "phase": scattered.phase,
        "delay_std": scattered.delay_std,
        "kind": np.full(count, Kind.REVERBERATION, np.int8),
        "snap": scattered.emission,
        "target": np.full(count, NO_TARGET),
        "facet": np.full(count, NO_TARGET),
    }
    return replace(arrivals, **(nothing | known), expansion=ArrayExpansion.none(count))
