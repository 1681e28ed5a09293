"""Makes the pages: those that are generated from the code, and the site of all."""

from __future__ import annotations

from pathlib import Path

from tools.page_building.command_reference import commands
from tools.page_building.python_reference import names
from tools.page_building.recipe_reference import recipe
from tools.page_building.variable_reference import stored_variables

ROOT = Path(__file__).resolve().parents[2]
REFERENCE = ROOT / "tools" / "docs" / "reference"


def generated() -> dict[Path, str]:
    """The files that are made from the code, with their text."""
    from sonarsynth.recipe.reading import schema_text

    return {
        ROOT / "configs" / "recipe.schema.json": schema_text(),
        REFERENCE / "recipe-fields.md": recipe(),
        REFERENCE / "stored-variables.md": stored_variables(),
        REFERENCE / "command-line.md": commands(),
        REFERENCE / "python.md": names(),
    }
