"""What the accuracy of a recipe leaves: its rows as JSON, and a picture of the frontiers."""

from __future__ import annotations

import json
from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import Final

from sonarsynth.frontiers import AccuracyReport
from sonarsynth.frontiers.rows import Point
from sonarsynth.pictures.figures.frontier_figure import Line, Panel, frontier_figure
from sonarsynth.pictures.figures.style import save
from sonarsynth.store.files.place import write_atomically

TITLES: Final = {
    "trace": "signals: tracing and synthesis, by how paths are traced",
    "synthesis": "synthesis of the traced paths",
    "reverberation": "reverberation: contrast at a hydrophone, by how many scatterers there are",
    "image": "image: beams within 20 dB of the brightest, root mean square",
    "range": "cloud: largest error of a range by the method",
    "picking": "cloud: median distance of points from the target, by how echoes are picked",
}


def write(measured: AccuracyReport, out: Path, name: str = "recipe") -> list[Path]:
    """Write <name>.json and <name>.png into a folder; their paths."""
    out.mkdir(parents=True, exist_ok=True)
    files = [out / f"{name}.json", out / f"{name}.png"]
    write_atomically(files[0], (json.dumps(measured.as_json(), indent=2, allow_nan=False) + "\n").encode())
    panels = [panel for stage in TITLES if (panel := _panel(stage, measured.points)) is not None]
    if not panels:
        return files[:1]
    frames = ", ".join(str(n) for n in measured.frames)
    note = (
        f"Frames {frames}; {measured.hydrophones} hydrophones computed exactly. An error is the largest of the frames, "
        "a time the mean of them. Points without error are drawn on the dotted line."
    )
    save(frontier_figure(f"{measured.title}: error against run time", panels, note), files[1])
    return files


def _name(point: Point) -> str:
    """Of its line: a knob, whose settings are joined; of images other than ours, each stands by itself."""
    return f"{point.knob}: {point.setting}" if point.role == "peer" and point.stage == "image" else point.knob


def _panel(stage: str, points: Sequence[Point]) -> Panel | None:
    """The panel of a stage; None where it was not walked."""
    of_stage = [p for p in points if p.stage == stage and p.role != "check" and isfinite(p.error)]
    chosen = next((p for p in of_stage if p.chosen), None)
    if chosen is None:
        return None
    lines = []
    for role in ("point", "peer"):
        of_role = [p for p in of_stage if p.role == role]
        for name in dict.fromkeys(_name(p) for p in of_role if p.knob != "chosen"):
            line = [p for p in of_role if _name(p) == name]
            if role == "point" and not any(p.chosen for p in line) and len(line) > 1 and stage != "synthesis":
                line = [*line, chosen]
            lines.append(Line(name, tuple(1e3 * p.seconds for p in line), tuple(p.error for p in line), role == "peer"))
    return Panel(TITLES[stage], chosen.unit, chosen.allowed, tuple(lines), (1e3 * chosen.seconds, chosen.error))
