"""The frequencies that a segment of time needs, and the spectra of its pulses at them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.fft import irfft, rfft

from sonarsynth.conventions import Complexes, Floats
from sonarsynth.description import FieldError
from sonarsynth.equations.scattering.facet_pulses import facet_mean, rough_factor
from sonarsynth.receiver import Sonar, stop_frequency
from sonarsynth.signals.array_paths import ArrayPaths
from sonarsynth.signals.direct_sum import relative_absorption
from sonarsynth.signals.filtered_pulse import at_longest, pulse_spectrum, stretch_sizes, stretched_spectra
from sonarsynth.signals.gridded.nodes import polynomials, rounded_up
from sonarsynth.signals.pulse_shapes import MOST_PHASE, blur_exponent, shape_modes
from sonarsynth.signals.pulse_variation import (
    UNCHANGING,
    PulseVariation,
    changes,
    with_changes,
)
from sonarsynth.signals.segments import Segment

SHAPES = 0.02
"""Share of the tolerance that is given to the shapes of pulses."""


LEAK = 0.1
"""Share of the tolerance that the spectrum may hold, by modulus, above the frequency up to which errors are kept."""
MOST_DECAY = 2.0
"""Range of absorption (Np) that is among the modes of pulses; a wider one keeps terms."""


class Bins(NamedTuple):
    """The frequencies that a segment needs: consecutive bins."""

    first: int  # number of the first bin
    frequency: Floats  # (bin,) Hz
    spectrum: Complexes  # (bin,) of the filtered snap at 1 m, in the shape that all paths share
    relative: Floats  # (bin,) absorption over that at the band centre, less one
    step: float  # Hz
    modes: Complexes  # (mode, bin) spectra that the modes of the paths weigh; none where all share their shape
    changes: PulseVariation  # of pulses over the aperture, in these modes

    def cut(self, count: int) -> Bins:
        """The first `count` bins."""
        first = slice(0, count)
        frequency, spectrum, relative = self.frequency[first], self.spectrum[first], self.relative[first]
        return self._replace(frequency=frequency, spectrum=spectrum, relative=relative, modes=self.modes[:, first])

    def shorter(self, period: int, samples: int, early: float) -> Bins:
        """Those of a segment of so many samples, not `period`; a share `early` of these are before a pulse arrives."""
        both, before = np.zeros((1 + len(self.modes), period // 2 + 1), complex), round(early * samples)
        both[:, self.first : self.first + self.frequency.size] = np.concatenate([self.spectrum[None], self.modes])
        wave = np.delete(irfft(both, period, axis=1), slice(samples - before, period - before), axis=1)
        step = self.step * period / samples
        first, last = int(self.frequency[0] / step), min(int(np.ceil(self.frequency[-1] / step)), samples // 2)
        frequency = np.asarray(step * np.arange(first, last + 1), float)
        spectra, relative = rfft(wave, axis=1)[:, first : last + 1], np.interp(frequency, self.frequency, self.relative)
        return Bins(first, frequency, spectra[0], relative, step, spectra[1:], self.changes)


def audible(spectrum: Complexes, tolerance: float) -> slice:
    """The bins of a spectrum without its ends, which hold no more than 0.03 `tolerance` of its modulus each."""
    mass = np.cumsum(np.abs(spectrum))
    ends = np.searchsorted(mass, np.array([0.03 * tolerance, 1.0 - 0.03 * tolerance]) * mass[-1])
    return slice(int(ends[0]), min(int(ends[1]) + 1, spectrum.size))


def highest_heard(bins: Bins, stop: float, tolerance: float, oversampling: float) -> float:
    """The frequency (Hz) up to which errors are to be kept: where the filter stops, or beyond, where it is narrow and
    what it leaks counts; and the grid is to hold all bins."""
    mass = np.cumsum(np.abs(bins.spectrum))
    leaks = int(np.searchsorted(mass, (1.0 - LEAK * tolerance) * mass[-1]))
    return max(stop, float(bins.frequency[min(leaks, mass.size - 1)]), float(bins.frequency[-1]) / oversampling)


def _coherent_gain(front: ArrayPaths) -> float:
    """Factor by which the low end of the spectrum may add up to more than its middle: waves longer than the delays
    between paths add by amplitude where paths have one sign, shorter waves by power."""
    return max(1.0, abs(float(np.sign(front.amplitude).sum())) / float(np.sqrt(front.count)))


def bins_of(
    segment: Segment, front: ArrayPaths, sonar: Sonar, absorption: Callable[[Floats], Floats] | None, tolerance: float
) -> tuple[ArrayPaths, Bins]:
    """The paths of a stretch, with the modes of their pulses, and its bins.

    Errors are relative to the least blurred path; paths that are silent beside it are left out. Raises FieldError
    for facets with corners more than `MOST_PHASE` from their middle at what the filter passes.
    """
    fs = sonar.sampling_frequency
    frequency, spectrum = pulse_spectrum(segment.waveform, sonar.antialias, fs, segment.samples)
    slope = np.asarray(1j * frequency / front.centre if segment.coherent else 1.0)
    spectrum = spectrum * slope
    widest = rounded_up(float(np.abs(front.doppler).max()), 2.0)
    series = np.zeros((0, spectrum.size), complex)
    if widest > 0.0:
        sizes = np.array(stretch_sizes(at_longest(segment.waveform), sonar.antialias, widest, segment.coherent))
        beyond = np.append(np.cumsum(sizes[::-1])[::-1], 0.0)
        count = int(np.flatnonzero(beyond <= SHAPES * tolerance)[0])
        series = slope * stretched_spectra(segment.waveform, sonar.antialias, fs, segment.samples, widest, count)
    if len(series) or _shaped(front):
        front, spectrum, series = _shared(front, frequency, spectrum, series, widest, tolerance)
    loud = audible(spectrum, tolerance / _coherent_gain(front))
    frequency, spectrum, series = frequency[loud], spectrum[loud], series[:, loud]
    if front.variance.any():
        front = _loud(front, frequency, spectrum, tolerance)
    if front.corner_delays.any():
        taken = slice(_bins_of_corners(front, frequency, sonar))
        frequency, spectrum, series = frequency[taken], spectrum[taken], series[:, taken]
    modes, variation = np.zeros((0, spectrum.size), complex), UNCHANGING
    relative = relative_absorption(absorption, frequency, sonar.band.centre)
    if front.count > 1:
        front = _changing(front, frequency[-1:], tolerance)
    if len(series) or _shaped(front):
        front, spectrum, modes = _with_modes(front, frequency, spectrum, relative, series, widest, tolerance)
        variation = changes(front, frequency, modes) if front.count > 1 else UNCHANGING
    return front, Bins(loud.start, frequency, spectrum, relative, fs / segment.samples, modes, variation)


def _shaped(front: ArrayPaths) -> bool:
    """Whether pulses have shapes, beside Doppler."""
    shaped = bool(
        front.variance.any() or front.phase.any() or front.corner_delays.any() or front.coherent_fraction.any()
    )
    return shaped or (front.count > 1 and bool(front.expansion.phase.any() or front.expansion.delay_variance.any()))


def _changing(front: ArrayPaths, highest: Floats, tolerance: float) -> ArrayPaths:
    """Paths without what their pulses change by over the aperture, up to the highest frequency (1,), where that is
    nothing beside the loudest."""
    if not (front.expansion.phase.shape[1] or front.expansion.delay_variance.shape[1]):
        return front
    loud = np.abs(front.amplitude)
    turn = np.linalg.norm(front.expansion.largest("phase") * loud)
    spread = np.linalg.norm(front.expansion.largest("delay_variance") * loud) * float(blur_exponent(highest)[0])
    least = SHAPES * tolerance * loud.max()
    quiet = [name for name, size in (("phase", turn), ("delay_variance", spread)) if size <= least]
    return front.but(expansion=front.expansion.without(*quiet))


def _bins_of_corners(front: ArrayPaths, frequency: Floats, sonar: Sonar) -> int:
    """Bins, the first ones, at which the series in the corners of facets holds: all that the filter passes.

    Raises FieldError where it passes more, for facets are as short as the band asks.
    """
    far = float(np.abs(front.corner_delays).max())
    highest = MOST_PHASE / (2.0 * np.pi * far)
    if frequency[-1] > highest and stop_frequency(sonar.antialias) > highest:
        message = (
            f"sound passes up to {stop_frequency(sonar.antialias) / 1e3:.4g} kHz, and facets up to {1e6 * far:.3g} us "
            f"from middle to corner are too long over {highest / 1e3:.4g} kHz: lower it, refine the shapes "
            "(shape.edge), or use scene.physics.synthesis direct_sum"
        )
        raise FieldError(("scene", "sonar", "filter"), message)
    return int(np.searchsorted(frequency, highest, side="right"))


def _with_modes(
    front: ArrayPaths,
    frequency: Floats,
    spectrum: Complexes,
    relative: Floats,
    series: Complexes,
    widest: float,
    tolerance: float,
) -> tuple[ArrayPaths, Complexes, Complexes]:
    """Paths with modes, the spectrum, and those of the modes. Absorption is among them, unless it differs much."""
    decay = np.log(10.0) / 20.0 * relative
    few = float(np.ptp(front.loss) * np.abs(decay).max()) <= MOST_DECAY
    if few:
        middle = 0.5 * float(front.loss.min() + front.loss.max())
        lost = np.exp(-middle * decay)
        front, spectrum, series = front.but(loss=front.loss - middle), spectrum * lost, series * lost
    else:
        decay = np.zeros(frequency.size)
    every = with_changes(front) if front.count > 1 else front
    weight, modes = shape_modes(every, frequency, spectrum, decay, series, widest, SHAPES * tolerance)
    weight = weight[: front.count]
    if front.corner_delays.any() or front.coherent_fraction.any():
        spectrum = modes[0]  # what paths mostly send: the spectrum of the errors
    return front.but(modes=weight, loss=np.zeros(front.count) if few else front.loss), spectrum, modes


def _shared(
    front: ArrayPaths, frequency: Floats, spectrum: Complexes, series: Complexes, widest: float, tolerance: float
) -> tuple[ArrayPaths, Complexes, Complexes]:
    """Paths without the shape that all share, and the spectrum with it; and the series in Doppler, empty where all
    share that."""
    if len(series):
        low, high = float(front.doppler.min()), float(front.doppler.max())
        # the ends of a smooth series differ most
        first, spectrum, last = polynomials(np.array([low, 0.5 * (low + high), high]) / widest, len(series)) @ series
        if np.abs(last - first).sum() <= SHAPES * tolerance * np.abs(spectrum).sum():
            series = series[:0]
    least = float(front.variance.min())
    spread = float(front.variance.max()) - least
    if least > 0.0:
        soft = np.exp(-least * blur_exponent(frequency))
        spectrum, series = spectrum * soft, series * soft
    alike = spread * blur_exponent(frequency)[-1] <= SHAPES * tolerance
    front = front.but(variance=np.zeros(front.count) if alike else front.variance - least)
    phase = float(front.phase[0])
    if (np.abs(front.phase - phase) <= SHAPES * tolerance).all():
        turn = np.exp(1j * phase)
        spectrum, series = spectrum * turn, series * turn
        front = front.but(phase=np.zeros(front.count))
    if front.corner_delays.any() or front.coherent_fraction.any():
        front, facet = _shared_facet(front, frequency)
        spectrum, series = spectrum * facet, series * facet
    return front, spectrum, series


def _shared_facet(front: ArrayPaths, frequency: Floats) -> tuple[ArrayPaths, Complexes]:
    """Paths without what all facets do alike to the pulse, and that (bin,)."""
    first, facet = front.select(np.arange(1)), np.ones(frequency.size, complex)
    if (front.corner_delays == first.corner_delays).all():
        facet = facet * facet_mean(frequency, first.corner_delays)[0]
        front = front.but(corner_delays=np.zeros((front.count, 3)))
    if not (np.ptp(front.coherent_fraction) or np.ptp(front.height_delay_std)):
        facet = facet * rough_factor(frequency, first.coherent_fraction, first.height_delay_std)[0]
        front = front.but(coherent_fraction=np.zeros(front.count))
    return front, facet


def _loud(front: ArrayPaths, frequency: Floats, spectrum: Complexes, tolerance: float) -> ArrayPaths:
    """The paths without those that their blur leaves, all together, less than 0.01 `tolerance` of the loudest."""
    sampled = slice(None, None, max(1, frequency.size // 128))
    mass, exponent = np.abs(spectrum[sampled]), blur_exponent(frequency[sampled])
    blurred = exponent[exponent > 0.0]  # 0 Hz is not
    if not blurred.size:
        return front
    variance = np.append(0.0, np.geomspace(1e-4 / blurred[-1], 1e3 / blurred[0], 257))
    level = np.exp(-np.multiply.outer(variance, exponent)) @ mass / mass.sum()
    loudness = np.abs(front.amplitude) * np.interp(front.variance, variance, level)
    keep = loudness > 0.01 * tolerance / front.count * loudness.max()
    return front if keep.all() else front.select(np.flatnonzero(keep))
