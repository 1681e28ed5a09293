"""Cases of the extremes table, and what came of each: what must come out, what did, whether it is right, how long."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt


class CaseResult(NamedTuple):
    """What came out of a case, in words, and whether it is what must."""

    text: str
    ok: bool


@dataclass(frozen=True)
class Case:
    """An extreme, what must come out, and the check: it computes both, the expectation on its own."""

    name: str
    expected: str
    check: Callable[[], CaseResult]
    slow: bool = False
    """Large: minutes, or gigabytes; in the command alone."""


@dataclass(frozen=True)
class Extreme:
    """A row of the table."""

    group: str
    case: str
    expected: str
    got: str
    ok: bool
    seconds: float
    """CPU time of one core, without compiling what was compiled before."""

    def as_json(self) -> dict[str, Any]:
        """The row, for programs."""
        return asdict(self)


def off(error: npt.ArrayLike, allowed: float, unit: str = "", what: str = "") -> CaseResult:
    """The largest of some errors against what is allowed; an error that is not a number is not within it."""
    errors = np.abs(np.atleast_1d(np.asarray(error, float)))
    largest = float(errors.max()) if errors.size and not np.isnan(errors).any() else float("nan")
    head = f"{what} " if what else ""
    return CaseResult(f"{head}{largest:.2g}{unit and ' '}{unit} off ({allowed:g} allowed)", largest <= allowed)


def relative(computed: npt.ArrayLike, exact: npt.ArrayLike, allowed: float, what: str = "") -> CaseResult:
    """The largest relative error; of arrays that differ in shape none is right."""
    values, expected = np.asarray(computed, float), np.asarray(exact, float)
    if values.shape != expected.shape:
        return CaseResult(f"{what or 'values'}: shape {values.shape} where {expected.shape} belongs", False)
    return off(values / expected - 1.0, allowed, what=what)


def holds(ok: bool | np.bool_, text: str) -> CaseResult:
    """A fact that is so, or is not."""
    return CaseResult(text if ok else f"NOT SO: {text}", bool(ok))


def refused(call: Callable[[], object], words: str) -> CaseResult:
    """Whether a call is refused with a ValueError in one line that has these words."""
    try:
        call()
    except ValueError as error:
        message = str(error)
        return CaseResult(f"refused: {message}", words in message and "\n" not in message)
    return CaseResult("not refused", False)


def together(*results: CaseResult | Iterable[CaseResult]) -> CaseResult:
    """All of several; of an iterable the first that fails, or how many there are and the last."""
    every = [result if isinstance(result, CaseResult) else _all_of(list(result)) for result in results]
    return CaseResult("; ".join(result.text for result in every), all(result.ok for result in every))


def _all_of(results: list[CaseResult]) -> CaseResult:
    wrong = [result for result in results if not result.ok]
    if wrong or not results:
        return wrong[0] if wrong else CaseResult("nothing was checked", False)
    return CaseResult(f"{len(results)} of {len(results)} right, the last {results[-1].text}", True)


def outcome(group: str, case: Case) -> Extreme:
    """Run a case; a warning, and an error that nobody expects, is a failure."""
    began = time.process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            result = case.check()
    except Exception as error:
        result = CaseResult(f"{type(error).__name__}: {' '.join(str(error).split())}", False)
    return Extreme(group, case.name, case.expected, result.text, result.ok, time.process_time() - began)
