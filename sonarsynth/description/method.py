"""What the planner asks of a method beside its mathematics: a new method may leave all of it as it is here. What a
method returns is looked at where it is first used (`returned`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

UNSTATED = float("nan")
"""The error of a method that says none."""


@dataclass(frozen=True)
class Demand:
    """What a plan asks of the methods of a family."""

    allowed: float  # error that the method may have, in the unit of its family
    exact: bool  # the recipe asks for no error at all
    error: Callable[[Any], float]  # what a method errs by against the exact one of the family, measured in some frames
    elements: Any = None  # of the array
    off_bottom: bool = False  # some source is not on the bottom
    reflected: bool = False  # sound is reflected by surface and bottom
    bandwidth: float = float("inf")  # Hz: of the sonar
    bending: float = 0.0  # m: what straight ranges err by where rays bend, at the sound speed of the water at the array


@dataclass(frozen=True)
class FrameSize:
    """How much of everything there is in a frame: what the cost of methods grows with."""

    emissions: int
    sensors: int
    samples: int  # of the signals of a sensor
    bins: int  # frequencies of the echo window, in band
    beams: int  # of the image
    facets: int
    paths: float  # by counts: each with the weight of its pulse, which some facets reshape
    solid_angle: float = 0.0  # sr: of the largest target, as the array sees it
    on_lattice: bool = True  # the sensors
    layers: int = 1  # of the sound speed


class Method:
    """How a method answers the planner. One that stands for several (`auto`) makes itself concrete in `resolve`."""

    kind: str

    def resolve(self, demand: Demand) -> tuple[Any, float]:
        """The method that runs, and what it errs by in the unit of its family; NaN where it does not say."""
        return self, UNSTATED

    def exact(self) -> Any:
        """The exact, slow method that this one is to be judged by; itself where there is none."""
        return self

    def cost(self, size: FrameSize) -> float:
        """Seconds of one core that a frame takes, on the machine that costs are measured on (`planning.costs`).

        Left at nothing, only the frames that are tried before a build tell (`schedule.predicting`).
        """
        return 0.0

    def variants(self) -> dict[str, Any]:
        """Other settings of it that `accuracy` walks, by what they are called: the knob, "at", the value."""
        return {}

    def row(self) -> str:
        """The method in a few words, as `plan` prints it."""
        return self.kind

    def notes(self) -> tuple[str, ...]:
        """What users should know of its settings, a line each."""
        return ()

    def refusal(self, elements: Any) -> str:
        """Why it cannot serve an array, in one line; empty where it can."""
        return ""


class WrongReturn(TypeError):
    """A method returned what its family does not; str() is one line that names it."""


def returned(
    method: object, name: str, value: Any, shape: tuple[int, ...], column: str = "", *, unknown: bool = False
) -> Any:
    """`value`, which `name` of a method returned: an array of this shape, or what has one as its attribute `column`.

    Raises WrongReturn for another shape, for what is no array of numbers, and for NaN unless these may be `unknown`.
    """
    array = np.asarray(getattr(value, column, None) if column else value)
    of, numbers = f" as {column}" if column else "", array.dtype.kind in "bifuc"
    if array.shape != shape or not numbers:
        what = f"an array of shape {array.shape}" if numbers else f"a {type(value).__name__}"
        raise WrongReturn(f"{_place(method, name)} returned {what}{of}, not an array of shape {shape}")
    if not unknown and _has_nan(array):
        raise WrongReturn(f"{_place(method, name)} returned NaN{of}")
    return value


def returned_rows(
    method: object, name: str, value: Any, kind: type, like: str, known: tuple[str, ...],
    wide: Mapping[str, tuple[int, ...]], rows: int | None = None,
) -> Any:  # fmt: skip
    """`value`, which `name` of a method returned: a table of a kind, each column with so many rows; left out: with
    those of the column `like`. known: columns without NaN; wide: shapes of the rows of those that are not numbers.

    Raises WrongReturn as `returned`.
    """
    if not isinstance(value, kind):
        raise WrongReturn(f"{_place(method, name)} returned a {type(value).__name__}, not a {kind.__name__}")
    count = np.size(getattr(value, like)) if rows is None else rows
    for column, array in vars(value).items():
        if column == like or column in wide or isinstance(array, np.ndarray):
            shape = (count, *wide.get(column, ()))
            if getattr(array, "shape", None) != shape or (column in known and _has_nan(array)):
                returned(method, name, value, shape, column, unknown=column not in known)
    return value


def _place(method: object, name: str) -> str:
    """A function of a method, as Python finds it."""
    return f"{type(method).__module__}.{type(method).__name__}.{name}"


def _has_nan(array: np.ndarray) -> bool:
    """Whether there is NaN among numbers: their maximum is. A third of the time of `numpy.isnan`."""
    top = np.maximum.reduce(array, axis=None) if array.size else 0.0
    return bool(np.isnan(top))
