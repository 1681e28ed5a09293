"""Opening a store to read it, by xarray; what its root says, and whether that is of the format of this version."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sonarsynth.conventions import FORMAT_VERSION
from sonarsynth.description import FieldError
from sonarsynth.products import SPLITS
from sonarsynth.store.files.place import Folder, Opened, absolute, folder_of, read_json, record, there
from sonarsynth.store.files.remote import Remote
from sonarsynth.store.files.within import Mismatch
from sonarsynth.store.marks import MARKS, Damage, load_layout, warn_unmarked

if TYPE_CHECKING:
    import xarray as xr


def root_attributes(path: Folder | str) -> dict[str, Any]:
    """Root attributes of a store, {} where there is none."""
    return attributes_in(absolute(path))


def attributes_in(store: Opened) -> dict[str, Any]:
    """The same of a store that is open."""
    attributes = read_json(store, "zarr.json").get("attributes")
    return attributes if isinstance(attributes, dict) else {}


def check_format(path: Folder, attributes: Mapping[Any, Any]) -> None:
    """Raise Mismatch where the root attributes of a store are of another format than this version reads and writes."""
    stored = attributes.get("sonarsynth_format")
    if stored is not None and str(stored) != FORMAT_VERSION:
        raise Mismatch(
            f"{path} was written in format {str(stored)[:20]}, and this version reads format {FORMAT_VERSION}: "
            "build it again from its recipe with --restart"
        )


def must_be_folder(path: Folder) -> None:
    """Raise Mismatch where there is nothing, or a file."""
    if not path.is_dir():
        raise Mismatch(f"{path} is not a store: it is not a folder" if there(path) else f"{path}: no such store")


def must_be_as_laid_out(path: Folder) -> None:
    """Raise Mismatch for a store of another format, Damage where its metadata, by which all numbers are read, are not
    those of its mark."""
    check_format(path, root_attributes(path))
    layout = load_layout(path)
    laid = None if layout is None else layout.files.get("zarr.json")
    with suppress(OSError):
        if laid is None or record(path, "zarr.json", size=laid[0]) == laid:
            return
    raise Damage(f"{path}: zarr.json is missing or damaged: 'sonarsynth repair' restores it")


def open_store(path: Folder | str) -> xr.DataTree:
    """A store as a DataTree, read lazily: what `xarray.open_datatree(path, engine="zarr")` gives, but no link in the
    store is followed, and counts of the converter decode to float32 (plain xarray: float64).

    path: a folder or a URL. Returns the tree. Raises Mismatch where there is no store of ours, or one of another
    format; Damage where its metadata are not as they were laid out. Reading a variable of the tree raises Damage where
    a file cannot be decoded, or is missing. Warns (`Unmarked`) where marks are gone, so that what is missing is not
    known.
    """
    import xarray as xr
    import zarr

    from sonarsynth.store.files.decoding import NAMING, opens_whole, read_from_disk

    folder = absolute(path)
    must_be_folder(folder)
    must_be_as_laid_out(folder)
    try:
        with zarr.config.set(NAMING):
            stored = xr.open_datatree(opens_whole(folder), engine="zarr", decode_cf=False)
        if "truth" not in stored.children or "frame" not in stored["truth"].sizes:
            raise Mismatch(f"{folder}: a store has a group /truth with frames; this has none")
        read_from_disk(stored, folder)
        tree = stored.map_over_datasets(_decoded)
    except (Mismatch, Damage):
        raise
    except Exception as error:  # metadata of a stranger: zarr and xarray raise whatever they stumble over
        if type(error).__name__ == "GroupNotFoundError":
            raise Mismatch(f"{folder} is not a store of sonarsynth") from None
        first = (str(error).splitlines() or [type(error).__name__])[0]
        raise Mismatch(f"{folder}: not a store that xarray can open ({first})") from None
    tree.set_close(stored.close)
    warn_unmarked(folder)
    return tree


def store_around(place: Folder | str) -> Path | None:
    """The store that a place is in: it takes no other files, which `verify` calls damage. None of another place."""
    folder = folder_of(place)
    above = () if isinstance(folder, Remote) else Path(os.path.realpath(folder)).parents
    return next((of for of in above if (of / MARKS).is_dir()), None)


def tree_of(store: Folder | str | xr.DataTree) -> xr.DataTree:
    """The tree of a store: as it is, or opened. Raises as `open_store`."""
    import xarray as xr

    return store if isinstance(store, xr.DataTree) else open_store(store)


def built_frames(tree: xr.DataTree) -> np.ndarray:
    """Numbers (frame,) of the frames of a tree that were built: the others read as NaN and -1."""
    return np.flatnonzero(np.isfinite(np.asarray(tree["truth/sonar_position"].values)[:, 0]))


def some_frames(tree: xr.DataTree, frames: int | Iterable[int] | None) -> list[int]:
    """Numbers of frames of a tree: one, several, or those of a mask (frame,); left out: all that were built.

    Raises IndexError for a frame that is not there, or a mask of another length, TypeError for what is no whole number.
    """
    if frames is None:
        return [int(frame) for frame in built_frames(tree)]
    return frame_numbers(frames, tree["truth"].sizes["frame"])


def frame_numbers(frames: int | Iterable[int], count: int) -> list[int]:
    """Numbers of frames, of `count`: one, several, or those of a mask (frame,). Raises as `some_frames`."""
    listed = list(frames) if isinstance(frames, Iterable) and not hasattr(frames, "__array__") else frames
    chosen = np.atleast_1d(np.asarray(listed))
    if chosen.dtype == bool and chosen.shape != (count,):
        raise IndexError(f"a mask of {chosen.size} frames, where there are {count}")
    numbers = np.flatnonzero(chosen) if chosen.dtype == bool else chosen
    if numbers.size and numbers.dtype.kind not in "iu":
        raise TypeError(f"frames must be whole numbers, not {frames!r}")
    if len(wrong := numbers[(numbers < 0) | (numbers >= count)]):
        raise IndexError(f"frame {wrong[0]} is outside 0..{count - 1}")
    return [int(frame) for frame in numbers]


def chosen_frames(tree: xr.DataTree, split: str | None = None) -> np.ndarray:
    """Numbers (frame,) of the frames of a tree that were built, of one split alone where it is named.

    Raises FieldError for a name that is none of a split, or a split without frames; Mismatch as `splits_of`.
    """
    built = built_frames(tree)
    if split is None:
        return built
    if split not in SPLITS:
        raise FieldError(("split",), f"must be one of {', '.join(SPLITS)}, not {split}")
    chosen = np.asarray(built[np.asarray(splits_of(tree, built), str) == split])
    if not len(chosen):
        raise FieldError(("split",), f"no frame of {split} has been built")
    return chosen


def splits_of(tree: xr.DataTree, frames: np.ndarray) -> list[str]:
    """Names (frame,) of the splits of some frames of a tree: one of `SPLITS`, whatever the store calls them, since
    files and pages are made of these. Raises Mismatch for a number that is none of a split."""
    numbers = np.asarray(tree["split"].values)[frames].tolist()
    if wrong := [number for number in numbers if number not in range(len(SPLITS))]:
        raise Mismatch(f"split: {wrong[0]} is no number of a split (0 to {len(SPLITS) - 1})")
    return [SPLITS[number] for number in numbers]


def _decoded(dataset: xr.Dataset) -> xr.Dataset:
    """A group as CF means it; a scale factor has the precision of its numbers, which JSON cannot say."""
    import xarray as xr

    for variable in dataset.variables.values():
        if variable.dtype.itemsize <= 2 and "scale_factor" in variable.attrs:
            variable.attrs["scale_factor"] = np.float32(variable.attrs["scale_factor"])
    return xr.decode_cf(dataset)
