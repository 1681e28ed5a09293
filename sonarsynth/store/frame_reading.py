"""Single frames of a store in random order, as training reads them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache, partial
from typing import Any, Final

from sonarsynth.store.files.place import Folder, absolute, read
from sonarsynth.store.files.remote import Remote
from sonarsynth.store.files.within import Mismatch
from sonarsynth.store.frame_arrays import FrameArray, as_laid, file_of
from sonarsynth.store.marks import WrittenFiles
from sonarsynth.store.opening import must_be_as_laid_out, must_be_folder

MOST_FILES: Final = 64
"""That are kept open."""


class FrameReader:
    """The arrays of a store that have frames. It can be pickled and forked: files are opened where they are read.

    path: a folder of this machine. Raises Mismatch where there is no store of this format, or for a URL.
    """

    def __init__(self, path: Folder | str) -> None:
        folder = absolute(path)
        if isinstance(folder, Remote):
            raise Mismatch(f"{folder}: frames are read from a folder of this machine: copy the store to one")
        must_be_folder(folder)
        must_be_as_laid_out(folder)
        self.root = folder
        try:
            document = json.loads(read(folder, "zarr.json"))
            self.attrs: Mapping[str, Any] = document["attributes"]
            self._members: Mapping[str, Any] = document["consolidated_metadata"]["metadata"]
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise Mismatch(f"{folder}: is no store of sonarsynth ({type(error).__name__}: {error})") from None
        self._open()

    def _open(self) -> None:
        self._file = lru_cache(MOST_FILES)(partial(file_of, self.root, WrittenFiles(self.root)))
        self._arrays: dict[str, FrameArray] = {}

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name not in ("_file", "_arrays")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._open()

    def __contains__(self, name: str) -> bool:
        return name in self._members

    def attributes_of(self, name: str) -> Mapping[str, Any]:
        """Attributes of an array. Raises KeyError."""
        attributes: Mapping[str, Any] = self._members[name]["attributes"]
        return attributes

    def array(self, name: str) -> FrameArray:
        """An array by its path, such as "image/energy". Raises KeyError where there is none, Mismatch for one that
        does not lie as this version lays it."""
        if name not in self._arrays:
            self._arrays[name] = FrameArray(as_laid(name, self._members[name]), self._file)
        return self._arrays[name]
