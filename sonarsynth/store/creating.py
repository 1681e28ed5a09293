"""Laying a store out: all of it at once, in a folder beside the place, which is then moved there.

At a URL nothing is moved: all is sent, the mark of the layout first and the metadata of
the root last. What has the mark and neither metadata nor marks of shards was never finished, and is laid out anew.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from sonarsynth.description.code_version import code_digest
from sonarsynth.pipeline import attributes, coordinates
from sonarsynth.recipe.reading import RecipeError, dump
from sonarsynth.recipe.reading.yaml_source import read_text
from sonarsynth.store.array_metadata import documents, fixed_array, framed_array
from sonarsynth.store.encoding import encoded_whole
from sonarsynth.store.files.place import (
    Folder,
    absolute,
    record_of,
    records,
    upload,
    write_each,
)
from sonarsynth.store.files.remote import Remote
from sonarsynth.store.files.scratch import clear, hidden, made, sweep
from sonarsynth.store.files.within import Mismatch
from sonarsynth.store.layout import Layout, layout_of
from sonarsynth.store.marks import LAYOUT, MANIFESTS, Damage, Mark, encoded_mark, load_layout, marked, save_mark
from sonarsynth.store.opening import check_format, root_attributes
from sonarsynth.store.provenance import begun, made_of, other_versions

if TYPE_CHECKING:
    from sonarsynth.planning import Plan
    from sonarsynth.recipe.reading import Source


def create(
    path: Folder | str, plan: Plan, *, restart: bool = False, source: Source | None = None, mixed_versions: bool = False
) -> Layout:
    """Lay the store out, or make ready to go on with the one that is there. Returns its layout.

    Raises Mismatch where the store that is there belongs to another recipe, other products or another version, was
    begun with other versions of libraries that touch numbers (unless `mixed_versions`), or is no store of ours;
    `restart` begins anew instead (and never removes what is not a store of ours). Raises Damage
    where the store that is there is not as it was laid out. The text of the recipe is kept where its `source` is given.
    """
    path, layout = absolute(path), layout_of(plan)
    if isinstance(path, Remote):
        return _create_there(path, plan, layout, restart, source, mixed_versions)
    clear(hidden(path))
    if path.is_dir() and not any(path.iterdir()):
        path.rmdir()
    exists = path.exists()
    if exists:
        stored = _identity_of(path)
        if not restart:
            check_format(path, stored)
            sweep(path)
            _go_on(path, stored, plan, mixed_versions)
            return layout
    with made(path) as scratch:
        new = scratch / "new"
        new.mkdir()
        files = laid_out(plan, layout, {**described(plan), **begun(source)})
        write_each(new, files)
        save_mark(new, layout_mark(files))
        if exists:
            os.rename(path, scratch / "old")
        os.rename(new, path)
    return layout


def _go_on(path: Folder, stored: Mapping[str, Any], plan: Plan, mixed_versions: bool) -> None:
    """Raise Mismatch or Damage unless a plan's build may go on in the store that is there."""
    _compare(path, stored, identity(plan))
    _check_layout(path)
    odd = other_versions(stored)
    if odd and not mixed_versions:
        raise Mismatch(
            f"{path} was begun with other libraries ({spelled(odd)}), so the remaining frames would differ from "
            "the existing ones: use those libraries, or --mixed-versions to resume and mark the new frames"
        )


def _create_there(
    path: Remote, plan: Plan, layout: Layout, restart: bool, source: Source | None, mixed_versions: bool
) -> Layout:
    """The same at a URL."""
    if path.is_dir():
        unfinished = not (path / "zarr.json").is_file() and load_layout(path) is not None and not marked(path)
        if not unfinished:
            stored = _identity_of(path)
            if not restart:
                check_format(path, stored)
                _go_on(path, stored, plan, mixed_versions)
                return layout
        (path / "zarr.json").unlink(missing_ok=True)
        path.unlink_each(path.sizes())
    files = laid_out(plan, layout, {**described(plan), **begun(source)})
    mark = encoded_mark(layout_mark(files))
    upload(path, files | dict.fromkeys(MANIFESTS, mark), MANIFESTS, "zarr.json")
    return layout


def layout_mark(files: Mapping[str, bytes]) -> Mark:
    """The mark of a store that is laid out in these files: all of them, and its attributes."""
    records_of_files = {name: record_of(files[name]) for name in sorted(files)}
    return Mark(LAYOUT, (), "", records_of_files, json.loads(files["zarr.json"])["attributes"])


