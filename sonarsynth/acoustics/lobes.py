"""Scattering by rough surfaces at high frequency: the lobe around the mirror direction, and the diffuse floor."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Bools, Floats


def dot(a: Floats, b: Floats) -> Floats:
    """Scalar product (...) of vectors (..., xyz), component by component: several times faster than einsum."""
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2])


def lit_and_seen(incident: Floats, scattered: Floats, normal: Floats) -> Bools:
    """Where a facet is lit by the incident wave and seen from where the scattered one goes (...)."""
    return np.asarray((dot(normal, incident) < 0) & (dot(normal, scattered) > 0))


def slope_of_width(width: npt.ArrayLike) -> Floats:
    """Rms slope per axis s of a surface whose lobe is exp(-delta^2/(2 width^2)) in amplitude, delta off the mirror.

    In the plane of incidence the half vector tilts by delta/2, so for small angles exp(-delta^2/(16 s^2)): s =
    width/sqrt 8.
    """
    return np.asarray(np.asarray(width, float) / np.sqrt(8.0))


def slope_lobe(incident: Floats, scattered: Floats, normal: Floats, slope: float) -> Floats:
    """Scattering cross-section per unit area and solid angle sigma0 (...) in 1/sr of a surface of rms slope `slope`.

    exp(-tan^2 b/(2 s^2))/(8 pi s^2 cos^4 b), b the tilt of the half vector scattered - incident from the normal: the
    high-frequency (slope) limit of the Kirchhoff integral for Gaussian slopes; Barrick (1968), IEEE Trans. Antennas
    Propag. 16, 449, with unit reflection coefficient. Unit vectors (..., xyz) of propagation, in and away. Reciprocal.
    0 where the half vector points into the surface.
    """
    half = [scattered[..., i] - incident[..., i] for i in range(3)]
    up = half[0] * normal[..., 0] + half[1] * normal[..., 1] + half[2] * normal[..., 2]
    # what is across the normal, so that nothing cancels at the mirror direction
    along = [half[i] - up * normal[..., i] for i in range(3)]
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        square = (along[0] * along[0] + along[1] * along[1] + along[2] * along[2]) / (up * up)  # tan^2 b
        lobe = np.exp(square * (-0.5 / slope**2)) * ((1.0 + square) ** 2 / (8.0 * np.pi * slope**2))
    return np.where((up > 0) & (square < 1e100), lobe, 0.0)


def lambert(incident: Floats, scattered: Floats, normal: Floats, albedo: float) -> Floats:
    """Scattering cross-section per unit area and solid angle (...) in 1/sr by Lambert's law: albedo/pi cos_i cos_s."""
    inward, outward = np.maximum(-dot(incident, normal), 0.0), np.maximum(dot(scattered, normal), 0.0)
    return np.asarray(albedo / np.pi * inward * outward)
