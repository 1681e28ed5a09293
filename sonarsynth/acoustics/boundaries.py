"""Reflection at the sea bed and at the surface. Time dependence exp(+i 2 pi f t): a lossy bed has Im V of that sign."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats

Complexes = npt.NDArray[np.complex128]


def rayleigh(
    grazing: npt.ArrayLike, density_ratio: npt.ArrayLike, speed_ratio: npt.ArrayLike, loss_tangent: npt.ArrayLike = 0.0
) -> Complexes:
    """Plane-wave reflection coefficient of a fluid half-space at grazing angles (rad, from the boundary).

    With m = rho2/rho1, n = (c1/c2)(1 - i delta) and q the grazing angle,

        V = (m sin q - w)/(m sin q + w),   w = sqrt(n^2 - cos^2 q),   Im w <= 0

    so that the wave in the bed dies away from the boundary. n^2 - cos^2 q is taken as (n^2 - 1) + sin^2 q, which keeps
    its digits near grazing; V(0) = -1 for every bed but the one that is no boundary at all (n = 1), where
    V = (m - 1)/(m + 1) at every angle. Arguments broadcast.
    Source: Rayleigh; Brekhovskikh and Lysanov (2003), Fundamentals of Ocean Acoustics, section 3.1 (conjugated).
    """
    sine = np.abs(np.sin(np.asarray(grazing, float)))
    m, ratio, delta = (np.asarray(x, float) for x in (density_ratio, speed_ratio, loss_tangent))
    n = (1.0 - 1j * delta) / ratio
    w = np.sqrt((n - 1.0) * (n + 1.0) + sine**2 + 0j)
    w = np.where(w.imag > 0.0, -w, w)
    top, bottom = m * sine - w, m * sine + w
    nothing = bottom == 0.0  # q = 0 and n = 1
    return np.asarray(np.where(nothing, (m - 1.0) / (m + 1.0), top / np.where(nothing, 1.0, bottom)))


def critical_grazing(speed_ratio: npt.ArrayLike) -> Floats:
    """Grazing angle (rad) below which a lossless bed of that speed ratio reflects everything; NaN for a slow bed."""
    ratio = np.asarray(speed_ratio, float)
    return np.asarray(np.arccos(np.where(ratio >= 1.0, 1.0 / ratio, np.nan)))


def pressure_release(grazing: npt.ArrayLike) -> Complexes:
    """Reflection coefficient of the flat sea surface: -1 at every angle."""
    return np.full(np.shape(grazing), -1.0 + 0j)


def eckart(wavenumber: npt.ArrayLike, rms_height: npt.ArrayLike, grazing: npt.ArrayLike) -> Floats:
    """Coherent part of the reflection from a rough boundary over that of the flat one: exp(-g^2/2), g = 2 k h sin q.

    wavenumber k (rad/m), rms height h (m), grazing angle q (rad). The rest of the energy is scattered, not lost.
    Source: Eckart (1953), JASA 25, 566.
    """
    k, h, q = (np.asarray(x, float) for x in (wavenumber, rms_height, grazing))
    return np.asarray(np.exp(-0.5 * (2.0 * k * h * np.sin(q)) ** 2))
