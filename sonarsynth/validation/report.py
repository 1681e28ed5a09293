"""What an accuracy run leaves: its rows as JSON, and a picture of error against run time."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from math import inf
from pathlib import Path
from typing import Any

from sonarsynth.pictures.figures.frontier_figure import Line, Panel, frontier_figure
from sonarsynth.pictures.figures.style import save
from sonarsynth.store.files.place import write_atomically
from sonarsynth.validation.validation_rows import Row


def as_json(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """The rows, for programs: case, quantity, bound, error, ok, cost and more."""
    return [row.as_json() for row in rows]


def write(rows: Sequence[Row], out: Path, name: str) -> list[Path]:
    """Write <name>.json and, where error is traded for time, <name>.png into a folder; their paths."""
    out.mkdir(parents=True, exist_ok=True)
    files = [out / f"{name}.json", out / f"{name}.png"]
    write_atomically(files[0], (json.dumps(as_json(rows), indent=2) + "\n").encode())
    panels = list(_panels(rows))
    if not panels:
        return files[:1]
    note = "Cases without error are drawn on the dotted line."
    save(frontier_figure(f"{name}: error against run time", panels, note), files[1])
    return files


def _panels(rows: Sequence[Row]) -> Iterator[Panel]:
    """One for each quantity whose error is traded for time: a line a trade, and a point for each case beside them."""
    for quantity in dict.fromkeys(row.quantity for row in rows if row.knob is not None and row.bound > 0.0):
        of = [row for row in rows if row.quantity == quantity]
        lines = []
        for name in dict.fromkeys(map(_name, of)):
            line = [row for row in of if _name(row) == name]
            lines.append(Line(name, tuple(row.cost for row in line), tuple(row.error for row in line)))
        yield Panel(quantity, of[0].unit, inf, tuple(lines), cost=f"CPU time of one core, {of[0].cost_unit}")


def _name(row: Row) -> str:
    return row.knob or f"{row.case} ({row.reference})"
