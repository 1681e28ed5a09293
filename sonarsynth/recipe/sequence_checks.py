"""What is refused of what a recipe spans, before any scene is looked at; and how many emissions a frame may have."""

from __future__ import annotations

from itertools import product
from math import prod

from sonarsynth.description import FieldError
from sonarsynth.description.field_messages import Where
from sonarsynth.recipe.sequences import MOST_SEQUENCES, Sequences, name_of
from sonarsynth.recipe.variation.grid import Axis
from sonarsynth.recipe.variation.named_paths import listed_values
from sonarsynth.recipe.variation.random_variations import Choice, NumberVariation, Sobol
from sonarsynth.recipe.variation.setting import Setting, plain_scene, with_settings
from sonarsynth.recipe.variation.sobol_points import OF_VARIATIONS
from sonarsynth.recipe.variation.values import MOST_FRAMES, where

RESERVED = ("frame", "trajectory", "step", "time", "split", "repeat")
"""Names of the store that no entry can have."""


def check_spanned(spanned: Sequences) -> None:
    """Raises FieldError for entries that cannot go together; the scenes are not looked at."""
    if spanned.count > MOST_SEQUENCES:
        raise FieldError(("grid",), f"spans {spanned.count:.8g} sequences, more than {MOST_SEQUENCES}")
    names: dict[str, str] = {}
    paths: dict[str, str] = {}
    for at, entry in spanned.entries:
        name = name_of(entry)
        if name in RESERVED or name in names:
            raise FieldError((*at, "name"), f"'{name}' is the name of another coordinate: give another name")
        names[name] = name
        for path in entry.path:
            if path in paths:
                raise FieldError((*at, "path"), f"'{path}' is set by '{paths[path]}' as well")
            paths[path] = name
    _check_dependent(spanned)
    if sum(isinstance(v, Sobol) for v in spanned.variations) > OF_VARIATIONS:
        raise FieldError(("variations",), f"has more than {OF_VARIATIONS} of kind sobol")
    if spanned.first_frames[-1] > MOST_FRAMES:
        raise FieldError(("grid",), f"spans {spanned.count} sequences: more than {MOST_FRAMES} frames")
    if spanned.splits is not None:
        stratify = [] if spanned.splits.stratify is None else [(("splits", "stratify"), spanned.splits.stratify)]
        for in_splits, name in [*stratify, *((("splits", "undivided"), n) for n in spanned.splits.undivided)]:
            _check_name(spanned, in_splits, name)


def _check_dependent(spanned: Sequences) -> None:
    """What goes with another, or only where another has some value: that must be there, and come before."""
    ranged = {name_of(v): v for v in spanned.variations if isinstance(v, NumberVariation)}
    listed = {name_of(entry) for at, entry in spanned.entries if at[0] == "grid"}
    for i, variation in enumerate(spanned.variations):
        if variation.when is not None and variation.when.entry not in listed:
            names = ", ".join(sorted(listed)) or "there are none"
            raise FieldError(
                ("variations", i, "when", "entry"),
                f"'{variation.when.entry}' is no entry of the grid, nor a choice that comes before; known: {names}",
            )
        if isinstance(variation, Choice):
            listed.add(name_of(variation))
        like = variation.like if isinstance(variation, NumberVariation) else None
        if like is not None and (like not in ranged or ranged[like].like is not None or like == name_of(variation)):
            free = ", ".join(name for name, v in ranged.items() if v.like is None and v is not variation) or "none"
            raise FieldError(("variations", i, "like"), f"'{like}' is no other variation to go with: {free}")


def _check_name(spanned: Sequences, at: Where, name: str) -> None:
    """A name must be that of an entry with values that several sequences can have."""
    divides = {name_of(e): isinstance(e, (Axis, Choice)) for _, e in spanned.entries}
    if name not in divides:
        raise FieldError(at, f"'{name}' names nothing that varies; known: {', '.join(divides) or 'nothing varies'}")
    if not divides[name]:
        raise FieldError(at, f"'{name}' has another value in each sequence: name an entry of the grid or a choice")


MOST_COMBINATIONS = 1000
"""Combinations of values that are looked at for one source."""


def most_emissions(spanned: Sequences) -> int:
    """Most emissions of a frame of any sequence: the store has room for so many.

    Of each source the most times that any values give it of what sets these, whether or not they come together with
    the most of another. Raises FieldError for values that cannot be.
    """
    scene = spanned.described(0)
    plain, count = plain_scene(scene) if spanned.entries else {}, 0
    for i, source in enumerate(scene.world.sources):
        times = ("scene", "world", "sources", i, source.times_field)
        setting = [
            [Setting(at, name_of(entry), entry.path, value) for value in listed_values(entry)]
            for at, entry in spanned.entries
            if any(where(path) == times[: len(where(path))] for path in entry.path)
        ]
        if prod(map(len, setting)) > MOST_COMBINATIONS:
            raise FieldError(times, f"has more than {MOST_COMBINATIONS} combinations of what sets it")
        several = [with_settings(scene, plain, combination) for combination in product(*setting) if combination]
        count += max(len(described.world.sources[i].times) for described in (scene, spanned.base, *several))
    return count
