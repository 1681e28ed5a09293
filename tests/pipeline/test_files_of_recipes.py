"""Files that a recipe names: plain files of its own folder, whatever lies or points elsewhere."""

from __future__ import annotations

import io
import os
import re
import socket
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from ruamel.yaml import YAML

from sonarsynth.description import named_files
from sonarsynth.description.memory import MAX_FACETS
from sonarsynth.environment.casts import CastError, profile_of
from sonarsynth.environment.sound_speed import Cast
from sonarsynth.recipe import reading
from sonarsynth.recipe.reading import RecipeError, json_schema
from sonarsynth.sources.recordings import RecordingError, read_recording
from sonarsynth.sources.snap_models import RecordedSnap
from sonarsynth.targets.mesh_readers.mesh_files import MAX_BYTES, read_surface
from sonarsynth.targets.meshes import MeshError, mesh_of
from sonarsynth.targets.shapes import MeshFile

SHAPE = "kind: box, size: [1, 1, 1], edge: 0.25"
FIELD = "scene.world.targets.0.shape.path"


@pytest.fixture
def home(tmp_path: Path, small_text: str) -> Path:
    """The folder of a recipe that wants a mesh, `{path}`; beside it, in `outside`, lies a good one."""
    home, outside = tmp_path / "home", tmp_path / "outside"
    home.mkdir()
    outside.mkdir()
    trimesh.creation.box((1, 1, 1)).export(outside / "good.stl")
    (home / "link.stl").symlink_to("../outside/good.stl")
    (home / "folder").symlink_to("../outside")
    (home / "zero.stl").symlink_to("/dev/zero")
    (home / "loop.stl").symlink_to("loop.stl")
    os.mkfifo(home / "pipe.stl")
    (home / "folder.stl").mkdir()
    (home / "here.stl").write_bytes((outside / "good.stl").read_bytes())
    (home / "inner").mkdir()
    (home / "inner" / "link.stl").symlink_to("../here.stl")
    (home / "small.yaml").write_text(small_text.replace(SHAPE, 'kind: mesh_file, path: "{path}"'))
    return home


def recipe(home: Path, path: str) -> Path:
    file = home / "recipe.yaml"
    file.write_text((home / "small.yaml").read_text().replace("{path}", path))
    return file


ELSEWHERE = {
    "/etc/passwd": "is an absolute path: a recipe names files in its own folder; `--set` may name any",
    "/dev/zero": "is an absolute path",
    "../outside/good.stl": "leaves the folder of the recipe",
    "x/../../outside/good.stl": "leaves the folder of the recipe",
    "inner/../here.stl": "leaves the folder of the recipe",
    "link.stl": "is a link out of the folder of the recipe",
    "folder/good.stl": "is a link out of the folder of the recipe",
    "zero.stl": "is a link out of the folder of the recipe",
    "http:" + "//127.0.0.1/good.stl": "is a URL: a recipe names files in its own folder",
    "file:/etc/passwd": "is a URL",
    "s3:" + "//bucket/good.stl": "is a URL",
    "pipe.stl": "is not a file",
    "folder.stl": "is not a file",
    "loop.stl": "is not the path of a file",
    "none.stl": "no such file",
    "a\\0.stl": "is not the path of a file",
    "n" * 300 + ".stl": "is not the path of a file",
    "d/" * 3000 + "good.stl": "is not the path of a file",
    "~/good.stl": "no such file",
    "": "is not a file",
    ".": "is not a file",
}


@pytest.mark.parametrize("path", ELSEWHERE)
def test_a_recipe_opens_no_file_out_of_its_folder(home: Path, path: str) -> None:
    file = recipe(home, path)
    with pytest.raises(RecipeError) as error:
        reading.load(file)
    text = str(error.value)
    assert text.startswith(f"{file}:8: {FIELD}: ") and ELSEWHERE[path] in text and "\n" not in text


