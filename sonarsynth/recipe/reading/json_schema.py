"""The JSON schema of recipes, for text editors."""

from __future__ import annotations

from typing import Any

from sonarsynth.description.schemas import schema_of
from sonarsynth.recipe import Recipe


def schema() -> dict[str, Any]:
    """JSON schema of a recipe, for editors: titles, descriptions, kinds, and the unit of each number (`x-unit`)."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema_of(Recipe)}
