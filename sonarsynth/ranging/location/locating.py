"""Locate snaps: from the signals to directions and distances, with predicted errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Floats, Ints, scattered
from sonarsynth.equations.arrays.spherical_wave import Wavefront, robust_wave, spherical_wave, wavefront_delays
from sonarsynth.geometry import Pose
from sonarsynth.products import Signals, SourceEstimates
from sonarsynth.ranging.location import pulse_times
from sonarsynth.ranging.location.candidates import (
    FAINT,
    QUIET,
    Candidate,
    Candidates,
    as_estimates,
    clipping_error,
    loudness,
    quiet_bin,
    when_heard,
)
from sonarsynth.ranging.location.locating_method import ahead, hearing_whole, unlocatable
from sonarsynth.ranging.location.pulse_times import AlignedPulse, Pulse
from sonarsynth.ranging.location.source_position import (
    ACCEPTED,
    ARRAY,
    BAND,
    CUT,
    RANGE,
    UNFIT,
    UNRESOLVED,
    Bend,
    SonarKnowledge,
    SourceFix,
    place,
    refused,
)
from sonarsynth.receiver import Elements, Sonar
from sonarsynth.state import Receiver

FEW = 64
"""Sensors that the first fit is made of where it errs by under 0.01 periods of the band centre; else all."""
ROUNDS = 4
"""Alignments of the sensors on the wavefront, at most; each improves the last, and the lags left settle the fit."""
ASIDE = 1e-3
"""Of half a window that is cut out about a pulse: where one is farther aside of its pulse than that, all are cut anew.
Cut aside of its pulse, a tail shifts it by 1 % of that: 16 ns, or 1.5 degrees, of a pulse of 3 kHz along the array.
"""
CLEAR = 3e4
"""Energy of a pulse at a sensor over that of the noise in a bin, above which so few sensors are tried."""
ALONE = 2.0
"""Noise of a longer window, over the share of it that is longer, up to which a pulse is alone in that, if no more than
`SHARED` of it is unexplained."""
ROBUST_ROUNDS = 3
"""Reweightings that turn outliers out of the first fit, at most."""
FIRST_STEPS = 3
"""Steps from the plane wave to the first sphere."""
SHARED = 0.05
"""Share of a pulse's power at the sensors that its wavefront may leave unexplained, unless it is the noise's own:"""
AUDIBLE = 4.0
"""no more than this factor over the power of the quiet."""
LOST = 0.5  # the share of other sound with which a pulse is refused without a look at how long it lasts
PERIODS_OFF = 1 / 6
"""Standard error of the first fit, root mean square over the sensors, in periods of a tone: with more, a sensor may be
taken a whole period early or late, and the pulse to come from a grating lobe."""
MAX_LAG = 0.15
"""A pulse whose lags exceed this share of a period (root mean square, band centre) is not one wavefront."""


def locate(
    signals: Signals,
    receiver: Receiver,
    bottom: float,
    snaps: int,
    *,
    bend: Callable[[Pose], Bend] | None = None,
    gradient: float = 0.0,
    kink: float = 0.0,
    on_bottom: bool = True,
    reflected: bool = False,
) -> SourceEstimates:
    """The `snaps` loudest direct pulses, loudest first; see `ranging.SensorDelays`. bottom: its depth (m).

    Paths to an array that has a pose bend as `bend` says. Where it is not undone, errors hold it; of those whose range
    is not known, what a `gradient` (1/s) of the sound speed may do, and those of directions what its change over the
    array does, a `kink` (1/s). Pulses that are refused follow those that are not, loudest first.
    """
    elements, sonar = receiver.elements, receiver.sonar
    if unlocatable(elements) is not None:
        return as_estimates([], snaps, ARRAY)
    if pulse_times.half_length(sonar.band) > pulse_times.LONGEST_HALF:
        return as_estimates([], snaps, BAND)
    if not signals.pressure.shape[1] or not snaps:
        return as_estimates([], snaps)
    short, rate = pulse_times.half_length(sonar.band), signals.sampling_frequency
    half = pulse_times.transit(elements, sonar.assumed_sound_speed) + 2 * short
    width = int(2 * half * rate) | 1
    loud, count = loudness(signals, elements.gain != 0, width), int(np.count_nonzero(elements.gain))
    rounding = pulse_times.rounding(signals, loud.peak, short)
    quiet = quiet_bin(loud.quiet, count, sonar.band, short)
    least = max(QUIET * max(loud.quiet, count * rounding * rate / (2 * short)), FAINT * float(loud.track.max()))
    known = SonarKnowledge(
        elements, sonar, receiver.pose, bottom, gradient, rounding, quiet, on_bottom, kink, reflected
    )
    track, candidates = loud.track.copy(), Candidates(known)

    def look(heard: Signals, centre: float, power: float) -> Candidate:
        own = when_heard(known, receiver.track, centre)
        return Candidate(centre, power, candidate(heard, own, centre, half, None if bend is None else bend(own.pose)))

    for _ in range(4 * snaps):
        top = _loudest(track, candidates, signals, snaps)
        if top is None or not track[top] > least:
            break
        candidates.add(look(signals, signals.start + top / rate, float(track[top])), short)
        track[max(top - width, 0) : top + width + 1] = 0.0
    if snaps > 1:
        candidates.look_beside(signals, receiver.track, width, least, look)
    return as_estimates(candidates.rows, snaps)


def _loudest(track: Floats, candidates: Candidates, signals: Signals, snaps: int) -> int | None:
    """Where the signals are loudest; once enough snaps are found, before the first of them: it may be an echo."""
    if len(candidates.found) < snaps or candidates.accepted < snaps:
        return int(track.argmax())
    first = min(candidate.centre for candidate in candidates.found if candidate.row.reason in (ACCEPTED, RANGE))
    before = track[: max(round((first - signals.start) * signals.sampling_frequency), 0)]
    return int(before.argmax()) if before.any() else None


def candidate(signals: Signals, knowledge: SonarKnowledge, centre: float, half: float, bend: Bend | None) -> SourceFix:
    """The loudest pulse about `centre` (s) by itself; refused where its data do not support a place."""
    elements, sonar = knowledge.elements, knowledge.sonar
    fitted = fit_pulse(signals, elements, sonar, centre, half, knowledge.velocity, knowledge.quiet)
    if isinstance(fitted, int):
        return refused(fitted)
    wave, pulse, elements = ahead(fitted[0], elements), *fitted[1:]
    longer = max(round(0.5 * pulse.window / pulse_times.half_length(sonar.band)), 1)  # so much more noise is in a bin
    knowledge = replace(knowledge, rounding=longer * knowledge.rounding, quiet=longer * knowledge.quiet)
    if pulse.share > SHARED and pulse.noise > AUDIBLE * knowledge.quiet:
        return refused(UNRESOLVED)
    if bend is None:
        row = place(wave, pulse, knowledge)
    else:
        from sonarsynth.ranging.location.refraction import placed_along_rays  # few need it

        row = placed_along_rays(wave, pulse, elements, knowledge, bend)
    clipping = clipping_error(signals, elements, sonar, centre, half)
    return replace(row, time_error=float(np.hypot(row.time_error, clipping)))


def fit_pulse(
    signals: Signals, elements: Elements, sonar: Sonar, centre: float, half: float, velocity: Floats, quiet: float
) -> tuple[Wavefront, Pulse, Elements] | int:
    """Wavefront of the pulse about `centre` (s), the pulse as measured last, and the sensors where they hear it; or why
    it is refused, of REASONS. velocity (sensor, xyz): m/s, sonar frame; quiet as `SonarKnowledge` has it.

    Envelope peaks of the sensors give eq. 6 in closed form, then the sphere, robustly; then the sensors are aligned
    and their lags measured coherently, until these settle: of few sensors first, where these hear it clearly. A pulse
    whose tails the window of a snap cuts is measured in a longer one, where it is alone in that.
    """
    first = _first_wave(signals, elements, sonar, centre, half, quiet)
    if isinstance(first, int):
        return first
    wave, off, rows, elements = first
    few: _Aligned | int | None = None
    if not isinstance(rows, slice):
        heard = _excerpt(signals, rows, wave.time, half + pulse_times.half_length(sonar.band))
        own = velocity[rows] if velocity.any() else velocity
        few = _aligned(heard, elements.select(rows), sonar, wave, own, quiet)
        if isinstance(few, int):
            return few
        wave = few.wave
    by_all = partial(_aligned, signals, elements, sonar, velocity=velocity, quiet=quiet)
    tails = pulse_times.cuts_tails(sonar.band) or pulse_times.null_in_band(elements, sonar, wave.direction)
    found = few if few and tails else by_all(wave)
    other: _Aligned | int | None = None
    if tails and not isinstance(found, int):
        other = by_all(found.wave, longer=found.longer * pulse_times.LONGER, deaf=found.pulse.noise_to_signal)
        if not isinstance(other, int) and _alone(other, found.pulse.noise, quiet):
            found, other = other, found
        elif found is few:
            found = by_all(wave)
    if isinstance(found, int):
        return found
    wave, pulse, moved, _ = found
    if not np.sqrt(pulse.weight @ wave.residual**2 / pulse.weight.sum()) < MAX_LAG / sonar.band.centre:
        return UNFIT
    if pulse.one_tone(SHARED) and not off < PERIODS_OFF / sonar.band.centre:
        return UNRESOLVED
    return wave, replace(pulse, other=other.pulse) if isinstance(other, _Aligned) else pulse, moved


class _Aligned(NamedTuple):
    """A pulse, measured with the sensors aligned on its wavefront."""

    wave: Wavefront
    pulse: Pulse
    elements: Elements  # where the sensors hear it
    longer: float  # in a window so many times as long as a snap's


def _alone(whole: _Aligned, noise: float, quiet: float) -> bool:
    """Whether a pulse is alone in a longer window; noise: what is found in the shorter, quiet as for `fit_pulse`."""
    most = AUDIBLE * whole.longer * quiet if whole.pulse.share > SHARED else ALONE * pulse_times.LONGER * noise
    return whole.pulse.noise < most


def _aligned(
    signals: Signals, elements: Elements, sonar: Sonar, wave: Wavefront, velocity: Floats, quiet: float,
    longer: float = 1.0, deaf: float = pulse_times.DEAF,
) -> _Aligned | int:  # fmt: skip
    """As `fit_pulse`, from a wavefront that sensors are aligned on, in a window at least `longer` times as long as a
    snap's. deaf: as for `pulse_times.waveform`."""
    c, q, rest = sonar.assumed_sound_speed, elements.position, elements
    aligned, expected = None, _times(wave, q, c)
    for _ in range(ROUNDS):
        if velocity.any():
            q = rest.position + (expected - wave.time)[:, None] * velocity
            elements, expected = replace(rest, position=q), _times(wave, q, c)
        aside = ASIDE * longer * pulse_times.half_length(sonar.band)
        if anew := aligned is None or np.abs(expected - aligned.time).max() > aside:
            aligned = pulse_times.align(signals, elements, sonar.band, expected, longer=longer)
        pulse = pulse_times.measure(aligned, elements, c, wave.direction, wave.curvature, wave.time, deaf)
        if anew and pulse.lasts and not (pulse.share > LOST and pulse.noise > AUDIBLE * longer * quiet):
            whole = _whole(signals, elements, sonar, wave, longer)
            if whole is None:
                return BAND
            aligned, pulse, longer = whole
        better = spherical_wave(expected + pulse.lag, q, c, pulse.weight, wave.direction, wave.curvature)
        if better is None:
            return UNFIT
        wave, last, expected = better, expected, _times(better, q, c)
        if np.abs(expected - last).max() < pulse_times.FLOOR / longer**2:  # lags err by more; the next by far less
            break
    return _Aligned(wave, pulse, elements, longer)


