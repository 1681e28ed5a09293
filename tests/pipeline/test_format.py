"""Format 3 of the store: read by names in plain xarray, older ones refused in a line, counts read as float32."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import sonarsynth as ss
from sonarsynth import schedule, store
from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.evaluation import labels_of_targets
from sonarsynth.pipeline import VARIABLES
from sonarsynth.products import PointCloud
from sonarsynth.recipe.reading import loads
from tools.fault_injection.hostile import _sealed

AXIS = "scene.processing.picking={kind: beam_axis}"  # many points


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory, small_text: str) -> Path:
    path = tmp_path_factory.mktemp("format") / "s.zarr"
    text = small_text.replace("  sonar:\n", "  sonar:\n    converter: {bits: 12, full_scale: 100}\n")
    assert schedule.build(loads(text), path, frames=(0, 1), workers=0).ok
    return path


def test_targets_are_found_by_name_and_no_variable_is_called_like_an_axis_of_its_group(built: Path) -> None:
    with xr.open_datatree(built, engine="zarr") as tree:
        name = str(tree["truth/targets"].coords["target"].values[0])
        for group in ("truth/targets", "link_budget"):
            assert tree[group].dataset.sel(target=name).sizes["frame"] == tree.sizes["frame"]
        assert tree["link_budget"].coords["target"].values[-1] == "direct"
        for node in tree.subtree:
            dataset = node.to_dataset(inherit=False)
            clash = {str(v) for v in dataset.variables} & {str(d) for d in dataset.dims}
            assert all(dataset[v].dims == (v,) for v in clash), (node.path, clash)


def test_the_cloud_is_a_list_whose_first_rows_are_its_points(built: Path) -> None:
    with xr.open_datatree(built, engine="zarr") as tree:
        cloud = tree["cloud"].dataset.isel(frame=[0, 1])
        there = np.arange(cloud.sizes["point"]) < cloud["count"].values[:, None]
        for name, variable in cloud.data_vars.items():
            if variable.dims == ("frame", "point") and name not in ("true_range", "distance"):
                none = np.isnan(variable.values) if variable.dtype.kind == "f" else variable.values == -1
                assert (none[~there]).all(), name
                assert variable.dtype.kind != "f" or not none[there].any(), name
        place = np.stack([cloud[axis].values for axis in "xyz"], axis=-1)[there]
        u = ss.conventions.direction(*(np.deg2rad(cloud[name].values[there]) for name in ("azimuth", "elevation")))
        np.testing.assert_allclose(place, u * cloud["range"].values[there][:, None], rtol=1e-5)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("points", 7, "numbers of points"),
        ("box_size", 3.0, "oriented boxes"),
        ("pixel_box", 1.0, "boxes in view"),
        ("truncation", 0.5, "boxes in view"),
        ("in_view", 0, "boxes in view"),
        ("full_box", 0.0, "boxes in view"),
    ],
)
def test_labels_of_targets_that_disagree_are_seen(built: Path, name: str, value: float, said: str) -> None:
    tree = xr.open_datatree(built, engine="zarr").load()
    targets = tree["truth/targets"].dataset
    frames = np.flatnonzero(targets["view"].values[:, 0] >= 0)
    assert labels_of_targets(tree, frames).ok is True
    counts = [(tree["cloud/target"].values[frame] == 0).sum() for frame in frames]
    assert targets["points"].values[frames, 0].tolist() == counts
    wrong = targets.copy(deep=True)
    wrong[name].values[frames[0]] = value
    tree["truth/targets"] = wrong
    found = labels_of_targets(tree, frames)
    assert not found.ok and said in found.got and found.frames == (frames[0],)


def test_the_loudest_points_are_kept_in_their_order_and_the_rest_are_counted() -> None:
    energy = np.array([3.0, 9.0, 1.0, 9.0, 5.0], np.float32)
    n = np.arange(5.0, dtype=np.float32)
    cloud = PointCloud(np.stack([n, n, n], axis=1), n, n, *[n.astype(float)] * 4, n, energy, n, overflow=2)
    few = cloud.loudest(3)
    assert few.range.tolist() == [1.0, 3.0, 4.0] and few.overflow == 4 and few.position[:, 2].tolist() == [1, 3, 4]
    assert cloud.loudest(5) is cloud and len(cloud.loudest(1)) == 1


def test_a_store_without_room_for_its_points_says_how_many_it_left_out() -> None:
    trees = [ss.render(ss.load("configs/tank.yaml", [f"scene.processing.max_points={n}", AXIS]), 0) for n in (4096, 5)]
    tree, few = (one["cloud"] for one in trees)
    count = int(tree["count"])
    assert count > 5 and int(tree["overflow"]) == 0
    assert int(few["count"]) == 5 and int(few["overflow"]) == count - 5
    louder = np.sort(tree["energy"].values[:count])[-5:]
    assert np.array_equal(np.sort(few["energy"].values), louder)
    for one in trees:  # the target has those that are left, and whose echo they are
        own = int((one["cloud/target"].values == 0).sum())
        assert one["truth/targets/points"].values.tolist() == [own] and own > 0


def test_pressure_reads_as_float32_and_is_what_plain_xarray_reads(built: Path) -> None:
    with xr.open_datatree(built, engine="zarr", chunks=None) as plain, ss.open(built) as tree:
        pressure = tree["signals/pressure"]
        assert pressure.dtype == np.float32
        np.testing.assert_allclose(pressure[0], plain["signals/pressure"][0], rtol=1e-6)
        assert np.isnan(pressure[2]).all()
        for node in plain.subtree:
            assert set(tree[node.path].to_dataset(inherit=False).variables) == set(
                node.to_dataset(inherit=False).variables
            )


def test_a_rendered_frame_has_the_types_and_the_numbers_of_a_store(small_text: str, tmp_path: Path) -> None:
    """To the bit: of coordinates too, but for texts, which zarr keeps at any length."""
    text = small_text.replace("  trajectory:", "    sensor_errors: {gain: 1 dB, phase: 10 deg}\n  trajectory:")
    recipe = loads(text)
    assert schedule.build(recipe, tmp_path / "s.zarr", frames=(1,), workers=0).ok
    stored, rendered = ss.open(tmp_path / "s.zarr"), ss.render(recipe, 1)
    for node in rendered.subtree:
        for name, own in node.to_dataset(inherit=False).variables.items():
            other = stored[node.path].to_dataset(inherit=False).variables[name]
            other = other.isel(frame=1) if "frame" in other.dims else other
            assert own.dims == other.dims and (own.dtype == other.dtype or own.dtype.kind == "U"), (node.path, name)
            np.testing.assert_array_equal(own.values, other.values, err_msg=f"{node.path}/{name}")


@pytest.mark.parametrize("command", ["build", "build --restart", "verify", "repair", "show", "card"])
def test_a_store_of_an_older_format_is_refused_in_one_line(
    command: str, built: Path, tmp_path: Path, small_text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    old, recipe = tmp_path / "old.zarr", tmp_path / "small.yaml"
    recipe.write_text(small_text)
    assert schedule.build(loads(small_text), old, frames=(0,), workers=0, products=()).ok
    root = json.loads((old / "zarr.json").read_text())
    root["attributes"]["sonarsynth_format"] = "2"
    (old / "zarr.json").write_text(json.dumps(root))
    name, *options = command.split()
    capsys.readouterr()
    source = [str(recipe)] if name == "build" else []
    status = run(app, [name, *source, str(old), *options, *(["--workers", "0", "--products", "truth"] * bool(source))])
    said = capsys.readouterr().err.strip().splitlines()
    if options:
        assert status == 0, said
    else:
        assert status == 2 and len(said) == 1 and "format 2" in said[0] and "--restart" in said[0]
        with pytest.raises(store.Mismatch, match="format 2"):
            ss.open(old)


def test_every_group_of_the_schema_is_on_the_page_of_the_store() -> None:
    page = Path("tools/docs/reference/the-store.md").read_text()
    assert all(f"`{group}`" in page for group in {v.group for v in VARIABLES} - {"/"})


@pytest.mark.parametrize("forged", [[], {"kind": "0", "must_understand": False, "metadata": {}}])
def test_forged_consolidated_metadata_are_a_problem_and_no_traceback(
    forged: object, tmp_path: Path, small_text: str
) -> None:
    path = tmp_path / "s.zarr"
    assert schedule.build(loads(small_text), path, frames=(0,), workers=0, products=()).ok
    root = json.loads((path / "zarr.json").read_text())
    root["consolidated_metadata"] = forged
    _sealed(path, root)
    report = store.verify(path)
    assert not report.ok and any("cannot be" in problem.what for problem in report.problems)


@pytest.mark.parametrize("name", ["code_digest", "shard_frames", "sonarsynth_version"])
def test_what_a_forged_attribute_holds_is_said_in_one_line(name: str, tmp_path: Path, small_text: str) -> None:
    path = tmp_path / "s.zarr"
    assert schedule.build(loads(small_text), path, frames=(0,), workers=0, products=()).ok
    root = json.loads((path / "zarr.json").read_text())
    root["attributes"][name] = "x\n# y"
    _sealed(path, root)
    with pytest.raises(store.Mismatch) as refused:
        schedule.build(loads(small_text), path, frames=(0,), workers=0, products=())
    assert str(refused.value).isprintable() and name[:4] in str(refused.value)
