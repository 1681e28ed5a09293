"""The slow exact synthesis: the reference that the fast one is measured against."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats
from sonarsynth.description import description
from sonarsynth.description.method import Demand, FrameSize, Method
from sonarsynth.equations.arrays.apertures import element_directivity
from sonarsynth.equations.kernels.fourier_sums import parts, waves
from sonarsynth.equations.scattering.facet_pulses import facet_response
from sonarsynth.products import Arrivals, Signals
from sonarsynth.receiver import Elements
from sonarsynth.signals.array_paths import ArrayPaths, array_paths, arrival_directions, delay_and_gain, lost, reach
from sonarsynth.signals.filtered_pulse import pulse_spectrum
from sonarsynth.signals.pulse_variation import changed, from_the_sharpest
from sonarsynth.signals.segments import Reception, fast_length, layout
from sonarsynth.state import Emission

FINER = 64
"""Parts of what `fourier_sums.parts` holds at once that stay in the cache of a core."""


def relative_absorption(absorption: Callable[[Floats], Floats] | None, frequency: Floats, centre: float) -> Floats:
    """Absorption at frequencies (bin,) over that at the band centre, less one; zero where none is given."""
    if absorption is None:
        return np.zeros_like(frequency)
    at = absorption(np.append(frequency, centre))
    if not at[-1] > 0.0:
        return np.zeros_like(frequency)
    return np.asarray(at[:-1] / at[-1] - 1.0)


def attenuation(absorption: Callable[[Floats], Floats] | None, centre: float) -> float:
    """Absorption (dB/m) at the band centre; zero where none is given."""
    return 0.0 if absorption is None else max(float(absorption(np.array([centre]))[0]), 0.0)


def exact_spectra(
    front: ArrayPaths, elements: Elements, frequency: Floats, relative: Floats, origin: float
) -> np.ndarray:
    """Transfer functions (sensor, bin) from the snap at 1 m to each hydrophone, delays counted from `origin` (s); but
    for Doppler, which is the snap's."""
    facets = bool(front.coherent.any() or front.corner_delays.any() or front.coherent_fraction.any())
    total = np.zeros((elements.count, frequency.size), complex)
    for e in range(front.count):
        path = front.select(np.array([e]))
        delay, gain = delay_and_gain(path, elements.position)
        u = arrival_directions(path, elements.position)
        late = path.delay[0] - origin + delay[0]
        farther = path.attenuation * path.sound_speed * delay[0]  # dB
        shape = np.exp(1j * path.phase[0] - 0.5 * path.variance[0] * (2.0 * np.pi * frequency) ** 2)
        if facets:
            shape = shape * facet_response(
                frequency, path.coherent, path.corner_delays, path.coherent_fraction, path.height_delay_std, path.centre
            )
        if path.expansion.phase.any() or path.expansion.delay_variance.any():
            shape = shape * changed(path, elements.position, frequency)[0]
        shape = np.broadcast_to(shape, total.shape)
        gain_of_sensors = elements.gain * ~path.hidden(elements.count)[0] if path.occluded.any() else elements.gain
        size = path.amplitude[0] * gain[0] * gain_of_sensors
        for some in parts(size, FINER * frequency.size):
            face = element_directivity(frequency, u[0, some, None], elements.face, path.sound_speed)
            loss = lost(np.multiply.outer(path.loss[0] + farther[some], relative))
            total[some] += size[some, None] * face * loss * (waves(frequency, late[some]) * shape[some])
    return total


class UnroundedSynthesis(Method):
    """A synthesis that also gives what it computes before that is rounded to float32."""

    @abstractmethod
    def pressure(
        self, arrivals: Arrivals, snaps: tuple[Emission, ...], reception: Reception
    ) -> tuple[npt.NDArray[Any], int]:
        """Pressure (sensor, sample) in the precision of the method, and the number of arrivals that the window cuts."""

    def signals(self, arrivals: Arrivals, snaps: tuple[Emission, ...], reception: Reception) -> Signals:
        """As `SignalSynthesis.signals`."""
        pressure, outside = self.pressure(arrivals, snaps, reception)
        rate = reception.sonar.sampling_frequency
        return Signals(pressure.astype(np.float32, copy=False), reception.start, rate, 0.0, 0, outside)


@description
class DirectSum(UnroundedSynthesis):
    """Sum of every path at every hydrophone and frequency, in float64, with exact delay, amplitude, directivity,
    phase, blur, Doppler and mean over its facet."""

    kind: Literal["direct_sum"] = "direct_sum"

    def resolve(self, demand: Demand) -> tuple[DirectSum, float]:
        """Itself: exact but for rounding."""
        return self, 0.0

    def cost(self, size: FrameSize) -> float:
        """As `Method.cost`: every path at every frequency of every hydrophone."""
        return 6.4e-8 * size.paths * size.sensors * size.samples

    def pressure(self, arrivals: Arrivals, snaps: tuple[Emission, ...], reception: Reception) -> tuple[Floats, int]:
        """As `UnroundedSynthesis.pressure`; the period of the transform is the window and a pulse at either end."""
        elements, sonar, absorption, start, samples, *_ = reception
        fs = sonar.sampling_frequency
        front = array_paths(arrivals, snaps, elements, attenuation(absorption, sonar.band.centre))
        front = from_the_sharpest(front, 0.5 * fs)  # elsewhere factors could be larger than numbers may be
        plan = layout(arrivals, front, snaps, reception)
        pressure = np.zeros((elements.count, samples))
        waveforms = [s.waveform for s in snaps]
        for waveform in dict.fromkeys(waveforms):
            rows = np.flatnonzero(np.array([w == waveform for w in waveforms])[arrivals.snap] & plan.audible)
            if not rows.size:
                continue
            pad = int(np.ceil(plan.support[:, rows].sum(axis=0).max() * fs)) + 2
            # where a pulse is partly heard at one hydrophone, it is at most this far out at another
            spread = int(np.ceil(2.0 * reach(front).max(initial=0.0) * fs)) + pad
            length = fast_length(samples + 2 * spread)
            for doppler in np.unique(front.doppler[rows]):
                frequency, spectrum = pulse_spectrum(waveform, sonar.antialias, fs, length, float(doppler))
                relative = relative_absorption(absorption, frequency, sonar.band.centre)
                group = front.select(rows[front.doppler[rows] == doppler])
                transfer = exact_spectra(group, elements, frequency, relative, start - spread / fs)
                pressure += np.fft.irfft(transfer * spectrum, length)[:, spread : spread + samples] * fs
        return pressure, plan.outside
