"""Rows of an accuracy table: one case, one quantity, the error that was allowed, the error that was found, the cost."""

from __future__ import annotations

from collections.abc import Mapping
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
    bound: float
    """Of the error, in `unit`: at the place where the error is largest against its bound."""
    error: float
    """The error there."""
    cost: float
    """CPU time of one core, in `cost_unit`."""
    cost_unit: str
    """Of what, too: "us a ray", "ms an aspect"."""
    counts: Mapping[str, int]
    """How much of it there was, each number with its name: {"pairs": 60, "rays": 540}, {"facets": 20480}."""
    knob: str | None = None
    """Name of the trade of error for time that the case is one point of."""
    note: str = ""
    """What the bound is, where it is not the one that is aimed at; one line."""

    @property
    def ok(self) -> bool:
        """Whether the error is within its bound; an error that is not a number is not."""
        return self.error <= self.bound

    def as_json(self) -> dict[str, Any]:
        """The row with its verdict, for programs: counts by their names; an error that is not a number is None."""
        return asdict(self) | dict(self.counts) | {"error": None if isnan(self.error) else self.error, "ok": self.ok}
