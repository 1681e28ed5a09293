"""Plane waves that together make noise of a given intensity by elevation: as a quadrature, or drawn at random."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np
from scipy.special import roots_legendre

from sonarsynth.conventions import Floats

Intensity = Callable[[Floats], Floats]
"""Power per solid angle (...) at sines of the elevation (...)."""

INVERSE = 4096
"""Nodes of a stretch of elevations, of the integral of which directions are drawn from."""


def quadrature(
    intensity: Intensity, edges: Sequence[float], degree: float, half: bool = False
) -> tuple[Floats, Floats]:
    """Directions (node, xyz) and weights (node,), of sum 1, over the sphere.

    Exact for exp(i k d.u) up to k d = degree (rad): Gauss and Legendre in the sine of the elevation, in each stretch
    between edges, and evenly in azimuth, as many as the circle of that elevation needs. half: of azimuths from 0 to pi
    alone, for what is alike in the others.
    """
    sines, powers = [], []
    for low, high in itertools.pairwise(edges):
        radius = 0.5 * (high - low)
        node, weight = roots_legendre(int(np.ceil(0.5 * degree * radius + 3.0 * (degree * radius) ** 0.33)) + 6)
        sine = 0.5 * (high + low) + radius * node
        sines.append(sine)
        powers.append(radius * weight * intensity(sine))
    sine, power = np.concatenate(sines), np.concatenate(powers)
    cosine = np.sqrt(np.maximum(1.0 - sine**2, 0.0))
    around = np.ceil(0.5 * degree * cosine + 3.0 * (degree * cosine) ** 0.33).astype(int) + 4
    azimuths = around if half else 2 * around
    ring = np.repeat(np.arange(sine.size), azimuths)
    first = np.cumsum(azimuths) - azimuths
    azimuth = np.pi * (np.arange(ring.size) - first[ring] + 0.5) / around[ring]
    toward = np.stack([cosine[ring] * np.cos(azimuth), cosine[ring] * np.sin(azimuth), sine[ring]], axis=1)
    return toward, (power / azimuths)[ring] / power.sum()


def drawn(intensity: Intensity, edges: Sequence[float], even: Floats) -> Floats:
    """Directions (..., xyz) that come as often as the intensity is; even (..., 2): random, evenly in 0 to 1."""
    stretches = list(itertools.pairwise(edges))
    sine = np.concatenate([np.linspace(low, high, INVERSE) for low, high in stretches])
    middle, step = 0.5 * (sine[1:] + sine[:-1]), np.diff(sine)
    power = np.where(step > 0.0, intensity(middle) * step, 0.0)
    up = np.interp(even[..., 0], np.append(0.0, np.cumsum(power)) / power.sum(), sine)
    across, azimuth = np.sqrt(np.maximum(1.0 - up**2, 0.0)), 2.0 * np.pi * even[..., 1]
    return np.stack([across * np.cos(azimuth), across * np.sin(azimuth), up], axis=-1)
