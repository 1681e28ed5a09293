"""Echoes of spheres of facets against the exact series and the exact Kirchhoff integral: error against run time.

Also the integral over one facet against many digits, and the law of partly reflecting surfaces against the exact series
of a fluid sphere.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from functools import cache
from itertools import pairwise
from typing import Final, Literal

import numpy as np

from sonarsynth.conventions import Complexes, Floats
from sonarsynth.equations.scattering.kirchhoff_integral import lit_sphere
from sonarsynth.equations.scattering.modal_series import Fluid, sphere_amplitude
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.scattering import Kirchhoff, PartlyReflecting
from sonarsynth.targets.mesh_resolution import CoarseMesh, expected_error, fine_mesh
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Sphere
from sonarsynth.targets.target_strength import target_strength
from sonarsynth.validation.bodies.body_cases import (
    BAND,
    LEVEL,
    PER_ASPECT,
    SOUND_SPEED,
    Point,
    decibels,
    measured,
    round_x,
    trade_rows,
    wavenumber,
    ways,
)
from sonarsynth.validation.bodies.facet_integral import triangle_rows
from sonarsynth.validation.run_time import timed
from sonarsynth.validation.validation_rows import Row

HIGHEST = 200e3  # Hz: the pulse is a Hann window of frequencies from 0 to this
WINDOW = 4e-3  # s: all echoes that matter come within this
FINER = 4
"""Samples over the fewest that hold the pulse."""


def front_echo(frequency: Floats, away: float, radius: float, fluid: Fluid, sound_speed: float) -> Complexes:
    """Far-field amplitude (frequency,) (m) of the outside alone at frequencies (Hz) well within 0 and `HIGHEST`.

    away: angle (rad) off backscatter. A short pulse's echo by the series, without what comes more than 0.6 radii of way
    before or after the mirror point's: echoes through the body (the first 4 a/c1 cos later) and waves round it.
    """
    f = np.arange(1, round(HIGHEST * WINDOW)) / WINDOW
    pulse = np.hanning(len(f) + 2)[1:-1]
    count = 2 * FINER * (len(f) + 1)
    spectrum = np.zeros(count // 2 + 1, complex)
    series = sphere_amplitude(f, np.pi - away, radius=radius, sound_speed=sound_speed, boundary=fluid)
    spectrum[1 : len(f) + 1] = pulse * series
    delay = np.arange(count) * (WINDOW / count)
    delay -= np.where(delay > 0.5 * WINDOW, WINDOW, 0.0)
    mirror = -2.0 * radius / sound_speed * np.cos(0.5 * away)
    near = np.abs(delay - mirror) < 0.6 * radius / sound_speed
    front = np.fft.rfft(np.fft.irfft(spectrum, count) * near)[1 : len(f) + 1] / pulse
    return np.asarray(np.interp(frequency, f, front.real) + 1j * np.interp(frequency, f, front.imag))


SERIES, INTEGRAL = "modal series", "Kirchhoff integral"
FRONT = "modal series, front echo"
RADII: Final = (0.25, 0.5)
WAYS = 12
FAIR = 0.3  # dB, at backscatter
AIM = 0.8  # dB, up to 105 degrees off it
SECTORS: Final = (0.0, 60.0, 105.0, 120.0)  # deg off backscatter
CLAIMED: Final = 2.6
"""dB: what `Kirchhoff` claims of spheres from 105 to 120 degrees."""
STEP: Final = 3.0  # deg: between angles that are checked

Surface = Literal["rigid", "soft"]

FILLING: Final = Fluid(1.8, 1.1)
"""Much as sand, over the water."""
INSIDE: Final = 12.0
"""dB: echoes from inside a lossless sphere of that filling, which focuses them, over that of its outside."""


def sphere_accuracy(quick: bool = False) -> list[Row]:
    """Errors and run times; quick: fewer meshes, ways and angles. Raises ModuleNotFoundError without mpmath."""
    radii = RADII[:1] if quick else RADII
    surfaces: tuple[Surface, ...] = ("rigid",) if quick else ("rigid", "soft")
    rows = [*triangle_rows(quick)]
    for radius in radii:
        rows += trade_rows(f"rigid sphere, {radius:g} m", INTEGRAL, sphere_points(radius, quick))
        rows += _levels(radius, quick)
    for radius in radii:
        for surface in surfaces:
            rows += [*_backscatter(radius, surface, quick), *_bistatic(radius, surface, quick)]
    rows += _partly_reflecting(RADII[0], quick)
    return rows


def sphere_points(radius: float, quick: bool) -> list[Point]:
    """Ever finer meshes of a rigid sphere: edges from 0.7 of sqrt(wavelength x radius) down, each 1/sqrt(2) of it."""
    exact = lit_sphere(radius, wavenumber(BAND))
    towards = ways(4 if quick else WAYS)
    return [measured(mesh, towards, exact) for mesh in _meshes(radius, quick)]


def _meshes(radius: float, quick: bool) -> list[Mesh]:
    first = 0.7 * np.sqrt(SOUND_SPEED / BAND[-1] * radius)
    edges = first * 2.0 ** (-0.5 * np.arange(1, 5) if quick else -0.5 * np.arange(0, 7))
    return [mesh_of(Sphere(radius=radius, edge=float(edge))) for edge in edges]


def _levels(radius: float, quick: bool) -> Iterator[Row]:
    """Backscatter of the same meshes as users get it, checks of the mesh and all, in dB."""
    case = f"rigid sphere, {radius:g} m, as a mesh"
    exact = sphere_level(BAND, np.zeros(1), radius, "rigid")
    towards = ways(2 if quick or radius > 0.3 else 4)
    meshes = _meshes(radius, quick)
    _mesh_level(meshes[0], towards)  # compiles
    for mesh in meshes:
        levels, cost = timed(lambda: _mesh_level(mesh, towards), calls=1)  # noqa: B023 -- called here
        expected = expected_error(mesh, SOUND_SPEED / BAND[-1])
        bound = FAIR + 20.0 * float(np.log10(1.0 + 2.0 * expected))
        error = float(np.abs(levels - exact).max())
        counts = {"facets": len(mesh.faces), "values": levels.size}
        yield Row(case, SERIES, LEVEL, "dB", bound, error, 1e3 * cost / len(towards), PER_ASPECT, counts, case)


def _mesh_level(mesh: Mesh, towards: Floats) -> Floats:
    """Level (frequency, way) in dB re 1 m2 of backscatter, however coarse the mesh."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CoarseMesh)
        return target_strength(mesh, BAND[:, None], -towards, towards, SOUND_SPEED)