def _check_layout(path: Folder) -> None:
    """Raise Damage where metadata or fixed arrays are not as they were laid out."""
    mark = load_layout(path)
    if mark is None:
        raise Damage(f"{path}: {MANIFESTS[0]} is missing or damaged: 'sonarsynth repair' restores it")
    for name, actual in records(path, mark.files):
        if actual != mark.files[name]:
            raise Damage(
                f"{path}: {name} is missing or has changed since the store was laid out: "
                "'sonarsynth repair' restores it"
            )


def described(plan: Plan) -> dict[str, Any]:
    """Root attributes of a store of this plan, whoever builds it, wherever and whenever."""
    return {**attributes(plan), **identity(plan), **made_of(plan)}


def identity(plan: Plan) -> dict[str, Any]:
    """What a store is of: two plans with the same identity make the same numbers. Root attributes of the store."""
    return {
        "recipe_digest": plan.digest,
        "products": sorted(plan.products),
        "shard_frames": plan.shard_frames,
        "sonarsynth_version": _version(),
        "code_digest": code_digest(),
        "recipe": dump(plan.recipe),
    }


def _version() -> str:
    try:
        return version("sonarsynth")
    except PackageNotFoundError:
        return "unknown"


def _identity_of(path: Folder) -> dict[str, Any]:
    stored = root_attributes(path)
    if not path.is_dir() or "recipe_digest" not in stored:
        raise Mismatch(f"{path} exists and is not a store of sonarsynth: choose another path")
    return stored


def _compare(path: Folder, stored: Mapping[str, Any], wanted: Mapping[str, Any]) -> None:
    """Raise Mismatch with the first difference between what is there and what is to be built."""
    if all(stored.get(key) == value for key, value in wanted.items() if key != "recipe"):
        return
    old, new = _flat(plain_recipe(stored)), _flat(plain_recipe(wanted))
    differing = [key for key in [*new, *old] if old.get(key) != new.get(key)]
    if differing:
        key = differing[0]
        was, now = (_short(recipe.get(key, "absent")) for recipe in (old, new))
        manner, difference = "from a different recipe", f"{key}: {was}, now {now}"
    else:
        names = {
            "products": "products",
            "shard_frames": "frames in a shard",
            "sonarsynth_version": "version of sonarsynth",
            "code_digest": "digest of the code",
        }
        changed = next((key for key in names if stored.get(key) != wanted[key]), None)
        manner, difference = (
            "differently",
            (
                "the content of a file that the recipe names has changed"
                if changed is None
                else f"{names[changed]}: {_short(stored.get(changed))}, now {_short(wanted[changed])}"
            ),
        )
    raise Mismatch(f"{path} was built {manner} ({difference}): use --restart to overwrite it, or another path")


def spelled(odd: Mapping[str, tuple[str, str]]) -> str:
    """Versions that differ, in words."""
    return "; ".join(f"{name} {before}, now {now}" for name, (before, now) in odd.items())


def _short(value: Any) -> str:
    """A value as people compare it, in one line: a digest by its beginning."""
    text = str(value) if str(value).isprintable() else ascii(value)
    return text if len(text) < 64 else text[:12]


def plain_recipe(attrs: Mapping[str, Any]) -> Any:
    """The recipe that root attributes hold, as plain values; None where it cannot be read."""
    try:
        return read_text(str(attrs.get("recipe", "")), "", Path()).data
    except RecipeError:
        return None


def _flat(value: Any, path: str = "") -> dict[str, Any]:
    """Leaves of nested values by dotted path."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else None
    if items is None:
        return {path: value}
    return {k: v for key, inner in items for k, v in _flat(inner, f"{path}.{key}" if path else str(key)).items()}


def laid_out(plan: Plan, layout: Layout, attrs_of_root: Mapping[str, Any]) -> dict[str, bytes]:
    """Everything but frames, as files by their names: metadata and the arrays that no frame changes."""
    static = coordinates(plan)
    framed = {a.variable.group for a in layout.arrays}
    named = {PurePosixPath(group) for group in framed.union(group for group, _ in static)}
    groups: dict[str, dict[str, Any]] = {"": dict(attrs_of_root)}
    for group in sorted(path.as_posix() for inner in named for path in (inner, *inner.parents)):
        extra = sorted(name for g, name in static if g == group and static[g, name][0] != (name,))
        attrs = {"coordinates": " ".join(extra)} if extra and group in framed else {}
        groups.setdefault(group.strip("/"), {}).update(attrs)
    fixed = {f"{group}/{name}".strip("/"): content for (group, name), content in static.items()}
    arrays = {array.path: framed_array(array) for array in layout.arrays}
    arrays |= {name: fixed_array(*content) for name, content in fixed.items()}
    chunks = {
        f"{name}/{'.'.join(['c', *['0'] * values.ndim])}": encoded_whole(values)
        for name, (_, values, _) in fixed.items()
        if values.size
    }
    return documents(groups, arrays) | chunks
