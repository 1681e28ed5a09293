"""The page of all fields that a recipe may have, from its schema."""

from __future__ import annotations

import re
from typing import Any

from sonarsynth.description.schemas import kind_of, schema_of, shown
from sonarsynth.recipe import Recipe
from tools.page_building.tables import MADE, cell, table

INTRODUCTION = """# Fields of a recipe

Every field, with its kind, unit, limits and default. A class in the column *what* has its own section; of several
`kind:` chooses. Numbers are written with a unit (`25 kHz`, `90 deg`); units here are those of a bare number. The
same is `sonarsynth schema` (JSON), the file `configs/recipe.schema.json`, which editors read, and in Python
`help(ss.Thermocline)`.
"""


def recipe() -> str:
    """The page: the recipe first, then every description in the order of their names."""
    found = schema_of(Recipe)
    sections = [
        section(found, found["$defs"]),
        *(section(found["$defs"][name], found["$defs"]) for name in sorted(found["$defs"])),
    ]
    return f"{MADE}{INTRODUCTION}\n" + "\n\n".join(sections) + "\n"


def section(part: dict[str, Any], others: dict[str, Any]) -> str:
    """A description: what it is, its kind, a table of its fields."""
    fields = part.get("properties", {})
    kind = fields.get("kind", {}).get("const")
    title = f"## {part['title']}" + (f"\n\n`kind: {kind}`" if kind else "")
    text = escaped(part.get("description", ""))
    if "enum" in part:
        return f"{title}\n\n{text}\n\nOne of {', '.join(f'`{value}`' for value in part['enum'])}."
    rows = [row(name, field, part, others) for name, field in fields.items() if name != "kind"]
    return f"{title}\n\n{text}" + (f"\n\n{table(('field', 'what', 'default', ''), rows)}" if rows else "")


def row(name: str, field: dict[str, Any], part: dict[str, Any], others: dict[str, Any]) -> tuple[str, str, str, str]:
    """Name, kind with limits and unit, default and text of a field."""
    default = "needed" if name in part.get("required", ()) else shown(field.get("default"))
    kinds = re.sub(r"\b[A-Z]\w+\b", lambda word: linked(word[0], others), kind_of(field))
    return f"`{name}`", kinds, default, field.get("description", "")


def linked(word: str, others: dict[str, Any]) -> str:
    """A class as a link to its section."""
    return f"[{word}](#{word.lower()})" if word in others else word


def escaped(text: str) -> str:
    """Text of a docstring as Markdown: names in angle brackets are no tags, what is indented is a table of its own."""
    return "\n".join(line if line.startswith("    ") else cell(line) for line in text.splitlines())
