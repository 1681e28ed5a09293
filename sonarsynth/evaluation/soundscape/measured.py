"""Figures of a sound, with the spread that its blocks give them (bootstrap: Efron 1979, Ann. Statist. 7, 1)."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.signal import csd, welch

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.equations.noise.arrival_counts import APART, fano_factor, loud_arrivals
from sonarsynth.equations.noise.stable_laws import fit_stable_law
from sonarsynth.evaluation.soundscape.octaves import band_means, octave_bands
from sonarsynth.evaluation.soundscape.sound import NothingHeard, Sound

PERCENT = (10.0, 50.0, 90.0, 99.0)
SEGMENT = 1024
"""Samples of a segment of spectra, at most."""
LATE = 0.15
"""Of a segment: as long as sound may take from one hydrophone to another for their coherence to be measured."""
STEP, LOUDER = 5.0, 14.0
"""dB: between levels whose rates are counted, and that these are above the root mean square at least."""
TAIL = 48
"""Levels that exceedance is measured at."""
FITTED = 1 << 13
"""Samples that stable laws are fitted to, at most."""
RESAMPLINGS = 60
"""Resamplings of blocks."""
CROWDED, FEWEST = 0.03, 10
"""Loud arrivals, of which gaps are measured: their rate times `APART` at most, and how many there are at least."""


@dataclass(frozen=True, eq=False)
class Figures:
    """Numbers of a sound; or their standard deviations. NaN where there is none."""

    density: Floats  # (bin,) Pa2/Hz, the mean over hydrophones
    octaves: Floats  # (band,) dB re 1 Pa2/Hz: of the mean density of 1/3 octaves
    rates: Floats  # (level,) 1/s, the mean over hydrophones
    exceedance: Floats  # (tail,) probability
    stable: Floats  # (2,) exponent alpha of a stable law, and its scale in dB re 1 Pa
    moments: Floats  # (2,) root mean square in dB re 1 Pa, excess kurtosis
    percentiles: Floats  # (percent,) dB re 1 Pa: levels of 1 ms
    coherence: Floats  # (frequency, pair)
    fano: Floats  # (1,) of loud arrivals in a block


@dataclass(frozen=True, eq=False)
class _Block:
    """What is summed over blocks."""

    density: Floats
    cross: Floats  # (frequency, pair) complex
    auto: Floats  # (frequency, sensor)
    counts: Ints  # (level,) of all hydrophones
    loud: int  # at the first hydrophone
    above: Floats  # (tail,)
    sums: Floats  # (2,) of squares and fourth powers
    windows: Floats  # (window,) mean square
    samples: Floats  # to fit


@dataclass(frozen=True, eq=False)
class MeasuredFigures:
    """Figures of a sound, what they are of, and their spread."""

    sound: Sound
    frequency: Floats  # (bin,) Hz
    centres: Floats  # (band,) Hz of 1/3 octaves
    edges: Floats  # (band, 2) Hz
    levels: Floats  # (level,) dB re 1 Pa
    tail: Floats  # (tail,) dB re 1 Pa
    at: Floats  # (frequency,) Hz of the coherence
    pairs: Ints  # (pair,) hydrophones, with the first
    loud: float  # dB re 1 Pa: what gaps are of; NaN without
    gaps: Floats  # (gap,) s
    figures: Figures
    spread: Figures


def measure(sound: Sound) -> MeasuredFigures:
    """The figures of a sound. Raises NothingHeard where it is silent."""
    square = float(np.mean([np.mean(block.astype(float) ** 2) for block in sound.pressure]))
    if not square > 0.0:
        raise NothingHeard("the sound is silent: there is nothing to measure")
    root, peak = 10.0 * np.log10(square), 20.0 * np.log10(max(float(np.abs(block).max()) for block in sound.pressure))
    levels = np.arange(np.ceil((root + LOUDER) / STEP), np.ceil(peak / STEP) + 1.0) * STEP
    frequency, at, pairs = _grids(sound)
    bins = (frequency >= sound.band[0]) & (frequency <= sound.band[1])
    centres, edges = octave_bands(*sound.band)
    used = np.isfinite(band_means(frequency, frequency, edges))
    loud, gaps = _loud(sound, levels)
    grid = np.linspace(root - 30.0, peak, TAIL)
    nothing = Figures(*(np.zeros(0) for _ in fields(Figures)))
    grids = MeasuredFigures(
        sound, frequency[bins], centres[used], edges[used], levels, grid, at, pairs, loud, gaps, nothing, nothing
    )
    blocks = [_block(grids, pressure, bins) for pressure in sound.pressure]
    random, count = np.random.default_rng(0), len(blocks)
    again = [_figures(grids, [blocks[n] for n in random.integers(0, count, count)]) for _ in range(RESAMPLINGS)]
    spread = {f.name: _deviation([getattr(figures, f.name) for figures in again]) for f in fields(Figures)}
    return replace(grids, figures=_figures(grids, blocks), spread=Figures(**spread))


def _deviation(values: list[Floats]) -> Floats:
    """Standard deviation of values (...) that are numbers; NaN of fewer than half of them."""
    finite = np.isfinite(values)
    enough = finite.sum(axis=0) > 0.5 * len(values)
    return np.where(enough, np.std(np.where(finite, values, 0.0), axis=0, where=finite | ~enough), np.nan)


def _segment(sound: Sound) -> int:
    return min(SEGMENT, 1 << int(np.log2(sound.pressure.shape[2])))


def _grids(sound: Sound) -> tuple[Floats, Floats, Ints]:
    """Frequencies of spectra, frequencies of the coherence, and the hydrophones that are near enough to the first."""
    size, rate = _segment(sound), sound.sampling_frequency
    frequency = np.fft.rfftfreq(size, 1.0 / rate)
    low, high = sound.band
    at = frequency[[int(np.argmin(np.abs(frequency - f))) for f in (low, 0.5 * (low + high), high)]]
    away = np.linalg.norm(sound.position - sound.position[0], axis=1)
    near = np.flatnonzero((away > 0.0) & (away * rate / 1500.0 < LATE * size))
    return np.asarray(frequency, float), np.asarray(at, float), near


def _loud(sound: Sound, levels: Floats) -> tuple[float, Floats]:
    """The lowest level whose arrivals at the first hydrophone are few enough to be told apart, and enough to count; and
    the gaps between them (s)."""
    if sound.running:
        rate, signal = sound.sampling_frequency, np.concatenate([block[0] for block in sound.pressure])
        for level in levels.tolist():
            first = loud_arrivals(signal, 10.0 ** (level / 20.0), rate)
            if FEWEST <= len(first) < CROWDED / APART * sound.seconds:
                return level, np.diff(first) / rate
    return float("nan"), np.zeros(0)


def _block(grids: MeasuredFigures, pressure: Floats, bins: Bools) -> _Block:
    sound, rate = grids.sound, grids.sound.sampling_frequency
    size = _segment(sound)
    density = welch(pressure, rate, nperseg=size, axis=-1)[1]
    at = [int(np.argmin(np.abs(np.fft.rfftfreq(size, 1.0 / rate) - f))) for f in grids.at]
    cross = [csd(pressure[n], pressure[0], rate, nperseg=size)[1][at] for n in grids.pairs.tolist()]
    counts = [sum(len(loud_arrivals(row, 10.0 ** (level / 20.0), rate)) for row in pressure) for level in grids.levels]
    loud = 0 if np.isnan(grids.loud) else len(loud_arrivals(pressure[0], 10.0 ** (grids.loud / 20.0), rate))
    ordered = np.sort(np.abs(pressure.ravel()))
    above = 1.0 - np.searchsorted(ordered, 10.0 ** (grids.tail / 20.0), side="right") / ordered.size
    square = pressure.astype(float) ** 2
    window = max(min(round(1e-3 * rate), pressure.shape[1]), 1)
    windowed = pressure.shape[1] // window * window
    step = int(np.ceil(sound.pressure.shape[0] * pressure.shape[1] / FITTED))
    return _Block(
        density=density[:, bins].mean(axis=0),
        cross=np.array(cross, complex).reshape(len(cross), len(at)).T,
        auto=density[:, at].T,
        counts=np.array(counts, int),
        loud=loud,
        above=above,
        sums=np.array([square.mean(), (square**2).mean()]),
        windows=square[:, :windowed].reshape(-1, window).mean(axis=1),
        samples=pressure[0, ::step].astype(float),
    )


def _figures(grids: MeasuredFigures, blocks: list[_Block]) -> Figures:
    """The figures of some blocks."""
    density = np.mean([b.density for b in blocks], axis=0)
    square, fourth = np.mean([b.sums for b in blocks], axis=0)
    sensors, seconds = len(grids.sound.position), grids.sound.seconds
    cross, auto = (np.sum([getattr(b, name) for b in blocks], axis=0) for name in ("cross", "auto"))
    alpha, scale = _fit(np.concatenate([b.samples for b in blocks]))
    with np.errstate(divide="ignore", invalid="ignore"):
        return Figures(
            density=density,
            octaves=10.0 * np.log10(band_means(grids.frequency, density, grids.edges)),
            rates=np.sum([b.counts for b in blocks], axis=0) / (sensors * seconds),
            exceedance=np.mean([b.above for b in blocks], axis=0),
            stable=np.array([alpha, 20.0 * np.log10(scale)]),
            moments=np.array([10.0 * np.log10(square), fourth / square**2 - 3.0]),
            percentiles=10.0 * np.log10(np.percentile(np.concatenate([b.windows for b in blocks]), PERCENT)),
            coherence=cross.real / np.sqrt(auto[:, :1] * auto[:, grids.pairs]),
            fano=np.array([np.nan if np.isnan(grids.loud) else fano_factor(np.array([b.loud for b in blocks]))]),
        )


def _fit(samples: Floats) -> tuple[float, float]:
    """alpha and scale; NaN where no law fits."""
    try:
        return fit_stable_law(samples)
    except ValueError:
        return float("nan"), float("nan")
