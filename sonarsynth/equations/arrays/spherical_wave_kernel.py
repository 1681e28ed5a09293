"""Delays of a spherical wave over an array, and the fit of one to delays: the compiled kernel of source estimates."""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.compiling import compiled

SETTLED = 1e-6
"""A step (rad) after which Gauss-Newton stops: what is left is its square."""

RANK_TOLERANCE = 1e-6
"""Singular values of the sensor positions below this share of the largest count as zero."""


@compiled
def delays_after_centre(position: Any, direction: Any, curvature: float, sound_speed: float) -> Any:
    """As `spherical_wave.wavefront_delays`."""
    delay = np.empty(len(position))
    for q in range(len(position)):
        x, y, z = position[q]
        along, square = x * direction[0] + y * direction[1] + z * direction[2], x * x + y * y + z * z
        rho = np.sqrt(1 - 2 * curvature * along + curvature**2 * square)
        delay[q] = (curvature * square - 2 * along) / (sound_speed * (1 + rho))
    return delay


@compiled
def tangents_at(u: Any) -> Any:
    """As `spherical_wave.tangent_plane`."""
    flat = np.hypot(u[0], u[1])
    y, x = (u[1] / flat, u[0] / flat) if flat > 0 else (0.0, 1.0)
    return np.array([[-y, x, 0.0], [-u[2] * x, -u[2] * y, flat]])


@compiled
def normal_equations(
    position: Any, delay: Any, weight: Any, u: Any, curvature: float, sound_speed: float, tangents: Any
) -> Any:
    """J^T W J (4, 4), J^T W (t - tau) and J^T W tau (4,) of delays t (sensor,) about the wave's own, tau.

    Also t - tau (sensor,) and J (sensor, 4); the order of parameters, and J, are those of `spherical_wave.Wavefront`.
    """
    sensors = len(delay)
    jacobian, late = np.empty((sensors, 4)), np.empty(sensors)
    normal, right, own = np.zeros((4, 4)), np.zeros(4), np.zeros(4)
    for q in range(sensors):
        x, y, z = position[q]
        along, square = x * u[0] + y * u[1] + z * u[2], x * x + y * y + z * z
        bent = curvature * along
        rho = np.sqrt(1 - 2 * bent + curvature**2 * square)
        j = jacobian[q]
        for i in range(2):
            j[i] = -(x * tangents[i, 0] + y * tangents[i, 1] + z * tangents[i, 2]) / (sound_speed * rho)
        j[2] = (square - along * along) / (sound_speed * rho * (1 + rho - bent))
        j[3] = 1.0
        tau = (curvature * square - 2 * along) / (sound_speed * (1 + rho))
        late[q] = delay[q] - tau
        for i in range(4):
            wj = weight[q] * j[i]
            right[i] += wj * late[q]
            own[i] += wj * tau
            for k in range(i + 1):
                normal[i, k] += wj * j[k]
    for i in range(4):
        for k in range(i):
            normal[k, i] = normal[i, k]
    return normal, right, own, late, jacobian


@compiled
def inverse_of(normal: Any, curved: bool) -> Any:
    """Whether J^T W J (4, 4) has an inverse, its columns scaled, and that; not `curved`: of all but the curvature, of
    which row and column are zero."""
    inverse, used = np.zeros((4, 4)), np.array([0, 1, 2, 3] if curved else [0, 1, 3])
    scale = np.sqrt(np.diag(normal)[used])
    if not (np.isfinite(normal).all() and scale.min() > 0):
        return False, inverse
    scaled = np.empty((len(used), len(used)))
    for i, row in enumerate(used):
        for j, column in enumerate(used):
            scaled[i, j] = normal[row, column] / (scale[i] * scale[j])
    values, vectors = np.linalg.eigh(scaled)
    if not values[0] > 1e-13 * values[-1]:
        return False, inverse
    for i, row in enumerate(used):
        for j, column in enumerate(used):
            inverse[row, column] = np.sum(vectors[i] * vectors[j] / values) / (scale[i] * scale[j])
    return True, inverse


@compiled
def _farthest_turn(late: Any, weight: Any, speed: float, size: float) -> float:
    """Angle (rad) that a step may turn by: its square then moves delays by no more than they are off. A wave along the
    plane of an array has the same delays whichever side it is turned to, and no other step is so long."""
    total = np.sum(weight)
    off = late - np.sum(weight * late) / total
    return float(np.sqrt(2.0 * speed / size * np.sqrt(np.sum(weight * off**2) / total)))