def _first_wave(
    signals: Signals, elements: Elements, sonar: Sonar, centre: float, half: float, quiet: float
) -> tuple[Wavefront, float, Ints | slice, Elements] | int:
    """Wavefront through the envelope peaks of the sensors, as of `fit_pulse`, the standard error (s) of its times, root
    mean square over the sensors, which sensors it is of, and those that hear it whole; or why it is refused."""
    c, (cut, start), settled = sonar.assumed_sound_speed, pulse_times.excerpt(signals, centre, half), pulse_times.FLOOR
    few = scattered(FEW, elements.count) if elements.count >= 2 * FEW else slice(None)
    heard, rate = cut[few], signals.sampling_frequency
    clear = np.vdot(heard, heard) * 2.0 * pulse_times.half_length(sonar.band) > CLEAR * quiet * rate * len(heard)
    for rows in (few, slice(None)) if clear else (slice(None),):
        q, live = elements.position[rows], elements.gain[rows] != 0
        delay, height = pulse_times.envelope_peaks(cut[rows], rate, sonar.band)
        loud = height**2 * live  # who hears more counts more
        wave = robust_wave(start + delay, q, c, loud, steps=FIRST_STEPS, rounds=ROBUST_ROUNDS, settled=settled)
        if wave is not None:
            late = np.sort(np.abs(wave.residual[live]))
            off = 0.7413 * float(late[(len(late) - 1) // 2] + late[len(late) // 2]) * (4.0 / len(late)) ** 0.5
            if len(q) == elements.count or off < 0.01 / sonar.band.centre:
                break
    else:
        return UNFIT
    whole = hearing_whole(signals, elements, _times(wave, elements.position, c), pulse_times.half_length(sonar.band))
    return CUT if whole is None else (wave, off, rows, whole)


def _excerpt(signals: Signals, some: Ints | slice, centre: float, half: float) -> Signals:
    """What some sensors hear within `half` (s) of `centre` (s)."""
    cut, start = pulse_times.excerpt(signals, centre, half)
    return replace(signals, pressure=np.ascontiguousarray(cut[some]), start=start)


def _whole(
    signals: Signals, elements: Elements, sonar: Sonar, wave: Wavefront, longer: float
) -> tuple[AlignedPulse, Pulse, float] | None:
    """A pulse that lasts beyond a window so many times as long as a snap's, in one that holds it; None where none does,
    or what that holds is another pulse."""
    c, half = sonar.assumed_sound_speed, pulse_times.half_length(sonar.band)
    while (longer := longer * pulse_times.LONGER) * half <= pulse_times.LONGER * pulse_times.LONGEST_HALF:
        aligned = pulse_times.align(signals, elements, sonar.band, _times(wave, elements.position, c), longer=longer)
        pulse = pulse_times.measure(aligned, elements, c, wave.direction, wave.curvature, wave.time)
        if pulse.aside > half:
            return None
        if not pulse.lasts:
            return aligned, pulse, longer
    return None


def _times(wave: Wavefront, position: Floats, sound_speed: float) -> Floats:
    """When (sensor,) s a wave passes sensors."""
    return wave.time + wavefront_delays(position, wave.direction, wave.curvature, sound_speed)
