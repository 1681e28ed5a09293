"""What is wrong with a field, as people read it: its path, and one clear line, of what pydantic reports."""

from __future__ import annotations

import difflib
import types
from collections.abc import Iterable
from dataclasses import is_dataclass
from typing import Annotated, Any, Final, Union, get_args, get_origin

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from sonarsynth.conventions import UNITS

NAME = r"^[A-Za-z][A-Za-z0-9_-]{0,63}$"
CATEGORY = r"^[A-Za-z][A-Za-z0-9_.+-]{0,63}$"
ALLOWED = {NAME: "letters, digits, hyphens and underscores", CATEGORY: "letters, digits and _.+-"}
"""Patterns of the names of targets and of their categories, and what these may be made of, in words."""

SYNONYMS: Final = {"file": "path", "filename": "path"}
"""What people write for a field, and its name, which is not spelt alike."""

Where = tuple[str | int, ...]
"""A path into a recipe, or a part of one: field names and indices from the top."""


def unknown(name: str, names: Iterable[str], noun: str = "field") -> str:
    """That there is no such name, and which one it may be."""
    meant = [word for word in names if word == SYNONYMS.get(name)]
    close = meant or difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    hint = f"did you mean '{close[0]}'?" if close else f"known: {', '.join(names)}"
    return f"'{name}' is not a {noun} here; {hint}"


def wrong_fields(error: ValidationError, root: Any, data: Any) -> list[tuple[Where, str]]:
    """Path and text of all that is wrong with a description, a misspelt field first; root, data: its class, or a union
    of such, and what its fields were to be."""
    texts: dict[Where, str] = {}
    explained = set[Where]()  # by what is wrong with one of their fields or entries
    for details in error.errors(include_url=False):
        keys, message = _message(details, _path(details, root, data), root, data)
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
    return items


def _path(details: ErrorDetails, root: Any, data: Any) -> Where:
    """The path of an error in the file: pydantic's, without the parts that name members of unions."""
    path: list[str | int] = []
    loc = details["loc"]
    if len(loc) == 1 and loc[0] in field_names(root):  # maybe one that was left out, and has a default that cannot be
        return loc
    for n, key in enumerate(loc):
        named = isinstance(data, dict) and key in data and data.get("kind") != key
        if named or (isinstance(data, list | tuple) and isinstance(key, int) and key < len(data)):
            data = data[key]
        elif not (details["type"] == "missing" and n == len(loc) - 1):
            continue
        path.append(key)
    return tuple(path)


def _message(details: ErrorDetails, keys: Where, root: Any, data: Any) -> tuple[Where, str]:
    """Path and text of an error."""
    context = details.get("ctx", {})
    if details["type"] == "union_tag_invalid":
        kinds = _kinds(_type_at(root, keys, data))
        return (*keys, "kind"), unknown(str(context["tag"]), kinds, "kind")
    if details["type"] == "union_tag_not_found":
        return keys, f"needs a kind: one of {', '.join(_kinds(_type_at(root, keys, data)))}"
    if details["type"] == "unexpected_keyword_argument":
        return keys, unknown(str(keys[-1]), field_names(_class_at(root, keys[:-1], data)))
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
        case "string_pattern_mismatch" if context["pattern"] in ALLOWED:
            return f"must be at most 64 {ALLOWED[context['pattern']]}, a letter first, not {value}"
        case "tuple_type" | "list_type":
            return f"must be a list, not {value}"
        case "too_long":
            return f"must have at most {context['max_length']} entries, not {context['actual_length']}"
        case "too_short":
            return f"must have at least {context['min_length']} entries, not {context['actual_length']}"
    text = details["msg"].replace("Input should be", "must be").replace("String should", "must")
    if details["type"].startswith(("less_than", "greater_than")) and (unit := _unit(details["input"])):
        limit = next(iter(context.values())) / next(sizes[unit] for sizes in UNITS.values() if unit in sizes)
        text = f"{text.rpartition(' ')[0]} {limit:.6g} {unit}"  # as it was written, not in SI
    return f"{text[0].lower()}{text[1:]}, not {value}"


def _unit(value: Any) -> str:
    """The unit that a text ends in; nothing of anything else."""
    last = value.split()[-1:] if isinstance(value, str) else []
    return next((unit for sizes in UNITS.values() for unit in sizes if [unit] == last), "")


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


def field_names(cls: Any) -> list[str]:
    """Names of the fields of a description; of anything else none."""
    return list(getattr(cls, "__pydantic_fields__", {}))


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


def members(kind: Any) -> list[Any]:
    """Members of a union (without None), or the type itself."""
    if get_origin(kind) is Annotated:
        return members(get_args(kind)[0])
    if get_origin(kind) in (Union, types.UnionType):
        return [m for member in get_args(kind) if member is not type(None) for m in members(member)]
    return [kind]


def _tag(kind: Any) -> str | None:
    field = getattr(kind, "__pydantic_fields__", {}).get("kind")
    return None if field is None else str(field.default)


def _kinds(kind: Any) -> list[str]:
    return [tag for tag in map(_tag, members(kind)) if tag is not None]


def _chosen(kind: Any, data: Any) -> Any:
    options = members(kind)
    if len(options) == 1:
        return options[0]
    if isinstance(data, list | tuple):
        return next((m for m in options if get_origin(m) is tuple), None)
    tag = data.get("kind") if isinstance(data, dict) else None
    tagged = [m for m in options if _tag(m) is not None]
    if isinstance(data, dict) and tag is None and len(tagged) == 1:  # the kind of the only one may be left out
        return tagged[0]
    fitting = [m for m in options if _tag(m) == tag and hasattr(m, "__pydantic_fields__")]
    names = set(data) if isinstance(data, dict) else set()
    return max(fitting, key=lambda m: len(names & set(field_names(m))), default=None)
