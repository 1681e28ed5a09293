"""Benchmarks against peers and against the slow exact way, as JSON: `tools/bench frame`, `tools/bench build`."""

from __future__ import annotations

import json
import sys


def main() -> int:
    """Run the benchmark that the first argument names."""
    name = sys.argv[1] if len(sys.argv) > 1 else ""
    if name == "frame":
        from benchmarks.frame import bench as run
    elif name == "build":
        from benchmarks.build import bench as run  # type: ignore[assignment]
    else:
        print("usage: tools/bench frame | build", file=sys.stderr)
        return 2
    print(json.dumps(run(), indent=2))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
