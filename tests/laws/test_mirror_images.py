"""Planar arrays hear what is behind as its mirror image in front; the plan says so, and of which target and frames."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.receiver import PlanarLattice, PositionTable, Romanis, elements
from sonarsynth.receiver.mirror_images import mirror_image, mirror_normal

WAVELENGTH = 0.018
RNG = np.random.default_rng(5)
TILT = np.array([0.8, 0.36, 0.48])


def table(points: np.ndarray) -> PositionTable:
    return PositionTable(positions=tuple(tuple(map(float, p)) for p in points))  # type: ignore[arg-type]


def in_plane(normal: np.ndarray, count: int = 12) -> np.ndarray:
    points = RNG.normal(scale=0.2, size=(count, 3))
    return np.asarray(points - np.outer(points @ normal, normal))


@pytest.mark.parametrize(
    ("array", "normal"),
    [
        (Romanis(), [1.0, 0.0, 0.0]),
        (PlanarLattice(columns=5, rows=1, pitch=0.02), [1.0, 0.0, 0.0]),
        (table(in_plane(TILT)), TILT),
        (table(RNG.normal(scale=0.2, size=(12, 3))), None),
        (table(in_plane(TILT) + 0.3 * WAVELENGTH * np.outer(np.arange(12) % 2, TILT)), None),
        (PlanarLattice(columns=1, rows=1, pitch=0.02), None),
        (table(np.outer(np.arange(4), [0.1, 0.0, 0.0])), None),
    ],
)
def test_a_direction_and_its_mirror_image_are_heard_alike(array: Romanis, normal: list[float] | None) -> None:
    made = elements(array)
    found = mirror_normal(made, WAVELENGTH)
    if normal is None:
        assert found is None
        return
    assert found is not None and np.allclose(found, normal, atol=1e-12)
    u = RNG.normal(size=(20, 3))
    image = mirror_image(u, found)
    assert np.allclose(u @ made.position.T, image @ made.position.T, atol=1e-12)
    assert np.allclose(mirror_image(image, found), u)
    assert np.allclose(u @ found, -image @ found)
