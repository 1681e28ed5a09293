"""Single paths, measured in signals: each alone in silence, at one ideal hydrophone in the middle of the array."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from scipy.fft import rfft

from sonarsynth.conventions import Complexes, Floats
from sonarsynth.products import Arrivals
from sonarsynth.receiver import POINT, Sonar
from sonarsynth.signals.array_paths import array_paths, reach
from sonarsynth.signals.filtered_pulse import (
    at_longest,
    pulse_spectrum,
    pulse_support,
    snap_gains,
    stretch_sizes,
    stretched_spectra,
)
from sonarsynth.signals.gridded.nodes import polynomials, rounded_up
from sonarsynth.signals.segments import GUARD, Reception, fast_length, layout
from sonarsynth.sources.snap_pulses import Waveform
from sonarsynth.state import Emission

if TYPE_CHECKING:
    from sonarsynth.signals import SignalSynthesis

FINER = 4.0
"""By how much spectra are finer of which energy in slices is taken: where a rough sea leaves only the lower end of a
sweep, 60 dB down, the level of a path errs by 0.02 dB, and by 0.11 dB at 1."""
STRETCH_TOLERANCE = 1e-6
"""Error of the spectra of pulses that Doppler stretches, relative to their size."""


@lru_cache(maxsize=64)
def energy_in_slices(waveform: Waveform, sonar: Sonar, count: int) -> Floats:
    """Energy (slice,) in Pa2 s, at positive frequencies, of the filtered snap at 1 m in equal slices of the band."""
    f, spectrum = whole_spectrum(waveform, sonar, finer=FINER)
    power = np.abs(spectrum) ** 2
    return _in_slices(f, 0.5 * (power[1:] + power[:-1]), sonar, count)


def sent_energy(snaps: tuple[Emission, ...], sonar: Sonar) -> Floats:
    """Energy (snap,) in Pa2 s of each pulse in the band at 1 m."""
    slices = [float(energy_in_slices(snap.waveform, sonar, 1).sum()) for snap in snaps]
    return np.asarray(2.0 * snap_gains(snaps) ** 2 * np.array(slices).reshape(len(snaps)))


@lru_cache(maxsize=64)
def lateness_in_slices(waveform: Waveform, sonar: Sonar, count: int) -> Floats:
    """Group delay (slice,) in s, after its time 0, of the filtered snap in equal slices of the band, by its energy."""
    f, spectrum = whole_spectrum(waveform, sonar)
    beside = spectrum[:-1] * spectrum[1:].conj()  # turned by the delay from bin to bin
    late, power = (
        _in_slices(f, np.angle(beside) * np.abs(beside), sonar, count),
        _in_slices(f, np.abs(beside), sonar, count),
    )
    return np.asarray(late / (2.0 * np.pi * f[1] * np.where(power > 0.0, power, np.inf)))


def whole_spectrum(
    waveform: Waveform, sonar: Sonar, doppler: float = 0.0, finer: float = 1.0
) -> tuple[Floats, Complexes]:
    """`pulse_spectrum` of a snap that lasts 1 + doppler times as long, in a window with room for all of it; finer: of a
    window so many times as long."""
    fs = sonar.sampling_frequency
    samples = fast_length(int(np.ceil(2.0 * finer * sum(pulse_support(at_longest(waveform), sonar.antialias)) * fs)))
    return pulse_spectrum(waveform, sonar.antialias, fs, samples, doppler)


def _in_slices(f: Floats, density: Floats, sonar: Sonar, count: int) -> Floats:
    """Integrals (slice,) over equal slices of the band of a density (bin - 1,) between frequencies (bin,)."""
    up_to = np.concatenate([[0.0], np.cumsum(density) * f[1]])
    total = np.diff(np.interp(np.linspace(sonar.band.low, sonar.band.high, count + 1), f, up_to))
    total.setflags(write=False)
    return np.asarray(total)


def measured_levels(
    method: SignalSynthesis,
    paths: Arrivals,
    snaps: tuple[Emission, ...],
    sonar: Sonar,
    absorption: Callable[[Floats], Floats] | None,
) -> Floats:
    """Level (path,) in dB of each path alone, measured in the signals that a method of synthesis makes of it.

    The energy in the band of the sonar at `POINT`, over that of the snap at 1 m, through the same filter and
    stretched by the same Doppler. Paths are moved by whole samples into slots of time of their own, so far apart that
    none is heard in another's, and made about equally loud (exactly: by powers of two), so that single precision rounds
    none away beside another; NaN for a snap that is silent in the band. Raises ValueError as the method does.
    """
    count, fs = len(paths.delay), sonar.sampling_frequency
    if not count:
        return np.zeros(0)
    alike = paths.expansion.without("phase", "delay_variance")
    paths = replace(paths, expansion=alike)  # that of the centre is heard
    front = array_paths(paths, snaps, POINT)
    reception = Reception(POINT, sonar, absorption, 0.0, 1)
    before, after = layout(paths, front, snaps, reception).support + reach(front)
    lead = int(np.ceil(before.max() * fs)) + GUARD
    slot = fast_length(lead + int(np.ceil(after.max() * fs)) + GUARD)
    position = lead + slot * np.arange(count)
    mantissa, exponent = np.frexp(paths.amplitude)
    moved = replace(paths, delay=(paths.delay * fs % 1.0 + position) / fs, amplitude=mantissa)
    signals = method.signals(moved, snaps, reception._replace(samples=slot * count))
    spectrum = rfft(np.asarray(signals.pressure[0], float).reshape(count, slot), axis=1) / fs
    at = np.arange(spectrum.shape[1]) - 0.5
    low, high = sonar.band.low * slot / fs, sonar.band.high * slot / fs  # in bins
    inside = np.clip(np.minimum(at + 1.0, high) - np.maximum(at, low), 0.0, 1.0)  # share of each bin
    gain = snap_gains(snaps)
    sent = np.array([
        gain[s] ** 2 * (np.abs(_sent(snaps[s].waveform, sonar, slot, float(d))) ** 2 @ inside)
        for s, d in zip(paths.snap, paths.doppler, strict=True)
    ])  # fmt: skip
    received = np.abs(spectrum) ** 2 @ inside
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(10.0 * np.log10(received / sent) + 20.0 * np.log10(2.0) * exponent)


def _sent(waveform: Waveform, sonar: Sonar, samples: int, doppler: float) -> np.ndarray:
    """Spectrum (bin,) of the filtered snap at 1 m that lasts 1 + doppler times as long, from spectra that are kept."""
    chosen, fs = sonar.antialias, sonar.sampling_frequency
    widest = rounded_up(abs(doppler), 2.0)
    if widest == 0.0:
        return pulse_spectrum(waveform, chosen, fs, samples)[1]
    sizes = np.array(stretch_sizes(at_longest(waveform), chosen, widest))
    enough = np.flatnonzero(np.append(np.cumsum(sizes[::-1])[::-1], 0.0) <= STRETCH_TOLERANCE)[0]
    series = stretched_spectra(waveform, chosen, fs, samples, widest, int(max(enough, 1)))
    return np.asarray((polynomials(np.array([doppler / widest]), len(series)) @ series)[0])
