"""Signal to noise: whether the parts of a store add up to its ratios, and to its images."""

from __future__ import annotations

import numpy as np
import xarray as xr

from sonarsynth.conventions import Floats
from sonarsynth.evaluation.checks import Check, SmallVariables, blocks, numbered, of_frame

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

    Frames of several targets, and images that are not by delay and sum, are asked for the first alone.
    """
    name, expected = "signal to noise", f"its parts within {ROUNDING} dB, and the images of what is loud"
    apart, compared, bad = 0.0, 0, list[int]()
    summed = str(dict(tree.attrs.get("choices") or {}).get("beamforming", {}).get("kind", "")) in BY_SUMS
    for some, i in ((block, i) for block in blocks(tree, frames) for i in block.frames):
        snr, echo = some.of("truth/targets/snr", i), _pascals(some, i, "echo")
        rest = [_pascals(some, i, part) for part in PARTS if some.has(f"truth/targets/{part}_energy")]
        known = 10.0 * np.log10(echo / np.sum(rest, axis=0))
        worst = float(np.nanmax(np.abs(known - snr), initial=0.0))
        apart = max(apart, worst)
        whole = not (np.isnan(known) ^ np.isnan(snr)).any()
        loud = np.flatnonzero(snr > LOUD)
        if summed and len(loud) == 1 and _alone(some, i) and "image" in tree.children:
            n = int(loud[0])
            whole &= _in_image(tree, i, n, echo[n], [part[n] for part in rest])
            compared += 1
        if worst > ROUNDING or not whole:
            bad.append(int(i))
    got = f"within {apart:.2g} dB" + (f", {compared} images compared" if compared else "")
    got += f", not in {len(bad)} frames" if bad else ""
    return Check(name, expected, got, not bad, {"worst_db": apart, "images": compared}, numbered(bad))


def _pascals(some: SmallVariables, frame: int, part: str) -> Floats:
    return np.asarray(10.0 ** (some.of(f"truth/targets/{part}_energy", frame) / 10.0 - 12.0))


def _alone(some: SmallVariables, frame: int) -> bool:
    """Whether a frame has one target, and its clock is right."""
    there = int((some.of("truth/targets/present", frame) == 1).sum())
    return there == 1 and bool(some.of("source_estimates/usable", frame) == 1)


def _in_image(tree: xr.DataTree, frame: int, target: int, echo: float, rest: list[float]) -> bool:
    """Whether the energy of an image in the beams of a target may be that of its parts, whatever their phases."""
    mine = of_frame(tree, "truth/beams/target", frame) == target
    energy = of_frame(tree, "image/energy", frame)[mine]
    if not mine.any() or not np.isfinite(energy).all():
        return True
    beside = float(np.sqrt(rest).sum())
    low, high = max(np.sqrt(echo) - beside, 0.0) ** 2, (np.sqrt(echo) + beside) ** 2
    margin = 10.0 ** (MARGIN / 10.0)
    return bool(low / margin <= energy.sum() <= high * margin)
