"""The page of all variables that a store may have, from the schema that stores are laid out by."""

from __future__ import annotations

from itertools import groupby

from sonarsynth.conventions import FORMAT_VERSION
from sonarsynth.pipeline import VARIABLES
from sonarsynth.pipeline.variables import Variable
from tools.page_building.tables import MADE, table

INTRODUCTION = f"""# Stored variables

Every variable of format {FORMAT_VERSION}, with its axes, type and unit, as the store says them in its attributes.
What is not written reads as NaN, or -1 of whole numbers, where no other value is named. `of` is what the variable is
stored with: `truth` is always there, `levels` with any product that is traced. [The store](the-store.md) says what the
groups are for, [labels](labels.md) what the labels of a frame mean.
"""


def stored_variables() -> str:
    """The page, a section a group."""
    sections = []
    for group, rows in groupby(VARIABLES, key=lambda variable: variable.group):
        sections.append(f"## `{group}`\n\n" + table(("variable", "axes", "type", "unit", "of", ""), map(row, rows)))
    return f"{MADE}{INTRODUCTION}\n" + "\n\n".join(sections) + "\n"


def row(variable: Variable) -> tuple[str, str, str, str, str, str]:
    """Name, axes, type, unit, product and meaning of a variable."""
    attributes = dict(variable.attributes)
    words = attributes.get("flag_meanings", "")
    values = attributes.get("flag_values", ())
    text = variable.long_name
    if words:
        text += ": " + ", ".join(f"{value} {word}" for value, word in zip(values, words.split(), strict=True))
    text += f"; {attributes['comment']}" if "comment" in attributes else ""
    usual = variable.fill != variable.fill or variable.fill == -1
    text += "" if usual else f"; {variable.fill} where there is none"
    unit = "" if variable.units == "1" else variable.units
    return f"`{variable.name}`", ", ".join(variable.dims), variable.dtype, unit, variable.product, text
