"""Echoes of rigid cylinders of facets against the exact series and the exact Kirchhoff integral, over the run time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.special import j1, struve

from sonarsynth.conventions import Complexes, Floats
from sonarsynth.equations.scattering.kirchhoff_kernels import mesh_amplitude
from sonarsynth.equations.scattering.lobes import lit_and_seen
from sonarsynth.equations.scattering.modal_series import cylinder_amplitude
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.targets.mesh_resolution import fine_mesh
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Cylinder
from sonarsynth.targets.target_strength import target_strength
from sonarsynth.validation.bodies.body_cases import (
    BAND,
    PER_ASPECT,
    SOUND_SPEED,
    Point,
    backscatter,
    decibels,
    measured,
    round_x,
    trade_rows,
    wavenumber,
)
from sonarsynth.validation.run_time import timed
from sonarsynth.validation.validation_rows import Row


def lit_cylinder(aspect: npt.ArrayLike, wavenumber: npt.ArrayLike, radius: float, length: float) -> Complexes:
    """Far-field amplitude f (...) (m) of the lit side and the lit end, seen at an angle (rad) off the axis, 0 to pi/2.

    With x = 2 k a sin(aspect), over the side, (i k/2 pi) a sin(aspect) L sinc(k L cos(aspect)) times
    int_(-pi/2)^(pi/2) cos q exp(i x cos q) dq = 2 - pi H_1(x) + i pi J_1(x), H_1 Struve's function (Abramowitz and
    Stegun 1972, 12.1.7, and 9.1.21); over the end, the disc (i k/2 pi) cos(aspect) pi a^2 2 J_1(x)/x
    exp(i k L cos(aspect)). Wavenumber k (rad/m), radius a and length L (m); phases as in
    `equations.scattering.kirchhoff_integral`.
    """
    k, angle = np.asarray(wavenumber, float), np.asarray(aspect, float)
    along = k * length * np.cos(angle)
    x = np.maximum(2.0 * k * radius * np.sin(angle), 1e-150)
    disc = np.pi * radius**2 * np.cos(angle) * (2.0 * j1(x) / x) * np.exp(1j * along)
    around = 2.0 - np.pi * struve(1, x) + 1j * np.pi * j1(x)
    side = radius * np.sin(angle) * length * np.sinc(along / np.pi) * around
    return np.asarray(0.5j / np.pi * k * (side + disc))


SERIES, INTEGRAL = "modal series (Stanton)", "Kirchhoff integral"
BODIES: Final = ((0.1, 0.8), (0.1, 1.6), (0.25, 1.0))  # radius and length, m
FAIR = 0.3  # dB
SIDE = 0.1
"""Error of the side's echo off broadside, over its rms in the band: the lobes are those of the length, but at 45
degrees so thin a cylinder (k a sin 7) is not quite what Kirchhoff's integral says."""
ROUND = 0.1
"""Error of the whole body's echo from any side, over its rms in the band there: that may be 40 dB below broadside."""
ROLLS = 12


def cylinder_accuracy(quick: bool = False) -> list[Row]:
    """Errors and run times; quick: one body, fewer meshes and aspects."""
    bodies = BODIES[:1] if quick else BODIES
    radius, length = BODIES[0]
    case = f"rigid cylinder, {radius:g} by {length:g} m"
    rows = [*trade_rows(f"{case}, broadside", INTEGRAL, cylinder_points(radius, length, quick))]
    for size in bodies:
        rows += _broadside(*size, quick)
    mesh = fine_mesh(Cylinder(radius=radius, length=length), SOUND_SPEED / BAND[-1])
    rows += _side(case, radius, length, mesh, quick)
    rows += _all_round(case, radius, length, mesh, quick)
    return rows


def cylinder_points(radius: float, length: float, quick: bool) -> list[Point]:
    """Ever finer meshes, broadside: edges from 0.6 of sqrt(wavelength x radius) down, each 1/sqrt(2) of it."""
    first = 0.6 * np.sqrt(SOUND_SPEED / BAND[-1] * radius)
    edges = first * 2.0 ** (-0.5 * np.arange(1, 5) if quick else -0.5 * np.arange(0, 7))
    exact = lit_cylinder(0.5 * np.pi, wavenumber(BAND), radius, length)
    roll = np.linspace(0.0, 2.0 * np.pi, 4 if quick else ROLLS, endpoint=False) + 0.1
    towards = np.stack([np.zeros_like(roll), np.cos(roll), np.sin(roll)], axis=1)
    return [measured(mesh_of(Cylinder(radius=radius, length=length, edge=float(e))), towards, exact) for e in edges]


