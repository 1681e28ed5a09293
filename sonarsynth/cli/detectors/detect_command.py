"""The command `detect`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sonarsynth.cli.options import Split, Store
from sonarsynth.cli.selecting import described


def detect(
    store: Store,
    method: Annotated[
        str,
        typer.Option(metavar="METHOD", help="peaks, cfar, or one with settings: '{kind: peaks, threshold: 6 dB}'."),
    ] = "peaks",
    split: Split = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Where to write. Default: <store>.<method>.json.", show_default=False),
    ] = None,
) -> None:
    """Run a baseline detector on the images of a store: boxes, scores, ranges as JSON, the results format of COCO."""
    from sonarsynth import detection
    from sonarsynth.cli import printing
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
    typer.echo(f"{file}: {len(detections)} detections")
