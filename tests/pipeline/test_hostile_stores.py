"""A store may come from anybody: nothing outside of it is read, written or removed on its word, by whatever command."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
import zarr

from sonarsynth import planning, store
from sonarsynth.planning import Plan
from sonarsynth.recipe import reading
from sonarsynth.schedule import build
from sonarsynth.schedule.repairing import repair
from sonarsynth.store import cards
from sonarsynth.store.marks import Mark, load_layout, load_mark, save_mark
from tools.fault_injection.corrupt import RECIPE, contents
from tools.fault_injection.watching import watched


@pytest.fixture(scope="module")
def made() -> Plan:
    return planning.plan(reading.loads(RECIPE), frozenset({"image"}))


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, made: Plan) -> Path:
    path = tmp_path_factory.mktemp("whole") / "s.zarr"
    assert build(made, path, frames=range(16), workers=0).ok
    return path


@pytest.fixture
def path(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "here" / "s.zarr"))


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    folder = tmp_path / "outside"
    folder.mkdir()
    (folder / "precious").write_text("precious")
    return folder


def linked(path: Path, outside: Path, name: str) -> Path:
    """A part of a store moved out of it, and a link in its place."""
    shutil.move(path / name, outside / "target")
    (path / name).symlink_to(outside / "target")
    return outside / "target"


def state(folder: Path) -> dict[str, tuple[int, bytes]]:
    files = [file for file in folder.rglob("*") if file.is_file()]
    return {str(file): (file.stat().st_mtime_ns, file.read_bytes()) for file in files}


LINKED = (
    "image/energy/c.1.0.0",
    ".marks",
    "zarr.json",
    *(pytest.param(name, marks=pytest.mark.long) for name in ("image/energy", "image", ".marks/1.json")),
    pytest.param(".marks/layout.json", marks=pytest.mark.long),
)


@pytest.mark.parametrize("name", LINKED)
def test_links_in_a_store_are_found_and_not_followed(
    path: Path, outside: Path, whole: Path, made: Plan, name: str
) -> None:
    linked(path, outside, name)
    before = state(outside)
    with watched(outside) as seen:
        assert not store.verify(path).ok
        with pytest.raises((store.Damage, store.Mismatch)):
            build(made, path, workers=0)
        assert repair(path, workers=0).ok
    assert seen == []
    assert state(outside) == before
    assert contents(path) == contents(whole)


def test_a_link_that_comes_while_a_shard_is_written_is_not_followed(path: Path, outside: Path, made: Plan) -> None:
    (path / ".marks/1.json").unlink()

    def exchange(done: int, total: int, failed: int) -> None:
        linked(path, outside, "image")

    before = state(outside)
    with pytest.raises(store.Damage, match="is a link, which is not followed"):
        build(made, path, workers=0, progress=exchange)
    shutil.rmtree(outside / "target")
    assert state(outside) == before


@pytest.mark.parametrize("name", ["../../outside/precious", "/etc/passwd", "image/../../../outside/precious", "./x"])
def test_a_mark_that_names_files_outside_is_damaged(path: Path, outside: Path, name: str) -> None:
    mark = load_mark(path, 0)
    assert mark is not None
    save_mark(path, Mark("0", mark.frames, mark.content, {**mark.files, name: (8, "0" * 64)}))
    with watched(outside) as seen:
        said = {problem.where: problem.what for problem in store.verify(path).problems}
        assert said[".marks/0.json"] == "the mark is damaged"
        assert repair(path, workers=0).ok
    assert seen == []


def test_zarr_2_in_a_store_is_not_read(path: Path) -> None:
    """Its filters may be any codec, one that runs code too."""
    (path / "image/zarr.json").unlink()
    (path / "image/.zgroup").write_text('{"zarr_format": 2}')
    with pytest.raises(FileNotFoundError):
        zarr.open_group(store.files.place.opens(path / "image"), mode="r")


BESIDE = ("lock", "log.jsonl", "times.jsonl", "failed.jsonl")


@pytest.mark.parametrize("suffix", BESIDE)
@pytest.mark.parametrize("how", ["symlink_to", "hardlink_to"])
def test_links_beside_a_store_are_not_opened(path: Path, outside: Path, made: Plan, suffix: str, how: str) -> None:
    getattr(store.beside(path, suffix), how)(outside / "precious")
    before = state(outside)
    with pytest.raises(store.Mismatch, match=rf"s\.zarr\.{suffix}: is a "):
        build(made, path, workers=0)
    if suffix == "lock":
        with pytest.raises(store.Mismatch, match="is a "):
            repair(path, workers=0)
    assert state(outside) == before


def test_a_card_replaces_a_link_and_not_what_it_leads_to(path: Path, outside: Path) -> None:
    store.beside(path, "card.md").symlink_to(outside / "precious")
    cards.write(path)
    assert not store.beside(path, "card.md").is_symlink()
    assert (outside / "precious").read_text() == "precious"


def test_what_is_moved_out_goes_through_no_link(path: Path, outside: Path) -> None:
    (path / "image/authorized_keys").write_text("mine")
    store.beside(path, "foreign").symlink_to(outside)
    assert repair(path, workers=0).ok
    assert state(outside).keys() == {str(outside / "precious")}
    assert (store.beside(path, "foreign") / "image/authorized_keys").read_text() == "mine"


@pytest.mark.parametrize("name", [".s.zarr.new", ".s.zarr.old", "s.zarr.doing"])
@pytest.mark.parametrize("restart", [False, True])
def test_a_build_removes_only_what_a_build_made(path: Path, made: Plan, name: str, restart: bool) -> None:
    folder = path.with_name(name)
    folder.mkdir()
    (folder / "thesis.txt").write_text("precious")
    (path / ".marks/1.json").unlink()
    if name == ".s.zarr.old":  # nothing of ours has this name any more
        assert build(made, path, workers=0, restart=restart).ok
    else:
        with pytest.raises(store.Mismatch, match="is in the way, and no build made it"):
            build(made, path, workers=0, restart=restart)
    assert (folder / "thesis.txt").read_text() == "precious"


@pytest.mark.parametrize("left", ["nothing", "the mark", "half a store"])
def test_what_a_killed_build_left_is_removed(path: Path, made: Plan, left: str) -> None:
    for name in (".s.zarr.new", "s.zarr.doing"):
        folder = path.with_name(name)
        folder.mkdir()
        if left != "nothing":
            (folder / store.files.scratch.MARKER).touch()
        if left == "half a store":
            shutil.copytree(path / "image", folder / "new")
    assert build(made, path, workers=0).ok
    assert not {".s.zarr.new", "s.zarr.doing"} & {file.name for file in path.parent.iterdir()}


def test_files_that_were_being_written_are_removed_and_no_others(path: Path, made: Plan) -> None:
    mine, theirs = f"{'0' * 32}.partial", "notes.partial"
    for folder, name in ((path / ".marks", "1.json"), (path.parent, "s.zarr.card.md"), (path.parent, "t.zarr.card.md")):
        (folder / f".{name}.{mine}").touch()
    (path.parent / theirs).touch()
    assert build(made, path, workers=0).ok
    left = {file.name for file in path.parent.rglob("*.partial")}
    assert left == {theirs, f".t.zarr.card.md.{mine}"}


def test_a_link_to_a_store_is_the_store(path: Path, tmp_path: Path, made: Plan, whole: Path) -> None:
    link = tmp_path / "elsewhere" / "link.zarr"
    link.parent.mkdir()
    link.symlink_to(path)
    other = planning.plan(reading.loads(RECIPE.replace("seed: 3", "seed: 4")), made.products)
    for again in (other, other, made):
        assert build(again, link, workers=0, restart=True, frames=range(16)).ok
        assert link.is_symlink() and not path.is_symlink()
        assert store.root_attributes(path)["recipe_digest"] == again.digest
    assert store.root_attributes(link) == store.root_attributes(path)
    shards = {name: text for name, text in contents(path).items() if "/c." in name}
    assert shards == {name: text for name, text in contents(whole).items() if "/c." in name}
    assert {file.name for file in link.parent.iterdir()} == {"link.zarr"}
    with store.lock(link), pytest.raises(store.StoreLocked), store.lock(path):
        pass
    with store.lock(path), pytest.raises(store.StoreLocked):
        build(made, link, workers=0)


def test_a_link_to_nothing_yet_is_built_where_it_leads(tmp_path: Path, made: Plan) -> None:
    (tmp_path / "there").mkdir()
    link = tmp_path / "link.zarr"
    link.symlink_to(tmp_path / "there/s.zarr")
    assert build(made, link, frames=[0], workers=0).ok
    assert link.is_symlink() and (tmp_path / "there/s.zarr").is_dir()
    link.unlink()
    link.symlink_to(link)
    with pytest.raises(OSError, match="is a link that leads nowhere"):
        build(made, link, frames=[0], workers=0)


@pytest.mark.parametrize("exchanged", [False, True])
def test_a_store_that_is_renamed_while_it_is_built_is_whole_under_its_new_name(
    tmp_path: Path, whole: Path, made: Plan, exchanged: bool
) -> None:
    """Nothing is made under the old name, and nothing is written into what is put there."""
    path, moved = tmp_path / "s.zarr", tmp_path / "moved.zarr"
    other = planning.plan(reading.loads(RECIPE.replace("seed: 3", "seed: 4")), made.products)
    if exchanged:
        store.create(tmp_path / "other.zarr", other)

    def rename(done: int, total: int, failed: int) -> None:
        if done and not moved.exists():
            path.rename(moved)
            if exchanged:
                (tmp_path / "other.zarr").rename(path)

    with pytest.raises(store.Damage, match="moved, removed or exchanged"):
        build(made, path, frames=range(16), workers=0, progress=rename)
    assert path.exists() is exchanged
    assert not exchanged or store.frames_there(path) == []
    assert store.frames_there(moved) == list(range(8))
    report = build(made, moved, frames=range(16), workers=0)
    assert report.there == 8 and report.ok
    assert store.verify(moved).ok
    shards = [{n: text for n, text in contents(p).items() if "/c." in n} for p in (moved, whole)]
    assert shards[0] == shards[1]


@pytest.fixture
def with_mesh(tmp_path: Path) -> tuple[Path, Path, Plan]:
    """A store whose recipe names a file, in its folder; the file; its plan."""
    trimesh = pytest.importorskip("trimesh")
    mesh = tmp_path / "project/meshes/box.stl"
    mesh.parent.mkdir(parents=True)
    trimesh.creation.box((1, 1, 1)).export(mesh)
    text = RECIPE.replace("{kind: box, size: [1, 1, 1], edge: 0.5}", "{kind: mesh_file, path: meshes/box.stl}")
    made = planning.plan(reading.loads(text, folder=tmp_path / "project"), frozenset({"image"}))
    path = tmp_path / "s.zarr"
    assert build(made, path, frames=[0], workers=0).ok
    return path, mesh, made


def test_files_that_a_stored_recipe_names_are_opened_only_where_their_folder_is_given(
    with_mesh: tuple[Path, Path, Plan], tmp_path: Path, outside: Path
) -> None:
    path, mesh, _ = with_mesh
    before = contents(path)
    (path / "step/c.0").unlink()
    with watched(mesh.parent) as seen:
        with pytest.raises(store.Mismatch, match=f"--files {mesh.parent}"):
            repair(path, workers=0)
        with pytest.raises(store.Mismatch, match="is not in"):
            repair(path, workers=0, files=outside)
    assert seen == []
    moved = shutil.copytree(mesh.parent.parent, tmp_path / "copy")
    shutil.rmtree(mesh.parent.parent)
    assert repair(path, files=moved, workers=1).ok  # in this process: workers would look where it was
    assert contents(path) == before


def test_a_file_without_the_digest_of_the_store_is_not_read_as_anything(
    with_mesh: tuple[Path, Path, Plan], capfd: pytest.CaptureFixture[str]
) -> None:
    path, mesh, _ = with_mesh
    (path / "step/c.0").unlink()
    mesh.write_text("root:x:0:0:secret\n")
    with pytest.raises(store.Mismatch, match="has changed") as raised:
        repair(path, workers=0, files=mesh.parent)
    mesh.unlink()
    (mesh.parent / "elsewhere").write_text("secret")
    mesh.symlink_to(mesh.parent / "elsewhere")
    with pytest.raises(store.Mismatch, match="is not in"):
        repair(path, workers=0, files=mesh.parent)
    assert "secret" not in str(raised.value) + "".join(capfd.readouterr())


def forge(path: Path, change: Callable[[dict[str, object]], object]) -> None:
    """Change the attributes of a store's root, with all digests as they must be."""
    layout = load_layout(path)
    assert layout is not None
    root = json.loads((path / "zarr.json").read_text())
    change(root["attributes"])
    (path / "zarr.json").write_text(json.dumps(root))
    files = {**layout.files, "zarr.json": store.files.place.record(path, "zarr.json")}
    save_mark(path, Mark("layout", (), "", files, root["attributes"]))


