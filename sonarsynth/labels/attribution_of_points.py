"""Whose energy a beam holds at a delay: the paths of the frame, as the beam hears them.

A path brings a beam its spectrum times the pattern of the array, with its focus and grating lobes, between the two
directions; paths of one snap, target and family are summed with their phases over a band of frequencies that is matched
to the pulse as ranging does it, at the delay of the point. The loudest group there made the point.

Against signals of each group alone, beamformed as the sonar does: the same group in all points whose two loudest are
3 dB apart (`tests/laws/test_labels_of_points.py`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from sonarsynth.columns import rows_of
from sonarsynth.conventions import NO_TARGET, Complexes, Floats, Ints
from sonarsynth.equations.arrays.apertures import live_gain
from sonarsynth.equations.scattering.facet_pulses import facet_response
from sonarsynth.geometry.motion import Track
from sonarsynth.labels import point_kernels as kernels
from sonarsynth.labels.level_band import Band
from sonarsynth.products import FAMILIES, Arrivals, Kind
from sonarsynth.receiver import Elements

GATE = 2.5
"""Of 1/bandwidth: how far in time from a point a path still adds to it. A raised cosine in frequency is heard for 2."""
MOST_BINS = 48
"""Frequencies that paths are summed at: enough for echoes that cross the largest array through its side lobes."""
OVERSAMPLING = 8
"""Of the pattern of a lattice: 16 values for each of its columns. Bilinear between them: 0.5 % of the main lobe."""
WIDEST_DEFOCUS = 40
"""Tables either side of the focus: what is further out of focus is taken for as far."""
WHITENING = 0.03
"""Share of the pulse's largest power density below which ranging flattens it no more (`ranging.range_profiles`)."""
SHIFTED = 0.05
"""Of 1/bandwidth: by how much pulses that motion makes longer may be sooner or later without a word."""
FAINT = 1e-4
"""Of the power of all paths of a snap, target and way that the faintest may bring together, and are left out: 40 dB
under echoes of which the loudest 25 dB are picked."""


@dataclass(frozen=True, eq=False)
class SonarTiming:
    """How the sonar listens and what it knows of the frame's clock."""

    elements: Elements
    sound_speed: float  # m/s that beams are steered by
    focus: float | None  # m
    clock: float  # s: when the direct pulse that delays are counted from is loudest
    track: Track  # of the array
    late: Floats  # (snap,) s: when its pulse is loudest, after the time that delays of paths count from


class _PatternTables:
    """Patterns of a lattice in and out of focus, kept from frame to frame: as many as were asked for."""

    def __init__(self, elements: Elements) -> None:
        self._elements = elements
        self._kept = 0, _table(elements, 0)[None]

    def holding(self, low: int, high: int) -> tuple[int, npt.NDArray[np.complex64]]:
        """Which defocus the first is of, at most `low`; and tables (defocus, row step, column step) up to `high`."""
        first, tables = self._kept
        last = first + len(tables) - 1
        if low < first or high > last:
            before = [_table(self._elements, level) for level in range(low, first)]
            after = [_table(self._elements, level) for level in range(last + 1, high + 1)]
            self._kept = first, tables = min(low, first), np.stack([*before, *tables, *after])
        return first, tables


def _table(elements: Elements, level: int) -> npt.NDArray[np.complex64]:
    """Pattern (row step, column step) of a lattice over two periods of its grating lobes, so far out of focus."""
    size = OVERSAMPLING * 2 * max(elements.rows, elements.columns)
    weights = np.zeros((size, size), complex)
    live = np.flatnonzero(elements.gain)
    bulge = level * kernels.RIM_STEP * np.sum((elements.position[live] / elements.aperture) ** 2, axis=1)
    y = (elements.columns - 1 - 2 * elements.column[live]) % size
    z = (elements.rows - 1 - 2 * elements.row[live]) % size
    weights[z, y] = live_gain(elements.gain)[live] * np.exp(-1j * bulge)
    return np.pad((np.fft.ifft2(weights) * size**2).astype(np.complex64), (0, 2), mode="wrap")


_tables = lru_cache(maxsize=2)(_PatternTables)


