"""Pictures of a store, from the store alone: a film of all frames, a sheet of one, and a summary."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats, Progress
from sonarsynth.pictures.figures.frame_figure import FramePicture, View, window
from sonarsynth.pictures.figures.range_fan import range_fan
from sonarsynth.pictures.figures.sheet import Errors, sheet
from sonarsynth.pictures.figures.style import decibels, save
from sonarsynth.pictures.film import thinned, write_film
from sonarsynth.pictures.steered_beams import beams
from sonarsynth.pictures.store_reading import (
    NothingToDraw,
    StoredFrame,
    beam_grid,
    built,
    every_stored,
    needed,
    opened,
    pictures_of,
    read,
)
from sonarsynth.pictures.summary import summary
from sonarsynth.store import Folder, folder_of

if TYPE_CHECKING:
    import xarray as xr


def show(
    store: str | Folder,
    out: str | Path | None = None,
    *,
    frame: int | None = None,
    film: bool = True,
    scale: str = "common",
    frames_per_second: float = 10.0,
    say: Callable[[str], None] = print,
    progress: Progress | None = None,
) -> list[Path]:
    """Draw a store, and say a summary.

    film.mp4 (film.gif without ffmpeg) has every frame that was built, sheet.png one, and ranges.png its range image.
    What the store does not hold is left out of the pictures and said.

    Parameters
    ----------
    store: a folder or a URL.
    out: folder of the pictures (default: `<store>.pictures`).
    frame: number of the frame of the sheet (default: the one with most points on a target).
    film: whether the film is written.
    scale: dB re the brightest beam of all frames ("common"), or of each ("frame").
    frames_per_second: of the film.
    say: called with lines of the summary.
    progress: called with the numbers of frames drawn and wanted.

    Returns
    -------
    The files written.

    Raises
    ------
    NothingToDraw, a ValueError, where there is no store, or not that frame; ValueError for another scale.
    """
    if scale not in ("common", "frame"):
        raise ValueError(f"scale must be 'common' or 'frame', not {scale!r}")
    tree = opened(path := folder_of(store))
    frames = built(tree)
    if not len(frames):
        say(summary(tree, path))
        raise NothingToDraw(f"{path}: no frame has been built yet")
    if frame is not None and frame not in frames:
        raise NothingToDraw(
            f"{path}: frame {frame} has not been built; there are {len(frames)}, {frames[0]} to {frames[-1]}"
        )
    say(summary(tree, path))
    folder = pictures_of(path) if out is None else Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    filmed = thinned(frames.tolist())
    wanted = filmed if frame is None or frame in filmed else [*filmed, frame]
    read = dict(zip(wanted, every_stored(tree, wanted), strict=True))
    chosen = frame if frame is not None else max(read, key=lambda i: _interest(read[i]))
    files = [_write_sheet(tree, read[chosen], folder, say)]
    if "range_image" in tree.children:
        files.append(_write_fan(tree, read[chosen], folder))
    if film and len(frames) > 1:
        if len(filmed) < len(frames):
            say(f"film: {len(filmed)} of {len(frames)} frames")
        in_order = [read[i] for i in filmed]
        common = _reference(in_order) if scale == "common" else None
        histories = zip(in_order, earlier_points(in_order), strict=True)
        views = [
            replace(_view(tree, stored, common or _reference([stored])), earlier=before) for stored, before in histories
        ]
        of = "all frames" if common else "each frame"
        picture = FramePicture(*beam_grid(tree), views, f"beams: energy re the brightest beam of {of} (dB)")
        files.append(write_film(picture.figure, picture.show, views, folder, frames_per_second, progress))
    return files


def earlier_points(frames: list[StoredFrame]) -> Iterator[Floats]:
    """For each frame the points (point, xyz) of those before it on targets, carried along with these, in
    its sonar frame."""
    earlier: dict[int, list[Floats]] = {}
    for frame in frames:
        poses = {t: pose for t, pose in enumerate(frame.poses) if np.isfinite(pose.position).all()}
        carried = [poses[t].to_world(np.concatenate(earlier[t])) for t in earlier if t in poses]
        yield np.concatenate([np.zeros((0, 3)), *carried])
        for t, pose in poses.items():
            if (own := (frame.point_target == t) & np.isfinite(frame.range_error)).any():
                earlier.setdefault(t, []).append(pose.to_body(frame.points[own]))


def _interest(frame: StoredFrame) -> tuple[int, int]:
    """Points on a target, then beams on a target."""
    return int(np.isfinite(frame.range_error).sum()), int((frame.target >= 0).sum())


def _reference(frames: list[StoredFrame]) -> float:
    """The brightest beam of frames (Pa2 s); 1 where nothing is heard."""
    energies = [f.energy if f.energy is not None else f.point_energy for f in frames]
    peaks = [float(np.nanmax(e)) for e in energies if np.isfinite(e).any()]
    return max([p for p in peaks if p > 0], default=1.0)


def frame_view(tree: xr.DataTree, frame: StoredFrame) -> View:
    """What is drawn of a frame by itself, in dB re its brightest beam."""
    return _view(tree, frame, _reference([frame]))


def _view(tree: xr.DataTree, frame: StoredFrame, reference: float) -> View:
    title = tree.attrs.get("title") or "untitled"
    clock = f"   t = {frame.time:.2f} s" if np.isfinite(frame.time) else ""
    count = tree["truth"].sizes["frame"]
    of = f", {count} frames" if count > 1 else ""
    return View(
        title=f"{title}{of}",
        moment=f"frame {frame.index}{clock}{_snr(tree, frame)}",
        level=None if frame.energy is None else decibels(frame.energy, reference),
        points=frame.points,
        point_level=decibels(frame.point_energy, reference),
        hulls=frame.hulls,
        ghosts=frame.ghosts,
        lobes=frame.lobes,
    )


def _snr(tree: xr.DataTree, frame: StoredFrame) -> str:
    """The signal-to-noise ratios of the targets of a frame, for its title: of the loudest three."""
    stored = read(tree, "truth/targets/snr")
    if stored is None:
        return ""
    snr, names = stored[frame.index], needed(tree, "truth/targets/target")
    loud = [n for n in np.argsort(-np.nan_to_num(snr, nan=-np.inf))[:3] if np.isfinite(snr[n])]
    return "   snr " + ", ".join(f"{names[n]} {round(float(snr[n]))} dB" for n in loud) if loud else ""


def _write_fan(tree: xr.DataTree, frame: StoredFrame, folder: Path) -> Path:
    ranges, azimuth = (needed(tree, f"range_image/{name}") for name in ("range", "azimuth"))
    energy, target = (needed(tree, f"range_image/{name}", frame.index) for name in ("energy", "target"))
    names = [str(name) for name in needed(tree, "truth/targets/target")]
    fan = range_fan(f"frame {frame.index}", ranges, azimuth, energy, target, names)
    return save(fan, folder / "ranges.png")


def _write_sheet(
    tree: xr.DataTree,
    frame: StoredFrame,
    folder: Path,
    say: Callable[[str], None],
) -> Path:
    loudest_of_beams = beams(tree, frame)
    missing = [name for name in ("signals", "image", "cloud") if name not in tree.children]
    if missing:
        say(f"sheet: without {', '.join(missing)}, which the store does not hold")
    elif not loudest_of_beams:
        say("sheet: without beam signals, for no beam of the frame points at a target, or no source sounds")
    errors = Errors(points=frame.points, error=frame.range_error)
    view = frame_view(tree, frame)
    fig = sheet(*beam_grid(tree), view, errors, loudest_of_beams, window([view]), "energy re the brightest beam (dB)")
    return save(fig, folder / "sheet.png")
