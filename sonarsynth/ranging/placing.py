"""From a wavefront and the depth of the bed to a place, with the errors to expect."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.fft import next_fast_len

from sonarsynth.acoustics.bearings import Wavefront, rms_bandwidth
from sonarsynth.conventions import Floats, azimuth_elevation
from sonarsynth.geometry import Pose
from sonarsynth.products import Bearings
from sonarsynth.ranging import pulses
from sonarsynth.ranging.pulses import Pulse
from sonarsynth.sonar import Elements, Sonar
from sonarsynth.world.environment import Profile

FLOOR = 1e-9
"""Standard error (s) of a lag without any noise: what cutting the pulse's tail off does. Biases of 0.01 to 0.2 ns of
curvature at the rim have been seen, which is what independent errors six times as large would leave."""


@dataclass(frozen=True, eq=False)
class Row:
    """One snap of `Bearings`."""

    time: float
    time_error: float
    direction: Floats  # (xyz) of the arriving wave
    angle_error: Floats  # (2,) rad of azimuth, elevation
    range_from_depth: tuple[float, float]  # value, error
    range_from_curvature: tuple[float, float]
    position: Floats
    covariance: Floats
    residual: float


@dataclass(frozen=True, eq=False)
class Known:
    """What the sonar knows besides what it hears."""

    elements: Elements
    sonar: Sonar
    pose: Pose
    bed_depth: float  # m
    gradient: float  # 1/s: size of the gradient of sound speed that rays taken for straight may have met; 0 for none
    rounding: float  # (Pa s)^2: power in a bin of what the converter and single precision round off


def mean_gradient(profile: Profile, depth: float, other: float, least: float) -> float:
    """Mean of |dc/dz| (1/s) between two depths (m), over no less than `least` (m) about them; jumps count."""
    middle, half = 0.5 * (depth + other), 0.5 * max(abs(depth - other), least)
    between = np.abs(profile.depth - middle) < half
    speed = [profile.at(middle - half), *profile.speed[between], profile.at(middle + half)]
    return float(np.sum(np.abs(np.diff(speed)))) / (2 * half)


def _variance(wave: Wavefront, pulse: Pulse, rounding: float) -> float:
    """Variance of a lag of weight one: the larger of what the lags show and of the Cramer-Rao bound for the noise seen.

    The noise is not taken below that of rounding, nor lags below `FLOOR`.
    """
    count = int(np.sum(pulse.weight > 0))
    least = FLOOR**2 * float(np.sum(pulse.weight)) / max(count, 1)
    shown = float(pulse.weight @ wave.residual**2) / max(count - 4, 1)
    return float(np.max([shown, least, 0.5 * pulse.noise, 0.5 * rounding]))


def bending_covariance(
    by_angle: Floats, slope: float, distance: float, gradient: float, sound_speed: float, aperture: float
) -> Floats:
    """Covariance (4, 4) of a wavefront's parameters where rays are taken for straight in a gradient (1/s).

    A ray of grazing angle a is an arc of curvature g cos a/c: over a distance r it arrives r g cos a/(2c) beside its
    chord, in the vertical plane. Where the gradient is that of a layer on the way, rays spread there by more or less,
    and the curvature of the wavefront over the array is off by up to g cos^2 a/(c sin a), half of it on the mean; where
    it is the same all the way, by g sin a/(2c): together g/(2c sin a), and never more than that of a source in the
    array (1/aperture). slope is sin a; by_angle (2,) its derivatives along the tangents, of size cos a.
    """
    half = 0.5 * gradient / sound_speed
    covariance = np.zeros((4, 4))
    covariance[:2, :2] = np.outer(by_angle, by_angle) * (half * distance) ** 2
    covariance[2, 2] = (half / max(abs(slope), half * aperture)) ** 2
    return covariance


def place(wave: Wavefront, pulse: Pulse, known: Known, arrival: Floats | None = None) -> Row:
    """Ranges and position from a wavefront and the depth of the bed; errors through the Jacobians.

    arrival: the direction (xyz) of the arriving wave, where `wave` is the straight one that is left without bending.
    """
    elements, sonar, pose = known.elements, known.sonar, known.pose
    timing = _variance(wave, pulse, known.rounding) * wave.covariance
    full = timing + np.outer(wave.by_sound_speed, wave.by_sound_speed) * sonar.sound_speed_error**2
    if not np.isfinite(full[2, 2]):  # too few sensors to tell the curvature: anything outside the array
        full[2, 2] = 1 / elements.aperture**2
    u, t, k = wave.direction, wave.tangents, wave.curvature
    up = pose.rotation[2]
    fall = -known.bed_depth - pose.position[2]  # the snap stands this much above the sonar (negative: below it)
    slope = float(up @ u)
    by_angle = t @ up
    fused = _fuse(wave, full, fall, slope, by_angle, sonar.bed_depth_error)
    straight = full
    for _ in range(2 * (known.gradient > 0)):  # what bending does depends on the distance, and that a little on bending
        distance = float(np.linalg.norm(fused[0]))
        full = straight + bending_covariance(
            by_angle, slope, distance, known.gradient, sonar.assumed_sound_speed, elements.aperture
        )
        fused = _fuse(wave, full, fall, slope, by_angle, sonar.bed_depth_error)
    spread = full[:2, :2]
    with np.errstate(divide="ignore", invalid="ignore"):
        from_depth = fall / slope if slope * fall > 0 else np.nan
        depth_error = np.hypot(from_depth * np.sqrt(by_angle @ spread @ by_angle), sonar.bed_depth_error) / abs(slope)
        from_curvature = 1 / k if k > 0 else np.nan
        curvature_error = np.sqrt(full[2, 2]) * from_curvature**2
    offset, width = _envelope_time(pulse)
    seen = u if arrival is None else arrival
    around = spread[0, 0] / max(1 - u[2] ** 2, 1e-300)
    return Row(
        time=pulse.time + offset,
        time_error=float(np.hypot(np.sqrt(timing[3, 3]), width)),
        direction=seen,
        angle_error=np.sqrt([around, spread[1, 1]]),
        range_from_depth=(from_depth, depth_error),
        range_from_curvature=(from_curvature, curvature_error),
        position=fused[0],
        covariance=fused[1],
        residual=float(np.sqrt(pulse.weight @ wave.residual**2 / pulse.weight.sum())),
    )


def _fuse(
    wave: Wavefront, covariance: Floats, fall: float, slope: float, by_angle: Floats, depth_error: float
) -> tuple[Floats, Floats]:
    """Position and covariance from the wavefront and from the depth: slope - k fall = 0 within |k| depth_error.

    slope is the sine of the bearing's elevation in the world, by_angle (2,) its derivatives along the tangents, fall
    (m) the height of the snap above the sonar. In (tangents, curvature) the condition is linear and the far field is
    no special case. Where depth and curvature disagree by more than their errors the covariance is scaled up by the
    disagreement (Birge's ratio).
    """
    u, k, p = wave.direction, wave.curvature, covariance[:3, :3]
    step = np.zeros(3)
    if slope * fall > 0:
        row = np.array([*by_angle, -fall])
        innovation = k * fall - slope
        noise = (max(abs(k), slope / fall) * depth_error) ** 2  # near the horizontal the depth says nothing of k
        variance = float(row @ p @ row) + noise
        gain = p @ row / variance
        step = gain * innovation
        keep = np.eye(3) - np.outer(gain, row)  # Joseph's form: no variance can come out negative
        p = (keep @ p @ keep.T + np.outer(gain, gain) * noise) * max(1.0, innovation**2 / variance)
    k = k + step[2]
    if not k > 0:
        return np.full(3, np.nan), np.full((3, 3), np.nan)
    u = u + step[:2] @ wave.tangents
    u = u / np.linalg.norm(u)
    jacobian = np.stack([wave.tangents[0] / k, wave.tangents[1] / k, -u / k**2], axis=1)
    return u / k, jacobian @ p @ jacobian.T


def _envelope_time(pulse: Pulse) -> tuple[float, float]:
    """Where the pulse's envelope peaks, s after the template's time 0, and the pulse's own width 1/(2 pi beta) (s)."""
    f, w = pulse.frequency, pulse.template
    spacing = f[1] - f[0] if len(f) > 1 else 0.5 / pulses.PULSE_HALF
    count = next_fast_len(16 * len(f))
    envelope = np.abs(np.fft.ifft(w, count))
    top = int(envelope.argmax())
    place, _ = pulses.parabola(envelope[top - 1], envelope[top], envelope[(top + 1) % count])
    index = (top + float(place) + count / 2) % count - count / 2
    beta = rms_bandwidth(f, w, centred=True)
    return index / (count * spacing), 1 / (2 * np.pi * beta) if beta > 0 else 1 / spacing


def as_bearings(rows: list[Row], snaps: int) -> Bearings:
    """Rows as `Bearings` of `snaps` rows, NaN beyond those there are."""

    def column(get: Callable[[Row], object], *shape: int) -> Floats:
        values = np.full((snaps, *shape), np.nan)
        for i, row in enumerate(rows):
            values[i] = get(row)
        return values

    return Bearings(
        time=column(lambda r: r.time),
        time_error=column(lambda r: r.time_error),
        azimuth=column(lambda r: azimuth_elevation(r.direction)[0]),
        azimuth_error=column(lambda r: r.angle_error[0]),
        elevation=column(lambda r: azimuth_elevation(r.direction)[1]),
        elevation_error=column(lambda r: r.angle_error[1]),
        range_from_depth=column(lambda r: r.range_from_depth[0]),
        range_from_depth_error=column(lambda r: r.range_from_depth[1]),
        range_from_curvature=column(lambda r: r.range_from_curvature[0]),
        range_from_curvature_error=column(lambda r: r.range_from_curvature[1]),
        position=column(lambda r: r.position, 3),
        position_covariance=column(lambda r: r.covariance, 3, 3),
        residual=column(lambda r: r.residual),
    )
