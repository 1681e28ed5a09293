"""Scenes that lack what most have: every command ends as it should, and `plan` says what there will not be."""

from __future__ import annotations

from pathlib import Path

import pytest

import sonarsynth as ss
from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.recipe import reading

SPARE = {
    "no sources": (
        "scene.world.sources=[]",
        "no source sounds: no target sends an echo, and there are no points (scene.world.sources)",
    ),
    "no targets": ("scene.world.targets=[]", ""),
    "one hydrophone": (
        "scene.sonar.array={kind: planar_lattice, columns: 1, rows: 1, pitch: 5 cm}",
        "no snap is located, so there are no points, and images are of the end of the record: 1 live hydrophone: ",
    ),
    "one row": (
        "scene.sonar.array={kind: planar_lattice, columns: 9, rows: 1, pitch: 5 cm}",
        "no snap is located, so there are no points, and images are of the end of the record: the live hydro",
    ),
    "one beam": ("scene.sonar.beams={azimuth_span: 40 deg, azimuths: 1, elevation_span: 40 deg, elevations: 1}", ""),
    "hertz for kilohertz": (
        "scene.sonar.band={low: 25 Hz, high: 85 Hz}",
        " in the band of the sonar, 0.025 to 0.085 kHz",
    ),
    "km/h for m/s": (
        "scene.world.environment.sound_speed={kind: isovelocity, speed: 1540 km/h}",
        "scene.world.environment.sound_speed: 427.8 m/s is of no water: its sound speed is 1300 to 1900 m/s",
    ),
}


@pytest.mark.parametrize("name", SPARE)
def test_every_command_ends_as_it_should(
    name: str, small_file: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    change, said = SPARE[name]
    recipe = reading.load(small_file, [change])
    made = ss.plan(recipe)
    assert any(said in line for line in made.warnings)
    store = tmp_path / "s.zarr"
    ss.build(made, store, frames=[0], workers=0)
    points = ss.points(store).sizes.get("point", 0)
    ends = {
        ("verify",): 4 if name == "hertz for kilohertz" else 0,  # signals round off what is 200 dB down
        ("show", "--no-film", "--frame", "0"): 0,
        ("export",): 0 if points else 2,
        ("export", "--to", "coco"): 0,
        ("export", "--to", "sonar-netcdf"): 0,
        ("detect",): 0,
        ("evaluate", "truth"): 0,
        ("card",): 0,
        ("report",): 0,
    }
    for (command, *options), status in ends.items():
        assert run(app, [command, str(store), *options]) == status, (command, capfd.readouterr().err)
    assert ("no point to write" in capfd.readouterr().err) == (not points)
