"""Where echoes come from, and how loud they are."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats, azimuth_elevation
from sonarsynth.equations.noise.path_sums import echo_sums
from sonarsynth.labels.path_powers import Powers
from sonarsynth.products import FAMILIES, Arrivals, Echoes

ONE_SIDE = 0.95
"""Length of the mean direction of echoes, weighted by power, from which on they count as coming from one side."""


def echo_levels(arrivals: Arrivals, powers: Powers, targets: int, snap_level: Floats) -> Echoes:
    """Where the echoes of each target come from; snap_level: (snap,) dB re 1 uPa at 1 m, peak."""
    shape = (targets, len(FAMILIES))
    loud = (10.0 ** (np.asarray(snap_level, float) / 10.0))[arrivals.snap]
    own = powers.steps[-1] * loud
    sums = echo_sums(arrivals.target, arrivals.arrives_by, arrivals.coherent, own, arrivals.direction, shape)
    if len(part := powers.part):
        together = np.column_stack([powers.part_power, powers.part_direction]) * loud[part, None]
        np.add.at(sums, arrivals.target[part] * len(FAMILIES) + arrivals.arrives_by[part], together)
    total, size = sums[:, 0], targets * len(FAMILIES)
    level, azimuth, elevation = np.full(size, np.nan), np.full(size, np.nan), np.full(size, np.nan)
    audible = total > 0.0
    level[audible] = 10.0 * np.log10(total[audible])
    mean = sums[audible, 1:] / total[audible, None]
    clear = np.linalg.norm(mean, axis=1) > ONE_SIDE
    sided = np.flatnonzero(audible)[clear]
    azimuth[sided], elevation[sided] = azimuth_elevation(mean[clear])
    return Echoes(azimuth.reshape(shape), elevation.reshape(shape), level.reshape(shape))
