"""What water absorbs along the paths of a sequence: one shape of spectrum for all of them, and its error."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Floats, depth
from sonarsynth.environment.absorption import absorption_db_per_m
from sonarsynth.environment.sea import Absorption
from sonarsynth.recipe.scene import Frame

_X, _W = np.polynomial.legendre.leggauss(5)
FREQUENCIES = 17
"""Of a band, at which an error is looked for."""


class StraightPaths(NamedTuple):
    """Straight paths: source to array, and source to each target to array."""

    depth: Floats  # (path, sample) m
    length: Floats  # (path, sample) m: of the path, near each


def passed_by(frames: Sequence[Frame]) -> StraightPaths:
    """The depths that straight paths of some frames pass; of a frame without a source, that of the array."""
    rows: list[tuple[Floats, Floats]] = []
    for frame in frames:
        array = frame.sonar_pose.position
        for snap in frame.moment.snaps:
            rows.append(_leg(snap.position, array, array))
            rows += [_leg(snap.position, body.pose.position, array) for body in frame.moment.bodies]
        if not frame.moment.snaps:
            rows.append(_leg(array, array, array))
    depths, length = (np.array(column) for column in zip(*rows, strict=True))
    return StraightPaths(depths, length if length.any() else length + 1.0)


def _leg(start: Floats, middle: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Depths (sample,) and lengths (sample,) in m of a path in two straight parts."""
    share = 0.5 + 0.5 * _X
    points = [a + share[:, None] * (b - a) for a, b in ((start, middle), (middle, end))]
    length = [0.5 * _W * np.linalg.norm(b - a) for a, b in ((start, middle), (middle, end))]
    return np.maximum(depth(np.concatenate(points)), 0.0), np.concatenate(length)


def mean_absorption(absorption: Absorption, passed: StraightPaths, frequency: np.ndarray | float) -> Floats:
    """Mean (...) in dB/m at frequencies (...) (Hz) over all that the paths pass, by their lengths."""
    f = np.asarray(frequency, float)
    return _mean(absorption, passed.depth.tobytes(), passed.length.tobytes(), f.tobytes()).reshape(f.shape)


@lru_cache(maxsize=256)
def _mean(absorption: Absorption, depths: bytes, lengths: bytes, frequencies: bytes) -> Floats:
    """The same, kept: all frames ask for the same few frequencies."""
    f, passed, length = (np.frombuffer(numbers) for numbers in (frequencies, depths, lengths))
    unique_depths, at = np.unique(np.round(passed, 3), return_inverse=True)
    weight = np.bincount(at, length) / length.sum()
    mean = np.asarray(absorption_db_per_m(absorption, f[:, None], unique_depths) @ weight)
    mean.setflags(write=False)
    return mean


def shape_error(
    absorption: Absorption, passed: StraightPaths, band: tuple[float, float], bottom: float, bounces: int
) -> float:
    """Largest error (dB) in a band (Hz) of any path: its loss at the centre is its own, its spectrum that of the mean.

    bottom (m): where paths are reflected, at most `bounces` times: as long a path close to the surface or to the bottom
    counts then, and one through all of the water so many times.
    """
    frequency = np.append(np.linspace(*band, FREQUENCIES), 0.5 * sum(band))
    mean = mean_absorption(absorption, passed, frequency)
    if not mean[-1] > 0.0:
        return 0.0
    per_depth = absorption_db_per_m(absorption, frequency[:, None, None], passed.depth)
    own = np.einsum("fps,ps->pf", per_depth, passed.length)
    if bounces:
        longest = float(passed.length.sum(axis=1).max())
        column = absorption_db_per_m(absorption, frequency, bottom * (0.5 + 0.5 * _X)[:, None])
        ends = absorption_db_per_m(absorption, frequency, np.array([[0.0], [bottom]]))
        own = np.concatenate([own, ends * longest, (0.5 * _W @ column)[None] * np.hypot(longest, bounces * bottom)])
    return float(np.abs(own - own[:, -1:] * (mean / mean[-1])).max())
