"""`sonarsynth repair STORE`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sonarsynth.cli.running import BadOption
from sonarsynth.cli.worker_options import worker_bounds

if TYPE_CHECKING:
    from sonarsynth.schedule.repairing import RepairReport


def repair(
    store: Annotated[str, typer.Argument(help="The store, a Zarr folder or its URL.", show_default=False)],
    workers: Annotated[
        int | None, typer.Option(min=0, help="Worker processes; 0: none, in this process. Left out: one a core.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A running Dask scheduler, such as tcp://127.0.0.1:8786.")
    ] = None,
    anyway: Annotated[
        bool, typer.Option("--anyway", help="Though another version of sonarsynth built it: says if numbers differ.")
    ] = False,
    files: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Where files that the recipe names are; none is opened outside of it."),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Compare files with their digests; do not read every number back.")
    ] = False,
    insecure: Annotated[
        bool, typer.Option("--insecure", help="Use a scheduler on another machine without TLS.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the answer as JSON.")] = False,
) -> None:
    """Make what is damaged in a store again, from the recipe in it. What does not belong there moves out."""
    from sonarsynth.cli import printing
    from sonarsynth.schedule.repairing import repair as run

    if scheduler is not None and workers is not None:
        raise BadOption("--workers is for worker processes of our own, --scheduler for those of another: give one")
    worker_bounds(workers, scheduler, None, None, insecure)
    with printing.progress() as progress:
        report = run(
            store,
            workers=workers,
            scheduler=scheduler,
            anyway=anyway,
            quick=quick,
            insecure=insecure,
            files=files,
            progress=progress,
        )
    if as_json:
        typer.echo(json.dumps(report.as_json(), indent=2))
    else:
        _print(report)
    if report.problems or report.differing:
        raise typer.Exit(4)
    if report.failures:
        raise typer.Exit(3)


def _print(report: RepairReport) -> None:
    from sonarsynth.cli.printing import console
    from sonarsynth.store import ranges
    from sonarsynth.store.checking.examining import shown

    out = console()
    for name in report.restored:
        out.print(f"restored {name}", markup=False)
    if report.shards:
        out.print(f"made again: {len(report.shards)} shards, frames {ranges(report.frames)}", markup=False)
    for name in report.moved:
        out.print(f"moved out: {shown(name)}", markup=False)
    for failure in report.failures[:10]:
        out.print(f"frame {failure.frame} set aside in {failure.stage}: {failure.error}", markup=False)
    for shard in report.differing:
        out.print(f"DIFFERS shard {shard}: its numbers are not those that were written", markup=False)
    for problem in report.problems[:50]:
        out.print(f"DAMAGE {problem.where}: {problem.what}", markup=False)
    if report.ok:
        made = report.restored or report.shards or report.moved
        out.print(f"{report.store}: whole and as written" + ("" if made else "; nothing to repair"), markup=False)
