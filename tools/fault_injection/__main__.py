"""Faults on purpose: `tools/faults --corrupt 1000` and others. Prints JSON; status 0 where everything went well."""

from __future__ import annotations

import argparse
import json
import sys
from importlib import import_module

KINDS = {
    "kills": "kill builds with SIGKILL, resume, compare",
    "corrupt": "damage files of a store, verify, repair, compare",
}
"""Modules beside this one; each has a function `run(count, seed) -> dict` with "ok" in what it gives."""


def main() -> int:
    """Run the kind of fault that the option names."""
    parser = argparse.ArgumentParser(prog="tools/faults", description="Faults on purpose.")
    chosen = parser.add_mutually_exclusive_group(required=True)
    for kind, text in KINDS.items():
        chosen.add_argument(f"--{kind}", type=int, metavar="N", help=text)
    parser.add_argument("--seed", type=int, default=1, help="of the random faults (1)")
    given = parser.parse_args()
    kind = next(kind for kind in KINDS if getattr(given, kind) is not None)
    count = getattr(given, kind)
    if count < 1 or given.seed < 0:
        parser.error(f"--{kind} must be 1 or more, --seed 0 or more")
    summary = import_module(f"fault_injection.{kind}").run(count, given.seed)
    print(json.dumps(summary, indent=2))
    return 0 if summary["ok"] else 1


if __name__ == "__main__":
    sys.exit(main())
