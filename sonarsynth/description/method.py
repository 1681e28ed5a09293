"""What the planner asks of a method beside its mathematics: a new method may leave all of it as it is here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

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
