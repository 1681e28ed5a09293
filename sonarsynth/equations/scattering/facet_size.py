"""How fine a mesh of flat facets must be to scatter like the curved surface that it stands for."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats

FIVE_PERCENT = 0.05  # 0.4 dB


def kirchhoff_error(edge: npt.ArrayLike, wavelength: npt.ArrayLike, radius: npt.ArrayLike) -> Floats:
    """Relative error of the complex echo of flat facets of mean edge L (m) on a surface curved with `radius` a (m).

    (pi/2) L^2/(lambda a): the two-way phase 2 k L^2/(8 a) of the sagitta. Against the exact Kirchhoff integral over a
    sphere it holds within a factor 2; it is of second order in L, and a flat surface (a infinite) has none.
    """
    length, lam, a = (np.asarray(x, float) for x in (edge, wavelength, radius))
    return np.asarray(0.5 * np.pi * (length / lam) * (length / a))


def kirchhoff_edge(wavelength: npt.ArrayLike, radius: npt.ArrayLike, error: float = FIVE_PERCENT) -> Floats:
    """Longest edge (m) for a relative `error`: sqrt(2 error lambda a/pi), 0.18 sqrt(lambda a) for 5 %.

    Across each principal direction with the radius of curvature (m) of that direction; infinite along a flat one.
    """
    lam, a = np.asarray(wavelength, float), np.asarray(radius, float)
    return np.asarray(np.sqrt(2.0 * error / np.pi) * np.sqrt(lam) * np.sqrt(a))
