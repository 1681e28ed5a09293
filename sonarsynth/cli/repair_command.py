"""`sonarsynth repair STORE`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sonarsynth.cli.options import Insecure, Json, Scheduler, Store, Workers, worker_bounds

if TYPE_CHECKING:
    from sonarsynth.schedule.repairing import RepairReport


def repair(
    store: Store,
    workers: Workers = None,
    scheduler: Scheduler = None,
    force: Annotated[
        bool, typer.Option("--force", help="Repair even if another version built it; reports differences.")
    ] = False,
    files: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Folder of the files that the recipe names; no file outside it is opened."),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only compare files with their digests.")] = False,
    insecure: Insecure = False,
    as_json: Json = False,
) -> None:
    """Rebuild damaged parts of a store from the recipe in it. Files that do not belong there are moved out."""
    from sonarsynth.cli import printing
    from sonarsynth.schedule.repairing import repair as run

    worker_bounds(workers, scheduler, None, None, insecure)
    with printing.progress() as progress:
        report = run(
            store,
            workers=workers,
            scheduler=scheduler,
            force=force,
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
    from sonarsynth.conventions import counted
    from sonarsynth.store import ranges
    from sonarsynth.store.checking.examining import shown

    out = console()
    for name in report.restored:
        out.print(f"restored {name}", markup=False)
    if report.shards:
        out.print(f"rebuilt: {counted(len(report.shards), 'shard')}, frames {ranges(report.frames)}", markup=False)
    for name in report.moved:
        out.print(f"moved out: {shown(name)}", markup=False)
    for failure in report.failures[:10]:
        out.print(f"frame {failure.frame} failed in {failure.stage}: {failure.error}", markup=False)
    for shard in report.differing:
        out.print(f"DIFFERS shard {shard}: the rebuilt data are not those that were first written", markup=False)
    for problem in report.problems[:50]:
        out.print(f"DAMAGE {problem.where}: {problem.what}", markup=False)
    if report.ok:
        repaired = report.restored or report.shards or report.moved
        out.print(f"{report.store}: store is intact" + ("" if repaired else "; nothing to repair"), markup=False)
