"""The command `accuracy`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from sonarsynth.cli.options import Json, Settings, check_folder, outside_stores
from sonarsynth.cli.running import BadOption

if TYPE_CHECKING:
    from sonarsynth.validation import Row

HELP = (
    "What to check: rays (the search for eigenrays); sphere, cylinder or plate (echoes computed with flat facets, "
    "against exact series and integrals); bubble (the collapse that makes a snap)."
)


def accuracy(
    recipe: Annotated[
        Path | None,
        typer.Argument(
            help="A recipe: each setting is varied around the planner's choice, all others exact.", show_default=False
        ),
    ] = None,
    *,
    reference: Annotated[str | None, typer.Option(metavar="NAME", help=HELP, show_default="rays")] = None,
    extremes: Annotated[
        bool, typer.Option("--extremes", help="Run stiff and extreme cases of every stage instead.")
    ] = False,
    settings: Settings = [],  # noqa: B006 - typer copies it
    frames: Annotated[
        str | None,
        typer.Option(
            metavar="LIST", help="Frames of the recipe, such as 21,42 (default: at 1/3 and 2/3 of the recipe)."
        ),
    ] = None,
    hydrophones: Annotated[
        str | None,
        typer.Option(metavar="all|N", help="Hydrophones computed exactly (default: 4 to 24, fewer if slow)."),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Redraw the random frames with this seed; keep the planner's choices.")
    ] = None,
    peers: Annotated[
        bool, typer.Option(help="Also run other programs for comparison: the thesis's loop, FINUFFT, Acoular.")
    ] = True,
    out: Annotated[
        Path, typer.Option(callback=outside_stores, metavar="FOLDER", help="Where to write the table and the picture.")
    ] = Path("accuracy"),
    as_json: Json = False,
) -> None:
    """Measure errors against slow, exact computations, and run times; exits 1 if any error exceeds its bound.

    For a recipe, for a reference, or for stiff and extreme cases.
    """
    from sonarsynth.validation import REFERENCES
    from sonarsynth.validation.report import as_json as for_programs
    from sonarsynth.validation.report import write

    check_folder(out)
    _check(recipe, reference, extremes, settings or [o for o in (frames, hydrophones, seed) if o is not None])
    if recipe is not None:
        from sonarsynth.cli.accuracy_tables.frontier_table import recipe_table

        return recipe_table(recipe, settings, frames, hydrophones, seed, out, peers=peers, as_json=as_json)
    if extremes:
        from sonarsynth.cli.accuracy_tables.extremes_table import extremes_table

        return extremes_table(out, as_json=as_json)
    reference = reference or "rays"
    if reference not in REFERENCES:
        raise BadOption(f"--reference {reference} is not one of {', '.join(REFERENCES)}")
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


def _check(recipe: Path | None, reference: str | None, extremes: bool, of_recipe: list[Any]) -> None:
    """Raise BadOption for more than one thing to measure."""
    if extremes and reference is not None:
        raise BadOption("--extremes checks every stage: do not give --reference as well")
    if recipe is not None and (extremes or reference is not None):
        raise BadOption("give only one of: a recipe, --reference, --extremes")
    if recipe is None and of_recipe:
        raise BadOption("--set, --frames, --hydrophones and --seed need a recipe")


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
        numbers = (f"{row.bound:.2g}", f"{row.error:.2g}", f"{row.cost:.3g} {row.cost_unit}")
        counts = (str(row.counts.get(name, "")) for name in counted)
        verdict = ("ok" if row.ok else "FAILED") + (f" ({notes.index(row.note) + 1})" if row.note else "")
        table.add_row(case, against, row.quantity, row.unit, *numbers, *counts, verdict)
    console().print(table)
    for number, note in enumerate(notes, 1):
        console().print(f"({number}) {note}")
    failed = sum(not row.ok for row in rows)
    console().print(f"{len(rows)} rows, {failed} failed" if failed else f"{len(rows)} rows, all within their bounds")
