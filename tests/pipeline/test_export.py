"""Clouds of many frames in one frame of reference, and files of them for other programs."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import sonarsynth as ss
from sonarsynth import schedule
from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.description import FieldError
from sonarsynth.export import fused_points, write_points
from sonarsynth.geometry import Pose
from sonarsynth.recipe.reading import load, loads
from tests.scenes import SWIMMING


@pytest.fixture(scope="module")
def crossing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five frames of a hull that crosses."""
    path = tmp_path_factory.mktemp("export") / "remus.zarr"
    recipe = load("configs/remus.yaml")
    assert schedule.build(recipe, path, frames=(0, 16, 32, 40, 63), workers=0, products="cloud").ok
    return path


@pytest.mark.long
def test_points_are_the_same_in_every_frame_of_reference(crossing: Path) -> None:
    tree = ss.open(crossing)
    sonar, world, hull = (ss.points(tree, relative_to=to) for to in ("sonar", "world", "remus"))
    assert sonar.sizes["point"] == world.sizes["point"] == int(tree["cloud/count"].where(tree["cloud/count"] > 0).sum())
    assert set(np.unique(sonar["frame"])) == {0, 16, 32, 40, 63}
    cloud, truth = tree["cloud"].dataset, tree["truth"].dataset
    for index in (0, 32):
        rows = np.flatnonzero(sonar["frame"].values == index)
        stored = np.stack([cloud[axis][index].values[: len(rows)] for axis in "xyz"], axis=-1)
        np.testing.assert_allclose(sonar["position"].values[rows], stored, rtol=1e-6)
        pose = Pose(truth["sonar_position"][index].values, truth["sonar_orientation"][index].values)
        np.testing.assert_allclose(world["position"].values[rows], pose.to_world(stored.astype(float)), atol=1e-5)
    np.testing.assert_allclose(
        np.linalg.norm(hull["normal"].values[hull["target"].values == 0], axis=1), 1.0, rtol=1e-6
    )


def test_points_of_a_moving_hull_fall_together_on_it(crossing: Path) -> None:
    hull = ss.points(crossing, relative_to="remus")
    own = (hull["target"].values == 0) & (hull["origin"].values == 0)
    place = hull["position"].values[own]
    assert own.mean() > 0.9
    assert np.mean(hull["distance"].values[own] < 0.05) > 0.95
    assert np.abs(place[:, 0]).max() < 0.9 and np.abs(place[:, 1:]).max() < 0.2
    world = ss.points(crossing, relative_to="world")["position"].values[own]
    assert np.ptp(world[:, 1]) > 5.0 > 3.0 * np.ptp(place[:, 0]), "it crossed 9 m of water"


def test_a_target_that_has_the_name_of_axes_changes_no_point(crossing: Path) -> None:
    """Points relative to the sonar were turned as well by how a target of the name sonar lay."""
    expected = {to: ss.points(crossing, relative_to=to) for to in ("sonar", "world")}
    for name, points in expected.items():
        tree = ss.open(crossing)
        tree["truth/targets"] = tree["truth/targets"].to_dataset().assign_coords(target=[name])
        assert ss.points(tree, relative_to=name).identical(points)


