"""Commands on a store: to describe it (`card`, `report`), to detect in it and judge what was detected."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sonarsynth.cli.options import Json, Split, Store, outside_stores
from sonarsynth.cli.running import BadOption
from sonarsynth.cli.selecting import described

if TYPE_CHECKING:
    from rich.console import Console


def card(
    store: Store,
    out: Annotated[
        str | None,
        typer.Option(
            callback=outside_stores, metavar="FOLDER", help="Where to write the two files. Default: beside the store."
        ),
    ] = None,
) -> None:
    """Describe a store: a dataset card to read (Markdown), and Croissant metadata for programs; where there are images,
    say what a threshold finds in 200 of them at most."""
    from sonarsynth.evaluation.detectors.threshold_baseline import threshold_lines
    from sonarsynth.store import built_frames, cards, open_store
    from sonarsynth.store.marks import must_hold_all

    must_hold_all(store)
    files = cards.write(store, out)
    tree = open_store(store)
    for line in (*map(str, files), *threshold_lines(tree, built_frames(tree))):
        typer.echo(line)


def report(
    store: Store,
    out: Annotated[
        Path | None,
        typer.Option(
            callback=outside_stores,
            metavar="FILE",
            help="Where to write: a file or a folder. Default: <store>.report.html.",
        ),
    ] = None,
) -> None:
    """Write a page about a store: film, contents by split, leaks between splits, errors, baselines, hardest frames."""
    from sonarsynth.cli import printing
    from sonarsynth.pictures.report_figures import report as write

    with printing.progress("reading") as progress:
        file, numbers = write(store, out, progress=progress)
    for warning in numbers["warnings"]:
        typer.echo(f"warning: {warning}")
    typer.echo(str(file))


def detect(
    store: Store,
    method: Annotated[
        str,
        typer.Option(metavar="METHOD", help="peaks, cfar, or one with settings: '{kind: peaks, threshold: 6 dB}'."),
    ] = "peaks",
    split: Split = None,
    out: Annotated[
        Path | None,
        typer.Option(
            callback=outside_stores,
            metavar="FILE",
            help="Where to write. Default: <store>.<method>.json.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Run a baseline detector on the images of a store: boxes, scores, ranges as JSON, the results format of COCO."""
    from sonarsynth import detection
    from sonarsynth.cli import printing
    from sonarsynth.conventions import counted
    from sonarsynth.store import named_after

    chosen: detection.DetectionMethod = (
        described(method, "--method", detection.Detector)
        if method.lstrip().startswith("{")
        else detection.by_kind(method)
    )
    with printing.progress("reading") as progress:
        detections = detection.detect(store, chosen, split=split, progress=progress)
    beside = named_after(store)
    file = detections.write(out or beside.with_name(f"{beside.name}.{chosen.kind}.json"))
    typer.echo(f"{file}: {counted(len(detections), 'detection')}")


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
        raise BadOption(f"{chosen}: {'is not a file but a folder' if Path(chosen).is_dir() else 'no such file'}")
    with printing.planning("reading"):
        figures = evaluation.evaluate(store, chosen, split=split).as_json()
    if as_json:
        from sonarsynth.conventions import finite_json  # and numpy, 0.2 s of every --help

        typer.echo(json.dumps(finite_json(figures), indent=2))
    else:
        _print(figures, printing.console())


def _print(score: dict[str, Any], console: Console) -> None:
    from rich.markup import escape
    from rich.table import Table

    from sonarsynth.conventions import counted
    from sonarsynth.evaluation.detectors.detector_scores import share_found, words_of

    found, sought, frames = (counted(score[f"{name}s"], name) for name in ("detection", "object", "frame"))
    console.print(f"{found} of {sought} in {frames}")
    table = Table("", "objects", "AP by boxes", "AP50", "AP by distance", "AP 2 m", "found at 1 false alarm a frame")
    at_one = next(rate for rate in score["detection"] if rate["false_alarms_a_frame"] == 1.0)
    table.add_row("all", str(score["objects"]), *words_of(score, at_one))
    for name in (name for name in score if name.startswith("by_")):
        table.add_section()
        for text, row in score[name].items():
            which = escape(text) if name == "by_category" else f"{name[3:]} {text}"
            table.add_row(which, str(row["objects"]), *words_of(row, row))
    console.print(table)
    for rate in score["detection"]:
        alarms = rate["false_alarms_a_frame"]
        console.print(f"found at {alarms:g} false alarm{'s' * (alarms != 1.0)} a frame: {share_found(rate)}")
    for name, row in score["errors"].items():
        if row["count"]:
            share = f"; {100 * row['share_within_3']:.3g} % within 3 predicted errors" if "predicted" in row else ""
            unit = "deg" if row["unit"] == "degree" else row["unit"]
            console.print(
                f"error of {name}: median {row['median_abs']:.2g} {unit}, mean {row['mean']:.2g} {unit}, rms "
                f"{row['rms']:.2g} {unit}, of {row['count']}{share}"
            )
