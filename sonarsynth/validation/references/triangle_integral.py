"""The integral of a plane wave over a triangle in arithmetic of many digits, from the textbook's divided difference."""

from __future__ import annotations

from typing import Any

from sonarsynth.conventions import Floats

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
