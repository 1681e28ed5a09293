"""The snap at 1 m after the anti-alias filter, and its shapes after changes by paths."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import inf
from typing import NamedTuple

import numpy as np
from scipy.fft import ifft, irfft, rfft

from sonarsynth.conventions import REFERENCE_PRESSURE, Complexes, Floats
from sonarsynth.description import FieldError
from sonarsynth.equations.arrays.spherical_wave import envelope_peak
from sonarsynth.equations.bubble import pulses
from sonarsynth.equations.bubble.pulses import Pulse
from sonarsynth.equations.noise import filters
from sonarsynth.equations.noise.filters import Fir
from sonarsynth.equations.scattering.facet_pulses import rough_factor
from sonarsynth.receiver import Filter, Sonar, stop_frequency
from sonarsynth.signals.gridded.nodes import analysis, chebyshev, rounded_up
from sonarsynth.sources.pulse_model import PulseModel, Stamp
from sonarsynth.sources.snap_pulses import Waveform
from sonarsynth.state import Emission

LONGEST_ENVELOPE = 1 << 18
"""Most samples of a pulse whose envelope is computed."""

LONGEST_TAIL = 0.02
"""s, times the width: the tails of turned pulses are cut there, unless the pulse itself is longer."""

MOST_SAMPLES = 1 << 23
"""Most samples of a pulse whose tails are measured."""

PULSE_FEET = float(np.sqrt(-2.0 * np.log(filters.SUPPORT_TOLERANCE)))
"""Standard deviations of a Gaussian blur that are added to the support of a pulse at either end."""


def fir(chosen: Filter) -> Fir:
    """The parameters of a described filter in the form of `equations.noise.filters`."""
    return Fir(*chosen.edges, chosen.transition, chosen.attenuation)


class PulseChanges(NamedTuple):
    """Changes of a pulse by its path that change its support, other than blur."""

    turned: bool = False  # at any constant phase
    sloped: bool = False  # differentiated
    rough: float = 0.0  # s: by `facet_pulses.rough_factor` with a share of 1 and this delay; 0: not


def pulse_support(
    waveform: Waveform,
    chosen: Filter,
    tolerance: float = filters.SUPPORT_TOLERANCE,
    *,
    turned: bool = False,
    sloped: bool = False,
    rough: float = 0.0,
) -> tuple[float, float]:
    """How long (s) before and after its collapse the filtered snap exceeds `tolerance` of its peak: for laying out
    windows.

    turned: at any constant phase. Such a pulse never ends. It falls as 1/t^3 where the snap has no net impulse, nor the
    impulse a net integral, as the logarithmic bubble; as 1/t^2 or 1/t (Keller-Miksis, recordings) it may be cut at
    LONGEST_TAIL: `cut_tail` says what is left there. sloped: differentiated, as a smooth facet does. rough: from rough
    facets with a `height_delay_std` (s) up to this, of any share. Facets make it longer by their corners, at both ends.
    """
    supports = [] if sloped else [_plain_support(waveform, chosen, tolerance)]
    if turned or sloped:
        supports.append(_shaped_support(waveform, chosen, tolerance, PulseChanges(turned, sloped))[:2])
    # a rough one lasts longest where what is missing has just not fallen silent: looked for within a factor of two
    shortest = 1e-11  # shorter ones are quieter only
    longest = rounded_up(max(min(rough, silencing_blur(waveform, chosen)), shortest), 2.0) if rough > 0.0 else 0.0
    for delay in [longest / 2.0**n for n in range(4)] if rough > 0.0 else []:
        supports.append(_shaped_support(waveform, chosen, tolerance, PulseChanges(turned, sloped, delay))[:2])
    before, after = zip(*supports, strict=True)
    return max(before), max(after)


def cut_tail(waveform: Waveform, chosen: Filter, tolerance: float = filters.SUPPORT_TOLERANCE) -> float:
    """What a turned snap may be outside of its support, relative to its peak: `tolerance`, or more where it is cut."""
    return max(_shaped_support(waveform, chosen, tolerance, PulseChanges(turned=True))[2], tolerance)


def at_longest(waveform: Waveform) -> Waveform:
    """The waveform a little longer, of one of few widths, so that supports are bounds, and kept."""
    return waveform._replace(width=rounded_up(waveform.width, 1.05))


@lru_cache(maxsize=64)
def _plain_support(waveform: Waveform, chosen: Filter, tolerance: float) -> tuple[float, float]:
    width, passed = waveform.width, fir(chosen)
    made = _made(waveform.model, waveform.stamp, 2.0 * passed.high * width)
    return pulses.support(pulses.scaled(made, 1.0, width), passed, tolerance)


def _tapered(waveform: Waveform, chosen: Filter, window: float) -> tuple[Floats, Complexes]:
    """Frequencies (bin,) from 0 to twice the stop edge in steps of 1/window, and the spectrum of the filtered snap,
    faded out from the stop edge on: cut there it would ring."""
    stop = stop_frequency(chosen)
    f = np.asarray(np.arange(2 * int(np.ceil(stop * window)) + 1) / window)
    fade = np.cos(0.5 * np.pi * np.clip(f / stop - 1.0, 0.0, 1.0)) ** 2
    return f, _snap_spectrum(waveform, 1.0, f) * filters.response(f, fir(chosen)) * fade


@lru_cache(maxsize=256)
def _shaped_support(
    waveform: Waveform, chosen: Filter, tolerance: float, shape: PulseChanges
) -> tuple[float, float, float]:
    """As `pulse_support`, of one shape; and what is left of it outside. At any phase, that is of the envelope: the
    modulus of the pulse and i times its Hilbert transform."""
    plain = sum(_plain_support(waveform, chosen, tolerance))
    window = 2.0 * plain
    f, value = _tapered(waveform, chosen, window)
    samples = 2 * (f.size - 1)
    wave = np.fft.fftshift(irfft(value, samples))
    longest = max(LONGEST_TAIL * waveform.width, plain)
    while True:
        padding, step = wave.size // 2, window / samples
        wave = np.pad(wave, padding)  # a wider window, in which less of the tails is folded
        envelope = _shaped(wave, step, shape)
        envelope /= envelope.max()
        loud = (np.flatnonzero(envelope > tolerance) - wave.size // 2) * step
        quarter = 0.25 * wave.size * step
        if max(-loud[0], loud[-1]) < quarter or longest < quarter or wave.size > MOST_SAMPLES:
            break
    time = (np.arange(wave.size) - wave.size // 2) * step
    left = float(envelope[np.abs(time) >= longest].max(initial=0.0))
    before, after = (min(max(float(end), 0.0), longest) for end in (step - loud[0], loud[-1] + step))
    return before, after, left


def _shaped(wave: Floats, step: float, shape: PulseChanges) -> Floats:
    """Modulus (sample,) of a wave in that shape; half of its envelope, if it may be turned."""
    spectrum = rfft(wave)
    f = np.arange(spectrum.size) / (wave.size * step)
    if shape.sloped:
        spectrum = spectrum * (1j * f)
    if shape.rough > 0.0:
        spectrum = spectrum * rough_factor(f, np.ones(1), np.array([shape.rough]))[0]
    if not shape.turned:
        return np.asarray(np.abs(irfft(spectrum, wave.size)))
    half = np.zeros(wave.size, complex)
    half[: wave.size // 2 + 1] = spectrum
    half[0] *= 0.5  # no frequency is neither positive nor negative
    return np.asarray(np.abs(ifft(half)))


@lru_cache(maxsize=64)
def silencing_blur(waveform: Waveform, chosen: Filter) -> float:
    """The blur (s) that leaves no more than `SUPPORT_TOLERANCE` of the modulus of the filtered snap's spectrum."""
    window = 4.0 * sum(_plain_support(waveform, chosen, filters.SUPPORT_TOLERANCE))
    f, value = _tapered(waveform, chosen, window)
    mass = np.abs(value) / np.abs(value).sum()
    low, high = 0.0, 1e3 / f[1]
    while high > 1.01 * low and high > 1e-12:
        middle = np.sqrt(max(low, 1e-3 * high) * high)
        silent = mass @ np.exp(-0.5 * (2.0 * np.pi * middle * f) ** 2) <= filters.SUPPORT_TOLERANCE
        low, high = (low, middle) if silent else (middle, high)
    return float(high)


