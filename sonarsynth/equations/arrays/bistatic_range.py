"""Bistatic range in water of one sound speed: source S, array A at the origin, target T = r u on a beam.

What is measured is the excess path x = |S - T| + |T - A| - |S - A|: the delay of the echo after the direct arrival,
times the sound speed. The snap time is not needed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats
from sonarsynth.geometry import unit

MIN_ONE_PLUS_COS = 0.1
"""Below this 1 + cos B the target is so near the line from source to array that its range cannot be told."""


@dataclass(frozen=True, eq=False)
class BistaticRange:
    """Range and its derivatives; NaN where there is no solution. Shapes (...) as broadcast."""

    range: Floats  # m
    one_plus_cos: Floats  # 1 + cos B, B the angle at the target between the directions to array and source
    by_path: Floats  # dr/dx = 1/(1 + cos B)
    by_angle: Floats  # m/rad: dr/dpsi, psi the angle between beam and source
    by_source: Floats  # (..., xyz) dr/dS at constant x

    @property
    def ill_conditioned(self) -> npt.NDArray[np.bool_]:
        """True where the target is too near the baseline, or there is no solution."""
        return ~(self.one_plus_cos >= MIN_ONE_PLUS_COS)


def bistatic_range(excess_path: npt.ArrayLike, beam: npt.ArrayLike, source: npt.ArrayLike) -> BistaticRange:
    """Range along unit vectors `beam` (..., xyz) at which the path by the target is `excess_path` (...) m longer.

    source (..., xyz) is the position of the source relative to the array, in the frame of the beams (m). With b = |S|
    and h = 1 - cos psi = |u - s|^2/2, from (L^2 - b^2)/(2 (L - b cos psi)) with L = b + x:
        r = x (2 b + x)/(2 (x + b h))
    which is a quotient of sums of positive terms: no digits are lost at the baseline. NaN where x < 0 (no path is
    shorter than the direct one) and where x = 0 on the baseline (every range fits).
    Source: any text on bistatic radar, e.g. Willis (2005), Bistatic Radar, section 5.2.
    """
    x, u, position = np.asarray(excess_path, float), np.asarray(beam, float), np.asarray(source, float)
    b = np.linalg.norm(position, axis=-1)
    s = unit(position)
    h = 0.5 * np.sum((u - s) ** 2, axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        d = np.where(x >= 0, x + b * h, np.nan)
        r = x * (2 * b + x) / (2 * d)
        from_source = unit(r[..., None] * u - position)
        by_path = (x * x + 2 * b * h * (b + x)) / (2 * d * d)  # (L - r)/d without its cancellation
        return BistaticRange(
            range=r,
            one_plus_cos=1 / by_path,
            by_path=by_path,
            by_angle=-r * b * np.sqrt(h * np.maximum(2.0 - h, 0.0)) / d,  # sin psi
            by_source=by_path[..., None] * (s + from_source),
        )


def excess_path(beam: npt.ArrayLike, range: npt.ArrayLike, source: npt.ArrayLike) -> Floats:
    """Excess path (m) of a target at `range` (...) on `beam` (..., xyz): the inverse of `bistatic_range`.

    |S - T| + r - b, written as r (1 + ((r - 2 b cos psi)/(|S - T| + b))): |S - T| - b without cancellation.
    """
    u, r, position = np.asarray(beam, float), np.asarray(range, float), np.asarray(source, float)
    b = np.linalg.norm(position, axis=-1)
    to_source = np.linalg.norm(r[..., None] * u - position, axis=-1)
    return np.asarray(r * (1 + (r - 2 * np.sum(u * position, axis=-1)) / (to_source + b)))
