"""`sonarsynth rays RECIPE`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sonarsynth.cli.options import RecipeFile, Settings, outside_stores
from sonarsynth.cli.running import BadOption


def rays(
    recipe: RecipeFile,
    out: Annotated[
        Path | None,
        typer.Option(
            callback=outside_stores, metavar="FOLDER", help="Where to write the pictures. Default: <recipe>.rays."
        ),
    ] = None,
    frame: Annotated[int, typer.Option(min=0, help="The frame to trace.")] = 0,
    compare: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Arrivals (.arr) that Bellhop made of what `export --to bellhop` wrote."),
    ] = None,
    settings: Settings = [],  # noqa: B006 - typer copies it
) -> None:
    """Draw eigenrays, or what the recipe's `rays:` asks for: a section, a 3-D view, and an interactive HTML page."""
    from sonarsynth import planning
    from sonarsynth.pictures.ray_pictures import show_rays
    from sonarsynth.recipe import reading

    if compare is not None and not compare.is_file():
        raise BadOption(f"--compare: {compare}: no such file")
    with reading.opened(recipe, settings) as made_from:
        if frame >= made_from.frames:
            raise BadOption(f"--frame {frame} is outside 0..{made_from.frames - 1}")
        plan = planning.plan(made_from)
        files, table = show_rays(plan, frame, out or Path(f"{recipe.stem}.rays"))
    typer.echo(table)
    for file in files:
        typer.echo(str(file))
    if compare is not None:
        from sonarsynth.validation.bellhop import ArrivalsError, compare_arrivals, comparison_table

        try:
            typer.echo(comparison_table(compare_arrivals(plan, frame, compare), compare))
        except ArrivalsError as error:
            raise BadOption(f"--compare: {error}") from None
