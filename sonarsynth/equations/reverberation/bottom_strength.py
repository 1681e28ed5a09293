"""Scattering strength of the bottom: cross-section per m2 and sr, for any two directions.

Directions are sines of grazing angles in and out and the cosine of the azimuth between them, 1 forward. All laws are
reciprocal: in and out may be swapped.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np
from scipy.special import gamma

from sonarsynth.conventions import Floats
from sonarsynth.equations.water.boundary_reflection import SEDIMENTS, rayleigh

EXPONENT: Final = 3.25
"""Of the spectrum of roughness: it falls as wavenumber^-3.25."""
GRAIN_SIZE: Final = MappingProxyType(
    {
        "sandy gravel": -1.0,
        "very coarse sand": -0.5,
        "muddy sandy gravel": 0.0,
        "coarse sand": 0.5,
        "gravelly muddy sand": 1.0,
        "medium sand": 1.5,
        "muddy gravel": 2.0,
        "fine sand": 2.5,
        "muddy sand": 3.0,
        "very fine sand": 3.5,
        "clayey sand": 4.0,
        "coarse silt": 4.5,
        "sandy silt": 5.0,
        "medium silt": 5.5,
        "sandy mud": 6.0,
        "fine silt": 6.5,
        "sandy clay": 7.0,
        "very fine silt": 7.5,
        "silty clay": 8.0,
        "clay": 9.0,
    }
)
"""Mean grain size, phi = -log2 of mm. Rock and pebbles are left out: the law would give back more than arrives."""


class Angles(NamedTuple):
    """Directions (...) of sound that a boundary scatters."""

    sine_in: Floats  # of the grazing angle
    sine_out: Floats
    forward: Floats  # cosine of the azimuth between the directions of travel: 1 forward, -1 back

    @property
    def level(self) -> Floats:
        """Product (...) of the horizontal parts of the directions, ci cs cos phi."""
        cosines = np.sqrt(np.maximum((1.0 - self.sine_in**2) * (1.0 - self.sine_out**2), 0.0))
        return np.asarray(cosines * self.forward)

    @property
    def half(self) -> tuple[Floats, Floats]:
        """Horizontal part (...), squared, and vertical part (...) of half the change of the unit wave vector."""
        level = (1.0 - self.sine_in**2) - 2.0 * self.level + (1.0 - self.sine_out**2)
        return 0.25 * np.maximum(level, 0.0), 0.5 * (self.sine_in + self.sine_out)


class Roughness(NamedTuple):
    """How rough a sediment is, and how much its volume scatters."""

    spectral_strength: float  # cm4: of the spectrum of heights at 1/cm
    volume: float  # volume cross-section over the attenuation coefficient


def sediment_roughness(name: str) -> Roughness:
    """Of a named sediment, by its grain size. Source: APL-UW TR 9407 (1994), section IV, table 2."""
    size = GRAIN_SIZE[name]
    height = (2.03846 - 0.26923 * size) / (1.0 + 0.076923 * size) if size < 5.0 else 0.5  # cm, over 1 m
    return Roughness(0.00207 * height**2, 0.002 if size < 5.5 else 0.001)


def lambert(angles: Angles, mu: float) -> Floats:
    """Lambert's law, mu sin q_i sin q_s (...) in 1/sr."""
    return np.asarray(mu * angles.sine_in * angles.sine_out)


def sediment(angles: Angles, wavenumber: float, name: str) -> Floats:
    """Scattering strength (...) in 1/sr of a named sediment at a wavenumber (rad/m): roughness by Kirchhoff's
    approximation near the mirror direction and by perturbation elsewhere, and the volume of the sediment.

    Source: APL-UW TR 9407 (1994), section IV, after Jackson, Winebrenner and Ishimaru (1986), JASA 79, 1410; bistatic
    after Williams and Jackson (1998), JASA 103, 169.
    """
    density, speed, loss = SEDIMENTS[name]
    rough, k = sediment_roughness(name), 0.01 * wavenumber  # rad/cm
    level, upright = angles.half
    kirchhoff = _kirchhoff(level, upright, k, rough.spectral_strength, (density, speed, loss))
    ways = [np.clip(sine, 0.0, 1.0) for sine in (angles.sine_in, angles.sine_out)]
    passes = [1.0 + rayleigh(np.arcsin(sine), density, speed, loss) for sine in ways]
    index = (1.0 - 1j * loss) / speed
    inner = [np.sqrt(index**2 - 1.0 + sine**2) for sine in ways]
    inner = [np.where(p.imag > 0.0, -p, p) for p in inner]
    both = np.abs(passes[0] * passes[1]) ** 2
    change = (1.0 / density - 1.0) * (angles.level - inner[0] * inner[1] / density) + 1.0 - index**2 / density
    spectrum = rough.spectral_strength / (2.0 * (np.sqrt(level) + 1e-4)) ** EXPONENT  # times k to the EXPONENT
    perturbed = 0.25 * k ** (4.0 - EXPONENT) * both * np.abs(change) ** 2 * spectrum
    faded = np.abs((inner[0] + inner[1]).imag) / 2.0
    volume = 5.0 * loss * rough.volume / (speed * np.log(10.0)) * both / (density**2 * np.maximum(faded, 1e-12))
    with np.errstate(divide="ignore"):
        surface = 1.0 / np.hypot(1.0 / kirchhoff, 1.0 / perturbed)
    return np.asarray(surface + volume)


def _kirchhoff(level: Floats, upright: Floats, k: float, strength: float, bottom: tuple[float, float, float]) -> Floats:
    """The Kirchhoff approximation (...) for a power-law surface, as a closed form; k in rad/cm, strength in cm4."""
    a = 0.5 * EXPONENT - 1.0
    ratio = 8.0 * a**2 * gamma(0.5 / a + 0.5) / (gamma(0.5) * gamma(1.0 / a) * gamma(0.5 / a))
    wide = ratio ** (2.0 * a)
    b = wide ** (0.5 + 0.5 / a) * gamma(1.0 / a) / (2.0 * a)
    structure = 2.0 * np.pi * strength * gamma(2.0 - a) * 2.0 ** (-2.0 * a) / (a * (1.0 - a) * gamma(1.0 + a))
    q = structure * 2.0 ** (1.0 - 2.0 * a) * k ** (2.0 * (1.0 - a))
    total = level + upright**2
    mirrored = np.abs(rayleigh(np.arcsin(np.sqrt(np.minimum(total, 1.0))), *bottom)) ** 2
    below = (level ** (2.0 * a) + wide * q**2 * upright**4) ** ((1.0 + a) / (2.0 * a))
    shape = np.divide(total**2 * (1.0 + 100.0 * level**2), below, out=np.zeros_like(total), where=below > 0.0)
    return np.asarray(mirrored / (8.0 * np.pi) * b * q * shape)
