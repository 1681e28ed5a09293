"""Signal to noise: whether the parts of a store add up to its ratios, and to its images."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.evaluation.checks import SmallVariables, blocks, numbered, of_frame
from sonarsynth.store.checking.check_rows import Check

if TYPE_CHECKING:
    import xarray as xr

PARTS = ("chorus", "reverberation", "noise", "electronics")
ROUNDING = 0.01
"""dB between a ratio and that of its parts."""
MARGIN = 1.5
"""dB that errors of sensors, and beams that are focused better, may change of an image."""
LOUD = 10.0
"""dB: of targets with more, the image must have the echo."""
BY_SUMS = ("focused", "dense")


def signal_to_noise(tree: xr.DataTree, frames: np.ndarray) -> Check:
    """Echo over the sum of the parts is the ratio; and where a target alone is much louder than all of them, the image
    has the energy of its echo, as far as parts that add or cancel may change that.

    Of frames with several targets, and of images that are not by delay and sum, only the ratio is checked.
    """
    name, expected = "signal to noise", f"its parts within {ROUNDING} dB, and the images of what is loud"
    apart, compared, bad = 0.0, 0, list[int]()
    summed = str(dict(tree.attrs.get("choices") or {}).get("beamforming", {}).get("kind", "")) in BY_SUMS
    for block, i in ((b, i) for b in blocks(tree, frames) for i in b.frames):
        snr, echo = block.of("truth/targets/snr", i), _pascals(block, i, "echo")
        noises = [_pascals(block, i, part) for part in PARTS if block.has(f"truth/targets/{part}_energy")]
        ratio = 10.0 * np.log10(echo / np.sum(noises, axis=0))
        worst = float(np.nanmax(np.abs(ratio - snr), initial=0.0))
        apart = max(apart, worst)
        consistent = not (np.isnan(ratio) ^ np.isnan(snr)).any()
        loud = np.flatnonzero(snr > LOUD)
        if summed and len(loud) == 1 and _alone(block, i) and "image" in tree.children:
            n = int(loud[0])
            consistent &= _in_image(tree, i, n, echo[n], [part[n] for part in noises])
            compared += 1
        if worst > ROUNDING or not consistent:
            bad.append(int(i))
    result = f"within {apart:.2g} dB" + (f", {compared} images compared" if compared else "")
    result += f", not in {len(bad)} frames" if bad else ""
    return Check(name, expected, result, not bad, {"worst_db": apart, "images": compared}, numbered(bad))


def _pascals(block: SmallVariables, frame: int, part: str) -> Floats:
    return np.asarray(10.0 ** (block.of(f"truth/targets/{part}_energy", frame) / 10.0 - 12.0))


def _alone(block: SmallVariables, frame: int) -> bool:
    """Whether a frame has one target, and its clock is right."""
    present = int((block.of("truth/targets/present", frame) == 1).sum())
    return present == 1 and bool(block.of("source_estimates/usable", frame) == 1)


def _in_image(tree: xr.DataTree, frame: int, target: int, echo: float, noises: list[float]) -> bool:
    """Whether the energy of an image in the beams of a target may be that of its parts, whatever their phases."""
    on_target = of_frame(tree, "truth/beams/target", frame) == target
    energy = of_frame(tree, "image/energy", frame)[on_target]
    if not on_target.any() or not np.isfinite(energy).all():
        return True
    beside = float(np.sqrt(noises).sum())
    low, high = max(np.sqrt(echo) - beside, 0.0) ** 2, (np.sqrt(echo) + beside) ** 2
    margin = 10.0 ** (MARGIN / 10.0)
    return bool(low / margin <= energy.sum() <= high * margin)
