"""The chorus of a frame: the paths of its snaps to the array, their pressure at the hydrophones, and their truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sonarsynth.conventions import azimuth_elevation, depth
from sonarsynth.labels.estimate_labels import Direct, heard_first
from sonarsynth.pipeline.stage_times import mark_stage
from sonarsynth.pipeline.stored_values import Values, table
from sonarsynth.pipeline.synthesis import true_elements
from sonarsynth.planning import Plan, frame_start, receiver_of
from sonarsynth.planning.noise_rows import DISTANT_CHORUS
from sonarsynth.products import Echoes, Signals
from sonarsynth.randomness import number, stream
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals import add_noise
from sonarsynth.signals.chorus.chorus_arrivals import (
    ChorusArrivals,
    chorus_arrivals,
    image_heights,
    listening,
    no_chorus,
)
from sonarsynth.signals.chorus.chorus_synthesis import chorus_pressure, spare_time
from sonarsynth.sources.chorus import draw_snaps
from sonarsynth.state import Emission, Receiver

LOUDEST = 3
"""Paths of a frame that are stored, the loudest."""


def frame_chorus(plan: Plan, frame: Frame) -> ChorusArrivals | None:
    """The snaps of the chorus that a frame hears; `plan` is that of its sequence. None where the scene has none."""
    chorus, reach = plan.scene.world.chorus, plan.chorus
    if chorus is None:
        return None
    if reach is None:
        return no_chorus()
    receiver, sonar = _in_mid_record(plan, frame), plan.scene.sonar
    spare = spare_time(plan.elements, sonar, receiver.speed(plan.medium))
    start = frame_start(plan, frame)
    window = (start - spare, start + plan.windows.samples / sonar.sampling_frequency + spare)
    heights = image_heights(plan.profile, plan.medium.depth, float(depth(receiver.pose.position)), reach.images)
    speed, half = 0.0 if receiver.track is None else float(np.linalg.norm(receiver.track.velocity)), np.ptp(window) / 2
    sooner = speed * float(half * heights.slowness.max())  # s: snaps are drawn about where the array is in the middle
    now = (frame.time + window[0] - sooner, frame.time + window[1] + sooner)
    snaps = draw_snaps(chorus, number(frame.seed, "chorus", frame.key), listening(heights, receiver, now, reach.reach))
    return chorus_arrivals(snaps, reach, plan.medium, receiver, frame.time, window)


def _in_mid_record(plan: Plan, frame: Frame) -> Receiver:
    """The array where it is in the middle of its record."""
    half = 0.5 * plan.windows.samples / plan.scene.sonar.sampling_frequency
    return receiver_of(plan, frame).at(frame_start(plan, frame) + half)


def with_chorus(plan: Plan, frame: Frame, signals: Signals, arrivals: ChorusArrivals | None) -> Signals:
    """Signals with the chorus; `plan` is that of the frame's sequence."""
    chorus, distant = plan.scene.world.chorus, plan.distant_chorus
    if arrivals is None or chorus is None:
        return signals
    if distant is not None:
        mark_stage("synthesise")
        random = stream(frame.seed, "distant chorus", frame.key, frame.step)
        receiver = _in_mid_record(plan, frame)
        pose, speed = receiver.pose, receiver.speed(plan.medium)
        signals = add_noise(signals, distant, plan.scene.sonar, true_elements(plan, frame), random, pose, speed)
        mark_stage(DISTANT_CHORUS)
    if not len(arrivals.delay):
        return signals
    model, samples = chorus.snap.at_depth(plan.medium.depth), signals.pressure.shape[1]
    pressure = chorus_pressure(
        arrivals,
        model,
        chorus.widths,
        true_elements(plan, frame),
        plan.scene.sonar,
        plan.absorption,
        signals.start,
        samples,
    )
    mark_stage("synthesise")
    return replace(signals, pressure=signals.pressure + pressure)


def soundscape_values(plan: Plan, frame: Frame, arrivals: ChorusArrivals | None) -> Values:
    """Truth of the chorus in the record of a frame: the number of snaps, and the loudest of them."""
    if arrivals is None:
        return {}
    start = frame_start(plan, frame)
    stop = start + plan.windows.samples / plan.scene.sonar.sampling_frequency
    arrivals = arrivals.select((arrivals.delay >= start) & (arrivals.delay < stop))
    level, time, azimuth, elevation = np.full((4, LOUDEST), np.nan)
    loud = np.argsort(-arrivals.received, kind="stable")[:LOUDEST]
    rows = slice(0, len(loud))
    level[rows], time[rows] = arrivals.received[loud], arrivals.delay[loud]
    azimuth[rows], elevation[rows] = (np.rad2deg(x) for x in azimuth_elevation(arrivals.direction[loud]))
    counts = {"snaps": np.int32(len(np.unique(arrivals.snap))), "paths": np.int32(len(arrivals.delay))}
    return table("/truth/soundscape", **counts, level=level, arrival=time, azimuth=azimuth, elevation=elevation)


def clear_values(
    plan: Plan, arrivals: ChorusArrivals | None, echoes: Echoes, direct: Direct, snaps: tuple[Emission, ...]
) -> Values:
    """1 where no snap of the chorus is louder in the echo window than the echoes of the loudest target, else 0.

    -1 where there are no echoes. Every snap that illuminates has an echo window of its own: 1 needs all to be clear.
    """
    if arrivals is None:
        return {}
    first = heard_first(direct, len(snaps))[0]
    time = [t for t, snap in zip(first, snaps, strict=True) if snap.illuminates]
    echo = np.max(echoes.level, initial=-np.inf, where=np.isfinite(echoes.level))
    clear = -1
    if np.isfinite(echo) and np.isfinite(time).any():
        opens, closes = plan.windows.echo
        inside = [(arrivals.delay >= t + opens) & (arrivals.delay <= t + closes) for t in time if np.isfinite(t)]
        clear = int(not (np.any(inside, axis=0) & (arrivals.received > echo)).any())
    return table("/truth/soundscape", clear=np.int8(clear))