def test_it_opens_those_that_are_in_it(home: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for path in ("here.stl", "./here.stl", "inner/link.stl"):
        (target,) = reading.load(recipe(home, path)).scene.world.targets
        assert len(mesh_of(target.shape).faces) == 12
    (tmp_path / "elsewhere").symlink_to(home)  # the folder itself may be a link
    reading.load(recipe(tmp_path / "elsewhere", "inner/link.stl"))


def test_who_gives_the_path_by_hand_may_name_any_file(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file, good = recipe(home, "none.stl"), home.parent / "outside" / "good.stl"
    monkeypatch.chdir(home)
    for path in (good, "../outside/good.stl", "link.stl"):
        (target,) = reading.load(file, [f"{FIELD}={path}"]).scene.world.targets
        assert len(mesh_of(target.shape).faces) == 12
    with pytest.raises(RecipeError, match=r"--set: .*: is not a file: /dev/zero"):
        reading.load(file, [f"{FIELD}=/dev/zero"])


def test_what_varies_opens_no_other_file_either(home: Path) -> None:
    text = recipe(home, "here.stl").read_text()
    grid = "grid: [{path: scene.world.targets.0.shape, values: [{kind: mesh_file, path: here.stl}, %s]}]\n"
    for value in ("{kind: mesh_file, path: /etc/passwd}", "{kind: mesh_file, path: link.stl}"):
        (home / "recipe.yaml").write_text(text + grid % value)
        with pytest.raises(RecipeError, match=r"grid\.0\.values\.1\.path: is a"):
            reading.load(home / "recipe.yaml")
    for part, message in ((".kind", "cannot vary by itself"), (".path", "is the name of a file")):
        entry = f"grid: [{{path: scene.world.targets.0.shape{part}, values: [mesh_file, box]}}]\n"
        (home / "recipe.yaml").write_text(text + entry)
        with pytest.raises(RecipeError, match=message):
            reading.load(home / "recipe.yaml")


FILES = {
    "mesh_file": "scene.world.targets.0.shape",
    "cast": "scene.world.environment.sound_speed",
    "recording": "scene.world.environment.noise",
    "track": "scene.world.targets.0.motion",
    "noise_recording": "scene.world.noise_sources.0.sound",
    "recorded_snap": "scene.world.sources.0.snap",
}
"""Where a recipe names files: the field of each kind of description that has the path of one."""


def test_every_path_of_a_file_is_looked_at_here() -> None:
    """By the schema: each kind with a `path` that is one word (what varies has several) is in the list above."""
    kinds = set()
    for each in json_schema.schema()["$defs"].values():
        fields = each.get("properties", {})
        if fields.get("path", {}).get("type") == "string":
            kinds.add(fields["kind"]["const"])
    assert kinds == set(FILES)


@pytest.mark.parametrize("kind", FILES)
def test_a_path_means_one_thing(
    home: Path, small_text: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, kind: str
) -> None:
    """In the recipe's file it starts at the recipe's folder, in `--set` at the shell's: the name is taken there and
    nowhere else, and where there is none the message names that folder. A recipe's stays in its own folder."""
    shell, file, place = tmp_path / "shell", home / "recipe.yaml", FILES[kind]
    shell.mkdir()
    monkeypatch.chdir(shell)
    extra = "[{name: ship, motion: {kind: still, position: [30, 0, -1]}, sound: {kind: thermal}}]"
    file.write_text(small_text)
    base = [f"scene.world.noise_sources={extra}"] if kind == "noise_recording" else []
    held = reading.dump(reading.load(file, base))
    file.write_text(held)
    data = YAML(typ="safe").load(held)
    inner = data
    for part in place.split("."):
        outer, key = inner, int(part) if part.isdigit() else part
        inner = inner[key]
    for path, message in (
        ("there.x", rf"{place}\.path: no such file: there\.x, in {home}$"),
        ("../outside/good.stl", r"\.path: leaves the folder of the recipe"),
        ("link.stl", r"\.path: is a link out of the folder of the recipe"),
        ("/etc/passwd", r"\.path: is an absolute path"),
    ):
        outer[key] = {"kind": kind, "path": path}
        file.write_text(yaml_text(data))
        (shell / "there.x").write_text("not looked at")
        with pytest.raises(RecipeError, match=message):
            reading.load(file)
    file.write_text(held)
    (shell / "there.x").unlink()
    (home / "there.x").write_text("not looked at")
    with pytest.raises(RecipeError, match=rf"--set: {place}\.path: no such file: there\.x, in {shell}$"):
        reading.load(file, [f"{place}={{kind: {kind}, path: there.x}}"])


def test_a_file_that_need_not_say_its_kind_is_one_too(
    home: Path, small_text: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The relief has meshes alone."""
    file, place = home / "recipe.yaml", "scene.world.relief.shape"
    (home / "reef.stl").write_bytes((home / "here.stl").read_bytes())
    for path, message in (("link.stl", "is a link out of the folder"), ("/etc/passwd", "is an absolute path")):
        file.write_text(small_text.replace("  world:", f"  world:\n    relief: {{shape: {{path: {path}}}}}", 1))
        with pytest.raises(RecipeError, match=rf"{place}\.path: {message}"):
            reading.load(file)
        grid = f"grid: [{{path: {place}, values: [{{path: reef.stl}}, {{path: {path}}}]}}]\n"
        file.write_text(small_text.replace("  world:", "  world:\n    relief: {shape: {path: reef.stl}}", 1) + grid)
        with pytest.raises(RecipeError, match=rf"grid\.0\.values\.1\.path: {message}"):
            reading.load(file)
    file.write_text(small_text)
    monkeypatch.chdir(tmp_path)  # in `--set` it starts at the shell's folder
    with pytest.raises(RecipeError, match=rf"{place}\.path: no such file: reef\.stl, in {tmp_path}$"):
        reading.load(file, ["scene.world.relief={shape: {path: reef.stl}}"])
    relief = reading.load(file, ["scene.world.relief={shape: {path: home/reef.stl}}"]).scene.world.relief
    assert relief.shape.path == str(home / "reef.stl")


def yaml_text(data: object) -> str:
    out = io.StringIO()
    YAML(typ="safe").dump(data, out)
    return out.getvalue()


@pytest.mark.parametrize("ending", ["stl", "obj", "ply", "off", "glb", "csv", "wav"])
def test_only_plain_files_are_read(tmp_path: Path, ending: str) -> None:
    """From Python too: a pipe would wait for ever, a device has no end."""
    pipe, device, folder, plug = (tmp_path / f"{name}.{ending}" for name in ("pipe", "device", "folder", "plug"))
    os.mkfifo(pipe)
    device.symlink_to("/dev/zero")
    folder.mkdir()
    with socket.socket(socket.AF_UNIX) as made:
        made.bind(str(plug))
    for path, reason in ((pipe, "a pipe"), (device, "a device"), (folder, "a directory"), (plug, "a socket")):
        with pytest.raises((MeshError, CastError, RecordingError), match=f"^{re.escape(str(path))}: is {reason}"):
            read_as(ending, path)


def read_as(ending: str, path: Path) -> object:
    """What a file of this ending is read as."""
    if ending == "wav":
        return read_recording(RecordedSnap(path=str(path)))
    return profile_of(Cast(path=str(path))) if ending == "csv" else mesh_of(MeshFile(path=str(path)))


def test_files_are_read_up_to_a_size(tmp_path: Path) -> None:
    file = tmp_path / "x"
    file.write_bytes(b"1234")
    assert named_files.read(file, 4) == b"1234"
    with pytest.raises(named_files.FileError, match="is larger than 0 MiB"):
        named_files.read(file, 3)
    with pytest.raises(named_files.FileError, match="no such file"):
        named_files.digest(tmp_path / "none")
    with pytest.raises(named_files.FileError, match="not the path"):
        named_files.stamp("a\0b")
    assert named_files.digest(file) == "03ac674216f3e15c761ee1a5e255f067953623c8b388b4459e13f978d7c846f4"


def test_files_too_large_are_not_read(tmp_path: Path) -> None:
    for ending, most in MAX_BYTES.items():
        file = tmp_path / f"huge.{ending}"
        with file.open("wb") as out:
            out.truncate(most + 1)
        with pytest.raises(MeshError, match=r"is larger than \d+ [GM]iB"):
            read_surface(file)
    facets = MAX_FACETS + 1
    with (tmp_path / "many.stl").open("wb") as out:
        out.write(bytes(80) + struct.pack("<I", facets))
        out.truncate(84 + 50 * facets)
    with pytest.raises(MeshError, match=rf"many.stl: has {facets} facets, more than \d+$"):
        read_surface(tmp_path / "many.stl")


def test_a_mesh_opens_no_further_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("a file was looked for")

    monkeypatch.setattr(trimesh.resolvers.FilePathResolver, "__init__", refuse)
    box = trimesh.creation.box((1, 1, 1))
    obj = tmp_path / "box.obj"
    obj.write_text("mtllib x.mtl\nusemtl x\n" + box.export(file_type="obj"))
    ply = tmp_path / "box.ply"
    ply.write_bytes(box.export(file_type="ply").replace(b"comment", b"comment TextureFile x.png\ncomment", 1))
    for file in (obj, ply):
        assert len(mesh_of(MeshFile(path=str(file))).faces) == 12


def glb(change: object) -> bytes:
    """A box as GLB, its description changed."""
    import json

    data = trimesh.creation.box((1, 1, 1)).export(file_type="glb")
    size = struct.unpack("<I", data[12:16])[0]
    tree = json.loads(data[20 : 20 + size])
    change(tree)  # type: ignore[operator]
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + size :]
    return b"glTF" + struct.pack("<IIII", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest


def _nowhere(tree: dict[str, list[dict[str, object]]]) -> None:
    del tree["accessors"][0]["bufferView"]
    tree["accessors"][0]["count"] = 10**10


def _placed_often(tree: dict[str, list[dict[str, object]]]) -> None:
    mesh = next(i for i, node in enumerate(tree["nodes"]) if "mesh" in node)
    tree["nodes"] += [dict(tree["nodes"][mesh])] * 3
    tree["accessors"][0]["count"] = MAX_FACETS


def _in_two_places(tree: dict[str, list[dict[str, object]]]) -> None:
    tree["nodes"][0]["children"] = [1, 1]


def _elsewhere(tree: dict[str, list[dict[str, object]]]) -> None:
    tree["buffers"][0]["uri"] = "../outside/x.bin"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda tree: None, None),
        (_nowhere, "accessor 0 has 10000000000 values that are not in the file"),
        (_placed_often, r"places \d+ corners, more than of \d+ facets"),
        (_in_two_places, "has a node that is in two places"),
        (_elsewhere, "cannot be read as GLB"),
        (lambda tree: tree["nodes"].append(5), r"cannot be read as GLB \(AttributeError in its description\)"),
        (lambda tree: tree.update(meshes=7), "cannot be read as GLB"),
    ],
)
def test_what_a_glb_says_of_itself_is_checked(tmp_path: Path, change: object, message: str | None) -> None:
    file = tmp_path / "x.glb"
    file.write_bytes(glb(change))
    if message is None:
        assert len(mesh_of(MeshFile(path=str(file))).faces) == 12
        return
    with pytest.raises(MeshError, match=message) as error:
        mesh_of(MeshFile(path=str(file)))
    assert str(error.value).startswith(str(file)) and "\n" not in str(error.value)


def test_reading_a_damaged_mesh_says_nothing_by_itself(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """trimesh logs tracebacks of what it tries; without a logger of the user's they would reach the screen."""
    good = trimesh.creation.box((1, 1, 1)).export(file_type="stl_ascii")
    file = tmp_path / "x.stl"
    file.write_text(good.replace("facet normal", "facet normal x", 1))
    try:
        mesh_of(MeshFile(path=str(file)))
    except MeshError as error:
        assert "\n" not in str(error)
    assert capfd.readouterr() == ("", "")


def test_the_digest_of_a_recipe_is_of_what_its_files_hold(home: Path) -> None:
    made = reading.load(recipe(home, "here.stl"))
    other = home / "other.stl"
    other.write_bytes((home / "here.stl").read_bytes())
    assert reading.load(recipe(home, "other.stl")).digest == made.digest
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    trimesh.Trimesh(vertices, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).export(other)
    assert reading.load(recipe(home, "other.stl")).digest != made.digest


ARRAY = "array: {kind: position_table, positions: [[0, 0.05, 0.05], [0, -0.05, 0.05], [0.01, 0, -0.05]]}"
STONES = "{kind: stones, positions: [[3, 50.5], [-4, 60]]}"
"""What tables stand for: of an array, and of stones."""


def tabled(home: Path, array: str, stones: str = "x,y\n3,50.5\n-4,60\n") -> Path:
    (home / "array.csv").write_text(array)
    (home / "stones.csv").write_text(stones)
    table = "{kind: position_table, positions: {table: array.csv}}"
    return listed(home, f"array: {table}", "{kind: stones, positions: {table: stones.csv}}")


def listed(home: Path, array: str = ARRAY, stones: str = STONES) -> Path:
    file = recipe(home, "here.stl")
    text = re.sub(r"array: \{.*\}", array, file.read_text())
    file.write_text(re.sub(r"( +)targets:", rf"\1scatterers: [{stones}]\n\1targets:", text, count=1))
    return file


@pytest.mark.parametrize(
    "array",
    [
        "x,y,z\n0,0.05,0.05\n0,-0.05,0.05\n0.01,0,-0.05\n",
        "z [cm], x (mm), y\n5, 0, 0.05\n5, 0, -0.05\n-5, 10, 0\n",
    ],
)
def test_positions_in_a_table_are_those_written_in_a_list(home: Path, array: str) -> None:
    assert reading.load(tabled(home, array)) == reading.load(listed(home))


@pytest.mark.parametrize(
    ("array", "words"),
    [
        ("x,y\n0,1\n", "array.csv: has no column 'z'; known: x, y, z"),
        ("x,y,z,gain\n0,1,2,3\n", "array.csv: 'gain' is no column; known: x, y, z"),
        ("x,y,z\n0,1,2\n0,b,2\n", "array.csv, line 3: y: 'b' is not a number"),
        ("x,y,z\n0,nan,2\n", "array.csv, line 2: y: 'nan' is not a number"),
        ("x,y,z\n0,1\n", "array.csv, line 2: must have 3 values"),
        ("x [mm],y,z\n,1,2\n", "array.csv, line 2: x: '' is not a number"),
        ("x,y,z,x\n0,1,2,3\n", "array.csv: has column 'x' twice"),
        ("x,y,z\n", "array.csv: has no rows under its column names"),
        ("", "array.csv: has no column 'x'; known: x, y, z"),
        ("x,y [furlong],z\n0,1,2\n", "has unit 'furlong'"),
    ],
)
def test_a_table_that_has_no_positions_is_one_clear_line(home: Path, array: str, words: str) -> None:
    with pytest.raises(RecipeError) as error:
        reading.load(tabled(home, array))
    assert "scene.sonar.array.positions" in str(error.value)
    assert words in str(error.value)
