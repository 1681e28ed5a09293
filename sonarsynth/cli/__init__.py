"""The command line. Thin: every command is a call that Python users have too.

Exit status: 0 done, 1 our fault, 2 bad input, 3 finished, but some frames failed, 4 store damaged or locked,
130 interrupted and resumable. Errors are one line on stderr.
"""

from __future__ import annotations

import json
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from sonarsynth.cli.accuracy_command import accuracy
from sonarsynth.cli.authoring.init_command import init
from sonarsynth.cli.authoring.notebooks_command import notebooks
from sonarsynth.cli.authoring.preview_command import preview
from sonarsynth.cli.export_command import export
from sonarsynth.cli.options import (
    Insecure,
    Json,
    RecipeFile,
    Scheduler,
    Settings,
    Store,
    Workers,
    outside_stores,
    worker_bounds,
)
from sonarsynth.cli.rays_command import rays
from sonarsynth.cli.repair_command import repair
from sonarsynth.cli.running import run
from sonarsynth.cli.selecting import chosen_frames, product_names
from sonarsynth.cli.soundscape_command import soundscape
from sonarsynth.cli.store_commands import card, detect, evaluate, report
from sonarsynth.cli.target_strength_command import target_strength

if TYPE_CHECKING:
    from xarray import DataTree

    from sonarsynth.evaluation import Check

__all__ = ["app", "main"]

