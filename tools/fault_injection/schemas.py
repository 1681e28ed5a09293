"""Values from the schema of recipes: every field and kind that there is, within its stated bounds or at their ends."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from sonarsynth.recipe import reading

Schema = dict[str, Any]
MOST_DEPTH = 6
WORDS = ("x", "auto", "a word", "rock", "2024-02-30", "é")
EXPONENTS = (-300, -30, -12, -6, -3, -1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 9, 12, 15, 30, 300)


@lru_cache(maxsize=1)
def whole() -> Schema:
    """The schema of a recipe."""
    return reading.schema()


def resolved(schema: Schema) -> Schema:
    """What a reference leads to."""
    while "$ref" in schema:
        schema = whole()["$defs"][schema["$ref"].rpartition("/")[2]]
    return schema


def one_of(schema: Schema, random: np.random.Generator, value: Any = None) -> Schema:
    """One member of a union: that of the kind of a value, if it has one, else any."""
    schema = resolved(schema)
    members = schema.get("oneOf") or schema.get("anyOf")
    if not members:
        return schema
    if isinstance(value, dict):
        fitting = [m for m in map(resolved, members) if _kind(m) == value.get("kind") and "properties" in m]
        members = fitting or [m for m in map(resolved, members) if "properties" in m or "oneOf" in m] or members
    return one_of(members[int(random.integers(len(members)))], random, value)


def _kind(schema: Schema) -> Any:
    return schema.get("properties", {}).get("kind", {}).get("const")


def drawn(schema: Schema, random: np.random.Generator, depth: int = 0) -> Any:
    """A value that the schema allows, or one at or just beyond its bounds."""
    schema = one_of(schema, random)
    if some := schema.get("enum", [schema["const"]] if "const" in schema else None):
        return some[int(random.integers(len(some)))]
    match schema.get("type"):
        case "object":
            return _object(schema, random, depth)
        case "array":
            parts = schema.get("prefixItems")
            if parts is None:
                least = schema.get("minItems", 0)
                parts = [schema.get("items", {})] * int(random.integers(least, least + 3))
            return [drawn(part, random, depth + 1) for part in parts]
        case "number" | "integer":
            return _number(schema, random)
        case "boolean":
            return bool(random.integers(2))
        case "string" if str(schema.get("pattern", "")).endswith(")$") and "with a unit" in str(schema):
            units = schema["pattern"].rpartition("(")[2].removesuffix(")$").split("|")
            return f"{_number({}, random)!r} {units[int(random.integers(len(units)))]}"
    return None if schema.get("type") == "null" else WORDS[int(random.integers(len(WORDS)))]


def _object(schema: Schema, random: np.random.Generator, depth: int) -> dict[str, Any]:
    """Fields that are required, and some of the others."""
    required, share = schema.get("required", []), 0.3 if depth < MOST_DEPTH else 0.0
    return {
        name: drawn(part, random, depth + 1)
        for name, part in schema.get("properties", {}).items()
        if name in required or name == "kind" or random.random() < share
    }


def _number(schema: Schema, random: np.random.Generator) -> float | int:
    """A number of any size, in its bounds where these are given; now and then a bound itself."""
    low, high = (
        schema.get(a, schema.get(b)) for a, b in (("minimum", "exclusiveMinimum"), ("maximum", "exclusiveMaximum"))
    )
    ends = [end for end in (low, high) if end is not None]
    if ends and random.random() < 0.2:
        return ends[int(random.integers(len(ends)))]
    exponent = EXPONENTS[int(random.integers(len(EXPONENTS)))]
    value = float(random.uniform(1, 10)) * 10.0**exponent * (-1.0 if low is None and random.random() < 0.3 else 1.0)
    if len(ends) == 2 and random.random() < 0.7:
        value = float(random.uniform(low, high))
    elif ends and random.random() < 0.7:
        value = max(value, low) if low is not None else min(value, high)
    return int(min(max(value, -1e18), 1e18)) if schema.get("type") == "integer" else value


def spots(data: Any, schema: Schema, random: np.random.Generator) -> list[tuple[Any, Any, Schema]]:
    """Every field of a recipe, written or left out: what holds it, its key, its schema."""
    schema = one_of(schema, random, data)
    found = []
    if isinstance(data, dict):
        for name, part in schema.get("properties", {}).items():
            found.append((data, name, part))
            if name in data:
                found += spots(data[name], part, random)
    elif isinstance(data, list):
        parts = schema.get("prefixItems") or [schema.get("items", {})] * len(data)
        for n, (value, part) in enumerate(zip(data, parts, strict=False)):
            found.append((data, n, part))
            found += spots(value, part, random)
    return found
