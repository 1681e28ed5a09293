"""Opening a store to work with it: the tree of xarray, tables and pictures under `.sonar`, frames for training."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sonarsynth.loading.accessor import SonarAccessor
from sonarsynth.loading.frames import Frames, RenderedFrames
from sonarsynth.store import Folder, absolute, open_store

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Frames", "RenderedFrames", "SonarAccessor", "open"]


def open(path: Folder | Path | str) -> xr.DataTree:
    """A store as a DataTree, read lazily: what `xarray.open_datatree(path, engine="zarr")` gives, but no link in the
    store is followed, and counts of the converter decode to float32 (plain xarray: float64).

    Parameters
    ----------
    path: a folder or a URL.

    Returns
    -------
    xarray's own tree: `tree["truth/targets"].sel(target="remus")`. Its `.sonar` has tables and pictures (see
    `SonarAccessor`): `tree.sonar.points(7)`, `tree.sonar.table("truth/targets")`, `tree.sonar.image(7)`. Frames that
    were not built read as NaN and -1: `print(tree.sonar)` says which were, and which failed.

    Raises
    ------
    Mismatch where there is no store of ours, or one of another format. Reading a variable raises Damage where its file
    is damaged or missing; chunks that were exchanged whole are found by `verify` alone.
    """
    tree = open_store(path)
    tree.encoding["source"] = str(absolute(path))
    return tree
