"""What an accuracy run leaves: its rows as JSON, and a picture of error against run time."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sonarsynth.accuracy.rows import Row
from sonarsynth.pictures.accuracy import Line, Mark, error_and_time_figure


def as_json(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """The rows, for programs: case, quantity, expected (the bound), got (the error), ok, microseconds and more."""
    return [row.as_json() for row in rows]


def write(rows: Sequence[Row], out: Path, name: str) -> list[Path]:
    """Write <name>.json and, where times were checked, <name>.png into a folder; their paths."""
    out.mkdir(parents=True, exist_ok=True)
    files = [out / f"{name}.json"]
    files[0].write_text(json.dumps(as_json(rows), indent=2) + "\n")
    times = [row for row in rows if row.quantity == "time"]
    if times:
        marks = [Mark(r.case, r.reference, r.microseconds, r.got) for r in times if r.knob is None]
        knobs = dict.fromkeys(r.knob for r in times if r.knob is not None)
        lines = [_line(knob, [r for r in times if r.knob == knob]) for knob in knobs]
        files.append(out / f"{name}.png")
        error_and_time_figure(marks, lines).savefig(files[1])
    return files


def _line(name: str, rows: Sequence[Row]) -> Line:
    return Line(name, tuple(r.microseconds for r in rows), tuple(r.got for r in rows))
