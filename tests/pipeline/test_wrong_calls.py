"""Mistakes of a first hour with the package: each is one line that says what is needed, and leaves nothing behind."""

from __future__ import annotations

import errno
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth import cli
from sonarsynth.cli.running import run
from sonarsynth.loading import Frames, RenderedFrames
from sonarsynth.recipe import Recipe
from sonarsynth.schedule import disk_space

LOADED = "sonarsynth.load reads one from a file"
PATH_NEEDED = "a store is named by a path or a URL, not by a"


@pytest.mark.parametrize("frame", [1.5, "1", None, True, np.bool_(True), range(2), [0]])
def test_a_frame_is_a_whole_number(small: Recipe, frame: Any) -> None:
    with pytest.raises(TypeError, match="a frame is a whole number, not "):
        ss.render(small, frame)


@pytest.mark.parametrize("frames", [[0.5], "0:2", 0.5, [None], ["1"]])
def test_frames_of_a_build_are_whole_numbers_and_no_frame_fails_for_it(
    small: Recipe, tmp_path: Path, frames: Any
) -> None:
    with pytest.raises(TypeError, match="frames must be whole numbers, not "):
        ss.build(small, tmp_path / "s.zarr", frames=frames, workers=0)
    assert list(tmp_path.iterdir()) == []


def test_frames_of_a_build_are_one_or_several_or_a_mask(small: Recipe, tmp_path: Path) -> None:
    path = tmp_path / "s.zarr"
    assert ss.build(small, path, frames=3, workers=0, products=[]).wanted == 1
    mask = np.arange(small.frames) % 2 == 1
    ss.build(small, path, frames=mask, workers=0, products=[])
    assert np.flatnonzero(mask).tolist() == ss.open(path).sonar.table("truth/targets").index.unique("frame").tolist()
    with pytest.raises(IndexError, match=f"a mask of 3 frames, where there are {small.frames}"):
        ss.build(small, path, frames=[True, False, True], workers=0)


@pytest.mark.parametrize("workers", ["2", 1.5])
def test_workers_are_a_whole_number(small: Recipe, tmp_path: Path, workers: Any) -> None:
    with pytest.raises(TypeError, match="workers must be a whole number, not "):
        ss.build(small, tmp_path / "s.zarr", workers=workers)
    assert list(tmp_path.iterdir()) == []


WRONG: list[tuple[str, type[Exception], Callable[[], object]]] = [
    (f"{PATH_NEEDED} NoneType", TypeError, lambda: ss.open(None)),  # type: ignore[arg-type]
    (f"{PATH_NEEDED} dict", TypeError, lambda: ss.verify({})),  # type: ignore[arg-type]
    (f"{PATH_NEEDED} list", TypeError, lambda: ss.detect([])),  # type: ignore[arg-type]
    (f"{PATH_NEEDED} list", TypeError, lambda: ss.evaluate([], "truth")),  # type: ignore[arg-type]
    (f"{PATH_NEEDED} int", TypeError, lambda: ss.points(3)),  # type: ignore[arg-type]
    ("scale must be 'common' or 'frame', not 'beam'", ValueError, lambda: ss.show("s.zarr", scale="beam")),
    (f"a recipe is written, not a str: {LOADED}", TypeError, lambda: ss.dump("a.yaml")),  # type: ignore[arg-type]
    (f"a recipe is drawn, not a str: {LOADED}", TypeError, lambda: ss.snap("a.yaml")),  # type: ignore[arg-type]
    (f"a recipe is drawn, not a str: {LOADED}", TypeError, lambda: ss.preview("a.yaml")),  # type: ignore[arg-type]
    ("a recipe is read from a text, not from a NoneType", TypeError, lambda: ss.loads(None)),  # type: ignore[arg-type]
    ("this is a text, not the path of one: sonarsynth.loads reads it", ss.RecipeError, lambda: ss.load("a: 1\n")),
    ("must be a mapping of fields .*, not 'a.yaml'", ss.RecipeError, lambda: ss.loads("a.yaml")),
    (
        "scattering must be a law such as",
        ValueError,
        lambda: ss.target_strength(ss.Sphere(radius=0.1), 3e4, [1, 0, 0], [-1, 0, 0], scattering="soft"),  # type: ignore[arg-type]
    ),
    (
        "sources are moved in a store as .*, not a str",
        TypeError,
        lambda: ss.with_sources("s.zarr", 0, []),  # type: ignore[arg-type]
    ),
]


