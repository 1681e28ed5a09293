"""Where echoes come from, with what that depends on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.arrays.bistatic_range import bistatic_range
from sonarsynth.geometry import unit


@dataclass(frozen=True, eq=False)
class Solution:
    """Where echoes come from; NaN where there is no answer or an ill-conditioned one. Sonar frame."""

    position: Floats  # (echo, xyz) m
    range: Floats  # (echo,) m
    by_path: Floats  # (echo,) dr/dx, x the excess path
    by_angle: Floats  # (echo,) m/rad
    by_source: Floats  # (echo, xyz) dr/dS
    by_speed: Floats  # (echo,) s: dr/dc, c the sound speed that places are computed with; 0 where that is the water's
    model_error: float = 0.0  # m: standard error of ranges by what places are computed with, beside its speed

    def as_array_moves(self, source: Floats, shift: Floats) -> Solution:
        """Of an array that has moved between the direct arrival and the echo, so that the source (xyz) m, sonar frame,
        has shifted (echo, xyz) m there by then: to the first order, and the direct path is as long as it was."""
        longer = shift @ unit(source)  # as `by_source` has it: a transmitter may have shifted by more than it is away
        r = self.range + np.einsum("ex,ex->e", self.by_source, shift) - self.by_path * longer
        return replace(self, position=self.position * (r / self.range)[:, None], range=r)


def isovelocity_solution(delay: Floats, beam: Floats, source: Floats, sound_speed: float) -> Solution:
    """Closed form; NaN where the target would be too near the line from source to array."""
    bistatic = bistatic_range(sound_speed * delay, beam, source)
    r = np.where(bistatic.ill_conditioned, np.nan, bistatic.range)
    by_speed = bistatic.by_path * delay
    return Solution(r[:, None] * beam, r, bistatic.by_path, bistatic.by_angle, bistatic.by_source, by_speed)
