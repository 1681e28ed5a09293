"""A wavefront over the array: looked for in the signals, fitted to them, and taken out of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.fft import ifft, irfft, next_fast_len

from sonarsynth.conventions import Floats, direction
from sonarsynth.equations.arrays.spherical_wave import plane_wavefront, spherical_wave, tangent_plane, wavefront_delays
from sonarsynth.geometry import unit
from sonarsynth.products import Signals, SourceEstimates
from sonarsynth.ranging import ranging_kernels
from sonarsynth.ranging.location import plane_wave_kernels, pulse_times
from sonarsynth.receiver import Elements, Sonar

EARLY: Final = 160e-6
"""A wave is looked for so long (s) before and after its expected time."""
HALF: Final = 500e-6
"""Half length (s) of what is taken out, flanks included: a pulse with the ringing of its filter."""
STEPS: Final = 4
"""Tilts of half a beam width tried on either side, at most."""
ROUNDS: Final = 4
"""Fits of the wavefront to the lags that the last one left."""
FEW: Final = 64
"""Sensors, all over the array, that are asked whether they hear anything beside a pulse."""
OWN: Final = 1.5
"""Half lengths of a pulse about its wavefront in which nothing else is told from it."""
BESIDE: Final = 0.005
"""Energy of what else is heard about it, over that of the pulse (23 dB below it), that is looked at: echoes are
fainter, but of bodies close by."""


@dataclass(frozen=True, eq=False)
class PlaneWaveFit:
    """A spherical wavefront over the array."""

    direction: Floats  # (xyz) unit vector towards its source, sonar frame
    curvature: float  # 1/m
    time: float  # s at the array centre

    @staticmethod
    def of(estimates: SourceEstimates, row: int = 0) -> PlaneWaveFit:
        """The direct pulse of a located snap; plane where nothing says how far away that is."""
        radius = float(estimates.range_from_curvature[row])
        if not np.isfinite(radius):
            radius = float(np.linalg.norm(estimates.position[row]))
        curvature = 1 / radius if np.isfinite(radius) else 0.0
        towards = direction(estimates.azimuth[row], estimates.elevation[row])
        return PlaneWaveFit(towards, curvature, float(estimates.time[row]))

    def delays(self, elements: Elements, sound_speed: float) -> Floats:
        """When each sensor hears it (sensor,), in s."""
        late = wavefront_delays(elements.position, self.direction, self.curvature, sound_speed)
        return np.asarray(self.time + late)


@dataclass(frozen=True, eq=False)
class WindowSegment:
    """What each sensor hears of a wave that all hear."""

    front: PlaneWaveFit
    place: Floats  # (sensor,) samples, where the front is
    wave: Floats  # (sensor, 2 half) Pa, about `place`, before the second window


def look(signals: Signals, elements: Elements, sonar: Sonar, expected: PlaneWaveFit, search: float) -> PlaneWaveFit:
    """The expected wavefront, tilted by up to `search` (rad) and moved in time to where a beam on it hears most."""
    c, u = sonar.assumed_sound_speed, expected.direction
    when = expected.delays(elements, c)
    aligned = pulse_times.cut(signals, elements.gain != 0, when, pulse_times.PULSE_HALF + EARLY, sonar.band)
    wave = pulse_times.waveform(aligned, elements, c, u, expected.curvature, expected.time)
    step = 0.25 * c / (sonar.band.centre * elements.aperture)  # half a beam width
    steps = min(int(np.ceil(search / step)), STEPS)
    tangents = tangent_plane(u) * step
    late = -(tangents @ elements.position.T) / c
    first, spacing = aligned.frequency[0], aligned.spacing
    energy = plane_wave_kernels.tilted_energies(wave.spectrum, wave.response, late, first, spacing, steps)
    tilt = np.array(np.unravel_index(energy.argmax(), energy.shape)) - steps
    beam, power = ranging_kernels.template_sums(
        ranging_kernels.turned(wave.spectrum, tilt @ late, first, spacing), wave.response
    )
    count = next_fast_len(16 * len(beam))
    envelope = np.abs(ifft(beam / np.sqrt(power + pulse_times.DEAF * elements.count), count))
    index = (int(envelope.argmax()) + count / 2) % count - count / 2
    moved = float(np.clip(index / (count * spacing), -EARLY, EARLY))
    return PlaneWaveFit(unit(u + tilt @ tangents), expected.curvature, expected.time + moved)


def refine(signals: Signals, elements: Elements, sonar: Sonar, near: PlaneWaveFit) -> tuple[PlaneWaveFit, float] | None:
    """The sphere that fits the sensors' lags, and the root mean square lag (s) that it leaves; None where none does."""
    c, q = sonar.assumed_sound_speed, elements.position
    aligned = pulse_times.cut(signals, elements.gain != 0, near.delays(elements, c), pulse_times.PULSE_HALF, sonar.band)
    wave = replace(plane_wavefront(near.direction, near.time), curvature=near.curvature)
    for _ in range(ROUNDS):
        pulse = pulse_times.measure(aligned, elements, c, wave.direction, wave.curvature, wave.time)
        delay = wave.time + wavefront_delays(q, wave.direction, wave.curvature, c) + pulse.lag
        better = spherical_wave(delay, q, c, pulse.weight, wave.direction, wave.curvature)
        if better is None:
            return None
        wave = better
    misfit = float(np.sqrt(pulse.weight @ wave.residual**2 / pulse.weight.sum()))
    return PlaneWaveFit(wave.direction, wave.curvature, wave.time), misfit


