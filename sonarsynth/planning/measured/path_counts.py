"""How many paths a frame has room for in a store."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sonarsynth.planning.measured.sampled_arrivals import arrivals_of
from sonarsynth.planning.measured.sampled_frames import SampledScene
from sonarsynth.planning.plans import Plan

COUNTED = 5
"""Sequences whose paths are counted, each in its first, middle and last frame that was looked at."""
ROOM = 1.5
"""Times the most paths of these frames: what a frame has beyond is left out, the faintest, and counted in the store."""


def room_for_paths(plan: Plan, looks: Sequence[SampledScene]) -> int:
    """Room for the paths of every frame of a dataset, as far as some of its frames tell."""
    real = [look for look in looks if look.real]
    most = 1
    for look in real[:: -(-len(real) // COUNTED)]:
        for n in np.unique([0, len(look.frames) // 2, len(look.frames) - 1]):
            frame = look.frames[n]
            most = max(most, len(arrivals_of(plan.at(frame.index), frame).delay))
    return int(np.ceil(ROOM * most))
