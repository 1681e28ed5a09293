"""Poses and rotations. Quaternions are unit, scalar first (w, x, y, z), and map body to world."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats


def quaternion(heading: float, pitch: float = 0.0, roll: float = 0.0) -> Floats:
    """Unit quaternion (4,) of a body whose x axis points to the compass `heading` (rad, clockwise from north).

    Then pitched nose up and rolled starboard down (rad): body to world = Rz(pi/2 - heading) Ry(-pitch) Rx(roll).
    """
    half = 0.5 * (0.5 * np.pi - heading), 0.5 * pitch, 0.5 * roll
    (cz, cy, cx), (sz, sy, sx) = ([float(f(angle)) for angle in half] for f in (np.cos, np.sin))
    return np.array(_product(_product((cz, 0.0, 0.0, sz), (cy, 0.0, -sy, 0.0)), (cx, sx, 0.0, 0.0)))


def quaternion_product(p: npt.ArrayLike, q: npt.ArrayLike) -> Floats:
    """Hamilton product p q of quaternions (..., 4): rotate by q first, then by p."""
    a, b = np.asarray(p, float), np.asarray(q, float)
    if a.ndim == b.ndim == 1:
        return np.array(_product(a.tolist(), b.tolist()))
    return np.stack(_product(np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)), axis=-1)


def _product(p: Any, q: Any) -> tuple[Any, Any, Any, Any]:
    """The same of four numbers each, or of four arrays."""
    (pw, px, py, pz), (qw, qx, qy, qz) = p, q
    return (
        pw * qw - px * qx - py * qy - pz * qz,
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
    )


def rotation_matrix(q: npt.ArrayLike) -> Floats:
    """Rotation matrix (3, 3), body to world, of a unit quaternion (4,)."""
    w, x, y, z = np.asarray(q, float).tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a body is: position (3,) in the world (m) and orientation (4,), a unit quaternion from body to world."""

    position: Floats
    orientation: Floats

    @cached_property
    def rotation(self) -> Floats:
        """Rotation matrix (3, 3), body to world."""
        return rotation_matrix(self.orientation)

    def to_world(self, points: npt.ArrayLike) -> Floats:
        """Points (..., 3) of the body in the world."""
        return np.asarray(points, float) @ self.rotation.T + self.position

    def to_body(self, points: npt.ArrayLike) -> Floats:
        """Points (..., 3) of the world in the body's frame."""
        return (np.asarray(points, float) - self.position) @ self.rotation

    def turn_to_world(self, vectors: npt.ArrayLike) -> Floats:
        """Vectors (..., 3) of the body in world axes (directions: no shift)."""
        return _times(vectors, self.rotation.T)

    def turn_to_body(self, vectors: npt.ArrayLike) -> Floats:
        """Vectors (..., 3) of the world in body axes (directions: no shift)."""
        return _times(vectors, self.rotation)


def turned(vectors: Floats, spin: Floats, seconds: Floats) -> Floats:
    """Vectors (row, xyz) that turned for so many seconds (row,) at an angular velocity (xyz) in rad/s (Rodrigues'
    rotation formula)."""
    rate = float(np.linalg.norm(spin))
    if rate == 0.0:
        return vectors
    axis, angle = spin / rate, rate * seconds[:, None]
    along = (vectors @ axis)[:, None] * axis
    return np.asarray(along + np.cos(angle) * (vectors - along) + np.sin(angle) * np.cross(axis, vectors))


def _times(vectors: npt.ArrayLike, matrix: Floats) -> Floats:
    """Vectors (..., 3) times a matrix (3, 3), as one product: many small ones take four times as long."""
    rows = np.asarray(vectors, float)
    return np.asarray((rows.reshape(-1, 3) @ matrix).reshape(rows.shape))


def unit(vectors: npt.ArrayLike) -> Floats:
    """Vectors (..., 3) scaled to length one; the zero vector gives NaN, never a direction."""
    v = np.asarray(vectors, float)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))
