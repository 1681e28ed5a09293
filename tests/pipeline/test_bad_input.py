"""What cannot be: refused before anything is computed, in one line that names file, line and field; exit status 2."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest
import xarray as xr

import sonarsynth
from sonarsynth import cli, pipeline
from sonarsynth.cli.running import run
from sonarsynth.recipe import Recipe, reading
from tests.waiting import HANGING

Command = Callable[..., tuple[int, str, str]]


@pytest.fixture
def command(capfd: pytest.CaptureFixture[str]) -> Command:
    def call(*arguments: object) -> tuple[int, str, str]:
        status = run(cli.app, [str(a) for a in arguments])
        out, err = capfd.readouterr()
        return status, out, err

    return call


@pytest.fixture
def nothing_is_rendered(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("a frame was rendered")

    monkeypatch.setattr(pipeline, "trace_paths", refuse)


WATER = "scene.world.environment"
TARGET = "scene.world.targets.0"
WRONG = [
    ("beams: {azimuths", "beams: {azimuth", "15: scene.sonar.beams.azimuth: 'azimuth' is not a field here"),
    ("kind: isovelocity, speed: 1540", "kind: cast, path: none.csv", f"5: {WATER}.sound_speed.path: no such file"),
    ("kind: isovelocity, speed: 1540", "kind: cast, path: small.yaml", f"5: {WATER}.sound_speed: "),
    ("kind: box, size: [1, 1, 1], edge: 0.25", "kind: mesh_file, path: small.yaml", f"8: {TARGET}.shape: "),
    ("kind: box, size: [1, 1, 1], edge: 0.25", "kind: mesh_file, path: bad.stl", f"8: {TARGET}.shape: "),
    ("stop: [10, 1, -5]", "stop: [10, 1, 0]", f"9: {TARGET}.motion: target 'box'"),
    ("pitch: 5 cm", "pitch: 5 km", "16: scene.trajectory.sonar: the array, 2.5e+04 m across, is "),
    (
        "pitch: 5 cm",
        "pitch: 5 cm, dead: [20]",
        "14: scene.sonar.array: dead: there is no hydrophone 20; they are 0 to 19",
    ),
    ("pitch: 5 cm", f"pitch: 5 cm, dead: {list(range(20))}", "14: scene.sonar.array.dead: names every hydrophone"),
    *(
        (
            "pitch: 5 cm}",
            f"pitch: 5 cm, dead: [{own}]}}\n    converter: {{bits: 16, full_scale: 200 Pa}}"
            f"\n    sensor_errors: {{{share}, known: {known}}}",
            "16: scene.sonar.sensor_errors: every hydrophone is dead or stuck at frame 0",
        )
        for own, share, known in (
            ("", "dead: 0.5, stuck: 0.5", "gain"),
            ("", "stuck: 1", "all"),
            (", ".join(str(i) for i in range(19)), "dead: 0.999", "gain"),
        )
    ),
    (
        "pitch: 5 cm}",
        "pitch: 5 cm}\n    assumed_sound_speed: 1 m/s",
        "15: scene.sonar.assumed_sound_speed: must be greater",
    ),
    (
        "pitch: 5 cm}",
        "pitch: 5 cm}\n    filter: {kind: low_pass, cutoff: 90 kHz, transition: 1 Hz}",
        "15: scene.sonar.filter.transition: must be greater than or equal to 100",
    ),
    (
        "pitch: 5 cm}",
        "pitch: 5 cm}\n    filter: {kind: low_pass, cutoff: 9 kHz}",
        "13: scene.sonar: nothing to sample: the filter stops the whole band",
    ),
    ("level: 40 dB", "level: 4000 dB", f"5: {WATER}.noise.level: must be less than or equal to 300"),
    (
        "position: [12, 8]",
        "position: [12, 8]\n        source_level: 1e4",
        "12: scene.world.sources.0.source_level: must be less",
    ),
    (
        "position: [12, 8]",
        "position: [12, 8]\n        height: 13",
        "11: scene.world.sources.0.position: depth -1 m is outside",
    ),
    (
        "position: [12, 8]",
        "position: [12, 8]\n        snap_times: [[]]",
        "12: scene.world.sources.0.snap_times",
    ),
    (
        "position: [12, 8]",
        "position: [12, 8]\n        snap_times: [0, 1e5]",
        "scene.processing.echo_window: a frame would take",
    ),
    ("position: [12, 8]", "position: [1e9, 1]", "11: scene.world.sources.0.position: is more than 1e+06 m"),
    ("depth: 12 m", "depth: 120 km", f"5: {WATER}.depth: must be less than or equal to 12 km, not '120 km'"),
    (  # of a word or a number the word alone was named
        "    targets:",
        "    chorus: {reach: 5 km}\n    targets:",
        "6: scene.world.chorus.reach: must be 'auto' or less than or equal to 3 km, not '5 km'",
    ),
    (
        "    targets:",
        "    chorus: {reach: 5 s}\n    targets:",
        "6: scene.world.chorus.reach: has unit 's'; use one of m",
    ),
    (
        "    targets:",
        "    chorus: {density: 2}\n    targets:",
        "6: scene.world.chorus.density: must be 'mud', 'harbour', 'reef', 'rubble' or less than or equal to 1, not 2",
    ),
    ("azimuth_span: 30 deg", "azimuth_span: 180 deg", "azimuth_span: must be less than 180 deg, not '180 deg'"),
    (
        "kind: isovelocity, speed: 1540",
        "kind: temperature_salinity, depth: [0], temperature: [900], salinity: [35]",
        "5: scene.world.environment.sound_speed.temperature",
    ),
]


@pytest.mark.filterwarnings("ignore::sonarsynth.equations.water.seawater.OutOfRange")
@pytest.mark.parametrize(("right", "wrong", "message"), WRONG)
@pytest.mark.usefixtures("nothing_is_rendered")
def test_it_is_one_line_with_file_line_and_field(
    command: Command, small_file: Path, right: str, wrong: str, message: str
) -> None:
    (small_file.parent / "bad.stl").write_bytes(b"solid nothing\nendsolid nothing\n")
    text = small_file.read_text()
    assert right in text
    small_file.write_text(text.replace(right, wrong))
    store = small_file.parent / "s.zarr"
    status, out, err = command("build", small_file, store, "--workers", "0")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"sonarsynth: {small_file}:")
    assert message in err
    assert not store.exists()


def test_drawing_what_is_not_there(command: Command, small_file: Path, tmp_path: Path) -> None:
    (tmp_path / "empty.zarr").mkdir()
    store = tmp_path / "s.zarr"
    assert command("build", small_file, store, "--workers", "0", "--frames", "0:2")[0] == 0
    for arguments, message in (
        ((tmp_path / "none.zarr",), "none.zarr: no such store"),
        ((small_file,), "is not a store: it is not a folder"),
        ((tmp_path / "empty.zarr",), "empty.zarr is not a store of sonarsynth"),
        ((store, "--frame", "7"), "frame 7 has not been built; there are 2, 0 to 1"),
    ):
        status, out, err = command("show", *arguments)
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert message in err
    assert not (tmp_path / "s.zarr.pictures").exists()


def test_a_store_needs_a_name(command: Command, small_file: Path) -> None:
    status, out, err = command("build", small_file, "/", "--workers", "0")
    assert (status, out, err) == (2, "", "sonarsynth: /: is no place for a store\n")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("snap", "small.yaml", "--out", "snap.abc"), "snap.abc: is none of "),
        (("accuracy", "small.yaml", "--out", "small.yaml"), "--out: small.yaml is a file, and a folder is needed"),
        (("target-strength", "{kind: sphere}", "--out", "small.yaml/x"), "--out: small.yaml is a file, and a folder"),
        (("card", "s.zarr", "--out", "small.yaml"), "small.yaml: is a file, and a folder is needed"),
        (("plan", "folder"), "folder: is not a file but a folder"),
        (("export", "truth.zarr"), "cloud: the store has no cloud: it was built without that product"),
    ],
)
def test_wrong_places_and_products_are_said_in_one_line(
    command: Command, small_file: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], said: str
) -> None:
    """Of a folder that is a file, before anything is computed."""
    monkeypatch.chdir(small_file.parent)
    Path("folder").mkdir()
    store, products = next((n for n in arguments if n.endswith(".zarr")), ""), "image" if "card" in arguments else ""
    if store:
        assert (
            command("build", "small.yaml", store, "--workers", "0", "--frames", "0:1", "--products", products)[0] == 0
        )
    status, out, err = command(*arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"sonarsynth: {said}")


def test_calls_that_cannot_be(small: Recipe, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="'film' is not a product; known: signals, image, cloud"):
        sonarsynth.plan(small, ["film"])
    with pytest.raises(ValueError, match="'film' is not a product"):
        sonarsynth.build(small, tmp_path / "s.zarr", workers=0, products="film")
    with pytest.raises(TypeError, match=r"a recipe is planned, not a str: sonarsynth.load reads one"):
        sonarsynth.build("small.yaml", tmp_path / "s.zarr", workers=0)
    with pytest.raises(TypeError, match=r"a recipe is planned, not a str: sonarsynth.load reads one"):
        sonarsynth.render("small.yaml", 0)
    with pytest.raises(ValueError, match="workers must be 0 or more, not -1"):
        sonarsynth.build(small, tmp_path / "s.zarr", workers=-1)
    with pytest.raises(IndexError, match=r"frame 20 is outside 0\.\.19"):
        sonarsynth.build(small, tmp_path / "s.zarr", workers=0, frames=[20])
    for frame in (20, -1):
        with pytest.raises(IndexError, match=rf"frame {frame} is outside 0\.\.19"):
            sonarsynth.render(small, frame)
    assert sonarsynth.plan(small, "image").products == {"image"}


@pytest.mark.long
def test_a_script_without_a_main_guard_is_told_so(small_file: Path, tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        f"import sonarsynth\nsonarsynth.build(sonarsynth.load({str(small_file)!r}), 's.zarr', workers=1)\n"
    )
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, cwd=tmp_path, timeout=HANGING, check=False
    )
    assert done.returncode == 1
    assert done.stderr.endswith(
        'RuntimeError: no worker process could start: in a script, build under `if __name__ == "__main__":`, '
        "or with workers=0\n"
    )


def test_the_schema_takes_every_recipe_there_is_and_no_misspelt_one() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    from ruamel.yaml import YAML

    check = jsonschema.Draft202012Validator(reading.schema())
    check.check_schema(check.schema)
    files = sorted((Path(__file__).parents[2] / "configs").glob("*.yaml"))
    assert files
    for file in files:
        data = json.loads(json.dumps(YAML(typ="safe", pure=True).load(file)))
        assert not list(check.iter_errors(data)), file.name
        data["scene"]["sonar"]["beems"] = {}
        assert list(check.iter_errors(data)), file.name


def test_a_store_of_somebody_else_or_without_its_root_is_said_in_one_line(
    command: Command, reference: Path, tmp_path: Path
) -> None:
    other, rootless = tmp_path / "other.zarr", tmp_path / "rootless.zarr"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that Zarr 3 has no word on consolidated metadata
        xr.Dataset({"a": ("x", [1.0])}).to_zarr(other, zarr_format=3, consolidated=True)
    shutil.copytree(reference, rootless)
    (rootless / "zarr.json").unlink()
    for path, status, said in (
        (other, 2, "a store has a group /truth with frames; this has none"),
        (rootless, 4, "zarr.json is missing or damaged: 'sonarsynth repair' restores it"),
    ):
        for name, *options in (
            ("show",),
            ("export",),
            ("export", "--to", "coco"),
            ("export", "--to", "sonar-netcdf"),
            ("detect",),
            ("evaluate", "truth"),
            ("report",),
        ):
            assert command(name, path, *options) == (status, "", f"sonarsynth: {path}: {said}\n")
