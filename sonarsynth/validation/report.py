"""What an accuracy run leaves: its rows as JSON, and a picture of error against run time."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from sonarsynth.pictures.accuracy_figures.accuracy_figure import Line, Mark, error_and_time_figure
from sonarsynth.pictures.accuracy_figures.bodies_figure import RefinementCurve, bodies_figure
from sonarsynth.validation.bodies.level_curves import cylinder_panels, plate_panels, sphere_panels
from sonarsynth.validation.validation_rows import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sonarsynth.pictures.accuracy_figures.bodies_figure import RefinementCurve

RELATIVE: Final = "relative error at 110 kHz, rms over ways"


def as_json(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """The rows, for programs: case, quantity, bound, error, ok, cost and more."""
    return [row.as_json() for row in rows]


def write(rows: Sequence[Row], out: Path, name: str) -> list[Path]:
    """Write <name>.json and, where there is something to draw, <name>.png into a folder; their paths."""
    out.mkdir(parents=True, exist_ok=True)
    files = [out / f"{name}.json", out / f"{name}.png"]
    files[0].write_text(json.dumps(as_json(rows), indent=2) + "\n")
    picture = PICTURES[name](rows) if name in PICTURES else None
    if picture is None:
        return files[:1]
    picture.savefig(files[1])
    return files


def _rays(rows: Sequence[Row]) -> Figure | None:
    times = [row for row in rows if row.quantity == "time"]
    marks = [Mark(r.case, r.reference, r.cost, r.error) for r in times if r.knob is None]
    lines = [Line(knob, tuple(r.cost for r in of), tuple(r.error for r in of)) for knob, of in _knobs(times).items()]
    return error_and_time_figure(marks, lines) if times else None


def _knobs(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """The rows of each trade of error for time."""
    names = dict.fromkeys(row.knob for row in rows if row.knob is not None)
    return {name: [row for row in rows if row.knob == name] for name in names}


def _trades(rows: Sequence[Row], quantity: str) -> list[RefinementCurve]:
    """Those of one quantity."""
    curves = []
    for name, of in _knobs([row for row in rows if row.quantity == quantity]).items():
        columns = [r.counts["facets"] for r in of], [r.cost for r in of], [r.error for r in of], [r.bound for r in of]
        curves.append(RefinementCurve(name, *columns))
    return curves


def _sphere(rows: Sequence[Row]) -> Figure:
    trades = {RELATIVE: _trades(rows, "amplitude"), "error of the level, largest (dB)": _trades(rows, "level")}
    return bodies_figure("Spheres of facets against exact computations", trades, sphere_panels())


def _cylinder(rows: Sequence[Row]) -> Figure:
    trades = {RELATIVE: _trades(rows, "amplitude")}
    return bodies_figure("Cylinders of facets against exact computations", trades, cylinder_panels())


def _plate(rows: Sequence[Row]) -> Figure:
    trades = {"error over area/wavelength, largest": _trades(rows, "amplitude")}
    return bodies_figure("Flat plates: facets, however cut, against closed forms", trades, plate_panels())


PICTURES: Final[dict[str, Callable[[Sequence[Row]], Figure | None]]] = {
    "rays": _rays,
    "sphere": _sphere,
    "cylinder": _cylinder,
    "plate": _plate,
}
"""Picture of the rows of a reference; None where there is nothing to draw."""
