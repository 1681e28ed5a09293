"""The command `evaluate`."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sonarsynth.cli.options import Json, Split, Store
from sonarsynth.cli.running import BadOption

if TYPE_CHECKING:
    from rich.console import Console


def evaluate(
    store: Store,
    predictions: Annotated[
        str | None,
        typer.Argument(
            metavar="PREDICTIONS", help="A file of detections (JSON), or 'truth' to judge the truth by itself."
        ),
    ] = None,
    also: Annotated[
        str | None, typer.Option("--predictions", metavar="FILE|truth", help="The same, as an option.")
    ] = None,
    split: Split = None,
    as_json: Json = False,
) -> None:
    """Judge detections by the truth of a store: average precision, detection against false alarms, errors."""
    from sonarsynth import evaluation
    from sonarsynth.cli import printing

    chosen = predictions or also
    if chosen is None or (predictions and also):
        raise BadOption("give one file of detections, or 'truth'")
    if chosen != evaluation.TRUTH and not Path(chosen).is_file():
        raise BadOption(f"{chosen}: no such file")
    with printing.planning("reading"):
        figures = evaluation.evaluate(store, chosen, split=split).as_json()
    if as_json:
        typer.echo(json.dumps(without_nan(figures), indent=2))
    else:
        _print(figures, printing.console())


def without_nan(value: Any) -> Any:
    """Figures with null where there is no number: JSON has no NaN."""
    if isinstance(value, dict):
        return {name: without_nan(item) for name, item in value.items()}
    if isinstance(value, list):
        return [without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _print(score: dict[str, Any], console: Console) -> None:
    from rich.markup import escape
    from rich.table import Table

    console.print(f"{score['detections']} detections of {score['objects']} objects in {score['frames']} frames")
    table = Table("", "objects", "AP by boxes", "AP50", "AP by distance", "AP 2 m", "found at 1 false alarm a frame")
    table.add_row("all", *_cells({**score, **next(r for r in score["detection"] if r["false_alarms_a_frame"] == 1.0)}))
    for name in (name for name in score if name.startswith("by_")):
        table.add_section()
        for text, row in score[name].items():
            table.add_row(escape(text) if name == "by_category" else f"{name[3:]} {text}", *_cells(row))
    console.print(table)
    for rate in score["detection"]:
        console.print(f"found at {rate['false_alarms_a_frame']:g} false alarms a frame: {_share(rate)}")
    for name, row in score["errors"].items():
        if row["count"]:
            share = f"; {100 * row['share_within_3']:.3g} % within 3 predicted errors" if "predicted" in row else ""
            unit = "deg" if row["unit"] == "degree" else row["unit"]
            console.print(
                f"error of {name}: median {row['median_abs']:.2g} {unit}, mean {row['mean']:.2g} {unit}, rms "
                f"{row['rms']:.2g} {unit}, of {row['count']}{share}"
            )


def _cells(row: dict[str, Any]) -> list[str]:
    figures = ["-" if math.isnan(row[name]) else f"{row[name]:.3f}" for name in ("ap", "ap50", "ap_distance", "ap_2m")]
    return [str(row["objects"]), *figures, _share(row)]


def _share(row: dict[str, Any]) -> str:
    if math.isnan(row["detected"]):
        return "-"
    return f"{100 * row['detected']:.1f} % ({100 * row['low']:.1f} to {100 * row['high']:.1f})"
