"""The JSON schema of recipes, for text editors: each number says its unit, and has an example that may be written."""

from __future__ import annotations

import json
from typing import Any

from sonarsynth.conventions import Unit
from sonarsynth.description.schemas import schema_of
from sonarsynth.recipe import Recipe

_EXAMPLES = {
    "m": ("1 m", "10 cm", "2 mm", "100 m"),
    "s": ("0.1 s", "1 s", "50 us", "1 min"),
    "Hz": ("40 kHz", "250 kHz", "100 Hz"),
    "rad": ("30 deg", "90 deg", "2 deg"),
    "rad/s": ("5 deg/s",),
    "m/s": ("1.5 m/s", "1500 m/s"),
    "Pa": ("100 Pa",),
    "dB": ("30 dB", "190 dB", "-30 dB"),
    "kg/m3": ("1025 kg/m3",),
    "degC": ("20 degC",),
    "psu": ("35 psu",),
}
"""Numbers as people write them, by unit; of a field the first that its bounds let pass."""


def schema() -> dict[str, Any]:
    """JSON schema of a recipe, for editors.

    Returns
    -------
    dict
        A schema of draft 2020-12: titles, descriptions, kinds, defaults, bounds, the unit of each number (`x-unit`, and
        in the text) and an example of it. The same is the file `recipe.schema.json` beside the shipped recipes.
    """
    recipe_schema = schema_of(Recipe)
    for owner in (recipe_schema, *recipe_schema["$defs"].values()):
        for field in owner.get("properties", {}).values():
            _exemplify(field)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **recipe_schema}


def schema_text() -> str:
    """The schema as the text of a file: a line for each description, so that a change of one changes one line."""
    whole_schema = schema()
    definitions = whole_schema.pop("$defs")
    lines = [f"{json.dumps(name)}:{_packed(value)}" for name, value in definitions.items()]
    return _packed(whole_schema)[:-1] + ',"$defs":{\n' + ",\n".join(lines) + "\n}}\n"


def _packed(value: Any) -> str:
    return json.dumps(_with_whole_numbers(value), separators=(",", ":"), ensure_ascii=False)


def _with_whole_numbers(node: Any) -> Any:
    """Whole numbers without a point: of equal bounds, 1000 and 1000.0, `Annotated` gives the one that came first."""
    if isinstance(node, dict):
        return {key: _with_whole_numbers(value) for key, value in node.items()}
    if isinstance(node, (list, tuple)):
        return [_with_whole_numbers(value) for value in node]
    return int(node) if isinstance(node, float) and node.is_integer() else node


def _exemplify(field: dict[str, Any]) -> None:
    """Give a field its unit in words, and an example."""
    number = next((item for item in (field, *field.get("anyOf", ())) if "x-unit" in item), field)
    items = field.get("prefixItems", [number | {"default": field.get("default")}])
    examples = [_example(item) for item in items]
    if None in examples:
        return
    example: Any = examples if "prefixItems" in field else examples[0]
    units = ", ".join(item["x-unit"].replace("rad", "deg") for item in items)
    shown = f"[{', '.join(map(str, examples))}]" if "prefixItems" in field else example
    field["description"] = f"{field.get('description', '')} ({units}, such as {shown})".strip()
    field["examples"] = [example]


def _example(field: dict[str, Any]) -> str | None:
    """A number with its unit that a field takes: its default, or else one of those above. None without a unit."""
    if "x-unit" not in field:
        return None
    unit, default = Unit(field["x-unit"]), field.get("default")
    if isinstance(default, str):
        return default
    if isinstance(default, (int, float)) and default != 0:
        return f"{default:g} {unit.symbol}"
    fitting = (text for text in _EXAMPLES[unit.symbol] if _takes(field, unit.parse(text)))
    return next(fitting, f"0 {unit.symbol}")


def _takes(field: dict[str, Any], number: float) -> bool:
    """Whether a number is within the bounds of a field."""
    (bounds, *_) = (alternative for alternative in (*field.get("anyOf", ()), {}) if alternative.get("type") != "string")
    return bool(
        bounds.get("minimum", number) <= number <= bounds.get("maximum", number)
        and number > bounds.get("exclusiveMinimum", float("-inf"))
        and number < bounds.get("exclusiveMaximum", float("inf"))
    )
