"""Whose energy a beam holds at a delay, compiled: paths heard through the pattern of the array, and summed by group."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Bools, Complexes, Floats, Ints
from sonarsynth.equations.kernels.phasors import face_response, sine

RIM_STEP = 0.35
"""rad at the rim of the aperture between two tables of the pattern: the nearest one errs by 0.1 rad rms at most."""
SMALL = 0.1
"""Np: decays as small as this go by the series of the exponential, good to 4e-6."""
STEPS, TINY = 64, 1e-300
"""Factors of two in power that paths are told apart by where they are faint; of the powers, where none is 0."""
HEARD = 0.1
"""Of what the loudest path brings of a point: what brings less does not tell where it may be."""


class Pattern(NamedTuple):
    """The pattern of an array: tabulated over the slowness across a lattice, or the sensors themselves."""

    table: npt.NDArray[np.complex64]  # (defocus, row step, column step) over twice the period of the lattice, and the
    # first two steps again; (0, 0, 0)
    first: int  # defocus of the first table, in steps
    step: float  # defocus (1/m times Hz) of one step
    pitch: float  # s: of the lattice, over the sound speed
    position: Floats  # (sensor, xyz) s: of live sensors, over the sound speed
    weight: Floats  # (sensor,) of sum one


@compiled
def turn(angle: float, step: float, phasors: Complexes) -> None:
    """Fill phasors (bin,) of an angle (rad) and a step more each."""
    phasor, turned = complex(math.cos(angle), math.sin(angle)), complex(math.cos(step), math.sin(step))
    for k in range(len(phasors)):
        phasors[k] = phasor
        phasor *= turned


@compiled(fastmath={"contract"})
def path_spectra(
    amplitude: Floats, phase: Floats, delay: Floats, loss: Floats, delay_std: Floats, face: Floats, frequency: Floats,
    relative: Floats,
) -> Complexes:  # fmt: skip
    """Spectra (path, bin) of paths as an element of the array hears them, over that of the snap at 1 m.

    phase rad; delay s; loss dB where relative (bin,) is 1; delay_std s; face (path, 2): sines of the direction along y
    and z times the side of the square face over the sound speed (s).
    """
    bins, steepest = len(frequency), np.abs(relative).max()
    spectrum, gain = np.empty((len(amplitude), bins), np.complex128), np.empty(bins)
    for e in range(len(amplitude)):
        decay, half = math.log(10.0) / 20.0 * loss[e], 0.5 * (2.0 * math.pi * delay_std[e]) ** 2
        small, out = abs(decay) * steepest + half * frequency[-1] ** 2 < SMALL, spectrum[e]
        for k in range(bins):
            x = -decay * relative[k] - half * frequency[k] * frequency[k]
            gain[k] = 1.0 + x * (1.0 + x / 2.0 * (1.0 + x / 3.0)) if small else math.exp(x)
        y, z, first, late = face[e, 0], face[e, 1], phase[e] / math.pi, 2.0 * delay[e]
        for k in range(bins):
            f = frequency[k]
            turns = first - f * late
            size = amplitude[e] * gain[k] * face_response(f * y, f * z)
            out[k] = complex(size * sine(turns + 0.5), size * sine(turns))
    return spectrum


@compiled
def farthest(vectors: Floats, factor: float, others: Floats) -> float:
    """Bound on how far vectors (row, xyz) times a factor are from others (row, xyz), two at most; 0 without any."""
    square = 0.0
    for x in range(3):
        low, high, least, most = np.inf, -np.inf, np.inf, -np.inf
        for n in range(len(vectors)):
            low, high = min(low, factor * vectors[n, x]), max(high, factor * vectors[n, x])
        for n in range(len(others)):
            least, most = min(least, others[n, x]), max(most, others[n, x])
        square += max(high - least, most - low, 0.0) ** 2
    return min(math.sqrt(square), 2.0)


@compiled
def largest(values: Floats, more: Floats) -> Floats:
    """Largest size (row,) of values (row, column), and more (row,)."""
    out = more.copy()
    for n in range(len(values)):
        size = 0.0
        for k in range(values.shape[1]):
            size = max(size, abs(values[n, k]))
        out[n] += size
    return out


@compiled
def loud_at(moment: Floats, window: float, delay: Floats, amplitude: Floats, code: Ints, share: float) -> Ints:
    """Which paths (path,) are within `window` (s) of any moment, in order, and not among those that from the faintest
    of their code on bring this share of its power at most: by steps of a factor of two in power."""
    total = np.zeros(code.max() + 1 if len(code) else 0)
    for e in range(len(code)):
        total[code[e]] += amplitude[e] ** 2
    step, power = np.zeros(len(code), np.int64), np.zeros((len(total), STEPS))
    for e in range(len(code)):
        step[e] = min(max(math.frexp(share * total[code[e]] / max(amplitude[e] ** 2, TINY))[1], 0), STEPS - 1)
        power[code[e], step[e]] += amplitude[e] ** 2
    faintest = np.full(len(total), STEPS)  # of each code, the first step that is left out
    for c in range(len(total)):
        up_to = 0.0
        while faintest[c] > 1 and up_to + power[c, faintest[c] - 1] <= share * total[c]:
            faintest[c] -= 1
            up_to += power[c, faintest[c]]
    rows, count = np.empty(len(code), np.int64), 0
    for e in range(len(code)):
        if step[e] < faintest[code[e]]:
            n = np.searchsorted(moment, delay[e] - window)
            rows[count] = e
            count += n < len(moment) and moment[n] < delay[e] + window
    return rows[:count]


@compiled(fastmath={"contract"}, forceinline=True)
def _tabulated(
    response: Complexes, apart: Floats, curvature: float, focus: float, frequency: Floats, pattern: Pattern
) -> None:
    """Response (bin,) on a lattice: bilinear in tables of the nearest defocus."""
    table, levels, size = pattern.table, pattern.table.shape[0], pattern.table.shape[1] - 2
    bulge, y, z = (curvature - focus) / pattern.step, 0.5 * pattern.pitch * apart[1], 0.5 * pattern.pitch * apart[2]
    for k in range(len(frequency)):
        level = np.uint32(min(max(np.rint(frequency[k] * bulge) - pattern.first, 0.0), levels - 1.0))
        across, up = frequency[k] * y, frequency[k] * z
        across, up = (across - np.floor(across)) * size, (up - np.floor(up)) * size
        i, j = np.uint32(up), np.uint32(across)  # without signs no index counts from the end
        v, u = np.float32(up - i), np.float32(across - j)
        a, b, c, d = table[level, i, j], table[level, i, j + 1], table[level, i + 1, j], table[level, i + 1, j + 1]
        upper, lower = a.real + u * (b.real - a.real), c.real + u * (d.real - c.real)
        real = upper + v * (lower - upper)
        upper, lower = a.imag + u * (b.imag - a.imag), c.imag + u * (d.imag - c.imag)
        response[k] = complex(real, upper + v * (lower - upper))


@compiled
def _delay(q: Floats, square: float, u: Floats, curvature: float) -> float:
    """Delay (s) of a sphere after the middle of the array: (sqrt(R^2 - 2 R u.q + q^2) - R)/c, q over c."""
    bulge = curvature * square - 2.0 * (u[0] * q[0] + u[1] * q[1] + u[2] * q[2])
    return float(bulge / (1.0 + math.sqrt(max(1.0 + curvature * bulge, 0.0))))


@compiled
def _summed(
    response: Complexes, path: Floats, curvature: float, slowness: float, beam: Floats, focus: float, speed: float,
    frequency: Floats, pattern: Pattern,
) -> None:  # fmt: skip
    """Response (bin,) of sensors anywhere, one by one; curvatures in 1/m, positions over `speed` (m/s)."""
    response[:] = 0.0
    spacing = frequency[1] - frequency[0] if len(frequency) > 1 else 0.0
    for q in range(len(pattern.weight)):
        sensor = pattern.position[q]
        square = sensor[0] ** 2 + sensor[1] ** 2 + sensor[2] ** 2
        late = _delay(sensor, square, beam, focus * speed) - slowness * _delay(sensor, square, path, curvature * speed)
        angle, step = 2.0 * math.pi * frequency[0] * late, 2.0 * math.pi * spacing * late
        phasor = complex(math.cos(angle), math.sin(angle)) * pattern.weight[q]
        turned = complex(math.cos(step), math.sin(step))
        for k in range(len(frequency)):
            response[k] += phasor
            phasor *= turned


@compiled(fastmath=True, forceinline=True)
def _heard(spectrum: Complexes, response: Complexes, weight: Complexes, sums: Complexes) -> complex:
    """Add a spectrum times a response (bin,) to sums (bin,): and the sum of what is added, weighted (bin,)."""
    total = 0j
    for k in range(len(sums)):
        value = spectrum[k] * response[k]
        sums[k] += value
        total += weight[k] * value
    return total


@compiled
def attribute(
    beam: Floats, moment: Floats, beam_energy: Floats, first: Ints, last: Ints, direction: Floats, slowness: float,
    delay: Floats, curvature: Floats, longer: Floats, group: Ints, coherent: Bools, pulse: Bools, spectrum: Complexes,
    matched: Floats, energy: Floats, frequency: Floats, focus: float, speed: float, gate: float, reach: float,
    pattern: Pattern,
) -> tuple[Floats, Floats, Ints, Floats]:  # fmt: skip
    """Power (point, group) at the delay of each point, energy (point, group) within the gate, the loudest group
    (point,), -1 without any, and what each path (point, path from `first` on) of it brings of that power: where its
    phase counts, what of its pressure is in phase with that of all such, and against it less than nothing. The mean
    delay by that is where their sum is loudest, and a smooth body is heard at its glint.

    beam (point, xyz); moment (point,) s when the point's echo reaches the array centre; beam_energy (point,): energy of
    the beam; first, last (point,): the paths that may be heard then, ascending in delay (path,) s. A path counts within
    `gate` (s), longer by `longer` (path,) s and by reach (s) times how far its direction is from the beam's: a pulse is
    heard through side lobes as long as it takes to cross the array. slowness: of the water over that of the beams.
    spectrum (path, bin), over the pulse at 1 m, with its delay; matched (group, bin): amplitude of the group's pulse in
    what ranges it; coherent (path,): its phase counts; energy (group, bin): of the pulse; pulse (group,): of no target,
    which brings no more energy than echoes leave of `beam_energy`, for the sonar may have taken it out; focus,
    curvature: 1/m.
    """
    bins, groups = len(frequency), len(pulse)
    power, total = np.zeros((len(beam), groups)), np.zeros((len(beam), groups))
    owner, share = np.full(len(beam), -1), np.zeros((len(beam), max(1, (last - first).max())))
    sums, peaks = np.empty((groups, bins), np.complex128), np.empty(groups, np.complex128)
    response, apart, brought = np.empty(bins, np.complex128), np.empty(3), np.empty(share.shape[1], np.complex128)
    sooner, weight = np.empty(bins, np.complex128), np.empty((groups, bins), np.complex128)
    spacing = frequency[1] - frequency[0] if bins > 1 else 0.0
    for p in range(len(beam)):
        sums[:], peaks[:], brought[:] = 0.0, 0.0, 0.0
        turn(2.0 * math.pi * frequency[0] * moment[p], 2.0 * math.pi * spacing * moment[p], sooner)
        for g in range(groups):
            weight[g] = matched[g] * sooner
        for e in range(first[p], last[p]):
            away = 0.0
            for x in range(3):
                apart[x] = slowness * direction[e, x] - beam[p, x]
                away += apart[x] ** 2
            if abs(moment[p] - delay[e]) > gate + longer[e] + reach * math.sqrt(away):
                continue
            if pattern.table.shape[0]:
                _tabulated(response, apart, curvature[e], focus, frequency, pattern)
            else:
                _summed(response, direction[e], curvature[e], slowness, beam[p], focus, speed, frequency, pattern)
            peak = _heard(spectrum[e], response, weight[group[e]], sums[group[e]])
            brought[e - first[p]] = peak
            peaks[group[e]] += peak
        _compare(power[p], total[p], sums, peaks, energy, pulse, beam_energy[p])
        owner[p] = power[p].argmax() if power[p].max() > 0.0 else -1
        own = slice(first[p], last[p])
        _shared(share[p], brought, group[own] == owner[p], coherent[own])
    return power, total, owner, share


@compiled
def _shared(share: Floats, brought: Complexes, own: Bools, coherent: Bools) -> None:
    """Write what each path (path,) of the group adds to the power of a peak by what it brings of the pressure."""
    joint = 0j
    for e in range(len(own)):
        if own[e] and coherent[e]:
            joint += brought[e]
    for e in range(len(own)):
        if own[e]:
            share[e] = (brought[e] * (joint if coherent[e] else brought[e]).conjugate()).real


@compiled
def means(points: Ints, share: Floats, first: Ints, values: Floats) -> Floats:
    """Means (row, column) of values (path, column) by the shares (point, path from `first` on) of some points (row,),
    none beyond the values of the paths that bring `HEARD` of the loudest: where echoes cancel, it may be anywhere.
    """
    out = np.zeros((len(points), values.shape[1]))
    for row, p in enumerate(points):
        total, least = share[p].sum(), HEARD * share[p].max()
        for x in range(values.shape[1]):
            mean, low, high = 0.0, np.inf, -np.inf
            for e in range(share.shape[1]):
                if share[p, e] != 0.0:
                    value = values[first[p] + e, x]
                    mean += share[p, e] / total * value
                    if share[p, e] >= least:
                        low, high = min(low, value), max(high, value)
            out[row, x] = min(max(mean, low), high)
    return out


@compiled
def _compare(
    power: Floats, total: Floats, sums: Complexes, peaks: Complexes, energy: Floats, pulse: Bools, beam_energy: float
) -> None:
    """Powers and energies (group,) of a point."""
    echoes = 0.0
    for g in range(len(power)):
        power[g] = abs(peaks[g]) ** 2
        for k in range(sums.shape[1]):
            total[g] += energy[g, k] * abs(sums[g, k]) ** 2
        if not pulse[g]:
            echoes += total[g]
    remainder = max(beam_energy - echoes, 0.0)
    for g in range(len(power)):
        if pulse[g] and total[g] > remainder:
            power[g] *= remainder / total[g]
            total[g] = remainder
