"""`sonarsynth card STORE`."""

from __future__ import annotations

from typing import Annotated

import typer


def card(
    store: Annotated[str, typer.Argument(help="The store, a Zarr folder or its URL.", show_default=False)],
    out: Annotated[
        str | None, typer.Option(metavar="FOLDER", help="Where to write the two files. Default: beside the store.")
    ] = None,
) -> None:
    """Describe a store: a dataset card to read (Markdown), and Croissant metadata for programs."""
    from sonarsynth.store import cards

    for file in cards.write(store, out):
        typer.echo(str(file))
