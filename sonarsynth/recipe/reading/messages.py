"""Validation errors as people read them: the field as it stands in the file, and one clear line."""

from __future__ import annotations

import difflib
import types
from dataclasses import is_dataclass
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from sonarsynth.recipe.reading.yaml_source import SET, RecipeError, Source, dotted
from sonarsynth.recipe.variation.values import Where
from sonarsynth.targets.target import NAME


def explain(error: ValidationError, root: type, source: Source) -> RecipeError:
    """The first error of a validation, with its place in the file, and how many more there are."""
    texts: dict[Where, str] = {}
    for details in error.errors(include_url=False):
        keys = _where(details, source.data)
        keys, message = _message(details, keys, root, source.data)
        if details["type"] == "dataclass_type" and (texts.get(keys) or "").startswith("must be '"):
            texts[keys] = texts[keys].replace("' or '", "', '").replace(", not ", " or a mapping, not ", 1)
        texts.setdefault(keys, message)
    words = {keys for keys, text in texts.items() if text.startswith("must be '") and text.endswith("not a mapping")}
    for keys in words:  # of a word or a mapping, it is the mapping that was meant
        if any(len(longer) > len(keys) and longer[: len(keys)] == keys for longer in texts):
            del texts[keys]
    guessed = [item for item in texts.items() if "did you mean" in item[1]]  # a misspelt field explains a missing one
    keys, message = next(iter(texts.items()))
    if guessed and message == "is required":
        keys, message = guessed[0]
    more = f" (and {len(texts) - 1} more)" if len(texts) > 1 else ""
    return source.error(keys, message + _of_another_kind(keys, source) + more)


def _of_another_kind(keys: Where, source: Source) -> str:
    """What to do about a field of the kind that `--set` has replaced; "" where it has not."""
    kind = (*keys[:-1], "kind")
    if not keys or keys[-1] == "kind" or source.places.get(kind) != SET or source.places.get(keys, SET) == SET:
        return ""
    holder = source.data
    for key in keys[:-1]:
        holder = holder[key]
    return f"; to replace all fields: --set {dotted(keys[:-1])}='{{kind: {holder['kind']}}}'"


def _where(details: ErrorDetails, data: Any) -> Where:
    """The path of an error in the file: pydantic's, without the parts that name members of unions."""
    path: list[str | int] = []
    loc = details["loc"]
    for n, key in enumerate(loc):
        named = isinstance(data, dict) and key in data and data.get("kind") != key
        if named or (isinstance(data, list) and isinstance(key, int) and key < len(data)):
            data = data[key]
        elif not (details["type"] == "missing" and n == len(loc) - 1):
            continue
        path.append(key)
    return tuple(path)


def _message(details: ErrorDetails, keys: Where, root: type, data: Any) -> tuple[Where, str]:
    """Path and text of an error."""
    context = details.get("ctx", {})
    if details["type"] == "union_tag_invalid":
        kinds = _kinds(_type_at(root, keys, data))
        return (*keys, "kind"), _unknown(str(context["tag"]), kinds, "kind")
    if details["type"] == "union_tag_not_found":
        return keys, f"needs a kind: one of {', '.join(_kinds(_type_at(root, keys, data)))}"
    if details["type"] == "unexpected_keyword_argument":
        return keys, _unknown(str(keys[-1]), _fields(_class_at(root, keys[:-1], data)))
    return keys, _text(details)


def _text(details: ErrorDetails) -> str:
    """What is wrong with a value, whatever it is in."""
    context, value = details.get("ctx", {}), _shown(details["input"])
    match details["type"]:
        case "missing":
            return "is required"
        case "value_error":
            return str(context["error"])
        case "dataclass_type" | "dict_type" | "model_attributes_type":
            return f"must be a mapping of fields, not {value}"
        case "string_pattern_mismatch" if context["pattern"] == NAME:
            return f"must be letters, digits, hyphens and underscores, a letter first, not {value}"
        case "tuple_type" | "list_type":
            return f"must be a list, not {value}"
        case "too_long":
            return f"must have at most {context['max_length']} entries, not {context['actual_length']}"
        case "too_short":
            return f"must have at least {context['min_length']} entries, not {context['actual_length']}"
    text = details["msg"].replace("Input should be", "must be").replace("String should", "must")
    return f"{text[0].lower()}{text[1:]}, not {value}"


def _unknown(name: str, names: list[str], noun: str = "field") -> str:
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    hint = f"did you mean '{close[0]}'?" if close else f"known: {', '.join(names)}"
    return f"'{name}' is not a {noun} here; {hint}"


def _shown(value: Any) -> str:
    match value:
        case None:
            return "nothing"
        case bool():
            return str(value).lower()
        case dict():
            return "a mapping"
        case list() | tuple():
            return "a list"
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


def _fields(cls: type | None) -> list[str]:
    return [] if cls is None else list(getattr(cls, "__pydantic_fields__", {}))


def _class_at(root: Any, keys: Where, data: Any) -> type | None:
    """The description that a path leads to; None where it leads elsewhere."""
    kind = _type_at(root, keys, data)
    for key in keys:
        data = data[key]
    chosen = _chosen(kind, data)
    return chosen if isinstance(chosen, type) and is_dataclass(chosen) else None


def _type_at(kind: Any, keys: Where, data: Any) -> Any:
    """The annotation of what a path leads to, choosing members of unions by the `kind` in the data."""
    for key in keys:
        kind, data = _chosen(kind, data), data[key]
        if get_origin(kind) is tuple:
            members = get_args(kind)
            kind = members[0] if members[-1] is Ellipsis else members[min(int(key), len(members) - 1)]
        else:
            field = getattr(kind, "__pydantic_fields__", {}).get(key)
            kind = None if field is None else field.annotation
    return kind


def _members(kind: Any) -> list[Any]:
    """Members of a union (without None), or the type itself."""
    if get_origin(kind) is Annotated:
        return _members(get_args(kind)[0])
    if get_origin(kind) in (Union, types.UnionType):
        return [m for member in get_args(kind) if member is not type(None) for m in _members(member)]
    return [kind]


def _tag(kind: Any) -> str | None:
    field = getattr(kind, "__pydantic_fields__", {}).get("kind")
    return None if field is None else str(field.default)


def _kinds(kind: Any) -> list[str]:
    return [tag for tag in map(_tag, _members(kind)) if tag is not None]


def _chosen(kind: Any, data: Any) -> Any:
    members = _members(kind)
    if len(members) == 1:
        return members[0]
    if isinstance(data, list):
        return next((m for m in members if get_origin(m) is tuple), None)
    tag = data.get("kind") if isinstance(data, dict) else None
    tagged = [m for m in members if _tag(m) is not None]
    if isinstance(data, dict) and tag is None and len(tagged) == 1:  # the kind of the only one may be left out
        return tagged[0]
    fitting = [m for m in members if _tag(m) == tag and hasattr(m, "__pydantic_fields__")]
    names = set(data) if isinstance(data, dict) else set()
    return max(fitting, key=lambda m: len(names & set(_fields(m))), default=None)
