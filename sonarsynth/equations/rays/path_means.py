"""Means over the depths that straight rays pass, of what depends on depth alone: absorption."""

from __future__ import annotations

import math

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats, Ints

LEVEL = 1e-4
"""m: over less depth a ray has the value where it starts."""


@compiled(borrows=True)
def _above(z: float, value: Floats, integral: Floats, step: float) -> float:
    """Integral of a value over depth from the surface to z (m), in water mirrored at surface and bottom; up to each of
    the even nodes it is `integral`, and the value is linear between them."""
    bottom = step * (len(value) - 1)
    layer = math.floor(z / bottom)
    down = layer % 2 == 0
    inside = z - bottom * layer if down else bottom * (layer + 1) - z
    cell = min(max(int(inside / step), 0), len(value) - 2)
    into = inside - step * cell
    part = integral[cell] + into * (value[cell] + 0.5 * into * (value[cell + 1] - value[cell]) / step)
    return float(layer * integral[-1] + (part if down else integral[-1] - part))


@compiled(borrows=True)
def straight_means(
    start: Floats, end: Floats, climb: Floats, bounces: Ints, value: Floats, integral: Floats, step: float, out: Floats
) -> None:
    """Write the mean (ray,) along straight rays from depths start to end (ray,) m; climb (ray,): upward component of
    the unit vector in which each leaves; bounces (ray,): how often it is reflected, at bottom and surface in turn: in
    water that is mirrored at both it goes straight on. value, integral (node,): at depths in even steps (m)."""
    bottom = step * (len(value) - 1)
    for r in range(len(out)):
        n, z = bounces[r], start[r]
        mirrored = bottom * ((n if climb[r] < 0.0 else -n) + n % 2) + (1 - 2 * (n % 2)) * end[r]
        deep = mirrored - z
        if abs(deep) < LEVEL:
            cell = min(max(int(z / step), 0), len(value) - 2)
            out[r] = value[cell] + (z / step - cell) * (value[cell + 1] - value[cell])
        else:
            out[r] = (_above(mirrored, value, integral, step) - _above(z, value, integral, step)) / deep
