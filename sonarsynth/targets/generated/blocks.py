"""Bodies of blocks, cut in nearly equilateral facets: boxes, and what can be built of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.geometry.surfaces import Surface, require_possible


def blocks(breaks: Sequence[Sequence[float]], solid: Bools, edge: float) -> Surface:
    """Closed surface of the solid cells (x, y, z) between the breaks (m, ascending) of each axis.

    Each rectangle is cut in rows of facets, staggered by half a step, with no edge longer than `edge` (m): 2.5/edge^2
    facets a square metre, where halving takes 4 to 8. Rectangles share the vertices on their common sides.
    Raises MeshError where that would take more than `memory.max_facets`.
    """
    widths = [np.diff(b) for b in breaks]
    require_possible(2.0 * sum(w[0].sum() * w[1].sum() for w in (widths[:2], widths[1:], widths[::2])), edge)
    pace = edge / np.sqrt(1.25)
    counts = [2 * np.maximum(1, np.ceil(0.5 * w / pace - 1e-9)).astype(int) for w in widths]
    starts = [np.concatenate([[0], np.cumsum(2 * n)]) for n in counts]  # in half steps
    quads = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        cells = np.pad(np.moveaxis(solid, (axis, u, v), (0, 1, 2)), ((1, 1), (0, 0), (0, 0)))
        for plane, i, j in np.argwhere(cells[1:] != cells[:-1]):
            flat = _rows(int(counts[u][i]), int(counts[v][j]))
            steps = np.empty((*flat.shape[:2], 3), np.int64)
            steps[..., axis] = starts[axis][plane]
            steps[..., u] = starts[u][i] + flat[..., 0]
            steps[..., v] = starts[v][j] + flat[..., 1]
            quads.append(steps if cells[plane, i, j] else steps[:, ::-1])
    places = np.concatenate(quads)
    size = [int(s[-1]) + 1 for s in starts]
    code = (places[..., 0] * size[1] + places[..., 1]) * size[2] + places[..., 2]
    _, first, index = np.unique(code, return_index=True, return_inverse=True)
    at = [_coordinates(np.asarray(b, float), n) for b, n in zip(breaks, counts, strict=True)]
    corner = places.reshape(-1, 3)[first]
    return np.stack([at[k][corner[:, k]] for k in range(3)], axis=1), index.reshape(-1, 3)


def _rows(across: int, rows: int) -> Ints:
    """Facets (facet, 3, uv) of a rectangle in half steps, counter-clockwise: rows of `across` edges and an even number
    of them, every other row shifted by half an edge, with half edges at its ends."""
    even = 2 * np.arange(across + 1)
    odd = np.concatenate([[0], even[:-1] + 1, [2 * across]])
    low, high = np.zeros(across, int), np.full(across, 2)
    up = [np.stack([even[:-1], low], -1), np.stack([even[1:], low], -1), np.stack([odd[1:-1], high], -1)]
    low, high = np.zeros(across + 1, int), np.full(across + 1, 2)
    down = [np.stack([odd[:-1], high], -1), np.stack([even, low], -1), np.stack([odd[1:], high], -1)]
    band = np.concatenate([np.stack(up, axis=1), np.stack(down, axis=1)])
    mirrored = (band * [1, -1] + [0, 4])[:, ::-1]
    pair = np.concatenate([band, mirrored])
    lift = 4 * np.arange(rows // 2)
    return np.asarray((pair[None] + np.stack([0 * lift, lift], -1)[:, None, None, :]).reshape(-1, 3, 2))


def _coordinates(breaks: Floats, counts: Ints) -> Floats:
    """Coordinate (m) at each half step."""
    segments = [np.linspace(a, b, 2 * n + 1)[:-1] for a, b, n in zip(breaks[:-1], breaks[1:], counts, strict=True)]
    return np.concatenate([*segments, breaks[-1:]])
