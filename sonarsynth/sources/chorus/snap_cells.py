"""Snaps drawn in cells of the bottom and of time: the same in every frame and window that hears them.

Each cell has a Poisson number of snaps (or of clusters), whose numbers are a hash of the cell and of their own number
alone. A snap belongs to its cell for ever, whoever asks, from wherever, in whatever order.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from sonarsynth.columns import Columns
from sonarsynth.conventions import Floats, Ints
from sonarsynth.randomness import uniforms
from sonarsynth.sources.chorus.shrimp_chorus import WIDTHS, Chorus

SIDE, SLOT = 25.0, 0.025
"""m and s: of a cell. Snaps keep their places as long as these stay."""
MOST_OF_A_CELL = 1000
"""Snaps of a cell, at most: the law of Poisson gives more once in ages."""


class Draw(IntEnum):
    """What a random number is for: part of its key, so that one more changes no other."""

    COUNT = 0
    X = 1
    Y = 2
    TIME = 3
    LEVEL = 4
    WIDTH = 5
    SIGN = 6
    CLUSTER_COUNT = 8
    CLUSTER_RADIUS = 9
    CLUSTER_ANGLE = 10
    CLUSTER_TIME = 11


class ListeningWindow(NamedTuple):
    """Who hears what."""

    array: Floats  # (xy) m of the array, world
    start: float  # s of the window, since the start of the motions
    stop: float
    reach: float  # m
    longer: float  # m: the farthest image is hypot(distance, longer) off
    slowest: float  # m/s
    fastest: float


@dataclass(frozen=True, eq=False)
class ChorusSnaps(Columns):
    """Snaps of a chorus that may be heard in a window.

    position    (snap, xy)   m    on the bottom, world
    time        (snap,)      s    since the start of the motions
    level       (snap,)      dB   peak source level re 1 uPa at 1 m
    width       (snap,)      -    number of the width, of `Chorus.widths`
    sign        (snap,)      -    evenly in 0 to 1: what random signs of its reflections are drawn from
    key         (snap, 5)    -    cell along x, y and time, number in the cell, number in the cluster
    """

    position: Floats
    time: Floats
    level: Floats
    width: Ints
    sign: Floats
    key: Ints


def draw_snaps(chorus: Chorus, seed: int, listening: ListeningWindow) -> ChorusSnaps:
    """The snaps that may be heard; seed: `randomness.number` of the sequence.

    All that are within reach and sound between the earliest and the latest time that the window can hear them from
    there, sorted by cell. Cost is linear in cells and snaps.
    """
    clusters, cells = chorus.clusters, _cells(chorus, listening)
    mean_count = chorus.rate * SIDE * SIDE * SLOT / (1.0 if clusters is None else clusters.snaps)
    count = poisson(uniforms(seed, Draw.COUNT, *cells.T), mean_count)
    key = _numbered(cells, count)

    def drawn(draw: Draw) -> Floats:
        return uniforms(seed, draw, *key.T)

    position = SIDE * (key[:, :2] + np.column_stack([drawn(Draw.X), drawn(Draw.Y)]))
    time = SLOT * (key[:, 2] + drawn(Draw.TIME))
    if clusters is None:
        key = np.column_stack([key, np.zeros(len(key), np.int64)])
    else:
        members = poisson(drawn(Draw.CLUSTER_COUNT), clusters.snaps)
        position, time = np.repeat(position, members, axis=0), np.repeat(time, members)
        key = _numbered(key, members)
        angle, away = 2.0 * np.pi * drawn(Draw.CLUSTER_ANGLE), clusters.radius * np.sqrt(drawn(Draw.CLUSTER_RADIUS))
        position = position + away[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        time = time + clusters.duration * drawn(Draw.CLUSTER_TIME)
    away = np.hypot(*(position - listening.array).T)
    early = listening.start - np.hypot(away, listening.longer) / listening.slowest
    audible = (away <= listening.reach) & (time >= early) & (time <= listening.stop - away / listening.fastest)
    key, position, time = key[audible], position[audible], time[audible]
    return ChorusSnaps(
        position=position,
        time=time,
        level=chorus.level + chorus.deviation * _normal(drawn(Draw.LEVEL)),
        width=np.floor(WIDTHS * drawn(Draw.WIDTH)).astype(np.int64),
        sign=drawn(Draw.SIGN),
        key=key,
    )


def _cells(chorus: Chorus, listening: ListeningWindow) -> Ints:
    """Cells (cell, xyt) that may hold what is heard, in order."""
    spread, lasts = (0.0, 0.0) if chorus.clusters is None else (chorus.clusters.radius, chorus.clusters.duration)
    reach = listening.reach + spread
    low, high = (np.floor((listening.array + sign * reach) / SIDE).astype(np.int64) for sign in (-1, 1))
    x, y = np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(low, high, strict=True)), indexing="ij")
    middle = SIDE * (np.stack([x.ravel(), y.ravel()], axis=1) + 0.5)
    away, corner = np.hypot(*(middle - listening.array).T), np.sqrt(0.5) * SIDE + spread
    near = away <= reach + corner
    x, y, away = x.ravel()[near], y.ravel()[near], away[near]
    farthest = np.hypot(np.minimum(away + corner, reach), listening.longer)
    first = np.floor((listening.start - farthest / listening.slowest - lasts) / SLOT).astype(np.int64)
    last = np.floor((listening.stop - np.maximum(away - corner, 0.0) / listening.fastest) / SLOT).astype(np.int64)
    slots = last - first + 1
    key = _numbered(np.column_stack([x, y]), slots)
    key[:, 2] += np.repeat(first, slots)
    return key


def _numbered(rows: Ints, count: Ints) -> Ints:
    """Rows (row, column), each so often (row,), with a number from 0 on as one more column."""
    every = np.repeat(np.arange(len(rows)), count)
    first = np.repeat(np.cumsum(count) - count, count)
    return np.column_stack([rows[every], np.arange(len(every)) - first])


def poisson(uniform: Floats, mean: float) -> Ints:
    """Poisson numbers (...), from numbers uniform in 0 to 1, by inverting the distribution."""
    count = np.zeros(uniform.shape, np.int64)
    more = np.flatnonzero(uniform >= np.exp(-mean))
    term = total = float(np.exp(-mean))
    for k in range(1, MOST_OF_A_CELL):
        if not more.size:
            break
        count.flat[more] = k
        term *= mean / k
        total += term
        more = more[uniform.flat[more] >= total]
    return count


def _normal(uniform: Floats) -> Floats:
    from scipy.special import ndtri

    return np.asarray(ndtri(uniform), float)
