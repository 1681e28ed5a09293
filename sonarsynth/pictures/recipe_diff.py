"""What differs between the recipes of stores, in few words: "kirchhoff, roughness 2 mm" beside "mirror lobe"."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sonarsynth.conventions import UNITS
from sonarsynth.recipe.reading import RecipeError, loads
from sonarsynth.recipe.reading.yaml_source import read_text
from sonarsynth.recipe.variation.setting import unit_at

PREFERRED = {"m": ("m", "mm", "um"), "s": ("s", "ms", "us"), "Hz": ("kHz", "Hz"), "rad": ("deg",), "rad/s": ("deg/s",)}
"""Units that people read, largest first, of SI units."""

WORDLESS = ("title", "licence")
"""Fields of a recipe that make no number of a store differ."""

GROUPS = ("scene", "world", "physics", "processing")
"""Parts of a recipe that say nothing about their fields."""

MOST = 4
"""Differences that are said of each store."""

LONGEST = 40
"""Characters of a value that are said."""


@dataclass(frozen=True)
class Difference:
    """A field whose values differ, and what is said of each store that has it."""

    path: tuple[str, ...]
    is_kind: bool  # the values name methods, which need no name of a field
    said: Mapping[int, str]  # by store


def names_of(recipes: Sequence[str], otherwise: Sequence[str]) -> list[str]:
    """A name for each store: the values of the fewest fields that tell its recipe from those of the others.

    recipes: the YAML of each, as stored. A field is said of the stores that have it: a roughness, where two of three
    scatter by a law that knows one. `otherwise`: names that are different anyhow; they stand for stores whose recipes
    do not differ, and behind names that two stores share.
    """
    plain = [_plain(text) for text in recipes]
    differences = _differences(dict(enumerate(plain)), (), [_loaded(text) for text in recipes])
    told = [d for d in differences if d.path[0] not in WORDLESS] or [d for d in differences if d.path[0] == "title"]
    descriptions = [_said(told, store) for store in range(len(recipes))]
    shared = Counter(descriptions)
    return [
        fallback if not words else f"{words} ({fallback})" if shared[words] > 1 else words
        for words, fallback in zip(descriptions, otherwise, strict=True)
    ]


def _said(told: Sequence[Difference], store: int) -> str:
    """What differs about a store, in words."""
    kinds = [d.path for d in told if d.is_kind]
    words = []
    for difference in told:
        if store in difference.said:
            bare = difference.is_kind and len(kinds) == 1 and difference.said[store] != "null"
            field = "" if bare else _field(difference.path, [d.path for d in told], kinds)
            words.append(f"{field} {difference.said[store]}".strip())
    more = [f"{len(words) - MOST} more"] if len(words) > MOST else []
    return ", ".join(words[:MOST] + more)


def _field(path: tuple[str, ...], others: Sequence[tuple[str, ...]], kinds: Sequence[tuple[str, ...]]) -> str:
    """A field with what it belongs to, as much as tells it from others: nothing where a kind that is said owns it."""
    long = 1 if len(path) == 1 or path[-2] in GROUPS or (len(kinds) == 1 and path[:-1] in kinds) else 2
    while long < len(path) and sum(other[-long:] == path[-long:] for other in others) > 1:
        long += 1
    return " ".join(path[-long:]).replace("_", " ")


def _differences(values: Mapping[int, Any], path: tuple[str, ...], recipes: Sequence[Any]) -> list[Difference]:
    """Differences of values (by store) at a path; stores that differ in form are told apart by it, and no further."""
    forms = {store: _form(value) for store, value in values.items()}
    differences = []
    if len(set(forms.values())) > 1:
        texts = {store: _value(value, path, recipes[store]) for store, value in values.items()}
        kinds = any(form[0] == "fields" for form in forms.values())
        differences.append(Difference(path or ("recipe",), kinds, texts))
    for form in dict.fromkeys(forms.values()):
        alike = {store: value for store, value in values.items() if forms[store] == form}
        if len(alike) > 1 and form[0] != "value":
            inner = {store: _items(value) for store, value in alike.items()}
            for key in dict.fromkeys(key for items in inner.values() for key in items):
                below = {store: items.get(key) for store, items in inner.items()}
                differences += _differences(below, (*path, key), recipes)
    return differences


def _form(value: Any) -> tuple[str, Any]:
    """What values have to share for their parts to be compared: fields of one kind, or the names of a list."""
    if isinstance(value, dict):
        return "fields", value.get("kind")
    if isinstance(value, list) and any(isinstance(item, dict) for item in value):
        return "many", tuple(_items(value))
    return "value", repr(value)


def _items(value: Any) -> dict[str, Any]:
    """Parts of fields or of a list by name; what has no name by its number."""
    if isinstance(value, dict):
        return {key: item for key, item in value.items() if key != "kind"}
    named = [
        str(item["name"]) if isinstance(item, dict) and item.get("name") else str(i) for i, item in enumerate(value)
    ]
    names = named if len(set(named)) == len(named) else [str(i) for i in range(len(value))]
    return dict(zip(names, value, strict=True))


def _value(value: Any, path: tuple[str, ...], recipe: Any) -> str:
    """A value as people write it: with a unit where its field has one."""
    if isinstance(value, dict):
        return str(value.get("kind") or "given").replace("_", " ")
    if _form(value)[0] == "many":
        return f"of {len(value)}" if len(value) > 3 else ", ".join(_items(value))
    unit = found.symbol if (found := unit_at(recipe, path)) else ""
    if isinstance(value, list):
        text = "[" + ", ".join(_number(item, "") for item in value) + "]" + (f" {unit}" if unit else "")
    else:
        text = _number(value, unit)
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."


def _number(value: Any, unit: str) -> str:
    """A number in the largest preferred unit in which it is not small; other values as YAML writes them."""
    if value is None or isinstance(value, bool):
        return "null" if value is None else str(value).lower()
    if unit in UNITS and isinstance(value, str) and value.endswith(f" {unit}"):  # as angles are written
        value = float(value.removesuffix(unit))
    if isinstance(value, str):
        return value.replace("_", " ")
    if not isinstance(value, int | float):
        return str(value)
    scales = [(symbol, UNITS[unit][symbol]) for symbol in PREFERRED.get(unit, ())] or [(unit, 1.0)]
    fitting = [(symbol, size) for symbol, size in scales if abs(value) >= 0.0999 * size]
    symbol, size = scales[0] if value == 0 else fitting[0] if fitting else scales[-1]
    return f"{value / size:.6g} {symbol}".rstrip()


def _plain(text: str) -> Any:
    """A recipe as plain values; None where it is not YAML."""
    try:
        return read_text(text, "", Path()).data
    except RecipeError:
        return None


def _loaded(text: str) -> Any:
    """A recipe, for the units of its fields; None for one of another version."""
    try:
        return loads(text, resolved=True)
    except (RecipeError, ValueError):
        return None
