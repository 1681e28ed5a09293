"""The plan as people read it: tables of its stages and of what it leaves out, as text and as HTML."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape as escape_html
from typing import TYPE_CHECKING, Final

from sonarsynth.conventions import format_bytes

if TYPE_CHECKING:
    from rich.table import Table

Row = tuple[str, ...]

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


def rows_of(stages: Sequence[Stage], left_out: Sequence[Omission]) -> tuple[list[Row], list[Row]]:
    """The cells of both tables, in the order of `STAGE_COLUMNS` and `OMISSION_COLUMNS`."""
    first: list[Row] = [(s.stage, s.method, s.why, s.error, f"{s.seconds:.2g}", format_bytes(s.bytes)) for s in stages]
    return first, [(o.what, o.why, o.bound) for o in left_out]


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

    first, second = rows_of(stages, left_out)
    tables = [Table(*STAGE_COLUMNS, title=escape(title), title_justify="left")]
    tables += [Table(*OMISSION_COLUMNS)] if second else []
    for table, rows in zip(tables, (first, second), strict=False):
        for row in rows:
            table.add_row(*(escape(cell) for cell in row))
    return tables


def as_html(title: str, stages: Sequence[Stage], left_out: Sequence[Omission], lines: Sequence[str]) -> str:
    """The same as HTML, for notebooks."""
    first, second = rows_of(stages, left_out)
    blocks = [f"<p><b>{escape_html(title)}</b></p>", _html_table(STAGE_COLUMNS, first)]
    blocks += [_html_table(OMISSION_COLUMNS, second)] if second else []
    return "".join([*blocks, *(f"<p>{escape_html(line)}</p>" for line in lines)])


def _html_table(columns: Row, rows: Sequence[Row]) -> str:
    cells = [[f"<th>{escape_html(name)}</th>" for name in columns]]
    cells += [[f"<td style='text-align:left'>{escape_html(cell)}</td>" for cell in row] for row in rows]
    return "<table>" + "".join(f"<tr>{''.join(row)}</tr>" for row in cells) + "</table>"