def test_worker_processes_open_no_file_that_only_the_store_names(
    with_mesh: tuple[Path, Path, Plan], outside: Path
) -> None:
    path, mesh, made = with_mesh
    forge(path, lambda a: a.update(recipe=str(a["recipe"]).replace(str(mesh), str(outside / "precious"))))
    with watched(outside) as seen, pytest.raises(store.Mismatch, match="precious, which this one does not"):
        build(made, path, workers=1)
    assert seen == []


VALUES = ("text", 5, None, {"creators": [3]}, {"names": [[]]})
FORGED = [
    "plan",
    "inputs",
    *(pytest.param(name, marks=pytest.mark.long) for name in ("dataset", "provenance", "products", "choices")),
    pytest.param("shard_frames", marks=pytest.mark.long),
]


@pytest.mark.parametrize("name", FORGED)
def test_forged_attributes_are_one_line(path: Path, made: Plan, name: str) -> None:
    for value in VALUES:
        forge(path, lambda attributes, value=value: attributes.update({name: value}))
        for command in (cards.write, lambda p: repair(p, workers=0), lambda p: build(made, p, workers=0)):
            try:
                command(path)
            except (store.Mismatch, store.Damage) as error:
                assert "\n" not in str(error)
        store.verify(path, quick=value != 5)


def test_a_forged_store_that_is_larger_than_memory_is_one_line(path: Path) -> None:
    with (path / ".marks/1.json").open("wb") as file:
        file.truncate(1 << 40)
    os.truncate(path / "zarr.json", 1 << 40)
    said = {problem.where: problem.what for problem in store.verify(path).problems}
    assert "is larger than 256 MiB" in said[".marks/1.json"]
    assert repair(path, workers=0).ok
