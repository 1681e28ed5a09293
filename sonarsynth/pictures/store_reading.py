"""What pictures need of a store, read with plain xarray. Whatever a store does not hold comes back as None."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats, Ints, azimuth_elevation, direction
from sonarsynth.equations.arrays.grating_lobes import grating_lobes, lattice_pitch
from sonarsynth.evaluation.point_checks import has_labels, points
from sonarsynth.geometry import Pose
from sonarsynth.pictures.figures.frame_figure import Hull
from sonarsynth.pictures.figures.ghost_rings import Ghost
from sonarsynth.store import Folder, Mismatch, folder_of, named_after, open_store

if TYPE_CHECKING:
    import xarray as xr

LOBED = 20.0
"""Grating lobes are drawn of direct echoes, and of ghosts that are less than this many dB under them."""
LOBE_POINTS = 24
"""Frequencies of the band at which a grating lobe is drawn."""
POINTS = ("x", "y", "z", "azimuth", "elevation", "energy", "delay", "target")
FAINTEST = 40.0
"""Ghosts this many dB under the direct echo of their target are not drawn."""


class NothingToDraw(ValueError):
    """There is no store, or nothing in it to draw; str() is one line."""


def opened(store: str | Folder) -> xr.DataTree:
    """The store as a DataTree. Raises NothingToDraw when it is not one."""
    try:
        return open_store(folder_of(store))
    except Mismatch as problem:
        raise NothingToDraw(str(problem)) from None


def pictures_of(store: str | Folder, name: str = "") -> Path:
    """The folder that the pictures of a store go to: beside it, or in the working directory where it is at a URL."""
    path = named_after(store)
    return path.with_name(f"{name or path.name}.pictures")


def _variable(tree: xr.DataTree, name: str) -> xr.Variable | None:
    group, _, variable = name.rpartition("/")
    try:
        return (tree[group] if group else tree).variables[variable]
    except KeyError:
        return None


def read(tree: xr.DataTree, name: str, frame: int | np.ndarray | None = None) -> np.ndarray | None:
    """A variable ("image/energy"), of one frame, of some, or whole; None where the store does not hold it."""
    data = _variable(tree, name)
    if data is None:
        return None
    return np.asarray((data if frame is None or "frame" not in data.dims else data.isel(frame=frame)).values)


def needed(tree: xr.DataTree, name: str, frame: int | None = None) -> np.ndarray:
    """As `read`, for what pictures cannot do without. Raises NothingToDraw."""
    if (values := read(tree, name, frame)) is None:
        raise NothingToDraw(f"the store has no variable {name}")
    return values


def built(tree: xr.DataTree) -> np.ndarray:
    """Indices of the frames that were built: the others read as NaN."""
    return np.flatnonzero(np.isfinite(needed(tree, "truth/sonar_position")[:, 0]))


def beam_grid(tree: xr.DataTree) -> tuple[Floats, Floats]:
    """Azimuth and elevation of the beams (deg, ascending)."""
    return needed(tree, "truth/beams/azimuth").astype(float), needed(tree, "truth/beams/elevation").astype(float)


@dataclass(frozen=True, eq=False)
class StoredFrame:
    """One frame of a store; sonar frame, m."""

    index: int
    time: float  # s since the start of the trajectory
    energy: Floats | None  # (elevation, azimuth) Pa2 s; None where there is no image or the frame has none
    points: Floats  # (point, xyz) m
    range_error: Floats  # (point,) m: range less true range of direct echoes of targets; NaN elsewhere
    point_energy: Floats  # (point,) Pa2 s
    point_direction: Floats  # (point, 2) deg: azimuth and elevation
    point_delay: Floats  # (point,) s after the direct arrival
    point_target: Ints  # (point,) whose echo it is; -1 of none
    target: np.ndarray  # (elevation, azimuth) true target; -1 for none
    true_range: Floats  # (elevation, azimuth) m
    snap: Floats  # (snap, xyz) m, true positions
    poses: tuple[Pose, ...]  # of the boxes of targets in the sonar's frame; NaN of one that is not there
    hulls: tuple[Hull, ...]
    ghosts: tuple[Ghost, ...]
    lobes: tuple[Floats, ...]  # (frequency, azimuth and elevation) deg: grating lobes over the band


def every_stored(tree: xr.DataTree, frames: Sequence[int]) -> list[StoredFrame]:
    """Some frames as stored. A frame that was not built comes back full of NaN."""
    labelled = points(tree, frames) if has_labels(tree) else None
    stored_frames = []
    for index in frames:
        cloud: dict[str, Floats] = dict.fromkeys((*POINTS, "range_error"), np.zeros(0))
        if labelled is not None:
            own = labelled.frame == index
            cloud = {name: needed(tree, f"cloud/{name}", index)[labelled.row[own]].astype(float) for name in POINTS}
            cloud["range_error"] = np.where(labelled.judged[own], labelled.error[own], np.nan)
        stored_frames.append(_stored(tree, index, cloud))
    return stored_frames


def stored(tree: xr.DataTree, index: int) -> StoredFrame:
    """One frame as stored."""
    return every_stored(tree, [index])[0]


def _stored(tree: xr.DataTree, index: int, cloud: Mapping[str, Floats]) -> StoredFrame:
    energy = read(tree, "image/energy", index)
    pose = _sonar(tree, index)
    time = read(tree, "time", index)
    return StoredFrame(
        index=index,
        time=float("nan") if time is None else float(time),
        energy=None if energy is None or not np.isfinite(energy).any() else energy.astype(float),
        points=np.stack([cloud["x"], cloud["y"], cloud["z"]], axis=-1),
        range_error=cloud["range_error"],
        point_energy=cloud["energy"],
        point_direction=np.stack([cloud["azimuth"], cloud["elevation"]], axis=-1),
        point_delay=cloud["delay"],
        point_target=cloud["target"].astype(int),
        target=needed(tree, "truth/beams/target", index),
        true_range=needed(tree, "truth/beams/range", index).astype(float),
        snap=pose.to_body(needed(tree, "truth/emissions/position", index)),
        poses=_poses(tree, index),
        hulls=hulls(tree, index),
        ghosts=ghosts(tree, index),
        lobes=lobes(tree, index),
    )


def _sonar(tree: xr.DataTree, index: int) -> Pose:
    return Pose(needed(tree, "truth/sonar_position", index), needed(tree, "truth/sonar_orientation", index))


def _poses(tree: xr.DataTree, index: int) -> tuple[Pose, ...]:
    """The poses of the boxes of targets, as the array hears them, in the sonar's frame; none in a store without."""
    centre, orientation = (read(tree, f"truth/targets/box_{name}", index) for name in ("centre", "orientation"))
    if centre is None or orientation is None:
        return ()
    return tuple(Pose(*pose) for pose in zip(centre, orientation, strict=True))


