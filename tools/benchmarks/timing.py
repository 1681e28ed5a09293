"""What benchmarks share: processor time, what the machine does just now, tables."""

import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
RECIPE = CONFIGS / "remus.yaml"


def cpu(function: Callable[[], Any], repeats: int = 7) -> tuple[Any, float]:
    """Result and median CPU seconds of a call, after one call that compiles and fills caches."""
    result = function()
    seconds = []
    for _ in range(repeats):
        result, spent = once(function)
        seconds.append(spent)
    return result, float(np.median(seconds))


def once(function: Callable[[], Any]) -> tuple[Any, float]:
    """Result and CPU seconds of a call."""
    began = time.process_time()
    result = function()
    return result, time.process_time() - began


def gemm() -> float:
    """Processor time (ms) of a product of two float32 matrices of 1024 by 1024: what this machine does just now."""
    a = np.random.default_rng(0).random((1024, 1024), np.float32)
    return 1e3 * cpu(lambda: a @ a, 9)[1]


def markdown(rows: Iterable[Iterable[str]]) -> list[str]:
    """Lines of a table; the first row is its head."""
    head, *others = [list(row) for row in rows]
    return ["| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *others)]
