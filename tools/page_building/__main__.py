"""`tools/pages`."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from tools.page_building import ROOT, generated
from tools.page_building.pictures import DRAWN, QUICK, draw
from tools.page_building.site import build


def main() -> int:
    """Exit status 0 where the pages were written and built without a warning."""
    parser = argparse.ArgumentParser(prog="tools/pages", description=__doc__)
    parser.add_argument("--out", type=Path, help="write the site to this folder")
    parser.add_argument(
        "--check", action="store_true", help="write nothing: fail where what is generated is not of now"
    )
    parser.add_argument(
        "--pictures",
        nargs="*",
        choices=list(DRAWN),
        metavar="NAME",
        help=f"draw pictures again first: {', '.join(DRAWN)}; without names those that are quick: {', '.join(QUICK)}",
    )
    options = parser.parse_args()
    if options.pictures is not None:
        draw(options.pictures or QUICK)
    old = [file for file, text in generated().items() if not file.is_file() or file.read_text() != text]
    for file in old:
        print(f"pages: {'run tools/pages to write' if options.check else 'wrote'} {file.relative_to(ROOT)}")
        if not options.check:
            file.write_text(generated()[file])
    with tempfile.TemporaryDirectory() as folder:
        status = build(options.out or Path(folder))
    return status or int(options.check and bool(old))


if __name__ == "__main__":
    sys.exit(main())
