"""JSON schemas of descriptions, with the text under each field; and what `help` says of one, made from these."""

from __future__ import annotations

import ast
import inspect
import textwrap
from contextvars import ContextVar
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from pydantic import TypeAdapter
from pydantic.json_schema import GenerateJsonSchema

_PLAIN: ContextVar[bool] = ContextVar("_PLAIN", default=False)
"""Whether a schema is being made, which takes the text of a class as it was written."""
_BOUNDS = {"minimum": "from {}", "exclusiveMinimum": "over {}", "maximum": "to {}", "exclusiveMaximum": "under {}"}
_NAMES = {
    "integer": "whole number",
    "boolean": "true or false",
    "string": "text",
    "null": "none",
    "object": "mapping",
}


class HelpText:
    """The `__doc__` of a description: what was written, and its fields as parameters (numpydoc), when asked for."""

    def __init__(self, written: str) -> None:
        self.written = inspect.cleandoc(written)
        self._made: str | None = None

    def __get__(self, instance: object, owner: type) -> str:
        if _PLAIN.get():
            return self.written
        if self._made is None:
            self._made = f"{self.written}\n\n{_parameters(owner)}".strip()
        return self._made


def schema_of(described: Any) -> dict[str, Any]:
    """JSON schema of a description, or a union of such: texts, kinds, and the unit of each number (`x-unit`)."""
    before = _PLAIN.set(True)
    try:
        schema = TypeAdapter(described).json_schema(schema_generator=_Schema)
    finally:
        _PLAIN.reset(before)
    _write_defaults(schema)
    return schema


def kind_of(field: dict[str, Any]) -> str:
    """What a field of a schema may be, in words: `number from 0 in m`, `Ricker | Gabor`, `list of (m, m, m)`."""
    if "$ref" in field:
        return str(field["$ref"].rpartition("/")[2])
    if "const" in field:
        return f"`{field['const']}`"
    if "enum" in field:
        return " | ".join(f"`{value}`" for value in field["enum"])
    several = field.get("oneOf") or field.get("allOf") or field.get("anyOf")
    if several:
        if "x-unit" in field:
            bounds = next((text for text in map(_limits, several) if text), "")
            return f"number{bounds} in {field['x-unit']}"
        kinds = dict.fromkeys(kind_of(option) for option in several)
        return " | ".join(kinds)
    if field.get("type") == "array":
        return _of_array(field)
    return _NAMES.get(field.get("type", ""), str(field.get("type", "any value"))) + _limits(field)


def _of_array(field: dict[str, Any]) -> str:
    if "prefixItems" in field:
        return f"({', '.join(item.get('x-unit') or kind_of(item) for item in field['prefixItems'])})"
    return f"list of {kind_of(field.get('items', {}))}"


def _limits(field: dict[str, Any]) -> str:
    """The bounds of a number in words; of two on one side the stricter."""
    words = []
    for at_least, beyond, best in (("minimum", "exclusiveMinimum", max), ("maximum", "exclusiveMaximum", min)):
        bounds = [name for name in (at_least, beyond) if name in field]
        if bounds:
            strictest = best(field[name] for name in bounds)
            name = next(name for name in reversed(bounds) if field[name] == strictest)
            words.append(f" {_BOUNDS[name].format(f'{strictest:g}')}")
    return "".join(words)


def _parameters(owner: type) -> str:
    """The fields of a description as the section Parameters of a docstring."""
    schema = schema_of(owner)
    own = schema.get("$defs", {}).get(schema["$ref"].rpartition("/")[2]) if "$ref" in schema else schema
    required, lines = own.get("required", []), ["Parameters", "----------"]
    for name, field in own["properties"].items():
        if name == "kind":
            continue
        has = "" if name in required else f", default {shown(field.get('default'))}"
        lines += [f"{name} : {kind_of(field)}{has}", textwrap.indent(field.get("description", ""), "    ")]
    return "\n".join(lines) if len(lines) > 2 else ""


def shown(default: Any) -> str:
    """A default as people read it, in short."""
    if default is None:
        return "none"
    if isinstance(default, dict):
        return str(default["kind"]) if "kind" in default else "its own defaults"
    if isinstance(default, list):
        return f"[{', '.join(map(shown, default))}]"
    return f"{default:g}" if isinstance(default, float) else str(default)


def _write_defaults(node: Any) -> str | None:
    """Give defaults that are angles their unit, as people write it. Returns the unit of a number, None for others."""
    if isinstance(node, list):
        return next((unit for unit in [_write_defaults(item) for item in node] if unit), None)
    if not isinstance(node, dict):
        return None
    inner = {name: _write_defaults(value) for name, value in node.items()}
    unit = node.get("x-unit") or inner.get("anyOf")
    value = node.get("default")
    if unit in ("rad", "rad/s") and isinstance(value, float) and value != 0:
        node["default"] = _in_degrees(value, unit)
    elif isinstance(value, list):
        units = [item.get("x-unit") for item in node.get("prefixItems", ())]
        of_angles = zip(value, units, strict=False)
        node["default"] = [_in_degrees(x, u) if x and u in ("rad", "rad/s") else x for x, u in of_angles] or value
    return unit


def _in_degrees(value: float, unit: str) -> str:
    """An angle, or a rate of one, as people write it."""
    return f"{round(float(np.rad2deg(value)), 10):.12g} {unit.replace('rad', 'deg')}"


class _Schema(GenerateJsonSchema):
    """Takes NumPy numbers as defaults, and what a field is from the text under it.

    Pydantic would read those texts from the source files whenever the package is imported, a tenth of that time.
    """

    def encode_default(self, dft: Any) -> Any:
        return super().encode_default(dft.item() if isinstance(dft, np.generic) else dft)

    def default_schema(self, schema: Any) -> dict[str, Any]:
        result, factory = super().default_schema(schema), schema.get("default_factory")
        if factory is None:
            return result
        return result | {"default": {"kind": factory.kind} if hasattr(factory, "kind") else {}}

    def dataclass_schema(self, schema: Any) -> dict[str, Any]:
        result = super().dataclass_schema(schema)
        for cls in schema["cls"].__mro__:
            for name, text in _field_texts(cls).items():
                if name in result["properties"]:
                    result["properties"][name].setdefault("description", text)
        return result


@lru_cache(maxsize=512)
def _field_texts(cls: type) -> dict[str, str]:
    """The text under each field that a class declares, by name; none of a class whose source is not at hand."""
    try:
        (declared,) = ast.parse(textwrap.dedent(inspect.getsource(cls))).body
    except (OSError, TypeError):
        return {}
    texts = {}
    for field, below in pairwise(getattr(declared, "body", [])):
        if isinstance(field, ast.AnnAssign) and isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
            texts[ast.unparse(field.target)] = inspect.cleandoc(str(below.value.value))
    return texts
