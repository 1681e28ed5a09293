"""Grids and variations from recipe to store: what is stored, what is selected, what is refused and where."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from sonarsynth import cli, evaluation, planning, schedule, store
from sonarsynth.cli.running import run
from sonarsynth.pipeline import render
from sonarsynth.recipe import Axis, reading
from sonarsynth.recipe.reading import RecipeError
from sonarsynth.recipe.variation.random_variations import Normal

SPAN = """\
grid:
  - {name: away, path: scene.world.targets.0.motion.start.0, values: [9 m, 1100 cm]}
  - zip:
      - {name: heading, path: scene.world.targets.0.motion.heading, first: 0 deg, last: 90 deg, count: 2}
      - name: hull
        path: scene.world.targets.0.shape
        values: [{kind: box, size: [1, 1, 1], edge: 0.5}, {kind: sphere, radius: 40 cm, edge: 0.3}]
variations:
  - {name: shrimp_x, path: scene.world.sources.0.position.0, kind: uniform, low: 20 m, high: 30 m}
  - name: water
    path: scene.world.environment.sound_speed
    kind: choice
    values: [{kind: linear, surface_speed: 1500, gradient: 0.1}, {kind: isovelocity, speed: 1520}]
repeats: 2
splits: {train: 0.5, test: 0.5, stratify: hull}
"""


WATCHING = """\
scene:
  world:
    environment: {depth: 20 m, sound_speed: {kind: isovelocity, speed: 1510 m/s}}
    targets: [{name: ball, shape: {kind: sphere, radius: 0.5, edge: 0.3}, motion: {kind: still, position: [14, 0, -5]}}]
    sources: [{kind: snapping_shrimp, position: [6, 5]}]
  sonar:
    array: {kind: planar_lattice, columns: 24, rows: 24, pitch: 4 cm}
    beams: {azimuth_span: 40 deg, azimuths: 21, elevation_span: 30 deg, elevations: 11}
  trajectory: {sonar: {kind: still, position: [0, 0, -5], heading: 90 deg}}
  processing: {echo_window: {start: 5 ms, stop: 14 ms}}
