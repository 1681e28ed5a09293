"""The integral over a facet against arithmetic of 50 digits: any triangle, any wave, the mirror angle among them."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from typing import Any

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.scattering.kirchhoff_kernels import ROOM, half_means, mesh_amplitude
from sonarsynth.randomness import stream
from sonarsynth.validation.bodies.body_cases import SEED
from sonarsynth.validation.rays.ray_matching import worst
from sonarsynth.validation.run_time import timed
from sonarsynth.validation.validation_rows import Row

DIGITS = 50
APART = 45
"""Equal phases are moved apart by ten to minus this."""


def exact_triangle(corners: Floats, wave: Floats) -> tuple[complex, float]:
    """Integral (m2) of exp(i w.x) over a triangle with corners (3, xyz) (m), for a wave w (xyz) (rad/m), and its area.

    2 A sum_j exp(z_j)/prod_(m != j) (z_j - z_m), z_j = i w.x_j: 0/0 where phases agree, so they are moved apart, and
    the digits that this costs are added.
    """
    import mpmath as mp

    with mp.workdps(DIGITS + 2 * APART + 10):
        x = [[mp.mpf(float(number)) for number in corner] for corner in corners]
        phase = [_dot(corner, [mp.mpf(float(number)) for number in wave]) for corner in x]
        z = [mp.mpc(0, phase[j] + j * mp.mpf(10) ** -APART) for j in range(3)]
        first, second = ([x[j][i] - x[0][i] for i in range(3)] for j in (1, 2))
        square = _dot(first, first) * _dot(second, second) - _dot(first, second) ** 2
        twice = mp.sqrt(square)
        difference = sum(mp.exp(z[j]) / ((z[j] - z[j - 1]) * (z[j] - z[j - 2])) for j in range(3))
        return complex(twice * difference), float(0.5 * twice)


def _dot(a: list[Any], b: list[Any]) -> Any:
    return sum(x * y for x, y in zip(a, b, strict=True))


HEIGHTS = (1.0, 1e-3, 1e-6, 1e-9)
"""Of triangles with a base of 1: from fat ones to needles."""
SIZES = 10.0 ** np.arange(-12.0, 4.1)
"""Of the wave times the base, rad."""
MIRROR, NEAR, ANY, EDGES = "at the mirror angle", "1e-8 off the mirror angle", "any wave", "square to an edge"
ROUNDING = 2.0**-52


def triangle_rows(quick: bool) -> Iterator[Row]:
    """Errors over the area of facets in their own plane, and of facets turned any way.

    Corners of a turned facet are rounded, and so is the phase w.x: by eps of the longest edge and of |w| L, whatever is
    done with them then. Its error is allowed that much more, over the longest edge squared. Raises ModuleNotFoundError
    without mpmath.
    """
    if find_spec("mpmath") is None:
        raise ModuleNotFoundError("the reference for triangles needs mpmath: pip install 'sonarsynth[accuracy]'")
    rng = stream(SEED, "accuracy", "triangles")
    sizes = SIZES[::4] if quick else np.repeat(SIZES, 4)
    cost = _cost(rng.normal(size=(10_000, 3, 3)), rng.normal(size=(10_000, 3)))
    for turned in (False, True):
        case = "triangles turned any way" if turned else "triangles in their own plane"
        note = "allowed more by the rounding of corners and of the phase" if turned else ""
        for direction in (MIRROR, NEAR, ANY, EDGES):
            errors = np.array([_error(rng, height, size, direction, turned) for height in HEIGHTS for size in sizes])
            error, bound = worst(errors[:, 0], errors[:, 1])
            unit, counts = ("edge squared" if turned else "area"), {"facets": len(errors), "values": len(errors)}
            yield Row(case, "50 digits", direction, unit, bound, error, cost, "us a facet", counts, note=note)


def triangle_integral(corners: Floats, wave: Floats) -> complex:
    """Integral (m2) of exp(i w.x) over a triangle, as of `exact_triangle`, by the kernel that sums echoes of facets."""
    half, room = np.empty(1, complex), np.empty((2, ROOM))
    x, y, z = (-wave).tolist()
    twice = half_means(half, np.ascontiguousarray(corners), x, y, z, np.ones(1), room, np.nan)
    return complex(np.linalg.norm(twice) * half[0])


def _cost(corners: Floats, wave: Floats) -> float:
    """CPU time (us) of the echo of one of many triangles (triangle, 3, xyz), a wave (triangle, xyz) each."""
    back = wave / np.linalg.norm(wave, axis=1, keepdims=True)
    return 1e6 * timed(lambda: mesh_amplitude(corners, -back, back, 1.0))[1] / len(corners)


def _error(rng: np.random.Generator, height: float, size: float, direction: str, turned: bool) -> tuple[float, float]:
    """Error of the integral over one random triangle, over its area or its longest edge squared, and the bound."""
    flat = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [rng.uniform(-0.2, 1.2), height, 0.0]])
    flat -= np.array([rng.uniform(), height / 3.0, 0.0])
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0] if turned else np.eye(3)
    corners, edges = flat @ turn.T, (flat - np.roll(flat, 1, axis=0)) @ turn.T
    normal = turn[:, 2]
    match direction:
        case "at the mirror angle":
            wave = normal
        case "1e-8 off the mirror angle":
            wave = normal + 1e-8 * rng.normal(size=3)
        case "square to an edge":
            wave = np.cross(normal, edges[rng.integers(3)])
        case _:
            wave = rng.normal(size=3)
    wave = wave * (size / np.linalg.norm(wave))
    exact, area = exact_triangle(corners, wave)
    longest = float(np.sum(edges**2, axis=1).max())
    error = abs(triangle_integral(corners, wave) - exact)
    if turned:
        return error / longest, 1e-14 + ROUNDING * size
    return error / area, 1e-14