def sphere_level(frequency: Floats, off: Floats, radius: float, surface: Surface | Fluid) -> Floats:
    """Exact target strength (frequency, angle) in dB re 1 m2 at angles off backscatter (deg)."""
    angle = np.pi - np.radians(off)
    series = sphere_amplitude(frequency[:, None], angle, radius=radius, sound_speed=SOUND_SPEED, boundary=surface)
    return decibels(series)


def facet_level(frequency: Floats, off: Floats, radius: float, law: Kirchhoff) -> Floats:
    """Target strength (frequency, angle) in dB re 1 m2 of facets, as users get it, at angles off backscatter (deg)."""
    out = -round_x(-off)
    return target_strength(Sphere(radius=radius), frequency[:, None], (1.0, 0.0, 0.0), out, SOUND_SPEED, law)


@cache
def _facets(radius: float) -> int:
    return len(fine_mesh(Sphere(radius=radius), SOUND_SPEED / BAND[-1]).faces)


def _backscatter(radius: float, surface: Surface, quick: bool) -> Iterator[Row]:
    """Levels of backscatter as users get them, all over the band, along the mesh's axis and others."""
    frequency = np.arange(25e3, 110.1e3, 5e3 if quick else 1e3 if radius < 0.3 else 2.5e3)
    towards = np.concatenate([[[-1.0, 0.0, 0.0]], ways(1 if quick or radius > 0.3 else 3)])
    body, law = Sphere(radius=radius), Kirchhoff(surface=surface)
    levels, cost = timed(
        lambda: target_strength(body, frequency[:, None], -towards, towards, SOUND_SPEED, law), calls=1
    )
    error = float(np.abs(levels - sphere_level(frequency, np.zeros(1), radius, surface)).max())
    columns = 1e3 * cost / len(towards), PER_ASPECT, {"facets": _facets(radius), "values": levels.size}
    yield Row(f"{surface} sphere, {radius:g} m", SERIES, "backscatter", "dB", FAIR, error, *columns)


def _bistatic(radius: float, surface: Surface, quick: bool) -> Iterator[Row]:
    """Levels as users get them, sector by sector: the largest error over each, every few degrees and at its ends."""
    frequency, law = BAND[::8] if quick else BAND, Kirchhoff(surface=surface)
    off = np.unique([*np.arange(0.0, SECTORS[-1], 30.0 if quick else STEP), *SECTORS])
    levels, cost = timed(lambda: facet_level(frequency, off, radius, law), calls=1)
    error = np.abs(levels - sphere_level(frequency, off, radius, surface)).max(axis=0)
    for first, end in pairwise(SECTORS):
        inside = (off >= first) & (off <= end)
        counts = {"facets": _facets(radius), "values": int(inside.sum()) * len(frequency)}
        columns = 1e3 * cost / len(off), PER_ASPECT, counts
        last = end == SECTORS[-1]
        bound, note = (CLAIMED, f"what Kirchhoff claims; {AIM:g} dB is aimed at") if last else (AIM, "")
        case, quantity = f"{surface} sphere, {radius:g} m", f"bistatic, {first:g} to {end:g} deg"
        yield Row(case, SERIES, quantity, "dB", bound, float(error[inside].max()), *columns, note=note)


def _partly_reflecting(radius: float, quick: bool) -> Iterator[Row]:
    """A surface that lets sound through: the front echo of a fluid sphere, and all its echoes in mean power."""
    case = f"fluid sphere, {radius:g} m"
    law = Kirchhoff(surface=PartlyReflecting(density_ratio=FILLING.density_ratio, speed_ratio=FILLING.speed_ratio))
    off = np.array([0.0, 60.0] if quick else [0.0, 30.0, 60.0])
    levels, cost = timed(lambda: facet_level(BAND, off, radius, law), calls=1)
    counts = {"facets": _facets(radius), "values": levels.size}
    front = np.array([front_echo(BAND, float(a), radius, FILLING, SOUND_SPEED) for a in np.radians(off)]).T
    error = float(np.abs(levels - decibels(front)).max())
    yield Row(case, FRONT, "front, 0 to 60 deg", "dB", FAIR, error, 1e3 * cost / len(off), PER_ASPECT, counts)
    exact = sphere_level(BAND, off, radius, FILLING)
    power = [10.0 * np.log10(np.mean(10.0 ** (level / 10.0), axis=0)) for level in (levels, exact)]
    left_out = float(np.abs(power[0] - power[1]).max())
    note = "echoes from inside, which the law leaves out: it is for bodies that swallow them"
    yield Row(case, SERIES, "left out", "dB", INSIDE, left_out, 1e3 * cost / len(off), PER_ASPECT, counts, note=note)