def test_only_built_frames_are_read_for_points(crossing: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 20 000 frames with 8 built, points took over ten minutes."""
    read, one = [], fused_points._frame

    def watched(tree: xr.DataTree, index: int, *rest: Any) -> dict[str, np.ndarray]:
        read.append(index)
        return one(tree, index, *rest)

    monkeypatch.setattr(fused_points, "_frame", watched)
    assert ss.points(crossing).identical(ss.points(crossing, range(64)))
    assert read == [0, 16, 32, 40, 63, *range(64)]


@pytest.mark.parametrize(("number", "error"), [(-1, IndexError), (64, IndexError), (0.5, TypeError)])
def test_points_of_a_frame_that_is_none_are_refused(crossing: Path, number: int, error: type[Exception]) -> None:
    """-1 gave the points of the last frame as of frame -1, and 0.5 those of frame 0."""
    with pytest.raises(error):
        ss.points(crossing, [number])


def test_points_are_on_hulls_that_move_and_turn_before_a_sonar_that_does(tmp_path: Path) -> None:
    """In the frame of each target, and as far from its sphere or box as their labels say; in the world as well. Points
    of a ball are as far as its facets glint beside each other, at rest as well; of a crate that was 8 mm, rms."""
    path = tmp_path / "s.zarr"
    assert schedule.build(loads(SWIMMING), path, workers=0, products="cloud").ok
    tree = ss.open(path)
    world = ss.points(tree, relative_to="world")["position"].values
    for number, name in enumerate(("ball", "crate")):
        cloud = ss.points(tree, relative_to=name)
        own = (cloud["target"].values == number) & (cloud["origin"].values == 0) & (cloud["family"].values == 0)
        place, frame = cloud["position"].values[own], cloud["frame"].values[own]
        beyond = np.abs(place) - [0.6, 0.3, 0.25]
        boxed = np.linalg.norm(np.maximum(beyond, 0.0), axis=1) - np.minimum(beyond.max(axis=1), 0.0)
        apart = boxed if number else np.abs(np.linalg.norm(place, axis=1) - 0.4)
        assert own.sum() > 10 and np.median(apart) < (0.003 if number else 0.01)
        assert np.sqrt(np.mean(apart**2)) < (0.005 if number else 0.02)
        np.testing.assert_allclose(cloud["distance"].values[own], apart, atol=4e-3)  # a mesh is inside its sphere
        met = tree["truth/targets/position_at_echo"].values[frame, 0, number]
        np.testing.assert_allclose(
            np.linalg.norm(world[own] - met, axis=1), np.linalg.norm(place, axis=1), rtol=0, atol=1e-6
        )
        outward = np.einsum("pj,pj->p", cloud["normal"].values[own], place)
        assert (outward > 0.0).all(), "normals point outwards"


def test_a_store_of_an_earlier_version_is_refused_by_a_line(crossing: Path) -> None:
    tree = ss.open(crossing)
    earlier = tree.copy()
    del earlier["truth"]["sonar_spin"]
    with pytest.raises(FieldError, match="has no truth/sonar_spin, which it takes to place points: build it again"):
        ss.points(earlier)


def test_files_hold_the_points_with_colours_normals_and_labels(crossing: Path, tmp_path: Path) -> None:
    import open3d as o3d

    cloud = ss.points(crossing, relative_to="remus")
    for ending in ("ply", "pcd"):
        back = o3d.t.io.read_point_cloud(str(write_points(cloud, tmp_path / f"a.{ending}")))
        assert np.allclose(back.point.positions.numpy(), cloud["position"].values, atol=1e-6)
        assert {"colors", "normals", "target", "frame", "snr"} <= set(dir(back.point)) | {
            k for k, _ in back.point.items()
        }
        assert np.array_equal(back.point["target"].numpy()[:, 0], cloud["target"].values)
    assert back.point.colors.numpy().std() > 0.0


@pytest.mark.parametrize("away", [0.0, 3e3, 9e5])
def test_files_of_points_far_from_the_origin_of_the_world_have_their_places(
    crossing: Path, tmp_path: Path, away: float
) -> None:
    """A scene may be 1000 km off: single precision put its points up to 3 cm beside where they are."""
    import open3d as o3d

    cloud = ss.points(crossing, relative_to="world")
    cloud["position"] = cloud["position"] + away * np.array([1.0, -1.0, 0.0])
    back = o3d.t.io.read_point_cloud(str(write_points(cloud, tmp_path / "a.ply")))
    np.testing.assert_allclose(back.point.positions.numpy(), cloud["position"].values, rtol=0.0, atol=1e-4)
    if away:
        with pytest.raises(ValueError, match=r"a\.pcd: would round places to .* m, so far off are they: a \.ply does"):
            write_points(cloud, tmp_path / "a.pcd")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--relative-to", "whale"], "must be sonar, world or a target (remus), not 'whale'"),
        (["a.ply", "--out", "b.ply"], "--out: where to write is given twice"),
        (["--to", "las"], "--to must be one of ply, pcd, coco, sonar-netcdf, bellhop, not las"),
        (["--frames", "5:70"], "ends past the last frame, 63"),
        (["--frames", "1:3"], "--frames: none of these frames has been built"),
        (["--to", "bellhop"], "is a folder: bellhop is of a recipe"),
        (["--out", "/dev/null/x.ply"], "/dev/null: is a file, and a folder is needed"),
    ],
)
def test_bad_input_gets_one_line(
    crossing: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], said: str
) -> None:
    assert run(app, ["export", str(crossing), "--out", str(tmp_path / "x"), *options]) == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_points_go_into_a_folder_that_is_there_or_not(crossing: Path, tmp_path: Path) -> None:
    for out, file in ((tmp_path, tmp_path / "remus.ply"), (tmp_path / "new" / "x.ply",) * 2):
        assert run(app, ["export", str(crossing), "--out", str(out)]) == 0
        assert file.stat().st_size > 1000


def test_the_command_writes_beside_the_store(crossing: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(app, ["export", str(crossing), "--relative-to", "remus"]) == 0
    assert crossing.with_suffix(".ply").stat().st_size > 1000
    assert "points" in capsys.readouterr().out
