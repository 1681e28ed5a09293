"""Where a law of scattering holds: what it makes of a sphere as wide as the body, against the exact series."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Final, Literal, NamedTuple

import numpy as np

from sonarsynth.conventions import Floats, direction
from sonarsynth.equations.scattering.lobes import slope_lobe
from sonarsynth.equations.scattering.modal_series import sphere_amplitude
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.surfaces import longest_edge

OFF: Final = 2.2
"""dB that a law may be off a sphere at some frequency of the band without a word: it is less from ka = 4 on, by every
law, and 0.5 dB from 20 on."""
LARGE: Final = 30.0
"""ka from which on all laws are within 0.3 dB of a sphere at backscatter."""
ASIDE: Final = np.deg2rad(120.0)
"""Angle off backscatter beyond which echoes are part of the wave that makes the shadow, which no law here has."""
NEAR: Final = 4.0
"""Distances, over the radius of the aperture, under which facets should be finer (measured: 2 to 5 % at 2.3)."""
COARSE: Final = 0.1
"""Facets longer than this (m) are noted: range errors of points are a few centimetres."""
KL, CURVED = 6.0, 2.76
"""A rough surface of correlation length l and rms height h scatters by its slopes where k l > KL and l^2 > CURVED h
wavelength: Ulaby, Moore and Fung (1982), Microwave Remote Sensing II, section 12-4."""


class Scatterer(NamedTuple):
    """A body in a band, as laws are asked about it."""

    mesh: Mesh
    shortest: float  # m: wavelengths in the band
    longest: float
    distance: float = np.inf  # m: from the array, at the nearest
    aperture: float = 0.0  # m: radius of the array
    angle: float = 0.0  # rad: off backscatter, at the most; pi: between snap and array

    @property
    def width(self) -> float:
        """m: the middle one of its lengths along the axes of its frame, for plates may be thin, and rods long."""
        return float(np.sort(self.mesh.box[1] - self.mesh.box[0])[1])

    @property
    def ka(self) -> tuple[float, float]:
        """Wavenumber times half the width, at the ends of the band."""
        return np.pi * self.width / self.longest, np.pi * self.width / self.shortest


Amplitude = Callable[[Floats], Floats]
"""|f|/a of a sphere of radius a that reflects all, seen at backscatter, at products ka: as a law has it."""


def sphere_errors(amplitude: Amplitude, boundary: Literal["rigid", "soft"], ka: Floats) -> Floats:
    """Error (dB) of a law at backscatter of a sphere at products ka, by the exact series; positive: too loud."""
    exact = np.abs(sphere_amplitude(ka / (2.0 * np.pi), np.pi, radius=1.0, sound_speed=1.0, boundary=boundary))
    return np.asarray(20.0 * np.log10(amplitude(ka) / exact))


def size_note(
    body: Scatterer, amplitude: Amplitude, law: str = "this law", boundary: Literal["rigid", "soft"] = "rigid"
) -> str | None:
    """One line if a sphere as wide as the body is off by more than `OFF` somewhere in the band; None if not."""
    low, high = body.ka
    if not len(body.mesh.faces) or low >= LARGE:
        return None
    errors = sphere_errors(amplitude, boundary, np.geomspace(low, max(min(high, LARGE), low), 64))
    if not np.abs(errors).max() > OFF:
        return None
    return (
        f"{body.width:.3g} m across is ka {low:.2g} to {high:.2g} in the band: too small for facets that scatter as "
        f"mirrors; of a {boundary} sphere as wide {law} is {errors.min():+.1f} to {errors.max():+.1f} dB off"
    )


def geometric(ka: Floats) -> Floats:
    """As `Amplitude`: that of geometry, at every ka."""
    return np.full_like(ka, 0.5)


def lit_half(ka: Floats) -> Floats:
    """As `Amplitude`: Kirchhoff's integral over the lit half, |x/2 (j0(x) + i j1(x))|."""
    from scipy.special import spherical_jn

    return np.asarray(0.5 * ka * np.abs(spherical_jn(0, ka) + 1j * spherical_jn(1, ka)))


def aside_note(body: Scatterer) -> str | None:
    """One line if the body is seen too far off backscatter; None if not."""
    if body.angle <= ASIDE:
        return None
    return (
        f"seen up to {np.rad2deg(body.angle):.0f} degrees off backscatter: beyond 120 the shadow-forming wave "
        "adds to the echo, which this law leaves out (2.5 dB for a sphere at 120)"
    )


def facets_note(body: Scatterer) -> str | None:
    """One line if facets, each echoing from its middle, are longer than `COARSE`; None if not."""
    edge = longest_edge((body.mesh.vertices, body.mesh.faces))
    if not edge > COARSE:
        return None
    return (
        f"facets up to {edge:.2g} m long ({edge / body.shortest:.2g} wavelengths at the top of the band), each "
        "scattering from its centre: set shape.edge to refine"
    )


def slopes_note(height: float, slope: float, body: Scatterer) -> str | None:
    """One line if a surface of rms height (m) and slope per axis is not one that scatters by its slopes; or None.

    With Gaussian correlations their length is sqrt(2) height/slope.
    """
    if not height > 0.0:
        return None
    length = np.sqrt(2.0) * height / slope
    kl, curved = 2.0 * np.pi * length / body.longest, length**2 / (height * body.longest)
    if kl > KL and curved > CURVED:
        return None
    return (
        f"heights of {1e3 * height:.3g} mm with slopes of {slope:.2g} are {1e3 * length:.2g} mm wide (k l = {kl:.2g} "
        f"at the bottom of the band): a lobe of slopes is right for k l > {KL:g} and l^2 > {CURVED:g} h wavelength"
    )


@lru_cache(maxsize=64)
def returned(slope: float, incidence: float) -> float:
    """Share of the power that the lobe of an rms slope sends back, of what arrives at an angle (rad) off the normal."""
    azimuth, elevation = np.deg2rad(np.arange(0.5, 360.0)), np.deg2rad(np.arange(0.125, 90.0, 0.25))
    away = direction(azimuth[None, :], elevation[:, None])
    incident = np.array([np.sin(incidence), 0.0, -np.cos(incidence)])
    lobe = slope_lobe(np.broadcast_to(incident, away.shape), away, np.array([0.0, 0.0, 1.0]), slope)
    ring = np.cos(elevation)[:, None] * np.deg2rad(1.0) * np.deg2rad(0.25)
    return float((lobe * ring).sum() / np.cos(incidence))


def grazing_note(slope: float) -> str | None:
    """One line if a lobe is so wide that it gives back more than a tenth too much at 75 degrees incidence; or None."""
    share = returned(slope, float(np.deg2rad(75.0)))
    if not share > 1.1:
        return None
    return f"a lobe so wide returns {share:.2f} of the power that arrives 75 degrees off the normal: it has no shadows"
