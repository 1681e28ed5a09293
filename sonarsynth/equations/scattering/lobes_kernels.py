"""The lobes of `lobes`, compiled: many directions a facet. Between both kernels NumPy takes all exponentials."""

from __future__ import annotations

import math

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats

INTO = 1e100
"""Square of the tangent of a tilt that is taken for more: where the half vector points into the surface."""


@compiled(borrows=True)
def tilts(incident: Floats, scattered: Floats, normal: Floats, out: Floats) -> None:
    """tan^2 of the tilt of the half vector, of unit vectors (row, column, xyz) into out (row, column); what is across
    the normal is taken without cancellation."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            a, b, n = incident[i, j], scattered[i, j], normal[i, j]
            hx, hy, hz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
            up = hx * n[0] + hy * n[1] + hz * n[2]
            ax, ay, az = hx - up * n[0], hy - up * n[1], hz - up * n[2]
            out[i, j] = min((ax * ax + ay * ay + az * az) / (up * up), INTO) if up > 0.0 else INTO


@compiled(borrows=True)
def amplitudes(
    incident: Floats, scattered: Floats, normal: Floats, area: Floats, lobe: Floats, share: float, floor: float,
    beyond: bool, out: Floats,
) -> None:  # fmt: skip
    """sqrt(area |share lobe + floor cos cos|) where lit and seen, or `beyond` that lit alone, of vectors (row, column,
    xyz) into out (row, column)."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            a, b, n = incident[i, j], scattered[i, j], normal[i, j]
            inward = -(a[0] * n[0] + a[1] * n[1] + a[2] * n[2])
            outward = b[0] * n[0] + b[1] * n[1] + b[2] * n[2]
            power = share * lobe[i, j] + floor * inward * outward
            seen = inward > 0.0 and (outward > 0.0 or beyond)
            out[i, j] = math.sqrt(area[i, j] * abs(power) if seen else 0.0)
