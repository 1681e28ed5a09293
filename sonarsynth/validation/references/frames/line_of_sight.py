"""Whether a triangle stands between two points: every triangle near the line is tried, in float64."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from sonarsynth.conventions import Bools, Floats

TOGETHER = 32
"""Triangles within one bounding sphere."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles of a body in its own frame, by groups with a bounding sphere each."""

    corners: Floats  # (triangle, 3, xyz) m, group by group
    middle: Floats  # (group, xyz) m
    radius: Floats  # (group,) m
    reach: float  # m: of all from the origin

    @staticmethod
    def of(corners: Floats) -> Surface:
        """Of triangles (triangle, 3, xyz), sorted along their longest extent."""
        centre = corners.mean(axis=1)
        groups = [np.arange(len(corners))]
        while len(groups[0]) > TOGETHER:
            halves = []
            for group in groups:
                along = np.ptp(centre[group], axis=0).argmax()
                order = group[np.argsort(centre[group, along], kind="stable")]
                halves += [order[: (len(order) + 1) // 2], order[(len(order) + 1) // 2 :]]
            groups = halves
        size = len(groups[0])  # shorter ones repeat a triangle
        rows = np.array([np.resize(group, size) for group in groups if len(group)])
        grouped = corners[rows]
        middle = 0.5 * (grouped.min(axis=(1, 2)) + grouped.max(axis=(1, 2)))
        radius = np.linalg.norm(grouped - middle[:, None, None], axis=3).max(axis=(1, 2)) * (1.0 + 1e-9)
        reach = float(np.linalg.norm(corners, axis=2).max()) * (1.0 + 1e-9)
        return Surface(np.ascontiguousarray(grouped.reshape(-1, 3, 3)), middle, radius, reach)

    def between(self, start: Floats, end: Floats) -> Bools:
        """Whether it stands in straight lines from start to end (line, xyz), in its frame."""
        out = np.zeros(len(start), bool)
        along = end - start
        square = np.maximum(np.einsum("nx,nx->n", along, along), 1e-300)
        fraction = np.clip(-np.einsum("nx,nx->n", start, along) / square, 0.0, 1.0)
        nearest = start + fraction[:, None] * along
        near = np.flatnonzero(np.einsum("nx,nx->n", nearest, nearest) <= self.reach**2)
        if len(near):
            blocked = np.zeros(len(near), bool)
            size = len(self.corners) // len(self.middle)
            ends = np.ascontiguousarray(start[near]), np.ascontiguousarray(along[near])
            _meets(*ends, self.corners, self.middle, self.radius, size, blocked)
            out[near] = blocked
        return out


@njit(cache=True, nogil=True)
def _meets(start, along, corners, middle, radius, size, out):  # type: ignore[no-untyped-def] # pragma: no cover
    """Moller and Trumbore (1997), J. Graphics Tools 2, 21, on every triangle whose group's sphere a line meets."""
    for n in range(len(start)):
        px, py, pz = start[n]
        dx, dy, dz = along[n]
        square = dx * dx + dy * dy + dz * dz
        for g in range(len(middle)):
            mx, my, mz = middle[g, 0] - px, middle[g, 1] - py, middle[g, 2] - pz
            t = min(max((mx * dx + my * dy + mz * dz) / square, 0.0), 1.0)
            mx, my, mz = mx - t * dx, my - t * dy, mz - t * dz
            if mx * mx + my * my + mz * mz > radius[g] * radius[g]:
                continue
            for k in range(g * size, (g + 1) * size):
                ax, ay, az = corners[k, 0]
                ux, uy, uz = corners[k, 1, 0] - ax, corners[k, 1, 1] - ay, corners[k, 1, 2] - az
                vx, vy, vz = corners[k, 2, 0] - ax, corners[k, 2, 1] - ay, corners[k, 2, 2] - az
                hx, hy, hz = dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx
                det = ux * hx + uy * hy + uz * hz
                if det == 0.0:
                    continue
                sx, sy, sz = px - ax, py - ay, pz - az
                a = (sx * hx + sy * hy + sz * hz) / det
                if a < 0.0 or a > 1.0:
                    continue
                qx, qy, qz = sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux
                b = (dx * qx + dy * qy + dz * qz) / det
                if b < 0.0 or a + b > 1.0:
                    continue
                far = (vx * qx + vy * qy + vz * qz) / det
                if 0.0 < far < 1.0:
                    out[n] = True
                    break
            if out[n]:
                break
