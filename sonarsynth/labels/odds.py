"""How often a target is found where the image is brightest, and by how much targets stand out, in some frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Bools, Floats, counted


@dataclass(frozen=True)
class Odds:
    """Of some frames that were made."""

    frames: int  # with an image, and a target that is no clutter in view
    found: int  # of these: whose brightest beam is on a target, or within a beam width of its outline
    snr: tuple[float, ...] = ()  # dB, of such targets in all of them; none where echoes are all that is heard

    @property
    def line(self) -> str:
        """What `plan` says; "" where no frame has a target in view."""
        if not self.frames:
            return ""
        text = f"of {counted(self.frames, 'frame')} with a target, the brightest beam is on it in {self.found}"
        if not self.snr:
            return text
        low, middle, high = np.quantile(self.snr, (0.0, 0.5, 1.0))
        return f"{text}; snr of targets {low:.0f} to {high:.0f} dB, median {middle:.0f}"

    def __add__(self, other: Odds) -> Odds:
        return Odds(self.frames + other.frames, self.found + other.found, self.snr + other.snr)


NO_ODDS = Odds(0, 0)
"""Of no frame."""


def odds(energy: Floats, beam_target: npt.NDArray[np.int16], clutter: Bools, snr: Floats | None, reach: int) -> Odds:
    """Of one frame: its image (elevation, azimuth), the target of each beam (-1: none), which targets are clutter
    (target,), their ratios (target,) dB, and a beam width in beams."""
    from scipy.ndimage import binary_dilation

    of = np.append(~clutter, False)[beam_target]  # beams on nothing: the last
    if not of.any() or not np.isfinite(energy).any():
        return NO_ODDS
    rows, columns = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    near = binary_dilation(of, rows**2 + columns**2 <= reach**2)
    on_target = bool(near.ravel()[int(np.nanargmax(energy))])
    ratios = np.zeros(0) if snr is None else snr[~clutter & np.isfinite(snr)]
    return Odds(1, int(on_target), tuple(ratios.tolist()))
