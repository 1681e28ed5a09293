"""Words and tables of Markdown."""

from __future__ import annotations

from collections.abc import Iterable

MADE = "<!-- Made by tools/pages from the code: change that. -->\n\n"


def cell(text: str) -> str:
    """A text as a cell of a table: one line, no bar of its own, and no tag but in code."""
    parts = " ".join(text.split()).replace("|", "\\|").split("`")
    return "`".join(part if n % 2 else part.replace("<", "&lt;") for n, part in enumerate(parts))


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table of Markdown."""
    head = list(head)
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *(f"| {' | '.join(map(cell, row))} |" for row in rows)])