"""


@pytest.fixture
def spanning(small_text: str, tmp_path: Path) -> Path:
    text = small_text.replace("frames: 20", "frames: 2").replace(
        "{kind: line, start: [10, 0, -5], stop: [10, 1, -5], duration: 1}",
        "{kind: course, start: [10, 0, -5], speed: 1}",
    )
    file = tmp_path / "grid.yaml"
    file.write_text(text + SPAN)
    return file


def said(capfd: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    status = run(cli.app, [str(a) for a in arguments])
    return (status, *capfd.readouterr())


def test_a_store_holds_every_value_and_every_mesh(spanning: Path, tmp_path: Path) -> None:
    """Read with plain xarray; alike in any order and on its own."""
    recipe = reading.load(spanning)
    whole, part = tmp_path / "whole.zarr", tmp_path / "part.zarr"
    assert schedule.build(recipe, whole, workers=0).ok
    assert schedule.build(recipe, part, frames=(13,), workers=0).ok
    assert not store.verify(whole, [evaluation.check]).problems
    with xr.open_datatree(whole, engine="zarr") as tree, xr.open_datatree(part, engine="zarr") as other:
        root = tree.to_dataset()
        assert {"away", "heading", "hull", "shrimp_x", "water", "repeat"} < set(root.coords)
        first = root.isel(frame=slice(0, 16, 2))
        assert first.trajectory.values.tolist() == list(range(8)) and root.step.values[:4].tolist() == [0, 1, 0, 1]
        assert first.away.values.tolist() == [9.0] * 4 + [11.0] * 4 and root.away.attrs["units"] == "m"
        assert first.heading.values.tolist() == [0.0, 0.0, 90.0, 90.0] * 2 and root.heading.attrs["units"] == "degree"
        assert first.repeat.values.tolist() == [0, 1] * 4
        assert first.hull.values.tolist() == [0, 0, 1, 1] * 2 and root.hull.attrs["flag_meanings"] == "box sphere"
        assert root.water.attrs["flag_meanings"] == "linear isovelocity"
        assert np.array_equal(tree["truth/targets/mesh"].values[::2, 0], first.hull.values)
        assert np.array_equal(tree["truth/targets/position"].values[::2, 0, 0], first.away.values)
        assert np.array_equal(tree["truth/emissions/position"].values[:, 0, 0], root.shrimp_x.values)
        assert len(np.unique(root.shrimp_x.values)) == 8
        faces = [tree[f"targets/box/{n}/faces"] for n in range(2)]
        for frame in range(16):
            mesh = faces[int(tree["truth/targets/mesh"][frame, 0])]
            assert tree["truth/beams/facet"].values[frame].max() < len(mesh)
        assert np.bincount(first.split.values, minlength=3).tolist() == [4, 0, 4]
        assert set(other["away"].values) == {9.0, 11.0}, "every value is there before its frame is"
        for name in ("signals/pressure", "cloud/range", "truth/beams/target", "link_budget/received_level"):
            assert np.array_equal(tree[name].values[13], other[name].values[13], equal_nan=True)
    one = render(recipe, 13)
    assert float(one.coords["away"]) == 11.0 and int(one["truth/targets/mesh"][0]) == 1


def test_a_sequence_more_changes_no_number_of_the_others(spanning: Path, tmp_path: Path) -> None:
    """Each point of the grid is repeated once more, as far away: every array of the old sequences is as it was."""
    text = spanning.read_text()
    text = text[: text.index("  - zip")] + text[text.index("variations") : text.index("  - name: water")]
    kept: dict[str, list[np.ndarray]] = {}
    for repeats, rows in ((2, [0, 1, 2, 3, 4, 5, 6, 7]), (3, [0, 1, 2, 3, 6, 7, 8, 9])):
        spanning.write_text(f"{text}repeats: {repeats}\n")
        path = tmp_path / f"{repeats}.zarr"
        assert schedule.build(reading.load(spanning), path, workers=0).ok
        with xr.open_datatree(path, engine="zarr", chunks=None) as tree:
            for array in store.layout_of(planning.plan(reading.load(spanning))).arrays:
                kept.setdefault(array.path, []).append(np.asarray(tree[array.path].values)[rows])
    differing = [name for name, (few, more) in kept.items() if few.tobytes() != more.tobytes()]
    assert set(differing) <= {"trajectory"}
    assert len(kept) > 50


def test_the_sound_speed_of_a_sequence_is_the_one_its_rays_go_through(spanning: Path) -> None:
    made = planning.plan(reading.load(spanning))
    kinds = {made.at(f).propagation.kind for f in range(16)}
    assert kinds == {"straight", "refracted"}
    for frame in range(0, 16, 2):
        speed = made.recipe.scene_of(frame // 2).world.environment.sound_speed
        view = made.at(frame)
        assert view.at(frame + 1) is view and view.profile.uniform == (speed.kind == "isovelocity")


def test_each_sequence_is_located_and_imaged_by_what_its_own_sonar_knows() -> None:
    """A bottom at another depth, and another speed that is assumed: each frame is that of a recipe of its own."""
    grid = (
        Axis(path="environment.depth", values=("10 m", "20 m")),
        Axis(path="sonar.assumed_sound_speed", values=("1500 m/s", "1520 m/s")),
    )
    recipe = replace(reading.loads(WATCHING), grid=grid)
    spanned, ranges = planning.plan(recipe), []
    for n in range(4):
        alone = planning.plan(replace(recipe, scene=recipe.scene_of(n), grid=()), choices=spanned.choices)
        frame, own = render(spanned, n), render(alone, 0)
        place = frame["source_estimates/position"].values[0]
        assert np.isfinite(place).all() and np.allclose(place, own["source_estimates/position"].values[0], atol=1e-3)
        ranges.append(float(frame["cloud/range"][0]))
        assert ranges[-1] == pytest.approx(float(own["cloud/range"][0]), abs=1e-3)
        assert float(frame.coords["sonar_assumed_sound_speed"]) == (1500.0, 1520.0)[n % 2]
    assert abs(ranges[0] - ranges[1]) > 0.05, "the speed that is assumed moves points"


def test_bodies_have_one_mesh_whatever_the_sonar_assumes() -> None:
    """Meshes of Kirchhoff's law follow the wavelength: that at the slowest speed that any sequence assumes."""
    recipe = reading.loads(
        WATCHING.replace("  trajectory:", "  physics: {scattering: {kind: kirchhoff}}\n  trajectory:")
    )
    ends = Normal(
        path="sonar.assumed_sound_speed", mean="1500 m/s", deviation="20 m/s", low="1460 m/s", high="1550 m/s"
    )
    slow = replace(recipe.scene.sonar, assumed_sound_speed=1460.0)
    fine = replace(recipe.scene, sonar=slow).mesh_of(0).digest
    assert fine != recipe.scene.mesh_of(0).digest
    varied = replace(recipe, variations=(ends,), repeats=4)
    scenes = [varied.scene_of(n) for n in range(4)]
    assert len({scene.sonar.assumed_sound_speed for scene in scenes}) == 4
    assert {scene.mesh_of(0).digest for scene in scenes} == {fine} == {mesh.digest for mesh in varied.meshes["ball"]}
    assert {varied.mesh_number(scene, 0) for scene in scenes} == {0}
    listed = Axis(path="sonar.assumed_sound_speed", values=("1500 m/s", "1460 m/s"))
    assert [mesh.digest for mesh in replace(recipe, grid=(listed,)).meshes["ball"]] == [fine]


