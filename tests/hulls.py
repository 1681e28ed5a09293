"""The Myring hull as printed: Prestero (2001), MIT, equations 2.1 and 2.2."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats
from sonarsynth.targets.shapes import Myring


def hull_radius(hull: Myring, station: npt.ArrayLike) -> Floats:
    """Radius (m) of the hull at stations (m aft of the foremost point)."""
    ahead = (hull.nose - hull.nose_offset - np.asarray(station, float)) / hull.nose  # of the middle, in noses
    x = -hull.nose * ahead - hull.middle  # behind the middle
    c, d, slope = hull.tail, hull.diameter, np.tan(hull.tail_angle)
    nose = 0.5 * d * (1.0 - np.clip(ahead, 0.0, 1.0) ** 2) ** (1.0 / hull.exponent)
    tail = 0.5 * d - (1.5 * d / c**2 - slope / c) * x**2 + (d / c**3 - slope / c**2) * x**3
    return np.where(x > 0.0, tail, nose)
