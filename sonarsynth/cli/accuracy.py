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

HELP = (
    "What is checked: rays, the search for eigenrays; sphere, cylinder or plate, their echoes by flat facets; "
    "bubble, the collapse that a snap comes from."
)


def accuracy(
    reference: Annotated[str | None, typer.Option(metavar="NAME", help=HELP, show_default="rays")] = None,
    extremes: Annotated[
        bool, typer.Option("--extremes", help="Stiff and extreme cases of every stage instead.")
    ] = False,
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where rows and picture go.")] = Path("accuracy"),
    as_json: Annotated[bool, typer.Option("--json", help="Print the rows as JSON.")] = False,
) -> None:
    """Measure errors against independent, slow and exact computations, and run times; exit status 1 if one is off."""
    from sonarsynth.accuracy import REFERENCES
    from sonarsynth.accuracy.report import as_json as for_programs
    from sonarsynth.accuracy.report import write

    if extremes:
        from sonarsynth.cli.extremes import extremes_table

        if reference is not None:
            raise BadOption("--extremes goes without --reference: it checks every stage")
        return extremes_table(out, as_json=as_json)
    reference = reference or "rays"
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
    """One line a row; case and reference where they change; notes below."""
    from sonarsynth.cli.printing import console

    counted = list(dict.fromkeys(name for row in rows for name in row.counts))
    table = Table()
    for name, least in (("case", 18), ("against", 12), ("quantity", 14), ("unit", 4)):
        table.add_column(name, min_width=least)
    for name in ("allowed", "error", "cost", *counted):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    before = ("", "")
    notes = list(dict.fromkeys(row.note for row in rows if row.note))
    for row in rows:
        named = (row.case, row.reference)
        if named[0] != before[0]:
            table.add_section()
        case, against = ("" if a == b else a for a, b in zip(named, before, strict=True))
        before = named
        numbers = (f"{row.expected:.2g}", f"{row.got:.2g}", f"{row.cost:.3g} {row.cost_unit}")
        counts = (str(row.counts.get(name, "")) for name in counted)
        verdict = ("ok" if row.ok else "FAILED") + (f" ({notes.index(row.note) + 1})" if row.note else "")
        table.add_row(case, against, row.quantity, row.unit, *numbers, *counts, verdict)
    console().print(table)
    for number, note in enumerate(notes, 1):
        console().print(f"({number}) {note}")
    failed = sum(not row.ok for row in rows)
    console().print(f"{len(rows)} rows, {failed} failed" if failed else f"{len(rows)} rows, all within their bounds")
