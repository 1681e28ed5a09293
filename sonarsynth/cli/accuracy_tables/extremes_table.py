"""The table of `accuracy --extremes`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.table import Table

from sonarsynth.cli.printing import console, overwrite
from sonarsynth.store.files.place import write_atomically
from sonarsynth.validation.extremes import extremes, groups

if TYPE_CHECKING:
    from sonarsynth.validation.extremes import Extreme


def extremes_table(out: Path, *, as_json: bool) -> None:
    """Run every case, write <out>/extremes.json and print the table; raises typer.Exit(1) where one is not right."""
    total, rows = sum(len(cases) for cases in groups().values()), []
    for row in extremes():
        rows.append(row)
        overwrite(f"{len(rows)} of {total} cases: {row.case}")
    overwrite("")
    text = json.dumps([row.as_json() for row in rows], indent=2)
    out.mkdir(parents=True, exist_ok=True)
    file = out / "extremes.json"
    write_atomically(file, f"{text}\n".encode())
    if as_json:
        typer.echo(text)
    else:
        _show(rows)
        typer.echo(str(file))
    if not all(row.ok for row in rows):
        raise typer.Exit(1)


def _show(rows: list[Extreme]) -> None:
    """A section a group, and how many are right."""
    table = Table("case", "expected", "result", title="stiff and extreme cases", title_justify="left")
    table.add_column("s", justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    group = ""
    for row in rows:
        if row.group != group:
            table.add_section()
            group = row.group
        table.add_row(row.case, row.expected, row.got, f"{row.seconds:.2g}", "ok" if row.ok else "FAILED")
    console().print(table, markup=False)
    failed = sum(not row.ok for row in rows)
    seconds = sum(row.seconds for row in rows)
    verdict = f"{failed} failed" if failed else "all passed, none skipped"
    console().print(f"{len(rows)} cases in {seconds:.3g} s of one core, {verdict}")
