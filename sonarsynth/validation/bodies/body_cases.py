"""What the references for echoes of bodies share: the band, ways of looking, costs, error against facets and time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Complexes, Floats
from sonarsynth.equations.scattering.kirchhoff_kernels import mesh_amplitude
from sonarsynth.equations.scattering.lobes import lit_and_seen
from sonarsynth.randomness import stream
from sonarsynth.targets.mesh_resolution import expected_error
from sonarsynth.validation.run_time import timed
from sonarsynth.validation.validation_rows import Row

if TYPE_CHECKING:
    from sonarsynth.geometry.mesh import Mesh


SOUND_SPEED: Final = 1500.0  # m/s
BAND: Final = np.arange(25e3, 110.1e3, 5e3)  # Hz
PER_ASPECT: Final = "ms an aspect"
"""CPU time of one core for the echo of all facets at all frequencies of the band; the mesh is made before."""
AMPLITUDE: Final = "amplitude"
LEVEL: Final = "level"
"""Quantities of trades of error for time: complex amplitudes, and target strength as users get it."""
ASYMPTOTIC: Final = 0.25
"""Expected errors up to this fall by the order of the method."""
SEED = 5


def wavenumber(frequency: npt.ArrayLike) -> Floats:
    """Wavenumbers (...) (rad/m) of frequencies (...) (Hz)."""
    return np.asarray(2.0 * np.pi * np.asarray(frequency, float) / SOUND_SPEED)


def decibels(amplitude: npt.ArrayLike) -> Floats:
    """20 log10 of the size (...) of far-field amplitudes (m): dB re 1 m2; -inf for none."""
    with np.errstate(divide="ignore"):
        return np.asarray(20.0 * np.log10(np.abs(amplitude)))


def ways(count: int) -> Floats:
    """Unit vectors (count, xyz), evenly likely in all directions; always the same."""
    drawn = stream(SEED, "accuracy", "ways").normal(size=(count, 3))
    return np.asarray(drawn / np.linalg.norm(drawn, axis=1, keepdims=True))


def round_x(degrees: npt.ArrayLike) -> Floats:
    """Unit vectors (..., xyz) in the plane of x and y, at angles (deg) from x towards y."""
    angle = np.radians(np.asarray(degrees, float))
    return np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)


def backscatter(mesh: Mesh, towards: Floats, frequency: Floats) -> Complexes:
    """Far-field amplitude (frequency,) (m) that a convex rigid mesh sends back to a direction (xyz)."""
    lit = lit_and_seen(-towards, towards, mesh.normal)
    return mesh_amplitude(mesh.corners, -towards, towards, wavenumber(frequency), lit)


@dataclass(frozen=True, eq=False)
class Point:
    """One fineness of a mesh: its cost and its errors."""

    facets: int
    edge: float  # m
    milliseconds: float
    error: Floats  # (way, frequency) of the complex amplitude, relative
    predicted: Floats  # (frequency,)

    @property
    def rms(self) -> Floats:
        """(frequency,) over the ways."""
        return np.asarray(np.sqrt(np.mean(self.error**2, axis=0)))


def measured(mesh: Mesh, towards: Floats, exact: Complexes) -> Point:
    """Backscatter of a rigid convex mesh to directions (way, xyz) against exact amplitudes (frequency,) over `BAND`."""
    echoes, cost = timed(lambda: np.array([backscatter(mesh, direction, BAND) for direction in towards]), 2)
    predicted = expected_error(mesh, SOUND_SPEED / BAND[-1]) * (BAND / BAND[-1])  # in proportion while it is small
    edge = float(np.linalg.norm(mesh.corners - np.roll(mesh.corners, -1, axis=1), axis=2).mean())
    return Point(len(mesh.faces), edge, 1e3 * cost / len(towards), np.abs(echoes / exact - 1.0), predicted)


def trade_rows(case: str, reference: str, points: Sequence[Point]) -> Iterator[Row]:
    """Rows of ever finer meshes: the error of each, whether it was predicted within a factor 2, and the order.

    The error of a mesh is the rms over ways, at the highest frequency, where it is largest; its bound is twice what
    `mesh_resolution.expected_error` says. That holds and the order shows from `ASYMPTOTIC` down.
    """
    for point in points:
        bound, error = 2.0 * float(point.predicted[-1]), float(point.rms[-1])
        columns = point.milliseconds, PER_ASPECT, {"facets": point.facets, "values": len(point.error)}
        yield Row(case, reference, AMPLITUDE, "1", bound, error, *columns, case)
    fine = [point for point in points if point.predicted[-1] <= ASYMPTOTIC]
    ratio = np.array([point.rms / point.predicted for point in fine])
    columns = fine[-1].milliseconds, PER_ASPECT, {"facets": fine[-1].facets, "values": ratio.size}
    worst = float(np.maximum(ratio, 1.0 / ratio).max())
    yield Row(case, "expectation", "error as expected", "factor", 2.0, worst, *columns)
    note = f"order in the length of edges: {order(fine):.3f}"
    yield Row(case, reference, "order less 2", "1", 0.2, abs(order(fine) - 2.0), *columns, note=note)


def order(points: Sequence[Point]) -> float:
    """Power of the mean edge that errors fall with: the slope through the mean of their logarithms over the band."""
    edges = np.log([point.edge for point in points])
    errors = [float(np.mean(np.log(point.rms))) for point in points]
    return float(np.polyfit(edges, errors, 1)[0])
