"""What others do in the place of our stages: the thesis's imaging loop, Acoular's BeamformerTime, FINUFFT."""

from __future__ import annotations

import time
import warnings
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
from scipy.fft import irfft

from sonarsynth.conventions import Floats, direction
from sonarsynth.planning import Plan, frame_start
from sonarsynth.products import Arrivals, Signals
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals.array_paths import array_paths, delay_and_gain, reach
from sonarsynth.signals.filtered_pulse import pulse_spectrum, pulse_support
from sonarsynth.signals.segments import fast_length
from sonarsynth.state import Emission


def installed(library: str) -> bool:
    """Whether a library can be imported."""
    return find_spec(library) is not None


def thesis_pulse(snap: Emission, plan: Plan) -> Floats:
    """The snap (sample,) as the thesis's loop places it: through the filter, at the sonar's rate."""
    sonar = plan.scene.sonar
    before, after = pulse_support(snap.waveform, sonar.antialias)
    length = fast_length(int(2.0 * max(before, after) * sonar.sampling_frequency) + 2)
    _, spectrum = pulse_spectrum(snap.waveform, sonar.antialias, sonar.sampling_frequency, length, 0.0)
    return np.asarray(np.roll(irfft(spectrum, length) * sonar.sampling_frequency, length // 2))


def thesis_image(
    plan: Plan, arrivals: Arrivals, pulse: np.ndarray, rate: float, beams: np.ndarray, frequency: float
) -> tuple[np.ndarray, float]:
    """Energy (beam,) of the beams numbered `beams` by the thesis's loop, and its seconds.

    Each beam, each ray: the array factor at one frequency for (arrival direction, steered direction), times the snap
    scaled by the ray's amplitude and shifted by its delay to the nearest sample; summed; squared and summed. The matrix
    is as short as the spread of the delays allows, as the thesis has it.
    """
    sonar, sensors = plan.scene.sonar, plan.elements
    grid = sonar.beams
    look = direction(grid.azimuth[None, :], grid.elevation[:, None]).reshape(-1, 3)[beams]
    echoes = arrivals.select(~arrivals.direct)
    shift = np.rint((echoes.delay - echoes.delay.min()) * rate).astype(int)
    wavenumber = 2 * np.pi * frequency / sonar.assumed_sound_speed
    energy = np.empty(len(beams))
    began = time.process_time()
    for b, u in enumerate(look):
        total = np.zeros(shift.max() + len(pulse))
        for ray in range(len(shift)):
            phase = wavenumber * (sensors.position @ (echoes.direction[ray] - u))
            factor = abs(np.exp(1j * phase).sum()) / sensors.count
            total[shift[ray] : shift[ray] + len(pulse)] += factor * echoes.amplitude[ray] * pulse
        energy[b] = np.sum(total * total) / rate
    return energy, time.process_time() - began


def acoular_image(plan: Plan, signals: Signals, start: float, stop: float, focus: float) -> tuple[np.ndarray, float]:
    """Energy (elevation, azimuth) by Acoular's BeamformerTime on the echo window of the same signals, and its seconds.

    It delays by whole travel times from the grid, so as much silence goes before the window; linear interpolation.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return _acoular_image(plan, signals, start, stop, focus)


def _acoular_image(plan: Plan, signals: Signals, start: float, stop: float, focus: float) -> tuple[np.ndarray, float]:
    import acoular

    acoular.config.global_caching = "none"
    sonar, grid = plan.scene.sonar, plan.scene.sonar.beams
    rate, position = signals.sampling_frequency, plan.elements.position
    first, last = (round((t - signals.start) * rate) for t in (start, stop))
    points = (focus * direction(grid.azimuth[None, :], grid.elevation[:, None])).reshape(-1, 3)
    travel = np.array([np.linalg.norm(points - q, axis=1) for q in position]) / sonar.assumed_sound_speed * rate
    before, spread = int(travel.min()) - 1, int(np.ceil(np.ptp(travel))) + 3
    data = np.zeros((before + last - first + spread, len(position)))
    data[before : before + last - first] = signals.pressure[:, first:last].T
    beamformer = acoular.BeamformerTime(
        source=acoular.TimeSamples(data=data, sample_freq=rate),
        steer=acoular.SteeringVector(
            grid=acoular.ImportGrid(pos=points.T),
            mics=acoular.MicGeom(pos_total=position.T),
            env=acoular.Environment(c=sonar.assumed_sound_speed),
            steer_type="classic",
        ),
    )
    next(beamformer.result(128))  # compiles
    began = time.process_time()
    energy = np.zeros(len(points))
    for block in beamformer.result(128):
        energy += np.sum(np.square(block), axis=0)
    seconds = time.process_time() - began
    return (energy / rate).reshape(grid.elevations, grid.azimuths), seconds


def likeness(image: np.ndarray, exact: np.ndarray) -> dict[str, float]:
    """How far an image is from the exact one, whatever its scale: over the beams within 20 dB of the peak."""
    bright = exact >= 0.01 * exact.max()
    decibels = 10 * np.log10(image[bright] / exact[bright])
    return {
        "rms_error_db": float(np.std(decibels)),
        "largest_error_db": float(np.abs(decibels - np.mean(decibels)).max()),
        "correlation": float(np.corrcoef(image[bright], exact[bright])[0, 1]),
    }


def plain(arrivals: Arrivals, plan: Plan, frame: Frame) -> Arrivals:
    """What FINUFFT can add up: paths of the first snap that are wholly heard, their pulses not reshaped."""
    start = frame_start(plan, frame)
    after = start + plan.windows.samples / plan.scene.sonar.sampling_frequency
    selected = arrivals.select((arrivals.snap == 0) & (arrivals.delay > start) & (arrivals.delay < after))
    nought = np.zeros_like(selected.delay)
    return replace(
        selected,
        delay_std=nought,
        echo_delay_std=nought,
        doppler=nought,
        coherent=np.zeros(len(nought), bool),
        corner_delays=np.zeros((len(nought), 3)),
        coherent_fraction=nought,
        height_delay_std=nought,
        expansion=selected.expansion.without("phase", "delay_variance"),
    )


def finufft_signals(plan: Plan, frame: Frame, arrivals: Arrivals, error: float) -> Floats:
    """Pressure (sensor, sample) of `plain` arrivals at point hydrophones, absorption that of the centre of the band: a
    transform of type 1 for each hydrophone."""
    import finufft

    sonar, elements, snap = plan.scene.sonar, plan.elements, frame.moment.snaps[0]
    fs, start, samples = sonar.sampling_frequency, frame_start(plan, frame), plan.windows.samples
    front = array_paths(arrivals, frame.moment.snaps, elements)
    late, gain = delay_and_gain(front, elements.position)
    support = sum(pulse_support(snap.waveform, sonar.antialias))
    margin = int(np.ceil((2.0 * reach(front).max() + support) * fs)) + 2
    length = fast_length(samples + 2 * margin)
    frequency, spectrum = pulse_spectrum(snap.waveform, sonar.antialias, fs, length, 0.0)
    used = len(frequency)
    turn = np.mod(2.0 * np.pi * fs / length * (front.delay[:, None] + late - start + margin / fs), 2.0 * np.pi)
    turn = np.ascontiguousarray(turn.T)  # (sensor, path)
    strength = np.ascontiguousarray(((front.amplitude * np.exp(1j * front.phase))[:, None] * gain * elements.gain).T)
    spectra = np.zeros((elements.count, used), complex)
    for n in range(elements.count):
        modes = finufft.nufft1d1(turn[n], strength[n], 2 * used, eps=error, isign=-1, nthreads=1)
        spectra[n] = modes[used:]  # from frequency 0 on
    pressure = irfft(spectra * spectrum, length, axis=1)[:, margin : margin + samples]
    return np.asarray(pressure * fs)
