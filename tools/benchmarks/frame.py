"""`tools/bench frame`: one core, stage by stage, against the thesis and Acoular, each with its error. Prints JSON."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.timing import RECIPE, cpu, once
from sonarsynth import pipeline, planning
from sonarsynth.frontiers.image_knobs import apart
from sonarsynth.frontiers.peers import acoular_image, likeness, thesis_image, thesis_pulse
from sonarsynth.imaging import DenseDelayAndSum, FocusedDelayAndSum
from sonarsynth.imaging.image_window import snapshots_of
from sonarsynth.pipeline import BeamformedFrame, cloud_of
from sonarsynth.products import Arrivals, EnergyImage, Signals
from sonarsynth.recipe import reading
from sonarsynth.signals import DirectSum

PATHS = 2000
THESIS_BEAMS = 150


def thin(arrivals: Arrivals, paths: int) -> Arrivals:
    """The direct path and `paths` echoes, evenly taken: the size that the aim is stated for."""
    echoes = np.flatnonzero(~arrivals.direct)
    chosen = echoes[np.linspace(0, len(echoes) - 1, min(paths, len(echoes))).astype(int)]
    return arrivals.select(np.concatenate([np.flatnonzero(arrivals.direct), chosen]))


def relative(got: np.ndarray, exact: np.ndarray) -> float:
    """Largest error over the largest exact value."""
    return float(np.nanmax(np.abs(got - exact)) / np.nanmax(np.abs(exact)))


def bench(index: int = 32) -> dict[str, Any]:
    """Measure one frame of the remus scene."""
    plan = planning.plan(reading.load(RECIPE))
    sonar, stages = plan.scene.sonar, dict[str, dict[str, Any]]()
    full, seconds = cpu(lambda: pipeline.trace_frame(plan, index))
    stages["trace and label"] = {"ms": 1e3 * seconds, "facets": len(full.frame.moment.bodies[0].mesh.faces)}
    traced = replace(full, arrivals=thin(full.arrivals, PATHS))
    signals, again = cpu(lambda: pipeline.synthesise(plan, traced))
    new = {"ms": 1e3 * synthesis_of_new_frames(plan), "ms_same_frame_again": 1e3 * again}
    stages["synthesise"] = new | synthesis_error(plan, traced)
    receiver, survey = planning.receiver_of(plan, traced.frame), planning.survey_of(plan, traced.frame)
    located, seconds = cpu(
        lambda: plan.scene.processing.locating.locate(signals, receiver, survey, plan.sizes["emission"])
    )
    off = located.position[0] - receiver.pose.to_body(traced.frame.moment.snaps[0].position)
    stages["locate"] = {"ms": 1e3 * seconds, "error_m": float(np.linalg.norm(off))}
    start, stop = (float(located.time[0]) + t for t in (plan.windows.echo_start, plan.windows.echo_stop))
    beamformer = plan.choices.beamforming
    image, image_seconds = cpu(lambda: beamformer.image(signals, plan.elements, sonar, start, stop))
    dense, dense_seconds = cpu(
        lambda: DenseDelayAndSum(focus=beamformer.focus).image(signals, plan.elements, sonar, start, stop), 1
    )
    plane = [method(focus=None) for method in (type(beamformer), DenseDelayAndSum)]
    kernel, check = (method.image(signals, plan.elements, sonar, start, stop).energy for method in plane)
    stages["beamform"] = {
        "ms": 1e3 * image_seconds,
        "error_of_peak_kernel": relative(kernel, check),  # the same plane waves, sensor by sensor
        "error_of_peak_focus": relative(image.energy, dense.energy),  # separable against spherical focusing
    }
    if isinstance(beamformer, FocusedDelayAndSum):
        axial, seconds = cpu(
            lambda: replace(beamformer, subarrays="axis").image(signals, plan.elements, sonar, start, stop)
        )
        stages["beamform"] |= {
            **likeness(image.energy, dense.energy),
            "focus_of_the_axis": {"ms": 1e3 * seconds, **likeness(axial.energy, dense.energy)},
        }

    beams = beamformer.beams(snapshots_of(signals, sonar, start, stop), plan.elements, sonar)

    def cloud(of: EnergyImage) -> Any:
        return cloud_of(plan, traced.frame, BeamformedFrame(signals, located, of, signals, beams))

    points, seconds = cpu(lambda: cloud(image))
    difference, _, _ = apart(points, cloud(dense))
    stages["range"] = {
        "ms": 1e3 * seconds,
        "points": int(np.isfinite(points.range).sum()),
        "largest_difference_m": float(np.max(difference, initial=0.0)),
    }
    aimed = sum(stages[name]["ms"] for name in ("synthesise", "beamform", "range"))
    total = sum(stage["ms"] for stage in stages.values())
    return {
        "scene": "configs/remus.yaml",
        "frame": index,
        "paths": len(traced.arrivals.delay),
        "sensors": plan.elements.count,
        "beams": int(image.energy.size),
        "window_ms": 1e3 * (stop - start),
        "stages": stages,
        "synthesise_beamform_range_ms": aimed,
        "frames_per_second_one_core": 1e3 / total,
        "image_stage_peers": peers(
            plan, traced, signals, image_seconds, image.energy, dense.energy, dense_seconds, start, stop
        ),
    }


def synthesis_of_new_frames(plan: planning.Plan, warm: int = 8) -> float:
    """Median CPU seconds of a synthesis of a frame that was not seen before, after some others: tables are shared."""
    seconds = []
    for index in range(0, plan.recipe.frames, 2):
        full = pipeline.trace_frame(plan, index)
        traced = replace(full, arrivals=thin(full.arrivals, PATHS))
        seconds.append(once(partial(pipeline.synthesise, plan, traced))[1])
    return float(np.median(seconds[warm:]))


def synthesis_error(plan: planning.Plan, traced: pipeline.TracedFrame) -> dict[str, Any]:
    """Largest error of the signals over their peak, against the direct sum, on every eighth echo (it takes seconds)."""
    share = 8
    some = thin(traced.arrivals, PATHS // share)
    arguments = (some, traced.frame.moment.snaps, plan.elements, plan.scene.sonar, plan.absorption)
    window = (float(plan.windows.start[traced.frame.index]), plan.windows.samples)
    fast = plan.scene.physics.synthesis.signals(*arguments, *window).pressure
    summed, seconds = once(lambda: DirectSum().signals(*arguments, *window))
    exact = summed.pressure
    heard = traced.arrivals.delay[traced.arrivals.direct].min() - window[0]
    echo = slice(int((heard + plan.windows.echo_start) * plan.scene.sonar.sampling_frequency), None)
    return {
        "error_of_peak": relative(fast, exact),
        "error_of_echo_peak": relative(fast[:, echo], exact[:, echo]),
        "direct_sum_ms_at_this_many_paths": 1e3 * seconds * share,
    }


def peers(
    plan: planning.Plan,
    traced: pipeline.TracedFrame,
    signals: Signals,
    ours: float,
    image: np.ndarray,
    exact: np.ndarray,
    exact_seconds: float,
    start: float,
    stop: float,
) -> dict[str, Any]:
    """The image by dense steering, by Acoular and by the thesis's loop: time, ratio to ours, error."""
    sonar = plan.scene.sonar
    focus = plan.choices.beamforming.focus or 1e6
    acoular, acoular_seconds = acoular_image(plan, signals, start, stop, focus)
    rate = sonar.sampling_frequency
    pulse = thesis_pulse(traced.frame.moment.snaps[0], plan)
    bright = np.flatnonzero(exact.ravel() >= 0.01 * exact.max())
    beams = bright[np.linspace(0, len(bright) - 1, min(THESIS_BEAMS, len(bright))).astype(int)]
    thesis, thesis_seconds = thesis_image(plan, traced.arrivals, pulse, rate, beams, sonar.band.centre)
    thesis_seconds *= exact.size / len(beams)
    return {
        "ours": {"ms": 1e3 * ours, **likeness(image, exact)},
        "dense steering, float64": {"ms": 1e3 * exact_seconds, "ratio": exact_seconds / ours},
        "Acoular BeamformerTime": {
            "ms": 1e3 * acoular_seconds,
            "ratio": acoular_seconds / ours,
            **likeness(acoular, exact),
        },
        "thesis loop": {
            "ms": 1e3 * thesis_seconds,
            "measured_on_beams": len(beams),
            "ratio": thesis_seconds / ours,
            **likeness(thesis, exact.ravel()[beams]),
        },
    }
