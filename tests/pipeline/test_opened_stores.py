"""`.sonar` of an opened store: its tables hold what xarray reads, its pictures what the frame holds."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import xarray as xr

import sonarsynth as ss
from sonarsynth import planning, schedule
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
    with pytest.raises(KeyError):
        tree.sonar.table("nothing")


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
