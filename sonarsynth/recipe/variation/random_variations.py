"""What is drawn anew for each sequence. A draw depends on the seed, the sequence and the variation, on nothing else."""

from __future__ import annotations

import re
from typing import Annotated, Literal, Self

import numpy as np
from annotated_types import Ge, Le, MinLen
from pydantic import model_validator

from sonarsynth.conventions import Number
from sonarsynth.description import BY_KIND, description
from sonarsynth.randomness import share
from sonarsynth.recipe.variation.sobol_points import sobol_shares
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

LEAST_SHARE = 1e-12
"""A normal distribution must have so much of itself between its bounds."""
FAR = 4.0
"""Standard deviations that stand for the end of a normal distribution without a bound."""


def as_drawn(path: str) -> str:
    """The path of what varies in the words that its random draws are keyed by: those of the first version."""
    path = re.sub(r"^scene\.world\.sources\b", "scene.world.shrimp", path)
    return re.sub(r"^scene\.world\.environment\.bottom\b", "scene.world.environment.bed", path)


@description
class Condition:
    """That another entry has a value."""

    entry: Name
    """An entry of the grid, or a choice that comes before."""
    value: PlainValue
    """What it must have; or its kind."""


@description
class RandomVariation:
    """What every variation says."""

    path: Paths
    """Field of the scene; a list of fields gets the same value. Targets, sources and populations go by name or number:
    `targets.drum.motion.speed`."""
    name: Name | None = None
    """Name of the coordinate in the store; left out: made from the path."""
    when: Condition | None = None
    """Where alone it is drawn; elsewhere the field stays as it is."""


@description
class NumberVariation(RandomVariation):
    """What every variation says that is a number."""

    like: Name | None = None
    """Name of another such variation, itself like none, that this one goes with."""
    correlation: Annotated[Number, Ge(-1), Le(1)] = 1.0
    """With that: of the normal scores of both (a Gaussian copula), so that each keeps its distribution."""

    def at(self, fraction: float) -> Plain:
        """The value that this fraction (0 to 1) of all draws stays under."""
        raise NotImplementedError

    def share(self, seed: int, key: int | str, partner: str | None) -> float:
        """The part that is drawn for a sequence; `partner`: the path of what it is like."""
        own = share(seed, "variation", key, as_drawn(self.path[0]))
        if partner is None:
            return own
        from scipy.special import ndtr, ndtri

        theirs = share(seed, "variation", key, as_drawn(partner))
        scores = ndtri(np.array([theirs, own]) + 2.0**-54)
        return float(ndtr(self.correlation * scores[0] + np.sqrt(1.0 - self.correlation**2) * scores[1]))


@description
class _Bounded:
    """What is drawn between two bounds."""

    low: Quantity
    """Least value."""
    high: Quantity
    """Largest value."""

    @model_validator(mode="after")
    def _check_bounds(self) -> Self:
        _check_order(self.low, self.high)
        return self

    def at(self, fraction: float) -> Plain:
        """The value at this fraction (0 to 1) of the way, exactly low at 0 and high at 1."""
        (low, unit), (high, _) = number_and_unit(self.low), number_and_unit(self.high)
        return with_unit(min(max(low * (1.0 - fraction) + high * fraction, low), high), unit)


@description
class Uniform(_Bounded, NumberVariation):
    """Evenly between two bounds."""

    kind: Literal["uniform"] = "uniform"


@description
class LogUniform(_Bounded, NumberVariation):
    """Between two bounds over 0, evenly in the logarithm."""

    kind: Literal["log_uniform"] = "log_uniform"

    @model_validator(mode="after")
    def _check(self) -> LogUniform:
        if not number_and_unit(self.low)[0] > 0.0:
            raise ValueError(f"low must be greater than 0, not {self.low}")
        return self

    def at(self, fraction: float) -> Plain:
        """As `NumberVariation.at`."""
        (low, unit), (high, _) = number_and_unit(self.low), number_and_unit(self.high)
        return with_unit(min(max(low * (high / low) ** fraction, low), high), unit)


@description
class Integers(NumberVariation):
    """Whole numbers, each equally often, both bounds included."""

    kind: Literal["integers"] = "integers"
    low: Annotated[int, Ge(-(10**9)), Le(10**9)]
    """Least value."""
    high: Annotated[int, Ge(-(10**9)), Le(10**9)]
    """Largest value."""

    @model_validator(mode="after")
    def _check(self) -> Integers:
        if not self.low < self.high:
            raise ValueError(f"low must be less than high: {self.low} to {self.high}")
        return self

    def at(self, fraction: float) -> Plain:
        """As `NumberVariation.at`."""
        return Plain.of(min(self.low + int(fraction * (self.high - self.low + 1)), self.high))


