"""Error against run time of the solvers of a collapsing bubble."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from sonarsynth.pictures.figures.style import INK, PALE, figure, grid, label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS: Final = ("#0072B2", "#56B4E9", "#E69F00", "#D55E00", "#CC79A7", "#009E73")
"""One a solver (Okabe and Ito 2008)."""
STYLES: Final[tuple[tuple[Literal["-", "--", ":"], str, float], ...]] = (
    ("-", "o", 1.6),
    ("--", "s", 0.9),
    (":", "^", 0.9),
)
"""Line, mark and width: one a form."""
TITLE: Final = (
    "A hard collapse (Keller-Miksis) and its rebound: error against run time, at tolerances from 1e-3 to 1e-12"
)


@dataclass(frozen=True)
class SolverLine:
    """A solver on one form of the equation, at falling tolerances; its points are those where it did not give up."""

    form: str
    method: str
    milliseconds: tuple[float, ...]
    evaluations: tuple[int, ...]
    error: tuple[float, ...]  # relative


def solver_figure(lines: Sequence[SolverLine], default: SolverLine | None) -> Figure:
    """Relative error over the CPU time (ms) of a bubble, and over the evaluations of its equation: all logarithmic.

    Colours tell the solvers, strokes the forms: whole for the first. default: one point, what is used.
    """
    fig = figure(11.5, 5.4, dpi=110)
    left, right = fig.subplots(1, 2, sharey=True)
    methods = list(dict.fromkeys(line.method for line in lines))
    forms = list(dict.fromkeys(line.form for line in lines))
    for axes, over in ((left, "milliseconds"), (right, "evaluations")):
        grid(axes)
        axes.set_xscale("log")
        axes.set_yscale("log")
        for line in lines:
            stroke, mark, width = STYLES[forms.index(line.form) % len(STYLES)]
            colour = COLOURS[methods.index(line.method) % len(COLOURS)]
            values = getattr(line, over)
            axes.plot(values, line.error, stroke, marker=mark, color=colour, linewidth=width, markersize=4)
        if default is not None:
            _mark(axes, getattr(default, over)[0], default.error[0])
    label(left, "CPU time of one core a bubble (ms)", "larger relative error of collapse and rebound radius")
    label(right, "evaluations of the equation", "")
    _legend(right, methods, forms, default)
    fig.supxlabel("A point is missing where a solver gave up.", fontsize=7, color=PALE)
    fig.suptitle(TITLE, fontsize=10, color=INK, x=0.01, ha="left")
    return fig


def _mark(axes: Axes, x: float, y: float) -> None:
    axes.plot([x], [y], "*", color="black", markersize=15, markeredgecolor="white", markeredgewidth=0.8, zorder=5)


def _legend(axes: Axes, methods: Sequence[str], forms: Sequence[str], default: SolverLine | None) -> None:
    from matplotlib.lines import Line2D

    keys = [Line2D([], [], color=COLOURS[i % len(COLOURS)], linewidth=2.5, label=m) for i, m in enumerate(methods)]
    for i, form in enumerate(forms):
        stroke, mark, width = STYLES[i % len(STYLES)]
        keys.append(
            Line2D([], [], color=PALE, linestyle=stroke, marker=mark, markersize=4, linewidth=width, label=form)
        )
    if default is not None:
        name = f"the default: {default.method}, {default.form}"
        keys.append(Line2D([], [], color="black", marker="*", markersize=11, linestyle="", label=name))
    axes.legend(handles=keys, fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False)
