"""Rows of an accuracy table: one case, one quantity, the error that was allowed, the error that was found, the cost."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import isnan
from typing import Any


@dataclass(frozen=True)
class Row:
    """The largest error of one quantity in one case, against a computation that shares no code with what it checks."""

    case: str
    reference: str
    """What it was compared with."""
    quantity: str
    unit: str
    expected: float
    """Bound of the error, in `unit`: at the place where the error is largest against its bound."""
    got: float
    """The error there."""
    microseconds: float
    """CPU time of one core for one ray, in the complete search of the whole case."""
    pairs: int
    """Pairs of ends that were searched."""
    rays: int
    """Rays that were compared."""
    knob: str | None = None
    """Name of the trade of error for time that the case is one point of."""

    @property
    def ok(self) -> bool:
        """Whether the error is within its bound; an error that is not a number is not."""
        return self.got <= self.expected

    def as_json(self) -> dict[str, Any]:
        """The row with its verdict, for programs; an error that is not a number is None."""
        return asdict(self) | {"got": None if isnan(self.got) else self.got, "ok": self.ok}