@pytest.mark.parametrize(("said", "error", "call"), WRONG)
def test_what_is_needed_is_said(said: str, error: type[Exception], call: Callable[[], object]) -> None:
    with pytest.raises(error, match=said) as raised:
        call()
    assert "\n" not in str(raised.value)


def test_numbers_that_cannot_be(small: Recipe, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="sequences must be 1 or more, not 0"):
        ss.preview(small, tmp_path / "p", 0)
    with pytest.raises(ValueError, match="hydrophones must be 1 or more, not 0"):
        ss.accuracy(small, [0], hydrophones=0)
    shrimp = ss.SnappingShrimp(position=(8.0, 0.0))
    with pytest.raises(TypeError, match=r"sources must be several, such as \[.*, not one SnappingShrimp"):
        ss.with_sources(small, 0, shrimp)  # type: ignore[arg-type]
    for method in (None, ss.ImagePeaks):
        ss.build(small, tmp_path / "s.zarr", frames=[0], workers=0, products=["image"])
        with pytest.raises(TypeError, match="method must be a kind such as 'peaks', or a method such as"):
            ss.detect(tmp_path / "s.zarr", method)  # type: ignore[arg-type]
    noise = ss.loads(ss.dump(small).replace("noise: null", "noise: {kind: flat, level: 50.0}"))
    for seconds in (-1.0, float("nan"), 0.01):
        with pytest.raises(ValueError, match=r"s are too short to measure: make 0\.05 s at least"):
            ss.soundscape(noise, tmp_path / "s.png", seconds=seconds)


SITE: dict[str, Any] = {"position": (0.0, 0.0, -5.0)}
BUOY = ss.Target(name="buoy", shape=ss.Sphere(radius=1.0), motion=ss.Still(**SITE))
DESCRIBED: list[tuple[str, Callable[[], object]]] = [
    ("Still: headng: 'headng' is not a field here; did you mean 'heading'?", lambda: ss.Still(**SITE, headng=1.0)),
    ("Still: position.2: is required; roll: must be a finite number", lambda: ss.Still(position=(1, 2), roll=np.inf)),
    ("Sonar: array.kind: 'still' is not a kind here; known: ", lambda: ss.Sonar(array=ss.Still(**SITE))),
    ("AutoTracing: bounces: must be less than or equal to 8, not 99", lambda: ss.AutoTracing(bounces=99)),
    (
        "MirrorLobe: diffuse: with reflectivity 0.9 scatters more power",
        lambda: ss.MirrorLobe(reflectivity=0.9, diffuse=0.2),
    ),
    ("Target: name: must be at most 64 letters", lambda: replace(BUOY, name="a b")),
]
"""Mistaken descriptions, and what is said of them."""


@pytest.mark.parametrize(("said", "make"), DESCRIBED)
def test_all_that_is_wrong_with_a_description_is_one_line(said: str, make: Callable[[], object]) -> None:
    with pytest.raises(ValueError, match=re.escape(said)) as raised:
        make()
    assert "\n" not in str(raised.value)


def test_fields_are_given_by_name() -> None:
    with pytest.raises(TypeError, match="Still takes its fields by name: kind, position, heading, pitch, roll"):
        ss.Still((0.0, 0.0, -5.0))  # type: ignore[misc]


@pytest.mark.parametrize("heading", [90.0, -45, 4.01 * np.pi])
def test_degrees_where_radians_are_meant_are_refused(heading: float) -> None:
    with pytest.raises(ValueError, match=r"must be within two turns, not .* rad: in Python angles are in radians"):
        ss.Still(position=(0, 0, -5), heading=heading)
    assert ss.Still(position=(0, 0, -5), heading=4 * np.pi).heading == 4 * np.pi


def test_the_length_of_a_name_is_said(small_text: str) -> None:
    for field in ("name: box", "category: box"):
        text = small_text.replace("name: box", "name: box\n        category: box".replace(field, field + "x" * 80), 1)
        with pytest.raises(ss.RecipeError, match=r"must be at most 64 letters, digits.*, a letter first, not 'box"):
            ss.loads(text)


