"""Which code makes the numbers: one digest of every source file of the package that a stored number depends on."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path
from typing import Final

APART: Final = (
    "frontiers",
    "cli",
    "evaluation",
    "pictures",
    "schedule",
    "store/cards",
    "validation",
    "__main__.py",
    "__init__.py",
)
"""Parts of the package that change no stored number."""


@cache
def code_digest() -> str:
    """SHA-256 of the sources, with their paths within the package."""
    package = Path(__file__).resolve().parent.parent
    digest = hashlib.sha256()
    for file in sorted(package.rglob("*.py")):
        inside = file.relative_to(package).as_posix()
        if not any(inside == folder or inside.startswith(f"{folder}/") for folder in APART):
            digest.update(f"{inside}\n".encode() + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()
