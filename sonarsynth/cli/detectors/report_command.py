"""The command `report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sonarsynth.cli.options import Store


def report(
    store: Store,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Where to write: a file or a folder. Default: <store>.report.html."),
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
