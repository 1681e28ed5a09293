"""What varies, as coordinates of the frames: numbers in SI units or degrees, other values by number and meaning."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from sonarsynth.conventions import Unit
from sonarsynth.recipe.sequences import NOTHING, Sequences, name_of
from sonarsynth.recipe.variation.grid import Axis
from sonarsynth.recipe.variation.named_paths import listed_values
from sonarsynth.recipe.variation.random_variations import Variation
from sonarsynth.recipe.variation.setting import unit_at, value_at
from sonarsynth.recipe.variation.values import Plain, where

UDUNITS = {"rad": "degree", "rad/s": "degree s-1", "m/s": "m s-1", "kg/m3": "kg m-3", "psu": "1e-3"}
"""Units as stored; others as they are."""


@dataclass(frozen=True, eq=False)
class Column:
    """A value of each sequence."""

    name: str
    values: np.ndarray  # (sequence,) float64, or int32: number of the value
    attributes: dict[str, Any]


@lru_cache(maxsize=4)
def columns(sequences: Sequences) -> tuple[Column, ...]:
    """A column for each entry, and `repeat` where the points of the grid have several sequences."""
    if not sequences.varied:
        return ()
    entries, count = sequences.entries, sequences.count
    table = list(zip(*([s.value for s in sequences.settings(n)] for n in range(count)), strict=True))
    columns_of_entries = [_column(sequences, entry, values) for (_, entry), values in zip(entries, table, strict=True)]
    if sequences.repeats > 1:
        repeat = np.arange(count) % sequences.repeats
        attributes = {"units": "1", "long_name": "number of the sequence of its point of the grid"}
        columns_of_entries.append(Column("repeat", repeat.astype(np.int32), attributes))
    return tuple(columns_of_entries)


def _column(sequences: Sequences, entry: Axis | Variation, values: Sequence[Plain]) -> Column:
    path = entry.path[0]
    listed = listed_values(entry)
    applying = next((n for n, plain in enumerate(values) if plain != NOTHING), None)
    unit: Unit | None = None
    value: Any = 0.0
    if applying is not None:
        scene = sequences.described(applying)
        unit, value = unit_at(scene, where(path)[1:]), value_at(scene, path)
    numeric = isinstance(value, (int, float)) and not isinstance(value, bool)
    parsed = {v: _number(v, unit) for v in set(values) | set(listed) if v != NOTHING} if numeric else {}
    long_name = ", ".join(entry.path)
    if numeric and None not in parsed.values():
        array = np.array([parsed.get(v, np.nan) for v in values], np.float64)
        symbol = unit.symbol if unit else "1"
        if symbol.startswith("rad"):
            array = np.rad2deg(array)
        return Column(name_of(entry), array, {"units": UDUNITS.get(symbol, symbol), "long_name": long_name})
    order = {plain: n for n, plain in enumerate(listed or (v for v in dict.fromkeys(values) if v != NOTHING))}
    attributes = {
        "units": "1",
        "long_name": long_name,
        "flag_values": list(range(len(order))),
        "flag_meanings": " ".join(meanings(list(order))),
    }
    return Column(name_of(entry), np.array([order.get(v, -1) for v in values], np.int32), attributes)


def _number(value: Plain, unit: Unit | None) -> float | None:
    """The value in SI units; None for one that is no number."""
    plain = value.value
    if unit is not None:
        plain = unit.parse(plain)
    return float(plain) if isinstance(plain, (int, float)) and not isinstance(plain, bool) else None


def meanings(values: list[Plain]) -> list[str]:
    """A word for each value: its kind where that tells them apart, else all that it holds."""
    words = [_word(v.value.get("kind")) if isinstance(v.value, dict) and "kind" in v.value else "" for v in values]
    alone = all(words) and len(set(words)) == len(words)
    if not alone:
        words = [_word(_leaves(v.value)) for v in values]
    return words if len(set(words)) == len(words) else [f"{word}_{n}" for n, word in enumerate(words)]


def _leaves(value: Any) -> str:
    if isinstance(value, dict):
        kind = [str(value["kind"])] if "kind" in value else []
        return " ".join(kind + [f"{k} {_leaves(v)}" for k, v in value.items() if k != "kind"])
    return " ".join(map(_leaves, value)) if isinstance(value, list) else str(value)


def _word(value: Any) -> str:
    """Letters, digits and what CF allows in a flag meaning."""
    return re.sub(r"[^A-Za-z0-9_.@+-]+", "_", str(value)).strip("_") or "none"
