"""Options of `build` about workers: what they may take, and where their scheduler may be."""

from __future__ import annotations

import math
from typing import Any

from sonarsynth.cli.running import BadOption

LEAST_GB, MOST_GB = 0.3, 1e6


def worker_bounds(
    workers: int | None, scheduler: str | None, timeout: float | None, memory_gb: float | None, insecure: bool
) -> dict[str, Any]:
    """Arguments of schedule.build. Raises BadOption for what cannot be."""
    if timeout is not None:
        if not math.isfinite(timeout):
            raise BadOption(f"--frame-timeout {timeout} is not a number of seconds")
        if workers == 0:
            raise BadOption("--frame-timeout works only with worker processes: use --workers 1 or more")
    if memory_gb is not None:
        if workers == 0 or scheduler is not None:
            raise BadOption(
                "--worker-memory applies only to processes on this machine: use it with --workers 1 or more"
            )
        if not LEAST_GB <= memory_gb <= MOST_GB:
            raise BadOption(f"--worker-memory: must be from {LEAST_GB} to {MOST_GB:g} GB, not {memory_gb}")
    if scheduler is not None:
        from sonarsynth.schedule.connecting import check_address

        try:
            check_address(scheduler, insecure)
        except ValueError as error:
            raise BadOption(f"--scheduler: {error}") from None
    return {"frame_timeout": timeout, "worker_memory": None if memory_gb is None else int(memory_gb * 1e9)}
