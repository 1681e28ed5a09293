"""Error against run time, of stages of a frame or quantities of a reference: knobs, choice, peers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any

from sonarsynth.pictures.figures.style import INK, PALE, RAYS, figure, grid, label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHAPES = ("o", "s", "^", "D", "v", "P", "<", ">")
PEERS = ("X", "*", "p", "P", "d", "^", "v", "s")
DECADES = 1.5
"""Errors of 0 are drawn so many decades below the smallest other one."""
CHOSEN = "#D55E00"
FRONTIER = "#d9d9d9"
NARROWEST = 5.0
"""The axis of times reaches at least so many times to either side of its middle."""


@dataclass(frozen=True)
class Line:
    """One knob, or one peer: costs and errors of its settings."""

    name: str
    cost: tuple[float, ...]
    error: tuple[float, ...]
    peer: bool = False


@dataclass(frozen=True)
class Panel:
    """One stage, or one quantity of a reference."""

    title: str
    unit: str
    allowed: float  # inf: nothing is asked for
    lines: tuple[Line, ...]
    chosen: tuple[float, float] | None = None  # cost, error; None: nothing was to be chosen
    cost: str = "CPU time of one core a frame (ms)"


def frontier_figure(title: str, panels: Sequence[Panel], note: str) -> Figure:
    """Panels, two in a row: error over CPU time, both logarithmic."""
    rows = -(-len(panels) // 2)
    fig = figure(13.0, 0.7 + 4.3 * rows, dpi=100)
    fig.suptitle(title, x=0.01, ha="left", fontsize=12, color=INK)
    for n, panel in enumerate(panels):
        _draw(fig.add_subplot(rows, 2, n + 1), panel)
    fig.supxlabel(note, fontsize=8, color=PALE)
    return fig


def _draw(axes: Axes, panel: Panel) -> None:
    errors = [e for e in (panel.allowed, *(e for line in panel.lines for e in line.error)) if isfinite(e)]
    floor = min(e for e in errors if e > 0.0) * 10.0**-DECADES
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.axhline(floor, color=PALE, linewidth=0.6, linestyle=":")
    if isfinite(panel.allowed):
        axes.axhline(panel.allowed, color=INK, linewidth=0.9, linestyle="--", label=f"allowed, {panel.allowed:g}")
    if panel.chosen is not None:
        _choice(axes, panel, panel.chosen, floor)
    for peer, shapes in ((False, SHAPES), (True, PEERS)):
        for n, line in enumerate(line for line in panel.lines if line.peer == peer):
            pairs = sorted(zip(line.cost, (max(e, floor) for e in line.error), strict=True))
            style: dict[str, Any] = (
                {"color": INK, "markersize": 8, "linestyle": ":", "linewidth": 0.8}
                if line.peer
                else {"color": RAYS[n % len(RAYS)], "markersize": 5, "linewidth": 1.0}
            )
            axes.plot(*zip(*pairs, strict=True), marker=shapes[n % len(shapes)], label=line.name, **style)
    _finish(axes, panel, floor)


def _finish(axes: Axes, panel: Panel, floor: float) -> None:
    """Limits, names and legend."""
    from matplotlib.ticker import NullFormatter

    grid(axes)
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, 0.5 * floor), high)
    left, right = axes.get_xlim()
    middle = (left * right) ** 0.5
    axes.set_xlim(min(left, middle / NARROWEST), max(right, middle * NARROWEST))
    axes.xaxis.set_minor_formatter(NullFormatter())
    label(axes, panel.cost, f"error ({panel.unit})", panel.title)
    axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, labelspacing=0.7)


def _choice(axes: Axes, panel: Panel, chosen: tuple[float, float], floor: float) -> None:
    """A ring at what was chosen, and the step line under which no setting of ours lies."""
    at = (chosen[0], max(chosen[1], floor))
    axes.plot(*at, "o", markersize=4, color=CHOSEN, zorder=5)
    ring: dict[str, Any] = {"markerfacecolor": "none", "markeredgecolor": CHOSEN, "markeredgewidth": 2.2}
    axes.plot(*at, "o", markersize=15, linestyle="", label="chosen", zorder=5, **ring)
    points = sorted(
        (x, max(y, floor))
        for x, y in [
            chosen,
            *(at for line in panel.lines if not line.peer for at in zip(line.cost, line.error, strict=True)),
        ]
    )
    best: list[tuple[float, float]] = []
    for x, y in points:
        if not best or y < best[-1][1]:
            best.append((x, y))
    if len(best) > 1:
        axes.step([p[0] for p in best], [p[1] for p in best], where="post", color=FRONTIER, linewidth=4, zorder=1,
                  label="frontier")  # fmt: skip
