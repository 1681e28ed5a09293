"""What is wrong with a recipe: the field as it stands in the file, and one clear line."""

from __future__ import annotations

from typing import Final

from pydantic import ValidationError

from sonarsynth.description.field_messages import Where, wrong_fields
from sonarsynth.recipe.reading.yaml_source import SET, RecipeError, Source, dotted

MOST_SHOWN: Final = 20
"""Errors that are told of a recipe."""


def explain(error: ValidationError, root: type, source: Source) -> RecipeError:
    """The errors of a validation, each with its place in the file: of a misspelt field first, at most `MOST_SHOWN`."""
    items = wrong_fields(error, root, source.data)
    (keys, message), *others = items
    message = _with_full_path(keys, message, source)
    lines = [source.error(*other) for other in others[: MOST_SHOWN - 1]]
    if len(items) > MOST_SHOWN:
        lines.append(RecipeError(source.name, "", "", f"and {len(items) - MOST_SHOWN} more"))
    return source.error(keys, message + _of_another_kind(keys, source), lines)


def _with_full_path(keys: Where, message: str, source: Source) -> str:
    """The message of a field that no recipe has at its root, with where it stands in this one, as of `frames`."""
    places = [at for at in source.places if len(at) > 1 and at[-1] == keys[-1]] if len(keys) == 1 else []
    said, field, _ = message.partition(" is not a field here; ")
    return f"{said}{field}did you mean '{dotted(places[0])}'?" if field and len(places) == 1 else message


def _of_another_kind(keys: Where, source: Source) -> str:
    """What to do about a field of the kind that `--set` has replaced; "" where it has not."""
    kind = (*keys[:-1], "kind")
    if not keys or keys[-1] == "kind" or source.places.get(kind) != SET or source.places.get(keys, SET) == SET:
        return ""
    holder = source.data
    for key in keys[:-1]:
        holder = holder[key]
    return f"; to replace all fields: --set {dotted(keys[:-1])}='{{kind: {holder['kind']}}}'"