def pattern_of(elements: Elements, speed: float, curvature: Floats, focus: float, top: float) -> kernels.Pattern:
    """Pattern of an array for waves of curvature (path,) 1/m where beams are focused at `focus` (1/m), up to `top`
    (Hz): tables for a lattice, its sensors elsewhere."""
    if not (elements.on_lattice and elements.aperture > 0.0):
        live = np.flatnonzero(elements.gain)
        sensors = elements.position[live] / speed, live_gain(elements.gain)[live]
        return kernels.Pattern(np.zeros((0, 0, 0), np.complex64), 0, 1.0, 0.0, *sensors)
    step = kernels.RIM_STEP * speed / (np.pi * elements.aperture**2)
    ends = np.clip(np.rint(top * (curvature - focus) / step), -WIDEST_DEFOCUS, WIDEST_DEFOCUS)
    low, high = int(min(ends.min(initial=0.0), 0.0)), int(max(ends.max(initial=0.0), 0.0))
    first, tables = _tables(elements).holding(low, high)
    return kernels.Pattern(tables, first, step, elements.pitch / speed, np.zeros((0, 3)), np.zeros(0))


@dataclass(frozen=True, eq=False)
class Attribution:
    """Whose energy beams hold at delays: groups of paths of one snap and target, and of one way to each."""

    clock: float  # s: when the direct pulse that delays are counted from arrives
    arrivals: Arrivals
    rows: Ints  # (path,) those of them that may be heard, ascending in delay
    first: Ints  # (point,) the first path that may be heard then
    target: Ints  # (group,) -1: the snap itself, or scatterers without a body
    snap: Ints  # (group,)
    family: Ints  # (group,) index into FAMILIES: on the way to the array
    lit_by: Ints  # (group,) index into FAMILIES: on the way to the target
    power: Floats  # (point, group) at the delay, in any unit
    energy: Floats  # (point, group) Pa2 s about it
    owner: Ints  # (point,) the loudest group, -1 without any
    share: Floats  # (point, path from first on) of the power of the loudest group: see `point_kernels.attribute`


def attribution(
    arrivals: Arrivals, band: Band, listening: SonarTiming, beam: Floats, late: Floats, beam_energy: Floats,
    most_bins: int = MOST_BINS,
) -> Attribution:  # fmt: skip
    """Whose energy beams (point, xyz) hold at delays (point,) s after the clock; beam_energy (point,): Pa2 s;
    most_bins: frequencies that paths are summed at, at most.

    The snap itself, not by a target, is taken to bring no more than echoes leave of that: the sonar may have taken it
    out (`ranging.WavefrontCancelling`).
    """
    elements, width = listening.elements, band.high - band.low
    gate, reach = GATE / width, elements.aperture / listening.sound_speed
    clock, doppler = _clock(arrivals, listening, gate)
    stretch, shift = _stretches(arrivals, doppler, band)
    moment, longer = clock + late, kernels.largest(arrivals.corner_delays, shift)
    slowness = listening.sound_speed / arrivals.sound_speed
    window = gate + reach * kernels.farthest(arrivals.direction, slowness, beam) + longer.max(initial=0.0)
    code = _code(arrivals, len(band.energy))
    rows = kernels.loud_at(np.sort(moment), window, arrivals.delay, arrivals.amplitude, code, FAINT)
    rows = rows[np.argsort(arrivals.delay[rows], kind="stable")]
    delay, direction, code = arrivals.delay[rows], rows_of(arrivals.direction, rows), code[rows]
    first, last = np.searchsorted(delay, [moment - window, moment + window])
    known = np.flatnonzero(np.bincount(code))  # (group,) its code
    group = np.searchsorted(known, code)
    example = np.empty(len(known), np.int64)
    example[group[::-1]] = rows[::-1]  # the first path of each
    groups = arrivals.target[example], arrivals.snap[example], arrivals.arrives_by[example], arrivals.lit_by[example]
    if not len(rows):
        none = np.zeros((len(beam), 0))
        owner, share = np.full(len(beam), NO_TARGET), np.zeros((len(beam), 1))
        return Attribution(clock, arrivals, rows, first, *groups, none, none, owner, share)
    across = gate + reach * kernels.farthest(direction, slowness, beam)  # without those that come at other times
    fine = band.sliced(min(2.0 * width * across, most_bins))
    focus = 0.0 if listening.focus is None else 1.0 / listening.focus
    curvature, pulse = 1.0 / arrivals.radius[rows], fine.energy[groups[1]]
    heard = _spectra(arrivals, rows, stretch, elements, fine), _matched(fine)[groups[1]], pulse, fine.frequency
    columns = kernels.attribute(
        beam, moment, 0.5 * beam_energy, first, last, direction, slowness, delay, curvature, longer[rows], group,
        arrivals.coherent[rows], arrivals.kind[example] == Kind.DIRECT, *heard, focus, listening.sound_speed, gate,
        reach, pattern_of(elements, listening.sound_speed, curvature, focus, band.high),
    )  # fmt: skip  # of the energy, the half at positive frequencies
    return Attribution(clock, arrivals, rows, first, *groups, columns[0], 2.0 * columns[1], *columns[2:])


