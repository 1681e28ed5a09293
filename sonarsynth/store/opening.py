"""Opening a store to read it, by xarray."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sonarsynth.store.files.place import Folder, absolute, opens
from sonarsynth.store.files.within import Mismatch

if TYPE_CHECKING:
    import xarray as xr


def open_store(path: Folder | str) -> xr.DataTree:
    """A store as a DataTree, read lazily: what `xarray.open_datatree(path, engine="zarr")` gives, but no link in the
    store is followed.

    path: a folder or a URL. Raises Mismatch where there is no store that xarray can open.
    """
    import xarray as xr

    folder = absolute(path)
    try:
        return xr.open_datatree(opens(folder), engine="zarr")
    except (OSError, ValueError, KeyError) as error:
        first = (str(error).splitlines() or [type(error).__name__])[0]
        raise Mismatch(f"{folder}: not a store that xarray can open ({first})") from None