@lru_cache(maxsize=64)
def filter_response(chosen: Filter, sampling_frequency: float, samples: int) -> Floats:
    """Response (bin,) of the filter at the `rfft` bins of so many samples."""
    value = filters.response(_bins(sampling_frequency, samples), fir(chosen))
    value.setflags(write=False)
    return value


def _bins(sampling_frequency: float, samples: int) -> Floats:
    return np.asarray(np.arange(samples // 2 + 1) * (sampling_frequency / samples), float)


@lru_cache(maxsize=32)
def _made(model: PulseModel, stamp: Stamp | None, highest: float) -> Pulse:
    if model.at_depth(0.0) != model:
        raise ValueError(f"a {model.kind} snap needs the depth of its source")
    return model.checked_pulse(0.0, highest)


def _pulse(waveform: Waveform, highest: float) -> Pulse:
    """The pulse for waves up to `highest` (Hz), or somewhat more: few pulses serve all frequencies and widths."""
    pulse = _made(waveform.model, waveform.stamp, rounded_up(waveform.width * highest, 2.0))
    return pulse if waveform.width == 1.0 else pulses.scaled(pulse, 1.0, waveform.width)


def _snap_spectrum(waveform: Waveform, longer: float, frequency: Floats) -> Complexes:
    """Spectrum of the snap, unfiltered, at `longer` times frequencies (bin,)."""
    return pulses.spectrum(longer * frequency, _pulse(waveform, 1.2 * float(frequency[-1])))


@lru_cache(maxsize=64)
def _spectrum(waveform: Waveform, chosen: Filter, sampling_frequency: float, samples: int, doppler: float) -> Complexes:
    f, longer = _bins(sampling_frequency, samples), 1.0 + doppler
    value = _snap_spectrum(waveform, longer, f) * filter_response(chosen, sampling_frequency, samples) * longer
    value[2 * f >= sampling_frequency] = 0.0
    value.setflags(write=False)
    return value


def pulse_spectrum(
    waveform: Waveform, chosen: Filter, sampling_frequency: float, samples: int, doppler: float = 0.0
) -> tuple[Floats, Complexes]:
    """Frequencies (bin,) in Hz and spectrum (bin,) in Pa s of the filtered snap at 1 m, at the `rfft` bins of a sample
    grid.

    What the filter leaves at and above half the sampling frequency (under its attenuation) is left out, not folded.
    doppler stretches the snap, p(t/(1 + doppler)), before the filter, which is the receiver's and keeps its band.
    """
    value = _spectrum(waveform, chosen, sampling_frequency, samples, doppler)
    return _bins(sampling_frequency, samples), value


@lru_cache(maxsize=16)
def stretched_spectra(
    waveform: Waveform, chosen: Filter, sampling_frequency: float, samples: int, widest: float, count: int
) -> Complexes:
    """Chebyshev coefficients (degree < count, bin) of `pulse_spectrum` in doppler/widest, from -1 to 1."""
    f, longer = _bins(sampling_frequency, samples), 1.0 + widest * chebyshev(count)
    value = pulses.stretched_spectra(f, _pulse(waveform, 1.2 * float(f[-1])), longer) * longer[:, None]
    value = analysis(count) @ (value * filter_response(chosen, sampling_frequency, samples))
    value[:, 2 * f >= sampling_frequency] = 0.0
    value.setflags(write=False)
    return np.asarray(value)


@lru_cache(maxsize=64)
def stretch_sizes(waveform: Waveform, chosen: Filter, widest: float, sloped: bool = False) -> tuple[float, ...]:
    """Mean moduli of the coefficients (degree,) of `stretched_spectra` where it is heard, over the first; of the
    differentiated snap, if it is sloped. As many as it takes until they are nothing: more, the longer the pulse."""
    stop = stop_frequency(chosen)
    pulse, sizes = _pulse(waveform, 1.2 * stop), np.ones(1)
    fine = np.linspace(0.0, stop, max(int(2.0 * stop * (pulse.end - pulse.start)), 97))  # tones are narrow
    loud = np.abs(pulses.spectrum(fine, pulse) * filters.response(fine, fir(chosen)))
    low, high = fine[loud >= 1e-3 * loud.max()][[0, -1]]
    f = np.linspace(low / (1.0 + widest), min(high / max(1.0 - widest, 0.1), stop), 97)
    filtered = filters.response(f, fir(chosen)) * (f if sloped else 1.0)
    for count in (16, 32, 64, 128, 256, 512):
        at = 1.0 + widest * chebyshev(count)
        value = analysis(count) @ (pulses.stretched_spectra(f, pulse, at) * at[:, None] * filtered)
        sizes = np.abs(value).sum(axis=1)
        if sizes[-count // 4 :].sum() <= 1e-9 * sizes[0]:
            break
    else:
        said = f"pulses too long to be stretched by {widest:.2g} of themselves, as motion does: take direct_sum"
        raise FieldError(("scene", "physics", "synthesis"), said)
    return tuple((sizes / sizes[0]).tolist()) if sizes[0] > 0.0 else (1.0, inf)


@lru_cache(maxsize=64)
def heard_part(waveform: Waveform, chosen: Filter) -> float:
    """Largest modulus of the filtered spectrum over the snap's, at 513 frequencies: peaks between them are missed."""
    f = np.linspace(0.0, stop_frequency(chosen), 513)
    pulse = _pulse(waveform, 1.2 * float(f[-1]))
    bound = np.abs(pulse.strength).sum()  # bounds its spectrum
    passed = np.abs(pulses.spectrum(f, pulse) * filters.response(f, fir(chosen))).max()
    return float(passed / bound) if bound > 0.0 else 0.0


def _peak(waveform: Waveform) -> float:
    """Largest pressure (Pa) at 1 m, as the model's level is taken."""
    return _made(waveform.model, waveform.stamp, 0.0).peak


def snap_levels(emissions: tuple[Emission, ...]) -> Floats:
    """(snap,) peak source level of each snap (dB re 1 uPa at 1 m), as its model's level is taken."""
    with np.errstate(divide="ignore"):
        own = [20.0 * np.log10(_peak(s.waveform) / REFERENCE_PRESSURE) for s in emissions]
    level = [o if s.source_level is None else s.source_level for s, o in zip(emissions, own, strict=True)]
    return np.array([v + 20.0 * np.log10(s.gain) for s, v in zip(emissions, level, strict=True)])


def snap_gains(emissions: tuple[Emission, ...]) -> Floats:
    """(snap,) factor on the pulse of each snap's waveform."""
    return np.array(
        [s.gain * pulses.gain_for_level(_made(s.model, s.waveform.stamp, 0.0), s.source_level) for s in emissions]
    )


@lru_cache(maxsize=16)
def envelope_delay(
    waveform: Waveform, sonar: Sonar, loss: Callable[[Floats], Floats] | None = None, doppler: float = 0.0
) -> float:
    """When (s after its time 0) a pulse, 1 + doppler times as long, is loudest in the band; loss (Hz): dB it loses."""
    band, rate = sonar.band, sonar.sampling_frequency
    samples = 1 << int(np.ceil(np.log2(max(2048.0, 32 * rate / (band.high - band.low)))))
    f, wave = pulse_spectrum(waveform, sonar.antialias, rate, min(samples, LONGEST_ENVELOPE), doppler)
    bins = slice(*np.searchsorted(f, [band.low, np.nextafter(band.high, np.inf)]))
    f, wave = f[bins], wave[bins] if loss is None else wave[bins] * 10.0 ** (-loss(f[bins]) / 20)
    return envelope_peak(f, wave.astype(complex), band.low, band.high)[0]