def beam_contrast(signals: Signals, elements: Elements, sonar: Sonar, front: PlaneWaveFit) -> tuple[float, float]:
    """How far (dB) a beam on a wavefront stands above all else in its window, and its energy at a sensor, Pa2 s.

    Of each bin, the share of the energy that one wave explains, over the rest per sensor: 1 for noise, and in the band
    as a whole for an echo from elsewhere, but for the bins where a grating lobe holds it. So: the median, over the half
    of the band that the sensors' faces hear best.
    """
    c = sonar.assumed_sound_speed
    when = front.delays(elements, c)
    aligned = pulse_times.cut(signals, elements.gain != 0, when, pulse_times.PULSE_HALF, sonar.band)
    wave = pulse_times.waveform(aligned, elements, c, front.direction, front.curvature, front.time)
    own, energy, power = plane_wave_kernels.shares(wave.spectrum, wave.response)
    count = int(np.sum(elements.gain != 0))
    residual = np.maximum(energy - own, np.finfo(float).eps * energy)
    ratio = own * (count - 1) / np.where(residual > 0, residual, np.inf)
    middle = float(np.median(ratio[power >= np.median(power)]))
    return 10 * float(np.log10(max(middle, 1e-30))), 2 * aligned.spacing * float(own.sum()) / count


def part_of(
    signals: Signals,
    elements: Elements,
    sonar: Sonar,
    front: PlaneWaveFit,
    half: float = HALF,
    lag: Floats | float = 0.0,
    gain: Floats | float = 1.0,
) -> WindowSegment:
    """What each sensor hears of the wave that a wavefront carries, within `half` (s) of it, flanks included.

    lag, gain (sensor,): how much later (s) than the front, and how many times as loud, a sensor hears it.

    The sensors' windows, moved onto the front, are projected bin by bin on the response of the sensors to one wave.
    With the window once more on what is taken out, that is W Q W with Q an orthogonal projection and 0 <= W <= 1: all
    its eigenvalues lie in 0..1, so what is left has no more energy, and an echo loses about one part in as many as
    there are sensors.
    """
    c, rate = sonar.assumed_sound_speed, signals.sampling_frequency
    time = front.delays(elements, c) + lag
    aligned = pulse_times.cut(signals, elements.gain != 0, time, half, None)
    toward = front.direction - front.curvature * elements.position
    distance = np.sqrt(np.sum(toward * toward, axis=1))
    sine = toward * (elements.face / (c * distance))[:, None]
    response = ranging_kernels.face_responses(sine[:, 1], sine[:, 2], 0.0, aligned.spacing, len(aligned.frequency))
    response *= (gain * elements.gain / distance)[:, None]
    explained = plane_wave_kernels.explained(aligned.spectrum, response) * rate
    explained[:, -1] = 0.0  # half the sampling frequency cannot be moved by parts of a sample
    samples = explained.shape[1] - 1
    arrival = (time - signals.start) * rate
    since = arrival - np.floor(arrival) + samples
    back = ranging_kernels.turned(explained, -since / rate, 0.0, aligned.spacing)
    return WindowSegment(front, arrival, irfft(back, 2 * samples, axis=1))


def accompanied(signals: Signals, elements: Elements, sonar: Sonar, front: PlaneWaveFit, reach: float) -> bool:
    """Whether anything within `reach` (s) of the pulse on a wavefront is `BESIDE` as loud."""
    rate, half = signals.sampling_frequency, OWN * pulse_times.half_length(sonar.band)
    some = np.flatnonzero(elements.gain)[:: max(elements.count // FEW, 1)]
    first = np.floor((front.delays(elements, sonar.assumed_sound_speed) - signals.start) * rate).astype(int)
    late = np.arange(-int(reach * rate), int(reach * rate) + 1)
    index, samples = first[some, None] + late, signals.pressure.shape[1]
    heard = signals.pressure[some[:, None], np.clip(index, 0, samples - 1)] * ((index >= 0) & (index < samples))
    power, own = np.einsum("qt,qt->t", heard, heard), np.abs(late) <= half * rate
    return bool(power[~own].sum() > BESIDE * power[own].sum())


def without(signals: Signals, pulses: list[tuple[Elements, PlaneWaveFit]], sonar: Sonar) -> Signals:
    """Signals without the pulses on wavefronts, one after the other; where sensors are as each comes."""
    rest, half = replace(signals, pressure=signals.pressure.copy()), OWN * pulse_times.half_length(sonar.band)
    for elements, front in pulses:
        segment = part_of(rest, elements, sonar, front, half)
        plane_wave_kernels.add(rest.pressure, segment.place, segment.wave, -1.0)
    return rest


def subtract(signals: Signals, segment: WindowSegment) -> tuple[Signals, float]:
    """Signals from which a part is taken, and by how much that lowers their sum of squares (Pa2)."""
    remaining = replace(signals, pressure=signals.pressure.copy())
    return remaining, float(plane_wave_kernels.add(remaining.pressure, segment.place, segment.wave, -1.0))


def restored(signals: Signals, segment: WindowSegment) -> tuple[Signals, float]:
    """Signals to which a part that was taken is given back, and by how much that lowers their sum of squares (Pa2)."""
    restored_signals = replace(signals, pressure=signals.pressure.copy())
    return restored_signals, float(plane_wave_kernels.add(restored_signals.pressure, segment.place, segment.wave, 1.0))
