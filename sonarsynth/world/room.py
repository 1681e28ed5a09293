"""How large a mesh may be: what fits into the memory that is free here."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Final

MAX_FACETS: Final = 20_000_000
"""Facets of a mesh, on any machine."""
BYTES: Final = 600
"""Of memory that a facet takes while a frame is made; measured 550 (`tools/bench memory`)."""


def most_facets() -> int:
    """Facets that a mesh may have here."""
    return int(min(MAX_FACETS, _free() / BYTES))


def _free() -> float:
    """Bytes of memory that this process may still take; infinite where nothing tells."""
    free = [float("inf")]
    with suppress(OSError, ValueError, IndexError):
        lines = Path("/proc/meminfo").read_text().splitlines()
        free += [1024.0 * float(line.split()[1]) for line in lines if line.startswith("MemAvailable:")]
    with suppress(ImportError, OSError, ValueError, IndexError):
        import resource

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY:
            taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
            free.append(float(max(limit - taken, 0)))
    return min(free)
