"""Clouds of many frames fused in one frame of reference."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.description import FieldError
from sonarsynth.geometry import Pose, rotation_matrix, turned
from sonarsynth.store import some_frames, tree_of

if TYPE_CHECKING:
    import xarray as xr

KEPT = ("energy", "snr", "range", "range_error", "target", "emission", "family", "facet", "distance", "origin")
"""What is kept of each point beside its place."""
AXES = ("sonar", "world")
"""What positions may be relative to beside targets: a target of such a name is not meant."""
NEEDED = (("truth", "sonar_velocity"), ("truth", "sonar_spin"), ("truth/targets", "orientation_at_echo"))
"""Variables that points are placed by, and that stores of earlier versions lack."""


def points(
    store: str | Path | xr.DataTree, frames: int | Iterable[int] | None = None, *, relative_to: str = "sonar"
) -> xr.Dataset:
    """The points of some frames of a store as one cloud.

    Parameters
    ----------
    store: path, URL or opened tree.
    frames: a number, several, or a mask (frame,) of bool; left out: all that were built.
    relative_to: the axes of `position`: "sonar", those of the array when it heard the echo; "world"; or the name of a
        target, as it was when the sound met it, so that points on its hull fall together whatever it and the array do.

    Returns
    -------
    A dataset along `point`: `position` and `normal` (point, xyz), m and of unit length: the normal of the true facet
    that brought most of the echo, NaN where none did; `frame`; and the columns of /cloud (`energy` in Pa2 s, `target`
    and the other labels). A frame that was not built gives no points.

    Raises
    ------
    FieldError where the store has no cloud, no target of that name, or is of an earlier version; IndexError for a
    frame that it has not; TypeError for a number of a frame that is not whole.
    """
    import xarray as xr

    tree = tree_of(store)
    if "cloud" not in tree.children:
        raise FieldError(("cloud",), "the store has no cloud: it was built without that product")
    for group, variable in NEEDED:
        if variable not in tree[group].data_vars:
            raise FieldError(("store",), f"has no {group}/{variable}, which it takes to place points: build it again")
    names = [str(name) for name in tree["truth/targets"].coords["target"].values]
    if relative_to not in (*AXES, *names):
        raise FieldError(
            ("relative_to",), f"must be sonar, world or a target ({', '.join(names)}), not {relative_to!r}"
        )
    cloud = tree["cloud"].dataset
    chosen = some_frames(tree, frames) or [0] * (frames is None)
    of_frames = [_frame(tree, index, relative_to, names) for index in chosen]
    columns = {name: np.concatenate([c[name] for c in of_frames]) for name in of_frames[0]} if of_frames else {}
    variables = {
        name: (("point", "xyz") if values.ndim == 2 else ("point",), values, _attributes(cloud, name))
        for name, values in columns.items()
    }
    return xr.Dataset(variables, attrs={"relative_to": relative_to})


def _attributes(cloud: xr.Dataset, name: str) -> dict[str, object]:
    own: dict[str, dict[str, object]] = {
        "position": {"units": "m", "long_name": "place of the point"},
        "normal": {"units": "1", "long_name": "outward normal of the facet that brought most of the echo"},
        "frame": {"units": "1", "long_name": "frame of the point"},
    }
    return own[name] if name in own else dict(cloud[name].attrs)


def _frame(tree: xr.DataTree, index: int, relative_to: str, names: list[str]) -> dict[str, np.ndarray]:
    """Columns (point,) of the points of a frame."""
    cloud, truth = (tree[group].dataset.isel(frame=index) for group in ("cloud", "truth"))
    bodies = tree["truth/targets"].dataset.isel(frame=index)
    finite = np.isfinite(cloud["range"].values)
    columns = {name: cloud[name].values[finite] for name in KEPT if name in cloud}
    position = np.stack([cloud[axis].values[finite] for axis in "xyz"], axis=-1).astype(float)
    sonar = Pose(truth["sonar_position"].values, truth["sonar_orientation"].values)
    clock = next(iter(tree["source_estimates"].dataset["time"].values[index]), np.nan)  # NaN: a scene without sources
    normal = _normals(tree, bodies, columns["target"], columns["facet"], columns["emission"], names)
    heard, spin = clock + cloud["delay"].values[finite].astype(float), truth["sonar_spin"].values
    if relative_to == "sonar":
        normal = sonar.turn_to_body(turned(normal, spin, -heard))
    else:
        carried = sonar.position + np.outer(heard, truth["sonar_velocity"].values)
        position = carried + turned(sonar.turn_to_world(position), spin, heard)
    if relative_to in names and relative_to not in AXES:
        body = bodies.isel(target=names.index(relative_to))
        rotations = _rotations(body, columns["emission"])
        position = np.einsum("pij,pi->pj", rotations, position - _at_echo(body, "position", columns["emission"]))
        normal = np.einsum("pij,pi->pj", rotations, normal)
    return {"position": position, "normal": normal, "frame": np.full(len(position), index, np.int32), **columns}


def _at_echo(body: xr.Dataset, name: str, emission: Ints) -> Floats:
    """Position or orientation (point, ...) of a body when the snap of each point met it; at the instant of the frame,
    where that is not known."""
    met = body[f"{name}_at_echo"].values[np.maximum(emission, 0)]
    return np.asarray(np.where(np.isfinite(met), met, body[name].values))


def _rotations(body: xr.Dataset, emission: Ints) -> Floats:
    """Rotation matrices (point, 3, 3) from a body to the world when the snap of each point met it."""
    orientations = _at_echo(body, "orientation", emission)
    return np.array([rotation_matrix(orientation) for orientation in orientations]).reshape(-1, 3, 3)


def _normals(
    tree: xr.DataTree, bodies: xr.Dataset, target: Ints, facet: Ints, emission: Ints, names: list[str]
) -> Floats:
    """Outward normals (point, xyz), world, of the facets that brought the echoes; NaN where none did."""
    normals = np.full((len(target), 3), np.nan)
    for number in range(len(names)):
        rows = np.flatnonzero((target == number) & (facet >= 0))
        if not len(rows):
            continue
        group = tree["targets"][str(bodies["group"].values[number])]
        mesh = (group[str(int(bodies["mesh"].values[number]))] if group.children else group).dataset
        a, b, c = np.moveaxis(mesh["vertices"].values.astype(float)[mesh["faces"].values[facet[rows]]], 1, 0)
        across = np.cross(b - a, c - a)
        own = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), np.finfo(float).tiny)
        rotations = _rotations(bodies.isel(target=number), emission[rows])
        normals[rows] = np.einsum("pij,pj->pi", rotations, own)
    return normals
