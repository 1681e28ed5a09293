"""Waiting for processes: until something happens, however busy the machine; a limit guards against hanging only."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

HANGING: Final = 600.0
"""s: no machine is so busy; what takes longer hangs."""


def wait_until(happened: Callable[[], object], goes_on: Callable[[], object] = lambda: True) -> None:
    """Return when something has happened; fail where `goes_on` says that it never will, or after HANGING."""
    until = time.monotonic() + HANGING
    while not happened():
        assert goes_on(), "it ended before"
        assert time.monotonic() < until, "it hangs"
        time.sleep(0.05)
