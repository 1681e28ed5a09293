"""Old keys of recipes: read for one version, with a note of the new name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from sonarsynth.recipe.reading.yaml_source import Source, dotted
from sonarsynth.recipe.renamed_keys import RENAMED, new_path
from sonarsynth.recipe.variation.values import Where


def new_setting(text: str) -> tuple[str, tuple[str, ...]]:
    """A `path=value` of the command line in the words of today, and a note where it was in others."""
    path, equals, value = text.partition("=")
    renamed = _new_text(path.strip())
    if not equals or renamed == path.strip():
        return text, ()
    return f"{renamed}={value}", (_note(path.strip(), renamed),)


def _new_text(path: str) -> str:
    return dotted(new_path(tuple(path.split("."))))


def _note(old: str, new: str) -> str:
    return f"{old} is called {new} now"


def with_new_keys(source: Source) -> Source:
    """A recipe as read with the new names of old keys and values, and a note of each.

    Raises RecipeError where both names are there.
    """
    data, notes = source.data, list(source.notes)
    for old in RENAMED:
        holder = _at(data, old[:-1])
        if isinstance(holder, dict) and old[-1] in holder:
            data = _changed(data, old[:-1], partial(_renamed, source, old))
            notes.append(_note(dotted(old), dotted(new_path(old))))
            if old[-1] == "shrimp":
                data = _changed(data, new_path(old), _with_kinds)
            if old[-1] == "ranging":
                data = _changed(data, old[:-1], partial(_with_picking, notes))
    data = _changed(data, ("scene", "physics", "occlusion"), _sensors)
    for block in ("grid", "variations"):
        data = _changed(data, (block,), partial(_new_paths, notes))
    if data is source.data:
        return source
    places = {new_path(keys): line for keys, line in source.places.items()}
    return replace(source, data=data, places=places, notes=tuple(dict.fromkeys(notes)))


def _renamed(source: Source, old: Where, fields: dict[str, Any]) -> dict[str, Any]:
    new = RENAMED[old]
    if new in fields:
        raise source.error(old, f"'{old[-1]}' is the old name of '{new}', which is there too")
    return {new if key == old[-1] else key: value for key, value in fields.items()}


def _with_kinds(sources: Any) -> Any:
    """Sources of a recipe of before they had kinds: all were shrimp."""
    if not isinstance(sources, list):
        return sources
    return [{"kind": "snapping_shrimp"} | source if isinstance(source, dict) else source for source in sources]


def _with_picking(notes: list[str], processing: dict[str, Any]) -> dict[str, Any]:
    """Processing of before picking and placing were two choices, and beams were those of the image."""
    placing = processing["placing"]
    if not isinstance(placing, dict):
        return processing
    picking = {name: placing[name] for name in ("threshold", "locality") if name in placing}
    remaining = {name: value for name, value in placing.items() if name not in ("threshold", "locality", "focus")}
    if "focus" in placing:
        notes.append("scene.processing.ranging.focus is not used: echoes are picked from the beams of the beamformer")
    changed = processing | {"placing": remaining}
    if picking and "picking" not in processing:
        notes.append("scene.processing.ranging's threshold and locality are those of picking: {kind: beam_axis} now")
        changed["picking"] = {"kind": "beam_axis"} | picking
    return changed


def _sensors(value: Any) -> Any:
    return "sensors" if value == "hydrophones" else value


def _new_paths(notes: list[str], node: Any) -> Any:
    """Axes of a grid, or variations, with the paths of what they change."""
    if isinstance(node, list):
        return [_new_paths(notes, item) for item in node]
    if not isinstance(node, dict):
        return node
    changed = {}
    for key, value in node.items():
        if key != "path":
            changed[key] = _new_paths(notes, value)
            continue
        item = [value] if isinstance(value, str) else value
        if not isinstance(item, list) or not all(isinstance(path, str) for path in item):
            return node  # which is for the schema to refuse
        paths = [_new_text(path) for path in item]
        notes.extend(_note(a, b) for a, b in zip(item, paths, strict=True) if a != b)
        changed[key] = paths[0] if isinstance(value, str) else paths
    return changed


def _at(data: Any, keys: Where) -> Any:
    for key in keys:
        data = data.get(key) if isinstance(data, dict) else None
    return data


def _changed(data: Any, keys: Where, change: Callable[[Any], Any]) -> Any:
    """`data` with the value at a path changed; the same object where nothing is, or where there is no such path."""
    if not keys:
        new = change(data)
        return data if new == data else new
    if not isinstance(data, dict) or keys[0] not in data:
        return data
    inner = _changed(data[keys[0]], keys[1:], change)
    return data if inner is data[keys[0]] else data | {keys[0]: inner}
