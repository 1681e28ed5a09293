"""Faults on purpose: `tools/faults --corrupt 1000` and others. Prints JSON; status 0 where everything went well."""

from __future__ import annotations

import argparse
import json
import sys
from importlib import import_module

KINDS = {
    "kills": "kill builds with SIGKILL, resume, compare",
    "corrupt": "damage files of a store, verify, repair, compare",
    "fuzz": "change recipes and their files, plan them",
    "meshes": "change mesh files, plan with them",
    "casts": "change casts, tracks and recordings, plan with them",
    "arrivals": "change arrivals of Bellhop, compare them with rays",
    "links": "put links into a store, beside it and in front of it",
    "hostile": "forge stores, digests and all, and run every command on them",
    "renames": "move stores while they are built",
}
"""Modules beside this one; each has a function `run(count, seed) -> dict` with "ok" in what it gives."""


def main() -> int:
    """Run the kind of fault that the option names."""
    parser = argparse.ArgumentParser(prog="tools/faults", description="Faults on purpose.")
    for kind, text in KINDS.items():
        parser.add_argument(f"--{kind}", type=int, metavar="N", help=text)
    parser.add_argument("--seed", type=int, default=1, help="of the random faults (1)")
    given = parser.parse_args()
    counts = {kind: getattr(given, kind) for kind in KINDS if getattr(given, kind) is not None}
    if not counts:
        parser.error(f"one of {', '.join(f'--{kind}' for kind in KINDS)} is required")
    if min(counts.values()) < 1 or given.seed < 0:
        parser.error("numbers of faults must be 1 or more, --seed 0 or more")
    found = {kind: import_module(f"fault_injection.{kind}").run(count, given.seed) for kind, count in counts.items()}
    ok = all(summary["ok"] for summary in found.values())
    print(json.dumps(next(iter(found.values())) if len(found) == 1 else {"ok": ok, **found}, indent=2))
    return 0 if ok else 1


if __name__ == "__main__":
    sys.exit(main())
