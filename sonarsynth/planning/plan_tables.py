"""The plan as people read it: tables of its stages and of what it leaves out."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sonarsynth.conventions import format_bytes

if TYPE_CHECKING:
    from rich.table import Table

WIDTH: Final = 140
"""Columns where there is no terminal."""


@dataclass(frozen=True)
class Stage:
    """One line of the plan."""

    stage: str
    method: str
    why: str
    error: str
    seconds: float  # predicted, one core, one frame
    bytes: int  # in the store, one frame


@dataclass(frozen=True)
class Omission:
    """Something that this scene does not need, and the bound on what leaving it out costs."""

    what: str
    why: str
    bound: str


STAGE_COLUMNS = ("stage", "method", "why", "error", "CPU s per frame", "size per frame")
OMISSION_COLUMNS = ("left out", "why", "error bound")


def as_text(title: str, stages: Sequence[Stage], left_out: Sequence[Omission], lines: Sequence[str]) -> str:
    """Both tables and the lines below them, for a terminal of `WIDTH` columns."""
    from rich.console import Console

    out = Console(width=WIDTH, highlight=False, record=True, file=io.StringIO())
    for table in as_tables(title, stages, left_out):
        out.print(table)
    for line in lines:
        out.print(line, markup=False)
    return out.export_text().rstrip("\n")


def as_tables(title: str, stages: Sequence[Stage], left_out: Sequence[Omission]) -> list[Table]:
    """Tables of rich: the stages, and what is left out where anything is."""
    from rich.markup import escape
    from rich.table import Table

    done, omitted = Table(*STAGE_COLUMNS, title=escape(title), title_justify="left"), Table(*OMISSION_COLUMNS)
    for s in stages:
        cells = (s.stage, s.method, s.why, s.error, f"{s.seconds:.2g}", format_bytes(s.bytes))
        done.add_row(*map(escape, cells))
    for o in left_out:
        omitted.add_row(*map(escape, (o.what, o.why, o.bound)))
    return [done, omitted] if left_out else [done]
