"""Sums of paths over a band, compiled: with phases where they count, and means of power where they do not.

Frequencies (bin,) in Hz are equally spaced; weights (snap, bin) sum to 1 or are in any unit that the caller divides by.
"""

from __future__ import annotations

import math

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.equations.scattering.kirchhoff_kernels import divided, series

WIDEST = 6.0  # rad: facets whose corners are closer together in phase go by the series
ROOM = 16
TOLERANCE = 1e-10
SMALL = 0.1  # Np: decays as small as this go by the series of the exponential, good to 4e-6 of what is lost

PARTS = 4
"""Sums of each group: of the paths, and of the paths times each component of their direction."""


@compiled
def coherent_sums(
    group: Ints,
    snap: Ints,
    amplitude: Floats,
    phase: Floats,
    delay: Floats,
    corners: Floats,
    loss: Floats,
    variance: Floats,
    direction: Floats,
    frequency: Floats,
    relative: Floats,
    weight: Floats,
    groups: int,
) -> tuple[Floats, Floats, Floats]:
    """Real and imaginary parts (group, PARTS, bin) of the sums of paths, and the mean power (path,) of their facets.

    A path gives amplitude exp(i phase - i 2 pi f delay) 10^(-relative loss/20) exp(-variance (2 pi f)^2/2) times the
    mean over its facet of exp(-i 2 pi f t), corners (path, 3) s (`facet_pulses.facet_mean`; error 1e-9). loss (path,)
    dB is what it takes where relative (bin,) is 1; variance (path,) s2. What all share may be left out of loss,
    variance and delay. group, snap (path,): which group it adds to, and the row of weight (snap, bin) that its mean
    power sum_f weight |mean|^2 takes.
    """
    bins = frequency.size
    real, imaginary = np.zeros((groups, PARTS, bins)), np.zeros((groups, PARTS, bins))
    power = np.zeros(amplitude.size)
    x, y, room = np.empty(bins), np.empty(bins), np.empty((4, max(bins, ROOM)))
    omega = 2.0 * math.pi * frequency
    square, largest = omega * omega, np.abs(relative).max()
    for e in range(amplitude.size):
        _facet_mean(x, y, corners[e], omega, square, room)
        for k in range(bins):
            power[e] += weight[snap[e], k] * (x[k] * x[k] + y[k] * y[k])
        _turn(x, y, phase[e], delay[e], omega, room)
        _fade(x, y, amplitude[e], math.log(10.0) / 20.0 * loss[e], 0.5 * variance[e], relative, square, largest)
        for j in range(PARTS):
            _add(real[group[e], j], direction[e, j - 1] if j else 1.0, x)
            _add(imaginary[group[e], j], direction[e, j - 1] if j else 1.0, y)
    return real, imaginary, power


@compiled
def _add(total: Floats, factor: float, values: Floats) -> None:
    for k in range(values.size):
        total[k] += factor * values[k]


@compiled
def _turn(x: Floats, y: Floats, phase: float, delay: float, omega: Floats, room: Floats) -> None:
    """Multiplies x + iy (bin,) by exp(i phase - i omega delay)."""
    c, s = room[0], room[1]
    _phasors(c, s, phase - omega[0] * delay, -(omega[-1] - omega[0]) / max(omega.size - 1, 1) * delay, omega.size)
    for k in range(omega.size):
        x[k], y[k] = x[k] * c[k] - y[k] * s[k], x[k] * s[k] + y[k] * c[k]


@compiled
def _fade(
    x: Floats, y: Floats, amplitude: float, decay: float, half: float, relative: Floats, square: Floats, largest: float
) -> None:
    """Multiplies x + iy (bin,) by amplitude exp(-decay relative - half square); largest: of |relative|."""
    if abs(decay) * largest + half * square[-1] < SMALL:
        for k in range(x.size):
            exponent = -decay * relative[k] - half * square[k]
            factor = amplitude * (1.0 + exponent * (1.0 + 0.5 * exponent * (1.0 + exponent / 3.0)))
            x[k], y[k] = x[k] * factor, y[k] * factor
    else:
        for k in range(x.size):
            factor = amplitude * math.exp(-decay * relative[k] - half * square[k])
            x[k], y[k] = x[k] * factor, y[k] * factor


