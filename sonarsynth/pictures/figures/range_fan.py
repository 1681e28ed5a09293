"""A range image as the sonar looks: a fan of ranges and azimuths, ahead is up and port is left."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats
from sonarsynth.pictures.figures.style import BACKDROP, DYNAMIC_RANGE, ENERGY_MAP, OUTLINES, decibels, figure, label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def draw_fan(axes: Axes, ranges: Floats, azimuth: Floats, energy: Floats, target: npt.NDArray[np.integer]) -> Any:
    """Cells (range, azimuth) in dB re the brightest, and outlines of those that targets are met in; ranges in m,
    azimuth in degrees, port positive."""
    angle = np.deg2rad(azimuth)
    across, ahead = -ranges[:, None] * np.sin(angle), ranges[:, None] * np.cos(angle)
    brightest = float(energy[np.isfinite(energy)].max(initial=0.0)) or 1.0
    options: dict[str, Any] = {
        "vmin": -DYNAMIC_RANGE,
        "vmax": 0.0,
        "cmap": ENERGY_MAP,
        "shading": "nearest",
        "rasterized": True,
    }
    drawn = axes.pcolormesh(across, ahead, decibels(energy, brightest), **options)
    for number in np.unique(target[target >= 0]):
        colour = OUTLINES[number % len(OUTLINES)]
        axes.contour(across, ahead, (target == number).astype(float), levels=[0.5], colors=[colour], linewidths=0.8)
    axes.set(aspect="equal", facecolor=BACKDROP)
    return drawn


def range_fan(
    title: str, ranges: Floats, azimuth: Floats, energy: Floats, target: npt.NDArray[np.integer], names: list[str]
) -> Figure:
    """The figure of one frame; names of the targets."""
    fig = figure(7.0, 5.2, layout="compressed")
    axes = fig.add_subplot()
    drawn = draw_fan(axes, ranges, azimuth, energy, target)
    fig.colorbar(drawn, label="power re the brightest cell (dB)")
    met = ", ".join(names[n] for n in np.unique(target[target >= 0]))
    label(axes, "to starboard (m)", "ahead (m)", f"{title}; outlined: {met}" if met else title)
    return fig
