"""YAML and recipes: the same classes as in Python, with errors that name file, line and field.

A value is checked as strictly as JSON: a number is a number (or a text with a unit), a whole number has no point,
true is no 1. A bare number is in the SI unit that the schema names; of an angle it is refused, unless it is 0. Paths
inside a file are relative to it and stay in its folder; paths given by `--set` are relative to the working directory.
"""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from pydantic import TypeAdapter, ValidationError
from ruamel.yaml import YAML

from sonarsynth.description import FieldError
from sonarsynth.description.field_messages import Where
from sonarsynth.recipe import FILE_KINDS, Recipe, must_be_recipe
from sonarsynth.recipe.reading.json_schema import schema, schema_text
from sonarsynth.recipe.reading.messages import explain
from sonarsynth.recipe.reading.recipe_tables import with_tables
from sonarsynth.recipe.reading.yaml_source import SET, RecipeError, Source, override, read_file, read_text

__all__ = [
    "RecipeError",
    "Source",
    "dump",
    "load",
    "loads",
    "locating",
    "opened",
    "read",
    "recipe_of",
    "schema",
    "schema_text",
]

_ADAPTER: Final[TypeAdapter[Recipe]] = TypeAdapter(Recipe)


def load(path: Path | str, sets: str | Sequence[str] = ()) -> Recipe:
    """Read a recipe from a YAML file.

    Parameters
    ----------
    path: the file.
    sets: settings `path=value` that replace fields, such as `scene.trajectory.frames=8`, or one alone.

    Returns
    -------
    The checked recipe.

    Raises
    ------
    RecipeError, a line for each error that names file, line and field.
    """
    return recipe_of(read(path, sets))


def loads(text: str, name: str = "recipe", folder: Path | str = ".", *, resolved: bool = False) -> Recipe:
    """Read a recipe from a YAML text.

    Parameters
    ----------
    text: the recipe.
    name: stands for the file in messages.
    folder: paths of files in the recipe are relative to it.
    resolved: whether `dump` wrote the text, maybe before it gave angles their unit: bare ones are then in rad.

    Returns
    -------
    The checked recipe.

    Raises
    ------
    RecipeError, a line for each error that names text, line and field.
    """
    return recipe_of(read_text(text, name, Path(folder).absolute()), check_files=False, resolved=resolved)


def read(path: Path | str, sets: str | Sequence[str] = ()) -> Source:
    """A recipe file as plain values with their lines, and settings over it. Raises RecipeError."""
    source = read_file(path)
    for setting in [sets] if isinstance(sets, str) else sets:
        source = override(source, setting)
    return source


def recipe_of(source: Source, *, check_files: bool = True, resolved: bool = False) -> Recipe:
    """The recipe that a source describes, files resolved to absolute paths. Raises RecipeError."""
    source = source if resolved else with_tables(source)
    data = _resolved(source, source.data, (), check_files)
    try:
        return _ADAPTER.validate_json(json.dumps(data), strict=True, context={"resolved": resolved})
    except ValidationError as error:
        raise explain(error, Recipe, source) from None


@contextmanager
def locating(source: Source) -> Iterator[None]:
    """Turn a FieldError (from planning) into a RecipeError that names file, line and field."""
    try:
        yield
    except FieldError as error:
        raise source.error(error.path, error.message) from None
    except MemoryError:
        raise RecipeError(source.name, "", "", "needs more memory than there is") from None


@contextmanager
def opened(path: Path | str, sets: Sequence[str] = ()) -> Iterator[Recipe]:
    """A recipe of a file, and settings over it; a FieldError meanwhile names file, line and field, as `locating` has
    it. Raises RecipeError."""
    source = read(path, sets)
    with locating(source):
        yield recipe_of(source)


def dump(recipe: Recipe) -> str:
    """The YAML text of a recipe, every default written out.

    Parameters
    ----------
    recipe: what is written.

    Returns
    -------
    Text of which `loads` makes an equal recipe.

    Raises
    ------
    TypeError for what is no recipe.
    """
    must_be_recipe(recipe, "written")
    text = io.StringIO()
    yaml: Any = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None  # mappings and lists of plain values in one line, the rest as blocks
    yaml.sort_base_mapping_type_on_output = False
    yaml.width = 4096
    yaml.allow_unicode = True
    yaml.dump(recipe.as_json(), text)
    return text.getvalue()


def _resolved(source: Source, data: Any, keys: Where, check: bool) -> Any:
    """The data with the paths of files absolute; raises RecipeError where a file is not there."""
    if isinstance(data, list):
        return [_resolved(source, value, (*keys, i), check) for i, value in enumerate(data)]
    if not isinstance(data, dict):
        return data
    path = data.get("path")
    if isinstance(path, str) and _is_file(data, keys):
        field = (*keys, "path")
        folder = Path.cwd() if source.place(field) == SET else source.folder
        file = Path(path) if Path(path).is_absolute() else folder / path
        if check:
            _check_place(source, field, path)
            _check_file(source, field, path, folder)
        return data | {"path": path if Path(path).is_absolute() else str(file)}
    return {key: _resolved(source, value, (*keys, key), check) for key, value in data.items()}


def _is_file(data: dict[str, Any], keys: Where) -> bool:
    """Whether a description with a path is of a file, or may be where it need not say its kind: a path that is none
    is a field of the scene, and stands in the recipe's grid and variations."""
    return any(data.get("kind") == kind for kind in FILE_KINDS) or (
        "kind" not in data and ("scene" in keys or "values" in keys)
    )


def _check_file(source: Source, keys: Where, path: str, folder: Path) -> None:
    file = folder / path
    try:
        exists, is_file = file.exists(), file.is_file()
    except (OSError, ValueError):  # too long, or a NUL byte
        raise source.error(keys, "is not the path of a file") from None
    if not exists:
        raise source.error(keys, f"no such file: {path}" + ("" if Path(path).is_absolute() else f", in {folder}"))
    if not is_file:
        raise source.error(keys, f"is not a file: {path or file}")


def _check_place(source: Source, keys: Where, path: str) -> None:
    """What a recipe names lies in its folder: what comes from elsewhere with a recipe opens no other file of ours."""
    if source.place(keys) == SET:
        return
    if re.match(r"[A-Za-z][A-Za-z0-9+.-]+://|file:", path):
        raise source.error(keys, "is a URL: a recipe names files in its own folder")
    elsewhere = "a recipe names files in its own folder; `--set` may name any"
    if Path(path).is_absolute():
        raise source.error(keys, f"is an absolute path: {elsewhere}")
    if ".." in Path(path).parts:
        raise source.error(keys, f"leaves the folder of the recipe: {elsewhere}")
    try:
        inside = (source.folder / path).resolve().is_relative_to(source.folder.resolve())
    except (OSError, ValueError, RuntimeError):  # too long, a NUL byte, links in a circle
        raise source.error(keys, "is not the path of a file") from None
    if not inside:
        raise source.error(keys, f"is a link out of the folder of the recipe: {elsewhere}")
