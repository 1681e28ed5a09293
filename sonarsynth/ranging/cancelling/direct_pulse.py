"""Direct pulses of located snaps, removed from the signals where they overlap echoes in time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.arrays.gates import frequency_spacing, gate_samples, gated_energy
from sonarsynth.products import EnergyImage, Signals, SourceEstimates
from sonarsynth.ranging import ranging_kernels
from sonarsynth.ranging.location import pulse_times
from sonarsynth.ranging.location.locating import MAX_LAG
from sonarsynth.ranging.location.plane_waves import PlaneWaveFit, part_of, refine, subtract
from sonarsynth.receiver import Elements, Sonar

FLAT: Final = 0.75
"""Share of the length of what is taken out that its flanks leave whole."""
UNLIKE: Final = 0.1
"""Standard deviation of the sensors' gains from those of a spherical wave, and of their phases (rad), before it is
known what they hear."""
ROUNDS: Final = 3
"""Steps to those deviations."""
MOST: Final = 0.25
"""Share of a beam's energy that may be left of the direct pulse (1.2 dB)."""

JUDGED: Final = 1e-5
"""Energy of a beam over that of the brightest down to which `MOST` is asked for (50 dB): beams that a method leaves
nothing in, as `clean` does, hold less than that, whatever is left."""

Imaging = Callable[[Signals, float, float], EnergyImage]
"""The energy image of signals from start to stop (s)."""


def remove_others(
    signals: Signals,
    estimates: SourceEstimates,
    elements: Elements,
    sonar: Sonar,
    length: float,
    window: tuple[float, float],
) -> Signals:
    """Signals without the direct pulses, of `length` (s), of later snaps that are heard in a window (start, stop) in s.

    Of those alone that are located, which no echo is; the same signals where there are none.
    """
    reach = length + pulse_times.transit(elements, sonar.assumed_sound_speed)
    for row in range(1, len(estimates.time)):
        near = window[0] - reach < estimates.time[row] < window[1] + reach
        if near and np.isfinite(estimates.position[row]).all():
            removed = remove(signals, estimates, elements, sonar, length, row)
            signals = signals if removed is None else removed
    return signals


def remove(
    signals: Signals, estimates: SourceEstimates, elements: Elements, sonar: Sonar, length: float, row: int = 0
) -> Signals | None:
    """Signals without the direct pulse of a located snap; None where none is located, or it is not
    one wavefront.

    The sphere that fits the sensors' lags, and then each sensor's own lag and gain as far as its signal supports them
    (rays that bend make no sphere), say how each hears the wave. What all sensors have of that wave
    (`plane_waves.part_of`) is taken out within `length` (s) of the wavefront. Of an echo from elsewhere goes one part
    in as many as there are sensors; of one that comes at the same time from within a beam width of the snap, or from a
    grating lobe of it, nearly all.

    Measured in configs/tank.yaml (128 sensors; rays bend, 6 ns root mean square off a sphere): the direct pulse falls
    by 54 dB along the sphere, 66 with lags, 80 with gains as well, from 19 dB above the echo to 78 dB below it in its
    window; an echo that comes 0.45 ms later from 24 degrees beside it loses 0.13 dB. 5 ms on one core; 17 ms of 508
    sensors.
    """
    if not np.isfinite(estimates.time[row]):
        return None
    fitted = refine(signals, elements, sonar, PlaneWaveFit.of(estimates, row))
    if fitted is None or not fitted[1] < MAX_LAG / sonar.band.centre:
        return None
    front, _ = fitted
    lag, gain = deviations(signals, elements, sonar, front)
    return subtract(signals, part_of(signals, elements, sonar, front, length / FLAT, lag, gain))[0]


def deviations(signals: Signals, elements: Elements, sonar: Sonar, front: PlaneWaveFit) -> tuple[Floats, Floats]:
    """How much later (sensor,) in s than a wavefront, and how many times as loud (sensor,), each sensor hears it.

    Newton steps on the squares of what the wave leaves, over the power of that, and of the deviations, over `UNLIKE`:
    a sensor that hears little of the wave, or nothing, stays on the sphere.
    """
    c, band = sonar.assumed_sound_speed, sonar.band
    aligned = pulse_times.cut(signals, elements.gain != 0, front.delays(elements, c), pulse_times.PULSE_HALF, band)
    wave = pulse_times.waveform(aligned, elements, c, front.direction, front.curvature, front.time)
    omega = 2 * np.pi * aligned.frequency
    model = wave.response * wave.template
    lag, gain = np.zeros(elements.count), np.ones(elements.count)
    live = elements.gain != 0
    power, slope = (np.sum(np.abs(m) ** 2, axis=1) for m in (model, omega * model))
    for _ in range(ROUNDS):
        aligned_spectrum = ranging_kernels.turned(wave.spectrum, lag, aligned.frequency[0], aligned.spacing)
        residual = aligned_spectrum - gain[:, None] * model
        prior = 0.5 * float(np.mean(np.abs(residual[live]) ** 2)) / UNLIKE**2 + np.finfo(float).tiny
        late = np.sum(omega * (model * residual.conj()).imag, axis=1) / (slope + prior * (2 * np.pi * band.centre) ** 2)
        lag, gain = lag + late, gain + np.sum((model.conj() * residual).real, axis=1) / (power + prior)
    return np.where(live, lag, 0.0), np.where(live, gain, 1.0)


def trusted(
    image: EnergyImage, received: Signals, remaining: Signals, sonar: Sonar, imaging: Imaging, begin: float
) -> EnergyImage:
    """An image of `remaining`, `received` without its direct pulse: NaN in beams that may hold too much of it still.

    Before the echo window there are no echoes, so what `remaining` holds there, from `begin` (s) on, is of the direct
    pulse still. Its beams, times the ratio of what was taken out within the window and before it, are what may be left
    within: no more than `MOST` of the energy of a beam, or of `JUDGED` of the brightest.
    """
    removed, start = replace(remaining, pressure=received.pressure - remaining.pressure), max(begin, remaining.start)
    within = _energy(removed, sonar, image.start, image.stop)
    if within == 0:
        return replace(image, remainder=0.0)
    before = _energy(removed, sonar, start, image.start)
    leakage = imaging(remaining, start, image.start).energy.astype(float) * (within / max(before, np.finfo(float).tiny))
    judged = np.maximum(image.energy, JUDGED * image.energy.max())
    energy = np.where(leakage <= MOST * judged, image.energy, np.float32("nan"))
    loudest = np.unravel_index(image.energy.argmax(), image.energy.shape)
    share = leakage[loudest] / image.energy[loudest] if image.energy[loudest] > 0 else np.nan
    return replace(image, energy=energy.astype(np.float32), remainder=float(share))


def _energy(signals: Signals, sonar: Sonar, start: float, stop: float) -> float:
    """Energy in band of all sensors from start to stop (s), tapered as for an image; in units of its own."""
    rate = signals.sampling_frequency
    first, count = gate_samples(start, stop, signals.start, rate, signals.pressure.shape[1])
    energy = gated_energy(signals.pressure, rate, first, count, (sonar.band.low, sonar.band.high))
    return energy * frequency_spacing(count, rate)