@description
class Normal(NumberVariation):
    """A normal distribution, cut off at bounds where these are given (truncated: no draw lies outside)."""

    kind: Literal["normal"] = "normal"
    mean: Quantity
    """Mean before it is cut."""
    deviation: Quantity
    """Standard deviation before it is cut."""
    low: Quantity | None = None
    """Least value; left out: none is too small."""
    high: Quantity | None = None
    """Largest value; left out: none is too large."""

    @model_validator(mode="after")
    def _check(self) -> Normal:
        same_unit(mean=self.mean, deviation=self.deviation, low=self.low, high=self.high)
        if not number_and_unit(self.deviation)[0] > 0.0:
            raise ValueError(f"deviation must be greater than 0, not {self.deviation}")
        if self.low is not None and self.high is not None:
            _check_order(self.low, self.high)
        first, last, _ = self._shares()
        if not last - first >= LEAST_SHARE:
            raise ValueError(f"less than {LEAST_SHARE:g} of the distribution lies between low and high")
        return self

    def _shares(self) -> tuple[float, float, float]:
        """Shares of the whole distribution under its bounds, mirrored where that is more exact; and the sign."""
        from scipy.special import ndtr

        mean, deviation = number_and_unit(self.mean)[0], number_and_unit(self.deviation)[0]
        low = -np.inf if self.low is None else (number_and_unit(self.low)[0] - mean) / deviation
        high = np.inf if self.high is None else (number_and_unit(self.high)[0] - mean) / deviation
        sign = -1.0 if low > 0.0 else 1.0
        if sign < 0:
            low, high = -high, -low
        return float(ndtr(low)), float(ndtr(high)), sign

    def at(self, fraction: float) -> Plain:
        """The value that this fraction (0 to 1) of all draws stays under; at 0 and 1, where there is no bound, at
        most FAR deviations from the mean.
        """
        from scipy.special import ndtri

        mean, unit = number_and_unit(self.mean)
        deviation = number_and_unit(self.deviation)[0]
        first, last, sign = self._shares()
        share = first + (last - first) * (fraction if sign > 0 else 1.0 - fraction)
        score = sign * float(ndtri(share))
        if not np.isfinite(score):
            score = float(np.copysign(FAR, score))
        value = mean + deviation * score
        low, high = (number_and_unit(b)[0] if b is not None else None for b in (self.low, self.high))
        value = value if low is None else max(low, value)
        return with_unit(value if high is None else min(high, value), unit)

    def share(self, seed: int, key: int | str, partner: str | None) -> float:
        """As `NumberVariation.share`; never 0, which has no score."""
        return super().share(seed, key, partner) + (2.0**-54 if partner is None else 0.0)


@description
class Choice(RandomVariation):
    """One of several values."""

    kind: Literal["choice"] = "choice"
    values: Annotated[tuple[PlainValue, ...], MinLen(1)]
    """What the field may be."""
    weights: tuple[Number, ...] | None = None
    """How often each is taken, relative to the others; left out: equally often."""

    @model_validator(mode="after")
    def _check(self) -> Choice:
        if len(set(self.values)) < len(self.values):
            raise ValueError("a value is given twice: use weights")
        if self.weights is not None:
            if len(self.weights) != len(self.values):
                raise ValueError(f"has {len(self.values)} values and {len(self.weights)} weights")
            if min(self.weights) < 0.0 or not sum(self.weights) > 0.0:
                raise ValueError("weights must be 0 or more, and not all 0")
        return self

    def number(self, seed: int, key: int | str, path: str) -> int:
        """Number of the value of a sequence."""
        bounds = np.cumsum(self.weights if self.weights is not None else np.ones(len(self.values)))
        fraction = share(seed, "variation", key, path)
        return int(np.searchsorted(bounds, fraction * bounds[-1], side="right"))

    def draw(self, seed: int, key: int | str, path: str) -> Plain:
        """The value of a sequence."""
        return self.values[self.number(seed, key, path)]


@description
class Sobol(_Bounded, RandomVariation):
    """Evenly between two bounds, and more evenly than by chance: the repeats of a grid point share one Sobol sequence
    (Sobol 1967, directions of Joe and Kuo 2008), with a dimension for each variation of this kind, shifted at random
    (digital shift) for each grid point.
    """

    kind: Literal["sobol"] = "sobol"

    def draw(self, seed: int, key: str, path: str, dimension: int, repeat: int) -> Plain:
        """The value of a repeat of the grid point `key`, in this dimension of the sequence."""
        return self.at(float(sobol_shares(seed, key, [path], dimension, repeat)[0]))


Variation = Annotated[Uniform | LogUniform | Integers | Normal | Choice | Sobol, BY_KIND]


def _check_order(low: float | str, high: float | str) -> None:
    same_unit(low=low, high=high)
    if not number_and_unit(low)[0] < number_and_unit(high)[0]:
        raise ValueError(f"low must be less than high: {low} to {high}")
