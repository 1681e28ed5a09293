"""Stores side by side: named by what differs, drawn alike, with the numbers of their arrays and run times."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from sonarsynth import schedule, store
from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.evaluation import range_errors
from sonarsynth.pictures.compare import moment, show_beside
from sonarsynth.pictures.figures.compared_images import BesidePicture, Column, Moment, Panel
from sonarsynth.pictures.figures.style import pixels
from sonarsynth.pictures.recipe_diff import names_of
from sonarsynth.pictures.scores import as_table, echo_energies, scores_of
from sonarsynth.pictures.store_reading import opened
from sonarsynth.planning import plan
from sonarsynth.recipe import reading

LOBE = "scene.physics.scattering={kind: mirror_lobe, width: 30 deg}"
MIRRORS = "scene.physics.scattering={kind: kirchhoff}"
ROUGH = "scene.physics.scattering={kind: kirchhoff, roughness: 2 mm}"
BALL = [  # lit from the side of the sonar
    "accuracy.signal=1e-2",
    "scene.world.targets.0.shape={kind: sphere, radius: 25 cm, edge: 12 cm}",
    "scene.world.sources.0.position=[6, -3]",
    "scene.sonar.array.pitch=10 cm",
]
FRAMES = {"lobe": range(5), "mirrors": range(5), "rough": range(1, 6)}


@pytest.fixture(scope="module")
def stores(tmp_path_factory: pytest.TempPathFactory, small_text: str) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("beside")
    (folder / "small.yaml").write_text(small_text)
    made = {}
    for (name, frames), setting in zip(FRAMES.items(), (LOBE, MIRRORS, ROUGH), strict=True):
        made[name] = folder / f"{name}.zarr"
        recipe = reading.load(folder / "small.yaml", [setting, *BALL])
        assert schedule.build(plan(recipe), made[name], frames=frames, workers=0).ok
    return made


def yaml(text: str, *settings: str) -> str:
    return reading.dump(reading.recipe_of(_set(text, settings)))


def _set(text: str, settings: tuple[str, ...]) -> reading.Source:
    from sonarsynth.recipe.reading.yaml_source import override, read_text

    source = read_text(text, "small", Path())
    for setting in settings:
        source = override(source, setting)
    return source


@pytest.mark.parametrize(
    ("settings", "names"),
    [
        (
            (LOBE, MIRRORS, ROUGH),
            [
                "scattering kind mirror lobe",
                "scattering kind kirchhoff, scattering roughness 0 m",
                "scattering kind kirchhoff, scattering roughness 0.002 m",
            ],
        ),
        ((LOBE, LOBE.replace("30", "12.5")), ["scattering width 30 deg", "scattering width 12.5 deg"]),
        (("seed=3", "seed=4"), ["seed 3", "seed 4"]),
        (("title=one", "title=two"), ["0", "1"]),
        (
            ("scene.world.targets.0.motion.stop=[10, 1, -5]", "scene.world.targets.0.motion.stop=[11, 1, -5]"),
            ["motion stop [10.0, 1.0, -5.0] m", "motion stop [11.0, 1.0, -5.0] m"],
        ),
        ((ROUGH, ROUGH, MIRRORS), [f"scattering roughness {x}" for x in ("0.002 m (0)", "0.002 m (1)", "0 m")]),
    ],
)
def test_stores_are_named_by_the_fields_that_tell_them_apart(
    small_text: str, settings: tuple[str, ...], names: list[str]
) -> None:
    recipes = [yaml(small_text, setting) for setting in settings]
    assert names_of(recipes, [str(n) for n in range(len(settings))]) == names


def test_recipes_of_another_version_are_told_apart_without_units() -> None:
    assert names_of(["{edge: 0.5, old: a_b}", "{edge: 2.0, old: a_b}"], ["x", "y"]) == ["edge 0.5", "edge 2"]
    assert names_of(["{edge: 0.5", ""], ["x", "y"]) == ["x", "y"]  # no YAML at all


def test_only_a_few_of_many_differences_are_said(small_text: str) -> None:
    many = [f"scene.world.environment.absorption.{n}" for n in ("temperature=3", "salinity=7", "ph=7.5")]
    many += ["seed=8", "scene.trajectory.frames=3", "scene.trajectory.interval=0.5"]
    one = names_of([yaml(small_text), yaml(small_text, *many)], ["a", "b"])[1]
    assert one == "seed 8, absorption temperature 3 degC, absorption salinity 7 psu, absorption ph 7.5, 2 more"


def test_numbers_are_those_of_the_arrays(stores: dict[str, Path]) -> None:
    tree = opened(stores["mirrors"])
    frames = [1, 2, 3, 4]
    sound = echo_energies(tree, frames)
    rows = scores_of(tree, stores["mirrors"], frames, sound)
    energy, target = tree["image/energy"].values[1:5].astype(float), tree["truth/beams/target"].values[1:5]
    each = [energy[i][target[i] >= 0].mean() for i in range(4)]
    assert sound.peak == energy.max()
    assert sound.on_target == pytest.approx(each)
    assert rows["mean echo on target"] == f"{10 * np.log10(np.mean(each)) + 120:.1f} dB"
    assert rows["its median over frames"] == f"{10 * np.log10(np.median(each)) + 120:.1f} dB"
    assert rows["brightest beam, drawn as 0 dB"] == f"{10 * np.log10(energy.max()) + 120:.1f} dB"
    cloud = {name: tree["cloud"][name].values[1:5] for name in ("range", "true_range", "target", "family", "origin")}
    reach, direct = cloud["range"], (cloud["target"] >= 0) & (cloud["family"] == 0) & (cloud["origin"] == 0)
    error = np.abs(reach - cloud["true_range"])[direct]
    assert len(error) > 0
    assert rows["points on target"] == str(len(error)) == str(sound.points.sum())
    assert rows["median range error"] == f"{100 * np.median(error):.3g} cm"
    assert rows["points off target"] == str(int((np.isfinite(reach) & ~direct).sum()))
    checked = range_errors(tree, np.array(frames))[0].numbers
    assert rows["within 3 predicted errors"] == f"{100 * checked['share_within_3']:.3g} %"


def test_the_cost_is_the_median_of_the_frames_as_last_built(stores: dict[str, Path], tmp_path: Path) -> None:
    tree = opened(stores["lobe"])
    rows = [
        {"frame": 0, "cpu": {"trace": 9.0, "beamform": 9.0, "range": 9.0}},  # built again below
        {"frame": 1, "cpu": {"trace": 0.002}},  # failed
        {"frame": 2, "cpu": {"trace": 0.002, "beamform": 0.030, "range": 0.004}},
        {"frame": 3, "cpu": {"trace": 0.010, "beamform": 0.005, "range": 0.001}},
        {"frame": 0, "cpu": {"trace": 0.003, "beamform": 0.020, "range": 0.002}},
        {"frame": 77, "cpu": {"trace": 5.0, "beamform": 5.0, "range": 5.0}},  # not among the frames asked for
    ]
    lines = [json.dumps(row | {"seconds": {}}) for row in rows]
    (tmp_path / "s.zarr.times.jsonl").write_text("\n".join([*lines, '{"frame": 2, "cpu": {"tra']))
    found = scores_of(tree, tmp_path / "s.zarr", [0, 1, 2, 3], echo_energies(tree, [0, 1, 2, 3]))
    costs = {name: value for name, value in found.items() if name.startswith(("CPU", "frames per second"))}
    assert list(costs.values()) == ["3 ms", "20 ms", "2 ms", "25 ms", "40"]
    assert list(costs)[-2:] == ["CPU per frame: all", "frames per second, one core"]
    without = scores_of(tree, tmp_path / "none.zarr", [0], echo_energies(tree, [0]))
    assert {without[name] for name in costs} == {"-"}


def test_a_film_and_a_picture_of_the_frames_that_all_have(
    stores: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from PIL import Image

    monkeypatch.setenv("PATH", "")  # no ffmpeg
    said: list[str] = []
    files = show_beside(list(stores.values()), tmp_path, say=said.append)
    assert [file.name for file in files] == ["beside.png", "film.gif"]
    with Image.open(files[0]) as picture, Image.open(files[1]) as film:
        assert film.n_frames == 4
        assert picture.size[1] > film.size[1]  # three moments, one under another
    assert said[0] == "only the 4 frames that all stores have"
    head, *rows = said[1].splitlines()
    assert head.split("  ")[-1].strip() == "scattering kind kirchhoff, scattering roughness 0.002 m"
    shared = scores_of(
        opened(stores["lobe"]), stores["lobe"], [1, 2, 3, 4], echo_energies(opened(stores["lobe"]), [1, 2, 3, 4])
    )
    assert [row[: len(name)] for row, name in zip(rows, shared, strict=True)] == list(shared)
    assert all(value in row for row, value in zip(rows, shared.values(), strict=True))


def test_every_film_is_drawn_re_its_own_brightest_beam(stores: dict[str, Path]) -> None:
    trees = [opened(path) for path in stores.values()]
    peaks = [echo_energies(tree, range(1, 5)).peak for tree in trees]
    assert len(set(peaks)) == 3
    seen = [moment(trees, peaks, frame) for frame in range(1, 5)]
    highest = [[np.max(panel.level) for panel in one.panels if panel.level is not None] for one in seen]
    assert np.max(highest, axis=0) == pytest.approx(0.0, abs=1e-6)
    assert seen[2].name == "frame 3\n0.30 s"
    assert [hull.name for hull in seen[0].panels[0].hulls] == ["box"]


def test_each_store_is_drawn_in_its_place_with_port_on_the_left() -> None:
    azimuth, elevation = np.linspace(-25.0, 25.0, 21), np.linspace(-20.0, 20.0, 17)
    silent = np.full((17, 21), -np.inf)
    port = silent.copy()
    port[15, 19] = 0.0  # elevation 17.5, azimuth 22.5
    columns = [Column("silent", {"points": "0"}), Column("port", {"points": "1"}), Column("nothing", {"points": "-"})]
    picture = BesidePicture(azimuth, elevation, columns, "three", rows=2)
    panels = tuple(Panel(level, ()) for level in (silent, port, None))
    picture.show(Moment("early", panels), Moment("late", panels[::-1]))
    shot = pixels(picture.figure)[..., :3].astype(int)

    def brightness(panel: int, x: float, y: float) -> int:
        across, up = picture.figure.axes[panel].transData.transform((x, y))
        return int(shot[round(shot.shape[0] - up), round(across)].sum())

    bright = [brightness(panel, 22.5, 17.5) for panel in range(6)]
    assert [value > 600 for value in bright] == [False, True, False, False, True, False]
    assert bright[0] == bright[5] < 60
    assert bright[2] == bright[3] == brightness(2, 0.0, 0.0) == 3 * 0x9B  # grey: no image
    left, lower = (picture.figure.axes[n].get_window_extent() for n in (0, 3))
    assert lower.y1 < left.y0
    assert left.x1 < picture.figure.axes[1].get_window_extent().x0


def test_a_silent_store_without_a_cloud_is_drawn(stores: dict[str, Path], tmp_path: Path) -> None:
    quiet = tmp_path / "quiet.zarr"
    tree = opened(stores["lobe"]).load()
    tree["image"] = tree["image"].assign(energy=tree["image/energy"] * np.float32(0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # zarr on text arrays and on consolidated metadata
        tree.drop_nodes("cloud").to_zarr(quiet, zarr_format=3, consolidated=True)
    said: list[str] = []
    assert len(show_beside([stores["lobe"], quiet], tmp_path / "out", say=said.append, film=False)) == 1
    assert "silent" in said[0]
    rows = scores_of(xr.open_datatree(quiet, engine="zarr"), quiet, [0], echo_energies(opened(quiet), [0]))
    assert rows["median range error"] == rows["points on target"] == "-"
    assert as_table(["a"], [rows]).count("silent") == 3


def test_stores_that_do_not_fit_are_refused_in_one_line(
    stores: dict[str, Path], small_text: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    def refused(*arguments: object) -> str:
        assert run(app, ["show", *map(str, arguments), "--out", str(tmp_path / "out")]) == 2
        said = capfd.readouterr()
        assert said.out == ""
        assert said.err.count("\n") == 1
        return said.err

    lobe = stores["lobe"]
    other, imageless, empty = (tmp_path / f"{name}.zarr" for name in ("other", "imageless", "empty"))
    store.create(other, plan(reading.recipe_of(_set(small_text, ("scene.sonar.beams.azimuths=9",)))))
    store.create(imageless, plan(reading.loads(small_text), frozenset({"signals"})))
    store.create(empty, plan(reading.loads(small_text)))
    assert "its beams (9 x 9 over 30 x 30 deg) are not those of" in refused(lobe, other)
    assert "imageless.zarr: the store has no image" in refused(lobe, imageless)
    assert "no frame has been built in all of them" in refused(lobe, empty)
    assert "5 stores: from 2 to 4 fit" in refused(*[lobe] * 5)
    assert "no such store" in refused(lobe, tmp_path / "none.zarr")
    assert "frame 0 has not been built in all stores; 4 are, 1 to 4" in refused(lobe, stores["rough"], "--frame", 0)
    assert not (tmp_path / "out").exists()


def test_the_command_names_folder_and_files(
    stores: dict[str, Path], capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    pair = [stores["lobe"], stores["mirrors"]]
    assert run(app, ["show", *map(str, pair), "--no-film", "--frame", "3"]) == 0
    made = pair[0].with_name("lobe-mirrors.pictures") / "beside.png"
    assert capfd.readouterr().out.splitlines()[-1] == str(made)
    assert made.is_file()
    assert run(app, ["show", str(pair[0]), "--no-film", "--out", str(tmp_path)]) == 0  # one store: as ever
    assert [file.name for file in tmp_path.iterdir()] == ["sheet.png"]
