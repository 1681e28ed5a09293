"""Locate snaps: from the signals to directions, distances, and what errors to expect of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from sonarsynth.acoustics.bearings import (
    Wavefront,
    plane_wave,
    plane_wavefront,
    spherical_wave,
    wavefront_delays,
)
from sonarsynth.conventions import Floats
from sonarsynth.geometry import Pose
from sonarsynth.products import Bearings, Signals
from sonarsynth.ranging import pulses
from sonarsynth.ranging.placing import Known, Row, as_bearings, place
from sonarsynth.ranging.pulses import Pulse
from sonarsynth.sonar import Elements, Sonar

ROUNDS = 3
"""Alignments of the sensors on the wavefront; each improves the last, and the lags left settle the fit."""
ROBUST_ROUNDS = 3
"""Reweightings that turn outliers out of the first fit."""
FIRST_STEPS = 3
"""Steps from the plane wave to the first sphere; a step each after that."""
MAX_LAG = 0.15
"""A pulse whose lags exceed this share of a period (root mean square, band centre) is not one wavefront."""

Bend = Callable[[Floats], tuple[Floats, Floats]]
"""Of a source position (xyz), sonar frame: delays (sensor,) beyond straight paths (s), and arrival direction (xyz)."""


@lru_cache(maxsize=16)
def unlocatable(elements: Elements) -> str | None:
    """Why an array can locate nothing; None where it can."""
    live = elements.position[elements.gain != 0]
    if len(live) < 3:
        return f"{len(live)} live sensor{'s' * (len(live) != 1)}: a direction needs three that are not in line"
    spread = np.linalg.svd(live - live.mean(axis=0), compute_uv=False)
    if not spread[1] > 1e-6 * spread[0]:
        return "the live sensors are in one line or in one place: they cannot tell a direction"
    return None


def locate(
    signals: Signals,
    elements: Elements,
    sonar: Sonar,
    pose: Pose,
    bed_depth: float,
    snaps: int,
    bend: Bend | None = None,
    gradient: float = 0.0,
) -> Bearings:
    """The `snaps` loudest direct pulses, loudest first; see `ranging.SensorDelays`.

    Paths bend as `bend` says; without it they are taken for straight, and the errors hold what a `gradient` (1/s) of
    the sound speed may do.
    """
    rows: list[Row] = []
    if unlocatable(elements) is None and signals.pressure.shape[1] > 0:
        live = elements.gain != 0
        half = pulses.transit(elements, sonar.assumed_sound_speed) + 2 * pulses.PULSE_HALF
        width = int(2 * half * signals.sampling_frequency) | 1
        loud = pulses.loudness(signals, live, width)
        known = Known(elements, sonar, pose, bed_depth, gradient, pulses.rounding(signals, loud.peak))
        track = loud.track.copy()
        for _ in range(4 * snaps):
            top = int(track.argmax())
            if len(rows) == snaps or not track[top] > pulses.QUIET * loud.quiet:
                break
            row = _row(signals, known, signals.start + top / signals.sampling_frequency, half, bend)
            if row is not None:
                rows.append(row)
            track[max(top - width, 0) : top + width + 1] = 0.0
    return as_bearings(rows, snaps)


def _row(signals: Signals, known: Known, centre: float, half: float, bend: Bend | None) -> Row | None:
    elements, sonar, pose = known.elements, known.sonar, known.pose
    found = fit_pulse(signals, elements, sonar, centre, half)
    if found is None:
        return None
    wave, pulse = found
    row = place(wave, pulse, known)
    if bend is not None and np.all(np.isfinite(row.position)):
        for _ in range(3):  # delays beyond straight ones change little with the place: this settles at once
            extra, arrival = bend(row.position)
            row = place(_refit(pulse, wave, elements, sonar, extra), pulse, known, arrival)
    height = pose.to_world(row.position)[2]
    reach = 3 * np.sqrt(max(pose.rotation[2] @ row.covariance @ pose.rotation[2], 0.0))
    if height > reach:  # the image of a snap in the surface
        return None
    return row


def fit_pulse(
    signals: Signals, elements: Elements, sonar: Sonar, centre: float, half: float
) -> tuple[Wavefront, Pulse] | None:
    """Wavefront of the pulse about `centre` (s), and the pulse as measured last; None where it is no single wavefront.

    Envelope peaks of the sensors give eq. 6 in closed form, then the sphere, robustly; then the sensors are aligned
    and their lags measured coherently, until these settle.
    """
    c, q = sonar.assumed_sound_speed, elements.position
    cut, start = pulses.excerpt(signals, centre, half)
    delay, height = pulses.envelope_peaks(cut, signals.sampling_frequency, sonar.band)
    wave = _robust_wave(start + delay, height * (elements.gain != 0), q, c)
    if wave is None:
        return None
    expected = wave.time + wavefront_delays(q, wave.direction, wave.curvature, c)
    aligned = pulses.align(signals, elements, sonar.band, expected)
    for _ in range(ROUNDS):
        pulse = pulses.measure(aligned, elements, c, wave.direction, wave.curvature, wave.time)
        delay = wave.time + wavefront_delays(q, wave.direction, wave.curvature, c) + pulse.lag
        better = fit_wave(delay, q, c, pulse.weight, wave, 1)
        if better is None:
            return None
        wave = better
    rms = np.sqrt(pulse.weight @ wave.residual**2 / pulse.weight.sum())
    if not rms < MAX_LAG / sonar.band.centre:
        return None
    return wave, pulse


def fit_wave(
    delay: Floats, position: Floats, sound_speed: float, weight: Floats, start: Wavefront, steps: int = 20
) -> Wavefront | None:
    """Sphere through delays; a plane where there are too few sensors for a sphere.

    One step (of Gauss and Newton) suffices where `start` is near and the fit is made again on better delays.
    """
    u, k = start.direction, start.curvature
    wave = spherical_wave(delay, position, sound_speed, weight, u, k, iterations=steps)
    if wave is None:
        wave = spherical_wave(delay, position, sound_speed, weight, u, curved=False, iterations=steps)
    return wave


def _robust_wave(delay: Floats, height: Floats, position: Floats, sound_speed: float) -> Wavefront | None:
    """Sphere through envelope peaks: who hears more counts more, outliers count for nothing (Tukey's biweight)."""
    loud = height**2
    direction, time = plane_wave(delay, position, sound_speed, loud)
    if not np.isfinite(time):
        return None
    wave = fit_wave(delay, position, sound_speed, loud, plane_wavefront(direction, time), FIRST_STEPS)
    for _ in range(ROBUST_ROUNDS):
        if wave is None:
            return None
        late = np.abs(wave.residual)
        order = np.argsort(late)
        share = np.cumsum(loud[order])
        middle = late[order[np.searchsorted(share, 0.5 * share[-1])]]
        scale = max(6 * middle, 1e-7)
        weight = loud * np.maximum(1 - (late / scale) ** 2, 0.0) ** 2
        wave = fit_wave(delay, position, sound_speed, weight, wave, 1)
    return wave


def _refit(pulse: Pulse, wave: Wavefront, elements: Elements, sonar: Sonar, extra: Floats) -> Wavefront:
    """The straight wave that is left when the delays `extra` (sensor,) of bending are taken away."""
    q, c = elements.position, sonar.assumed_sound_speed
    delay = wave.time + wavefront_delays(q, wave.direction, wave.curvature, c) + wave.residual - extra
    return fit_wave(delay, q, c, pulse.weight, wave) or wave