@compiled
def _facet_mean(x: Floats, y: Floats, corners: Floats, omega: Floats, square: Floats, room: Floats) -> None:
    """Real and imaginary part (bin,) of the mean over a facet of exp(-i omega t) about the mean of its corners (3,),
    and the turn that this mean makes."""
    middle = (corners[0] + corners[1] + corners[2]) / 3.0
    p, q, r = middle - corners[0], middle - corners[1], middle - corners[2]  # phases are omega times these
    low, high = min(p, q), max(p, q)
    a, c = min(low, r), max(high, r)
    gap, top = c - a, omega.size - 1
    if gap * omega[top] < WIDEST:
        terms = series(room, p * (q + r) + q * r, p * q * r, gap * omega[top], 0.5 * TOLERANCE)
        x[:] = room[0, terms]
        y[:] = room[1, terms]
        for j in range(terms - 1, -1, -1):
            u, v = room[0, j], room[1, j]
            for k in range(omega.size):
                x[k] = x[k] * square[k] + u
                y[k] = y[k] * square[k] + v
        for k in range(omega.size):
            x[k] *= 2.0
            y[k] *= 2.0 * omega[k]
    else:
        b = max(low, min(high, r))
        for k in range(omega.size):
            value = 2.0 * divided(omega[k] * a, omega[k] * b, omega[k] * c)
            x[k], y[k] = value.real, value.imag
    if abs(middle) * omega[top] > TOLERANCE:
        _turn(x, y, 0.0, middle, omega, room)


@compiled
def _phasors(c: Floats, s: Floats, first: float, step: float, count: int) -> None:
    """Cosines and sines of first + step * bin, of `count` bins, by doubling: error 1e-16 of their number."""
    c[0], s[0] = math.cos(first), math.sin(first)
    by_c, by_s, done = math.cos(step), math.sin(step), 1
    while done < count:
        for k in range(min(done, count - done)):
            c[done + k] = c[k] * by_c - s[k] * by_s
            s[done + k] = s[k] * by_c + c[k] * by_s
        by_c, by_s, done = by_c * by_c - by_s * by_s, 2.0 * by_c * by_s, 2 * done


@compiled
def _moments(weight: Floats, fade: Floats, relative: Floats) -> Floats:
    """Sums (snap, 4) over bins of weight (snap, bin) times fade (bin,) times powers 0 to 3 of -relative (bin,)."""
    moment = np.zeros((len(weight), 4))
    for n in range(len(weight)):
        for k in range(len(fade)):
            value = weight[n, k] * fade[k]
            for j in range(4):
                moment[n, j] += value
                value *= -relative[k]
    return moment


@compiled
def mean_powers(
    snap: Ints,
    coherent: Bools,
    coherent_fraction: Floats,
    height_delay_std: Floats,
    loss: Floats,
    delay_std: Floats,
    echo_delay_std: Floats,
    frequency: Floats,
    relative: Floats,
    weight: Floats,
    centre: float,
) -> Floats:
    """Means over the band (4, path) of the power of each path over that at its centre.

    First of what a facet does to the pulse, (f/centre)^2 of a coherent one (its mean left out) or 1 - w exp(-g^2) of a
    rough one (`facet_pulses`); then with echo_delay_std (path,) s, the facet's part of it; then with absorption of
    loss (path,) dB at the centre, relative (bin,) more at the other frequencies; then with the rest of delay_std
    (path,) s as well. weight (snap, bin) sums to 1. What a loss is more or less than their mean is taken by a
    series where it is `SMALL`.
    """
    out = np.zeros((4, loss.size))
    omega, shared = 2.0 * math.pi * frequency, math.log(10.0) / 10.0 * loss.mean()
    fade, largest = np.exp(-shared * relative), np.abs(relative).max()
    total, moment = weight.sum(axis=1), _moments(weight, fade, relative)
    for e in range(loss.size):
        decay = math.log(10.0) / 10.0 * loss[e] - shared
        small = abs(decay) * largest < SMALL
        own = echo_delay_std[e] ** 2
        others = max(delay_std[e] ** 2 - own, 0.0)
        if small and own + others == 0.0 and not coherent[e] and not coherent_fraction[e] > 0.0:  # water alone
            m = moment[snap[e]]
            out[0, e] = out[1, e] = total[snap[e]]
            out[2, e] = out[3, e] = m[0] + decay * (m[1] + 0.5 * decay * (m[2] + decay / 3.0 * m[3]))
            continue
        for k in range(frequency.size):
            power = weight[snap[e], k]
            if coherent[e]:
                power *= (frequency[k] / centre) ** 2
            if coherent_fraction[e] > 0.0:
                g = omega[k] * height_delay_std[e]
                power *= 1.0 - coherent_fraction[e] - coherent_fraction[e] * math.expm1(-g * g)
            out[0, e] += power
            if own > 0.0:
                power *= math.exp(-(omega[k] ** 2) * own)
            out[1, e] += power
            x = -decay * relative[k]
            power *= fade[k] * (1.0 + x * (1.0 + 0.5 * x * (1.0 + x / 3.0)) if small else math.exp(x))
            out[2, e] += power
            if others > 0.0:
                power *= math.exp(-(omega[k] ** 2) * others)
            out[3, e] += power
    return out


