"""Writing whole shards, and knowing which are missing."""

from __future__ import annotations

import hashlib
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from sonarsynth.render import Values
from sonarsynth.store.encoding import encoded
from sonarsynth.store.layout import ArrayLayout, Layout, layout_of
from sonarsynth.store.marks import ABSENT, Mark, add_to_digest, drop_mark, load_marks, marked, save_mark
from sonarsynth.store.place import FileRecord, Folder, folder_of, write_new

if TYPE_CHECKING:
    from sonarsynth.planning import Plan

AT_ONCE: Final = 8
"""Files of a shard that are on their way at once: each waits for the disk, which takes several in the time of one."""


def write_shard(
    path: Folder | str,
    plan: Plan,
    shard: int,
    frames: Mapping[int, Values],
    still: Callable[[], None] = lambda: None,
) -> Mark:
    """Write one whole shard of every array, then its completion mark. Frames not given read as fill values.

    `still` is called before the mark is written, and may raise. Raises ValueError, before anything is written, where a
    frame is not of this shard or its values do not fit.
    """
    path, layout = folder_of(path), layout_of(plan)
    region = layout.region(shard)
    outside = sorted(set(frames) - set(region))
    if outside:
        raise ValueError(f"frame {outside[0]} is not in shard {shard} (frames {region.start} to {region.stop - 1})")
    checked = {frame: layout.check(values) for frame, values in sorted(frames.items())}
    drop_mark(path, shard)
    content = hashlib.sha256()
    files: dict[str, FileRecord] = {}
    under_way: deque[tuple[str, Future[FileRecord]]] = deque()
    with ThreadPoolExecutor(AT_ONCE) as writers:
        for array in sorted((a for a in layout.arrays if not a.empty), key=lambda a: a.path):
            if len(under_way) == AT_ONCE:
                name, first = under_way.popleft()
                files[name] = first.result()
            block = layout.block(array, shard, checked)
            add_to_digest(content, array.path, block)
            packed = _content(layout, array, region.start, block)  # here: threads keep the memory that they allocate
            under_way.append((array.file(shard), writers.submit(_put, path, array.file(shard), packed)))
        files |= {name: rest.result() for name, rest in under_way}
    still()
    mark = Mark(str(shard), tuple(checked), content.hexdigest(), files)
    save_mark(path, mark)
    return mark


def write_region(path: Folder, layout: Layout, array: ArrayLayout, start: int, block: np.ndarray) -> FileRecord:
    """Write frames start:start+len(block) of an array: their file, on the disk when this returns, and its record.

    Raises ValueError unless they are exactly one shard.
    """
    return _put(path, array.file(start // layout.shard_frames), _content(layout, array, start, block))


def _content(layout: Layout, array: ArrayLayout, start: int, block: np.ndarray) -> bytes | None:
    """What the file of a shard is to hold."""
    layout.check_region(start, start + len(block))
    return encoded(array, block)


def _put(path: Folder, name: str, content: bytes | None) -> FileRecord:
    if content is None or isinstance(path, Path):  # an object is written over
        (path / name).unlink(missing_ok=True)
    return ABSENT if content is None else write_new(path / name, content)


def missing(path: Folder | str, plan: Plan, frames: Iterable[int] | None = None) -> dict[int, tuple[int, ...]]:
    """Shards to do so that `frames` (left out: all) are in the store, and the frames to render for each.

    A shard is written whole, so one that has some of its frames is rendered again with those and the wanted ones.
    Raises IndexError for a frame outside the dataset.
    """
    path, layout = folder_of(path), layout_of(plan)
    wanted: dict[int, set[int]] = {}
    for frame in range(layout.frames) if frames is None else frames:
        if not 0 <= frame < layout.frames:
            raise IndexError(f"frame {frame} is outside 0..{layout.frames - 1}")
        wanted.setdefault(frame // layout.shard_frames, set()).add(frame)
    there = _have(path, wanted.keys() & set(marked(path)))
    todo = {}
    for shard, some in sorted(wanted.items()):
        have = there.get(shard, set())
        if not some <= have:
            todo[shard] = tuple(sorted(some | have))
    return todo


def frames_there(path: Folder | str) -> list[int]:
    """Frames that are complete in the store, by their marks."""
    path = folder_of(path)
    return sorted(frame for have in _have(path, marked(path)).values() for frame in have)


def _have(path: Folder, shards: Iterable[int]) -> dict[int, set[int]]:
    """The frames of shards whose marks are whole."""
    return {n: set(mark.frames) for n, mark in load_marks(path, sorted(shards)) if isinstance(mark, Mark)}
