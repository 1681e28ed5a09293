"""The site of the pages, by MkDocs: a warning, such as a link that leads nowhere, is a failure."""

from __future__ import annotations

import logging
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "tools" / "docs"
TAKING_PART = {"CONTRIBUTING.md": "contributing.md", "SECURITY.md": "security.md"}
"""Pages that live in `.github`, where they are looked for, with their names on the site."""


def build(out: Path) -> int:
    """Build the site into a folder; exit status 0 where that went without a warning."""
    from mkdocs.commands.build import build as build_site
    from mkdocs.config import load_config
    from mkdocs.exceptions import Abort, ConfigurationError

    said = logging.StreamHandler()
    said.setLevel(logging.WARNING)
    logging.getLogger("mkdocs").addHandler(said)
    with tempfile.TemporaryDirectory() as folder:
        pages = Path(folder) / "pages"
        lay_out(pages)
        text = (DOCS / "mkdocs.yml").read_text().replace("[PACKAGE]", f"[{ROOT}]")
        (Path(folder) / "mkdocs.yml").write_text(text)
        config = load_config(str(Path(folder) / "mkdocs.yml"), docs_dir=str(pages), site_dir=str(out.resolve()))
        config.plugins.on_startup(command="build", dirty=False)
        try:
            build_site(config)
        except (Abort, ConfigurationError) as problem:
            print(f"pages: {problem}", file=sys.stderr)
            return 1
        finally:
            config.plugins.on_shutdown()
    return 0


def lay_out(pages: Path) -> None:
    """Put pages and pictures where MkDocs takes them from, with links that hold there."""
    for file in DOCS.rglob("*.md"):
        lay(file, pages / file.relative_to(DOCS), pages)
    for name, page in TAKING_PART.items():
        lay(ROOT / ".github" / name, pages / page, pages)
    (pages / "pictures").mkdir()
    for picture in (ROOT / ".github").glob("*.png"):
        shutil.copy(picture, pages / "pictures" / picture.name)


def lay(file: Path, page: Path, pages: Path) -> None:
    """Write a page; links to what lies elsewhere in the repository lead to where that is on the site."""

    def there(found: re.Match[str]) -> str:
        before, link, anchor, after = found.groups(default="")
        target = (file.parent / link).resolve()
        if target.is_relative_to(DOCS):
            place = pages / target.relative_to(DOCS)
        elif target.suffix == ".png":
            place = pages / "pictures" / target.name
        else:
            place = pages / TAKING_PART.get(target.name, target.name)
        return f"{before}{os.path.relpath(place, page.parent)}{anchor}{after}"

    text = re.sub(r"(\]\()([\w./-]+)(#[\w-]+)?(\))", there, file.read_text().replace("](#", "](\0"))
    text = re.sub(r"(^\[\w+\]: )([\w./-]+)()($)", there, text, flags=re.MULTILINE).replace("\0", "#")
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(text)
