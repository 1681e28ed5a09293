"""East and north on the plane that touches the ellipsoid at an origin, from latitudes and longitudes."""

from __future__ import annotations

from typing import Final

import numpy as np

from sonarsynth.conventions import Floats

EQUATOR: Final = 6_378_137.0
"""m: semi-major axis of WGS 84."""
ECCENTRICITY_SQUARED: Final = 6.694_379_990_14e-3
FARTHEST: Final = 100e3
"""m from the origin: there the plane is 4 m short, and the sea, which is level here, curves 785 m away from it."""


def east_north(latitude: Floats, longitude: Floats, origin: tuple[float, float]) -> Floats:
    """Metres (point, 2) east and north of an origin (latitude, longitude); all in rad, on the ellipsoid of WGS 84.

    Exact on the tangent plane; distances along the ground are longer by d^3/(6 R^2): 4 mm at 10 km. Source: Torge and
    Mueller (2012), Geodesy, 4th ed., sections 4.1 (ellipsoid) and 4.3 (local axes).
    """
    phi, lam = np.asarray(latitude, float), np.asarray(longitude, float)
    point, centre = (_from_centre(np.asarray(a), np.asarray(b)) for a, b in ((phi, lam), origin))
    away = point - centre
    (sp, cp), (sl, cl) = ((np.sin(angle), np.cos(angle)) for angle in origin)
    east = away @ np.array([-sl, cl, 0.0])
    north = away @ np.array([-sp * cl, -sp * sl, cp])
    return np.stack([east, north], axis=-1)


def _from_centre(phi: Floats, lam: Floats) -> Floats:
    """Places (..., 3) m from the centre of the Earth, on the ellipsoid."""
    across = EQUATOR / np.sqrt(1.0 - ECCENTRICITY_SQUARED * np.sin(phi) ** 2)  # radius of curvature, prime vertical
    flat = across * np.cos(phi)
    return np.stack(
        [flat * np.cos(lam), flat * np.sin(lam), (1.0 - ECCENTRICITY_SQUARED) * across * np.sin(phi)], axis=-1
    )
