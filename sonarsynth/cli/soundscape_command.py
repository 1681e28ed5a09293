"""The command `soundscape`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from sonarsynth.cli.options import Json, Settings, outside_stores
from sonarsynth.cli.running import BadOption

LONGEST = 120.0
"""s: of sound that is made, at most."""


def soundscape(
    source: Annotated[
        str, typer.Argument(metavar="RECIPE|STORE", help="A recipe (YAML), or a store.", show_default=False)
    ],
    *,
    out: Annotated[
        Path, typer.Option(callback=outside_stores, metavar="FILE", help="Where to write the picture.")
    ] = Path("soundscape.png"),
    seconds: Annotated[float, typer.Option(metavar="S", help="Of a recipe's sound that is made.")] = 2.0,
    compare: Annotated[
        Path | None, typer.Option(metavar="FILE", help="A recording of the sea (WAV, HDF5) to put beside it.")
    ] = None,
    full_scale: Annotated[
        float | None, typer.Option(metavar="PA", help="Pressure (Pa) of the recording's full scale.")
    ] = None,
    sensitivity: Annotated[
        float | None, typer.Option(metavar="DB", help="The same in dB re full scale per uPa, such as -176.")
    ] = None,
    channel: Annotated[int, typer.Option(min=0, help="Channel of the recording, from 0.")] = 0,
    dataset: Annotated[
        str | None, typer.Option(metavar="NAME", help="Of an HDF5 that has several: the one of the recording.")
    ] = None,
    sampling_frequency: Annotated[
        float | None, typer.Option(metavar="HZ", help="Of an HDF5 that does not say it.")
    ] = None,
    files: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Where the files are that a store's recipe names.")
    ] = None,
    settings: Settings = [],  # noqa: B006 - typer copies it
    as_json: Json = False,
) -> None:
    """Draw what the hydrophones hear of the sea, beside its models: spectrum, loud arrivals, amplitudes, directions,
    coherence, gaps. A recording can be put beside it."""
    from sonarsynth.cli import printing
    from sonarsynth.evaluation.soundscape.recorded_sound import SeaRecording
    from sonarsynth.evaluation.soundscape.sound import LEAST_SECONDS
    from sonarsynth.pictures.soundscape_figures import soundscape_pictures as pictures
    from sonarsynth.recipe import reading

    if not LEAST_SECONDS <= seconds <= LONGEST:
        raise BadOption(f"--seconds: must be from {LEAST_SECONDS:g} to {LONGEST:g}")
    of_recording = (full_scale, sensitivity, dataset, sampling_frequency)
    if compare is None and (channel or any(option is not None for option in of_recording)):
        raise BadOption(
            "--full-scale, --sensitivity, --channel, --dataset and --sampling-frequency are those of a recording: name "
            "one with --compare"
        )
    beside = None
    if compare is not None:
        pascals = _pascals(full_scale, sensitivity)
        beside = SeaRecording(compare, pascals, channel, dataset, sampling_frequency)
    if Path(source).is_file():
        with reading.opened(Path(source), settings) as made_from, printing.planning("making sound"):
            drawn = pictures.soundscape_of_recipe(made_from, seconds, beside)
    elif Path(source).suffix.lower() in {".yaml", ".yml"}:
        raise BadOption(f"{source}: no such file")
    elif settings:
        raise BadOption("--set is for recipes: a store is what it is")
    else:
        drawn = pictures.soundscape_of_store(source, files, beside)
    file = pictures.draw_soundscape(drawn, out)
    if as_json:
        typer.echo(json.dumps(drawn.as_json(), allow_nan=False))
        return
    for line in drawn.summary():
        typer.echo(line)
    typer.echo(str(file))


def _pascals(full_scale: float | None, sensitivity: float | None) -> float | None:
    """Pressure (Pa) of the number 1 in the file; None where nothing is given. Raises BadOption."""
    if full_scale is not None and sensitivity is not None:
        raise BadOption("--full-scale and --sensitivity say the same: give only one")
    if sensitivity is not None:
        if not abs(sensitivity) <= 400.0:
            raise BadOption("--sensitivity: must be in dB re full scale per uPa, such as -176")
        return float(1e-6 * 10.0 ** (-sensitivity / 20.0))
    if full_scale is not None and not 1e-9 <= full_scale <= 1e12:
        raise BadOption("--full-scale: must be a pressure in Pa, from 1e-9 to 1e12")
    return full_scale
