"""What snaps that sound alike have in common, and how others differ."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.sources.pulse_model import PulseModel, Stamp
from sonarsynth.sources.snap_models import SnapVariation

CUT = 3.0
"""Standard deviations at which a variation is cut."""


class Waveform(NamedTuple):
    """What snaps that sound alike have in common: the key of all that is kept of a pulse."""

    model: PulseModel  # a bubble at its depth
    width: float  # p(t/width)
    stamp: Stamp | None  # of the file that it comes from


class Scales(NamedTuple):
    """How snaps differ from their model: p(t) becomes gain p(t/width)."""

    gain: Floats  # (snap,)
    width: Floats  # (snap,)


def waveform(model: PulseModel, width: float = 1.0) -> Waveform:
    """The waveform of a described snap that lasts `width` times as long. Raises ValueError for a file that is gone."""
    return Waveform(model, width, model.file)


def scales(variation: SnapVariation, generator: np.random.Generator, snaps: int) -> Scales:
    """Gain and width of snaps, from two numbers of the stream each, whatever the variation: one that is 0 changes no
    other."""
    from scipy.special import ndtr, ndtri

    edge = float(ndtr(-CUT))
    normal = ndtri(edge + (1.0 - 2.0 * edge) * generator.random((snaps, 2)))
    return Scales(10.0 ** (variation.level * normal[:, 0] / 20.0), np.exp(variation.width * normal[:, 1]))


def largest_scales(variation: SnapVariation) -> tuple[float, float]:
    """Bounds on the gain and the width, for laying out windows; the smallest are their inverses."""
    return float(10.0 ** (CUT * variation.level / 20.0)), float(np.exp(CUT * variation.width))
