"""What differs between the recipes of stores, in few words: "scattering roughness 0.002 m" beside "... 0 m"."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from math import degrees
from pathlib import Path
from typing import Any

from sonarsynth.recipe.reading import RecipeError, loads
from sonarsynth.recipe.reading.yaml_source import read_text
from sonarsynth.recipe.variation.setting import unit_at

WORDLESS = ("title", "licence")
"""Fields of a recipe that make no number of a store differ."""

MOST, LONGEST = 4, 40
"""Differences that are said of each store; characters of a value that are said."""


def names_of(recipes: Sequence[str], otherwise: Sequence[str]) -> list[str]:
    """A name for each store: the fields that differ among the recipes that have them, and their values in SI units.

    recipes: the YAML of each, as stored. `otherwise`: names that are different anyhow; they stand for stores of which
    nothing is said, and behind names that stores share.
    """
    fields = [_fields(text) for text in recipes]
    paths = dict.fromkeys(path for own in fields for path in own if path[0] not in WORDLESS)
    told = [path for path in paths if len({own[path] for own in fields if path in own}) > 1]
    names = [_name([f"{' '.join(path[-2:])} {own[path]}" for path in told if path in own]) for own in fields]
    shared = Counter(names)
    return [
        fallback if not name else f"{name} ({fallback})" if shared[name] > 1 else name
        for name, fallback in zip(names, otherwise, strict=True)
    ]


def _name(said: Sequence[str]) -> str:
    more = [f"{len(said) - MOST} more"] if len(said) > MOST else []
    return ", ".join([*said[:MOST], *more]).replace("_", " ")


def _fields(text: str) -> Mapping[tuple[str, ...], str]:
    """Every value of a recipe by its path, as text; none of what is no YAML, and no units of another version."""
    try:
        plain = read_text(text, "", Path()).data
    except RecipeError:
        return {}
    try:
        recipe = loads(text, resolved=True)
    except (RecipeError, ValueError):
        recipe = None
    return {path: _said(value, unit_at(recipe, path)) for path, value in _values(plain, ())}


def _values(value: Any, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Plain values below a path: a list of fields by its numbers, any other as it is."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _values(item, (*path, key))
    elif isinstance(value, list) and any(isinstance(item, dict) for item in value):
        yield from _values({str(n): item for n, item in enumerate(value)}, path)
    elif path:
        yield path, value


def _said(value: Any, unit: Any) -> str:
    """A value with its unit, where its field has one; angles, which are written with theirs, in degrees."""
    if isinstance(value, str) and value.endswith(" rad"):
        return f"{degrees(float(value.removesuffix(' rad'))):.6g} deg"
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    text += f" {unit.symbol}" if unit is not None and not isinstance(value, str | None) else ""
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."
