"""The snap's own reflections: predicted from where the snap is, found in the signals, and taken out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from sonarsynth.conventions import Floats, azimuth_elevation
from sonarsynth.products import Signals, SourceEstimates
from sonarsynth.ranging import ranging_kernels
from sonarsynth.ranging.location import pulse_times
from sonarsynth.ranging.location.candidates import images
from sonarsynth.ranging.location.locating import MAX_LAG
from sonarsynth.ranging.location.plane_waves import (
    HALF,
    PlaneWaveFit,
    WindowSegment,
    beam_contrast,
    look,
    part_of,
    refine,
    restored,
    subtract,
)
from sonarsynth.receiver import Elements, Sonar
from sonarsynth.state import Receiver

SENSORS: Final = 32
"""Fewer live sensors cancel nothing: an echo would lose more than one part in so many (0.14 dB)."""
PASSES: Final = 3
"""Times that arrivals which overlap are each taken out anew, with the others gone."""
SETTLED: Final = 0.01
"""A pass that gains less than this share of the first is the last."""

REASONS: Final = (
    "cancelled",
    "outside the echo window",
    "too near a direct pulse",
    "inside the field of view",
    "not bright enough",
    "does not fit a wavefront",
    "weaker than expected",
)
"""What became of an expected arrival: `Outcome.reason` is an index."""
CANCELLED, OUTSIDE, DIRECT, SEEN, FAINT, UNFIT, WEAK = range(len(REASONS))


@dataclass(frozen=True)
class Limits:
    """What is looked for, and what counts as found; see `WavefrontCancelling`."""

    bounces: int
    search: float  # rad
    excess: float  # dB
    weakest: float  # dB


@dataclass(frozen=True, eq=False)
class ExpectedArrival:
    """An arrival as straight paths, and reflections without loss, would bring it."""

    surface: int  # reflections
    bottom: int
    front: PlaneWaveFit
    energy: float  # Pa2 s at a sensor in the band, its face's response included


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of an expected arrival."""

    expected: ExpectedArrival
    reason: int  # index into REASONS
    found: PlaneWaveFit | None = None  # as fitted, where it was
    excess: float = float("nan")  # dB: of a beam on it over all else in its window; NaN where it was not fitted


@dataclass(frozen=True, eq=False)
class CancelledSignals:
    """Signals without the arrivals that were found, and what became of each that was expected."""

    signals: Signals  # the same object where nothing was taken out
    outcomes: tuple[Outcome, ...]  # loudest expected first


def cancel(
    signals: Signals,
    estimates: SourceEstimates,
    receiver: Receiver,
    bottom: float,
    window: tuple[float, float],
    limits: Limits,
) -> CancelledSignals:
    """Signals without the located snaps' reflections in the echo `window` (start, stop), in s; bottom: its depth (m).

    See `WavefrontCancelling`. Loudest first, so that each is looked for with the louder ones gone.
    """
    elements, sonar = receiver.elements, receiver.sonar
    if np.sum(elements.gain != 0) < SENSORS:
        return CancelledSignals(signals, ())
    expected = expect(signals, estimates, receiver, bottom, limits.bounces)
    remaining, outcomes, segments = signals, [], []
    for arrival in sorted(expected, key=lambda e: -e.energy):
        reason = _out_of_question(arrival.front, estimates, elements, sonar, window)
        outcome = Outcome(arrival, reason) if reason != CANCELLED else find(remaining, elements, sonar, arrival, limits)
        outcomes.append(outcome)
        if outcome.reason == CANCELLED and outcome.found is not None:
            segments.append(part_of(remaining, elements, sonar, outcome.found))
            remaining, _ = subtract(remaining, segments[-1])
    return CancelledSignals(_settle(remaining, elements, sonar, segments), tuple(outcomes))


