"""Processor time of this thread in each stage of a frame, measured within `stage_timer`. No result depends on it."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Final

STAGES: Final = ("trace", "label", "synthesise", "measure", "locate", "beamform", "resolve", "range", "collect")
"""Stages in order: names of rows of a plan, and `collect`, which makes values ready to be stored."""


class _Watch:
    """Seconds by stage, and when the last stage ended."""

    def __init__(self, before: Mapping[str, float] | tuple[()]) -> None:
        self.cpu, self.last = dict[str, float](before), time.thread_time()


_watch: ContextVar[_Watch | None] = ContextVar("watch", default=None)


@contextmanager
def stage_timer(before: Mapping[str, float] | tuple[()] = ()) -> Iterator[dict[str, float]]:
    """Give seconds of processor time by stage, with those of before; the dictionary fills while the block runs."""
    watch = _Watch(before)
    token = _watch.set(watch)
    try:
        yield watch.cpu
    finally:
        _watch.reset(token)


def mark_stage(stage: str) -> None:
    """End a stage: the time since the last stage ended is added to it."""
    watch = _watch.get()
    if watch is not None:
        now = time.thread_time()
        watch.cpu[stage] = watch.cpu.get(stage, 0.0) + now - watch.last
        watch.last = now
