"""Draws the thumbnails of README again: python tools/docs/pictures.py."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import sonarsynth as ss

ROOT = Path(__file__).resolve().parents[2]
FRAMES = {"remus": 40, "thermocline": 40, "crowd": 0, "deep": 8, "tank": 0, "l_shape": 0, "grid": 3, "harbour": 8}
"""The frame of each shipped recipe that is drawn."""


def thumbnail(name: str, frame: int, sets: list[str]) -> None:
    """The energy image of a frame, 30 dB deep, with the boxes of the targets."""
    tree = ss.render(ss.load(ROOT / "configs" / f"{name}.yaml", sets), frame)
    energy, boxes = tree["image/energy"], tree["truth/targets/image_box"].values
    decibels = 10 * np.log10(energy.values / energy.values.max())
    azimuth, elevation = energy["azimuth"].values, energy["elevation"].values
    figure, axes = plt.subplots(figsize=(1.6, 1.2), dpi=100)
    axes.pcolormesh(azimuth, elevation, decibels, vmin=-30, cmap="inferno", shading="nearest", rasterized=True)
    for left, right, low, high in boxes:
        axes.add_patch(plt.Rectangle((left, low), right - left, high - low, fill=False, color="cyan", linewidth=0.8))
    axes.set(xlim=(azimuth[-1], azimuth[0]), ylim=(elevation[0], elevation[-1]), xticks=[], yticks=[])
    figure.subplots_adjust(0, 0, 1, 1)
    figure.savefig(ROOT / ".github" / f"{name}.png", metadata={"Software": None})
    plt.close(figure)


def main() -> None:
    """Draw all."""
    sys.path.insert(0, str(ROOT / "tools"))
    from same_numbers import harbour

    with tempfile.TemporaryDirectory() as folder:
        for name, frame in FRAMES.items():
            thumbnail(name, frame, harbour.written(Path(folder)) if name == "harbour" else [])


if __name__ == "__main__":
    main()
