"""Putting back what no frame changes: metadata, fixed arrays and their mark; and moving out what is not ours."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from sonarsynth.pipeline import attributes
from sonarsynth.store.checking.examining import Findings
from sonarsynth.store.creating import described, identity, laid_out, layout_mark
from sonarsynth.store.files.place import Folder, opens, record, there, write_in
from sonarsynth.store.files.remote import Remote
from sonarsynth.store.files.within import Mismatch, parts_of, status
from sonarsynth.store.layout import ArrayLayout, layout_of
from sonarsynth.store.marks import Mark, save_mark
from sonarsynth.store.opening import root_attributes

if TYPE_CHECKING:
    import zarr

    from sonarsynth.planning import Plan


def restore(path: Folder, findings: Findings, plan: Plan | None) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Put back laid-out files and the mark of the layout. Returns their names, and where what was in the way is now.

    A plan is needed unless only a copy of the mark is damaged. Files are laid out again, and put in
    only where they are what they were, to the byte: raises Mismatch, with nothing changed, where they are not (other
    versions of libraries).
    """
    if plan is None or (findings.layout is not None and not findings.fixed):
        if findings.layout is None:
            raise ValueError("a plan is needed to restore what was laid out")
        moved = move_out(path, obstacles(path, findings.manifests))
        if findings.manifests:
            save_mark(path, findings.layout)
        return tuple(sorted(findings.manifests)), moved
    attrs = findings.attributes or {
        **described(plan),
        **root_attributes(path),  # how it was begun, and as what was planned then
        **attributes(plan),
        **identity(plan),
    }
    files = laid_out(plan, layout_of(plan), attrs)
    laid = layout_mark(files)
    bad = _to_put_back(path, findings, laid)
    moved = move_out(path, obstacles(path, [*bad, *findings.manifests]))
    for name in bad:
        write_in(path, name, files[name])
    if findings.manifests:
        save_mark(path, findings.layout or laid)
    return (*bad, *sorted(findings.manifests)), moved


def _to_put_back(path: Folder, findings: Findings, laid: Mark) -> list[str]:
    """Names of laid-out files that are not as they were."""
    if findings.layout is None:
        return sorted(name for name, now in laid.files.items() if not _is(path, name, now))
    for name in sorted(findings.fixed):
        if laid.files.get(name) != findings.layout.files[name]:
            raise Mismatch(f"{path}: {name} cannot be made again as it was: other versions of libraries wrote it")
    return sorted(findings.fixed)


def _is(path: Folder, name: str, expected: tuple[int, str]) -> bool:
    try:
        return record(path, name, size=expected[0]) == expected
    except OSError:
        return False


def frames_written(path: Folder, plan: Plan, shard: int) -> tuple[int, ...]:
    """The frames of a shard whose mark is lost, from what its data says; () where there is no sign of any.

    A frame that is there always has its step, time and place of the sonar. Where these are there and none can be read,
    all frames of the shard.
    """
    import zarr

    layout = layout_of(plan)
    if shard >= layout.shards:
        return ()
    always = [a for a in layout.arrays if not a.empty and (a.variable.group == "/" or a.path == "truth/sonar_position")]
    region = layout.region(shard)
    try:
        root = zarr.open_group(opens(path), mode="r")
    except Exception:  # whatever zarr raises on metadata that somebody forged
        return tuple(region)
    present = [a for a in always if there(path, a.file(shard))]
    written = np.zeros(len(region), bool)
    for array in present:
        written |= _rows(root, array, region)
    if present and not written.any():
        return tuple(region)
    return tuple(region.start + int(i) for i in np.flatnonzero(written))


def _rows(root: zarr.Group, array: ArrayLayout, region: range) -> np.ndarray:
    """Frames of a region in which an array has numbers; none where it cannot be decoded."""
    try:
        block = np.asarray(cast("zarr.Array[Any]", root[array.path])[region.start : region.stop]).reshape(
            len(region), -1
        )
    except Exception:  # whatever a codec raises on what it cannot decode
        return np.zeros(len(region), bool)
    return np.array([not array.is_fill(row) for row in block])


def move_out(path: Folder, names: Iterable[str]) -> tuple[str, ...]:
    """Move files that do not belong in a store to `<store>.foreign` beside it. Returns where they are now."""
    if isinstance(path, Remote):
        return _move_out_there(path, names)
    moved = []
    outside = path.with_name(f"{path.name}.foreign")
    for name in sorted(names):
        if status(path, name) is None:
            continue
        target = outside / name
        for parent in reversed(target.relative_to(outside).parents):
            _make_folder(outside / parent)
        target = _free(target)
        os.rename(path / name, target)
        moved.append(str(target))
    return tuple(moved)


def _move_out_there(path: Remote, names: Iterable[str]) -> tuple[str, ...]:
    """The same at a URL."""
    moved = []
    for name in sorted(names):
        try:
            content = (path / name).read_bytes()
        except FileNotFoundError:
            continue
        target, count = path.with_name(f"{path.name}.foreign") / name, 0
        while not target.write_if_absent(content):
            count += 1
            target = target.with_name(f"{name.rpartition('/')[2]}.{count}")
        (path / name).unlink()
        moved.append(str(target))
    return tuple(moved)


def _make_folder(folder: Path) -> None:
    """Make a folder; what has its name and is none goes out of the way, a link too."""
    if os.path.lexists(folder) and (folder.is_symlink() or not folder.is_dir()):
        folder.rename(_free(folder.with_name(f"{folder.name}.file")))
    folder.mkdir(exist_ok=True)


def _free(file: Path) -> Path:
    """A name that nothing has."""
    count, unused = 0, file
    while os.path.lexists(unused):
        count += 1
        unused = file.with_name(f"{file.name}.{count}")
    return unused


def obstacles(path: Folder, names: Iterable[str]) -> set[str]:
    """What lies where files are to be written and cannot be written over: folders, links and pipes in the place of the
    file, files and links in the place of a folder."""
    blocked: set[str] = set()
    if isinstance(path, Remote):
        return blocked  # an object is in nobody's way
    for name in names:
        folders = parts_of(name)
        for count in range(1, len(folders) + 1):
            inner = "/".join(folders[:count])
            mode = status(path, inner)
            if mode is None:
                break
            if not (stat.S_ISREG if count == len(folders) else stat.S_ISDIR)(mode.st_mode):
                blocked.add(inner)
                break
    return blocked


def drop_empty_folders(path: Folder) -> None:
    """Remove folders without files, which moved files leave."""
    if isinstance(path, Remote):
        return
    for folder, _, _ in os.walk(path, topdown=False):
        if not os.listdir(folder):
            os.rmdir(folder)
