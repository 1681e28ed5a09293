"""The place of a source, with predicted errors, from its wavefront and, where it agrees, the depth of the bottom."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.arrays.spherical_wave import Wavefront, envelope_peak, envelope_spread
from sonarsynth.equations.arrays.wavefront_errors import (
    bending_covariance,
    bias_covariance,
    image_covariance,
    source_place,
)
from sonarsynth.geometry import Pose
from sonarsynth.products import REASONS
from sonarsynth.ranging.location.pulse_times import Pulse, half_length, lag_variance
from sonarsynth.receiver import Elements, Sonar

AGREES = 9.0
"""The bottom is used where innovation squared over variance is no more: three standard errors, since a source that
stands off the bottom by less than the wavefront can tell is pulled there."""
FARTHEST = 0.2
"""Standard error of the range, in ranges, above which the range is unknown: errors of such a place are no ellipsoid."""
STEPS = 5
"""Linear steps to where wavefront and bottom meet, at most."""
SETTLED = 0.01
"""A step, in standard errors, after which no other is taken."""

KINKED = 3 / 16
"""A sphere fitted to a wavefront through a kink at the middle of an array of radius a, where the gradient of the sound
speed changes by dg, is tilted by 3 dg a/(16 c): least squares of z|z| by z over -a..a."""

REFLECTED = 0.5
"""Wavelengths at the band centre, up or down, by which a source on the bottom is heard elsewhere for its reflection:
over a fluid sediment the phase turns by up to 8 rad per rad of grazing angle (Brekhovskikh and Lysanov 2003, section
3.1), and half of that is left in the sum with the direct pulse."""
PHASE_SLOPE = 8.0
"""rad/rad: that phase. Over angles of standard deviation s from the array it bends the wavefront by slope^2 s^2/2 rad,
which moves the time: by 0.1 to 3 times that below the critical angle (sand to rock, 7 to 14 m), by less above."""
LEFT = 0.05
"""Of what a longer window changes of a time, what it leaves: 0.001 to 0.1 were seen, 0.05 root mean square."""
LEFT_OF_IMAGE = 0.3
"""The same where the longer window holds a reflection that the other does not: 0.05 to 0.7."""
ACCEPTED, SILENT, ARRAY, BAND, UNFIT, UNRESOLVED, OUTSIDE, ECHO, RANGE, CUT = range(len(REASONS))


@dataclass(frozen=True, eq=False)
class SourceFix:
    """One snap of `SourceEstimates`."""

    time: float
    time_error: float
    direction: Floats  # (xyz) of the arriving wave
    angle_error: Floats  # (2,) rad of azimuth, elevation
    range_from_depth: tuple[float, float]  # value, error
    range_from_curvature: tuple[float, float]
    position: Floats
    covariance: Floats
    by_speed: Floats  # (xyz) s: dS/dc, c the assumed sound speed
    residual: float
    bottom_used: int
    reason: int
    curvature: tuple[float, float]  # 1/m: value, error; of the straight wave over the array
    chord: Floats  # (xyz) unit vector towards the source, where the wavefront alone puts it
    amplitude: float  # Pa: of the pulse at the array centre, peak of the envelope, the face's response removed
    suspect: SourceFix | None = None  # what a pulse that may be an echo is, were it a snap


@dataclass(frozen=True, eq=False)
class SonarKnowledge:
    """What the sonar knows besides what it hears."""

    elements: Elements
    sonar: Sonar
    pose: Pose
    bottom_depth: float  # m
    gradient: float  # 1/s: size of the gradient of sound speed that rays of unknown bending may have met; 0 for none
    rounding: float  # (Pa s)^2: power in a bin of what the converter and single precision round off
    quiet: float  # (Pa s)^2: power in a bin of the noise at a sensor
    on_bottom: bool = True  # whether sources may be taken to be on the bottom, where the wavefront agrees
    kink: float = 0.0  # 1/s: change of the gradient of the sound speed over the array
    reflected: bool = False  # whether sources are heard with their reflections at surface and bottom
    velocity: Floats = field(default_factory=lambda: np.zeros((1, 3)))  # (sensor, xyz) m/s, sonar frame


@dataclass(frozen=True, eq=False)
class Bend:
    """How rays bend: what they add to the delays of straight paths at some speed (m/s)."""

    delays: Callable[[Floats, float], Floats]  # of a source (xyz), sonar frame, and that speed: (sensor,) s
    sound_speed: float  # m/s of the water at the array
    undone: bool  # or only in the predicted errors


@dataclass(frozen=True, eq=False)
class Fix:
    """Direction and curvature of a source with their errors, in the tangents of the wavefront."""

    direction: Floats  # (xyz)
    curvature: float
    covariance: Floats  # (3, 3) of (along tangents, curvature)
    by_speed: Floats  # (3,) change of these per m/s of the assumed sound speed
    used: bool  # whether the bottom was


def place(
    wave: Wavefront,
    pulse: Pulse,
    knowledge: SonarKnowledge,
    bent: Wavefront | None = None,
    unbent: Wavefront | None = None,
) -> SourceFix:
    """Ranges and position from a wavefront, and the depth of the bottom where it agrees; errors through the Jacobians.

    bent: the wave as the array hears it, where `wave` is the straight one that is left without bending. The direction
    is always that of the wave as heard. unbent: the straight one, where `wave` is as heard, which is off by the rest.
    """
    elements, sonar, pose = knowledge.elements, knowledge.sonar, knowledge.pose
    bent = bent or wave
    variance = lag_variance(unbent or wave, pulse, elements, knowledge.rounding, half_length(sonar.band))
    timing = variance * wave.covariance
    fall = -knowledge.bottom_depth - pose.position[2]  # the bottom is this much above the sonar (negative: below it)
    slope, by_angle = float(pose.rotation[2] @ wave.direction), wave.tangents @ pose.rotation[2]
    from_depth = fall / slope if slope * fall > 0 else np.nan
    full = _straight_covariance(wave, timing, by_angle / from_depth, pulse, knowledge)
    tilt = by_angle * (KINKED * knowledge.kink * elements.aperture / sonar.assumed_sound_speed)
    spread = full[:2, :2] + np.outer(tilt, tilt)
    from_pole = float(np.hypot(*bent.direction[:2]))  # its azimuth is anybody's guess where it may be beyond
    beyond = 0.5 * math.erfc(from_pole / max(np.sqrt(2.0 * spread[1, 1]), 1e-300))
    around = min(spread[0, 0] / max(from_pole**2, 1e-300) + np.pi**2 * beyond, np.pi**2)
    full, fix = _bent(wave, full, from_depth, fall, knowledge, unbent)
    with np.errstate(divide="ignore", invalid="ignore"):
        depth_error = np.hypot(from_depth * np.sqrt(by_angle @ full[:2, :2] @ by_angle), sonar.bed_depth_error)
        from_curvature = 1 / wave.curvature if wave.curvature > 0 else np.nan
        curvature_error = np.sqrt(full[2, 2]) * from_curvature**2
    reason = RANGE if not np.sqrt(fix.covariance[2, 2]) <= FARTHEST * fix.curvature else ACCEPTED
    reason = reason if _in_water(wave, full, slope, by_angle, fall, knowledge) else OUTSIDE
    time, time_error = _arrival(pulse, float(full[3, 3]), sonar, knowledge.rounding)
    reason = reason if np.isfinite(time) else BAND
    known = fix.curvature if reason == ACCEPTED and fix.curvature > 0 else np.nan
    position, covariance, by_speed = source_place(fix.direction, known, wave.tangents, fix.covariance, fix.by_speed)
    return SourceFix(
        time=time,
        time_error=time_error,
        direction=bent.direction,
        angle_error=np.sqrt([around, spread[1, 1]]),
        range_from_depth=(from_depth, float(depth_error) / abs(slope) if np.isfinite(from_depth) else np.nan),
        range_from_curvature=(from_curvature, curvature_error),
        position=position,
        covariance=covariance,
        by_speed=by_speed,
        residual=float(np.sqrt(pulse.weight @ wave.residual**2 / pulse.weight.sum())),
        bottom_used=int(fix.used) if reason == ACCEPTED else -1,
        reason=reason,
        curvature=(wave.curvature, float(np.sqrt(full[2, 2]))),
        chord=wave.direction,
        amplitude=float(np.linalg.norm(pulse.by_window[0].template)),  # all by windows as long
    )


def _straight_covariance(
    wave: Wavefront, timing: Floats, by_height: Floats, pulse: Pulse, knowledge: SonarKnowledge
) -> Floats:
    """Covariance (4, 4) of a wavefront's parameters along straight rays, from that of its delays.

    by_height (2,): change of its tangents with the height of a source on the bottom, 1/m; NaN where that is not seen.
    """
    sonar, up, own = knowledge.sonar, knowledge.pose.rotation[2], float(knowledge.pose.position[2])
    full = timing + np.outer(wave.by_sound_speed, wave.by_sound_speed) * sonar.sound_speed_error**2
    if not np.isfinite(full[2, 2]):  # too few sensors to tell the curvature: anything outside the array
        full[2, 2] = 1 / knowledge.elements.aperture**2
    if knowledge.on_bottom and knowledge.reflected and np.isfinite(by_height).all():
        moved = by_height * (REFLECTED * sonar.assumed_sound_speed / sonar.band.centre)
        full[:2, :2] += np.outer(moved, moved)
        height = knowledge.elements.position[knowledge.elements.gain != 0] @ up
        bent = 0.5 * (PHASE_SLOPE * float(np.std(height)) * float(np.linalg.norm(by_height))) ** 2
        full[3, 3] += (bent / (2.0 * np.pi * sonar.band.centre)) ** 2
    elif knowledge.reflected and not knowledge.on_bottom:
        depth, seen = knowledge.bottom_depth, (wave.tangents @ up, up @ wave.direction, wave.curvature, full)
        both = pulse, pulse.by_window[1]
        spread = [envelope_spread(p.frequency, p.template, sonar.band.low, sonar.band.high) for p in both]
        short, time = (_peak(p, sonar, knowledge.rounding)[0] for p in pulse.by_window)
        windows = pulse.window, both[1].window, LEFT_OF_IMAGE * abs(float(np.nan_to_num(time - short)))
        for height in (-own, -depth - own):
            full = full + image_covariance(*seen, height, sonar.assumed_sound_speed, spread, windows, deepest=depth)
    return full


def _bent(
    wave: Wavefront, straight: Floats, from_depth: float, fall: float, knowledge: SonarKnowledge,
    unbent: Wavefront | None,
) -> tuple[Floats, Fix]:  # fmt: skip
    """The covariance (4, 4) of a wavefront along straight rays with what bending adds to it, and the fix by that."""
    if unbent is not None:
        full = straight + bias_covariance(wave, unbent)
        return full, _fuse(wave, full, fall, knowledge)
    full, fix, up = straight, _fuse(wave, straight, fall, knowledge), knowledge.pose.rotation[2]
    c, aperture = knowledge.sonar.assumed_sound_speed, knowledge.elements.aperture
    for _ in range(2 * (knowledge.gradient > 0)):  # bending depends on the distance, and that a little on bending
        likely = [1 / fix.curvature if fix.curvature > 0 else np.nan, from_depth, aperture]
        distance, slope = next(d for d in likely if np.isfinite(d)), float(up @ wave.direction)
        full = straight + bending_covariance(wave.tangents @ up, slope, distance, knowledge.gradient, c, aperture)
        fix = _fuse(wave, full, fall, knowledge)
    return full, fix


def _fuse(wave: Wavefront, covariance: Floats, fall: float, knowledge: SonarKnowledge) -> Fix:
    """The wavefront, and where it agrees the depth: slope - k fall = 0 within |k| times the error of the depth.

    slope is the sine of the bearing's elevation in the world, fall (m) the height of the bottom above the sonar. In
    (tangents, curvature) the far field is no special case, and the condition is nearly linear: it is made linear anew
    where each step has led (Gauss and Newton), and not used where that does not settle.
    """
    u, k, p, up = wave.direction, wave.curvature, covariance[:3, :3], knowledge.pose.rotation[2]
    alone = Fix(u, k, p, wave.by_sound_speed[:3], False)
    slope, by_angle = float(up @ u), wave.tangents @ up
    if not (knowledge.on_bottom and slope * fall > 0):
        return alone
    # near the horizontal the depth says nothing of k
    noise = (max(abs(k), slope / fall) * knowledge.sonar.bed_depth_error) ** 2
    row = np.array([*by_angle, -fall])
    variance = float(row @ p @ row) + noise
    if not (k * fall - slope) ** 2 <= AGREES * variance:
        return alone
    step, scale = np.zeros(3), np.sqrt(np.maximum(np.diag(p), 1e-300))
    for _ in range(STEPS):
        u = _turned(wave, step)
        row = np.array([*(wave.tangents @ up) / np.linalg.norm(wave.direction + step[:2] @ wave.tangents), -fall])
        missed = (k + step[2]) * fall - float(up @ u)
        gain = p @ row / (float(row @ p @ row) + noise)
        last, step = step, gain * (missed + row @ step)
        if np.max(np.abs(step - last) / scale) < SETTLED:
            break
    else:
        return alone
    keep = np.eye(3) - np.outer(gain, row)  # Joseph's form: no variance can come out negative
    fused = keep @ p @ keep.T + np.outer(gain, gain) * noise
    return Fix(_turned(wave, step), k + float(step[2]), fused, keep @ alone.by_speed, True)


def _turned(wave: Wavefront, step: Floats) -> Floats:
    u = wave.direction + step[:2] @ wave.tangents
    return np.asarray(u / np.linalg.norm(u))


def _in_water(
    wave: Wavefront, covariance: Floats, slope: float, by_angle: Floats, fall: float, knowledge: SonarKnowledge
) -> bool:
    """Whether the wavefront alone can come from between surface and bottom, within three standard errors.

    The images of a snap in surface and bottom lie beyond them. Asked of the curvature: the source may be anywhere on
    the bearing this side of the boundary, k room >= slope. An array under the bottom (a shelf overhead) knows none.
    """
    k, p = wave.curvature, covariance[:3, :3]
    room = fall if slope < 0 else -float(knowledge.pose.position[2])
    if fall > 0 or slope * room <= 0:
        return True
    row = np.array([*by_angle, -room])
    slack = (max(abs(k), slope / room) * knowledge.sonar.bed_depth_error) ** 2 if slope < 0 else 0.0
    beyond = (slope - k * room) * np.sign(room)
    return bool(beyond <= 3 * np.sqrt(float(row @ p @ row) + slack))


def _arrival(pulse: Pulse, fitted: float, sonar: Sonar, rounding: float) -> tuple[float, float]:
    """When (s) the pulse's envelope peaks at the array centre, and the standard error of that time (s).

    The error is that of `_peak` and that of the wavefront's time, of variance `fitted` (s2), which pulses do not show.
    """
    short, longer = pulse.by_window
    time, error = _peak(longer, sonar, rounding)
    if longer is not short:
        error = float(np.hypot(error, LEFT * np.nan_to_num(time - _peak(short, sonar, rounding)[0])))
    return time, float(np.hypot(error, np.sqrt(fitted)))


def _peak(pulse: Pulse, sonar: Sonar, rounding: float) -> tuple[float, float]:
    """When (s) the envelope of the mean pulse peaks, and the standard error of that (s) in all that the model does not
    explain: what is in phase with it changes its shape."""
    undamped = np.minimum(1 + pulse.deaf * len(pulse.lag) / np.maximum(pulse.power, 1e-300), 2.0)  # of `waveform`
    noise = max(pulse.noise, pulse.rest, rounding) / np.maximum(pulse.power, 1e-300)
    low, high = sonar.band.low, sonar.band.high
    time, error = envelope_peak(pulse.frequency, pulse.template * undamped, low, high, noise)
    return pulse.time + time, error


def refused(reason: int) -> SourceFix:
    """A row of which nothing is known but why."""
    none, pair = np.full(3, np.nan), (np.nan, np.nan)
    return SourceFix(
        np.nan, np.nan, none, none[:2], pair, pair, none, np.full((3, 3), np.nan), none,
        np.nan, -1, reason, pair, none, np.nan,
    )  # fmt: skip