@pytest.mark.parametrize(
    "arguments",
    [
        ("build", "small.yaml", "s.zarr/sub", "--workers", "0"),
        ("build", "small.yaml", "s.zarr/image/sub.zarr", "--workers", "0"),
        ("build", "small.yaml", "link/sub.zarr", "--workers", "0"),
        ("card", "s.zarr", "--out", "s.zarr"),
        ("report", "s.zarr", "--out", "s.zarr"),
        ("detect", "s.zarr", "--out", "s.zarr/p.json"),
        ("export", "s.zarr", "--to", "coco", "--out", "s.zarr/coco"),
        ("export", "s.zarr", "s.zarr/coco", "--to", "coco"),
        ("show", "s.zarr", "--out", "link/pictures"),
        ("preview", "small.yaml", "--out", "s.zarr/truth"),
        ("snap", "small.yaml", "--out", "s.zarr/snap.png"),
        ("rays", "small.yaml", "--out", "s.zarr/rays"),
        ("soundscape", "s.zarr", "--out", "s.zarr/s.png"),
        ("target-strength", "{kind: sphere}", "--out", "s.zarr/t"),
        ("accuracy", "small.yaml", "--out", "s.zarr/a"),
    ],
)
def test_nothing_is_written_into_a_store(
    small: Recipe,
    small_file: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
) -> None:
    """`verify` would call it damage."""
    monkeypatch.chdir(small_file.parent)
    ss.build(small, "s.zarr", frames=[0], workers=0, products=["image"])
    Path("link").symlink_to("s.zarr")
    capfd.readouterr()
    status = run(cli.app, list(arguments))
    out, err = capfd.readouterr()
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert " is in the store " in err
    assert "choose another place" in err or "choose another path" in err
    assert ss.verify("s.zarr", quick=True).ok


def test_a_name_that_is_too_long_is_bad_input(small_file: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run(cli.app, ["build", str(small_file), str(small_file.parent / ("x" * 300)), "--workers", "0"]) == 2
    assert capfd.readouterr().err.count("\n") == 1
    assert [file.name for file in small_file.parent.iterdir()] == ["small.yaml"]


@pytest.mark.parametrize(("number", "mended"), [(errno.EROFS, "make it writable"), (errno.EFBIG, "ulimit -f")])
def test_no_space_is_asked_for_where_space_is_not_what_is_lacking(tmp_path: Path, number: int, mended: str) -> None:
    with (
        pytest.raises(OSError, match=mended) as raised,
        disk_space.told_when_full(tmp_path, lambda: disk_space.DiskRoom(1.0, 1)),
    ):
        raise OSError(number, "no")
    assert "free some space" not in str(raised.value)


@pytest.mark.parametrize(
    ("field", "meant"), [("frames", "scene.trajectory.frames"), ("depth", "scene.world.environment.depth")]
)
def test_a_field_that_is_not_at_the_root_is_found_where_it_stands(small_file: Path, field: str, meant: str) -> None:
    with pytest.raises(
        ss.RecipeError, match=rf"--set: {field}: '{field}' is not a field here; did you mean '{meant}'\?$"
    ):
        ss.load(small_file, [f"{field}=3"])


def test_the_arrivals_to_compare_with_are_looked_for_before_anything_is_drawn(
    small_file: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(small_file.parent)
    assert run(cli.app, ["rays", "small.yaml", "--compare", "none.arr"]) == 2
    assert capfd.readouterr().err == "sonarsynth: --compare: none.arr: no such file\n"
    assert [file.name for file in Path().iterdir()] == ["small.yaml"]


def test_samples_are_chosen_by_whole_numbers_and_parts_are_counted_from_none(small: Recipe, tmp_path: Path) -> None:
    ss.build(small, tmp_path / "s.zarr", frames=range(3), workers=0, products=["image"])
    data = Frames(tmp_path / "s.zarr")
    assert data[np.int64(1)]["frame"] == 1
    for row in (slice(0, 2), "0", 1.5, None):
        with pytest.raises(TypeError, match="a sample is chosen by a whole number, not by "):
            data[row]  # type: ignore[index]
    parts = np.concatenate([RenderedFrames(small, part=(k, 3)).frames for k in range(3)])
    assert np.sort(parts).tolist() == list(range(small.frames))
    for part in ((3, 3), (-1, 3), (0, 0)):
        with pytest.raises(ValueError, match=r"part must be \(k, n\) with k from 0 to n - 1, not "):
            RenderedFrames(small, part=part)
    with pytest.raises(ValueError, match=r"frame '1' is outside 0\.\.19"):
        ss.open(tmp_path / "s.zarr").sonar.image("1")
