"""`sonarsynth preview RECIPE`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from sonarsynth.cli.options import Json, RecipeFile, Settings, outside_stores


def preview(
    recipe: RecipeFile,
    out: Annotated[
        Path | None,
        typer.Option(
            callback=outside_stores, metavar="FOLDER", help="Where to write the pictures. Default: <recipe>.preview."
        ),
    ] = None,
    sequences: Annotated[int, typer.Option(min=1, metavar="N", help="Look at so many sequences at most.")] = 1000,
    settings: Settings = [],  # noqa: B006 - typer copies it
    as_json: Json = False,
) -> None:
    """Draw what a recipe would make, without sound: its scenes, and distributions of ranges, angles and views.

    By target and by split, of straight lines from the array centre. The numbers are in preview.json as well.
    """
    from sonarsynth.cli import printing
    from sonarsynth.pictures.preview_figures.preview_pictures import draw_preview
    from sonarsynth.recipe import reading

    with reading.opened(recipe, settings) as made_from, printing.progress("reading files") as progress:
        files, numbers = draw_preview(made_from, out or Path(f"{recipe.stem}.preview"), sequences, progress)
    if as_json:
        typer.echo(json.dumps(numbers, indent=2, allow_nan=False))
        return
    for file in files:
        typer.echo(str(file))
