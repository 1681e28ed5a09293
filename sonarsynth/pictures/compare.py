"""Several stores side by side: a film of all, and one picture of three frames with what each store errs and costs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Progress
from sonarsynth.pictures.figures.compared_images import BesidePicture, Column, Moment, Panel
from sonarsynth.pictures.figures.style import decibels, save
from sonarsynth.pictures.film import thinned, write_film
from sonarsynth.pictures.recipe_diff import names_of
from sonarsynth.pictures.scores import LEVEL, EchoEnergies, as_table, echo_energies, scores_of
from sonarsynth.pictures.store_reading import (
    NothingToDraw,
    beam_grid,
    built,
    ghosts,
    hulls,
    lobes,
    needed,
    opened,
    pictures_of,
    read,
)
from sonarsynth.pictures.summary import spread
from sonarsynth.store import Folder, folder_of

if TYPE_CHECKING:
    import xarray as xr


MOST = 4
"""Stores that fit beside each other."""

EDGE = 8
"""The early and the late frame stand this part of all frames away from the first and the last."""

NOTE = (
    f"Echo: mean energy of the beams that point at a target; levels in {LEVEL}. "
    "Rings: ghosts; dotted lines: grating lobes. CPU: median over frames, of one core."
)


def show_beside(
    stores: Sequence[str | Folder],
    out: str | Path | None = None,
    *,
    frame: int | None = None,
    film: bool = True,
    scale: str = "common",
    frames_per_second: float = 10.0,
    say: Callable[[str], None] = print,
    progress: Progress | None = None,
) -> list[Path]:
    """Draw two to four stores beside each other into the folder `out`, say their numbers; returns the files written.

    beside.png: an early, the best and a late frame, and the numbers of each store under it; the best is `frame`, left
    out the one with most points on target in all stores. film.mp4 (film.gif without ffmpeg): the frames that all
    stores have. Each store is named by what differs in its recipe, and drawn re its own brightest beam of
    all frames (scale "common") or of each ("frame"). `out` left
    out: <names of the stores>.pictures beside the first.

    Raises NothingToDraw, a ValueError, where a store is none or has no image, where beam grids differ, where no frame
    is in all stores, or not that one.
    """
    paths = [folder_of(store) for store in stores]
    if not 2 <= len(paths) <= MOST:
        raise NothingToDraw(f"{len(paths)} stores: from 2 to {MOST} fit beside each other")
    trees = [_fit(opened(path), path) for path in paths]
    frames = _common(trees, paths, frame, say)
    sounds = [echo_energies(tree, frames) for tree in trees]
    references = [sound.reference if scale == "common" else None for sound in sounds]
    names = names_of([str(tree.attrs.get("recipe", "")) for tree in trees], _file_names(paths))
    numbers = [scores_of(t, path, frames, sound) for t, path, sound in zip(trees, paths, sounds, strict=True)]
    say(as_table(names, numbers))
    say(NOTE)
    columns = [Column(name, rows) for name, rows in zip(names, numbers, strict=True)]
    folder = _folder(paths) if out is None else Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    heading = _heading(trees, len(frames))
    chosen = _three(sounds, frames, frame)
    of = "each film" if scale == "common" else "each image"
    sheet = BesidePicture(*beam_grid(trees[0]), columns, heading, NOTE, rows=len(chosen), of=of)
    sheet.show(*(moment(trees, references, *pick) for pick in chosen))
    files = [folder / "beside.png"]
    save(sheet.figure, files[0], dpi=120)
    if film and len(frames) > 1:
        if len(thinned(frames)) < len(frames):
            say(f"film: {len(thinned(frames))} of {len(frames)} frames")
        moving = BesidePicture(*beam_grid(trees[0]), columns, heading, NOTE, of=of)

        def show(frame: int) -> None:
            moving.show(moment(trees, references, frame))

        files.append(write_film(moving.figure, show, thinned(frames), folder, frames_per_second, progress))
    return files


def moment(trees: Sequence[xr.DataTree], references: Sequence[float | None], frame: int, why: str = "") -> Moment:
    """A frame of all stores, each in dB re its own reference (Pa2 s); without one, re its brightest beam."""
    panels: list[Panel] = []
    for tree, reference in zip(trees, references, strict=True):
        energy = needed(tree, "image/energy", frame)
        brightest = float(np.max(energy, initial=0.0, where=np.isfinite(energy))) or 1.0
        level = decibels(energy, reference or brightest) if np.isfinite(energy).any() else None
        panels.append(Panel(level, hulls(tree, frame), ghosts(tree, frame), lobes(tree, frame)))
    times = {None if (t := read(tree, "time", frame)) is None else round(float(t), 9) for tree in trees}
    clock = [f"{t:.2f} s" for t in times if t is not None and np.isfinite(t)] if len(times) == 1 else []
    return Moment("\n".join([f"frame {frame}", *clock, *([why] if why else [])]), tuple(panels))


def _fit(tree: xr.DataTree, path: Folder) -> xr.DataTree:
    """The store, if its images can be drawn beside others."""
    if "image" not in tree.children or "energy" not in tree["image"].dataset:
        raise NothingToDraw(f"{path}: the store has no image, which is what is drawn side by side")
    return tree


def _common(
    trees: Sequence[xr.DataTree], paths: Sequence[Folder], frame: int | None, say: Callable[[str], None]
) -> list[int]:
    """Frames that all stores have, or of very many some, spread over all; refuses stores whose images do not fit
    together."""
    for tree, path in zip(trees[1:], paths[1:], strict=True):
        same = [np.array_equal(a, b) for a, b in zip(beam_grid(tree), beam_grid(trees[0]), strict=True)]
        if not all(same):
            raise NothingToDraw(
                f"{path}: its beams ({_grid(tree)}) are not those of {paths[0]} ({_grid(trees[0])}), "
                "so they cannot be compared"
            )
    available = [built(tree) for tree in trees]
    common: list[int] = reduce(np.intersect1d, available).tolist()
    if not common:
        raise NothingToDraw(f"{' and '.join(map(str, paths))}: no frame has been built in all of them")
    if frame is not None and frame not in common:
        raise NothingToDraw(
            f"frame {frame} has not been built in all stores; {len(common)} are, {common[0]} to {common[-1]}"
        )
    if any(len(frames) > len(common) for frames in available):
        say(f"only the {len(common)} frames that all stores have")
    compared = {*spread(np.array(common)).tolist(), *([] if frame is None else [frame])}
    if len(compared) < len(common):
        say(f"compared: {len(compared)} of {len(common)} frames, spread over all")
    return sorted(compared)


def _grid(tree: xr.DataTree) -> str:
    azimuth, elevation = beam_grid(tree)
    return f"{len(azimuth)} x {len(elevation)} over {np.ptp(azimuth):g} x {np.ptp(elevation):g} deg"


def _three(sounds: Sequence[EchoEnergies], frames: list[int], wanted: int | None) -> list[tuple[int, str]]:
    """An early, the best and a late frame, and what they are called; fewer where there are fewer frames."""
    if len(frames) <= 3 and wanted is None:
        return [(frame, "") for frame in frames]
    skipped = max(1, len(frames) // EDGE) - 1
    early, late = frames[skipped], frames[-1 - skipped]
    if wanted is not None:
        return [(frame, "") for frame in sorted({early, wanted, late})]
    points = np.sum([sound.points for sound in sounds], axis=0)
    interest = points if points.any() else np.sum([sound.beams for sound in sounds], axis=0)
    inside = slice(skipped + 1, -1 - skipped)
    best = frames[inside][int(np.argmax(interest[inside]))]
    return [(early, ""), (best, "most points" if points.any() else ""), (late, "")]


def _heading(trees: Sequence[xr.DataTree], count: int) -> str:
    titles = list(dict.fromkeys(str(tree.attrs.get("title") or "untitled") for tree in trees))
    return f"{' / '.join(titles)}   {count} frames"


def _file_names(paths: Sequence[Folder]) -> list[str]:
    """Names that tell stores apart: their own, or else the whole paths, or else with a number."""
    for names in ([PurePosixPath(path.name).stem for path in paths], [str(path) for path in paths]):
        if len(set(names)) == len(names):
            return names
    return [f"{path} ({n})" for n, path in enumerate(paths, 1)]


def _folder(paths: Sequence[Folder]) -> Path:
    names = [path.name.removesuffix(".zarr") for path in paths]
    return pictures_of(paths[0], "-".join(names))
