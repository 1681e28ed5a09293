"""Rows of the table of a recipe: settings of a knob with their error and cost, and what they say of the choice."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from math import isfinite, nan
from typing import Any, Final, Literal

STAGES: Final = ("trace", "synthesis", "image", "range", "picking", "frame")
"""Parts of a frame that are walked, and the whole."""
Role = Literal["point", "peer", "check"]


@dataclass(frozen=True)
class Point:
    """One setting of one knob: what it errs by, and what it costs. In tracing all else is exact, but for what is chosen
    and what is cheaper than that; in other stages all else is as chosen."""

    stage: str
    knob: str
    setting: str
    error: float
    """Against the exact way, in `unit`: what the accuracy of the recipe is about. Largest of the frames."""
    unit: str
    allowed: float
    seconds: float
    """CPU time of one core a frame, of this stage; mean of the frames."""
    chosen: bool = False
    """Whether it is what the plan has."""
    role: Role = "point"
    """`peer`: another program or method; `check`: of the exact way itself."""
    also: Mapping[str, float] = field(default_factory=dict)
    """More numbers, by name with unit."""
    note: str = ""

    @property
    def meets(self) -> bool:
        """Whether the error is within what is allowed; one that is not a number is not."""
        return self.error <= self.allowed

    def as_json(self) -> dict[str, Any]:
        """The row for programs."""
        rows = {"row": self.role} | asdict(self) | dict(self.also) | {"meets": self.meets}
        return {k: v for k, v in rows.items() if k not in ("role", "also")}


@dataclass(frozen=True)
class Verdict:
    """Whether the choice of a stage, or of the whole frame, keeps within the accuracy at little more than it need."""

    stage: str
    choice: str
    error: float
    unit: str
    allowed: float
    seconds: float
    cheapest: str
    """The cheapest setting of the walk that keeps within the accuracy too."""
    cheapest_seconds: float
    ok: bool
    """Whether the error is within what is allowed, and the choice takes little more than the cheapest setting."""
    note: str = ""

    @property
    def meets(self) -> bool:
        """As `Point.meets`: unlike `ok`, it does not depend on times."""
        return self.error <= self.allowed

    @property
    def ratio(self) -> float:
        """How many times as long the choice takes as the cheapest setting; NaN where none keeps within."""
        return self.seconds / self.cheapest_seconds if self.cheapest_seconds > 0.0 else nan

    def as_json(self) -> dict[str, Any]:
        """The row for programs."""
        return {"row": "verdict"} | asdict(self) | {"ratio": self.ratio, "meets": self.meets}


def merged(points: Iterable[Point]) -> list[Point]:
    """One point for each setting, of those of several frames: the largest errors, the mean cost."""
    alike: dict[tuple[str, str, str, str], list[Point]] = {}
    for point in points:
        alike.setdefault((point.stage, point.role, point.knob, point.setting), []).append(point)
    return [_merged(group) for group in alike.values()]


def _merged(group: Sequence[Point]) -> Point:
    errors = [p.error for p in group]
    names = dict.fromkeys(name for p in group for name in p.also)
    return replace(
        group[0],
        error=max(errors) if all(isfinite(e) for e in errors) else nan,
        seconds=sum(p.seconds for p in group) / len(group),
        also={name: max(p.also[name] for p in group if name in p.also) for name in names},
    )
