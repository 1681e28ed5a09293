"""The base of methods that locate sources: one that is added needs no more than `locate`."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.description.method import FrameSize, Method, returned_rows
from sonarsynth.equations.arrays.spherical_wave import Wavefront
from sonarsynth.products import Signals, SourceEstimates
from sonarsynth.receiver import Band, Elements
from sonarsynth.state import Emission, Receiver, Survey, Trigger

WHOLE = 0.5
"""Share of the live sensors that must have all of a pulse in the record, or it is not located. Where fewer had, 10
sources of 48 random scenes were put 1.7 m beside their places, in the median, which is 25 predicted errors."""


class LocatingMethod(Method):
    """Finds where snaps are from what the array hears. `Demand` tells `resolve` of the recipe's sources and paths."""

    def locate(self, signals: Signals, receiver: Receiver, survey: Survey, snaps: int) -> SourceEstimates:
        """The `snaps` loudest direct pulses, loudest first, one row each; NaN rows for those that were not found."""
        raise NotImplementedError(f"{type(self).__name__} locates nothing")

    def checked_estimates(self, signals: Signals, receiver: Receiver, survey: Survey, snaps: int) -> SourceEstimates:
        """What `locate` returns, once it has the shape of that."""
        found = self.locate(signals, receiver, survey, snaps)
        wide = {"position": (3,), "position_covariance": (3, 3), "position_by_speed": (3,)}
        wide |= {"as_snap_position": (3,), "as_snap_covariance": (3, 3)}
        estimates: SourceEstimates = returned_rows(self, "locate", found, SourceEstimates, "time", (), wide, snaps)
        return estimates

    def told(self, snaps: tuple[Emission, ...], receiver: Receiver, random: np.random.Generator) -> tuple[Trigger, ...]:
        """What a trigger tells the sonar of the emissions of a frame, loudest first; nothing, unless it has one.

        random: a stream of its own in each frame.
        """
        return ()

    def off_bottom_note(self) -> str:
        """What it does with sources that are not on the bottom, in a few words; empty where it treats them alike."""
        return ""

    def locates_nothing(self, elements: Elements, band: Band) -> str:
        """Why it can locate nothing by these hydrophones, heard in this band; empty where it can."""
        return ""

    def nearest(self, elements: Elements) -> float:
        """Distance (m) from the array centre within which it locates nothing."""
        return 0.0

    def cost(self, size: FrameSize) -> float:
        """As `Method.cost`."""
        return 8e-6 * size.sensors


@lru_cache(maxsize=16)
def unlocatable(elements: Elements) -> str | None:
    """Why an array can locate nothing; None where it can."""
    live, spread, _ = _extent(elements)
    if live < 3:
        return f"{live} live hydrophone{'s' * (live != 1)}: a direction needs three that are not in line"
    if not spread[1] > 1e-6 * spread[0]:
        return "the live hydrophones are in one line or in one place: they cannot tell a direction"
    return None


def ahead(wave: Wavefront, elements: Elements) -> Wavefront:
    """A wave, or what is heard alike by sensors that are in one plane: its image ahead of them where it comes from
    behind."""
    _, spread, axes = _extent(elements)
    normal = axes[2]
    if spread[2] > 1e-6 * spread[0] or not normal[0] * (wave.direction @ normal) < 0:
        return wave
    mirror = np.eye(3) - 2.0 * np.outer(normal, normal)
    return replace(wave, direction=mirror @ wave.direction, tangents=wave.tangents @ mirror)


@lru_cache(maxsize=16)
def _extent(elements: Elements) -> tuple[int, Floats, Floats]:
    """How many sensors are live, and how far (3,) m they reach along which axes (3, xyz), widest first."""
    live = elements.position[elements.gain != 0]
    about = live - live.mean(axis=0) if len(live) else live
    _, spread, axes = np.linalg.svd(np.vstack([about, np.zeros((3, 3))]), full_matrices=False)
    return len(live), spread, axes


def hearing_whole(signals: Signals, elements: Elements, times: Floats, half: float) -> Elements | None:
    """Elements of which those are dead that have not all of a pulse in the record, `half` (s) to either side of `times`
    (sensor,) in s; None where that leaves less than `WHOLE` of them, or none that tell a direction."""
    stop = signals.start + (signals.pressure.shape[1] - 1) / signals.sampling_frequency
    whole = (times - half >= signals.start) & (times + half <= stop) | (elements.gain == 0.0)
    if whole.all():
        return elements
    left = replace(elements, gain=np.where(whole, elements.gain, 0.0))
    few = np.count_nonzero(left.gain) < WHOLE * np.count_nonzero(elements.gain)
    return None if few or unlocatable(left) else left
