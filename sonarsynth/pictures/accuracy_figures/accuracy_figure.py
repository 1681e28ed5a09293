"""Error against run time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sonarsynth.pictures.figures.style import INK, PALE, RAYS, figure, grid, label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FLOOR = 1e-17
"""s: errors below, 0 among them, are drawn here."""

SHAPES = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*")


@dataclass(frozen=True)
class Mark:
    """One case: what it is compared with, its cost and its error."""

    name: str
    group: str
    microseconds: float
    error: float  # s


@dataclass(frozen=True)
class Line:
    """One method on one case, at several costs."""

    name: str
    microseconds: tuple[float, ...]
    error: tuple[float, ...]  # s


BELLHOP = (
    Line("Pekeris", (42.0, 547.0), (4e-6, 7e-7)),
    Line("linear", (39.0, 482.0), (1e-5, 8e-6)),
    Line("Munk", (27.0, 316.0), (2e-2, 3e-3)),
    Line("thermocline", (34.0, 387.0), (2e-4, 2e-4)),
)
"""Bellhop (Fortran), 4001 beams, one core: time and largest time error of an eigenray with its default step and with a
sixteenth of it. Measured once, in waters of their own; not by the run that draws them."""


def error_and_time_figure(marks: Sequence[Mark], lines: Sequence[Line]) -> Figure:
    """Largest error of the travel time (s) over the CPU time of an eigenray (us), both logarithmic.

    marks: cases that are exact to rounding, their colour telling the group; lines: knobs, from coarse to fine.
    """
    fig = figure(10.5, 6.2, dpi=110)
    axes = fig.add_subplot()
    grid(axes)
    axes.set_xscale("log")
    axes.set_yscale("log")
    groups = list(dict.fromkeys(mark.group for mark in marks))
    counts: dict[str, int] = dict.fromkeys(groups, 0)
    for mark in marks:
        shape = SHAPES[counts[mark.group] % len(SHAPES)]
        counts[mark.group] += 1
        colour = RAYS[groups.index(mark.group) % len(RAYS)]
        name = f"{mark.name} ({mark.group})"
        axes.plot(
            mark.microseconds,
            max(mark.error, FLOOR),
            shape,
            color=colour,
            markersize=6,
            alpha=0.85,
            linestyle="",
            label=name,
        )
    for i, line in enumerate(lines):
        errors = [max(error, FLOOR) for error in line.error]
        axes.plot(line.microseconds, errors, "-o", color=RAYS[-2 - i], markersize=4, linewidth=1.2, label=line.name)
    _bellhop(axes)
    axes.set_xlim(0.3, 3e3)
    label(axes, "CPU time of one core an eigenray (us)", "largest error of the travel time (s)")
    axes.set_title("Eigenrays: error against run time", fontsize=10, color=INK, loc="left")
    axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False)
    fig.supxlabel(
        "Bellhop's points are from earlier measurements in waters of their own (4001 beams; default step, a sixteenth "
        f"of it), not from this run. Errors below {FLOOR:g} s are drawn there.",
        fontsize=7,
        color=PALE,
    )
    return fig


def _bellhop(axes: Axes) -> None:
    for i, line in enumerate(BELLHOP):
        name = "Bellhop (measured earlier)" if i == 0 else None
        axes.plot(line.microseconds, line.error, "--x", color=PALE, markersize=6, linewidth=0.8, label=name)
        axes.annotate(
            line.name,
            (line.microseconds[-1], line.error[-1]),
            xytext=(5, -3),
            textcoords="offset points",
            fontsize=7,
            color=PALE,
        )
