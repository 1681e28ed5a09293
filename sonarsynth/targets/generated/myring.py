"""The Myring hull: meridian of a streamlined body of revolution.

Myring (1976), "A theoretical study of body drag in subcritical axisymmetric flow", Aeronautical Quarterly 27, 186; in
the parameters of Prestero (2001), MIT, equations 2.1 and 2.2.
"""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.targets.generated.revolution import Arc, line
from sonarsynth.targets.shapes import Myring


def hull_length(hull: Myring) -> float:
    """Length (m) of the hull without the tips that its offsets cut off."""
    return hull.nose - hull.nose_offset + hull.middle + hull.tail - hull.tail_offset


def _tail(hull: Myring, x: Floats) -> Floats:
    """Radius at x behind the middle: d/2 - (3 d/(2 c^2) - tan/c) x^2 + (d/c^3 - tan/c^2) x^3, by factors of 1 - x/c."""
    forward = x / hull.tail
    u = 1.0 - forward
    return np.asarray(
        u * (0.5 * hull.diameter * u * (1.0 + 2.0 * forward) + hull.tail * np.tan(hull.tail_angle) * forward**2)
    )


def hull_meridian(hull: Myring) -> list[Arc]:
    """The meridian from nose to tail, centred: flat ends where tips are cut off, nose, middle, tail."""
    half = 0.5 * hull_length(hull)
    shoulder = half - hull.nose + hull.nose_offset  # x where the middle begins
    hip = shoulder - hull.middle
    t_tip = 1.0 - hull.nose_offset / hull.nose  # t at the foremost point

    def nose(u: Floats) -> tuple[Floats, Floats]:
        # t = cos(angle) keeps every digit of the radius of a pointed and of a blunt nose.
        angle = np.arccos(t_tip) + u * (0.5 * np.pi - np.arccos(t_tip))
        return shoulder + hull.nose * np.cos(angle), 0.5 * hull.diameter * np.sin(angle) ** (2.0 / hull.exponent)

    def tail(u: Floats) -> tuple[Floats, Floats]:
        x = u * (hull.tail - hull.tail_offset)
        return hip - x, _tail(hull, x)

    # A blunt nose (large exponent) is steep at its tip: sample it evenly in radius as well.
    even = np.linspace(0.0, 1.0, 2049)
    first = np.arccos(t_tip)
    radius = np.linspace(np.sin(first) ** (2.0 / hull.exponent), 1.0, 2049)
    by_radius = (np.arcsin(radius ** (0.5 * hull.exponent)) - first) / (0.5 * np.pi - first)
    arcs = [Arc(nose, np.unique(np.clip(np.concatenate([even, by_radius]), 0.0, 1.0)))]
    if hull.nose_offset > 0:
        arcs.insert(0, line((half, 0.0), (half, float(nose(np.zeros(1))[1][0]))))
    if hull.middle > 0:
        arcs.append(line((shoulder, 0.5 * hull.diameter), (hip, 0.5 * hull.diameter)))
    arcs.append(Arc(tail, even))
    if hull.tail_offset > 0:
        arcs.append(line((-half, float(_tail(hull, np.array(hull.tail - hull.tail_offset)))), (-half, 0.0)))
    return arcs
