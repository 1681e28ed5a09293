"""Rows of numbers as programs in Fortran read them: apart by white space or commas, a `/` or a `!` ends a row."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from typing import NamedTuple


class FortranRow(NamedTuple):
    """A line of numbers."""

    line: int  # in the file, from 1
    numbers: list[float]
    ended: bool  # by a `/`: what is left out is for the reader to know

    def axis(self, count: float, scale: float = 1.0) -> list[float]:
        """So many numbers, times a scale; of two and a `/`, as many in even steps. Raises ValueError."""
        given = [scale * number for number in self.numbers]
        if self.ended and len(given) == 2 and count > 2:
            step = (given[1] - given[0]) / (count - 1)
            return [given[0] + n * step for n in range(int(count))]
        if len(given) != count:
            raise ValueError(f"line {self.line}: has {len(given)} numbers, not {count:g}")
        return given


def fortran_rows(lines: Iterable[str], first: int = 1) -> list[FortranRow]:
    """The lines that hold something, the first of number `first`. Raises ValueError where a word is no number."""
    rows = []
    for line, text in enumerate(lines, first):
        words, slash, _ = text.partition("!")[0].partition("/")
        numbers = []
        for word in re.split(r"[,\s]+", words.strip()):
            try:
                number = float(re.sub("[dD]", "e", word)) if word else math.nan
            except ValueError:
                raise ValueError(f"line {line}: {word[:40]!r} is not a number") from None
            if word and not math.isfinite(number):
                raise ValueError(f"line {line}: {word[:40]!r} is not a finite number")
            numbers += [number] if word else []
        if numbers:
            rows.append(FortranRow(line, numbers, bool(slash)))
    return rows
