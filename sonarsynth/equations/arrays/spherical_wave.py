"""Direction and distance of a source from the delays of its pulse over an array, and the bounds on their errors.

A wavefront is described by the unit vector u towards its source, its curvature k = 1/R and the time t0 at which it
passes the array centre; the plane wave is k = 0, no special case. Sensors at q (sonar frame) hear it at
    t0 + (R |u - k q| - R)/c = t0 + (k |q|^2 - 2 u.q)/(c (1 + |u - k q|)).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Complexes, Floats


@dataclass(frozen=True, eq=False)
class Wavefront:
    """A spherical wave over an array; parameters are (along tangent 0, along tangent 1, curvature, time)."""

    direction: Floats  # (xyz) unit vector towards the source
    curvature: float  # 1/m
    time: float  # s at the array centre
    tangents: Floats  # (2, xyz) unit vectors square to the direction and to each other
    covariance: Floats  # (4, 4) of the parameters, for independent errors of one second at each sensor of weight one
    by_sound_speed: Floats  # (4,) change of the fitted parameters per m/s of the assumed sound speed
    residual: Floats  # (sensor,) s


def wavefront_delays(position: npt.ArrayLike, direction: npt.ArrayLike, curvature: float, sound_speed: float) -> Floats:
    """Delays (sensor,) in s after the array centre of a wave from `direction` at sensors `position` (sensor, xyz)."""
    from sonarsynth.equations.arrays.spherical_wave_kernel import delays_after_centre

    q, u = np.asarray(position, float), np.asarray(direction, float)
    return np.asarray(delays_after_centre(q, u, float(curvature), float(sound_speed)))


def tangent_plane(direction: npt.ArrayLike) -> Floats:
    """Unit vectors (2, xyz) square to a direction: of increasing azimuth and elevation (y first at a pole)."""
    from sonarsynth.equations.arrays.spherical_wave_kernel import tangents_at

    return np.asarray(tangents_at(np.asarray(direction, float)))


def plane_wavefront(direction: Floats, time: float) -> Wavefront:
    """A plane wave as a `Wavefront` whose errors are not known."""
    unknown = np.full((4, 4), np.nan)
    return Wavefront(direction, 0.0, time, tangent_plane(direction), unknown, unknown[0], np.zeros(0))


def plane_wave(
    delay: npt.ArrayLike, position: npt.ArrayLike, sound_speed: float, weight: npt.ArrayLike | None = None
) -> tuple[Floats, float]:
    """Direction (xyz) and time (s) of the plane wave that fits delays (sensor,) best: the thesis's eq. 6, corrected.

    Minimises the sum of SQUARES of tau_i - t0 + u.q_i/c, with the intercept t0 among the unknowns; closed form, no
    search. (As printed, without the square, the sum does not depend on the angles for a symmetric array.) A planar
    array gives the two components in its plane; the third follows from |u| = 1 with the sign that faces +x, since
    such an array cannot tell front from back. NaN where the sensors (those of positive weight) lie on one line or in
    one point, or where the components in the plane exceed 1 (no plane wave is that slow).
    """
    from sonarsynth.equations.arrays.spherical_wave_kernel import plane_fit

    t, q = np.asarray(delay, float), np.asarray(position, float)
    w = np.ones(len(t)) if weight is None else np.asarray(weight, float)
    direction, time = plane_fit(q, t, w, float(sound_speed))
    return direction, float(time)


def spherical_wave(
    delay: npt.ArrayLike,
    position: npt.ArrayLike,
    sound_speed: float,
    weight: npt.ArrayLike,
    start: npt.ArrayLike,
    curvature: float = 0.0,
    iterations: int = 20,
) -> Wavefront | None:
    """The spherical wave that fits delays (sensor,) best, by Gauss-Newton from direction `start`; None where none does.

    weight (sensor,) >= 0: inverse variances, up to a common factor. Where there are too few sensors for a sphere (three
    cannot tell it), a plane, the variance of its curvature infinite. Derivatives, with rho = |u - k q|:
        d/du along a tangent e: -(q.e)/(c rho);  d/dk: (|q|^2 - (u.q)^2)/(c rho (rho + 1 - k u.q)).
    Fisher matrix and bound follow: `covariance` times the variance of a delay of weight one is the Cramer-Rao bound
    (physics: independent Gaussian errors; Van Trees 2002, section 8.4).
    """
    t, q, w, u = (np.asarray(a, float) for a in (delay, position, weight, start))
    size = _size(q)
    if not (np.all(np.isfinite(u)) and size > 0):
        return None
    from sonarsynth.equations.arrays.spherical_wave_kernel import curved_or_plane

    curved, wave = curved_or_plane(q, t, w, (u, float(curvature)), float(sound_speed), size, iterations)
    return _wavefront(wave, curved)


def robust_wave(
    delay: Floats, position: Floats, sound_speed: float, weight: Floats, *, steps: int, rounds: int, settled: float
) -> Wavefront | None:
    """The spherical wave that fits delays (sensor,) best of which some may be wrong; a plane where there are too few
    for a sphere, None where none fits.

    Begins with `plane_wave` and so many steps of `spherical_wave`; then weights are those given times Tukey's biweight
    of the residuals over six times their median, anew after each step, until no delay moves by `settled` (s) or for so
    many rounds.
    """
    from sonarsynth.equations.arrays.spherical_wave_kernel import robust_fit

    curved, wave = robust_fit(position, delay, weight, sound_speed, _size(position), steps, rounds, settled)
    return _wavefront(wave, curved)


def _size(position: Floats) -> float:
    """Distance (m) of the sensor (sensor, xyz) that is farthest out."""
    return float(np.sqrt(np.einsum("qi,qi->q", position, position).max(initial=0.0)))


def _wavefront(fit: tuple[Any, ...], curved: bool) -> Wavefront | None:
    """What a kernel fitted, if it found a fit; not `curved`: nothing is known of the curvature."""
    found, *wave = fit
    if not found:
        return None
    if not curved:
        wave[4][2, 2] = np.inf
    return Wavefront(*wave)


def parabola(left: npt.ArrayLike, middle: npt.ArrayLike, right: npt.ArrayLike) -> tuple[Floats, Floats]:
    """Place (in samples from the middle, within +-0.5) and height of the vertex through three equidistant values."""
    a, b, c = (np.asarray(v, float) for v in (left, middle, right))
    bend = a - 2 * b + c
    safe = np.where(bend < 0, bend, -1.0)
    offset = np.where(bend < 0, np.clip(0.5 * (a - c) / safe, -0.5, 0.5), 0.0)
    return np.asarray(offset), np.asarray(b - 0.25 * (a - c) * offset)


def envelope_peak(
    frequency: npt.ArrayLike, spectrum: npt.ArrayLike, low: float, high: float, noise: npt.ArrayLike = 0.0
) -> tuple[float, float]:
    """Time (s) at which the envelope of a pulse in a band is largest, and its standard error (s); NaN without one.

    frequency (bin,) in Hz, evenly spaced; spectrum (bin,) and noise, the mean power of noise in each bin, in the same
    unit, squared. The band (low to high, Hz) is tapered by sin^2, so that bins at its edges do not count. With
    a = |z| the envelope of z = sum g S exp(i w t) and w0 = Im(z'/z), the noise of its slope is that of
    sum (w - w0) g n / sqrt 2, and the peak moves by that over a'' = Re(z'' conj z)/a + w0^2 a.
    """
    f, nothing = np.asarray(frequency, float), (float("nan"), float("nan"))
    taper = np.sin(np.pi * np.clip((f - low) / (high - low), 0.0, 1.0)) ** 2
    wave = taper * np.asarray(spectrum, complex)
    if len(f) < 3 or not wave.any():
        return nothing
    count, spacing, omega = 16 * len(f), f[1] - f[0], 2 * np.pi * f
    top = int(np.abs(np.fft.ifft(wave, count)).argmax())
    time = float((top if top < count / 2 else top - count) / (count * spacing))
    from sonarsynth.equations.arrays.spherical_wave_kernel import climb_envelope

    time, curve, carrier = climb_envelope(wave, omega, time, 0.5 / (count * spacing))
    if not curve < 0:
        return nothing
    return time, float(np.sqrt(0.5 * np.sum(((omega - carrier) * taper) ** 2 * noise)) / abs(curve))


def envelope_spread(frequency: Floats, spectrum: Complexes, low: float, high: float) -> float:
    """How far (s) the envelope of a pulse reaches from where it is largest, root mean square by its sixth power.

    Of two pulses as loud that is 0.7 of what is between them; of a pulse and its image of strength s somewhat less than
    s^2 of that, which moves the mean of their powers. frequency (bin,) Hz, spectrum (bin,), band as `envelope_peak`;
    NaN of fewer than three.
    """
    if len(frequency) < 3:
        return float("nan")
    taper = np.sin(np.pi * np.clip((frequency - low) / (high - low), 0.0, 1.0)) ** 2
    envelope = np.abs(np.fft.ifft(taper * spectrum, 8 * len(frequency)))
    since = np.fft.fftfreq(len(envelope)) / (frequency[1] - frequency[0])
    weight = (envelope / max(float(envelope.max()), 1e-300)) ** 6
    return float(np.sqrt(weight @ (since - since[envelope.argmax()]) ** 2 / max(float(weight.sum()), 1e-300)))
