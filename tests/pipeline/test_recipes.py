"""Recipes in YAML: what is wrong is said in one line with file, line and field; what is right survives a round trip."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sonarsynth.description import FieldError
from sonarsynth.environment import sea as water
from sonarsynth.geometry import motion
from sonarsynth.receiver import (
    Band,
    BandPass,
    BeamGrid,
    Converter,
    LowPass,
    PlanarLattice,
    PositionTable,
    Romanis,
    Sonar,
)
from sonarsynth.recipe import Recipe, reading
from sonarsynth.recipe.reading import RecipeError, messages
from sonarsynth.recipe.scene import Scene, Trajectory, World
from sonarsynth.sources.shrimp import SnappingShrimp
from sonarsynth.targets import shapes
from sonarsynth.targets.target import Target

FOCUSED = "  processing: {beamforming: {kind: focused, subarrays: %s}}\n  sonar:"
WRONG = [
    ("beams:", "beems:", "15: scene.sonar.beems: 'beems' is not a field here; did you mean 'beams'?"),
    ("azimuths: 11", "azimuths: 11.0", "15: scene.sonar.beams.azimuths: must be a valid integer, not 11.0"),
    ("azimuths: 11", "azimuths: true", "15: scene.sonar.beams.azimuths: must be a valid integer, not true"),
    ("azimuths: 11", "azimuths: 'no'", "15: scene.sonar.beams.azimuths: must be a valid integer, not 'no'"),
    ("azimuths: 11", "azimuths: ", "15: scene.sonar.beams.azimuths: must be a valid integer, not nothing"),
    ("kind: box,", "kind: bux,", "8: scene.world.targets.0.shape.kind: 'bux' is not a kind here; did you mean 'box'?"),
    ("kind: flat,", "", "5: scene.world.environment.noise: needs a kind: one of flat, knudsen, rain"),
    ("[1, 1, 1]", "[1, .nan, 1]", "8: scene.world.targets.0.shape.size.1: must be a finite number, not .nan"),
    ("[1, 1, 1]", "[1, -.inf, 1]", "8: scene.world.targets.0.shape.size.1: must be a finite number, not -.inf"),
    ("[1, 1, 1]", "[1, 1e400, 1]", "8: scene.world.targets.0.shape.size.1: must be a finite number, not 1e400"),
    ("[1, 1, 1]", "[1, -2, 1]", "8: scene.world.targets.0.shape.size.1: must be greater than 0, not -2"),
    ("[1, 1, 1]", "[1, 2 kHz, 1]", "8: scene.world.targets.0.shape.size.1: has unit 'kHz'; use one of m, km, cm"),
    ("[1, 1, 1]", "[1, 1]", "8: scene.world.targets.0.shape.size.2: is required"),
    ("[1, 1, 1]", "1", "8: scene.world.targets.0.shape.size: must be a list, not 1"),
    ("  sonar:", FOCUSED % "axis", "13: scene.processing.beamforming.subarrays: must be a list or 'auto', not 'axis'"),
    ("  sonar:", FOCUSED % "[1, 17]", "13: scene.processing.beamforming.subarrays.1: must be less than or equal to 16"),
    ("      - position: [12, 8]\n", "      - name: a\n", "11: scene.world.sources.0.position: is required"),
    ("depth: 12 m, ", "", "5: scene.world.environment.depth: is required"),
    ("seed: 3", "seed: 3\nseed: 4", "3: seed: is given twice"),
    ("seed: 3", "\tseed: 3", "2: tabs cannot indent YAML; use spaces"),
    ("seed: 3", "seed: !!python/object/apply:os.system [ls]", "2: seed: has the tag"),
    ("seed: 3", "seed: !thing 3", "2: seed: has the tag !thing; tags are not used in recipes"),
    ("seed: 3", "seed: &a [*a]", "2: is nested deeper than 64 levels"),
    ("seed: 3", "seed: " + "[" * 5000, "2: is nested deeper than 64 levels"),
    ("seed: 3", "seed: [", "4: is not YAML"),
    ("seed: 3", "seed: -3", "2: seed: must be greater than or equal to 0, not -3"),
    ("seed: 3", "? [a]\n: 3", "2: a key must be a text"),
    ("scene:", "scene: []\nscenery:", "3: scene: must be a mapping of fields, not a list"),
    (
        "pitch: 5 cm}",
        "pitch: 5 cm}\n    sampling_frequency: 150 kHz",
        "15: scene.sonar.sampling_frequency: 150000 Hz is",
    ),
    (
        "{kind: isovelocity, speed: 1540}",
        "{kind: tabulated, depth: [0, 5], speed: [1500, .nan]}",
        "speed.1: must be a finite",
    ),
    (
        "{kind: isovelocity, speed: 1540}",
        "{kind: tabulated, depth: [5, 0], speed: [1500, 1500]}",
        "depth: must not decrease",
    ),
    (
        "{kind: isovelocity, speed: 1540}",
        "{kind: cast, file: cast.csv}",
        "5: scene.world.environment.sound_speed.file: 'file' is not a field here; did you mean 'path'?",
    ),
]


def refused(file: Path, sets: tuple[str, ...] = ()) -> str:
    with pytest.raises(RecipeError) as caught:
        reading.load(file, sets)
    message = str(caught.value)
    assert all(line.startswith(str(file)) for line in message.split("\n"))
    return message.removeprefix(f"{file}:")


@pytest.mark.parametrize(("right", "wrong", "message"), WRONG)
def test_what_is_wrong_is_named_with_file_line_and_field(
    small_file: Path, right: str, wrong: str, message: str
) -> None:
    text = small_file.read_text()
    assert right in text
    small_file.write_text(text.replace(right, wrong))
    assert message in refused(small_file)


def test_all_that_is_wrong_is_named_a_line_each(small_file: Path) -> None:
    """Of as many errors as a page holds; of what a misspelt field brings about, the field comes first."""
    text, wrong = small_file.read_text(), (("seed: 3", "seed: -3"), ("pitch: 5 cm", "pich: 5 cm"), ("1540}", "x}"))
    for right, other in wrong:
        assert right in text
        text = text.replace(right, other)
    small_file.write_text(text)
    lines = refused(small_file).split("\n")
    fields = ("seed: must be", "array.pich: 'pich' is not", "array.pitch: is required", "sound_speed.speed: must be")
    assert sorted(field for field in fields for line in lines if field in line) == sorted(fields)
    assert len(lines) == len(fields)
    names = "".join(f"word{i}: 3\n" for i in range(50))
    small_file.write_text(small_file.read_text() + names)
    lines = refused(small_file).split("\n")
    assert lines[-1].endswith(f"and {len(fields) + 50 - messages.MOST_SHOWN} more")
    assert len(lines) == messages.MOST_SHOWN + 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", "1: is empty"),
        (b"# nothing\n", "1: is empty"),
        (b"- 1\n", "1: must be a mapping"),
        (b"title: x\n", "1: scene: is required"),
        (b"title: x\n---\ntitle: y\n", "2: is not YAML"),
        (b"a: 1\ntitle: \xff\xfe\n", "2: is not UTF-8"),
        (b"title: \x00\n", "1: is not YAML"),
        (b"title: x\n" * 300_000, " is larger than 2 MB"),
    ],
)
def test_files_that_are_no_recipe(tmp_path: Path, text: bytes, message: str) -> None:
    file = tmp_path / "x.yaml"
    file.write_bytes(text)
    assert refused(file).startswith(message)


def test_an_alias_bomb_is_refused(tmp_path: Path) -> None:
    rows = ["a: &a [1,1,1,1,1,1,1,1,1,1]"]
    rows += [f"{n}: &{n} [{','.join([f'*{chr(ord(n) - 1)}'] * 10)}]" for n in "bcdefghij"]
    (tmp_path / "x.yaml").write_text("\n".join(rows))
    assert "holds more than 50000 values" in refused(tmp_path / "x.yaml")


def test_files_that_are_not_there(tmp_path: Path) -> None:
    assert refused(tmp_path / "none.yaml") == " no such file"
    assert refused(tmp_path) == " is not a file but a folder"


def test_settings_reach_into_lists_and_make_mappings(small_file: Path) -> None:
    sets = ("scene.world.targets.0.name=crate", "scene.sonar.converter.full_scale=20 kPa", "seed=0o17")
    by_name = ("targets.crate.category=box", "trajectory.frames=3")  # as in a grid
    recipe = reading.load(small_file, (*sets, *by_name))
    assert recipe.scene.world.targets[0].name == "crate" and recipe.scene.world.targets[0].category == "box"
    assert recipe.scene.trajectory.frames == 3
    assert recipe.scene.sonar.converter == Converter(full_scale=20e3)
    assert recipe.seed == 15


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("scene.sonar.sampling_frequency=150 kHz", "--set: scene.sonar.sampling_frequency: 150000 Hz is under twice"),
        ("scene.sonar.beems=1", "--set: scene.sonar.beems: 'beems' is not a field here; did you mean 'beams'?"),
        ("scene.world.targets.3.name=x", "--set: scene.world.targets.3.name: there is no entry '3', only 0 ("),
        ("targets.nobody.name=x", "--set: scene.world.targets.nobody.name: there is no entry 'nobody', only 0 ("),
        ("trajectory.frames=x", "--set: scene.trajectory.frames: must be"),
        ("sources.0.position=[10 m]", "--set: scene.world.sources.0.position: must have at least 2 entries, not 1"),
        (
            "sources.0.position=[1, 2, 3, 4]",
            "--set: scene.world.sources.0.position: must have at most 3 entries, not 4",
        ),
        ("environment.depth=nan", "--set: scene.world.environment.depth: must be a finite number, not nan"),
        ("title.x=3", "--set: title.x: 'title' has no fields"),
        ("title", "--set: 'title' is not path=value"),
        ("seed=[", "--set: seed: is not YAML"),
        ("seed=.nan", "--set: seed: must be a finite number"),
        (
            "scene.world.targets.0.shape={kind: mesh_file, path: none.stl}",
            "--set: scene.world.targets.0.shape.path: no",
        ),
    ],
)
def test_what_is_wrong_in_a_setting_is_named_with_its_field(small_file: Path, setting: str, message: str) -> None:
    assert refused(small_file, (setting,)).startswith(message)


def test_one_setting_needs_no_list(small_file: Path) -> None:
    one, listed = (reading.load(small_file, sets) for sets in ("trajectory.frames=3", ["trajectory.frames=3"]))
    assert one.frames == 3 and one.digest == listed.digest


def test_a_kind_set_over_the_fields_of_another_says_how_to_replace_them(small_file: Path) -> None:
    message = refused(small_file, ("scene.sonar.array.kind=romanis",))
    (hint,) = message.partition("\n")[0].split("--set ")[1:]
    assert "columns" in message
    assert hint == "scene.sonar.array='{kind: romanis}'"
    assert "--set" not in refused(small_file, ("scene.sonar.array={kind: romanis, columns: 2}",)).removeprefix("--set")


def test_paths_in_a_file_are_relative_to_it_and_those_of_settings_to_the_working_directory(
    small_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for folder in ("", "elsewhere"):
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / "cast.csv").write_text("")
    monkeypatch.chdir(tmp_path / "elsewhere")
    text = small_file.read_text().replace("{kind: isovelocity, speed: 1540}", "{kind: cast, path: cast.csv}")
    small_file.write_text(text)
    speed = reading.load(Path("..") / small_file.name).scene.world.environment.sound_speed
    assert Path(speed.path).resolve() == tmp_path / "cast.csv"
    speed = reading.load(small_file, ("scene.world.environment.sound_speed.path=cast.csv",)).scene.world.environment
    assert Path(speed.sound_speed.path) == tmp_path / "elsewhere" / "cast.csv"


def test_errors_of_planning_are_named_with_file_line_and_field(small_file: Path) -> None:
    source = reading.read(small_file)
    with pytest.raises(RecipeError) as caught, reading.locating(source):
        raise FieldError(("scene", "world", "targets", 0, "motion"), "is above the surface at frame 3")
    assert str(caught.value) == f"{small_file}:9: scene.world.targets.0.motion: is above the surface at frame 3"


def test_yaml_is_1_2() -> None:
    scene = "scene: {world: {environment: {depth: 1e2, sound_speed: {kind: isovelocity, speed: 15e2}}}}"
    recipe = reading.loads(f"title: no\nseed: 010\n{scene}\n")
    assert (recipe.title, recipe.seed, recipe.scene.world.environment.depth) == ("no", 10, 100.0)


numbers = st.floats(-1e3, 1e3, allow_subnormal=False)
positive = st.floats(1e-3, 1e3)
angles = st.floats(-7, 7)
points = st.tuples(numbers, numbers, numbers)
texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=30)
names = st.from_regex(r"[A-Za-z][A-Za-z0-9_-]{0,20}", fullmatch=True)
motions = st.one_of(
    st.builds(motion.Still, position=points, heading=angles, pitch=angles, roll=angles),
    st.builds(motion.Line, start=points, stop=points, duration=positive, heading=st.none() | angles),
    st.builds(motion.Circle, centre=points, radius=positive, speed=numbers, bearing=angles),
    st.builds(motion.ConstantVelocity, start=points, heading=angles, speed=numbers, climb=numbers),
    st.builds(
        motion.Waypoints,
        points=st.tuples(*(st.builds(motion.Waypoint, time=st.just(t), position=points) for t in (0.0, 1.5))),
    ),
)
bodies = st.one_of(
    st.builds(shapes.Sphere, radius=positive, edge=st.none() | positive),
    st.builds(shapes.Box, size=st.tuples(positive, positive, positive)),
    st.builds(shapes.Remus100, fins=st.booleans(), coarse=st.booleans()),
    st.builds(shapes.MeshFile, path=texts.map("/tmp/{}".format), unit=st.sampled_from(["m", "mm"]), offset=points),
)
speeds = st.one_of(
    st.builds(water.Isovelocity, speed=st.floats(1000, 2000)),
    st.builds(water.Tabulated, depth=st.just((0.0, 5.0, 5.0)), speed=st.tuples(*[st.floats(1000, 2000)] * 3)),
)
arrays = st.one_of(
    st.just(Romanis()),
    st.builds(
        PlanarLattice, columns=st.just(2), rows=st.just(2), pitch=positive, mask=st.sampled_from([None, ("#.", ".#")])
    ),
    st.builds(PositionTable, positions=st.lists(points, min_size=1, max_size=3).map(tuple)),
)
sonars = st.builds(
    Sonar,
    array=arrays,
    band=st.just(Band(low=20e3, high=50e3)),
    filter=st.sampled_from([None, LowPass(cutoff=60e3), BandPass(low=10e3, high=60e3)]),
    converter=st.none() | st.builds(Converter, bits=st.integers(2, 24), full_scale=positive),
    beams=st.builds(BeamGrid, azimuths=st.integers(1, 2001), azimuth_span=st.floats(1e-3, 3)),
)
recipes = st.builds(
    Recipe,
    title=texts,
    seed=st.integers(0, 2**70),
    scene=st.builds(
        Scene,
        world=st.builds(
            World,
            environment=st.builds(water.Environment, depth=positive, sound_speed=speeds),
            targets=st.lists(
                st.builds(Target, name=names, shape=bodies, motion=motions), max_size=2, unique_by=lambda t: t.name
            ).map(tuple),
            sources=st.lists(
                st.builds(SnappingShrimp, name=texts, position=st.tuples(numbers, numbers) | points), max_size=2
            ).map(tuple),
        ),
        sonar=sonars,
        trajectory=st.builds(Trajectory, frames=st.integers(1, 10**7), start=numbers, sonar=motions),
    ),
)


@settings(max_examples=25)
@given(recipes)
def test_a_recipe_survives_yaml(recipe: Recipe) -> None:
    assert reading.loads(reading.dump(recipe)) == recipe