def echo_levels(tree: xr.DataTree, frame: int | np.ndarray) -> tuple[Floats, list[str]] | None:
    """Levels (target, family) in dB re the direct echo of each target, and the families; None where none are stored.

    A target without a direct echo: re its strongest. frame: one, or several (frame,), which are the leading axis then.
    """
    level, families = read(tree, "truth/targets/echo_level", frame), read(tree, "truth/targets/family")
    if level is None or families is None:
        return None
    names = [str(name) for name in families]
    direct = level[..., names.index("direct")]
    strongest = np.max(level, axis=-1, initial=-np.inf, where=np.isfinite(level))
    return level - np.where(np.isfinite(direct), direct, strongest)[..., None], names


def ghosts(tree: xr.DataTree, frame: int) -> tuple[Ghost, ...]:
    """Ghosts of all targets that are less than `FAINTEST` under the direct echo; none in a store without echoes."""
    levels = echo_levels(tree, frame)
    azimuth, elevation = (read(tree, f"truth/targets/echo_{name}", frame) for name in ("azimuth", "elevation"))
    targets = read(tree, "truth/targets/target")
    if levels is None or azimuth is None or elevation is None or targets is None:
        return ()
    level, families = levels
    drawn = []
    for target, family in np.argwhere(level > -FAINTEST):
        if families[family] != "direct" and not _blended(azimuth[target], elevation[target], families, int(family)):
            whose = f"{targets[target]}: " if len(targets) > 1 else ""
            bearing = float(azimuth[target, family]), float(elevation[target, family])
            drawn.append(Ghost(f"{whose}{families[family]} ghost", int(target), *bearing, float(level[target, family])))
    return tuple(drawn)


