"""Where a store comes from, in its attributes: written once, and no part of what the store is of."""

from __future__ import annotations

import getpass
import hashlib
import json
import os
import platform
import socket
import subprocess
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

from sonarsynth import planning, schedule, store
from sonarsynth.cli import main
from sonarsynth.planning import Plan
from sonarsynth.recipe import reading
from sonarsynth.store import provenance, writing
from sonarsynth.store.marks import MARKS, all_files


def contents(path: Path) -> dict[str, bytes]:
    """Every file of a store but its marks of the layout, with the root's metadata apart."""
    names = [name for name in all_files(path) if name != "zarr.json"] + [f"{MARKS}/0.json"]
    return {name: (path / name).read_bytes() for name in names}


def rest_of_root(path: Path) -> Any:
    root = json.loads((path / "zarr.json").read_bytes())
    found = root["attributes"].pop("provenance")
    assert found["created"]
    return root


def test_two_builds_differ_in_one_attribute(
    tmp_path: Path, small_text: str, small_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    schedule.build(reading.loads(small_text), tmp_path / "a.zarr", frames=range(8), workers=0)
    monkeypatch.setattr(provenance, "machine", lambda: {"cpu": "another"})
    monkeypatch.setattr(provenance, "git_state", lambda: None)
    monkeypatch.setattr(provenance, "versions", lambda: {"numpy": "another"})
    source = reading.read(small_file)
    recipe = reading.recipe_of(source)
    schedule.build(recipe, tmp_path / "b.zarr", frames=range(8), workers=0, source=source)
    assert contents(tmp_path / "a.zarr") == contents(tmp_path / "b.zarr")
    assert rest_of_root(tmp_path / "a.zarr") == rest_of_root(tmp_path / "b.zarr")
    one, other = (store.root_attributes(tmp_path / name)["provenance"] for name in ("a.zarr", "b.zarr"))
    assert one["recipe_as_written"] == ""
    assert other["recipe_as_written"] == small_text
    assert other["machine"] == {"cpu": "another"}


def test_a_resumed_build_keeps_how_the_store_was_begun(
    tmp_path: Path, small_plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "s.zarr"
    schedule.build(small_plan, path, frames=range(8), workers=0)
    begun = (path / "zarr.json").read_bytes()
    monkeypatch.setattr(provenance, "machine", lambda: {"cpu": "another"})
    schedule.build(small_plan, path, frames=range(16), workers=0)
    assert (path / "zarr.json").read_bytes() == begun
    schedule.build(small_plan, path, frames=range(1), workers=0, restart=True)
    assert store.root_attributes(path)["provenance"]["machine"] == {"cpu": "another"}


def test_the_command_line_keeps_the_recipe_as_written_and_what_was_set(tmp_path: Path, small_file: Path) -> None:
    with pytest.raises(SystemExit) as end:
        main(
            ["build", str(small_file), str(tmp_path / "s.zarr"), "--workers", "0", "--no-predict"]
            + ["--set", "scene.trajectory.frames=2", "--set", "title=two"]
        )
    assert end.value.code == 0
    found = store.root_attributes(tmp_path / "s.zarr")
    assert found["provenance"]["recipe_as_written"] == small_file.read_text()
    assert found["provenance"]["recipe_settings"] == ["scene.trajectory.frames=2", "title=two"]
    assert reading.loads(found["recipe"]).title == "two"


def test_the_plan_meshes_and_files_are_there(tmp_path: Path, small_text: str) -> None:
    cast = tmp_path / "cast.csv"
    cast.write_text("depth (m),sound speed (m/s)\n0,1500\n20,1490\n")
    speed = f"{{kind: cast, path: {cast}}}"
    recipe = reading.loads(small_text.replace("{kind: isovelocity, speed: 1540}", speed))
    made = planning.plan(recipe)
    found = store.creating.described(made)
    assert found["inputs"]["files"] == [{"name": "cast.csv", "sha256": hashlib.sha256(cast.read_bytes()).hexdigest()}]
    meshes = [mesh.digest for mesh in recipe.meshes["box"]]
    assert found["inputs"]["meshes"] == {"box": meshes}
    assert {row["stage"] for row in found["plan"]["stages"]} >= {"trace", "synthesise", "beamform", "range"}
    assert found["plan"]["left_out"]
    assert found["plan"]["errors"]["synthesis"] > 0
    assert "seconds" not in json.dumps(found["plan"], allow_nan=False)


def test_nothing_names_the_host_the_user_or_a_path(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platform, "release", lambda: f"6.1.2-{socket.gethostname()}")
    text = json.dumps(provenance.begun())
    for name in {socket.gethostname(), getpass.getuser(), os.getcwd(), str(Path.home())} - {"/"}:
        assert f'"{name}' not in text
        assert f"/{name}" not in text
    assert provenance.machine()["release"] == "6.1.2"


def test_versions_are_those_installed() -> None:
    found = provenance.versions()
    assert found["numpy"] == version("numpy")
    assert found["python"].endswith(platform.python_version())
    assert found["blas"] != "unknown"


def git(folder: Path, *arguments: str) -> str:
    who = ["-c", "user.name=A", "-c", "user.email=a@example.org", "-c", "commit.gpgsign=false"]
    done = subprocess.run(["git", *who, *arguments], cwd=folder, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_the_commit_is_of_the_checkout_that_holds_the_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in os.environ if name.startswith("GIT_")]:
        monkeypatch.delenv(name)
    package = tmp_path / "code" / "package"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("")
    assert provenance.git_state(package) is None
    git(package.parent, "init", "-q")
    assert provenance.git_state(package) is None, "nothing of the package is in the repository"
    git(package.parent, "add", "-A")
    git(package.parent, "commit", "-q", "-m", "one")
    commit = git(package.parent, "rev-parse", "HEAD")
    assert provenance.git_state(package) == {"commit": commit, "dirty": False}
    monkeypatch.setenv("GIT_DIR", str(tmp_path / "nowhere"))
    (package.parent / "notes.txt").write_text("beside the package")
    assert provenance.git_state(package) == {"commit": commit, "dirty": False}
    (package / "more.py").write_text("x = 1")
    assert provenance.git_state(package) == {"commit": commit, "dirty": True}
    monkeypatch.setenv("PATH", str(tmp_path))
    assert provenance.git_state(package) is None


def test_what_is_said_of_a_dataset_changes_no_identity(tmp_path: Path, small_text: str) -> None:
    said = "dataset: {creators: [{name: A. Author}], citation: 'cite me', url: 'https://doi.org/10.1000/d'}\n"
    plain, told = reading.loads(small_text), reading.loads(said + small_text)
    assert told.dataset.creators[0].name == "A. Author"
    assert plain.digest == told.digest
    path = tmp_path / "s.zarr"
    began = time.time()
    schedule.build(told, path, frames=range(8), workers=0)
    schedule.build(plain, path, frames=range(16), workers=0)
    found = store.root_attributes(path)
    assert found["dataset"]["citation"] == "cite me"
    assert abs(time.mktime(time.strptime(found["provenance"]["created"][:19], "%Y-%m-%dT%H:%M:%S")) - began) < 86_400


@pytest.mark.parametrize(
    ("line", "field"),
    [
        ("dataset: {url: 'ftp://example.org'}", "dataset.url"),
        ("dataset: {version: '1'}", "dataset.version"),
        ("dataset: {creators: [{affiliation: X}]}", "dataset.creators.0.name"),
        ("dataset: {creators: [{name: ''}]}", "dataset.creators.0.name"),
        ("dataset: {author: X}", "dataset.author"),
    ],
)
def test_a_wrong_field_is_one_line(tmp_path: Path, small_text: str, line: str, field: str) -> None:
    file = tmp_path / "wrong.yaml"
    file.write_text(f"{line}\n{small_text}")
    with pytest.raises(reading.RecipeError, match=f"wrong.yaml:1: {field}"):
        reading.load(file)


def test_a_build_with_other_numeric_libraries_goes_on_only_where_told_and_marks_its_frames(
    tmp_path: Path, small_plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, here = tmp_path / "s.zarr", provenance.versions()
    schedule.build(small_plan, path, frames=range(8), workers=0)
    card = store.beside(path, "card.md")
    assert "other libraries" not in card.read_text()
    for name, other in (("numpy", "2.0.1"), ("python", "CPython 3.9.1"), ("blas", "mkl 1")):
        monkeypatch.setattr(provenance, "versions", lambda name=name, other=other: here | {name: other})
        with pytest.raises(store.Mismatch, match=f"{name} .* now {other.removesuffix('.1')}"):
            schedule.build(small_plan, path, frames=range(16), workers=0)
    for name in ("zarr", "dask"):  # which carry numbers
        monkeypatch.setattr(provenance, "versions", lambda name=name: here | {name: "0"})
        schedule.build(small_plan, path, frames=range(8), workers=0)
    monkeypatch.setattr(provenance, "versions", lambda: here | {"numpy": "2.0.1"})
    writing._seen.clear()  # those of a process do not change
    report = schedule.build(small_plan, path, frames=range(16), workers=0, mixed_versions=True)
    assert any("other libraries" in note for note in report.notes)
    marks = [store.marks.load_mark(path, shard) for shard in (0, 1)]
    assert [mark.attributes for mark in marks if mark] == [{}, {"versions": {"numpy": "2.0.1"}}]
    assert "8 frames were made with different libraries from the rest (numpy 2.0.1)" in card.read_text()
    monkeypatch.undo()
    writing._seen.clear()
    assert store.verify(path).ok
    assert schedule.build(small_plan, path, frames=range(16), workers=0).there == 16


def test_python_counts_by_its_minor_version(monkeypatch: pytest.MonkeyPatch) -> None:
    stored = {provenance.PROVENANCE: {"versions": {"python": "CPython 3.11.7", "gsw": "1", "numpy": "2.4.0"}}}
    monkeypatch.setattr(provenance, "versions", lambda: {"python": "CPython 3.11.9", "numpy": "2.4.0"})
    assert provenance.other_versions(stored) == {}
    monkeypatch.setattr(provenance, "versions", lambda: {"python": "CPython 3.12.7", "numpy": "2.4.0"})
    assert provenance.other_versions(stored) == {"python": ("CPython 3.11", "CPython 3.12")}
    assert provenance.other_versions({}) == provenance.other_versions({provenance.PROVENANCE: 5}) == {}
