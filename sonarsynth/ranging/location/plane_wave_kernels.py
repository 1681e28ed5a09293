"""What looking for a wavefront and taking it out do to every sensor, compiled. One thread, fixed order."""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.ranging.ranging_kernels import template_sums


@compiled
def tilted_energies(spectrum: Any, response: Any, late: Any, first: float, spacing: float, steps: int) -> Any:
    """Energy of beams tilted by -steps..steps of two tilts (tilt, tilt): sum over bins of |sum over sensors|^2.

    spectrum, response (sensor, bin) at f = first + spacing * bin (Hz); late (2, sensor) s: by how much the wave of one
    step of each tilt is later. Each bin is divided by its sum of response^2.
    """
    sensors, bins = spectrum.shape
    n = 2 * steps + 1
    beam = np.zeros((bins, n, n), np.complex128)
    power = np.zeros(bins)
    for q in range(sensors):
        first_turn, second_turn = np.exp(2j * np.pi * first * late[0, q]), np.exp(2j * np.pi * first * late[1, q])
        first_step, second_step = np.exp(2j * np.pi * spacing * late[0, q]), np.exp(2j * np.pi * spacing * late[1, q])
        corner, corner_on = np.conj(first_turn * second_turn) ** steps, np.conj(first_step * second_step) ** steps
        for k in range(bins):
            h = response[q, k]
            power[k] += h * h
            row = h * spectrum[q, k] * corner
            for i in range(n):
                value = row
                for j in range(n):
                    beam[k, i, j] += value
                    value *= second_turn
                row *= first_turn
            first_turn, second_turn, corner = first_turn * first_step, second_turn * second_step, corner * corner_on
    energy = np.zeros((n, n))
    for k in range(bins):
        if power[k] > 0:
            energy += (beam[k].real ** 2 + beam[k].imag ** 2) / power[k]
    return energy


@compiled
def shares(spectrum: Any, response: Any) -> Any:
    """Of each bin (bin,): energy that the best common wave explains, energy of all, and the power of the response.

    spectrum, response (sensor, bin). The best wave is sum(h x)/sum(h^2).
    """
    sensors, bins = spectrum.shape
    total = np.zeros(bins, np.complex128)
    power, energy = np.zeros(bins), np.zeros(bins)
    for q in range(sensors):
        for k in range(bins):
            h, x = response[q, k], spectrum[q, k]
            total[k] += h * x
            power[k] += h * h
            energy[k] += x.real**2 + x.imag**2
    wave = np.abs(total) ** 2
    return np.where(power > 0, wave / np.where(power > 0, power, 1.0), 0.0), energy, power


@compiled
def explained(spectrum: Any, response: Any) -> Any:
    """What the best common wave makes each sensor hear (sensor, bin): an orthogonal projection, bin by bin."""
    sensors, bins = spectrum.shape
    total, power = template_sums(spectrum, response)
    for k in range(bins):
        total[k] = total[k] / power[k] if power[k] > 0 else 0.0
    projection = np.empty((sensors, bins), np.complex128)
    for q in range(sensors):
        for k in range(bins):
            projection[q, k] = response[q, k] * total[k]
    return projection


@compiled
def add(pressure: Any, arrival: Any, wave: Any, sign: float) -> Any:
    """Add sign * wave (sensor, 2 half) to pressure (sensor, sample) about `arrival`, with the window of `cut_out`.

    In place. Returns by how much the sum of squares fell (Pa2).
    """
    sensors, samples = pressure.shape
    half = wave.shape[1] // 2
    fell = 0.0
    for q in range(sensors):
        sample = np.floor(arrival[q])
        first, fraction = int(sample) - half, arrival[q] - sample
        for i in range(max(1, -first), min(2 * half, samples - first)):
            x = i - fraction
            flat = 1.0 if 0.25 * half <= x <= 1.75 * half else np.sin(2 * np.pi * x / half) ** 2
            old = pressure[q, first + i]
            new = np.float32(old + sign * flat * wave[q, i])
            pressure[q, first + i] = new
            fell += np.float64(old) ** 2 - np.float64(new) ** 2
    return fell
