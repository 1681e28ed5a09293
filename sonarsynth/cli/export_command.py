"""`sonarsynth export STORE`, and `export RECIPE --to bellhop`."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sonarsynth.cli.options import Settings, outside_stores
from sonarsynth.cli.running import BadOption
from sonarsynth.cli.selecting import frame_numbers

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr

COCO, SONAR_NETCDF, BELLHOP = "coco", "sonar-netcdf", "bellhop"


def export(
    source: Annotated[
        str, typer.Argument(metavar="STORE", help="The store, or for bellhop the recipe.", show_default=False)
    ],
    folder: Annotated[
        Path | None,
        typer.Argument(
            callback=outside_stores, metavar="[DIR]", help="Where to write: the same as --out.", show_default=False
        ),
    ] = None,
    to: Annotated[
        str,
        typer.Option(
            metavar="FORMAT",
            help="Of a store ply or pcd (points), coco (images, boxes, masks), sonar-netcdf (signals, beams). "
            "Of a recipe bellhop (its water).",
        ),
    ] = "ply",
    out: Annotated[
        Path | None,
        typer.Option(
            callback=outside_stores,
            metavar="FILE",
            help="Where to write: a file of points, else a folder. Default: beside the store.",
        ),
    ] = None,
    frames: Annotated[
        str | None,
        typer.Option(
            metavar="LIST", help="Only these frames, such as 0:8 or 0:8,12 (end excluded). Default: all; bellhop: 0."
        ),
    ] = None,
    relative_to: Annotated[
        str | None,
        typer.Option(
            metavar="AXES", help="sonar, world, or the name of a target: its points fall together. Default: sonar."
        ),
    ] = None,
    settings: Settings = [],  # noqa: B006 - typer copies it
) -> None:
    """Write what other programs read: of a store its points as one cloud, images and boxes for COCO, or signals and
    beams in the convention SONAR-netCDF4; of a recipe the water for Bellhop. Says what is lost.

    A cloud has colours, normals and labels. For Bellhop each snap of a frame has an environment, from it to the array.
    """
    from sonarsynth.export import FORMATS

    if folder is not None and out is not None:
        raise BadOption("--out: where to write is given twice")
    out = out or folder
    if to == BELLHOP:
        if relative_to is not None:
            raise BadOption("--relative-to is for point clouds: Bellhop has no such axes")
        if Path(source).is_dir():
            raise BadOption(f"{source} is a folder: bellhop is of a recipe")
        _bellhop(Path(source), out, frames, settings)
    elif to not in (*FORMATS, COCO, SONAR_NETCDF):
        raise BadOption(f"--to must be one of {', '.join((*FORMATS, COCO, SONAR_NETCDF, BELLHOP))}, not {to}")
    elif settings:
        raise BadOption("--set is for recipes: a store is what it is")
    elif to in (COCO, SONAR_NETCDF):
        if relative_to is not None:
            raise BadOption("--relative-to is for point clouds")
        _folder(source, to, out, frames)
    else:
        _points(source, to, out, frames, relative_to or "sonar")


def _points(store: str, to: str, out: Path | None, frames: str | None, relative_to: str) -> None:
    from sonarsynth.conventions import counted
    from sonarsynth.export import points, write_points
    from sonarsynth.store import Damage, named_after, open_store

    tree = open_store(store)
    chosen = _built(tree, store, frames)
    beside = named_after(store).with_suffix(f".{to}")
    file = out or beside
    file = file / beside.name if file.is_dir() else file
    try:
        cloud = points(tree, chosen, relative_to=relative_to)
        written = write_points(cloud, file if file.suffix else file.with_suffix(f".{to}"))
    except Damage:
        raise
    except (ValueError, ImportError) as error:
        raise BadOption(str(error)) from None
    typer.echo(f"{written}: {counted(cloud.sizes['point'], 'point')} of {counted(len(chosen), 'frame')}")
    _say_left_out(tree, frames)


def _folder(store: str, to: str, out: Path | None, frames: str | None) -> None:
    """A folder of files: images and annotations, or signals and beams."""
    from sonarsynth.cli import printing
    from sonarsynth.export import coco_files, sonar_netcdf
    from sonarsynth.store import named_after, open_store

    tree = open_store(store)
    chosen = _built(tree, store, frames)
    into = out or named_after(store).with_name(f"{named_after(store).name}.{to}")
    write, lost = (
        (coco_files.write_coco, coco_files.LOST) if to == COCO else (sonar_netcdf.write_sonar_netcdf, sonar_netcdf.LOST)
    )
    try:
        with _filled(into) as folder, printing.progress("reading") as progress:
            files = [into / file.relative_to(folder) for file in write(tree, folder, chosen, progress)]
    except ImportError as error:
        raise BadOption(f"{error}: pip install 'sonarsynth[netcdf]'") from None
    for file in files:
        typer.echo(str(file))
    for note in lost:
        typer.echo(f"note: {note}")
    _say_left_out(tree, frames)


def _say_left_out(tree: xr.DataTree, frames: str | None) -> None:
    """That an export of all frames lacks those that were not built."""
    from sonarsynth.store import built_frames

    total = tree.sizes["frame"]
    if frames is None and (left := total - len(built_frames(tree))):
        typer.echo(f"note: {left} of {total} frames have not been built, and are left out")


def _built(tree: xr.DataTree, store: str, frames: str | None) -> np.ndarray:
    """Numbers (frame,) of the frames that were asked for and built. Raises BadOption where there is none."""
    import numpy as np

    from sonarsynth.store import built_frames

    wanted = frame_numbers(frames, tree.sizes["frame"])
    chosen = built_frames(tree)
    chosen = chosen if wanted is None else np.intersect1d(chosen, wanted)
    if not len(chosen):
        raise BadOption("--frames: none of these frames has been built" if wanted else f"{store} has no frames yet")
    return chosen


@contextmanager
def _filled(folder: Path) -> Iterator[Path]:
    """A folder to write into, whose files are those of `folder` in the end: a part of an export would be taken for all
    of it. Raises BadOption where there are files already: those of two exports would be taken for one dataset."""
    there = folder.exists()
    if there and (not folder.is_dir() or any(folder.iterdir())):
        raise BadOption(f"{folder} exists already and is not an empty folder: remove it, or name another by --out")
    partial = folder / ".partial"
    partial.mkdir(parents=True)
    try:
        yield partial
        for file in sorted(partial.iterdir(), key=Path.is_file):  # lists of files last
            file.rename(folder / file.name)
        partial.rmdir()
    except BaseException as error:
        if isinstance(error, OSError) and error.filename is None:  # the disk is full
            error.filename = str(folder)
        shutil.rmtree(partial, ignore_errors=True)
        if not there:
            with suppress(OSError):
                folder.rmdir()
        raise


def _bellhop(recipe: Path, out: Path | None, frames: str | None, settings: list[str]) -> None:
    from sonarsynth import planning
    from sonarsynth.export import write_bellhop
    from sonarsynth.recipe import reading

    notes, written = dict[str, None](), list[Path]()
    into = out or Path(f"{recipe.stem}.bellhop")
    with reading.opened(recipe, settings) as made_from, _filled(into) as folder:
        numbers = frame_numbers(frames or "0:1", made_from.frames) or ()
        plan = planning.plan(made_from)
        for index in numbers:
            files, unsaid = write_bellhop(plan, index, folder, recipe.stem)
            notes |= dict.fromkeys(unsaid)
            written += [into / file.relative_to(folder) for file in files]
    for file in written:
        typer.echo(str(file))
    for note in notes:
        typer.echo(f"note: {note}")
