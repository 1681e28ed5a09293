"""Error against run time of solvers, with the stretched clock and without it, on a hard collapse and its rebound."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from sonarsynth.equations.bubble import bubble_collapse
from sonarsynth.equations.bubble.bubble_collapse import Cavity, Method
from sonarsynth.pictures.accuracy_figures.bubble_figure import SolverLine, solver_figure
from sonarsynth.validation.bubbles.bubble_checks import SERIES, TOLERANCE, described, exact
from sonarsynth.validation.references.bubble_forms import Form, Run, solve
from sonarsynth.validation.validation_rows import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sonarsynth.pictures.accuracy_figures.bubble_figure import SolverLine

GAS = 100.0  # Pa, at 5 m: Mach 0.74
QUANTITY = "smallest radius, rebound"
DEFAULTS = " (default)"
"""A knob is "form, method", with this at the end for the default."""
TOLERANCES: Final = (1e-3, 1e-6, 1e-9, 1e-12)
FORMS: Final[dict[str, Form | None]] = {"stretched clock": None, "R in t": "plain", "ln R in t": "logarithm"}
"""Names of the forms; that of the stretched clock is what snaps are made with."""
DEFAULT: Final[tuple[str, Method, float]] = ("stretched clock", "DOP853", 1e-10)
BOUND: Final = {"stretched clock": 30.0, "R in t": 300.0, "ln R in t": 300.0}
"""Errors allowed over the solver's tolerance: local errors add up, and a late collapse is another one."""


class Point(NamedTuple):
    """A solver at a tolerance."""

    form: str
    method: Method
    tolerance: float
    milliseconds: float
    radii: float  # relative error of the smallest radius or the rebound, whichever is worse; NaN where it gave up
    collapse: float  # relative error of the time of the collapse
    evaluations: int


def solver_rows(quick: bool) -> Iterator[Row]:
    """Radii and the time of the collapse, a solver, form and tolerance after the other; and of the default."""
    for p in solver_points(quick):
        default = (p.form, p.method, p.tolerance) == DEFAULT
        case = f"{p.form}, {p.method} {p.tolerance:g}"
        knob = f"{p.form}, {p.method}{DEFAULTS if default else ''}"
        columns = p.milliseconds, "ms a bubble", {"evaluations": p.evaluations}, knob
        if np.isnan(p.radii):
            note = "the solver gives up: its steps are shorter than float64 tells apart"
            yield Row(case, SERIES, "gave up", "", 1.0, 1.0, *columns, note)
            continue
        expected, note = (TOLERANCE, "the default") if default else (BOUND[p.form] * p.tolerance, "")
        yield Row(case, SERIES, QUANTITY, "1", expected, p.radii, *columns, note)
        yield Row(case, SERIES, "collapse time", "1", expected, p.collapse, *columns, note)


def solver_points(quick: bool) -> list[Point]:
    """All solvers at all tolerances; quick: the explicit ones, at three."""
    cavity = described(GAS)
    methods: list[Method] = ["DOP853", "LSODA"] if quick else ["DOP853", "RK45", "LSODA", "Radau", "BDF"]
    points = []
    for form in FORMS:
        for method in methods:
            for tolerance in TOLERANCES[:3] if quick else TOLERANCES:
                points.append(_measured(cavity, form, method, tolerance))
    points.append(_measured(cavity, *DEFAULT))
    return points


def solver_picture(rows: Sequence[Row]) -> Figure | None:
    """Error against run time of the solvers among the rows; None where there are none."""
    drawn = [row for row in rows if row.quantity == QUANTITY and row.knob is not None]
    knobs = dict.fromkeys(row.knob for row in drawn if row.knob is not None)
    lines = {knob: _line(knob, [row for row in drawn if row.knob == knob]) for knob in knobs}
    default = next((lines.pop(knob) for knob in knobs if knob.endswith(DEFAULTS)), None)
    return solver_figure(list(lines.values()), default) if lines else None


def _line(knob: str, rows: Sequence[Row]) -> SolverLine:
    form, method = knob.removesuffix(DEFAULTS).split(", ")
    cost, count = tuple(r.cost for r in rows), tuple(r.counts["evaluations"] for r in rows)
    return SolverLine(form, method, cost, count, tuple(r.got for r in rows))


def _measured(cavity: Cavity, form: str, method: Method, tolerance: float) -> Point:
    times: list[float] = []
    while len(times) < 7 and sum(times) < 0.1:
        began = time.process_time()
        run = _run(cavity, form, method, tolerance)
        times.append(time.process_time() - began)
    best = exact(cavity)
    radii = np.abs(np.array([run.radius, run.rebound]) / best.radii - 1.0).max()
    late = abs(run.time / best.times[0] - 1.0)
    return Point(form, method, tolerance, 1e3 * float(np.median(times)), float(radii), late, run.evaluations)


def _run(cavity: Cavity, form: str, method: Method, tolerance: float) -> Run:
    plain = FORMS[form]
    if plain is not None:
        return solve(cavity, plain, method, tolerance)
    bubble = bubble_collapse.collapse.__wrapped__(cavity, 0, tolerance, method)
    return Run(bubble.collapse_time, bubble.minimum_radius, bubble.largest[0].radius, bubble.evaluations)
