"""One stored variable, and the axes that several have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Variable:
    """One stored variable. Those with a `frame` axis are written frame by frame; unwritten ones read as `fill`."""

    group: str  # "/" or "/signals"
    name: str
    dims: tuple[str, ...]
    dtype: str
    units: str  # UDUNITS text; "1" where there is none
    long_name: str
    fill: float | int = float("nan")
    attributes: tuple[tuple[str, Any], ...] = ()
    product: str = ""  # of a build; "truth": always there; "levels": of what is traced, there with any other product

    @property
    def listed(self) -> bool:
        """Whether a frame has as many rows of it as there are points or paths; the rest reads as `fill`."""
        return self.dims in (POINT, PATH)

    def stacked(self, frames: Sequence[np.ndarray], shape: tuple[int, ...]) -> np.ndarray:
        """Values of frames together (frame, ...), each in the shape that the store has room for."""
        if not self.listed:
            return np.array(frames)
        rows = np.full((len(frames), *shape), self.fill, frames[0].dtype)
        for n, values in enumerate(frames):
            rows[n, : len(values)] = values
        return rows


LOUDEST = ("frame", "loudest")
BEAMS = ("frame", "elevation", "azimuth")
EMISSION = ("frame", "emission")
ESTIMATE = ("frame", "estimate")
SENSOR = ("frame", "sensor")
POINT = ("frame", "point")
PATH = ("frame", "path")
TARGET = ("frame", "target")
ECHO = (*TARGET, "family")
CELL = ("frame", "emission", "target", "family")
NONE = (("flag_values", [-1]), ("flag_meanings", "none"))


def group_of(group: str, product: str, *rows: Variable) -> tuple[Variable, ...]:
    """Rows of a group, of a product where they say none themselves."""
    return tuple(replace(row, group=group, product=row.product or product) for row in rows)


def comment(text: str) -> tuple[tuple[str, Any], ...]:
    """The attribute of a remark."""
    return (("comment", text),)


def flags(meanings: tuple[str, ...]) -> tuple[tuple[str, Any], ...]:
    """CF attributes of numbers that stand for words, from 0 on."""
    words = " ".join(meaning.replace(" ", "_") for meaning in meanings)
    return (("flag_values", list(range(len(meanings)))), ("flag_meanings", words))


def row(
    name: str, dims: tuple[str, ...], units: str, long_name: str, *, dtype: str = "float64", **more: Any
) -> Variable:
    """A row of a group; whole numbers that are not written read as -1."""
    if dtype[0] in "iu" and "fill" not in more:
        more["fill"] = -1
    return Variable("", name, dims, dtype, units, long_name, **more)