def _code(paths: Arrivals, snaps: int) -> Ints:
    """Number (path,) of the target, snap and ways to target and array of each."""
    ways = paths.lit_by * len(FAMILIES) + paths.arrives_by
    last = int(paths.target.max(initial=NO_TARGET)) + 1
    owner = np.where(paths.kind == Kind.REVERBERATION, last, paths.target)
    return np.asarray(((owner + 1) * snaps + paths.snap) * len(FAMILIES) ** 2 + ways)


def _clock(arrivals: Arrivals, listening: SonarTiming, gate: float) -> tuple[float, float]:
    """When (s) the direct pulse that delays are counted from arrives, and its Doppler: as traced, where one is loudest
    at that time."""
    rows = np.flatnonzero(arrivals.direct)
    rows = rows[(arrivals.surface[rows] == 0) & (arrivals.bottom[rows] == 0)]
    if not len(rows):
        return listening.clock, 0.0
    off = np.abs(arrivals.delay[rows] + listening.late[arrivals.snap[rows]] - listening.clock)
    near = rows[np.argmin(off)]
    return (float(arrivals.delay[near]), float(arrivals.doppler[near])) if off.min() < gate else (listening.clock, 0.0)


def _stretches(arrivals: Arrivals, doppler: float, band: Band) -> tuple[Floats, Floats]:
    """By what part (path,) pulses last longer than the direct one, of this Doppler; and by how much (path,) s they are
    ranged sooner or later for it, at the most: where that is nothing, 0."""
    stretch = arrivals.doppler - doppler
    shift = np.abs(stretch) * _by_stretch(band)[arrivals.snap]
    told = shift.max(initial=0.0) * (band.high - band.low) > SHIFTED
    return (stretch, shift) if told else (np.zeros(len(shift)), np.zeros(len(shift)))


@lru_cache(maxsize=16)
def _by_stretch(band: Band) -> Floats:
    """By how much (snap,) s pulses are ranged sooner or later where they last twice as long, at the most."""
    loud = band.weight > WHITENING * band.weight.max(axis=1, keepdims=True)
    late = np.gradient(band.frequency * band.late, band.frequency, axis=1)
    return np.asarray(np.where(loud, np.abs(late), 0.0).max(axis=1))


def _spectra(arrivals: Arrivals, rows: Ints, stretch: Floats, elements: Elements, band: Band) -> Complexes:
    """Spectra (path, bin) that elements hear of some paths (path,), over that of the snap at 1 m; stretch (path of
    all,): by what part pulses last longer.

    P(f (1 + s)) = P(f) exp(-2 pi i s f tau), tau the group delay of the pulse: where frequencies come one after the
    other a shift of frequency is one of time. Source: Woodward (1953), Probability and Information Theory, with
    Applications to Radar, chapter 7.
    """
    amplitude = arrivals.amplitude[rows]
    if arrivals.occluded.shape[1]:  # of the array, as much as sees it
        occluded = rows_of(arrivals.occluded, rows)
        hidden = np.bitwise_count(occluded) @ np.ones(occluded.shape[1]) - (occluded[:, 0] >= 128)
        amplitude = amplitude * (1.0 - hidden / elements.count)
    sine = rows_of(arrivals.direction, rows)[:, 1:] * (elements.face / arrivals.sound_speed)
    frequency, losses = band.frequency, (arrivals.absorption[rows], arrivals.delay_std[rows])
    spectra = kernels.path_spectra(
        amplitude, arrivals.phase[rows], arrivals.delay[rows], *losses, sine, frequency, band.relative
    )
    if stretch.any():
        spectra *= np.exp(-2j * np.pi * stretch[rows, None] * (frequency * band.late)[arrivals.snap[rows]])
    columns = arrivals.coherent, arrivals.corner_delays, arrivals.coherent_fraction, arrivals.height_delay_std
    echo = [rows_of(column, rows) for column in columns]
    shaped = np.flatnonzero(echo[0] | (echo[1].any() and echo[1].any(axis=1)) | (echo[2] > 0.0))
    if len(shaped):
        coherent, corners, fraction, height = (column[shaped] for column in echo)
        spectra[shaped] *= facet_response(frequency, coherent, corners, fraction, height, arrivals.centre)
    return spectra


@lru_cache(maxsize=16)
def _matched(band: Band) -> Floats:
    """Amplitude (snap, bin) of pulses in what ranges them: flattened by the mean pulse, and a raised cosine."""
    mean = band.weight.mean(axis=0)
    taper = np.sin(np.pi * (np.arange(len(mean)) + 0.5) / len(mean)) ** 2
    return np.asarray(np.sqrt(band.energy * mean) * (taper / (mean + WHITENING * mean.max())))