@compiled
def gauss_newton(
    position: Any, delay: Any, weight: Any, start: Any, speed: float, size: float, curved: bool, iterations: int
) -> Any:
    """The fit of `spherical_wave.spherical_wave` from `start` (direction, curvature) in arrays of `size` (m): whether
    there is one, direction, curvature, time, tangents, covariance, change by the sound speed, residual."""
    u, k = start
    for _ in range(iterations):
        tangents = tangents_at(u)
        normal, right, own, late, jacobian = normal_equations(position, delay, weight, u, k, speed, tangents)
        found, covariance = inverse_of(normal, curved)
        step = covariance @ right
        step[:2] *= min(_farthest_turn(late, weight, speed, size) / max(np.hypot(step[0], step[1]), 1e-300), 1.0)
        turned = u + step[0] * tangents[0] + step[1] * tangents[1]
        bent = min(max(k + step[2], -0.5 / size), 2.0 / size)  # no source among the sensors
        moved = np.hypot(step[0], step[1]) + abs(bent - k) * size
        u, k = turned / np.sqrt(np.sum(turned * turned)), bent
        if not (found and moved >= SETTLED):
            break
    return found, u, k, step[3], tangents, covariance, covariance @ own / speed, late - jacobian @ step


@compiled
def curved_or_plane(position: Any, delay: Any, weight: Any, start: Any, speed: float, size: float, steps: int) -> Any:
    """`gauss_newton`, without the curvature where there is no fit with it; and whether there is."""
    for curved in (True, False):  # the compiler makes a second kernel for a second call
        first = start[0], (start[1] if curved else 0.0)
        wave = gauss_newton(position, delay, weight, first, speed, size, curved, steps)
        if wave[0]:
            break
    return curved, wave


@compiled
def plane_fit(position: Any, delay: Any, weight: Any, speed: float) -> Any:
    """Direction and time of the fit of `spherical_wave.plane_wave`; NaN where there is none."""
    total, nothing = np.sum(weight), (np.full(3, np.nan), np.nan)
    if not total > 0:
        return nothing
    square, slope, middle, time = np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.sum(weight * delay) / total
    for i in range(3):
        middle[i] = np.sum(weight * position[:, i]) / total
    for q in range(len(delay)):
        for i in range(3):
            about = weight[q] * (position[q, i] - middle[i])
            slope[i] += about * (delay[q] - time)
            for k in range(3):
                square[i, k] += about * (position[q, k] - middle[k])
    squares, axes = np.linalg.eigh(square)
    rank = np.sum(squares > RANK_TOLERANCE**2 * squares[2]) if squares[2] > 0 else 0
    if rank < 2:
        return nothing
    u, normal = np.zeros(3), axes[:, 0]
    for k in range(3 - rank, 3):
        u -= speed * np.sum(axes[:, k] * slope) / squares[k] * axes[:, k]
    if rank == 2:
        rest = 1.0 - np.sum(u * u)
        if rest < 0:
            return nothing
        u += np.sqrt(rest) * normal * (1.0 if normal[0] >= 0 else -1.0)
    u /= np.sqrt(np.sum(u * u))
    return u, time + np.sum(middle * u) / speed


@compiled
def robust_fit(
    position: Any, delay: Any, loud: Any, speed: float, size: float, steps: int, rounds: int, settled: float
) -> Any:
    """As `curved_or_plane`, from `plane_fit` on, by so many steps; then weights loud (sensor,) are made anew, outliers
    counting for nothing, at most so many times, until no delay moves by more than `settled` (s)."""
    weight, before, start = loud, np.full(len(delay), np.inf), (plane_fit(position, delay, loud, speed)[0], 0.0)
    for n in range(rounds + 1):
        curved, wave = curved_or_plane(position, delay, weight, start, speed, size, steps if n == 0 else 1)
        fitted = wave[3] + delays_after_centre(position, wave[1], wave[2], speed)
        if not wave[0] or n == rounds or np.abs(fitted - before).max() < settled:
            break
        late = np.abs(wave[7])
        order = np.argsort(late)
        share = np.cumsum(loud[order])
        scale = max(6.0 * late[order[np.searchsorted(share, 0.5 * share[-1])]], 1e-7)
        weight = loud * np.maximum(1.0 - (late / scale) ** 2, 0.0) ** 2
        start, before = (wave[1], wave[2]), fitted
    return curved, wave


@compiled
def climb_envelope(wave: Any, omega: Any, time: float, longest: float) -> tuple[float, float, float]:
    """By Newton's steps, no longer than `longest` (s), from `time` (s) to the top of the envelope of a pulse with
    spectrum `wave` (bin,) at `omega` (bin,) rad/s: when that is, the envelope's second derivative there, and the rate
    (rad/s) at which the phase turns. It stops where the envelope is not hollow downwards."""
    curve = carrier = 0.0
    for _ in range(8):
        z = slope = bend = 0j
        for k in range(len(omega)):
            turned = wave[k] * complex(np.cos(omega[k] * time), np.sin(omega[k] * time))
            z, slope, bend = z + turned, slope + 1j * omega[k] * turned, bend - omega[k] ** 2 * turned
        height, carrier = abs(z), (slope / z).imag
        curve = (bend * np.conj(z)).real / height + carrier**2 * height
        if not curve < 0:
            break
        step = min(max(-(slope * np.conj(z)).real / height / curve, -longest), longest)
        time += step
        if abs(step) < 1e-15:
            break
    return time, curve, carrier
