"""Target strength round a body."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sonarsynth.conventions import Floats, evenly
from sonarsynth.pictures.figures.style import DYNAMIC_RANGE, ENERGY_MAP, INK, RAYS, figure, label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.projections.polar import PolarAxes

CURVES: Final = 3
"""Frequencies drawn in the polar diagram, beside the mean of the band."""


def strength_figure(title: str, aspect: Floats, frequency: Floats, strength: Floats) -> Figure:
    """Target strength (aspect, frequency) in dB re 1 m2 over aspects (rad, 0 ahead, port positive) and frequency (Hz).

    Polar, bow up and port on the left, at the lowest, middle and highest frequency with the mean power of the band; and
    all of it over frequency where there are several. Levels more than 50 dB below the highest are drawn there.
    """
    several = len(frequency) > 1 and len(aspect) > 1
    fig = figure(11.0 if several else 6.2, 5.8, dpi=110)
    top = float(np.max(strength, initial=-300.0, where=np.isfinite(strength)))
    top = 5.0 * np.ceil(top / 5.0)
    polar: PolarAxes = fig.add_subplot(1, 1 + several, 1, projection="polar")  # type: ignore[assignment]
    _rose(polar, aspect, frequency, strength, top)
    if several:
        _map(fig, fig.add_subplot(1, 2, 2), aspect, frequency, strength, top)
    fig.suptitle(title, fontsize=10, color=INK, x=0.01, ha="left")
    return fig


def _rose(axes: PolarAxes, aspect: Floats, frequency: Floats, strength: Floats, top: float) -> None:
    low = top - DYNAMIC_RANGE
    axes.set_theta_zero_location("N")
    line = "-" if len(aspect) > 1 else "o"
    for n, i in enumerate(evenly(len(frequency), CURVES)):
        level = np.maximum(strength[:, i], low)
        axes.plot(aspect, level, line, color=RAYS[n], linewidth=0.8, markersize=4, label=f"{frequency[i] / 1e3:g} kHz")
    if len(frequency) > 1:
        with np.errstate(divide="ignore"):
            mean = 10.0 * np.log10(np.mean(10.0 ** (strength / 10.0), axis=1))
        axes.plot(aspect, np.maximum(mean, low), line, color=INK, linewidth=1.6, markersize=4, label="mean power")
    axes.set_ylim(low, top)
    axes.set_yticks(np.arange(low + 10.0, top + 1.0, 10.0))
    axes.tick_params(labelsize=8, colors=INK)
    axes.grid(color="#dddddd", linewidth=0.5)
    axes.set_rlabel_position(200.0)
    for text in axes.get_yticklabels():
        text.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.8})
    axes.set_xlabel("target strength (dB re 1 m2); bow up, port on the left", fontsize=8, color=INK)
    axes.legend(fontsize=7, loc="lower left", bbox_to_anchor=(-0.12, -0.1), frameon=False)


def _map(fig: Figure, axes: Axes, aspect: Floats, frequency: Floats, strength: Floats, top: float) -> None:
    from matplotlib.ticker import AutoLocator, MultipleLocator

    low = top - DYNAMIC_RANGE
    shown = axes.pcolormesh(
        frequency / 1e3,
        np.rad2deg(aspect),
        np.maximum(strength, low),
        cmap=ENERGY_MAP,
        vmin=low,
        vmax=top,
        shading="nearest",
        rasterized=True,
    )
    label(axes, "frequency (kHz)", "aspect (deg, 0 bow, 90 port)")
    axes.yaxis.set_major_locator(MultipleLocator(45.0) if np.ptp(aspect) > np.pi else AutoLocator())
    bar = fig.colorbar(shown, ax=axes, fraction=0.05, pad=0.02)
    bar.set_label("target strength (dB re 1 m2)", fontsize=8)
    bar.ax.tick_params(labelsize=8)
