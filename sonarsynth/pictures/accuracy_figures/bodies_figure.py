"""Echoes of bodies: error against the number of facets and against run time, and levels with the exact curve under."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from sonarsynth.conventions import Floats
from sonarsynth.pictures.figures.style import INK, PALE, RAYS, figure, grid, label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHAPES = ("o", "s", "^", "D")
FLOOR = 1e-17
"""Errors below, 0 among them, are drawn here."""


@dataclass(frozen=True)
class RefinementCurve:
    """One body or method, from coarse to fine."""

    name: str
    facets: Sequence[int]
    milliseconds: Sequence[float]
    error: Sequence[float]
    bound: Sequence[float]


@dataclass(frozen=True, eq=False)
class Curve:
    """Levels along one axis."""

    name: str
    x: Floats  # (point,)
    level: Floats  # (point,) dB
    style: Literal["exact", "facets", "other"]
    colour: int
    """Of `RAYS`; an exact curve and the one over it have the same."""


@dataclass(frozen=True, eq=False)
class Panel:
    """Levels along one axis, with what they are compared with under them."""

    title: str
    x: str
    y: str
    curves: tuple[Curve, ...]
    lowest: float  # dB; what is below is cut off
    highest: float  # dB
    limit: float | None = None
    """Along x: how far an error is claimed."""
    bounds: tuple[float, ...] = ()
    """dB: lines along x."""


def bodies_figure(title: str, trades: Mapping[str, Sequence[RefinementCurve]], panels: Sequence[Panel]) -> Figure:
    """Errors of ever finer meshes over facets and over CPU time, logarithmic; then levels, two panels a row.

    trades: a row for each kind of error, under its name and unit.
    """
    rows = len(trades) + (len(panels) + 1) // 2
    fig = figure(12.0, 4.3 * rows, dpi=110)
    axes = fig.subplots(rows, 2, squeeze=False)
    for slot, (error, of) in zip(axes, trades.items(), strict=False):
        _trades(slot[0], of, [trade.facets for trade in of], "facets", error)
        _trades(slot[1], of, [trade.milliseconds for trade in of], "CPU time of one core an aspect (ms)", error)
        slot[0].set_title("error against number of facets; dotted: bound", fontsize=10, color=INK, loc="left")
        slot[1].set_title("error against run time, 18 frequencies", fontsize=10, color=INK, loc="left")
    for slot, panel in zip(axes[len(trades) :].ravel(), panels, strict=False):
        _levels(slot, panel)
    fig.suptitle(title, fontsize=11, color=INK, x=0.01, ha="left")
    return fig


def _trades(
    axes: Axes, trades: Sequence[RefinementCurve], costs: Sequence[Sequence[float]], name: str, error: str
) -> None:
    grid(axes)
    axes.set_xscale("log")
    axes.set_yscale("log")
    for i, (trade, cost) in enumerate(zip(trades, costs, strict=True)):
        colour = RAYS[i % len(RAYS)]
        drawn = [max(value, FLOOR) for value in trade.error]
        axes.plot(cost, drawn, "-" + SHAPES[i % 4], color=colour, markersize=5, linewidth=1.2, label=trade.name)
        axes.plot(cost, trade.bound, ":", color=colour, linewidth=1.2)
    label(axes, name, error)
    if trades:
        axes.legend(fontsize=8, frameon=False)


def _levels(axes: Axes, panel: Panel) -> None:
    grid(axes)
    for curve in panel.curves:
        colour = RAYS[curve.colour]
        level = curve.level.clip(panel.lowest - 50.0)
        if curve.style == "exact":
            axes.plot(curve.x, level, color=colour, linewidth=4.0, alpha=0.3, solid_capstyle="butt", label=curve.name)
        elif curve.style == "facets":
            dashes = "-" if curve.colour == 0 else (0, (6, 3))
            axes.plot(curve.x, level, color=colour, linewidth=1.0, linestyle=dashes, label=curve.name)
        else:
            axes.plot(curve.x, level, ":", color=INK, linewidth=1.0, label=curve.name)
    for bound in panel.bounds:
        axes.axhline(bound, color=PALE, linewidth=0.8)
    if panel.limit is not None:
        axes.axvline(panel.limit, color=PALE, linewidth=0.8)
    axes.set_xlim(float(panel.curves[0].x.min()), float(panel.curves[0].x.max()))
    axes.set_ylim(panel.lowest, panel.highest)
    label(axes, panel.x, panel.y, panel.title)
    axes.legend(fontsize=8, frameon=False, ncols=2)
