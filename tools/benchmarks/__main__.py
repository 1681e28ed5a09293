"""Benchmarks against peers and against the slow exact way, as JSON or a table: `tools/bench build` and others.

With `--page` the table also replaces the one under the mark `<!-- tools/bench NAME -->` of a page in `tools/docs`.
"""

from __future__ import annotations

import json
import sys
from importlib import import_module
from pathlib import Path

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
    "detectors",
    "images",
)
"""Modules beside this one; each has a function `bench`."""

DOCS = Path(__file__).resolve().parents[1] / "docs"


def write_to_page(name: str, table: str) -> None:
    """Put the first paragraph of the table under the mark of the benchmark, in place of the one that stands there."""
    mark = f"<!-- tools/bench {name} -->\n\n"
    (page,) = (page for page in sorted(DOCS.rglob("*.md")) if mark in page.read_text())
    before, _, old = page.read_text().partition(mark)
    page.write_text(before + mark + table.partition("\n\n")[0] + "\n\n" + old.partition("\n\n")[2])


def main() -> int:
    """Run the benchmark that the first argument names; JSON, or its table where it has one and `--json` is not said."""
    name, options = (sys.argv[1], sys.argv[2:]) if len(sys.argv) > 1 else ("", [])
    settings: dict[str, int] = {}
    if name == "odds" and options[:1] == ["--windows"] and "".join(options[1:2]).isdigit():
        settings, options = {"windows": int(options[1])}, options[2:]
    if name not in BENCHMARKS or options not in ([], ["--json"], ["--page"]):
        print(f"usage: tools/bench {' | '.join(BENCHMARKS)} [--json | --page]; odds: [--windows N]", file=sys.stderr)
        return 2
    module = import_module(f"benchmarks.{name}")
    result = module.bench(**settings)
    if options == ["--page"]:
        write_to_page(name, module.table(result))
    readable = hasattr(module, "table") and options != ["--json"]
    print(module.table(result) if readable else json.dumps(result, indent=2))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
