"""Arguments and options that several commands have, and what cannot be of those about workers."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from sonarsynth.cli.running import BadOption

RecipeFile = Annotated[Path, typer.Argument(help="The recipe, a YAML file.", show_default=False)]
Store = Annotated[str, typer.Argument(help="The store, a Zarr folder or its URL.", show_default=False)]
Settings = Annotated[
    list[str],
    typer.Option(
        "--set",
        metavar="PATH=VALUE",
        help="Override a field of the recipe, such as scene.trajectory.frames=8. Repeatable.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
Split = Annotated[str | None, typer.Option(metavar="NAME", help="Only these frames: train, validation or test.")]
Workers = Annotated[
    int | None,
    typer.Option(
        min=0, help="Worker processes (default: one per core, none for a short build; 0 runs in this process)."
    ),
]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="A running Dask scheduler, such as tcp://127.0.0.1:8786.")
]
Insecure = Annotated[bool, typer.Option("--insecure", help="Allow an unencrypted connection to a remote scheduler.")]

LEAST_GB, MOST_GB = 0.3, 1e6


def worker_bounds(
    workers: int | None, scheduler: str | None, timeout: float | None, memory_gb: float | None, insecure: bool
) -> dict[str, Any]:
    """Arguments of schedule.build. Raises BadOption for what cannot be."""
    if scheduler is not None and workers is not None:
        raise BadOption("--workers starts processes on this machine, --scheduler uses a running cluster: give only one")
    if timeout is not None:
        if not math.isfinite(timeout):
            raise BadOption(f"--frame-timeout {timeout} is not a number of seconds")
        if workers == 0:
            raise BadOption("--frame-timeout works only with worker processes: use --workers 1 or more")
    if memory_gb is not None:
        if workers == 0 or scheduler is not None:
            raise BadOption(
                "--worker-memory applies only to processes on this machine: use it with --workers 1 or more"
            )
        if not LEAST_GB <= memory_gb <= MOST_GB:
            raise BadOption(f"--worker-memory: must be from {LEAST_GB} to {MOST_GB:g} GB, not {memory_gb}")
    if scheduler is not None:
        from sonarsynth.schedule.connecting import check_address

        try:
            check_address(scheduler, insecure)
        except ValueError as error:
            raise BadOption(f"--scheduler: {error}") from None
    return {"frame_timeout": timeout, "worker_memory": None if memory_gb is None else int(memory_gb * 1e9)}


def outside_stores(out: Any) -> Any:
    """Where to write, as it is given. Raises BadOption for a place in a store, which takes no other files."""
    from sonarsynth.store import store_around

    if out is not None and (around := store_around(str(out) + "/_")) is not None:  # itself a store, or in one
        raise BadOption(f"--out: {out} is in the store {around}, which takes no other files: choose another place")
    return out


def check_folder(out: Path | None) -> None:
    """Raise BadOption where --out, a folder that is to be written, is a file or in one: before anything is computed."""
    for place in () if out is None else (out, *out.parents):
        if place.exists():
            if not place.is_dir():
                raise BadOption(f"--out: {place} is a file, and a folder is needed")
            return
