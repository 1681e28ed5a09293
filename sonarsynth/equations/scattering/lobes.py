"""Scattering by rough surfaces at high frequency: the lobe around the mirror direction, and the diffuse floor."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Bools, Floats


def dot(a: Floats, b: Floats) -> Floats:
    """Scalar product (...) of vectors (..., xyz), component by component: several times faster than einsum."""
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2])


def lit_and_seen(incident: Floats, scattered: Floats, normal: Floats, beyond: bool = False) -> Bools:
    """Where a facet is lit by the incident wave and, unless `beyond`, seen from where the scattered one goes (...)."""
    return np.asarray((dot(normal, incident) < 0) & ((dot(normal, scattered) > 0) | beyond))


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
    from sonarsynth.equations.scattering import lobes_kernels

    (a, b, n), shape = _rows(incident, scattered, normal)
    square = np.empty(a.shape[:2])
    lobes_kernels.tilts(a, b, n, square)
    lobe = np.exp(square * (-0.5 / slope**2))
    lobe *= np.square(square + 1.0, out=square)
    lobe /= 8.0 * np.pi * slope**2
    return lobe.reshape(shape)


def lobe_amplitude(
    incident: Floats,
    scattered: Floats,
    normal: Floats,
    area: Floats,
    slope: float,
    share: float,
    albedo: float,
    beyond: bool = False,
) -> Floats:
    """Amplitude sqrt(area (share sigma0 + albedo/pi cos_i cos_s)) (...) in m of facets lit and seen, 0 of others;
    `beyond` that, it goes on where they are lit and not seen, as the root of |...|: with nothing at the array centre
    it could not be followed to hydrophones that see them.

    Unit vectors (..., xyz) and area (...) m2 broadcast; slope as for `slope_lobe`, albedo as for `lambert`.
    """
    from sonarsynth.equations.scattering import lobes_kernels

    (a, b, n, size), shape = _rows(incident, scattered, normal, np.asarray(area)[..., None])
    lobe = slope_lobe(a, b, n, slope)
    lobes_kernels.amplitudes(a, b, n, size[..., 0], lobe, share, albedo / np.pi, beyond, lobe)
    return lobe.reshape(shape)


def _rows(*vectors: Floats) -> tuple[list[Floats], tuple[int, ...]]:
    """Vectors broadcast to (row, column, xyz), without copies where they have two axes or three, and their shape."""
    full = np.broadcast_shapes(*(np.shape(v) for v in vectors))
    columns = full[-2] if len(full) > 2 else 1
    rows = int(np.prod(full[:-1])) // max(columns, 1)
    wide = (v if v.shape == full else np.broadcast_to(v, full) for v in vectors)
    return [v.reshape(rows, columns, 3) for v in wide], full[:-1]


def lambert(incident: Floats, scattered: Floats, normal: Floats, albedo: float) -> Floats:
    """Scattering cross-section per unit area and solid angle (...) in 1/sr by Lambert's law: albedo/pi cos_i cos_s."""
    inward, outward = np.maximum(-dot(incident, normal), 0.0), np.maximum(dot(scattered, normal), 0.0)
    return np.asarray(albedo / np.pi * inward * outward)
