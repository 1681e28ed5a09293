"""Reflection at surface and bottom, by the textbook's formulas for each."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.environment.boundaries import (
    FluidHalfSpace,
    PressureRelease,
    ReflectionTable,
    Rigid,
    SeaBottom,
    SeaSurface,
)
from sonarsynth.environment.sea import Environment
from sonarsynth.equations.water.boundary_reflection import SEDIMENTS
from sonarsynth.validation.references.rays.layered_rays import Family
from sonarsynth.validation.references.rays.layers_crossed import Water

GRAVITY, PHILLIPS, DECAY = 9.81, 8.1e-3, 0.74


def reflected(
    environment: Environment, water: Water, family: Family, cosine: Floats, frequency: float
) -> tuple[np.ndarray, Floats]:
    """Coefficient (ray,) of all reflections of a family, complex, in time dependence exp(+i 2 pi f t), and the
    variance (ray,) in s2 of the delays that rough boundaries give.

    cosine (ray,) s/m: cosine of the grazing angle over the sound speed; frequency (Hz) at which bubbles take their
    loss. Heights h at the grazing angle q leave exp(-(2 k h sin q)^2/2) (Eckart 1953).
    """
    total, variance = np.ones(len(cosine), complex), np.zeros(len(cosine))
    for boundary, depth, count in (
        (environment.surface, 0.0, family.bounces - family.bottom),
        (environment.bottom, water.bottom, family.bottom),
    ):
        if count:
            c = float(water.at(np.asarray(depth)))
            sine = np.sqrt(np.maximum(1.0 - (cosine * c) ** 2, 0.0))
            total *= _coefficient(boundary, sine, frequency) ** count
            variance += count * (2.0 * _height(boundary) * sine / c) ** 2
    return total, variance


def _height(boundary: SeaSurface | SeaBottom) -> float:
    """Rms height (m): as written, or of a sea that the wind has raised (Pierson and Moskowitz 1964)."""
    if isinstance(boundary, SeaSurface) and boundary.wind_speed is not None:
        return float(boundary.wind_speed**2 / (2.0 * GRAVITY) * np.sqrt(PHILLIPS / DECAY))
    return boundary.rms_height


def _coefficient(boundary: SeaSurface | SeaBottom, sine: Floats, frequency: float) -> np.ndarray:
    value = _smooth(boundary, sine)
    if isinstance(boundary, SeaSurface) and boundary.bubbles and boundary.wind_speed is not None:
        u = boundary.wind_speed  # APL-UW TR 9407 (1994), II-21
        loss = 1.26e-3 * max(u, 6.0) ** 1.57 * (frequency / 1e3) ** 0.85 * np.exp(1.2 * min(u - 6.0, 0.0))
        value = value * 10.0 ** (-loss / np.maximum(sine, 1e-300) / 20.0)
    return value


def _smooth(boundary: SeaSurface | SeaBottom, sine: Floats) -> np.ndarray:
    """Plane-wave coefficient at grazing angles of these sines."""
    of = boundary.reflection
    if isinstance(of, PressureRelease):
        return np.full(len(sine), -1.0 + 0j)
    if isinstance(of, Rigid):
        return np.full(len(sine), 1.0 + 0j)
    if isinstance(of, ReflectionTable):
        angle = np.arcsin(sine)
        if of.modulus is not None:
            size = np.interp(angle, of.grazing, of.modulus)
        else:
            size = 10.0 ** (-np.interp(angle, of.grazing, of.loss or ()) / 20.0)
        return np.asarray(size * np.exp(1j * np.interp(angle, of.grazing, of.phase)))
    ratio = (
        (of.density_ratio, of.speed_ratio, of.loss_tangent) if isinstance(of, FluidHalfSpace) else SEDIMENTS[of.name]
    )
    m, speed, loss_tangent = ratio  # Brekhovskikh and Lysanov (2003), section 3.1
    below = np.emath.sqrt(((1.0 - 1j * loss_tangent) / speed) ** 2 - (1.0 - sine**2))
    below = np.where(below.imag > 0.0, -below, below)
    return np.asarray((m * sine - below) / (m * sine + below))
