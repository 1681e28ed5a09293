"""How large a mesh and the signals of a frame may be: what fits into the memory that is free here."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Final

MAX_FACETS: Final = 20_000_000
"""Facets of a mesh, on any machine."""
BYTES: Final = 600
"""Of memory that a facet takes while a frame is made; measured 550 (`tools/bench memory`)."""

SAMPLE_BYTES: Final = 24
"""Of memory that a sample of a hydrophone takes while a frame is made, spectra and copies with it; measured 23 over
3000 to 40 000 samples of 508 hydrophones."""
PROCESS_BYTES: Final = 300e6
"""Of memory that a process takes before it makes a frame; measured 250 MB."""
HELD_BYTES: Final = 8
"""Of memory that a sample of a hydrophone takes in a frame that waits for its next stage; measured 5.4 to 6."""
TOGETHER: Final = 8
"""Frames at most that go through each stage together, so that its code and constants are in the caches for all but the
first."""
TOGETHER_BYTES: Final = 160e6
"""Of memory at most that frames take that go through each stage together."""
SHARD_COPIES: Final = 3
"""Times the bytes of a shard that a process takes to keep its frames and to write them; measured 2.3 to 2.9,
1.2 to 1.5 where most of a shard is room for points that are not there."""


def frame_bytes(facets: int, samples: int, parts: int = 0) -> float:
    """Bytes of memory of a process that makes frames of so many facets, and samples of all hydrophones together; parts:
    of the sound that are kept beside the whole."""
    waiting = (frames_together(samples, parts) - 1) * (HELD_BYTES + 4 * parts)
    return PROCESS_BYTES + BYTES * facets + (SAMPLE_BYTES + 4 * parts + waiting) * samples


def frames_together(samples: int, parts: int = 0) -> int:
    """Frames that go through each stage together; arguments as of `frame_bytes`."""
    return int(min(max(TOGETHER_BYTES / ((HELD_BYTES + 4 * parts) * max(samples, 1)), 1), TOGETHER))


def max_facets() -> int:
    """Facets that a mesh may have here."""
    return int(min(MAX_FACETS, free_bytes() / BYTES))


def free_bytes() -> float:
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
