"""What locating and ranging do to every sensor and every beam, compiled. All in float64, one thread, fixed order."""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.equations.kernels.phasors import face_response, sine


@compiled(fastmath=True)
def powers(waves: Any, taps: Any, power: Any, total: Any, loudest: Any) -> None:
    """Write |.|^2 of complex waves (beam, sample), and of what they are halfway between samples, into power (beam, two
    for a sample), as many as it has, their sums into total (beam,), and into loudest (delay,) what is more than it has.

    Waves have frequencies from 0 to half their rate and go on where they end as they begin. Halfway between samples
    they are the sum over k of taps (4,) times samples k + 1/2 before and after, turned by their middle frequency.
    """
    samples, count = waves.shape[1], power.shape[1]
    re, im = np.empty(samples + 8, np.float32), np.empty(samples + 8, np.float32)  # from 3 samples before the first on
    between = np.empty((count + 1) // 2, np.float32)
    a, b, c, d = taps
    for n in range(len(waves)):
        for i in range(samples):
            re[i + 3], im[i + 3] = waves[n, i].real, waves[n, i].imag
        for i in (-3, -2, -1, samples, samples + 1, samples + 2, samples + 3, samples + 4):
            re[i + 3], im[i + 3] = waves[n, i % samples].real, waves[n, i % samples].imag
        for i in range(len(between)):
            x = a * (re[i + 3] + im[i + 4]) - b * (im[i + 2] + re[i + 5])
            y = a * (im[i + 3] - re[i + 4]) + b * (re[i + 2] - im[i + 5])
            x += d * (im[i] + re[i + 7]) - c * (re[i + 1] + im[i + 6])
            y -= d * (re[i] - im[i + 7]) + c * (im[i + 1] - re[i + 6])
            between[i] = x * x + y * y
        for i in range(count // 2):
            power[n, 2 * i] = re[i + 3] * re[i + 3] + im[i + 3] * im[i + 3]
            power[n, 2 * i + 1] = between[i]
        if count % 2 > 0:
            last = len(between) + 2
            power[n, count - 1] = re[last] * re[last] + im[last] * im[last]
        sum_of_all = np.float32(0.0)
        for i in range(count):
            sum_of_all += power[n, i]
            loudest[i] = max(loudest[i], power[n, i])
        total[n] = sum_of_all


@compiled
def cut_out(pressure: Any, arrival: Any, half: int, gain: Any) -> Any:
    """Samples (sensor, 2 half) about `arrival` (sensor,), counted in samples, times gain and a flat top.

    The window is 1 in its middle three quarters, with raised-cosine flanks, and moves with the arrival, not with the
    samples: x samples after it opens, its flanks are sin^2(2 pi x/half) on either side. Zeros beyond the ends of
    pressure (sensor, sample).
    """
    sensors, samples = pressure.shape
    angle = 4 * np.pi / half * np.arange(2 * half)
    cosine, sine = np.cos(angle), np.sin(angle)
    cut = np.zeros((sensors, 2 * half))
    for q in np.flatnonzero(gain):
        sample = np.floor(arrival[q])
        first, fraction = int(sample) - half, arrival[q] - sample
        c, s = np.cos(4 * np.pi / half * fraction), np.sin(4 * np.pi / half * fraction)
        begin = max(1, -first)
        end = max(min(2 * half, samples - first), begin)
        row, heard, factor = cut[q, begin:end], pressure[q, first + begin : first + end], gain[q]
        for i in range(end - begin):  # of slices: many at once
            row[i] = heard[i] * factor
        low, high = int(np.ceil(0.25 * half + fraction)), int(np.floor(1.75 * half + fraction))  # flat from low to high
        for i in range(begin, min(low, end)):
            cut[q, i] *= 0.5 - 0.5 * (cosine[i] * c + sine[i] * s)
        for i in range(max(high + 1, begin), end):
            cut[q, i] *= 0.5 - 0.5 * (cosine[i] * c + sine[i] * s)
    return cut


@compiled(fastmath={"contract"}, forceinline=True)
def turned(spectrum: Any, delay: Any, first: float, spacing: float) -> Any:
    """spectrum * exp(+i 2 pi f delay): (sensor, bin) at f = first + spacing * bin (Hz), delay (sensor,) s."""
    shifted = np.empty(spectrum.shape, np.complex128)
    for q in range(len(shifted)):
        row, out = spectrum[q], shifted[q]
        for k in range(len(out)):
            turns = 2.0 * (first + k * spacing) * delay[q]
            out[k] = row[k] * complex(sine(turns + 0.5), sine(turns))
    return shifted


@compiled(fastmath={"contract"}, forceinline=True)
def face_responses(across: Any, up: Any, first: float, spacing: float, bins: int) -> Any:
    """sinc(f across) sinc(f up): (row, bin) at f = first + spacing * bin (Hz); across, up (row,) s: face times sine/c.

    `apertures.element_directivity` of many directions at evenly spaced frequencies.
    """
    response = np.empty((len(across), bins))
    for i in range(len(across)):
        row = response[i]
        for k in range(bins):
            row[k] = face_response((first + k * spacing) * across[i], (first + k * spacing) * up[i])
    return response


@compiled(fastmath=True, forceinline=True)
def _mean_square(values: Any, share: Any) -> Any:
    total = np.float32(0.0)
    for k in range(len(values)):
        total += share[k] * values[k] * values[k]
    return total


@compiled
def match(beams: Any, across: Any, up: Any, first: float, spacing: float, share: Any, matched: Any, wider: Any) -> None:
    """Multiply beams (beam, bin) by `face_responses`, over their root mean square by share (bin,), and by matched
    (bin,), and write them into wider (beam, more bins), with zeros beyond, as well."""
    bins = beams.shape[1]
    face, share, matched = np.empty(bins, np.float32), share.astype(np.float32), matched.astype(np.complex64)
    for b in range(len(beams)):
        for k in range(bins):
            face[k] = face_response((first + k * spacing) * across[b], (first + k * spacing) * up[b])
        scale = np.float32(1.0 / np.sqrt(_mean_square(face, share)))
        for k in range(bins):
            wider[b, k] = beams[b, k] * (face[k] * scale * matched[k])
        beams[b], wider[b, bins:] = wider[b, :bins], 0.0


@compiled
def template_sums(spectrum: Any, response: Any) -> Any:
    """Sums over sensors of response * spectrum and of response^2: (bin,) each; spectrum, response (sensor, bin)."""
    sensors, bins = spectrum.shape
    total = np.zeros(bins, np.complex128)
    power = np.zeros(bins)
    for q in range(sensors):
        for k in range(bins):
            total[k] += response[q, k] * spectrum[q, k]
            power[k] += response[q, k] * response[q, k]
    return total, power


@compiled
def common_wave(
    spectrum: Any, shift: Any, position: Any, gain: Any, direction: Any, curvature: float, face: float, first: float,
    spacing: float,
) -> Any:  # fmt: skip
    """Spectra of sensors turned by shift (sensor,) s, their responses to one wave, both (sensor, bin), and the
    `template_sums` of these.

    position (sensor, xyz) m, gain (sensor,); direction (xyz) and curvature (1/m) of the wave; face (s): side of the
    faces over the sound speed; first, spacing (Hz): of the bins.
    """
    sensors, bins = spectrum.shape
    across, up, loud, toward = np.empty(sensors), np.empty(sensors), np.empty(sensors), np.empty(3)
    for q in range(sensors):
        square = 0.0
        for x in range(3):
            toward[x] = direction[x] - curvature * position[q, x]
            square += toward[x] * toward[x]
        distance = np.sqrt(square)
        across[q], up[q], loud[q] = toward[1] * face / distance, toward[2] * face / distance, gain[q] / distance
    response = face_responses(across, up, first, spacing, bins)
    for q in range(sensors):
        for k in range(bins):
            response[q, k] *= loud[q]
    shifted = turned(spectrum, shift, first, spacing) if np.any(shift != 0.0) else spectrum
    total, power = template_sums(shifted, response)
    return shifted, response, total, power


@compiled(fastmath={"contract", "reassoc"})
def lag_sums(spectrum: Any, response: Any, template: Any, omega: Any) -> Any:
    """Sums over bins for each sensor (sensor,), with the model M = response * template and the rest R = spectrum - M:

    omega Im(M conj R), |omega M|^2, |R|^2 and Im(M conj R)^2/|M|^2, what is out of phase; spectrum, response (sensor,
    bin), which is real; template, omega (bin,).
    """
    sums, loud = np.zeros((4, len(spectrum))), template.real**2 + template.imag**2
    inverse = 1.0 / np.where(loud > 0.0, loud, np.inf)
    for q in range(len(spectrum)):
        x, h = spectrum[q], response[q]
        slope = weight = residual = across = 0.0
        for k in range(len(omega)):
            r, by_phase = x[k] - h[k] * template[k], omega[k] * h[k]
            turn = template[k].imag * r.real - template[k].real * r.imag
            slope += by_phase * turn
            weight += by_phase * by_phase * loud[k]
            residual += r.real * r.real + r.imag * r.imag
            across += turn * turn * inverse[k]
        sums[:, q] = slope, weight, residual, across
    return sums


@compiled
def loudest_near(
    power: Any, top: Any, about: int, row: Any, column: Any, index: Any, up: int, across: int, beam: Any, reach: float
) -> Any:
    """Largest power (beam,) within `about` steps of each beam's own peak, in the beams within `reach` of it.

    power (beam, delay), top (beam,) the steps of the peaks, beam (beam, xyz) unit vectors, reach the largest distance
    of their ends; row, column (beam,) on the grid and index (elevation, azimuth) the beam there, -1 for none; no beam
    further than `up` rows and `across` columns is within reach.
    """
    rows, columns = index.shape
    steps = power.shape[1]
    loudest = np.zeros(len(top), power.dtype)
    for b in range(len(top)):
        low, high = max(top[b] - about, 0), min(top[b] + about + 1, steps)
        for i in range(max(row[b] - up, 0), min(row[b] + up + 1, rows)):
            for j in range(max(column[b] - across, 0), min(column[b] + across + 1, columns)):
                neighbour = index[i, j]
                if neighbour < 0:
                    continue
                x, y = beam[b, 0] - beam[neighbour, 0], beam[b, 1] - beam[neighbour, 1]
                z = beam[b, 2] - beam[neighbour, 2]
                if x * x + y * y + z * z <= reach * reach:
                    for t in range(low, high):
                        loudest[b] = max(loudest[b], power[neighbour, t])
    return loudest
