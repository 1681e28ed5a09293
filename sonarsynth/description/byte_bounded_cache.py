"""Results kept by their arguments, as `functools.lru_cache` keeps them, but bounded in bytes: meshes can be large."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import is_dataclass
from functools import update_wrapper
from threading import Lock
from typing import Any, Final, Generic, ParamSpec, TypeVar

import numpy as np

P = ParamSpec("P")
R = TypeVar("R")

MOST_BYTES: Final = 2**29
"""What one cache may hold, but for the results that were asked for last."""
LEAST: Final = 4
"""Results that stay whatever their size: a scene asks for the meshes of its targets again in every frame."""


def size_of(*values: object) -> int:
    """Bytes of all arrays that results hold, each counted once; of other objects, their `nbytes`."""
    total, counted, pending = 0, set[int](), list(values)
    alive: list[object] = []  # so that no two have the same id
    while pending:
        value = pending.pop()
        if id(value) in counted:
            continue
        counted.add(id(value))
        alive.append(value)
        if isinstance(value, np.ndarray) and isinstance(value.base, np.ndarray):
            pending.append(value.base)
        elif isinstance(value, (tuple, list)):
            pending += value
        elif isinstance(value, dict):
            pending += value.values()
        elif is_dataclass(value):
            pending += vars(value).values()  # fields, and what was computed of them
        else:
            total += int(getattr(value, "nbytes", 0))
    return total


class ByteBoundedCache(Generic[P, R]):
    """A function that keeps its results: at most `most`, and the last `LEAST` or no more than `MOST_BYTES` together.

    The size of a result is taken when it is added and when the next is, for meshes grow with what is asked of them; of
    all results, what they share counted once, where these sizes come to too much. Safe in threads; two that ask for the
    same at once may both make it.
    """

    def __init__(self, function: Callable[P, R], limit: int) -> None:
        self._function, self._most = function, limit
        self._results: OrderedDict[Hashable, tuple[Any, R]] = OrderedDict()
        self._sizes: dict[Hashable, int] = {}
        self._lock = Lock()
        update_wrapper(self, function)

    def __call__(self, *args: P.args, **named: P.kwargs) -> R:
        """The result for these arguments."""
        key = (args, tuple(sorted(named.items())))
        with self._lock:
            if key in self._results:
                self._results.move_to_end(key)
                return self._results[key][1]
        result = self._function(*args, **named)
        with self._lock:
            self._results[key] = (key, result)
            self._results.move_to_end(key)
            for recent in (*list(self._sizes)[-1:], key):
                self._sizes[recent] = size_of(self._results[recent])
            while len(self._results) > self._most or self._too_large:
                del self._sizes[self._results.popitem(last=False)[0]]
        return result

    @property
    def _too_large(self) -> bool:
        return len(self._results) > LEAST and sum(self._sizes.values()) > MOST_BYTES and self.nbytes > MOST_BYTES

    @property
    def nbytes(self) -> int:
        """Bytes of arrays in results and arguments that are kept now."""
        return size_of(*self._results.values())

    def __len__(self) -> int:
        return len(self._results)

    def cache_clear(self) -> None:
        """Forget all results."""
        with self._lock:
            self._results.clear()
            self._sizes.clear()


def byte_bounded_cache(limit: int) -> Callable[[Callable[P, R]], ByteBoundedCache[P, R]]:
    """Decorator: keep results by arguments, at most `limit`, bounded in bytes (`ByteBoundedCache`)."""

    def decorate(function: Callable[P, R]) -> ByteBoundedCache[P, R]:
        return ByteBoundedCache(function, limit)

    return decorate
