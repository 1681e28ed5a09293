"""The command `accuracy`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from sonarsynth.cli.running import BadOption

if TYPE_CHECKING:
    from sonarsynth.accuracy import Row


def accuracy(
    reference: Annotated[
        str, typer.Option(metavar="NAME", help="What is checked: rays, the search for eigenrays.")
    ] = "rays",
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where rows and picture go.")] = Path("accuracy"),
    as_json: Annotated[bool, typer.Option("--json", help="Print the rows as JSON.")] = False,
) -> None:
    """Measure errors against independent, slow and exact computations, and run times; exit status 1 if one is off."""
    from sonarsynth.accuracy import REFERENCES
    from sonarsynth.accuracy.report import as_json as for_programs
    from sonarsynth.accuracy.report import write

    if reference not in REFERENCES:
        raise BadOption(f"--reference {reference} is none of {', '.join(REFERENCES)}")
    try:
        rows = REFERENCES[reference](False)
    except ModuleNotFoundError as error:
        raise BadOption(str(error)) from None
    files = write(rows, out, reference)
    if as_json:
        typer.echo(json.dumps(for_programs(rows), indent=2))
    else:
        _table(rows)
        for file in files:
            typer.echo(str(file))
    if not all(row.ok for row in rows):
        raise typer.Exit(1)


def _table(rows: list[Row]) -> None:
    """One line a row; case and reference where they change."""
    from sonarsynth.cli.printing import console

    right = ("allowed", "error", "us a ray", "pairs", "rays")
    table = Table("case", "against", "quantity", "unit")
    for name in right:
        table.add_column(name, justify="right")
    table.add_column("")
    before = ("", "")
    for row in rows:
        named = (row.case, row.reference)
        if named[0] != before[0]:
            table.add_section()
        case, against = ("" if a == b else a for a, b in zip(named, before, strict=True))
        before = named
        numbers = (f"{row.expected:.2g}", f"{row.got:.2g}", f"{row.microseconds:.3g}", str(row.pairs), str(row.rays))
        table.add_row(case, against, row.quantity, row.unit, *numbers, "ok" if row.ok else "FAILED")
    console().print(table)
    failed = sum(not row.ok for row in rows)
    console().print(f"{len(rows)} rows, {failed} failed" if failed else f"{len(rows)} rows, all within their bounds")
