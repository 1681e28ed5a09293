"""Benchmarks against peers and against the slow exact way, as JSON: `tools/bench frame` and others."""

from __future__ import annotations

import json
import sys
from importlib import import_module

BENCHMARKS = ("frame", "build", "rays", "reflections", "scattering", "laws")
"""Modules beside this one; each has a function `bench`."""


def main() -> int:
    """Run the benchmark that the only argument names."""
    if len(sys.argv) != 2 or sys.argv[1] not in BENCHMARKS:
        print(f"usage: tools/bench {' | '.join(BENCHMARKS)}", file=sys.stderr)
        return 2
    print(json.dumps(import_module(f"benchmarks.{sys.argv[1]}").bench(), indent=2))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