def lobes(tree: xr.DataTree, frame: int) -> tuple[Floats, ...]:
    """Lines (frequency, azimuth and elevation) in deg along which the image has grating lobes of the loudest echoes.

    None in a store without echoes, or of an array that is no lattice.
    """
    levels, position = echo_levels(tree, frame), read(tree, "signals/position")
    azimuth, elevation = (read(tree, f"truth/targets/echo_{name}", frame) for name in ("azimuth", "elevation"))
    pitch = 0.0 if position is None else lattice_pitch(position)
    if levels is None or azimuth is None or elevation is None or not pitch:
        return ()
    frequency = np.linspace(tree.attrs["band_low"], tree.attrs["band_high"], LOBE_POINTS)
    grid = [needed(tree, f"truth/beams/{name}") for name in ("azimuth", "elevation")]
    low, high = np.array([[axis.min(), axis.max()] for axis in grid]).T
    drawn = []
    for echo in np.argwhere((levels[0] > -LOBED) & np.isfinite(azimuth + elevation)):
        towards = direction(*np.deg2rad([azimuth[tuple(echo)], elevation[tuple(echo)]]))
        beams = grating_lobes(towards, frequency, pitch, tree.attrs["assumed_sound_speed"])
        lines = np.rad2deg(np.stack(azimuth_elevation(beams), axis=-1))
        drawn += [line for line in lines if ((line >= low) & (line <= high)).all(axis=-1).any()]
    return tuple(drawn)


def _blended(azimuth: Floats, elevation: Floats, families: list[str], family: int) -> bool:
    """True where a direction (deg) is none, or the mean of several that lie apart, where there is nothing to see.

    Echoes by surface and bottom come from above (the bottom first) and from below (the surface first). Each of the two
    lies farther from the direct echo than the ghosts by one boundary do; their mean lies between them.
    """
    towards = direction(np.deg2rad(azimuth), np.deg2rad(elevation))
    if not np.isfinite(towards[family]).all():
        return True
    if " and " not in families[family]:
        return False
    once = [i for i, name in enumerate(families) if name != "direct" and " and " not in name]
    near = towards @ towards[families.index("direct")]
    return bool((near[once] <= near[family]).any())


def mesh_group(tree: xr.DataTree, target: int, index: int) -> str:
    """Where the mesh is that a target has in a frame: its group, or one of those in it where there are several."""
    group, which = (needed(tree, f"truth/targets/{n}", i)[target] for n, i in (("group", None), ("mesh", index)))
    return f"targets/{group}" if read(tree, f"targets/{group}/0/faces") is None else f"targets/{group}/{int(which)}"


def hulls(tree: xr.DataTree, index: int) -> tuple[Hull, ...]:
    """The targets of a frame where they truly are when they are heard; none of a frame that was not built."""
    names, poses = read(tree, "truth/targets/target"), _poses(tree, index)
    if names is None or not poses:
        return ()
    scale, bodies = needed(tree, "truth/targets/scale", index), []
    for i, name in enumerate(map(str, names)):
        if not np.isfinite(poses[i].position).all():  # not in this sequence
            continue
        group = mesh_group(tree, i, index)
        vertices, faces = read(tree, f"{group}/vertices"), read(tree, f"{group}/faces")
        if vertices is not None and faces is not None:
            middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
            bodies.append(Hull(name, poses[i].to_world(scale[i] * (vertices - middle)), faces.astype(np.int64)))
    return tuple(bodies)
