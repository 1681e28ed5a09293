"""Paths by name: `targets.drum.motion.speed` for `scene.world.targets.0.motion.speed` of a target that is so called."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

from sonarsynth.description import FieldError
from sonarsynth.description.field_messages import Where
from sonarsynth.recipe.scene import World
from sonarsynth.recipe.variation.grid import Axis, Zip
from sonarsynth.recipe.variation.random_variations import Choice, Variation
from sonarsynth.recipe.variation.values import Plain

Entry = TypeVar("Entry", bound=Axis | Variation)
LISTS = ("targets", "sources", "noise_sources", "populations")
"""Of the world, whose members have names."""


def numbered(world: World, grid: tuple[Axis | Zip, ...]) -> tuple[Axis | Zip, ...]:
    """The entries of a grid with numbers in their paths for names. Raises FieldError for a name that nothing has."""
    return tuple(
        replace(entry, zip=tuple(_numbered(world, axis, ("grid", i, "zip", j)) for j, axis in enumerate(entry.zip)))
        if isinstance(entry, Zip)
        else _numbered(world, entry, ("grid", i))
        for i, entry in enumerate(grid)
    )


def numbered_variations(world: World, variations: tuple[Variation, ...]) -> tuple[Variation, ...]:
    """The same of variations."""
    return tuple(_numbered(world, variation, ("variations", i)) for i, variation in enumerate(variations))


def _numbered(world: World, entry: Entry, at: Where) -> Entry:
    paths = tuple(_by_number(world, path, (*at, "path")) for path in entry.path)
    return entry if paths == entry.path else replace(entry, path=paths)


def _by_number(world: World, path: str, at: Where) -> str:
    keys = path.split(".")
    if len(keys) < 4 or keys[1] != "world" or keys[2] not in LISTS or keys[3].isdecimal():
        return path
    names = [item.name for item in getattr(world, keys[2])]
    if keys[3] not in names:
        listed = ", ".join(names) or "there are none"
        raise FieldError(at, f"'{path}': none of scene.world.{keys[2]} is called '{keys[3]}'; known: {listed}")
    return ".".join([*keys[:3], str(names.index(keys[3])), *keys[4:]])


def listed_values(entry: Axis | Variation) -> tuple[Plain, ...]:
    """The values of what varies, where they are listed."""
    return entry.taken if isinstance(entry, Axis) else entry.values if isinstance(entry, Choice) else ()
