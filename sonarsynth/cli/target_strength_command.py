"""The command `target-strength`."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from sonarsynth.cli.options import Json, check_folder, outside_stores
from sonarsynth.cli.running import BadOption
from sonarsynth.cli.selecting import described

if TYPE_CHECKING:
    from sonarsynth.conventions import Floats
    from sonarsynth.targets.shapes import Shape

MOST: Final = 100_000
"""Values of one range, and levels of a table in hundreds."""


def target_strength(
    body: Annotated[
        str,
        typer.Argument(
            metavar="MESH", help="A mesh file, or a shape such as '{kind: sphere, radius: 0.25 m}'.", show_default=False
        ),
    ],
    frequency: Annotated[
        str, typer.Option(metavar="A:B:STEP", help="Frequencies in Hz, both ends included.")
    ] = "25e3:110e3:5e3",
    aspect: Annotated[
        str, typer.Option(metavar="A:B:STEP", help="Direction of the sonar from the target (deg; 0 bow, 90 port).")
    ] = "0:360:1",
    scattering: Annotated[
        str,
        typer.Option(
            metavar="LAW", help="Scattering law, such as '{kind: kirchhoff, surface: soft}' or '{kind: mirror_lobe}'."
        ),
    ] = "{kind: kirchhoff}",
    sound_speed: Annotated[float, typer.Option(help="Sound speed in m/s.", metavar="C")] = 1500.0,
    unit: Annotated[
        str, typer.Option(metavar="UNIT", help="Unit of the mesh file's coordinates: m, cm, mm, in, ft, or auto.")
    ] = "auto",
    out: Annotated[
        Path, typer.Option(callback=outside_stores, metavar="FOLDER", help="Where to write the table and the picture.")
    ] = Path("target_strength"),
    as_json: Json = False,
) -> None:
    """Monostatic target strength over aspect and frequency, in dB re 1 m2: a table (CSV) and a polar plot."""
    import numpy as np

    from sonarsynth.conventions import FASTEST, SLOWEST
    from sonarsynth.pictures.strength_pictures import strength_table, write_strength
    from sonarsynth.scattering import Scattering
    from sonarsynth.targets.meshes import mesh_of
    from sonarsynth.targets.shapes import MeshFile

    check_folder(out)
    law = described(scattering, "--scattering", Scattering)
    shape = _shape(body, unit)
    f, degrees = _values(frequency, "--frequency"), _values(aspect, "--aspect")
    if not f.min() > 0:
        raise BadOption("--frequency: must be above 0 Hz")
    if not SLOWEST <= sound_speed <= FASTEST:
        raise BadOption(f"--sound-speed: must be from {SLOWEST:g} to {FASTEST:g} m/s")
    if f.size * degrees.size > 100 * MOST:
        raise BadOption(f"{f.size} frequencies at {degrees.size} aspects are too many: use longer steps")
    with warnings.catch_warnings(record=True) as notes:
        warnings.simplefilter("always")
        try:
            table = strength_table(shape, f, np.deg2rad(degrees), sound_speed, law)
        except ValueError as error:
            raise BadOption(str(error)) from None
    files = write_strength(table, f"{body}, {scattering}", out)
    repaired = mesh_of(shape).notes if isinstance(shape, MeshFile) else ()
    for text in dict.fromkeys((*repaired, *(str(note.message) for note in notes))):
        typer.echo(f"note: {text}", err=True)
    if as_json:
        typer.echo(json.dumps(table.as_json()))
        return
    typer.echo(table.summary())
    for file in files:
        typer.echo(str(file))


def _shape(text: str, unit: str) -> Shape:
    """The shape that a text describes: a mapping in YAML, or the path of a mesh file. Raises BadOption, RecipeError."""
    from sonarsynth.targets.shapes import MeshFile, Shape

    if unit not in ("auto", "m", "cm", "mm", "in", "ft"):
        raise BadOption(f"--unit: {unit} is none of auto, m, cm, mm, in, ft")
    if text.lstrip().startswith("{"):
        if unit != "auto":
            raise BadOption(f"--unit: is for a mesh file; write units in the shape, such as 'radius: 25 {unit}'")
        shape: Shape = described(text, "shape", Shape)
        return shape
    if not Path(text).is_file():
        raise BadOption(f"{text}: no such file, and no shape such as '{{kind: sphere, radius: 0.25 m}}'")
    return MeshFile(path=text, unit=unit)  # type: ignore[arg-type]


def _values(text: str, option: str) -> Floats:
    """Numbers of a text "a:b:step", both ends included, or of a single one. Raises BadOption."""
    import numpy as np

    try:
        numbers = [float(number) for number in text.split(":")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 3) or not np.isfinite(numbers).all():
        raise BadOption(f"{option}: '{text}' is neither a number nor a range such as 0:90:5")
    if len(numbers) == 1:
        return np.array(numbers)
    first, last, step = numbers
    count = (last - first) / step if step != 0.0 else np.nan
    if not 0 <= count < MOST:
        raise BadOption(f"{option}: '{text}' contains no value, or more than {MOST}")
    return np.asarray(first + step * np.arange(int(count + 1e-9) + 1))
