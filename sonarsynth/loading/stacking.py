"""Images of a still scene stacked: the median over windows, which single loud windows do not decide."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Final

import numpy as np

from sonarsynth.detection import beam_widths
from sonarsynth.store import some_frames

if TYPE_CHECKING:
    import xarray as xr

EFFICIENCY: Final = 2.0 / np.pi
"""Of a median of many Gaussian numbers: the variance of their mean over its own (Cramer 1946, section 28.5)."""


def stack(tree: xr.DataTree, frames: int | Iterable[int] | None = None) -> xr.DataArray:
    """Median energy (elevation, azimuth) in Pa2 s over frames in which nothing moves by more than half a beam.

    Windows without an image are left out; windows that a loud stranger spoils count as any other, which moves the
    median little. What it gains over one window: `stacked_index`.

    Parameters
    ----------
    tree: of a store.
    frames: numbers, or a mask (frame,); left out, all that were built.

    Raises
    ------
    ValueError where the store has no image, no frame is left, or a target moves too far over the array's view;
    IndexError for a frame that is not there.
    """
    if "image" not in tree.children:
        raise ValueError("the store has no image")
    chosen = np.asarray(some_frames(tree, frames), int)
    energy = tree["image"].dataset["energy"].isel(frame=chosen)
    imaged = np.isfinite(energy.values).any(axis=(1, 2))
    if not imaged.any():
        raise ValueError("none of the frames has an image")
    targets = tree["truth/targets"].dataset
    boxes = targets["image_box"].isel(frame=chosen[imaged]).values
    width = np.rad2deg(beam_widths(tree))[[0, 0, 1, 1]]  # of the sides of a box
    for number, name in enumerate(targets["target"].values):
        own = boxes[:, number][np.isfinite(boxes[:, number]).all(axis=1)]
        moved = np.ptp(own, axis=0) if len(own) else np.zeros(4)
        most = int((moved / width).argmax())
        if moved[most] > 0.5 * width[most]:
            raise ValueError(
                f"{name} moves {moved[most]:.1f} deg in these frames: more than half of a beam of {width[most]:.1f} deg"
            )
    return energy.isel(frame=imaged).median("frame", keep_attrs=True)


def stacked_index(ratio: float, degrees: float, windows: float) -> float:
    """Standard deviations by which an echo is told in a median over windows of Gaussian noise.

    r sqrt(0.64 M B T): r the energy of the echo over that of the noise in its beam, B T the degrees of freedom of a
    window (its length times the band, of which the energy of noise varies by 1/sqrt(B T)), M windows.

    Parameters
    ----------
    ratio: r in dB.
    degrees: B T.
    windows: M, many.

    Returns
    -------
    The index; 5 takes M = (5/r)^2/(0.64 B T) windows.
    """
    return float(10.0 ** (ratio / 10.0) * np.sqrt(EFFICIENCY * windows * degrees))
