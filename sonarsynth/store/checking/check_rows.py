"""A line of a report on whether what a store says agrees with what was there."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Check:
    """One line of the report. `ok` is None where a figure is reported, or the store has nothing to check.

    `frames` are those that are not as they should be, where that can be said of a frame. `warning`: a line on data that
    are as they say, but of little use; the check holds all the same.
    """

    name: str
    expected: str
    got: str
    ok: bool | None
    numbers: dict[str, float]
    frames: tuple[int, ...] = ()
    warning: str = ""
