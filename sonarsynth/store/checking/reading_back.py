"""Reading a store back: the numbers that were written, finite where they must be, on coordinates that make sense."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np

from sonarsynth.store.checking.examining import Problem
from sonarsynth.store.files.place import Folder, opens
from sonarsynth.store.marks import ContentDigest, Mark
from sonarsynth.store.opening import root_attributes

if TYPE_CHECKING:
    import xarray as xr

MUST_BE_FINITE: Final = ("/", "/signals")
"""Groups without NaN in the frames that are there; elsewhere NaN means "no point", "not found"."""


def read_back(path: Folder, mark: Mark) -> Iterator[Problem]:
    """Decode a shard: its contents must have the digest of its mark, and be finite where they must be."""
    import zarr

    try:
        root = zarr.open_group(opens(path), mode="r")
    except Exception as error:  # whatever zarr raises on metadata that somebody forged
        yield Problem("zarr.json", f"cannot be read by zarr: {error}", mark.frames)
        return
    shard, step = int(mark.name), root_attributes(path).get("shard_frames")
    if not isinstance(step, int) or step < 1:
        yield Problem(f"shard {shard}", "the store does not say how many frames are in one", mark.frames)
        return
    digest = ContentDigest(mark.content)
    for name in sorted({file.rpartition("/")[0] for file in mark.files}):
        try:
            array = root[name]
            assert isinstance(array, zarr.Array)
            block = np.asarray(array[shard * step : min((shard + 1) * step, array.shape[0])])
        except Exception as error:  # whatever a codec raises on what it cannot decode
            yield Problem(f"{name}, shard {shard}", f"cannot be decoded: {error}", mark.frames)
            return
        digest.add(name, [block])
        yield from _finite(name, block, mark.frames, shard * step)
    if str(digest) != mark.content:
        yield Problem(f"shard {shard}", "its data are not those that were written", mark.frames)


def _finite(name: str, block: np.ndarray, frames: tuple[int, ...], first: int) -> Iterator[Problem]:
    rows = [f - first for f in frames if f - first < len(block)]
    if block.dtype.kind != "f" or not block.size or not rows:
        return
    group = "/" + name.rpartition("/")[0]
    bad = np.isinf(block[rows]) if group not in MUST_BE_FINITE else ~np.isfinite(block[rows])
    for i in np.flatnonzero(bad.reshape(len(rows), -1).any(axis=1)):
        frame = first + rows[i]
        yield Problem(f"{name}, frame {frame}", f"{int(bad[i].sum())} values are not finite", (frame,))


def structure(path: Folder) -> Iterator[Problem]:
    """Plain xarray opens it, every variable has units, and every coordinate can be looked up."""
    import xarray as xr

    try:
        with xr.open_datatree(opens(path), engine="zarr", chunks=None) as tree:
            yield from described(tree)
    except Exception as error:
        yield Problem(str(path), f"cannot be opened by xarray: {error}")


def described(tree: xr.DataTree) -> Iterator[Problem]:
    """Every variable of a tree has units, and every coordinate can be looked up."""
    for node in tree.subtree:
        for name, variable in node.to_dataset(inherit=False).variables.items():
            path = f"{node.path}/{name}".replace("//", "/")
            if "units" not in variable.attrs:
                yield Problem(path, "has no units")
            if variable.dims == (name,):
                yield from _coordinate(path, variable)


def _coordinate(path: str, variable: xr.Variable) -> Iterator[Problem]:
    """Labels of an axis: finite and strictly rising or falling numbers, or texts that differ."""
    values = np.asarray(variable.values)
    if values.dtype.kind not in "iuf":
        if len(set(values.tolist())) != len(values):
            yield Problem(path, "has the same label twice")
    elif not np.isfinite(values).all():
        yield Problem(path, f"{int((~np.isfinite(values)).sum())} values are not finite")
    else:
        step = np.diff(values.astype(float))
        if not (np.all(step > 0) or np.all(step < 0)):
            yield Problem(path, "neither rises nor falls throughout")
