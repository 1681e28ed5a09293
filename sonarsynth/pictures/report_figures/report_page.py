"""The page of a report: one HTML file that any browser opens without a network."""

from __future__ import annotations

import json
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from sonarsynth.conventions import Progress, finite_json
from sonarsynth.evaluation import warnings as warnings_of
from sonarsynth.evaluation.detectors.detector_scores import words_of
from sonarsynth.pictures.figures.style import PAGE_CONFIG
from sonarsynth.pictures.report_figures import report_plots as plots
from sonarsynth.pictures.report_figures.report_numbers import numbers_of
from sonarsynth.pictures.store_reading import NothingToDraw
from sonarsynth.store import Folder, built_frames, folder_of, named_after, open_store
from sonarsynth.store.files.place import write_atomically

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

PAGE: Final = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<style>
body {{ font: 15px/1.5 sans-serif; color: #222; max-width: 1100px; margin: 0 auto; padding: 0 16px 48px }}
table {{ border-collapse: collapse; margin: 12px 0 }}
td, th {{ border-bottom: 1px solid #ddd; padding: 3px 14px 3px 0; text-align: left }}
.warning {{ background: #fff3d6; padding: 6px 12px; margin: 6px 0 }}
</style></head>
<body>
{body}
<script type="application/json" id="numbers">{numbers}</script>
</body></html>
"""


def report(
    store: str | Folder,
    out: str | Path | None = None,
    *,
    progress: Progress | None = None,
) -> tuple[Path, dict[str, Any]]:
    """Write a page about a store: film, what is in it by split, whether splits are apart, errors against predicted
    errors, baseline detectors, the hardest frames.

    out: the file, which gets the ending .html where it has another, or a folder that is there; `<store>.report.html`
    where it is left out. The page holds plotly.js (5 MB) and its own numbers as
    JSON (the element `numbers`). Returns the file and the numbers. Raises NothingToDraw where no frame is built.
    """
    folder = folder_of(store)
    tree = open_store(folder)
    if not len(built_frames(tree)):
        raise NothingToDraw(f"{folder}: no frame has been built")
    numbers = numbers_of(tree, warnings_of(folder), progress)
    beside = named_after(folder)
    file = beside.with_name(f"{beside.name}.report.html")
    if out is not None:
        chosen = Path(out)
        ending = "" if chosen.suffix.lower() in (".html", ".htm") else ".html"
        file = chosen / file.name if chosen.is_dir() else chosen.with_name(chosen.name + ending)

    figures = [
        ("Film", plots.film(tree, built_frames(tree))),
        ("What is in it", plots.histograms(numbers)),
        ("Errors of ranges against predicted errors", plots.range_errors(numbers)),
        ("Baseline detectors", plots.baselines(numbers)),
    ]
    title = escape(f"{numbers['title']}: {beside.name}")
    sections = [f"<h1>{title}</h1>", *_head(numbers)]
    script = True
    for heading, figure in figures:
        if figure is not None:
            sections.append(f"<h2>{escape(heading)}</h2>{_drawn(figure, script)}")
            script = False
    sections += [*_clouds(numbers), *_scores(numbers)]
    file.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(file, PAGE.format(title=title, body="\n".join(sections), numbers=_as_json(numbers)).encode())
    return file, numbers


def _drawn(figure: Figure, script: bool) -> str:
    return str(figure.to_html(full_html=False, include_plotlyjs=script, config=PAGE_CONFIG, auto_play=False))


def _as_json(numbers: dict[str, Any]) -> str:
    """JSON that ends no element of the page; null where there is no number."""
    return json.dumps(finite_json(numbers)).replace("<", "\\u003c")


def _head(numbers: dict[str, Any]) -> list[str]:
    splits = ", ".join(f"{count} {name}" for name, count in numbers["splits"].items())
    apart = numbers["leakage"]
    leaks = (
        "no sequence is in two splits, and no frame is equal to one of another split"
        if not any(apart.values())
        else f"<b>{apart['sequences']} sequences are in two splits, {apart['equal_frames']} frames are equal to one of "
        "another split</b>"
    )
    rows = [
        ("frames", f"{numbers['frames']} of {numbers['frames_of_the_recipe']} built, {numbers['sequences']} sequences"),
        ("splits", splits),
        ("apart", leaks),
        ("objects", f"{numbers['objects']} in view"),
        *((escape(name), ", ".join(f"{n} {s}" for s, n in of.items())) for name, of in numbers["categories"].items()),
    ]
    warned = [f'<p class="warning">{escape(text)}</p>' for text in numbers["warnings"]]
    return [_table(("", ""), rows), *warned]


def _clouds(numbers: dict[str, Any]) -> list[str]:
    by = numbers["clouds"].get("by_tolerance")
    if not by:
        return []
    rows = [(limit, *(f"{row[name]:.3f}" for name in ("precision", "recall", "f_score"))) for limit, row in by.items()]
    text = f"Chamfer distance {numbers['clouds']['chamfer']:.3g} m, of {numbers['clouds']['points']} points."
    table = _table(("within", "points on the surface", "surface found", "F-score"), rows)
    return [f"<h2>Clouds against the surfaces that the array sees</h2><p>{text}</p>{table}"]


def _scores(numbers: dict[str, Any]) -> list[str]:
    if not numbers["baselines"]:
        return []
    rows = [(kind, *words_of(of, of["detection"][-2])) for kind, of in numbers["baselines"].items()]
    head = ("", "AP by boxes", "AP50", "AP by distance", "AP 2 m", "found at 1 false alarm a frame")
    hardest = [tuple(map(str, row.values())) for row in numbers["hardest"]]
    named = ("frame", "objects", "missed", "false alarms")
    return [
        f"<p>Of {numbers['judged_frames']} frames; bands of 95 %.</p>{_table(head, rows)}",
        f"<h2>Hardest frames</h2><p>Those that <code>peaks</code> errs in most.</p>{_table(named, hardest)}",
    ]


def _table(head: tuple[str, ...], rows: list[Any]) -> str:
    """Cells are HTML already."""
    lines = ["".join(f"<th>{cell}</th>" for cell in head)] if any(head) else []
    lines += ["".join(f"<td>{cell}</td>" for cell in row) for row in rows]
    return "<table>" + "".join(f"<tr>{line}</tr>" for line in lines) + "</table>"
