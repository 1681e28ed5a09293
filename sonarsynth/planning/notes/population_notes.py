"""What a user should know about populations: how many bodies there are, how many places do not fit."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np

from sonarsynth.conventions import counted, evenly
from sonarsynth.recipe import Recipe

LOOKED_AT = 1000
"""Sequences whose bodies are drawn to say how many there are."""


def population_notes(recipe: Recipe) -> list[str]:
    """How many bodies sequences have, and the share of the places tried that do not fit.

    Raises FieldError, naming the sequence, where a population has no room.
    """
    if not recipe.described.world.populations:
        return []
    numbers, draws = [], 0
    for sequence in evenly(recipe.sequences, LOOKED_AT):
        with recipe.spanned.naming(sequence):
            drawn = recipe.spanned.bodies(sequence)
        numbers.append(len(drawn.targets))
        draws += drawn.tried
    refused = 100.0 * (1.0 - sum(numbers) / draws) if draws else 0.0
    empty = sum(number == 0 for number in numbers)
    return [
        f"populations: {min(numbers)} to {max(numbers)} bodies in {counted(len(numbers), 'sequence')} drawn, "
        f"{np.mean(numbers):.2g} on average, none in {empty}; {refused:.0f} % of the places tried were refused: "
        "outside the region, out of the water, or too near to another body, the array or a snap"
    ]


def once(lines: Iterable[str], recipe: Recipe) -> tuple[str, ...]:
    """Notes without repeats: of the bodies of a population that differ in numbers alone, the first, of all of them."""
    slots = {name: p.name for p in recipe.described.world.populations for name in p.slots}
    unique: dict[str, str] = {}
    for line in lines:
        name, colon, text = line.partition(": ")
        if colon and name in slots:
            unique.setdefault(re.sub(r"[\d.e+-]+", "#", f"{slots[name]}: {text}"), f"{slots[name]}, such as {line}")
        else:
            unique.setdefault(line, line)
    return tuple(unique.values())