def expect(
    signals: Signals, estimates: SourceEstimates, receiver: Receiver, bottom_depth: float, bounces: int
) -> list[ExpectedArrival]:
    """Every reflected path of every located snap, by image sources and at the assumed sound speed."""
    elements, sonar, arrivals = receiver.elements, receiver.sonar, []
    c = sonar.assumed_sound_speed
    for time, position in zip(estimates.time, estimates.position, strict=True):
        distance = float(np.linalg.norm(position))
        if not (np.isfinite(time) and np.isfinite(distance) and distance > 0):
            continue
        direct = PlaneWaveFit(position / distance, 1 / distance, float(time))
        late = direct.delays(elements, c)
        aligned = pulse_times.cut(signals, elements.gain != 0, late, pulse_times.PULSE_HALF, sonar.band)
        wave = pulse_times.waveform(aligned, elements, c, direct.direction, direct.curvature, direct.time)
        density = 2 * aligned.spacing * np.abs(wave.template) ** 2
        for surface, bottom, image in images(position, receiver.pose_at(float(time)), bottom_depth, bounces):
            r = float(np.linalg.norm(image))
            front = PlaneWaveFit(image / r, 1 / r, float(time) + (r - distance) / c)
            across, up = front.direction[1:, None] * (elements.face / c)
            face = ranging_kernels.face_responses(across, up, aligned.frequency[0], aligned.spacing, len(density))[0]
            arrivals.append(ExpectedArrival(surface, bottom, front, float(density @ face**2) * (distance / r) ** 2))
    return arrivals


def _out_of_question(
    front: PlaneWaveFit, estimates: SourceEstimates, elements: Elements, sonar: Sonar, window: tuple[float, float]
) -> int:
    """Why an arrival is not even looked for; `CANCELLED` where it is."""
    c = sonar.assumed_sound_speed
    when = front.delays(elements, c)
    if not (when.min() - HALF < window[1] and when.max() + HALF > window[0]):
        return OUTSIDE
    apart = pulse_times.transit(elements, c) + 2 * HALF
    if np.any((estimates.time > when.min() - apart) & (estimates.time < when.max() + apart)):
        return DIRECT
    return SEEN if in_view(front.direction, elements, sonar) else CANCELLED


def in_view(direction: Floats, elements: Elements, sonar: Sonar) -> bool:
    """Whether a direction lies within the beam grid, or a beam (to its first null at the lowest frequency) beside it.

    A planar array cannot tell front from back, so what comes from behind counts as coming from its mirror image.
    """
    ahead = np.array([abs(direction[0]), direction[1], direction[2]])
    beam = 0.61 * sonar.assumed_sound_speed / (sonar.band.low * elements.aperture)
    angles = zip(azimuth_elevation(ahead), (sonar.beams.azimuth, sonar.beams.elevation), strict=True)
    return all(grid[0] - beam <= angle <= grid[-1] + beam for angle, grid in angles)


def find(signals: Signals, elements: Elements, sonar: Sonar, expected: ExpectedArrival, limits: Limits) -> Outcome:
    """The arrival's wavefront as the sensors hear it, and whether it is what was expected."""
    fitted = refine(signals, elements, sonar, look(signals, elements, sonar, expected.front, limits.search))
    if fitted is None:
        return Outcome(expected, FAINT)
    front, misfit = fitted
    excess, energy = beam_contrast(signals, elements, sonar, front)
    turned = float(np.linalg.norm(front.direction - expected.front.direction))
    reason = CANCELLED
    if excess < limits.excess:
        reason = FAINT
    elif not misfit < MAX_LAG / sonar.band.centre or turned > 2 * limits.search:
        reason = UNFIT
    elif in_view(front.direction, elements, sonar):
        reason = SEEN
    elif energy < expected.energy * 10 ** (-limits.weakest / 10):
        reason = WEAK
    return Outcome(expected, reason, front, excess)


def _settle(signals: Signals, elements: Elements, sonar: Sonar, segments: list[WindowSegment]) -> Signals:
    """Arrivals that overlap are each taken out anew, fitted with the others gone, where that leaves less energy."""
    fits, first = list(segments), 0.0
    for turn in range(PASSES):
        gained = 0.0
        for n, old in enumerate(fits):
            if not any(_overlap(old, segment, signals) for m, segment in enumerate(fits) if m != n):
                continue
            restored_signals, rise = restored(signals, old)
            fitted = refine(restored_signals, elements, sonar, old.front)
            if fitted is None or in_view(fitted[0].direction, elements, sonar):
                continue
            new = part_of(restored_signals, elements, sonar, fitted[0])
            less, fell = subtract(restored_signals, new)
            if rise + fell > 0:
                signals, fits[n] = less, new
                gained += rise + fell
        first = gained if turn == 0 else first
        if gained <= SETTLED * first:
            break
    return signals


def _overlap(first: WindowSegment, second: WindowSegment, signals: Signals) -> bool:
    """Whether at any sensor the windows of two parts share a sample."""
    return bool(np.min(np.abs(first.place - second.place)) < 2 * HALF * signals.sampling_frequency)
