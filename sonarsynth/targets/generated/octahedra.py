"""Bodies of many small pieces, each an octahedron: nets, chains, schools of fish, clouds of bubbles."""

from __future__ import annotations

from itertools import product

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.geometry.surfaces import Surface
from sonarsynth.randomness import stream
from sonarsynth.targets.shapes import Knots, School

CORNERS = np.concatenate([np.eye(3), -np.eye(3)])
FACES = np.array(
    [
        [a, b, c] if (a >= 3) + (b >= 3) + (c >= 3) in (0, 2) else [a, c, b]
        for a, b, c in product((0, 3), (1, 4), (2, 5))
    ]
)
"""Outward: turned where an odd number of corners is on a negative axis."""


def octahedra(places: Floats, radius: float) -> Surface:
    """One octahedron at each place (piece, xyz), its corners `radius` (m) from there along the axes."""
    vertices = places[:, None, :] + radius * CORNERS
    faces = FACES + len(CORNERS) * np.arange(len(places))[:, None, None]
    return vertices.reshape(-1, 3), faces.reshape(-1, 3)


def knots(shape: Knots) -> Floats:
    """Places (knot, xyz) m."""
    y, z = (shape.spacing * (np.arange(n) - 0.5 * (n - 1)) for n in (shape.columns, shape.rows))
    across, up = np.meshgrid(y, z)
    return np.stack([0.0 * across, across, up], axis=-1).reshape(-1, 3)


def members(shape: School) -> Floats:
    """Places (member, xyz) m, drawn once for its arrangement: evenly over the ball, then stretched to the ellipsoid."""
    random = stream(shape.arrangement, "school")
    towards = random.standard_normal((shape.members, 3))
    towards /= np.linalg.norm(towards, axis=1)[:, None]
    return np.asarray(towards * random.random((shape.members, 1)) ** (1.0 / 3.0) * shape.axes)
