"""`sonarsynth card STORE`."""

from __future__ import annotations

from typing import Annotated

import typer

from sonarsynth.cli.options import Store


def card(
    store: Store,
    out: Annotated[
        str | None, typer.Option(metavar="FOLDER", help="Where to write the two files. Default: beside the store.")
    ] = None,
) -> None:
    """Describe a store: a dataset card to read (Markdown), and Croissant metadata for programs; where there are images,
    say what a threshold finds in 200 of them at most."""
    from sonarsynth.evaluation.detectors.threshold_baseline import threshold_lines
    from sonarsynth.store import built_frames, cards, folder_of, open_store

    files = cards.write(store, out)
    tree = open_store(folder_of(store))
    for line in (*map(str, files), *threshold_lines(tree, built_frames(tree))):
        typer.echo(line)
