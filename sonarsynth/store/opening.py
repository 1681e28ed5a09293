"""Opening a store to read it, by xarray; and whether it is of the format that this version reads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sonarsynth.description import FieldError
from sonarsynth.pipeline.variables import FORMAT_VERSION
from sonarsynth.store.files.place import Folder, absolute, opens
from sonarsynth.store.files.within import Mismatch

if TYPE_CHECKING:
    import xarray as xr


def check_format(path: Folder, attributes: Mapping[Any, Any]) -> None:
    """Raise Mismatch where the root attributes of a store are of another format than this version reads and writes."""
    found = attributes.get("sonarsynth_format")
    if found is not None and str(found) != FORMAT_VERSION:
        raise Mismatch(
            f"{path} was written in format {str(found)[:20]}, and this version reads format {FORMAT_VERSION}: "
            "build it again from its recipe with --restart"
        )


def open_store(path: Folder | str) -> xr.DataTree:
    """A store as a DataTree, read lazily: what `xarray.open_datatree(path, engine="zarr")` gives, but no link in the
    store is followed, and counts of the converter decode to float32 (plain xarray: float64).

    path: a folder or a URL. Returns the tree. Raises Mismatch where there is no store that xarray can open, or one of
    another format.
    """
    import xarray as xr

    folder = absolute(path)
    try:
        stored = xr.open_datatree(opens(folder), engine="zarr", decode_cf=False)
        check_format(folder, stored.attrs)
        tree = stored.map_over_datasets(_decoded)
    except Mismatch:
        raise
    except (OSError, ValueError, KeyError) as error:
        first = (str(error).splitlines() or [type(error).__name__])[0]
        raise Mismatch(f"{folder}: not a store that xarray can open ({first})") from None
    tree.set_close(stored.close)
    return tree


def built_frames(tree: xr.DataTree) -> np.ndarray:
    """Numbers (frame,) of the frames of a tree that were built: the others read as NaN and -1."""
    return np.flatnonzero(np.isfinite(np.asarray(tree["truth/sonar_position"].values)[:, 0]))


def chosen_frames(tree: xr.DataTree, split: str | None = None) -> np.ndarray:
    """Numbers (frame,) of the frames of a tree that were built, of one split alone where it is named.

    Raises FieldError for a split that the store has not.
    """
    built = built_frames(tree)
    if split is None:
        return built
    known = str(tree["split"].attrs["flag_meanings"]).split() if "split" in tree.dataset else []
    if split not in known:
        raise FieldError(
            ("split",), f"must be one of {', '.join(known) or 'none: the store has no splits'}, not {split}"
        )
    return np.asarray(built[np.asarray(tree["split"].values)[built] == known.index(split)])


def _decoded(dataset: xr.Dataset) -> xr.Dataset:
    """A group as CF means it; a scale factor has the precision of its numbers, which JSON cannot say."""
    import xarray as xr

    for variable in dataset.variables.values():
        if variable.dtype.itemsize <= 2 and "scale_factor" in variable.attrs:
            variable.attrs["scale_factor"] = np.float32(variable.attrs["scale_factor"])
    return xr.decode_cf(dataset)
