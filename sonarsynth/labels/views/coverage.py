"""How much of the cell of each beam bodies cover, by directions that are spread evenly over its solid angle."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats
from sonarsynth.receiver import BeamGrid

DIRECTIONS, STEP = 610, 377
"""Of a cell: a Fibonacci lattice. The share that one straight edge cuts off errs by 0.002 rms, in 99 of 100 by under
0.01, at most by 0.02, where the edge is along a row of it. Source: Niederreiter (1992), Random Number Generation and
Quasi-Monte Carlo Methods, section 5.1."""

Words = npt.NDArray[np.uint64]
"""Bits of the directions of a cell, 64 a word."""


class Cells(NamedTuple):
    """Cells of a beam grid, which end half way to the next beams, and at 90 degrees; sizes (rad) and directions."""

    first: tuple[float, float]  # rad: lower edge of the first cell, in azimuth and elevation
    step: tuple[float, float]  # rad
    azimuth: Floats  # (column, direction) rad
    level: Floats  # (column, direction, xy) cosine and sine of azimuth
    sine: Floats  # (row, direction) of elevation, ascending along direction
    cosine: Floats  # (row, direction) of elevation


@lru_cache(maxsize=4)
def cells_of(beams: BeamGrid) -> Cells:
    """The cells of a grid, as wide as its span where that is one beam."""
    steps, edges = [], []
    for angle, span in ((beams.azimuth, beams.azimuth_span), (beams.elevation, beams.elevation_span)):
        step = span / max(len(angle) - 1, 1)
        low, high = (np.clip(angle + sign * step, -0.5 * np.pi, 0.5 * np.pi) for sign in (-0.5, 0.5))
        steps.append(step)
        edges.append((low[:, None], high[:, None]))
    along = (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS
    across = (np.arange(DIRECTIONS) * STEP % DIRECTIONS + 0.5) / DIRECTIONS
    (left, right), (low, high) = edges
    azimuth = left + across * (right - left)
    sine = np.sin(low) + along * (np.sin(high) - np.sin(low))
    first = float(beams.azimuth[0] - 0.5 * steps[0]), float(beams.elevation[0] - 0.5 * steps[1])
    level = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)
    return Cells(first, (steps[0], steps[1]), azimuth, level, sine, np.sqrt(1.0 - sine**2))


@compiled
def _planes(corners: Floats, face: tuple[int, int, int], planes: Floats) -> bool:
    """Write inward normals (3, xyz) of the planes through the origin and each side of a triangle; returns whether its
    outer side, from which its corners are counter-clockwise, is seen."""
    for i in range(3):
        a, b = face[i], face[i + 1 if i < 2 else 0]
        for x, y, z in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            planes[i, x] = corners[a, y] * corners[b, z] - corners[a, z] * corners[b, y]
    c = face[2]
    outer = corners[c, 0] * planes[0, 0] + corners[c, 1] * planes[0, 1] + corners[c, 2] * planes[0, 2] < 0.0
    if outer:
        for i in range(3):
            for x in range(3):
                planes[i, x] = -planes[i, x]
    return bool(outer)


@compiled
def _mark(
    planes: Floats, boxes: Floats, f: int, azimuth: Floats, level: Floats, sine: Floats, cosine: Floats, row: int,
    column: int, covered: Words,
) -> int:  # fmt: skip
    """Mark the directions of a cell that are inside planes, and in the box of facet f; returns how many were not yet.
    Whole arrays and numbers: to cut a row out of an array takes longer than what is done with it."""
    last, west, east, added = sine.shape[1] - 1, boxes[f, 0], boxes[f, 1], 0
    spacing = (sine[row, last] - sine[row, 0]) / last
    begin = max(math.floor((math.sin(boxes[f, 2]) - sine[row, 0]) / spacing), 0)
    end = min(math.ceil((math.sin(boxes[f, 3]) - sine[row, 0]) / spacing), last) + 1
    for n in range(begin, end):
        bit = np.uint64(1) << np.uint64(n & 63)
        if not west <= azimuth[column, n] <= east or covered[row, column, n >> 6] & bit:
            continue
        x, y, within = cosine[row, n] * level[column, n, 0], cosine[row, n] * level[column, n, 1], True
        for i in range(3):
            within &= x * planes[i, 0] + y * planes[i, 1] + sine[row, n] * planes[i, 2] >= 0.0
        if within:
            covered[row, column, n >> 6] |= bit
            added += 1
    return added


@compiled
def _cover(
    corners: Floats, faces: npt.NDArray[np.int32], boxes: Floats, first: tuple[float, float], step: tuple[float, float],
    azimuth: Floats, level: Floats, sine: Floats, cosine: Floats, outside: bool, covered: Words,
    count: npt.NDArray[np.int16],
) -> None:  # fmt: skip
    """Mark the directions that meet triangles (facet, 3) of points (vertex, xyz) with boxes (facet, 4) rad in bits
    (row, column, word), and count them (row, column); `outside` a closed surface those that show their outer side
    do."""
    rows, columns, directions = len(sine), len(azimuth), sine.shape[1]
    planes = np.empty((3, 3))
    for f in range(len(faces)):
        if not boxes[f, 0] <= boxes[f, 1]:  # NaN: behind, or in a shadow
            continue
        left = max(math.floor((boxes[f, 0] - first[0]) / step[0]), 0)
        right = min(math.floor((boxes[f, 1] - first[0]) / step[0]), columns - 1)
        bottom = max(math.floor((boxes[f, 2] - first[1]) / step[1]), 0)
        top = min(math.floor((boxes[f, 3] - first[1]) / step[1]), rows - 1)
        if left > right or bottom > top:
            continue
        if not _planes(corners, (faces[f, 0], faces[f, 1], faces[f, 2]), planes) and outside:
            continue
        for row in range(bottom, top + 1):
            for column in range(left, right + 1):
                if count[row, column] < directions:
                    count[row, column] += _mark(planes, boxes, f, azimuth, level, sine, cosine, row, column, covered)


def coverage(bodies: list[tuple[Floats, np.ndarray, Floats, bool]], beams: BeamGrid) -> npt.NDArray[np.float32]:
    """Share (elevation, azimuth) of the solid angle of the cell of each beam that bodies cover: 0.002 rms at one edge.

    bodies: corners seen (vertex, xyz), sonar frame, facets (facet, 3) of them, their `facet_boxes`, and whether they
    are a closed surface.
    """
    cells = cells_of(beams)
    covered = np.zeros((beams.elevations, beams.azimuths, (DIRECTIONS + 63) // 64), np.uint64)
    count = np.zeros(covered.shape[:2], np.int16)
    for corners, faces, boxes, closed in bodies:
        beside = closed and any(x.min() >= 0.0 or x.max() <= 0.0 for x in corners.T)
        outside = beside and bool(np.isfinite(corners).all())
        _cover(corners, faces, boxes, *cells, outside, covered, count)
    return (count / DIRECTIONS).astype(np.float32)
