"""Levels of bodies over frequency and angle, of facets and exact: what the pictures of the references show."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.scattering.kirchhoff_integral import rectangular_plate
from sonarsynth.pictures.accuracy_figures.bodies_figure import Curve, Panel
from sonarsynth.scattering import Kirchhoff
from sonarsynth.validation.bodies import cylinder, plate, sphere
from sonarsynth.validation.bodies.body_cases import SOUND_SPEED, decibels, wavenumber
from sonarsynth.validation.bodies.cylinder import lit_cylinder

MIDDLE = 50e3  # Hz: where levels are drawn over angle
STRENGTH = "target strength (dB re 1 m2)"
KHZ = "frequency (kHz)"


def _band(step: float) -> Floats:
    return np.arange(25e3, 110.1e3, step)


def sphere_panels() -> tuple[Panel, Panel]:
    """Backscatter over frequency, and the bistatic angle all round, of a rigid and of a soft sphere."""
    radius = sphere.RADII[0]
    f, geometric = _band(250.0), 20.0 * np.log10(0.5 * radius)
    y, fair = "target strength less 20 log10(a/2) (dB)", (-sphere.FAIR, sphere.FAIR)
    back = _sphere_curves(radius, f, np.zeros(1), f / 1e3, geometric)
    over_frequency = Panel(
        f"spheres of {radius:g} m, backscatter; grey: {sphere.FAIR:g} dB", KHZ, y, back, -0.4, 0.4, bounds=fair
    )
    off = np.append(np.arange(0.0, 120.0, 2.0), np.arange(120.0, 180.1, 0.5))
    round_it = _sphere_curves(radius, np.array([MIDDLE]), off, off, 0.0)
    title = f"spheres of {radius:g} m at {MIDDLE / 1e3:g} kHz"
    return over_frequency, Panel(title, "angle off backscatter (deg)", STRENGTH, round_it, -30.0, 20.0, 120.0)


def _sphere_curves(radius: float, f: Floats, off: Floats, x: Floats, less: float) -> tuple[Curve, ...]:
    """Levels (dB) less a constant over frequency (Hz) or over the angle off backscatter (deg)."""
    curves = []
    surfaces: tuple[sphere.Surface, ...] = ("rigid", "soft")
    for i, surface in enumerate(surfaces):
        exact = sphere.sphere_level(f, off, radius, surface).ravel() - less
        facets = sphere.facet_level(f, off, radius, Kirchhoff(surface=surface)).ravel() - less
        curves.append(Curve(f"{surface}, series", x, exact, "exact", i))
        curves.append(Curve(f"{surface}, facets", x, facets, "facets", i))
    tapered = sphere.facet_level(f, off, radius, Kirchhoff(edges="smooth")).ravel() - less
    return (*curves, Curve("tapered echo, as in frames", x, tapered, "other", 2))


def cylinder_panels() -> tuple[Panel, Panel]:
    """Broadside over frequency, and over the aspect from end-on to broadside."""
    f, broadside = _band(500.0), np.array([90.0])
    curves = []
    for i, (radius, length) in enumerate((cylinder.BODIES[0], cylinder.BODIES[-1])):
        geometric = 10.0 * np.log10(0.5 * radius * length**2 * f / SOUND_SPEED)
        exact = cylinder.series_level(f, broadside, radius, length)[:, 0] - geometric
        facets = cylinder.facet_level(f, broadside, radius, length)[:, 0] - geometric
        name = f"{radius:g} by {length:g} m"
        curves.append(Curve(f"{name}, series", f / 1e3, exact, "exact", i))
        curves.append(Curve(f"{name}, facets", f / 1e3, facets, "facets", i))
    title = f"rigid cylinders, broadside; grey: {cylinder.FAIR:g} dB"
    y, fair = "level less 10 log10(a L^2/2 wavelength) (dB)", (-cylinder.FAIR, cylinder.FAIR)
    over_frequency = Panel(title, KHZ, y, tuple(curves), -0.4, 0.4, bounds=fair)
    aspect, (radius, length) = np.arange(0.0, 90.01, 0.1), cylinder.BODIES[0]
    k = wavenumber(MIDDLE)
    integral = decibels(lit_cylinder(np.radians(aspect), k, radius, length))
    facets = cylinder.facet_level(np.array([MIDDLE]), aspect, radius, length)[0]
    series = cylinder.series_level(np.array([MIDDLE]), aspect, radius, length)[0]
    pictured = (
        Curve("integral, side and end", aspect, integral, "exact", 0),
        Curve("series, side only", aspect, series, "other", 0),
        Curve("facets", aspect, facets, "facets", 0),
    )
    title = f"cylinder of {radius:g} by {length:g} m at {MIDDLE / 1e3:g} kHz"
    return over_frequency, Panel(title, "aspect off the axis (deg)", STRENGTH, pictured, -60.0, 10.0)


def plate_panels() -> tuple[Panel, Panel]:
    """A wave that comes straight in: one way out over frequency, and one frequency over the way out."""
    f, aside, middle, off = _band(100.0), 40.0, np.array([MIDDLE]), np.arange(0.0, 90.01, 0.05)
    size = f"plate of {plate.SIDES[0]:g} by {plate.SIDES[1]:g} m"
    title = f"{size}, the wave straight in, out at {aside:g} degrees"
    over_frequency = Panel(title, KHZ, STRENGTH, _plate_curves(f, np.array([aside]), f / 1e3), -50.0, 30.0)
    title = f"{size}, the wave straight in at {MIDDLE / 1e3:g} kHz"
    way_out = "way out, off the normal (deg)"
    return over_frequency, Panel(title, way_out, STRENGTH, _plate_curves(middle, off, off), -50.0, 20.0)


def _plate_curves(f: Floats, off: Floats, x: Floats) -> tuple[Curve, ...]:
    """Levels (dB) over frequency (Hz) or over the way out, off the normal (deg)."""
    dots, (into, out) = plate.tiles(8), plate.fan_out(off)
    exact = rectangular_plate(plate.SIDES, into[:, None], out[:, None], wavenumber(f))
    return (
        Curve("closed form", x, decibels(exact).ravel(), "exact", 0),
        Curve(f"{len(dots)} points", x, decibels(plate.points_echo(dots, into, out, f)).ravel(), "other", 0),
        Curve("two facets", x, decibels(plate.echoes(plate.rectangle(), into, out, f)).ravel(), "facets", 0),
    )
