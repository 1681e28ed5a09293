"""What a computation costs: CPU time of its fastest call."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final, TypeVar

T = TypeVar("T")

CALLS: Final = 3
ENOUGH, LONG = 1.0, 5.0
"""After so many s together something has been measured enough; what takes this long is measured once."""


def timed(run: Callable[[], T], calls: int = CALLS) -> tuple[T, float]:
    """What a function gives, and the CPU seconds of its fastest call of so many: compiled, and with its tables made."""
    best, total = float("inf"), 0.0
    for call in range(1, calls + 1):
        began = time.process_time()
        result = run()
        seconds = time.process_time() - began
        best, total = min(best, seconds), total + seconds
        if total > LONG or (call > 1 and total > ENOUGH):
            break
    return result, best
