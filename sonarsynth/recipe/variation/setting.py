"""A scene with other values at some paths, checked as if it had been written so."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, get_args, get_type_hints

from pydantic import TypeAdapter, ValidationError

from sonarsynth.conventions import Unit
from sonarsynth.description import FieldError, named_files, unknown
from sonarsynth.description.field_messages import Where, wrong_fields
from sonarsynth.receiver import Sonar
from sonarsynth.recipe.scene import Scene, Trajectory, World
from sonarsynth.recipe.variation.values import Plain, put, where

_SCENE: TypeAdapter[Scene] = TypeAdapter(Scene)
_PARTS: dict[str, tuple[type, TypeAdapter[Any]]] = {
    name: (kind, TypeAdapter(kind)) for name, kind in (("world", World), ("trajectory", Trajectory), ("sonar", Sonar))
}


@dataclass(frozen=True)
class Setting:
    """A value for some paths, and where in the recipe it comes from."""

    source: Where
    name: str
    paths: tuple[str, ...]
    value: Plain

    @property
    def shown(self) -> str:
        """As errors say it."""
        return f"{self.name} = {self.value.shown}"


Stamps = tuple[tuple[int, int] | None, ...]
"""When files were changed, and their sizes."""


def mesh_files(value: Any) -> tuple[str, ...]:
    """Every file of a mesh or grid of heights in plain values, and every text that may be one."""
    if isinstance(value, str):
        return (value,) if Path(value).suffix else ()
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return tuple(dict.fromkeys(path for one in inner for path in mesh_files(one)))


def file_stamps(paths: Iterable[str]) -> Stamps:
    """As `named_files.stamp`, of each; None where there is no file."""
    return tuple(named_files.stamp(path) if os.path.isfile(path) else None for path in paths)


def plain_scene(scene: Scene) -> dict[str, Any]:
    """The scene as plain JSON values."""
    value: dict[str, Any] = _SCENE.dump_python(scene, mode="json")
    return value


def with_settings(scene: Scene, plain: dict[str, Any], settings: Sequence[Setting]) -> Scene:
    """The scene (`plain` is the same in JSON) with settings applied, those of shorter paths first.

    Raises FieldError that names the setting and the field.
    """
    data: Any = {"scene": plain}
    by_path = [(where(path), setting) for setting in settings for path in setting.paths]
    for path, setting in sorted(by_path, key=lambda item: len(item[0])):
        try:
            data = put(data, path, setting.value.value, unknown)
        except LookupError as error:
            at = setting.source[:-2] if "values" in setting.source else setting.source
            raise FieldError((*at, "path"), f"{'.'.join(map(str, path))}: {error.args[0]}") from None
    changed = {}
    for name in {str(path[1]) for path, _ in by_path}:
        try:
            changed[name] = _PARTS[name][1].validate_json(json.dumps(data["scene"][name]), strict=True)
        except ValidationError as error:
            raise _explained(error, name, data["scene"][name], by_path) from None
    return replace(scene, **changed)


def _explained(error: ValidationError, part: str, data: Any, by_path: Sequence[tuple[Where, Setting]]) -> FieldError:
    """The first error of the validation of a part of a scene, with the setting that is to blame: the one that sets most
    of its path."""
    keys, message = wrong_fields(error, _PARTS[part][0], data)[0]
    field = ("scene", part, *keys)

    def shared(item: tuple[Where, Setting]) -> int:
        return next((n for n, (a, b) in enumerate(zip(item[0], field, strict=False)) if a != b), len(item[0]))

    setting = max(by_path, key=lambda item: (shared(item) == len(item[0]), shared(item)))[1]
    return FieldError(setting.source, f"{'.'.join(map(str, field))}: {message} ({setting.shown})")


def value_at(scene: Scene, path: str) -> Any:
    """What a path leads to, in SI units."""
    value: Any = scene
    for key in where(path)[1:]:
        value = value[int(key)] if isinstance(value, tuple) else getattr(value, str(key))
    return value


def unit_at(root: Any, keys: Where) -> Unit | None:
    """The unit of the number that a path leads to, from a description on; None for one without, or no such field.
    Entries of a list go by number or by name."""
    value, hint = root, None
    for key in keys:
        if isinstance(value, tuple):
            value = next((item for i, item in enumerate(value) if key in (i, str(i), getattr(item, "name", ""))), None)
        else:
            hint = None if value is None else get_type_hints(type(value), include_extras=True).get(str(key))
            value = getattr(value, str(key), None)
    return _unit_in(hint)


def _unit_in(hint: Any) -> Unit | None:
    """The unit that an annotation names, or the first that a part of it does."""
    own = (annotation for annotation in getattr(hint, "__metadata__", ()) if isinstance(annotation, Unit))
    return next(own, None) or next((unit for unit in map(_unit_in, get_args(hint)) if unit is not None), None)
