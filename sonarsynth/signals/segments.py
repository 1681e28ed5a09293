"""The arrivals that a window holds, sorted into short segments of time that are synthesised one by one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import dist
from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.equations.noise.filters import SUPPORT_TOLERANCE
from sonarsynth.equations.scattering.facet_pulses import rough_factor
from sonarsynth.products import Arrivals, Kind
from sonarsynth.receiver import Elements, Sonar, stop_frequency
from sonarsynth.signals.array_paths import ArrayPaths, Wavefronts, delay_and_gain, face_reach, reach
from sonarsynth.signals.filtered_pulse import PULSE_FEET, at_longest, pulse_support, silencing_blur
from sonarsynth.sources.snap_pulses import Waveform
from sonarsynth.state import Emission

FAST = (16, 18, 20, 24, 27, 30)
"""Lengths of segments are these times powers of two: fast to transform, and so few that cached spectra of pulses are
used again."""

NOWHERE = np.zeros((0, 3))
"""No point (point, xyz)."""
GUARD = 4
"""Samples of silence at either end of a segment: half of the widest kernel that interpolates it at hydrophones."""


class Reception(NamedTuple):
    """The hydrophones, the absorption of the water, and the window in which arrivals are synthesised."""

    elements: Elements
    sonar: Sonar
    absorption: Callable[[Floats], Floats] | None  # dB/m at frequencies (Hz); none: no absorption
    start: float  # s: the first sample, by the clock of the arrivals
    samples: int
    whole: bool = True  # False: signals may begin later and end sooner, where there is silence in all that is left out
    still: bool = False  # True: the array does not move, and may hear few paths again as they are


@dataclass(frozen=True, eq=False)
class Segment:
    """Paths of one waveform whose pulses overlap in time, and the samples that hold them at the array centre."""

    paths: Ints  # (path,) which
    waveform: Waveform
    coherent: bool  # all pulses are differentiated, or none
    first: int  # sample of the window where it begins; may be negative
    samples: int  # even
    before: float  # s: no pulse begins sooner before it arrives
    after: float  # s: none ends later


@dataclass(frozen=True, eq=False)
class Layout:
    """The segments of a window, and which arrivals it holds."""

    stretches: tuple[Segment, ...]
    audible: Bools  # (path,) some of the pulse is in the window at some hydrophone
    outside: int  # paths but reverberation whose pulse is not wholly in the window at every hydrophone
    support: Floats  # (before or after, path) s: how far a pulse reaches from its arrival


def fast_length(samples: int) -> int:
    """The smallest even length of the list `FAST` times a power of two that holds so many samples."""
    scale = 2
    while FAST[-1] * scale < samples:
        scale *= 2
    return next(m * scale for m in FAST if m * scale >= samples)


def layout(
    arrivals: Arrivals,
    front: ArrayPaths,
    snaps: tuple[Emission, ...],
    reception: Reception,
    *,
    tolerance: float = SUPPORT_TOLERANCE,
) -> Layout:
    """Sort arrivals into segments: direct paths and echoes apart (they differ by tens of dB), each waveform apart, and
    coherent echoes apart, whose pulses are differentiated. tolerance: of its peak, what a pulse may still be at the
    ends of a segment.
    """
    elements, sonar, _, start, samples, *_ = reception
    if samples < 1:
        raise ValueError("a window needs at least one sample")
    fs = sonar.sampling_frequency
    plain, support, silent = _supports(arrivals, front, snaps, sonar, SUPPORT_TOLERANCE)
    longer = support if tolerance >= SUPPORT_TOLERANCE else _supports(arrivals, front, snaps, sonar, tolerance)[1]
    smeared = face_reach(front, elements)
    support, longer = support + smeared, longer + smeared
    before, after = support
    early, late = _extent(front, elements, before, after, start, start + (samples - 1) / fs)
    cut = ~silent & ((early < start) | (late > start + (samples - 1) / fs))
    audible = ~silent & (late > start) & (early < start + (samples - 1) / fs)
    stretches: list[Segment] = []
    waveforms, kind = [s.waveform for s in snaps], 2 * front.coherent + ~arrivals.direct
    begin, end = early + before - plain[0], late - after + plain[1]
    for waveform in dict.fromkeys(waveforms):
        same = np.array([w == waveform for w in waveforms])[arrivals.snap] & audible
        for number in range(4):
            rows = np.flatnonzero(same & (kind == number))
            for chosen in overlapping(rows, begin, end):
                sooner, later = np.take(longer, chosen, axis=1).max(axis=1)
                delay, spread = front.delay[chosen] - start, steered_spread(front, ends_of(front, chosen))
                first = int(np.floor((delay.min() - sooner - spread) * fs)) - GUARD
                length = fast_length(int(np.ceil((delay.max() + later + spread) * fs)) + GUARD + 1 - first)
                stretches.append(Segment(chosen, waveform, number > 1, first, length, float(sooner), float(later)))
    return Layout(tuple(stretches), audible, int((cut & (arrivals.kind != Kind.REVERBERATION)).sum()), support)


def _supports(
    arrivals: Arrivals, front: ArrayPaths, snaps: tuple[Emission, ...], sonar: Sonar, tolerance: float
) -> tuple[Floats, Floats, Bools]:
    """Support (before or after, path) of each pulse in s: in its plain shape or its slope's, and in its own; and which
    (path,) are silent, blurred or from a facet that is not rough."""
    if not front.count:
        return np.zeros((2, 0)), np.zeros((2, 0)), np.zeros(0, bool)
    chosen, rough = sonar.antialias, front.coherent_fraction > 0.0
    spread = front.expansion.largest("delay_variance")
    delay_std, least = np.sqrt(front.variance + spread), np.sqrt(np.maximum(front.variance - spread, 0.0))
    turned = (front.phase != 0.0) | front.expansion.phase.any(axis=1)
    longest = [at_longest(s.waveform) for s in snaps]
    roughest = float(front.height_delay_std[rough].max(initial=0.0))

    def each(turned: Bools, rough: Bools) -> Floats:
        kinds = front.coherent + 2 * turned + 4 * rough
        table = np.zeros((8, len(snaps), 2))
        for kind in np.flatnonzero(np.bincount(kinds)).tolist():
            turn, slope, blur = kind & 2 > 0, kind % 2 == 1, roughest * (kind >= 4)
            table[kind] = [pulse_support(w, chosen, tolerance, turned=turn, sloped=slope, rough=blur) for w in longest]
        return np.asarray(table[kinds, arrivals.snap].T)

    none, silent = np.zeros(front.count, bool), np.zeros(front.count, bool)
    plain = each(none, none)
    support = each(turned, rough) if turned.any() or roughest else plain
    if delay_std.any():
        silent = least >= np.array([silencing_blur(w, chosen) for w in longest])[arrivals.snap]
    if rough.any():
        highest = np.array([stop_frequency(chosen)])
        factor = rough_factor(highest, front.coherent_fraction, front.height_delay_std)[:, 0]
        silent |= factor <= SUPPORT_TOLERANCE
    a, b, c = front.corner_delays.T
    wide = np.stack([-np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)])
    return plain, support * (1.0 + np.abs(front.doppler)) + np.where(silent, 0.0, PULSE_FEET * delay_std) + wide, silent


def _extent(
    front: ArrayPaths, elements: Elements, before: Floats, after: Floats, start: float, stop: float
) -> tuple[Floats, Floats]:
    """When the pulse of each path begins at the first hydrophone and ends at the last (path,) in s: bounds, which are
    exact for paths that may leave the window."""
    spread = reach(front)
    early, late = front.delay - spread - before, front.delay + spread + after
    doubtful = np.flatnonzero((early < start) | (late > stop))
    for rows in (doubtful[i : i + 1024] for i in range(0, doubtful.size, 1024)):  # bounds the memory
        delay, _ = delay_and_gain(front.select(rows), elements.position)
        early[rows] = front.delay[rows] + delay.min(axis=1) - before[rows]
        late[rows] = front.delay[rows] + delay.max(axis=1) + after[rows]
    return early, late


def overlapping(rows: Ints, early: Floats | Ints, late: Floats | Ints) -> Iterator[Ints]:
    """Rows in runs that overlap in time, in its order; each run keeps the order of the rows. early, late (row,): when
    each begins and ends, in s or samples."""
    if not rows.size:
        return
    if early[rows].max() <= late[rows].min():  # all of them at one time
        yield rows
        return
    order = rows[np.argsort(early[rows])]
    silent = early[order[1:]] > np.maximum.accumulate(late[order])[:-1]
    for run in np.split(order, np.flatnonzero(silent) + 1):
        yield np.sort(run)


def ends_of(front: Wavefronts, paths: Ints, points: Floats = NOWHERE, gradient: Floats = NOWHERE) -> Floats:
    """The smallest and the largest (2, column) of some paths: direction (xyz), curvature (1/m), absorption (dB), delay
    terms (s); and at points (point, xyz) in m the unit vectors towards sources, to which delay terms add -c times their
    gradient (xyz, point, term) per m."""
    from sonarsynth.signals.gridded.variation_kernels import extremes

    late, lean = front.expansion.delay, np.zeros((0, 3, 0))
    if late.size and points.size:
        slopes = -front.sound_speed * gradient[:, :, : late.shape[1]]
        lean = np.einsum("et,ipt->pie", late[paths], slopes, order="C")
    ends: Floats = extremes(front.direction, front.curvature, front.loss, late, lean, paths, points)
    return ends


def steered_spread(front: Wavefronts, ends: Floats) -> float:
    """Bound (s) on how much sooner or later paths with such ends (`ends_of`) meet any hydrophone than one front from
    among them, which meets the array centre when they do."""
    aperture, (low, high) = front.aperture, ends[:, : 5 + front.expansion.delay.shape[1]].tolist()
    late = list(zip(low[5:], high[5:], strict=True))
    spread: float = 2.0 * (aperture / front.sound_speed + sum(max(-a, b) for a, b in late))
    if high[3] * aperture > 0.5:
        return spread
    # |R d - q| - R varies with d by at most 2 |q|, with 1/R by at most |q|^2
    apart = 2.0 * aperture * dist(low[:3], high[:3]) + aperture**2 * (high[3] - low[3])
    return min(spread, float(apart / front.sound_speed + sum(b - a for a, b in late)))
