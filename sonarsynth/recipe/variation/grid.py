"""The grid: every combination of the values of its entries is a trajectory."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np
from annotated_types import Ge, Le, MinLen
from pydantic import model_validator

from sonarsynth.description import description
from sonarsynth.recipe.variation.values import (
    Name,
    Paths,
    Plain,
    PlainValue,
    Quantity,
    number_and_unit,
    same_unit,
    with_unit,
)

MOST_VALUES = 100_000
"""Of one entry."""


@description
class Axis:
    """One field and the values that it takes: listed, or `first` to `last`, both included, by `step` or `count`."""

    path: Paths
    """Field of the scene, such as scene.world.targets.0.motion.heading; a list of fields gets the same value."""
    name: Name | None = None
    """Name of the coordinate in the store; left out: made from the path."""
    values: Annotated[tuple[PlainValue, ...], MinLen(1)] | None = None
    """What the field takes: numbers, texts with units, or whole descriptions such as {kind: sphere, radius: 0.5 m}."""
    first: Quantity | None = None
    """First value of a range."""
    last: Quantity | None = None
    """Last value of a range: no value lies beyond."""
    step: Quantity | None = None
    """From one value of a range to the next."""
    count: Annotated[int, Ge(2), Le(MOST_VALUES)] | None = None
    """Number of values of a range, evenly spaced."""

    @model_validator(mode="after")
    def _check(self) -> Axis:
        ranged = (self.first, self.last, self.step, self.count)
        if self.values is not None:
            if any(field is not None for field in ranged):
                raise ValueError("has values and a range: give one")
            first_of: dict[str, int] = {}
            for i, value in enumerate(self.values):
                if first_of.setdefault(value.text, i) != i:
                    raise ValueError(f"value {value.shown} is given twice: use repeats for more sequences of a value")
            return self
        if self.first is None or self.last is None or (self.step is None) == (self.count is None):
            raise ValueError("needs values: [...], or first, last and one of step and count")
        same_unit(first=self.first, last=self.last, step=self.step)
        _numbers(self)
        return self

    @property
    def size(self) -> int:
        """Number of values, without making them."""
        return len(self.values) if self.values is not None else self.count or len(_numbers(self))

    @property
    def taken(self) -> tuple[Plain, ...]:
        """The values, in order."""
        if self.values is not None:
            return self.values
        unit = number_and_unit(self.first or 0.0)[1]
        integers = not unit and all(isinstance(field, int) for field in (self.first, self.last, self.step))
        return tuple(Plain.of(round(n)) if integers else with_unit(n, unit) for n in _numbers(self))


def _numbers(axis: Axis) -> list[float]:
    """The numbers of a range, in the unit written. Raises ValueError where there is none, or too many."""
    first, last = (number_and_unit(end or 0.0)[0] for end in (axis.first, axis.last))
    if axis.count is not None:
        if first == last:
            raise ValueError("first and last are the same")
        return [float(n) for n in np.linspace(first, last, axis.count)]
    step = number_and_unit(axis.step or 0.0)[0]
    steps = (last - first) / step if step else math.nan
    if not 0.0 <= steps < MOST_VALUES:
        raise ValueError(f"step {axis.step} does not lead from first to last in under {MOST_VALUES} values")
    return [round(first + n * step, 12) for n in range(math.floor(steps * (1.0 + 1e-12) + 1e-9) + 1)]


@description
class Zip:
    """Entries that advance together: the first values of all, the second values of all, ..."""

    zip: Annotated[tuple[Axis, ...], MinLen(2)]
    """Entries of equally many values."""

    @model_validator(mode="after")
    def _check(self) -> Zip:
        counts = [axis.size for axis in self.zip]
        if len(set(counts)) > 1:
            raise ValueError(f"the entries have {', '.join(map(str, counts))} values; they must have equally many")
        return self


def entry_tag(value: Any) -> str:
    """Which of the two a written entry is."""
    return "zip" if (isinstance(value, dict) and "zip" in value) or isinstance(value, Zip) else "axis"


def axes(entry: Axis | Zip) -> tuple[Axis, ...]:
    """The axes of an entry."""
    return entry.zip if isinstance(entry, Zip) else (entry,)
