"""The table of `accuracy RECIPE`."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.table import Table

from sonarsynth.cli.printing import console, overwrite
from sonarsynth.cli.running import BadOption
from sonarsynth.cli.selecting import frame_numbers
from sonarsynth.frontiers import measure
from sonarsynth.frontiers.frontier_report import write
from sonarsynth.recipe import reading

if TYPE_CHECKING:
    from sonarsynth.frontiers import AccuracyReport, Point, Verdict


SECOND = (
    ("largest", "of the peak ", ""),
    ("largest_db", "largest ", " dB"),
    ("direction_rad", "direction ", " rad"),
    ("correlation", "correlation ", ""),
    ("points", "points ", ""),
    ("within_5_cm", "within 5 cm ", ""),
)
"""Numbers that are shown beside the errors: names, words, units; the file has the others too."""

WIDEST = 120
"""Columns of the table, whatever it is printed on."""


def recipe_table(
    recipe: Path,
    settings: Sequence[str],
    frames: str | None,
    hydrophones: str | None,
    seed: int | None,
    out: Path,
    *,
    peers: bool,
    as_json: bool,
) -> None:
    """Walk the knobs of a recipe, write <out>/<recipe>.json and .png, print the table; raises typer.Exit(1) where an
    error is over its bound."""
    count = _hydrophones(hydrophones)
    with reading.opened(recipe, settings) as made_from:
        chosen = frame_numbers(frames, made_from.frames)
        measured = measure(made_from, chosen, hydrophones=count, seed=seed, peers=peers, say=overwrite)
    overwrite("")
    files = write(measured, out, recipe.stem)
    if as_json:
        typer.echo(json.dumps(measured.as_json(), indent=2, allow_nan=False))
    else:
        show(measured)
        for file in files:
            typer.echo(str(file))
    if not measured.ok:
        raise typer.Exit(1)


def _hydrophones(text: str | None) -> int | None:
    """How many: None for as many as can be afforded. Raises BadOption."""
    if text is None:
        return None
    if text == "all":
        return sys.maxsize
    if not text.isdecimal() or int(text) < 1:
        raise BadOption(f"--hydrophones {text} is neither 'all' nor a whole number from 1 on")
    return int(text)


def show(measured: AccuracyReport) -> None:
    """A section a stage, then the verdicts."""
    table = Table(title=measured.title, title_justify="left")
    table.add_column("stage", no_wrap=True)
    table.add_column("parameter")
    table.add_column("setting")
    for name in ("error", "allowed", "ms per frame"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("", min_width=6)
    table.add_column("also")
    stage = ""
    for point in measured.points:
        if point.stage != stage:
            table.add_section()
        cells = (point.knob, point.setting, *_numbers(point), _mark(point), _also(point))
        table.add_row("" if point.stage == stage else point.stage, *cells, style="bold" if point.chosen else None)
        stage = point.stage
    for part_of_report in (table, _verdict_table(measured.verdicts)):
        console().print(part_of_report, markup=False, soft_wrap=False, width=min(console().width, WIDEST))
    frames = ", ".join(str(n) for n in measured.frames)
    console().print(
        f"frames {frames}, {measured.hydrophones} hydrophones; {'all within their bounds' if measured.ok else 'FAILED'}"
    )


def _numbers(point: Point) -> tuple[str, str, str]:
    if point.error != point.error:
        return "", "", ""
    allowed = f"{point.allowed:g}" if isfinite(point.allowed) else ""
    return f"{point.error:.2g} {point.unit}", allowed, f"{1e3 * point.seconds:.3g}"


def _mark(point: Point) -> str:
    if point.role == "peer":
        return ""
    if point.role == "check":
        return "ok" if point.meets else "FAILED"
    verdict = ("within" if point.meets else "exceeds") if isfinite(point.allowed) else ""
    return ", ".join(word for word in ("chosen" if point.chosen else "", verdict) if word)


def _also(point: Point) -> str:
    """The second number of a stage, and the note."""
    numbers = [f"{words}{point.also[name]:.2g}{unit}" for name, words, unit in SECOND if name in point.also]
    return "; ".join([*numbers, *([point.note] if point.note else [])])


def _verdict_table(verdicts: Sequence[Verdict]) -> Table:
    table = Table("stage", "chosen", title="verdicts", title_justify="left")
    for name in ("error", "allowed", "ms"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("cheapest within the bound")
    for name in ("ms", "times"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    table.add_column("note")
    for v in verdicts:
        table.add_row(
            v.stage,
            v.choice,
            f"{v.error:.2g} {v.unit}",
            f"{v.allowed:g}",
            f"{1e3 * v.seconds:.3g}",
            v.cheapest,
            f"{1e3 * v.cheapest_seconds:.3g}",
            f"{v.ratio:.2g}",
            "ok" if v.ok else "slow" if v.meets else "FAILED",
            v.note,
        )
    return table
