"""The store: one Zarr v3 hierarchy that plain `xarray.open_datatree(path, engine="zarr")` reads.

Laid out whole from the plan, written one whole shard at a time, each shard with a completion mark; resumable, checked.
What writes and checks is imported when it is first used: who opens a store to read needs nothing of recipe and plan.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from sonarsynth.store.files.lock import BuildEnded, StoreLocked, lock, shared_lock
from sonarsynth.store.files.place import Folder, absolute, beside, folder_of, here, named_after, try_writing
from sonarsynth.store.files.remote import Remote, Unreachable
from sonarsynth.store.files.within import Mismatch
from sonarsynth.store.marks import Damage, Mark
from sonarsynth.store.opening import (
    built_frames,
    chosen_frames,
    frame_numbers,
    open_store,
    root_attributes,
    some_frames,
    splits_of,
    store_around,
    tree_of,
)

if TYPE_CHECKING:
    from sonarsynth.store.checking.examining import Findings, Problem, examine, must_be_store, ranges
    from sonarsynth.store.checking.verifying import Report, verify
    from sonarsynth.store.creating import create
    from sonarsynth.store.layout import layout_of
    from sonarsynth.store.writing import frames_there, missing, write_shard

_WRITERS = {
    "checking.examining": "Findings Problem examine must_be_store ranges",
    "checking.verifying": "Report verify",
    "creating": "create",
    "layout": "layout_of",
    "writing": "frames_there missing write_shard",
}

__all__ = [
    "BuildEnded",
    "Damage",
    "Findings",
    "Folder",
    "Mark",
    "Mismatch",
    "Problem",
    "Remote",
    "Report",
    "StoreLocked",
    "Unreachable",
    "absolute",
    "beside",
    "built_frames",
    "chosen_frames",
    "create",
    "examine",
    "folder_of",
    "frame_numbers",
    "frames_there",
    "here",
    "layout_of",
    "lock",
    "missing",
    "must_be_store",
    "named_after",
    "open_store",
    "ranges",
    "root_attributes",
    "shared_lock",
    "some_frames",
    "splits_of",
    "store_around",
    "tree_of",
    "try_writing",
    "verify",
    "write_shard",
]


def __getattr__(name: str) -> Any:
    for module, names in _WRITERS.items():
        if name in names.split():
            return globals().setdefault(name, getattr(importlib.import_module(f"{__name__}.{module}"), name))
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
