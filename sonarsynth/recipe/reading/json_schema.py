"""The JSON schema of recipes, for text editors."""

from __future__ import annotations

import ast
import inspect
import textwrap
from itertools import pairwise
from typing import Any

import numpy as np
from pydantic import TypeAdapter
from pydantic.json_schema import GenerateJsonSchema

from sonarsynth.recipe import Recipe


def schema() -> dict[str, Any]:
    """JSON schema of a recipe, for editors: titles, descriptions, kinds, and the unit of each number (`x-unit`)."""
    found = TypeAdapter(Recipe).json_schema(schema_generator=_Schema)
    _write_defaults(found)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **found}


def _write_defaults(part: Any) -> str | None:
    """Give defaults that are angles their unit, as people write it. Returns the unit of a number, None for others."""
    if isinstance(part, list):
        return next((unit for unit in [_write_defaults(one) for one in part] if unit), None)
    if not isinstance(part, dict):
        return None
    inner = {name: _write_defaults(value) for name, value in part.items()}
    unit = part.get("x-unit") or inner.get("anyOf")
    value = part.get("default")
    if unit in ("rad", "rad/s") and isinstance(value, float) and value != 0:
        part["default"] = f"{round(float(np.rad2deg(value)), 10):.12g} {unit.replace('rad', 'deg')}"
    return unit


class _Schema(GenerateJsonSchema):
    """Takes NumPy numbers as defaults, and what a field is from the text under it.

    Pydantic would read those texts from the source files whenever the package is imported, a tenth of that time.
    """

    def encode_default(self, dft: Any) -> Any:
        return super().encode_default(dft.item() if isinstance(dft, np.generic) else dft)

    def dataclass_schema(self, schema: Any) -> dict[str, Any]:
        found = super().dataclass_schema(schema)
        for cls in schema["cls"].__mro__:
            for name, text in _field_texts(cls).items():
                if name in found["properties"]:
                    found["properties"][name].setdefault("description", text)
        return found


def _field_texts(cls: type) -> dict[str, str]:
    """The text under each field that a class declares, by name; none of a class whose source is not at hand."""
    try:
        (declared,) = ast.parse(textwrap.dedent(inspect.getsource(cls))).body
    except (OSError, TypeError):
        return {}
    found = {}
    for field, below in pairwise(getattr(declared, "body", [])):
        if isinstance(field, ast.AnnAssign) and isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
            found[ast.unparse(field.target)] = inspect.cleandoc(str(below.value.value))
    return found
