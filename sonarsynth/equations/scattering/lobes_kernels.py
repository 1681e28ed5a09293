"""The lobes of `lobes`, compiled: many directions a facet."""

from __future__ import annotations

import math

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats


@compiled(borrows=True)
def slope_lobe(incident: Floats, scattered: Floats, normal: Floats, slope: float) -> float:
    """Barrick's lobe sigma0 of three unit vectors (xyz); what is across the normal is taken without cancellation."""
    hx, hy, hz = scattered[0] - incident[0], scattered[1] - incident[1], scattered[2] - incident[2]
    up = hx * normal[0] + hy * normal[1] + hz * normal[2]
    ax, ay, az = hx - up * normal[0], hy - up * normal[1], hz - up * normal[2]
    square = (ax * ax + ay * ay + az * az) / (up * up)  # tan^2 of the tilt of the half vector
    if not (up > 0.0 and square < 1e100):
        return 0.0
    return float(math.exp(square * (-0.5 / slope**2)) * ((1.0 + square) ** 2 / (8.0 * math.pi * slope**2)))


@compiled(borrows=True)
def slope_lobes(incident: Floats, scattered: Floats, normal: Floats, slope: float, out: Floats) -> None:
    """`slope_lobe` of vectors (row, column, xyz) into out (row, column)."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = slope_lobe(incident[i, j], scattered[i, j], normal[i, j], slope)


@compiled(borrows=True)
def amplitudes(
    incident: Floats, scattered: Floats, normal: Floats, area: Floats, slope: float, share: float, albedo: float,
    beyond: bool, out: Floats,
) -> None:  # fmt: skip
    """sqrt(area |share sigma0 + albedo/pi cos cos|) where lit and seen, or `beyond` that lit alone, of vectors (row,
    column, xyz) into out."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            a, b, n = incident[i, j], scattered[i, j], normal[i, j]
            inward = -(a[0] * n[0] + a[1] * n[1] + a[2] * n[2])
            outward = b[0] * n[0] + b[1] * n[1] + b[2] * n[2]
            out[i, j] = 0.0
            if inward > 0.0 and (outward > 0.0 or beyond):
                power = share * slope_lobe(a, b, n, slope) + albedo / math.pi * inward * outward
                out[i, j] = math.sqrt(area[i, j] * abs(power))
