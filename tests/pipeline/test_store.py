"""The store: laid out from the plan, plain to read, written in whole shards, resumed from its marks."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import zarr

from sonarsynth import store
from sonarsynth.pipeline import Values
from sonarsynth.planning import Plan, plan
from sonarsynth.recipe.reading import loads
from sonarsynth.store import layout_of
from sonarsynth.store.files.within import write_atomically

MadeUp = Callable[[Plan, int], Values]


@pytest.fixture
def laid_out(tmp_path: Path, small_plan: Plan) -> Path:
    path = tmp_path / "small.zarr"
    store.create(path, small_plan)
    return path


def opened(path: Path) -> xr.DataTree:
    with xr.open_datatree(path, engine="zarr", chunks=None) as tree:
        return tree.load()


def test_the_layout_opens_in_plain_xarray_with_units_on_everything(laid_out: Path, small_plan: Plan) -> None:
    tree = opened(laid_out)
    assert {"signals", "image", "cloud", "source_estimates", "truth", "link_budget", "targets"} <= set(tree.children)
    for node in tree.subtree:
        for name, variable in node.to_dataset(inherit=False).variables.items():
            assert variable.attrs.get("units"), f"{node.path}/{name}"
    assert tree["signals/pressure"].shape == (20, 20, small_plan.sizes["sample"])
    assert tree.attrs["products"] == ["cloud", "image", "signals"]
    assert loads(tree.attrs["recipe"]) == small_plan.recipe


def test_unwritten_numbers_read_as_nan_or_minus_one(laid_out: Path, small_plan: Plan) -> None:
    tree = opened(laid_out)
    for array in layout_of(small_plan).arrays:
        values = tree[array.path].values
        assert (np.isnan(values) if array.dtype.kind == "f" else values == -1).all(), array.path


def test_what_is_written_is_what_is_read(laid_out: Path, small_plan: Plan, made_up: MadeUp) -> None:
    values = {frame: made_up(small_plan, frame) for frame in range(8, 16)}
    store.write_shard(laid_out, small_plan, 1, values)
    tree = opened(laid_out)
    for array in layout_of(small_plan).arrays:
        for frame in values:
            np.testing.assert_array_equal(tree[array.path].values[frame], values[frame][array.key])


def test_lists_are_handed_on_as_long_as_they_are_and_filled_where_they_are_stored(
    laid_out: Path, small_plan: Plan, made_up: MadeUp
) -> None:
    """Room for 4096 points is no reason to hold 4096 of them in each frame that waits for its shard."""
    arrays = [array for array in layout_of(small_plan).arrays if array.variable.dims == ("frame", "point")]
    values = made_up(small_plan, 3)
    given = {array.key: values[array.key][:2] for array in arrays}
    store.write_shard(laid_out, small_plan, 0, {3: values | given})
    tree = opened(laid_out)
    for array in arrays:
        stored = tree[array.path].values[3]
        assert (
            (stored[:2] == given[array.key]).all() and len(stored) > 2 and array.is_fill(stored[2:].astype(array.dtype))
        )


def test_a_converter_stores_counts_that_read_as_pascals(tmp_path: Path, small_text: str, made_up: MadeUp) -> None:
    made = plan(loads(small_text.replace("  sonar:\n", "  sonar:\n    converter: {bits: 12, full_scale: 100}\n")))
    store.create(tmp_path / "s.zarr", made)
    values = {frame: made_up(made, frame) for frame in range(8)}
    store.write_shard(tmp_path / "s.zarr", made, 0, values)
    assert zarr.open_array(tmp_path / "s.zarr/signals/pressure", mode="r").dtype == np.int16
    pressure = opened(tmp_path / "s.zarr")["signals/pressure"].values
    np.testing.assert_allclose(pressure[3], values[3]["/signals", "pressure"].astype(float) * 100 / 2**11, rtol=1e-6)
    assert np.isnan(pressure[8:]).all()


def test_codecs_have_checksums_and_frames_are_chunks(laid_out: Path) -> None:
    pressure = zarr.open_array(laid_out / "signals/pressure", mode="r")
    assert pressure.chunks[0] == 1
    assert pressure.shards[0] == 8
    assert [type(codec).__name__ for codec in pressure.compressors] == ["BloscCodec", "Crc32cCodec"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda v: v.pop(("/image", "energy")), "differ in image/energy"),
        (lambda v: v.update({("/image", "colour"): np.zeros(3)}), "differ in image/colour"),
        (lambda v: v.update({("/image", "energy"): np.zeros((11, 9))}), "image/energy has shape"),
        (lambda v: v.update({("/image", "energy"): np.zeros((9, 11), complex)}), "image/energy is complex128"),
        (
            lambda v: v.update({("/truth/beams", "target"): np.full((9, 11), 40_000)}),
            "truth/beams/target does not fit in int16",
        ),
        (lambda v: v.update({("/truth/beams", "target"): np.zeros((9, 11))}), "truth/beams/target is float64"),
    ],
)
def test_values_that_do_not_fit_the_layout_are_refused_before_anything_is_written(
    laid_out: Path, small_plan: Plan, made_up: MadeUp, change: Callable[[Values], object], message: str
) -> None:
    values = made_up(small_plan, 0)
    change(values)
    with pytest.raises(ValueError, match=message):
        store.write_shard(laid_out, small_plan, 0, {0: values})
    assert not list(laid_out.glob("*/*/c.0.0.0"))
    assert store.frames_there(laid_out) == []


def test_a_frame_of_another_shard_is_refused(laid_out: Path, small_plan: Plan, made_up: MadeUp) -> None:
    with pytest.raises(ValueError, match="frame 8 is not in shard 0"):
        store.write_shard(laid_out, small_plan, 0, {8: made_up(small_plan, 8)})
    with pytest.raises(IndexError, match="shard 3 is outside"):
        store.write_shard(laid_out, small_plan, 3, {})


def test_missing_shards_are_those_without_the_frames_wanted(laid_out: Path, small_plan: Plan, made_up: MadeUp) -> None:
    assert store.missing(laid_out, small_plan, [3, 9]) == {0: (3,), 1: (9,)}
    store.write_shard(laid_out, small_plan, 0, {frame: made_up(small_plan, frame) for frame in range(5)})
    assert store.frames_there(laid_out) == [0, 1, 2, 3, 4]
    assert store.missing(laid_out, small_plan, range(3)) == {}
    assert store.missing(laid_out, small_plan, [6]) == {0: (0, 1, 2, 3, 4, 6)}
    assert store.missing(laid_out, small_plan) == {0: tuple(range(8)), 1: tuple(range(8, 16)), 2: tuple(range(16, 20))}
    with pytest.raises(IndexError, match="frame 20 is outside"):
        store.missing(laid_out, small_plan, [20])


def test_a_shard_without_its_mark_is_missing(laid_out: Path, small_plan: Plan, made_up: MadeUp) -> None:
    store.write_shard(laid_out, small_plan, 2, {16: made_up(small_plan, 16)})
    mark = laid_out / ".marks/2.json"
    mark.write_text(mark.read_text().replace("[16]", "[16, 17]"))
    assert store.missing(laid_out, small_plan, [16]) == {2: (16,)}
    mark.unlink()
    assert store.missing(laid_out, small_plan, [16]) == {2: (16,)}


def test_another_recipe_is_refused_with_the_difference(laid_out: Path, small_plan: Plan, small_text: str) -> None:
    store.create(laid_out, small_plan)
    other = plan(loads(small_text.replace("frames: 20", "frames: 21")))
    with pytest.raises(store.Mismatch, match=r"scene\.trajectory\.frames: 20, now 21"):
        store.create(laid_out, other)
    with pytest.raises(store.Mismatch, match="products: "):
        store.create(laid_out, replace(small_plan, products=frozenset({"image"})))
    store.create(laid_out, other, restart=True)
    assert opened(laid_out).sizes["frame"] == 21
    assert sorted(p.name for p in laid_out.parent.iterdir()) == [laid_out.name]


def test_a_layout_that_was_cut_short_leaves_no_store(
    tmp_path: Path, small_plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "s.zarr"
    with monkeypatch.context() as patch:
        patch.setattr("sonarsynth.store.creating.save_mark", lambda *_: (_ for _ in ()).throw(OSError("disk full")))
        with pytest.raises(OSError, match="disk full"):
            store.create(path, small_plan)
    assert not path.exists()
    store.create(path, small_plan)
    assert [p.name for p in tmp_path.iterdir()] == ["s.zarr"]


def test_a_damaged_layout_is_not_built_on(laid_out: Path, small_plan: Plan) -> None:
    (laid_out / "truth/zarr.json").write_text("{}")
    with pytest.raises(store.Damage, match=r"truth/zarr\.json is missing or has changed"):
        store.create(laid_out, small_plan)


OTHER = """\
import os, sys
from sonarsynth.store import StoreLocked
from sonarsynth.store.files.lock import lock
try:
    with lock(sys.argv[1]):
        pass
