"""`.sonar` of an opened store: its tables hold what xarray reads, its pictures what the frame holds."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import sonarsynth as ss
from sonarsynth import planning, schedule
from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.recipe import reading

BUILT = [2, 3]
TWO = """  - name: two
        shape: {kind: sphere, radius: 0.4, edge: 0.1}
        motion: {kind: still, position: [10, -2, -6]}
    sources:"""


@pytest.fixture(scope="module")
def tree(small_text: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[xr.DataTree]:
    """Two frames of twenty, of two spheres before 96 hydrophones."""
    text = small_text.replace("columns: 5, rows: 4", "columns: 12, rows: 8").replace("sources:", TWO, 1)
    text = text.replace("{kind: box, size: [1, 1, 1], edge: 0.25}", "{kind: sphere, radius: 0.4, edge: 0.1}")
    made = reading.loads(text.replace("azimuths: 11, elevations: 9", "azimuths: 21, elevations: 21"))
    path = tmp_path_factory.mktemp("opened") / "s.zarr"
    assert schedule.build(planning.plan(made), path, frames=BUILT, workers=0).ok
    with ss.open(path) as found:
        yield found


def test_points_are_those_of_the_cloud_without_padding(tree: xr.DataTree) -> None:
    table, cloud = tree.sonar.points(), tree["cloud"].to_dataset()
    counts = cloud["count"].values[BUILT]
    assert counts.sum() > 0
    assert [len(table.loc[frame]) if frame in table.index else 0 for frame in BUILT] == counts.tolist()
    for (frame, point), row in table.iterrows():
        for name in ("x", "y", "z", "range", "energy", "delay", "emission", "facet"):
            assert row[name] == cloud[name].values[frame, point]
        target = int(cloud["target"].values[frame, point])
        assert row["target"] == ["box", "two"][target] if target >= 0 else row.isna()["target"]
        meanings = cloud["family"].attrs["flag_meanings"].split()
        family = int(cloud["family"].values[frame, point])
        assert row["family"] == meanings[family] if family >= 0 else row.isna()["family"]


def test_points_of_a_frame_and_of_frames_that_are_not_there(tree: xr.DataTree) -> None:
    every = tree.sonar.points()
    assert tree.sonar.points(BUILT[0]).equals(every.loc[[BUILT[0]]] if BUILT[0] in every.index else every.iloc[:0])
    assert len(tree.sonar.points([0])) == 0  # not built
    with pytest.raises(IndexError, match=r"frame 20 is outside 0\.\.19"):
        tree.sonar.points(20)


def test_a_group_is_a_row_a_target_with_components_as_columns(tree: xr.DataTree) -> None:
    table, group = tree.sonar.table("truth/targets"), tree["truth/targets"]
    assert table.index.names == ["frame", "target"] and table.index.tolist() == [
        (n, name) for n in BUILT for name in ("box", "two")
    ]
    for i, axis in enumerate("xyz"):
        assert table[f"position_{axis}"].tolist() == group["position"].values[BUILT, :, i].ravel().tolist()
    assert table["box_7_z"].tolist() == group["box"].values[BUILT, :, 7, 2].ravel().tolist()
    assert table["image_box_elevation_max"].tolist() == group["image_box"].values[BUILT, :, 3].ravel().tolist()
    assert set(table["view"]) <= set(group["view"].attrs["flag_meanings"].split())
    assert "echo_level" in table.attrs["left_out"]


def test_rows_may_be_chosen(tree: xr.DataTree) -> None:
    table = tree.sonar.table("truth/targets", ["frame", "target", "family"], frames=3)
    level = tree["truth/targets"]["echo_level"].sel(frame=3, target="two")
    assert table.loc[(3, "two"), "echo_level"].to_numpy() == pytest.approx(level.values, nan_ok=True)
    assert table.loc[(3, "two")].index.tolist() == [str(name) for name in level["family"].values]
    assert table.loc[(3, "two"), "position_x"].nunique() == 1
    with pytest.raises(ValueError, match="truth/targets has no axis points"):
        tree.sonar.table("truth/targets", ["points"])
    assert tree.sonar.table("truth/targets", "frame").index.names == ["frame"]
    for group in ("nothing", "image/energy"):
        with pytest.raises(KeyError, match=r"is no group of the store, which has .*/truth/targets"):
            tree.sonar.table(group)


@pytest.mark.parametrize(
    ("group", "rows"),
    [
        ("/", ["frame"]),
        ("truth", ["frame"]),
        ("truth/emissions", ["frame", "emission"]),
        ("source_estimates", ["frame", "estimate"]),
        ("link_budget", ["frame", "emission", "target", "family"]),
        ("truth/beams", ["frame", "elevation", "azimuth"]),
        ("cloud", ["frame", "point"]),
        ("image", ["frame"]),
        ("signals", ["frame"]),
        ("targets/box", ["face"]),
    ],
)
def test_no_table_has_more_rows_than_its_axes(tree: xr.DataTree, group: str, rows: list[str]) -> None:
    table, sizes = tree.sonar.table(group), tree[group].to_dataset(inherit=True).sizes
    assert table.index.names == rows
    assert len(table) == np.prod([len(BUILT) if name == "frame" else sizes[name] for name in rows])
    assert len(table.columns) > 0


def test_a_target_is_chosen_by_name_and_a_frame_is_a_picture(tree: xr.DataTree) -> None:
    assert tree["truth/targets"].sel(target="box")["position"].dims == ("frame", "xyz")
    image = tree.sonar.image(3)
    drawn = next(axes for axes in image.axes if axes.images).images[0].get_array()
    energy = tree["image/energy"].isel(frame=3).values.astype(float)
    assert drawn is not None and drawn[:, ::-1].filled() == pytest.approx(10 * np.log10(energy / energy.max()))
    shown = tree.sonar.cloud(3).axes[0].get_title()
    assert "points on a target" in shown or "point on a target" in shown
    for picture in (tree.sonar.image, tree.sonar.cloud):
        with pytest.raises(ValueError, match="frame 0 has not been built"):
            picture(0)
        with pytest.raises(ValueError, match=r"frame 20 is outside 0\.\.19"):
            picture(20)


def test_tables_say_their_units(tree: xr.DataTree) -> None:
    cloud = tree["cloud"].dataset
    assert tree.sonar.points().attrs["units"] == {
        name: unit for name in tree.sonar.points().columns if (unit := cloud[name].attrs["units"]) != "1"
    }
    units = tree.sonar.table("truth/targets").attrs["units"]
    assert units["position_x"] == "m" and units["image_box_azimuth_min"] == "degree" and "visible_fraction" not in units


@pytest.mark.parametrize("take", ["points", "cloud", "table", "stack"])
def test_frames_are_numbers_or_a_mask_and_nothing_else(tree: xr.DataTree, take: str) -> None:
    """A mask taken for numbers would be frames 0 and 1, a negative number one from the end, and 2.5 frame 2."""
    frames = {
        "points": tree.sonar.points,
        "cloud": lambda chosen: ss.points(tree, chosen),
        "table": lambda chosen: tree.sonar.table("truth", frames=chosen),
        "stack": tree.sonar.stack,
    }[take]
    mask = tree["frame"] == 2
    assert frames(mask).equals(frames(2)) and frames(mask.values).equals(frames([2]))
    wrong = {IndexError: (-1, 20, [True, False], True), TypeError: (2.5, [2.5], "2", slice(2, 3))}
    for kind, chosen in ((kind, chosen) for kind, several in wrong.items() for chosen in several):
        with pytest.raises(kind, match="frame"):
            frames(chosen)


def test_it_says_which_frames_were_built_and_which_failed(
    tree: xr.DataTree, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    place = Path(tree.encoding["source"])
    said = f"{len(BUILT)} of {tree.sizes['frame']} built (2:4)"
    assert said in repr(tree.sonar) and "failed" not in repr(tree.sonar)
    log = place.with_name(f"{place.name}.failed.jsonl")
    log.write_text('{"frame": 7, "stage": "trace", "error": "X"}\n{"frame": 2}\n{"frame": [9]}\n')  # 2 was built since
    assert f"{said}, 1 failed (7:8)" in repr(tree.sonar)
    assert "1 of 15 built (3:4), 1 failed (7:8)" in repr(tree.isel(frame=slice(3, 18)).sonar)
    assert run(app, ["show", "--no-film", str(place)]) == 0
    assert f"frames     {said}, 1 failed (7:8)" in capsys.readouterr().out
    log.unlink()
    assert run(app, ["export", str(place), "--to", "coco", "--out", str(tmp_path / "coco")]) == 0
    assert "note: 18 of 20 frames have not been built, and are left out" in capsys.readouterr().out
