"""The first echo of a fluid sphere, that of its outside, cut in time out of the exact series."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats
from sonarsynth.equations.scattering.modal_series import Fluid, sphere_amplitude

Complexes = npt.NDArray[np.complex128]

HIGHEST = 200e3  # Hz: the pulse is a Hann window of frequencies from 0 to this
WINDOW = 4e-3  # s: all echoes that matter come within this
FINER = 4
"""Samples over the fewest that hold the pulse."""


def front_echo(frequency: Floats, away: float, radius: float, fluid: Fluid, sound_speed: float) -> Complexes:
    """Far-field amplitude (frequency,) (m) of the outside alone at frequencies (Hz) well within 0 and `HIGHEST`.

    away: angle (rad) off backscatter. A short pulse's echo by the series, without what comes more than 0.6 radii of way
    before or after the mirror point's: echoes through the body (the first 4 a/c1 cos later) and waves round it.
    """
    f = np.arange(1, round(HIGHEST * WINDOW)) / WINDOW
    pulse = np.hanning(len(f) + 2)[1:-1]
    count = 2 * FINER * (len(f) + 1)
    spectrum = np.zeros(count // 2 + 1, complex)
    series = sphere_amplitude(f, np.pi - away, radius=radius, sound_speed=sound_speed, boundary=fluid)
    spectrum[1 : len(f) + 1] = pulse * series
    delay = np.arange(count) * (WINDOW / count)
    delay -= np.where(delay > 0.5 * WINDOW, WINDOW, 0.0)
    mirror = -2.0 * radius / sound_speed * np.cos(0.5 * away)
    near = np.abs(delay - mirror) < 0.6 * radius / sound_speed
    front = np.fft.rfft(np.fft.irfft(spectrum, count) * near)[1 : len(f) + 1] / pulse
    return np.asarray(np.interp(frequency, f, front.real) + 1j * np.interp(frequency, f, front.imag))
