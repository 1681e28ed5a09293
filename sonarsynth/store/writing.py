"""Writing whole shards, and knowing which are missing."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sonarsynth.pipeline import Values
from sonarsynth.store.encoding import encoded
from sonarsynth.store.files import within
from sonarsynth.store.files.place import Folder, Opened, absolute, folder_of, held, record_of, remove, write_each
from sonarsynth.store.files.remote import Remote
from sonarsynth.store.files.within import OpenedFolder
from sonarsynth.store.layout import layout_of
from sonarsynth.store.marks import (
    ABSENT,
    ContentDigest,
    Damage,
    Mark,
    drop_mark,
    file_missing_of,
    load_marks,
    marked,
    save_mark,
)
from sonarsynth.store.opening import attributes_in
from sonarsynth.store.provenance import other_versions

if TYPE_CHECKING:
    from sonarsynth.planning import Plan

GONE: Final = (
    "the store was moved, removed or exchanged while it was built: put it back, or use its "
    "new name, and run the same command again to resume"
)


def write_shard(
    path: Folder | str,
    plan: Plan,
    shard: int,
    frames: Mapping[int, Values],
    still: Callable[[], None] = lambda: None,
) -> Mark:
    """Write one whole shard of every array, then its completion mark. Frames not given read as fill values.

    `still` is called before the mark is written, and may raise. Raises ValueError, before anything is written, where a
    frame is not of this shard or its values do not fit; Damage where the store is not there any more, or is another.
    The mark names what is of another version in this process than where the store was begun, and may change numbers.
    """
    path = folder_of(path)
    try:
        with held(path) as opened:
            return _write(opened, plan, shard, frames, still)
    except OSError as error:
        if isinstance(path, Path) and not os.path.lexists(path):
            raise Damage(f"{path}: {GONE}") from None
        if error.errno in (errno.ELOOP, errno.ENOTDIR):
            raise Damage(f"{error.filename or path}: {error.strerror}: 'sonarsynth repair' moves it out") from None
        raise


def _write(store: Opened, plan: Plan, shard: int, frames: Mapping[int, Values], still: Callable[[], None]) -> Mark:
    layout, versions = layout_of(plan), _other_versions(store, plan)
    region = layout.region(shard)
    outside = sorted(set(frames) - set(region))
    if outside:
        raise ValueError(f"frame {outside[0]} is not in shard {shard} (frames {region.start} to {region.stop - 1})")
    checked = {frame: layout.check(values) for frame, values in sorted(frames.items())}
    drop_mark(store, shard)
    content, packed = ContentDigest(), dict[str, bytes | None]()
    for array in sorted((a for a in layout.arrays if not a.empty), key=lambda a: a.path):
        chunks = layout.chunks(array, shard, checked)
        content.add(array.path, chunks)
        packed[array.file(shard)] = encoded(array, chunks)
    for name in (name for name, of_file in packed.items() if of_file is None):
        remove(store, name, sync=False)
    write_each(store, {name: of_file for name, of_file in packed.items() if of_file is not None})
    files = {name: ABSENT if of_file is None else record_of(of_file) for name, of_file in packed.items()}
    if isinstance(store, OpenedFolder) and not store.in_its_place():
        raise Damage(f"{store}: {GONE}")
    still()
    mark = Mark(str(shard), tuple(checked), str(content), files, {"versions": versions} if versions else {})
    save_mark(store, mark)
    return mark


def _other_versions(store: Opened, plan: Plan) -> dict[str, str]:
    """What is of another version in this process than where the store was begun. Raises Damage unless the store is
    there, and of this plan."""
    key = None
    if not isinstance(store, Remote):
        status = within.status(store, "zarr.json")
        if status is None:
            raise Damage(f"{store}: {GONE}")
        key = (str(store), plan.digest, status.st_dev, status.st_ino, status.st_mtime_ns)
    if key is None or key not in _seen:
        attrs = attributes_in(store)
        if attrs.get("recipe_digest") != plan.digest:
            raise Damage(f"{store}: {GONE}")
        _seen.clear()
        _seen[key] = {name: now for name, (_, now) in other_versions(attrs).items()}
    return _seen[key]


_seen: dict[tuple[object, ...] | None, dict[str, str]] = {}


def missing(path: Folder | str, plan: Plan, frames: Iterable[int] | None = None) -> dict[int, tuple[int, ...]]:
    """Shards to do so that `frames` (left out: all) are in the store, and the frames to render for each.

    A shard is written whole, so one that has some of its frames is rendered again with those and the wanted ones; so is
    one with a file that is gone, which readers would take for one of fill values.
    Raises IndexError for a frame outside the dataset.
    """
    path, layout = absolute(path), layout_of(plan)
    wanted: dict[int, set[int]] = {}
    for frame in range(layout.frames) if frames is None else frames:
        if not 0 <= frame < layout.frames:
            raise IndexError(f"frame {frame} is outside 0..{layout.frames - 1}")
        wanted.setdefault(frame // layout.shard_frames, set()).add(frame)
    stored, broken, file_missing = dict[int, set[int]](), set[int](), file_missing_of(path)
    for shard, mark in _whole_marks(path, wanted.keys() & set(marked(path))):
        stored[shard] = set(mark.frames)
        if file_missing(mark):
            broken.add(shard)
    todo = {}
    for shard, needed in sorted(wanted.items()):
        have = stored.get(shard, set())
        if shard in broken or not needed <= have:
            todo[shard] = tuple(sorted(needed | have))
    return todo


def frames_there(path: Folder | str) -> list[int]:
    """Frames that are complete in the store, by their marks."""
    path = absolute(path)
    return sorted(frame for _, mark in _whole_marks(path, marked(path)) for frame in mark.frames)


def _whole_marks(path: Folder, shards: Iterable[int]) -> Iterator[tuple[int, Mark]]:
    """The marks of shards that are whole, with their numbers."""
    return ((number, mark) for number, mark in load_marks(path, sorted(shards)) if isinstance(mark, Mark))
