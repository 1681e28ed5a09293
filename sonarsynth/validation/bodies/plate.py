"""Echoes of flat plates, cut into facets in any way, against closed forms: facets are exact, points are not."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from sonarsynth.conventions import Complexes, Floats
from sonarsynth.equations.scattering.kirchhoff_integral import circular_plate, rectangular_plate
from sonarsynth.equations.scattering.kirchhoff_kernels import mesh_amplitude
from sonarsynth.randomness import stream
from sonarsynth.targets.shapes import Box
from sonarsynth.targets.target_strength import target_strength
from sonarsynth.validation.bodies.body_cases import (
    AMPLITUDE,
    BAND,
    PER_ASPECT,
    SEED,
    SOUND_SPEED,
    wavenumber,
)
from sonarsynth.validation.run_time import timed
from sonarsynth.validation.validation_rows import Row

CLOSED, WHOLE = "closed form", "the plate in one piece"
SIDES: Final = (0.6, 0.25)  # m
RADIUS: Final = 0.3  # m
TIGHT = 1e-13
PIECES, POINTS, POLYGON = "rectangle in facets of any shape", "rectangle in points", "disc as a polygon"
DOWN, UP = np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 1.0])
NULL: Final = 3.8317059702075125
"""First zero of J1."""


def plate_accuracy(quick: bool = False) -> list[Row]:
    """Errors and run times; quick: fewer pieces."""
    return [*_rectangle(), *_nulls(), *_pieces(quick), *_points(quick), *_polygons(quick), *_face()]


def rectangle() -> Floats:
    """Corners (2, 3, xyz) of two facets, their normal z."""
    x, y = 0.5 * SIDES[0], 0.5 * SIDES[1]
    rim = np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]])
    return rim[[[0, 1, 2], [0, 2, 3]]]


def echoes(corners: Floats, incident: Floats, scattered: Floats, frequency: Floats) -> Complexes:
    """Far-field amplitudes (pair, frequency) (m) of rigid facets, for pairs of directions (pair, xyz)."""
    k = wavenumber(frequency)
    pairs = zip(incident, scattered, strict=True)
    return np.array([mesh_amplitude(corners, inward, outward, k) for inward, outward in pairs])


def pairs(count: int) -> tuple[Floats, Floats]:
    """Directions of propagation in, down to the plate, and out, up from it (pair, xyz): the first is straight back."""
    drawn = stream(SEED, "accuracy", "plate").normal(size=(2, count, 3))
    drawn /= np.linalg.norm(drawn, axis=2, keepdims=True)
    drawn[:, :, 2] = np.abs(drawn[:, :, 2])
    drawn[:, 0] = UP
    return drawn[0] * [1.0, 1.0, -1.0], drawn[1]


def _exact(incident: Floats, scattered: Floats) -> Complexes:
    return rectangular_plate(SIDES, incident[:, None], scattered[:, None], wavenumber(BAND))


def _most(area: float) -> Floats:
    """Area over wavelength (frequency,) (m): the largest |f| of a plate."""
    return area * BAND / SOUND_SPEED


def _error(amplitude: Complexes, exact: Complexes, area: float) -> float:
    """Largest error (pair, frequency) over area/wavelength."""
    return float((np.abs(amplitude - exact) / _most(area)).max())


def _rectangle() -> Iterator[Row]:
    """Two facets against sinc lobes, and |f| = A/lambda straight back."""
    incident, scattered = pairs(200)
    amplitude, cost = timed(lambda: echoes(rectangle(), incident, scattered, BAND))
    counts = {"facets": 2, "values": amplitude.size}
    size = float(np.prod(SIDES))
    columns = 1e3 * cost / len(incident), PER_ASPECT, counts
    error = _error(amplitude, _exact(incident, scattered), size)
    yield Row("rectangle", CLOSED, AMPLITUDE, "A/wavelength", TIGHT, error, *columns)
    straight = float(np.abs(np.abs(amplitude[0]) / _most(size) - 1.0).max())
    yield Row("rectangle", "A/wavelength", "straight back", "1", TIGHT, straight, *columns)


def _nulls() -> Iterator[Row]:
    """Where a side spans whole wavelengths of path nothing is sent; nor at the first zero of a disc."""
    frequency = 60e3
    wavelength = SOUND_SPEED / frequency
    sines = [(first, first + n * wavelength / SIDES[0]) for n in (1, 2, 3, 10) for first in (0.0, 0.3)]
    into = np.array([[s, 0.0, -np.sqrt(1.0 - s * s)] for s, _ in sines])
    out = np.array([[s, 0.0, np.sqrt(1.0 - s * s)] for _, s in sines])
    amplitude, cost = timed(lambda: echoes(rectangle(), into, out, np.array([frequency])))
    counts = {"facets": 2, "values": len(sines)}
    null = float(np.abs(amplitude).max()) * wavelength / float(np.prod(SIDES))
    columns = 1e3 * cost / len(sines), PER_ASPECT
    yield Row("rectangle", CLOSED, "nulls", "A/wavelength", TIGHT, null, *columns, counts)
    sine = NULL / (2.0 * np.pi / wavelength * RADIUS)
    ring = polygon(4000)
    direction = np.array([[sine, 0.0, np.sqrt(1.0 - sine**2)]])
    amplitude, cost = timed(lambda: echoes(ring, DOWN[None], direction, np.array([frequency])), calls=2)
    null = float(np.abs(amplitude).max()) * wavelength / (np.pi * RADIUS**2)
    yield Row(
        "disc", CLOSED, "null", "A/wavelength", 1e-6, null, 1e3 * cost, PER_ASPECT, {"facets": len(ring), "values": 1}
    )


def split(corners: Floats, rng: np.random.Generator) -> Floats:
    """Every facet (facet, 3, xyz) cut in three at a random point inside, needles among them."""
    share = rng.dirichlet([0.4, 0.4, 0.4], len(corners))
    point = np.einsum("fc,fcx->fx", share, corners)
    thirds = [np.stack([corners[:, i], corners[:, (i + 1) % 3], point], axis=1) for i in range(3)]
    return np.concatenate(thirds)


def _pieces(quick: bool) -> Iterator[Row]:
    """The rectangle cut again and again: nothing changes but the run time."""
    incident, scattered = pairs(6)
    rng = stream(SEED, "accuracy", "pieces")
    corners = rectangle()
    uncut = echoes(corners, incident, scattered, BAND)
    for _ in range(5 if quick else 9):
        corners = split(corners, rng)
        amplitude, cost = timed(lambda: echoes(corners, incident, scattered, BAND), calls=2)  # noqa: B023 -- called here
        error = _error(amplitude, uncut, float(np.prod(SIDES)))
        counts = {"facets": len(corners), "values": amplitude.size}
        columns = 1e3 * cost / len(incident), PER_ASPECT, counts, PIECES
        yield Row(PIECES, WHOLE, AMPLITUDE, "A/wavelength", TIGHT, error, *columns)


def tiles(cells: int) -> Floats:
    """Corners (facet, 3, xyz) of the rectangle cut into so many cells along its width, each halved; nearly square."""
    along = round(cells * SIDES[0] / SIDES[1])
    x, y = (np.linspace(-0.5 * length, 0.5 * length, n + 1) for length, n in zip(SIDES, (along, cells), strict=True))
    i, j = (index.ravel() for index in np.meshgrid(np.arange(along), np.arange(cells), indexing="ij"))
    at = [np.stack([x[i + p], y[j + q], 0.0 * i], axis=1) for p, q in ((0, 0), (1, 0), (1, 1), (0, 1))]
    return np.concatenate([np.stack([at[0], at[1], at[2]], axis=1), np.stack([at[0], at[2], at[3]], axis=1)])


def points_echo(corners: Floats, incident: Floats, scattered: Floats, frequency: Floats) -> Complexes:
    """As `echoes`, but each facet is a point in its middle with all its area: the rule of the centroid."""
    k, middle = wavenumber(frequency), corners.mean(axis=1)
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])  # times the normal
    sums = [(area @ u) @ np.exp(-1j * k * (middle @ u)[:, None]) for u in incident - scattered]
    return np.asarray(-0.25j / np.pi * k * np.array(sums))


def _points(quick: bool) -> Iterator[Row]:
    """What points cost that are as many as the facets: an error of second order in their distance.

    Bound: of a facet with edges e, |1 - mean of exp(i w.(x - middle))| <= sum (w.e)^2/72, and 2.
    """
    incident, scattered = pairs(6)
    exact = _exact(incident, scattered)
    for cells in (4, 8, 16) if quick else (2, 4, 8, 16, 32, 64, 128):
        corners = tiles(cells)
        amplitude, cost = timed(lambda: points_echo(corners, incident, scattered, BAND))  # noqa: B023 -- called here
        edges = corners[[0, len(corners) // 2]] - np.roll(corners[[0, len(corners) // 2]], 1, axis=1)
        change = np.einsum("fex,px->pfe", edges, incident - scattered)[:, None] * wavenumber(BAND)[:, None, None]
        off = np.minimum(np.sum(change**2, axis=-1) / 72.0, 2.0).mean(axis=-1)
        along = 0.5 * np.abs((incident - scattered)[:, 2])
        bound = float((off * along[:, None]).max())
        error = _error(amplitude, exact, float(np.prod(SIDES)))
        counts = {"facets": len(corners), "values": amplitude.size}
        columns = 1e3 * cost / len(incident), PER_ASPECT, counts, POINTS
        yield Row(POINTS, CLOSED, AMPLITUDE, "A/wavelength", bound + TIGHT, error, *columns)


def polygon(sides: int) -> Floats:
    """Corners (facet, 3, xyz) of a fan over a regular polygon inscribed in the disc."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    rim = RADIUS * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    return np.stack([np.zeros_like(rim), rim, np.roll(rim, -1, axis=0)], axis=1)


