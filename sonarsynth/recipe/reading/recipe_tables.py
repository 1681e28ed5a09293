"""Tables that stand for lists of a recipe: `models: {table: hulls/models.csv}`, `positions: {table: array.csv}`."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import PurePosixPath
from typing import Any, Final

from sonarsynth.description import named_files
from sonarsynth.description.field_messages import Where
from sonarsynth.recipe.reading.yaml_source import SET, Source

MOST_BYTES: Final = 1 << 23
OF_SHAPE: Final = ("unit", "sides", "heading", "pitch", "roll", "edge", "smooth", "crease")
OF_MODEL: Final = ("category", "weight", "licence")
OF_MODELS: Final = ("file", *OF_MODEL, "scale_low", "scale_high", *OF_SHAPE)
"""What a table of models may have: the mesh file, relative to the table, and fields of the model and of its shape."""
AXES: Final = ("x", "y", "z")

Row = dict[str, str]  # texts by column
Listed = Callable[[str, Row], Any]
"""What a recipe would have for a row of a table (its name, the row). Raises ValueError."""


def with_tables(source: Source) -> Source:
    """The source with what its tables list in place of the tables. Raises RecipeError."""
    world, data = ("scene", "world"), source.data
    for keys in _entries(data, (*world, "populations")):
        data = _listed(source, data, (*keys, "models"), _model, OF_MODELS, ("file",))
    for keys in _entries(data, (*world, "scatterers")):
        data = _listed(source, data, (*keys, "positions"), _position, AXES[:2], AXES[:2])
    data = _listed(source, data, ("scene", "sonar", "array", "positions"), _position, AXES, AXES)
    return replace(source, data=data)


def _at(data: Any, keys: Where) -> Any:
    """What stands at keys; None where nothing does."""
    for key in keys:
        try:
            data = data[key]
        except (KeyError, IndexError, TypeError):
            return None
    return data


def _entries(data: Any, keys: Where) -> Iterator[Where]:
    """Keys of each entry of a list."""
    entries = _at(data, keys)
    return ((*keys, n) for n in range(len(entries) if isinstance(entries, list) else 0))


def _with(data: Any, keys: Where, value: Any) -> Any:
    """A copy of the data with another value at keys."""
    if not keys:
        return value
    changed = data.copy()
    changed[keys[0]] = _with(data[keys[0]], keys[1:], value)
    return changed


def _listed(
    source: Source, data: Any, keys: Where, of_row: Listed, known: tuple[str, ...], needed: tuple[str, ...]
) -> Any:
    """The data with the rows of a table in its place; as it is, where there is none at keys."""
    table = _at(data, keys)
    if not (isinstance(table, dict) and isinstance(table.get("table"), str)):
        return data
    name, at = table["table"], (*keys, "table")
    if len(table) > 1:
        raise source.error(keys, f"a table has no field beside it: {', '.join(k for k in table if k != 'table')}")
    if source.place(at) == SET:
        raise source.error(at, "a table is named in the recipe itself: paths in it are relative to that")
    rows = csv.DictReader(io.StringIO(_text(source, at, name)), skipinitialspace=True)
    columns, units = _columns(rows.fieldnames or [])
    problems = [f"'{column[:40]}' is no column" for column in columns if column not in known]
    problems += [f"has no column '{column}'" for column in needed if column not in columns]
    problems += [f"has column '{column}' twice" for column in known if columns.count(column) > 1]
    if problems:
        raise source.error(at, f"{name}: {problems[0]}; known: {', '.join(known)}")
    rows.fieldnames = columns
    listed = []
    for row in rows:
        where = f"{name}, line {rows.line_num}"
        if None in row or None in row.values():
            raise source.error(at, f"{where}: must have {len(columns)} values")
        cells = [str(row[column]).strip() for column in columns]
        texts = {
            c: f"{cell} {unit}".strip() if cell else "" for c, cell, unit in zip(columns, cells, units, strict=True)
        }
        try:
            listed.append(of_row(name, texts))
        except ValueError as error:
            raise source.error(at, f"{where}: {error}") from None
    if not listed:
        raise source.error(at, f"{name}: has no rows under its column names")
    return _with(data, keys, listed)


def _columns(names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Names of columns, and the units in brackets after them: `x [mm]`, `x (mm)`."""
    split = [re.fullmatch(r"\s*(.*?)\s*(?:[\[(]\s*(.*?)\s*[\])])?\s*", name) for name in names]
    return [match[1] if match else "" for match in split], [match[2] or "" if match else "" for match in split]


def _text(source: Source, at: Where, name: str) -> str:
    """The text of a table in the folder of the recipe."""
    outside = "leaves the folder of the recipe: a recipe names files in its own folder"
    if PurePosixPath(name).is_absolute():
        raise source.error(at, outside)
    try:
        file = (source.folder / name).resolve()
        if not file.is_relative_to(source.folder.resolve()):
            raise source.error(at, outside)
        return named_files.read(file, MOST_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise source.error(at, f"{name}: is not UTF-8 text") from None
    except (named_files.FileError, OSError, RuntimeError) as error:
        raise source.error(at, f"{name}: {error}, in {source.folder}") from None


def _model(table: str, row: Row) -> dict[str, Any]:
    """The model of a row; empty values are left out."""
    values = {name: _value(text) for name, text in row.items() if text}
    shape = {name: values[name] for name in OF_SHAPE if name in values}
    model: dict[str, Any] = {name: values[name] for name in OF_MODEL if name in values}
    if "scale_low" in values or "scale_high" in values:
        low, high = values.get("scale_low", 1.0), values.get("scale_high", 1.0)
        model["scale"] = [low, high]
    return {"shape": {"kind": "mesh_file", "path": str(PurePosixPath(table).parent / row["file"]), **shape}, **model}


def _position(_: str, row: Row) -> list[Any]:
    """The place of a row: numbers in m, or texts with the unit of their columns."""
    for axis, text in row.items():
        number = _value(text.split(" ")[0])
        if not (isinstance(number, float) and isfinite(number)):
            raise ValueError(f"{axis}: '{text[:40]}' is not a number")
    return [_value(row[axis]) for axis in AXES if axis in row]


def _value(text: str) -> bool | float | str:
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    try:
        return float(text)
    except ValueError:
        return text
