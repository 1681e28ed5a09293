"""`sonarsynth init`: a first recipe."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from sonarsynth.cli.authoring.shipped_recipes import copy_beside, text_of
from sonarsynth.cli.running import BadOption

NAMES = "remus, grid, crowd, harbour, boat, deep, tank, thermocline, l_shape."


def init(
    file: Annotated[Path, typer.Argument(help="Where to write the recipe; never over another file.")] = Path(
        "recipe.yaml"
    ),
    source: Annotated[
        str | None, typer.Option("--from", metavar="NAME", help=f"Copy a shipped recipe with its comments: {NAMES}")
    ] = None,
) -> None:
    """Write a first recipe, with comments: a copy of a shipped one, or one of a few answers on a terminal.

    Without --from and without a terminal: a small one of a REMUS-100 that crosses ahead.
    """
    from sonarsynth.cli.authoring.questions import ask
    from sonarsynth.cli.authoring.recipe_text import DEFAULTS, recipe_text
    from sonarsynth.recipe import reading

    if file.exists() or file.is_symlink():
        raise BadOption(f"{file} exists already: nothing was written")
    if not file.name.isprintable():
        raise BadOption("the name of the file holds what cannot be printed")
    if not file.parent.is_dir():
        raise BadOption(f"{file.parent}: no such folder")
    missing: list[str] = []
    if source is not None:
        text, beside, missing = text_of(source, file)
        copy_beside(beside, file.parent)
    else:
        asked = sys.stdin.isatty() and sys.stdout.isatty()
        answers = ask(file.parent) if asked else DEFAULTS
        text = recipe_text(answers, file)
        reading.loads(text, str(file), file.parent)
    with file.open("x", encoding="utf-8") as new:
        new.write(text)
    typer.echo(str(file))
    for name in missing:
        typer.echo(f"note: {name} does not come with it: put yours beside {file}, or name it by --set")
    typer.echo(f"next: sonarsynth preview {file}, sonarsynth plan {file}")
