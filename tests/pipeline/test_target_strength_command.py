"""`sonarsynth target-strength`: the table, the picture, what a program reads, and bad input."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth.cli import app
from sonarsynth.cli.running import run

BOX = "{kind: box, size: [0.5 m, 0.3 m, 0.2 m]}"


def test_the_table_holds_what_the_call_returns(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ranges = ["--frequency", "40e3:60e3:10e3", "--aspect", "0:90:15", "--out", str(tmp_path / "out")]
    assert run(app, ["target-strength", BOX, *ranges]) == 0
    said = capsys.readouterr().out
    assert "21 levels: maximum" in said
    with (tmp_path / "out" / "target_strength.csv").open() as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["aspect_deg", "frequency_hz", "target_strength_db"]
    table = np.array(rows[1:], float)
    towards = np.stack([np.cos(np.deg2rad(table[:, 0])), np.sin(np.deg2rad(table[:, 0])), 0 * table[:, 0]], axis=-1)
    expected = ss.target_strength(ss.Box(size=(0.5, 0.3, 0.2)), table[:, 1], -towards, towards)
    np.testing.assert_allclose(table[:, 2], expected, atol=1e-4)
    assert (tmp_path / "out" / "target_strength.png").read_bytes().startswith(b"\x89PNG")


def test_an_open_mesh_file_in_its_unit_and_silence_as_null(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "plate.off"
    file.write_text("OFF\n4 2 0\n0 -100 -100\n0 100 -100\n0 100 100\n0 -100 100\n3 0 1 2\n3 0 2 3\n")
    options = ["--frequency", "50e3", "--aspect", "0:180:180", "--unit", "cm", "--json", "--out", str(tmp_path)]
    assert run(app, ["target-strength", str(file), *options]) == 0
    said = capsys.readouterr()
    assert said.err.startswith("note: not closed: 1 of 1 parts open, 4 edges with one facet only")
    answer = json.loads(said.out)
    assert answer["aspect_deg"] == [0.0, 180.0]
    levels = [row[0] for row in answer["target_strength_db"]]
    seen = [level for level in levels if level is not None]
    assert seen
    np.testing.assert_allclose(seen, 20 * np.log10(4 / 0.03), atol=1e-6)


def test_a_coarse_mesh_is_noted_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--frequency", "50e3", "--aspect", "90", "--out", str(tmp_path)]
    assert run(app, ["target-strength", "{kind: remus100, coarse: true}", *options]) == 0
    said = capsys.readouterr()
    noted = said.err.splitlines()
    assert len(noted) == 1 and said.out.startswith("1 level: maximum")
    assert noted[0].startswith("note: facets of")


def test_a_body_too_small_for_the_lowest_frequency_is_noted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--frequency", "1e3:101e3:100e3", "--aspect", "90", "--out", str(tmp_path)]
    assert run(app, ["target-strength", "{kind: sphere, radius: 20 mm}", *options]) == 0
    noted = capsys.readouterr().err.splitlines()
    assert len(noted) == 1
    assert noted[0].startswith("note: 0.04 m across is ka 0.084 to 8.5 in the band: too small")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nofile.stl"], "nofile.stl: no such file"),
        (["{kind: sfere, radius: 1}"], "did you mean 'sphere'?"),
        (["{kind: sphere, radius: -1}"], "radius: must be greater than 0"),
        (["{kind: sphere"], "is not YAML"),
        (["{kind: mesh_file, path: nowhere.stl}"], "nowhere.stl: no such file"),
        ([BOX, "--frequency", "0"], "--frequency: must be above 0 Hz"),
        ([BOX, "--frequency", "1:2"], "--frequency: '1:2' is neither a number nor a range"),
        ([BOX, "--aspect", "0:360:0"], "--aspect: '0:360:0' contains no value"),
        ([BOX, "--aspect", "0:90:0.001", "--frequency", "1e3:1e5:1"], "too many: use longer steps"),
        (
            [BOX, "--scattering", "{kind: kirchhoff, surface: hard}"],
            "surface: must be 'rigid', 'soft' or a mapping, not",
        ),
        (
            [BOX, "--scattering", "{kind: kirchhoff, surface: {density_ratio: 0, speed_ratio: 1}}"],
            "surface.density_ratio: must",
        ),
        (
            [BOX, "--scattering", "kirchhoff"],
            "--scattering: must be a mapping such as '{kind: kirchhoff}', not 'kirchhoff'",
        ),
        ([BOX, "--unit", "cm"], "--unit: is for a mesh file"),
        ([BOX, "--sound-speed", "1"], "--sound-speed: must be from"),
        (["README.md", "--unit", "mile"], "--unit: mile is none of"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(app, ["target-strength", *arguments, "--out", str(tmp_path / "none")]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1
    assert not (tmp_path / "none").exists()