def test_sequences_and_frames_are_selected(spanning: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    place = tmp_path / "s.zarr"
    build = ("build", spanning, place, "--workers", "0", "--products", "signals")
    assert said(capfd, *build, "--sequences", "1:3,7")[0] == 0
    assert store.frames_there(place) == [2, 3, 4, 5, 14, 15]
    assert said(capfd, *build, "--sequences", "4", "--frames", "0:9")[0] == 0
    assert store.frames_there(place) == [2, 3, 4, 5, 8, 14, 15]
    for options, message in (
        (("--sequences", "8"), "--sequences: '8' ends past the last sequence, 7"),
        (("--sequences", "x"), "--sequences: 'x' is neither a sequence number nor a range such as 0:8"),
        (("--sequences", "4", "--frames", "0:8"), "--frames and --sequences have no frame in common"),
    ):
        assert said(capfd, *build, *options) == (2, "", f"sonarsynth: {message}\n")


def test_settings_override_the_grid(spanning: Path) -> None:
    sets = ("grid.0.values=[12 m]", "repeats=3", "variations.0.high=21 m")
    recipe = reading.load(spanning, sets)
    assert recipe.sequences == 6
    assert all(20 <= recipe.scene_of(n).world.sources[0].position[0] <= 21 for n in range(6))


def test_plan_says_what_is_spanned(spanning: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, out, _ = said(capfd, "plan", spanning)
    assert status == 0
    assert "8 sequences of 2 frames: away (2) x heading with hull (2) x 2 repeats\n" in out
    assert "drawn for each: shrimp_x (uniform), water (choice)\n" in out
    assert "splits: train 4, validation 0, test 4 sequences\n" in out
    _, out, _ = said(capfd, "plan", spanning, "--json")
    made = json.loads(out)
    assert (made["sequences"], made["frames_of_a_sequence"], made["frames_looked_at"]) == (8, [2, 2], 16)
    assert made["splits"] == {"train": 4, "validation": 0, "test": 4}


START, SHAPE = "scene.world.targets.0.motion.start", "scene.world.targets.0.shape"
WRONG = [
    ("[9 m, 1100 cm]", "[9 m, 11 kHz]", f"18: grid.0.values.1: {START}.0: has unit 'kHz'; use one of m, km"),
    ("[9 m, 1100 cm]", "[9 m, far]", f"18: grid.0.values.1: {START}.0: must be a number in m"),
    ("[9 m, 1100 cm]", "[9 m, 9 m]", "18: grid.0: value 9 m is given twice"),
    ("[9 m, 1100 cm]", "[]", "18: grid.0.values: "),
    ("values: [9 m, 1100 cm]", "value: [9 m]", "18: grid.0.value: 'value' is not a field here; did you mean 'values'?"),
    ("values: [9 m, 1100 cm]", "first: 9 m", "18: grid.0: needs values: [...], or first, last and one of step and"),
    ("values: [9 m, 1100 cm]", "first: 9 m, last: 1 km, step: 1 m", "18: grid.0: must all have the same unit"),
    ("values: [9 m, 1100 cm]", "first: 9 m, last: 8 m, step: 1 m", "18: grid.0: step 1 m does not lead from first"),
    ("motion.start.0", "motion.strat.0", "18: grid.0.values.0: scene.world.targets.0.motion.strat: 'strat' is not a"),
    (
        "motion.start.0",
        "motion.start.7",
        "18: grid.0.path: scene.world.targets.0.motion.start.7: there is no entry '7'",
    ),
    ("motion.start.0", "motion.hedding", "18: grid.0.values.0: scene.world.targets.0.motion.hedding: 'hedding' is not"),
    ("motion.start.0", "motion.speed.0", "18: grid.0.path: scene.world.targets.0.motion.speed.0: 'scene.world.targets"),
    ("scene.world.targets.0.motion.start.0", "scene.sonar.beams.azimuths", "18: grid.0.path: 'scene.sonar.beams.az"),
    (
        "scene.world.targets.0.motion.start.0",
        "scene.physics.subarrays",
        "18: grid.0.path: 'scene.physics.subarrays' can",
    ),
    ("scene.world.targets.0.motion.start.0", f"{SHAPE}.path", f"18: grid.0.path: '{SHAPE}.path' is the name of a fil"),
    ("name: away", "name: time", "18: grid.0.name: 'time' is the name of another coordinate"),
    ("name: away", "name: heading", "20: grid.1.zip.0.name: 'heading' is the name of another coordinate"),
    ("motion.heading", "motion.start.0", "20: grid.1.zip.0.path: 'scene.world.targets.0.motion.start.0' is set by"),
    ("count: 2", "count: 3", "19: grid.1.zip: the entries have 3, 2 values; they must have equally many"),
    ("kind: sphere, radius", "kind: sphere, radios", f"23: grid.1.zip.1.values.1: {SHAPE}.radios: 'radios' is not a "),
    ("40 cm, edge", "-40 cm, edge", f"23: grid.1.zip.1.values.1: {SHAPE}.radius: must be greater than 0"),
    (
        "kind: sphere, radius: 40 cm",
        "kind: ball",
        f"23: grid.1.zip.1.values.1: {SHAPE}.kind: 'ball' is not a kind here; known: ",
    ),
    ("low: 20 m", "low: 31 m", "25: variations.0: low must be less than high: 31 m to 30 m"),
    ("low: 20 m", "low: 20", "25: variations.0: must all have the same unit"),
    (
        "kind: uniform",
        "kind: uniformly",
        "25: variations.0.kind: 'uniformly' is not a kind here; did you mean 'uniform'",
    ),
    ("high: 30 m", "high: 9e9 m", "25: variations.0: scene.world.sources.0.position: is more than 1e+06 m"),
    ("repeats: 2", "repeats: 0", "30: repeats: must be greater than or equal to 1"),
    ("repeats: 2", "repeats: 900000", "17: grid: spans 3600000 sequences, more than 1000000"),
    ("test: 0.5", "test: 0.4", "31: splits: train, validation and test must add up to 1, not 0.9"),
    ("stratify: hull", "stratify: hall", "31: splits.stratify: 'hall' names nothing that varies; known: away"),
    ("stratify: hull", "stratify: shrimp_x", "31: splits.stratify: 'shrimp_x' has another value in each sequence"),
    (
        f"path: {START}.0, values: [9 m, 1100 cm]",
        "path: scene.world.targets, values: [[]]",
        "22: grid.1.zip.1.path: scene.w",
    ),
    (
        f"path: {START}.0, values: [9 m, 1100 cm]",
        f"path: {START}.2, values: [-5 m, -0.2 m]",
        "18: grid.0.values.1: scene.world.targets.0.motion: target 'box' is 0.3 m above the surface at frame 8 (seq",
    ),
    (
        f"path: {START}.0, values: [9 m, 1100 cm]",
        f"path: trajectory.frames, values: [{2**62}, {2**62 + 1}]",  # whose sum would be under 0
        "18: grid.0.values.0: scene.trajectory.frames must be a whole number from 1 to 10000000, not 46",
    ),
    (
        f"path: {START}.0, values: [9 m, 1100 cm]",
        "path: trajectory.frames, values: [2, 0]",
        "18: grid.0.values.1: scene.trajectory.frames must be a whole number from 1 to 10000000, not 0",
    ),
]


@pytest.mark.parametrize(("right", "wrong", "message"), WRONG)
def test_what_is_wrong_is_named_with_file_line_and_field(
    spanning: Path, right: str, wrong: str, message: str, capfd: pytest.CaptureFixture[str]
) -> None:
    text = spanning.read_text()
    assert right in text
    spanning.write_text(text.replace(right, wrong, 1))
    place = spanning.parent / "s.zarr"
    status, out, err = said(capfd, "build", spanning, place, "--workers", "0")
    assert (status, out, err.count("\n")) == (2, "", 1), err
    assert err.startswith(f"sonarsynth: {spanning}:{message}")
    assert not place.exists()


def test_a_drawn_value_that_cannot_be_is_named(spanning: Path) -> None:
    spanning.write_text(
        spanning.read_text().replace(
            "scene.world.sources.0.position.0, kind: uniform, low: 20 m, high: 30 m",
            "scene.world.targets.0.motion.start.2, kind: uniform, low: -8 m, high: 6 m",
        )
    )
    source = reading.read(spanning)
    with pytest.raises(RecipeError) as caught, reading.locating(source):
        planning.plan(reading.recipe_of(source))
    assert f"{spanning}:25: variations.0: scene.world.targets.0.motion: target 'box' is " in str(caught.value)
    assert "(sequence " in str(caught.value) and "shrimp_x = " in str(caught.value)


def test_a_target_that_one_sequence_lacks_is_refused(spanning: Path) -> None:
    text = spanning.read_text().replace(
        "{kind: course, start: [10, 0, -5], speed: 1}",
        "{kind: course, start: [10, 0, -5], speed: 1}\n        scattering: null",
    )
    names = "path: scene.world.targets.0.name, values: [box, crate]"
    spanning.write_text(text.replace(f"path: {START}.0, values: [9 m, 1100 cm]", names))
    source = reading.read(spanning)
    told = r"targets\.0\.name: must be the same in all sequences: 'box' and 'crate'"
    with pytest.raises(RecipeError, match=told), reading.locating(source):
        planning.plan(reading.recipe_of(source))


def test_too_many_meshes_are_refused(spanning: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from sonarsynth.recipe.variation import mesh_variants

    monkeypatch.setattr(mesh_variants, "MOST_VARIANTS", 3)
    radius = f"path: {SHAPE}, kind: uniform, low: 1, high: 2"
    text = spanning.read_text().replace(
        "path: scene.world.sources.0.position.0, kind: uniform, low: 20 m, high: 30 m", radius
    )
    text = (
        text.replace("{kind: box, size: [1, 1, 1], edge: 0.25}", "{kind: sphere, radius: 0.3, edge: 0.3}")
        .replace(f"path: {SHAPE}, kind: uniform", f"path: {SHAPE}.radius, kind: uniform")
        .replace("low: 1, high: 2", "low: 0.3, high: 0.6")
        .replace(SPAN[SPAN.index("  - zip") : SPAN.index("variations")], "")
    )
    spanning.write_text(text.replace("stratify: hull", "stratify: away"))
    source = reading.read(spanning)
    with (
        pytest.raises(RecipeError, match=r"20: variations.0: makes more than 3 different meshes"),
        reading.locating(source),
    ):
        _ = reading.recipe_of(source).meshes


def test_a_path_too_faint_for_single_precision_has_no_measured_level() -> None:
    """-inf would be an infinite number in the store, which verify takes for damage."""
    from types import SimpleNamespace

    from sonarsynth.pipeline.stored_values import link_budget_values
    from sonarsynth.products import LINK_BUDGET

    level = np.full((1, 1, 1), -1274.0)
    isolated = SimpleNamespace(facet=np.array([3]), level=np.array([-1274.0]))
    budget = SimpleNamespace(
        level=np.zeros((1, 1, 1, len(LINK_BUDGET))),
        paths=level,
        error_bound=level,
        isolated=isolated,
        isolated_level=level,
    )
    stored = link_budget_values(budget, np.full((1, 1, 1), -np.inf))["/link_budget", "measured_level"]  # type: ignore[arg-type]
    assert np.isnan(stored).all()
