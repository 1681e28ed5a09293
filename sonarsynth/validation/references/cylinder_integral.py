"""The Kirchhoff integral over a whole rigid cylinder at backscatter, in closed form."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.special import j1, struve

from sonarsynth.conventions import Floats

Complexes = npt.NDArray[np.complex128]


def lit_cylinder(aspect: npt.ArrayLike, wavenumber: npt.ArrayLike, radius: float, length: float) -> Complexes:
    """Far-field amplitude f (...) (m) of the lit side and the lit end, seen at an angle (rad) off the axis, 0 to pi/2.

    With x = 2 k a sin(aspect), over the side, (i k/2 pi) a sin(aspect) L sinc(k L cos(aspect)) times
    int_(-pi/2)^(pi/2) cos q exp(i x cos q) dq = 2 - pi H_1(x) + i pi J_1(x), H_1 Struve's function (Abramowitz and
    Stegun 1972, 12.1.7, and 9.1.21); over the end, the disc (i k/2 pi) cos(aspect) pi a^2 2 J_1(x)/x
    exp(i k L cos(aspect)). Wavenumber k (rad/m), radius a and length L (m); phases as in
    `equations.scattering.kirchhoff_integral`.
    """
    k, angle = np.asarray(wavenumber, float), np.asarray(aspect, float)
    along = k * length * np.cos(angle)
    x = np.maximum(2.0 * k * radius * np.sin(angle), 1e-150)
    disc = np.pi * radius**2 * np.cos(angle) * (2.0 * j1(x) / x) * np.exp(1j * along)
    return np.asarray(0.5j / np.pi * k * (_side(x, along, angle, radius, length) + disc))


def _side(x: Floats, along: Floats, angle: Floats, radius: float, length: float) -> Complexes:
    around = 2.0 - np.pi * struve(1, x) + 1j * np.pi * j1(x)
    return np.asarray(radius * np.sin(angle) * length * np.sinc(along / np.pi) * around)
