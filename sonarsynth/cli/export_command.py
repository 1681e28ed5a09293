"""`sonarsynth export STORE`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sonarsynth.cli.running import BadOption
from sonarsynth.cli.selecting import frame_numbers


def export(
    store: Annotated[str, typer.Argument(help="The store, a Zarr folder or its URL.", show_default=False)],
    to: Annotated[str, typer.Option(metavar="FORMAT", help="ply or pcd: point clouds.")] = "ply",
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Where to write. Default: beside the store.")] = None,
    frames: Annotated[
        str | None, typer.Option(metavar="LIST", help="Only these frames, such as 0:8 or 0:8,12 (end excluded).")
    ] = None,
    relative_to: Annotated[
        str, typer.Option(metavar="AXES", help="sonar, world, or the name of a target: its points fall together.")
    ] = "sonar",
) -> None:
    """Write the points of a store as one cloud for other programs, with colours, normals and labels."""
    from sonarsynth.export import FORMATS, points, write_points
    from sonarsynth.store import open_store

    if to not in FORMATS:
        raise BadOption(f"--to must be one of {', '.join(FORMATS)}, not {to}")
    tree = open_store(store)
    some = frame_numbers(frames, tree.sizes["frame"])
    beside = Path(Path(store).name) if "://" in store else Path(store)
    file = out or beside.with_suffix(f".{to}")
    try:
        cloud = points(tree, some, relative_to=relative_to)
        written = write_points(cloud, file if file.suffix else file.with_suffix(f".{to}"))
    except (ValueError, ImportError) as error:
        raise BadOption(str(error)) from None
    typer.echo(f"{written}: {cloud.sizes['point']} points")
