"""Tables of mesh files for populations: `models: {table: hulls/models.csv}` stands for the models that it lists."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from pathlib import PurePosixPath
from typing import Any, Final

from sonarsynth.description import named_files
from sonarsynth.recipe.reading.yaml_source import SET, Source
from sonarsynth.recipe.variation.values import Where

MOST_BYTES: Final = 1_000_000
OF_SHAPE: Final = ("unit", "sides", "heading", "pitch", "roll", "edge", "smooth", "crease")
OF_MODEL: Final = ("category", "weight", "licence")
COLUMNS: Final = ("file", *OF_MODEL, "scale_low", "scale_high", *OF_SHAPE)
"""What a table may have: the mesh file, relative to the table, and fields of the model and of its shape."""


def with_models(source: Source) -> Source:
    """The source with the models that its tables list in place of the tables. Raises RecipeError."""
    keys: Where = ("scene", "world", "populations")
    populations = source.data
    for key in keys:
        populations = populations.get(key) if isinstance(populations, dict) else None
    if not isinstance(populations, list):
        return source
    expanded, scene = [], source.data["scene"]
    for number, population in enumerate(populations):
        models = population.get("models") if isinstance(population, dict) else None
        if isinstance(models, dict) and isinstance(models.get("table"), str):
            expanded.append(population | {"models": _listed(source, (*keys, number, "models"), models)})
        else:
            expanded.append(population)
    world = scene["world"] | {"populations": expanded}
    return replace(source, data=source.data | {"scene": scene | {"world": world}})


def _listed(source: Source, keys: Where, models: dict[str, Any]) -> list[dict[str, Any]]:
    """The models of a table."""
    name, at = models["table"], (*keys, "table")
    if len(models) > 1:
        raise source.error(keys, f"a table has no field beside it: {', '.join(k for k in models if k != 'table')}")
    if source.place(at) == SET:
        raise source.error(at, "a table is named in the recipe itself: paths in it are relative to that")
    rows = csv.DictReader(io.StringIO(_text(source, at, name)), skipinitialspace=True)
    columns = [column.strip() for column in rows.fieldnames or []]
    unknown = [column for column in columns if column not in COLUMNS]
    if unknown or "file" not in columns:
        problem = f"'{unknown[0]}' is no column" if unknown else "has no column 'file'"
        raise source.error(at, f"{name}: {problem}; known: {', '.join(COLUMNS)}")
    rows.fieldnames = columns
    listed = []
    for row in rows:
        if None in row or None in row.values():
            raise source.error(at, f"{name}: line {rows.line_num}: must have {len(columns)} values")
        listed.append(_model(PurePosixPath(name).parent, {column: str(v).strip() for column, v in row.items()}))
    if not listed:
        raise source.error(at, f"{name}: lists no model")
    return listed


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


def _model(folder: PurePosixPath, row: dict[str, str]) -> dict[str, Any]:
    """The model of a row, as a recipe would have it; empty values are left out."""
    values = {name: _value(text) for name, text in row.items() if text}
    shape = {name: values[name] for name in OF_SHAPE if name in values}
    model: dict[str, Any] = {name: values[name] for name in OF_MODEL if name in values}
    if "scale_low" in values or "scale_high" in values:
        low, high = values.get("scale_low", 1.0), values.get("scale_high", 1.0)
        model["scale"] = [low, high]
    return {"shape": {"kind": "mesh_file", "path": str(folder / row["file"]), **shape}, **model}


def _value(text: str) -> bool | float | str:
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    try:
        return float(text)
    except ValueError:
        return text
