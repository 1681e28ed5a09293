"""Validation errors as people read them: the field as it stands in the file, and one clear line."""

from __future__ import annotations

from typing import Final

from pydantic import ValidationError

from sonarsynth.recipe.field_messages import error_message, error_path
from sonarsynth.recipe.reading.yaml_source import SET, RecipeError, Source, dotted
from sonarsynth.recipe.variation.values import Where

MOST_SHOWN: Final = 20
"""Errors that are told of a recipe."""


def explain(error: ValidationError, root: type, source: Source) -> RecipeError:
    """The errors of a validation, each with its place in the file: of a misspelt field first, at most `MOST_SHOWN`."""
    texts: dict[Where, str] = {}
    explained = set[Where]()  # by what is wrong with one of their fields or entries
    for details in error.errors(include_url=False):
        keys, message = error_message(details, error_path(details, source.data), root, source.data)
        if details["type"] == "dataclass_type" and (texts.get(keys) or "").startswith("must be '"):
            texts[keys] = texts[keys].replace("' or '", "', '").replace(", not ", " or a mapping, not ", 1)
        if details["type"] == "literal_error" and (texts.get(keys) or "").startswith("must be a list, not "):
            texts[keys] = texts[keys].replace("a list, not ", f"a list or {details['ctx']['expected']}, not ", 1)
        number = details["type"].startswith(("less_than", "greater_than")) or message.startswith("has unit ")
        if number and (texts.get(keys) or "").startswith("must be '"):  # or a word
            said = texts[keys].rpartition(", not ")[0].replace("' or '", "', '")
            texts[keys] = message.replace("must be ", f"{said} or ", 1)
        texts.setdefault(keys, message)
        if details["type"] == "too_short":  # only entries that are right are counted
            explained.add(keys)
    meant = ("not a mapping", "not a list")
    words = {keys for keys, text in texts.items() if text.startswith("must be '") and text.endswith(meant)}
    for keys in explained | words:  # of a word, or a mapping or list, it is the latter that was meant
        if any(len(longer) > len(keys) and longer[: len(keys)] == keys for longer in texts):
            del texts[keys]
    items = list(texts.items())
    if items[0][1] == "is required":  # which a misspelt field explains
        items.sort(key=lambda item: "did you mean" not in item[1])
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