except StoreLocked as locked:
    print(locked, flush=True)
with lock(sys.argv[1] + ".dies"):
    os._exit(9)
"""
"""Another process: it is refused a store that this one builds, and dies while it builds one itself."""


def test_two_builders_exclude_each_other_and_one_that_dies_leaves_no_lock(tmp_path: Path) -> None:
    path = tmp_path / "s.zarr"
    with store.lock(path):
        with pytest.raises(store.StoreLocked, match=r"s\.zarr is being built by process \d+ on "), store.lock(path):
            raise AssertionError
        done = subprocess.run([sys.executable, "-c", OTHER, path], capture_output=True, text=True, check=False)
        assert "is being built by process" in done.stdout
    with store.lock(path):
        pass
    assert done.returncode == 9
    died = tmp_path / "s.zarr.dies"
    assert [file.name for file in tmp_path.iterdir()] == [f"{died.name}.lock"]
    with store.lock(died):
        pass
    assert list(tmp_path.iterdir()) == []


def test_scenes_without_targets_or_snaps_have_a_store(tmp_path: Path, small_text: str, made_up: MadeUp) -> None:
    head, _, rest = small_text.partition("    targets:")
    made = plan(loads(head + rest[rest.index("  sonar:") :]))
    path = tmp_path / "empty.zarr"
    store.create(path, made)
    store.write_shard(path, made, 0, {frame: made_up(made, frame) for frame in range(8)})
    assert opened(path)["truth/targets/position"].shape == (20, 0, 3)
    assert store.verify(path).problems == ()
    shutil.rmtree(path)


def test_a_file_that_cannot_be_written_is_named_whole(tmp_path: Path) -> None:
    """By its own name and folder, not by that of the file which would have become it."""
    name = "n" * 250  # fits, but not with what a file has in its name until it is whole
    with pytest.raises(OSError, match="too long") as raised:
        write_atomically(tmp_path, name, b"")
    assert raised.value.filename == f"{tmp_path}/{name}"