def _polygons(quick: bool) -> Iterator[Row]:
    """A disc of so many sides: no error but what is missing of its area."""
    incident, scattered = pairs(6)
    exact = circular_plate(RADIUS, incident[:, None], scattered[:, None], wavenumber(BAND))
    for sides in (16, 64, 256) if quick else (8, 16, 32, 64, 128, 256, 512, 1024, 4096):
        corners = polygon(sides)
        amplitude, cost = timed(lambda: echoes(corners, incident, scattered, BAND))  # noqa: B023 -- called here
        missing = 1.0 - float(np.sinc(2.0 / sides))
        error = _error(amplitude, exact, np.pi * RADIUS**2)
        counts = {"facets": sides, "values": amplitude.size}
        columns = 1e3 * cost / len(incident), PER_ASPECT, counts, POLYGON
        yield Row(POLYGON, CLOSED, AMPLITUDE, "A/wavelength", missing + TIGHT, error, *columns)


def _face() -> Iterator[Row]:
    """The face of a box, as users get it: A/wavelength, in dB."""
    box = Box(size=(0.2, *SIDES))
    level, cost = timed(lambda: target_strength(box, BAND, (-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), SOUND_SPEED))
    error = float(np.abs(level - 20.0 * np.log10(_most(float(np.prod(SIDES))))).max())
    yield Row(
        "face of a box",
        "A/wavelength",
        "straight back",
        "dB",
        1e-9,
        error,
        1e3 * cost,
        PER_ASPECT,
        {"facets": 12, "values": level.size},
    )
