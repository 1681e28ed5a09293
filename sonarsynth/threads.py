"""One thread for linear algebra: the matrices of a frame are small, and frames are spread over processes."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")


@cache
def _libraries() -> Any:
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def in_one_thread(work: Callable[P, T]) -> Callable[P, T]:
    """The same work, for which BLAS has one thread: in two, a frame of `configs/remus.yaml` takes 1.9 times the time of
    a core, and one with a bounce 1.6 times."""

    @wraps(work)
    def limited(*args: P.args, **named: P.kwargs) -> T:
        with _libraries().limit(limits=1, user_api="blas"):
            return work(*args, **named)

    return limited
