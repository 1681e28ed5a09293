"""Arrays of hydrophones: element directivity, and polynomials over the aperture."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats


def aperture_terms(position: npt.ArrayLike, aperture: float) -> Floats:
    """Polynomials up to the third degree over the aperture (..., term) at positions (..., xyz) in the sonar frame.

    Coordinates are divided by `aperture` (m). The basis is the 20 monomials of x, y, z: 1; x, y, z; xx, xy, xz, yy, yz,
    zz; xxx, xxy, xxz, xyy, xyz, xzz, yyy, yyz, yzz, zzz. On a planar array those with x vanish.
    """
    x, y, z = np.moveaxis(np.asarray(position, float) / aperture, -1, 0)
    one = np.ones_like(x)
    second = [x * x, x * y, x * z, y * y, y * z, z * z]
    third = [x * x * x, x * x * y, x * x * z, x * y * y, x * y * z, x * z * z, y * y * y, y * y * z, y * z * z, z * z * z]
    return np.stack([one, x, y, z, *second, *third], axis=-1)


def element_directivity(
    frequency: npt.ArrayLike, direction: npt.ArrayLike, face: float, sound_speed: float
) -> Floats:
    """Far-field response of a square face in the plane x = 0 to a plane wave from `direction` (..., xyz), sonar frame.

    The mean of the pressure over the face (side `face`, m): sinc(f w u_y / c) sinc(f w u_z / c), sinc x = sin(pi x)/(pi x);
    1 for a point. frequency (...) in Hz broadcasts against direction without its last axis.
    Source: any text on arrays, e.g. Van Trees (2002), Optimum Array Processing, section 2.6.
    """
    u = np.asarray(direction, float)
    scale = np.asarray(frequency, float) * (face / sound_speed)
    return np.asarray(np.sinc(scale * u[..., 1]) * np.sinc(scale * u[..., 2]))