def series_level(frequency: Floats, aspect: Floats, radius: float, length: float) -> Floats:
    """Exact target strength (frequency, aspect) in dB re 1 m2 of the side, at angles (deg) off the axis."""
    angle = np.radians(aspect)
    return decibels(
        cylinder_amplitude(frequency[:, None], angle, radius=radius, length=length, sound_speed=SOUND_SPEED)
    )


def facet_level(frequency: Floats, aspect: Floats, radius: float, length: float) -> Floats:
    """Target strength (frequency, aspect) in dB re 1 m2 of facets, as users get it, at angles (deg) off the axis."""
    towards = round_x(aspect)
    return target_strength(
        Cylinder(radius=radius, length=length), frequency[:, None], -towards, towards, SOUND_SPEED, None
    )


def _broadside(radius: float, length: float, quick: bool) -> Iterator[Row]:
    """Levels as users get them, all over the band: the ends add nothing."""
    case = f"rigid cylinder, {radius:g} by {length:g} m"
    frequency = np.arange(25e3, 110.1e3, 5e3 if quick else 1e3)
    aspect = np.array([90.0])
    levels, cost = timed(lambda: facet_level(frequency, aspect, radius, length), calls=1)
    error = float(np.abs(levels - series_level(frequency, aspect, radius, length)).max())
    counts = {"facets": _facets(radius, length), "values": levels.size}
    yield Row(case, SERIES, "broadside", "dB", FAIR, error, 1e3 * cost, PER_ASPECT, counts)


def _facets(radius: float, length: float) -> int:
    return len(fine_mesh(Cylinder(radius=radius, length=length), SOUND_SPEED / BAND[-1]).faces)


def _side(case: str, radius: float, length: float, mesh: Mesh, quick: bool) -> Iterator[Row]:
    """The side alone, as in the series, round to 45 degrees: lobe by lobe, over the rms in the band."""
    on_side = np.abs(mesh.normal[:, 0]) < 0.5
    aspects = np.arange(90.0, 44.0, -15.0 if quick else -1.0)

    def echo(towards: Floats) -> Complexes:
        lit = on_side & lit_and_seen(-towards, towards, mesh.normal)
        return mesh_amplitude(mesh.corners, -towards, towards, wavenumber(BAND), lit)

    echoes, cost = timed(lambda: np.array([echo(direction) for direction in round_x(aspects)]), calls=1)
    angle = np.radians(aspects)[:, None]
    exact = cylinder_amplitude(BAND, angle, radius=radius, length=length, sound_speed=SOUND_SPEED)
    counts = {"facets": len(mesh.faces), "values": echoes.size}
    error = float(_relative(echoes, exact).max())
    yield Row(case, SERIES, "side, 90 to 45 deg", "1", SIDE, error, 1e3 * cost / len(aspects), PER_ASPECT, counts)


def _all_round(case: str, radius: float, length: float, mesh: Mesh, quick: bool) -> Iterator[Row]:
    """Side and end from end-on to broadside, against the integral; end-on that is a disc's."""
    aspects = np.arange(0.0, 90.1, 15.0 if quick else 1.0)
    echoes, cost = timed(
        lambda: np.array([backscatter(mesh, direction, BAND) for direction in round_x(aspects)]), calls=1
    )
    exact = lit_cylinder(np.radians(aspects)[:, None], wavenumber(BAND), radius, length)
    counts = {"facets": len(mesh.faces), "values": echoes.size}
    error = float(_relative(echoes, exact).max())
    yield Row(
        case, INTEGRAL, "all round, 0 to 90 deg", "1", ROUND, error, 1e3 * cost / len(aspects), PER_ASPECT, counts
    )


def _relative(echoes: Complexes, exact: Complexes) -> Floats:
    """Rms error over the band, over the rms (aspect,)."""
    return np.asarray(np.sqrt(np.mean(np.abs(echoes - exact) ** 2, axis=1) / np.mean(np.abs(exact) ** 2, axis=1)))
