"""What water absorbs along whole paths: the mean over the depths that each of them passes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats, depth
from sonarsynth.environment.absorption import DepthAbsorption
from sonarsynth.state import Emission
from sonarsynth.tracing.receive_paths import ReceivePaths

if TYPE_CHECKING:
    from sonarsynth.tracing.facet_paths import FacetPaths
    from sonarsynth.tracing.transmit_paths import TransmitPaths


def path_loss(array: FacetPaths, snap: Emission, legs: ReceivePaths, out: TransmitPaths | None = None) -> Floats:
    """Absorption (path,) in dB along legs to the array and, of echoes, along the ways out to where they start."""
    absorption = array.context.medium.absorption
    if not isinstance(absorption, DepthAbsorption):
        return np.asarray(absorption * (legs.length if out is None else out.length + legs.length))
    start, profile = depth(legs.point), array.bending.profile
    end = np.full(len(start), float(depth(array.context.receiver.pose.position)))
    lost = absorption.lost(legs.length, profile, start, end, legs.departure[:, 2], legs.bounces + legs.turning)
    if out is None:
        return lost
    source = np.full(len(start), float(depth(snap.position)))
    reversed_way = profile, start, source, -out.arrival[:, 2], out.bounces + out.turning
    return lost + absorption.lost(out.length, *reversed_way)