@compiled
def power_steps(
    scattering: Floats, spreading_out: Floats, spreading_in: Floats, loss: Floats, boundary: Floats, means: Floats
) -> Floats:
    """Powers (step, path) of paths over that of the snap at 1 m, with one factor more in each: scattering, way out, way
    in, absorption of loss (path,) dB at the centre, boundaries; means (3, path) over the band of what the facet, then
    absorption, then roughness do to the power, together."""
    steps = np.empty((5, len(loss)))
    for e in range(len(loss)):
        power = scattering[e] ** 2
        steps[0, e] = power * means[0, e]
        power *= spreading_out[e] ** 2
        steps[1, e] = power * means[0, e]
        power *= spreading_in[e] ** 2
        steps[2, e] = power * means[0, e]
        power *= math.exp(-math.log(10.0) / 10.0 * loss[e])
        steps[3, e] = power * means[1, e]
        steps[4, e] = power * boundary[e] ** 2 * means[2, e]
    return steps


@compiled
def budget_sums(
    snap: Ints, target: Ints, family: Ints, steps: Floats, coherent: Bools, shape: tuple[int, int, int]
) -> tuple[Ints, Ints, Floats, Floats, Ints]:
    """Cell (path,) of a table (snap, target, family), whose last target is none, and of each cell how many paths there
    are, the sums of their powers (step, cell), of the last step those of paths that are not coherent, and the path of
    most power there, the first of equals, -1 where there is none."""
    size = shape[0] * shape[1] * shape[2]
    cell, count, loudest = np.empty(len(snap), np.int64), np.zeros(size, np.int64), np.full(size, -1)
    sums, apart = np.zeros((len(steps), size)), np.zeros(size)
    for e in range(len(snap)):
        met = target[e] if target[e] >= 0 else shape[1] - 1
        c = cell[e] = (snap[e] * shape[1] + met) * shape[2] + family[e]
        count[c] += 1
        for step in range(len(steps)):
            sums[step, c] += steps[step, e]
        if not coherent[e]:
            apart[c] += steps[-1, e]
        if loudest[c] < 0 or steps[-1, e] > steps[-1, loudest[c]]:
            loudest[c] = e
    return cell, count, sums, apart, loudest


@compiled
def echo_sums(
    target: Ints, family: Ints, coherent: Bools, power: Floats, direction: Floats, shape: tuple[int, int]
) -> Floats:
    """Powers of echoes that are not coherent (path,), and those times their directions (path, xyz), summed: (target *
    family, 1 + xyz); of a target less than 0, which is none, nothing."""
    sums = np.zeros((shape[0] * shape[1], 4))
    for e in range(len(target)):
        if target[e] < 0 or coherent[e]:
            continue
        c = target[e] * shape[1] + family[e]
        sums[c, 0] += power[e]
        for x in range(3):
            sums[c, 1 + x] += power[e] * direction[e, x]
    return sums
