"""Benchmarks against peers and against the slow exact way, as JSON or a table: `tools/bench build` and others."""

from __future__ import annotations

import json
import sys
from importlib import import_module

BENCHMARKS = (
    "build",
    "scheduling",
    "reading",
    "laws",
    "memory",
    "cloud",
    "odds",
    "reef",
    "soundscape",
    "growth",
    "ablation",
)
"""Modules beside this one; each has a function `bench`."""


def main() -> int:
    """Run the benchmark that the first argument names; JSON, or its table where it has one and `--json` is not said."""
    name, options = (sys.argv[1], sys.argv[2:]) if len(sys.argv) > 1 else ("", [])
    settings: dict[str, int] = {}
    if name == "odds" and options[:1] == ["--windows"] and "".join(options[1:2]).isdigit():
        settings, options = {"windows": int(options[1])}, options[2:]
    if name not in BENCHMARKS or options not in ([], ["--json"]):
        print(f"usage: tools/bench {' | '.join(BENCHMARKS)} [--json]; odds: [--windows N]", file=sys.stderr)
        return 2
    module = import_module(f"benchmarks.{name}")
    result = module.bench(**settings)
    readable = hasattr(module, "table") and not options
    print(module.table(result) if readable else json.dumps(result, indent=2))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
