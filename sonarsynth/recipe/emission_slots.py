"""How many emissions a frame may have, where sources of some sequences sound more often than of others."""

from __future__ import annotations

from itertools import product
from math import prod

from sonarsynth.description import FieldError
from sonarsynth.recipe.sequences import Sequences, name_of
from sonarsynth.recipe.variation.grid import Axis
from sonarsynth.recipe.variation.random_variations import Choice, Variation
from sonarsynth.recipe.variation.setting import Setting, plain_scene, with_settings
from sonarsynth.recipe.variation.values import Plain, where

MOST_COMBINATIONS = 1000
"""Combinations of values that are looked at for one source."""


def most_emissions(spanned: Sequences) -> int:
    """Most emissions of a frame of any sequence: the store has room for so many.

    Of each source the most times that any values give it of what sets these, whether or not they come together with
    the most of another. Raises FieldError for values that cannot be.
    """
    scene = spanned.described(0)
    plain, count = plain_scene(scene), 0
    for i, source in enumerate(scene.world.sources):
        times = ("scene", "world", "sources", i, source.times_field)
        setting = [
            [Setting(at, name_of(entry), entry.path, value) for value in _listed(entry)]
            for at, entry in spanned.entries
            if any(where(path) == times[: len(where(path))] for path in entry.path)
        ]
        if prod(map(len, setting)) > MOST_COMBINATIONS:
            raise FieldError(times, f"has more than {MOST_COMBINATIONS} combinations of what sets it")
        several = [with_settings(scene, plain, combination) for combination in product(*setting) if combination]
        count += max(len(described.world.sources[i].times) for described in (scene, spanned.base, *several))
    return count


def _listed(entry: Axis | Variation) -> tuple[Plain, ...]:
    return entry.taken if isinstance(entry, Axis) else entry.values if isinstance(entry, Choice) else ()
