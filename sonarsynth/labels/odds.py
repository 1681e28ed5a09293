"""How often a target is found where the image is brightest, and by how much targets stand out, in some frames."""

from __future__ import annotations

from dataclasses import dataclass
from math import isqrt
from typing import Final

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Bools, Floats, binomial_band, counted

PEAKS: Final = 3
"""Brightest peaks of an image that are looked at."""


@dataclass(frozen=True)
class Odds:
    """Of some frames that were made of a scene with more than echoes."""

    frames: int  # with an image, and a target that is no clutter in view
    found: int  # of these: whose brightest beam is on a target, or within a beam width of its outline
    among_peaks: int  # of these: where one of the `PEAKS` brightest peaks is
    chance: float = 0.0  # of these, on average: where a beam at random is
    snr: tuple[float, ...] = ()  # dB, of such targets in all of them

    @property
    def line(self) -> str:
        """What `plan` says; "" where no frame has a target in view."""
        if not self.frames:
            return ""
        text = (
            f"of {counted(self.frames, 'frame')} with a target, the brightest beam is on it in "
            f"{self._share(self.found)}, a beam at random in {self.chance:.2g}, "
            f"one of the {PEAKS} brightest peaks in {self._share(self.among_peaks)}"
        )
        if not self.snr:
            return text
        low, middle, high = np.quantile(self.snr, (0.0, 0.5, 1.0))
        return f"{text}; snr of targets {low:.0f} to {high:.0f} dB, median {middle:.0f}"

    def _share(self, hits: int) -> str:
        low, high = binomial_band(hits, self.frames)
        return f"{hits} (95 %: {low:.2f} to {high:.2f})"

    def __add__(self, other: Odds) -> Odds:
        return Odds(*(mine + more for mine, more in zip(vars(self).values(), vars(other).values(), strict=True)))


NO_ODDS = Odds(0, 0, 0)
"""Of no frame."""


def odds(
    energy: Floats, beam_target: npt.NDArray[np.int16], clutter: Bools, snr: Floats | None, reach: tuple[int, int]
) -> Odds:
    """Of one frame: its image (elevation, azimuth), the target of each beam (-1: none), which targets are clutter
    (target,), their ratios (target,) dB (none where echoes are all that is heard: no odds), a beam width in beams
    (along elevation and azimuth). A peak is as bright as any beam so near to it."""
    from scipy.ndimage import distance_transform_edt

    of = np.append(~clutter, False)[beam_target]  # beams on nothing: the last
    if snr is None or not of.any() or not np.isfinite(energy).any():
        return NO_ODDS
    heard = np.where(np.isfinite(energy), energy, -np.inf)
    peaks = np.where(brightest_about(heard, reach) == heard, heard, -np.inf).ravel()
    best = np.argsort(-peaks, kind="stable")[:PEAKS]
    near = distance_transform_edt(~of, sampling=1.0 / np.array(reach)) <= 1.0 + 1e-9
    on_target = near.ravel()[best] & np.isfinite(peaks[best])
    ratios = snr[~clutter & np.isfinite(snr)]
    return Odds(1, int(on_target[0]), int(on_target.any()), float(near.mean()), tuple(ratios.tolist()))


def brightest_about(energy: Floats, reach: tuple[int, int]) -> Floats:
    """The brightest beam within `reach` beams (along both) of each (elevation, azimuth), a row of the ellipse at a
    time: a beam of one hydrophone fills the image, and takes a minute by all beams at once."""
    from scipy.ndimage import maximum_filter1d

    rows, highest = len(energy), energy.copy()
    high, wide = reach
    for off in range(min(high, rows - 1) + 1):
        width = 2 * (isqrt(wide**2 * (high**2 - off**2)) // high) + 1
        along = maximum_filter1d(energy, width, axis=1, mode="constant", cval=-np.inf)
        for to, of in ((slice(off, rows), slice(0, rows - off)), (slice(0, rows - off), slice(off, rows))):
            highest[to] = np.maximum(highest[to], along[of])
    return highest