app = typer.Typer(
    name="sonarsynth",
    help="Labelled synthetic datasets of passive sonar with snapping shrimp as the sound source.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

Products = Annotated[
    str,
    typer.Option(
        metavar="LIST", help="Stored besides truth: signals, image, cloud, beams, range_image, paths; 'truth': no more."
    ),
]
Scale = Literal["common", "frame"]
ALL_PRODUCTS = "signals,image,cloud"


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit with its status."""
    raise SystemExit(run(app, arguments))


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"sonarsynth {version('sonarsynth')}")
        raise typer.Exit


@app.callback()
def _options(
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Labelled synthetic datasets of passive sonar with snapping shrimp as the sound source."""


@app.command()
def build(
    recipe: RecipeFile,
    store: Annotated[str, typer.Argument(help="Where to write the dataset: a folder or a URL.", show_default=False)],
    settings: Settings = [],  # noqa: B006 - typer copies it
    *,
    frames: Annotated[
        str | None, typer.Option(metavar="A:B", help="Only these frames, such as 0:8 or 0:8,12 (end excluded).")
    ] = None,
    sequences: Annotated[
        str | None,
        typer.Option(metavar="A:B", help="Only these sequences, such as 0:10; with --frames, their overlap."),
    ] = None,
    products: Products = ALL_PRODUCTS,
    workers: Workers = None,
    scheduler: Scheduler = None,
    restart: Annotated[
        bool, typer.Option("--restart", help="Overwrite a store built from a different recipe.")
    ] = False,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Retry frames that failed in an earlier build.")
    ] = False,
    frame_timeout: Annotated[
        float | None,
        typer.Option(min=0, metavar="SECONDS", help="Skip a frame if one stage takes longer (0: no limit)."),
    ] = None,
    worker_memory: Annotated[
        float | None, typer.Option(metavar="GB", help="Memory per worker. Default: an equal share of the machine's.")
    ] = None,
    agreed: Annotated[
        bool, typer.Option("--yes", help="Build even if it needs more than is free (disk, memory), or over 1 TB.")
    ] = False,
    insecure: Insecure = False,
    mixed_versions: Annotated[
        bool,
        typer.Option("--mixed-versions", help="Resume with other versions of numeric libraries; mark those frames."),
    ] = False,
    dashboard: Annotated[
        bool, typer.Option("--dashboard", help="Start Dask's dashboard; all users of this machine can read it.")
    ] = False,
    predicting: Annotated[
        bool | None,
        typer.Option("--predict/--no-predict", help="Predict time and size first. Default: of what takes over 5 s."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Build a dataset, or the part of it that is missing. Run the same command again to resume."""
    from sonarsynth import compiling_ahead, evaluation, planning, schedule
    from sonarsynth import store as stores
    from sonarsynth.cli import printing
    from sonarsynth.recipe import reading

    bounds = worker_bounds(workers, scheduler, frame_timeout, worker_memory, insecure)
    chosen = product_names(products)
    source = reading.read(recipe, settings)
    made_from = reading.recipe_of(source)
    some = frames is not None or sequences is not None
    with reading.locating(source):
        wanted = chosen_frames(frames, sequences, made_from.spanned.first_frames.tolist()) if some else None
    stores.try_writing(stores.folder_of(store))
    compiling_ahead.use_other_cores()
    with reading.locating(source), printing.planning():
        plan = planning.plan(made_from, chosen)
    prediction, predicting = None, not schedule.brief(plan, wanted) if predicting is None else predicting
    if predicting and scheduler is None and (restart or stores.missing(store, plan, wanted)):
        with printing.planning("timing frames"):
            prediction = schedule.predict(plan)
    with printing.progress() as progress:
        report = schedule.build(
            plan, store, frames=wanted, workers=workers, scheduler=scheduler, restart=restart,
            retry_failed=retry_failed, agreed=agreed, insecure=insecure, mixed_versions=mixed_versions,
            dashboard=dashboard, progress=progress, announce=printing.announce, **bounds,
            prediction=prediction, source=source,
        )  # fmt: skip
    report.warnings = tuple(evaluation.warnings(store))
    if as_json:
        _print_json(report.as_json())
    else:
        printing.build_report(report)
    if not report.ok:
        raise typer.Exit(3)


@app.command()
def plan(recipe: RecipeFile, settings: Settings = [], products: Products = ALL_PRODUCTS, as_json: Json = False) -> None:  # noqa: B006
    """Show what each stage will do and why, what is left out, the error bounds, and the predicted time and size.

    For one worker per core. Estimated by timing a few frames on this machine.
    """
    from sonarsynth import compiling_ahead, planning, schedule
    from sonarsynth.cli import printing
    from sonarsynth.recipe import reading

    chosen = product_names(products)
    compiling_ahead.use_other_cores()
    with reading.opened(recipe, settings) as made_from, printing.planning():
        planned = planning.plan(made_from, chosen)
    with printing.planning("timing frames"):
        prediction = schedule.predict(planned)
    planned = prediction.tried(planned)
    if as_json:
        _print_json({**planned.as_json(), **prediction.as_json()})
    else:
        printing.plan_report(planned, prediction)


@app.command()
def verify(
    store: Store,
    quick: Annotated[bool, typer.Option("--quick", help="Only compare files with their digests.")] = False,
    as_json: Json = False,
) -> None:
    """Check a store: compare all files with their digests, re-read all data, check it against the ground truth."""
    from sonarsynth import store as stores
    from sonarsynth.cli import printing

    def check(tree: DataTree) -> list[Check]:
        from sonarsynth import evaluation  # half a second, which --quick does not need

        reading.close()
        with printing.planning("checking truth against data"):
            return evaluation.check(tree)

    with ExitStack() as reading:
        progress = reading.enter_context(printing.progress("comparing files"))
        report = stores.verify(store, [check], quick=quick, progress=progress)
    if as_json:
        _print_json(report.as_json())
    else:
        printing.verify_report(report)
    if not report.ok:
        raise typer.Exit(4)


@app.command()
def show(
    stores: Annotated[
        list[str], typer.Argument(metavar="STORE...", help="One store, or up to four to compare.", show_default=False)
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            callback=outside_stores, metavar="FOLDER", help="Where to. Default: <store>.pictures, <a>-<b>.pictures."
        ),
    ] = None,
    frame: Annotated[
        int | None, typer.Option(min=0, help="The frame of the sheet. Default: the frame with most points.")
    ] = None,
    film: Annotated[bool, typer.Option(help="Also write the film.")] = True,
    scale: Annotated[Scale, typer.Option(help="0 dB: the brightest beam of all frames, or of each.")] = "common",
) -> None:
    """Draw a store: a film of the energy image, a sheet with image, point cloud and signals; print a summary.

    With several stores: films side by side, each with its range error, levels and cost.
    """
    from sonarsynth.cli import printing

    with printing.progress("reading") as drawn:
        more: Any = {"frame": frame, "film": film, "scale": scale, "say": typer.echo, "progress": drawn}
        if len(stores) == 1:
            from sonarsynth.pictures import show as draw

            files = draw(stores[0], out, **more)
        else:
            from sonarsynth.pictures.compare import show_beside

            files = show_beside(stores, out, **more)
    for file in files:
        typer.echo(str(file))


for command in (accuracy, card, detect, evaluate, export, init, notebooks, preview, rays, repair, report, soundscape):
    app.command()(command)
app.command("target-strength")(target_strength)


@app.command()
def snap(
    recipe: RecipeFile,
    out: Annotated[
        Path, typer.Option(callback=outside_stores, metavar="FILE", help="Where to write the picture.")
    ] = Path("snap.png"),
    compare: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A recording (WAV, CSV, HDF5) of a snap to compare the model with."),
    ] = None,
    settings: Settings = [],  # noqa: B006
) -> None:
    """Draw the snap of a recipe before and after the sonar's filter: waveform, spectrum, level, width and bandwidth."""
    from sonarsynth.pictures import snap_pictures
    from sonarsynth.recipe import reading

    with reading.opened(recipe, settings) as made_from:
        file, comparison = snap_pictures.draw_snap(made_from, out, compare)
    if comparison is not None:
        typer.echo(comparison.summary())
    typer.echo(str(file))


@app.command()
def schema() -> None:
    """Print the JSON schema of recipes, for text editors."""
    from sonarsynth.recipe import reading

    _print_json(reading.schema())


def _print_json(value: Any) -> None:
    typer.echo(json.dumps(value, indent=2))
