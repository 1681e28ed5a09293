"""Arrays of a store as they are read without zarr, by `ss.open` and frame by frame: what plain xarray reads, bit for
bit, whichever part is asked for, and each file once."""

from __future__ import annotations

import asyncio
import json
import shutil
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
import zarr

import sonarsynth as ss
from sonarsynth import planning, schedule
from sonarsynth.recipe import Recipe
from sonarsynth.store import Damage, Mismatch
from sonarsynth.store.files import within
from sonarsynth.store.frame_reading import FrameReader

PARTS: tuple[Any, ...] = (
    7,
    slice(3, 17, 4),
    slice(None, None, -1),
    [17, 2, 2, 9],
    [],
    np.arange(20) % 3 == 0,
)
"""Of the frames."""


@pytest.fixture(scope="module")
def whole(partly_built: Path) -> Path:
    return partly_built


def plain(path: Path) -> Iterator[tuple[str, xr.Variable]]:
    """Arrays of numbers of frames as plain xarray reads them; packed ones in the precision of their scale."""
    for node in xr.open_datatree(path, engine="zarr", mask_and_scale=False).subtree:
        for name, raw in node.to_dataset(inherit=False).variables.items():
            if raw.dims[:1] != ("frame",) or name == "frame" or raw.dtype.kind not in "iuf":
                continue
            values = raw.values
            if "scale_factor" in raw.attrs:
                pressure = values * np.float32(raw.attrs["scale_factor"])
                values = np.where(values != raw.attrs["_FillValue"], pressure, np.float32(np.nan))
            yield f"{node.path}/{name}".strip("/"), xr.Variable(raw.dims, values, raw.attrs)


def test_every_array_is_what_xarray_reads(whole: Path) -> None:
    tree, reader = ss.open(whole), FrameReader(whole)
    arrays = dict(plain(whole))
    assert len(arrays) > 60 and {"signals/pressure", "beams/level", "truth/targets/view"} <= set(arrays)
    for name, expected in arrays.items():
        found = tree[name].variable
        assert (found.dtype, found.dims) == (expected.dtype, expected.dims), name
        for part in PARTS:
            np.testing.assert_array_equal(found[part].values, expected[part].values, err_msg=name)
        np.testing.assert_array_equal(found.values, expected.values, err_msg=name)
        if 0 not in expected.shape:
            array = reader.array(name)
            assert array.shape == expected.shape and array.every().dtype == expected.dtype
            np.testing.assert_array_equal(array.every(), expected.values, err_msg=name)
            for frame in (0, 2, 17, 19, 7):
                np.testing.assert_array_equal(array[frame], expected.values[frame], err_msg=name)


def test_parts_of_further_axes_are_what_xarray_reads(whole: Path) -> None:
    """Numbers, slices, lists and points, of several axes at once."""
    expected = dict(plain(whole))["image/energy"]
    pairs = {axis: xr.Variable("pair", [2, 5, 7]) for axis in expected.dims}
    for chosen in (
        {"elevation": 3},
        {"frame": 5, "azimuth": [4, 1]},
        {"frame": [9, 3], "elevation": slice(7, 1, -2), "azimuth": [0, 10, 4]},
        {"frame": slice(4, 12, 3), "elevation": [1, 8], "azimuth": 2},
        {"elevation": np.arange(9) > 4, "azimuth": slice(0, 0)},
        pairs,
    ):
        for variable in (
            ss.open(whole)["image/energy"].variable,
            ss.open(whole)["image/energy"].variable.chunk(frame=3),
        ):
            np.testing.assert_array_equal(
                variable.isel(chosen).values, expected.isel(chosen).values, err_msg=str(chosen)
            )


def test_each_file_is_opened_once_and_no_other(whole: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not once for each chunk and component: the points of 100 000 frames take 2 s of one core so, and 19 otherwise."""
    opened, real = Counter[str](), within.opened

    def counted(root: within.Root, name: str) -> AbstractContextManager[Any]:
        opened[name] += 1
        return real(root, name)

    monkeypatch.setattr(within, "opened", counted)
    for read, group in (
        (lambda tree: tree.sonar.points(), "cloud/"),
        (lambda tree: tree.sonar.table("truth/targets"), "truth/targets/"),
        (lambda tree: tree["signals/pressure"].values, "signals/pressure/"),
    ):
        tree = ss.open(whole)
        opened.clear()
        read(tree)
        files = {name: count for name, count in opened.items() if name.startswith(group) and "/c." in name}
        written = {str(path.relative_to(whole)) for path in (whole / group).rglob("c.*")}
        assert set(files.values()) == {1} and len(written & files.keys()) > 2
    tree = ss.open(whole)
    opened.clear()
    _ = tree["image/energy"][9, 2].values
    assert [name for name in opened if "/c." in name] == ["image/energy/c.1.0.0"]


def test_loops_of_asyncio_read_the_same(whole: Path) -> None:
    read = asyncio.run(ss.open(whole)["cloud"].to_dataset().load_async())
    np.testing.assert_array_equal(read["x"].values, dict(plain(whole))["cloud/x"].values)


def test_threads_read_the_same(whole: Path) -> None:
    tree, expected = ss.open(whole), dict(plain(whole))
    names = ["image/energy", "cloud/x", "signals/pressure"]
    frames = [(name, frame) for frame in range(20) for name in names]
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda at: tree[at[0]][at[1]].values, frames))
    for (name, frame), values in zip(frames, found, strict=True):
        np.testing.assert_array_equal(values, expected[name].values[frame])


def test_what_a_build_has_written_since_is_read(varied: Recipe, tmp_path: Path) -> None:
    plan, path = planning.plan(varied, {"image"}), tmp_path / "s.zarr"
    assert schedule.build(plan, path, frames=range(2), workers=0).ok
    tree = ss.open(path)
    assert np.isnan(tree["image/energy"][12].values).all() and np.isnan(tree["image/energy"][3].values).all()
    assert schedule.build(plan, path, frames=range(14), workers=0).ok
    assert all(np.isfinite(tree["image/energy"][frame].values).any() for frame in (12, 3, 13, 0))


LAID: dict[str, dict[str, Any]] = {
    "other chunks": {"chunks": (4, 3, 11)},
    "other chunks in a shard": {"chunks": (2, 9, 5), "shards": (8, 9, 15)},
    "the index first": {
        "chunks": (1, 9, 11),
        "shards": {"shape": (8, 9, 11), "index_location": "start"},
    },
    "the other end first": {"chunks": (8, 9, 11), "serializer": zarr.codecs.BytesCodec(endian="big")},
    "another compression": {"chunks": (8, 9, 11), "compressors": [zarr.codecs.GzipCodec()]},
}


@pytest.mark.parametrize("how", LAID)
@pytest.mark.filterwarnings("ignore::sonarsynth.store.marks.Unmarked")
def test_what_others_lay_otherwise_is_read_as_it_lies(whole: Path, tmp_path: Path, how: str) -> None:
    """By xarray, as zarr says; frame by frame it is refused."""
    copy = tmp_path / "s.zarr"
    shutil.copytree(whole, copy, ignore=shutil.ignore_patterns(".marks"))
    before = dict(plain(copy))["image/energy"]
    shutil.rmtree(copy / "image/energy")
    options: dict[str, Any] = {"compressors": [zarr.codecs.BloscCodec(), zarr.codecs.Crc32cCodec()], **LAID[how]}
    names = {"chunk_key_encoding": {"name": "default", "separator": "."}, "dimension_names": before.dims}
    array = zarr.create_array(
        copy, name="image/energy", shape=before.shape, dtype="float32", fill_value=np.nan, **names, **options
    )
    array[:] = before.values
    root, own = (json.loads((copy / at / "zarr.json").read_text()) for at in ("", "image/energy"))
    root["consolidated_metadata"]["metadata"]["image/energy"] = own | {"attributes": before.attrs}
    (copy / "zarr.json").write_text(json.dumps(root))
    np.testing.assert_array_equal(dict(plain(copy))["image/energy"].values, before.values)
    np.testing.assert_array_equal(ss.open(copy)["image/energy"].values, before.values)
    with pytest.raises(Mismatch, match="does not lie as sonarsynth writes it"):
        FrameReader(copy).array("image/energy")


@pytest.mark.parametrize("change", ["a bit", "no end", "nothing left"])
def test_a_damaged_file_is_named_with_its_remedy(copy: Path, change: str) -> None:
    for name in ("image/energy", "truth/targets/position"):
        file = min((copy / name).glob("c.*"))
        content = file.read_bytes()
        flipped = content[:20] + bytes([content[20] ^ 1]) + content[21:]
        file.write_bytes({"a bit": flipped, "no end": content[:-9], "nothing left": b""}[change])
        with pytest.raises(Damage, match=f"^{name}/{file.name}: .*: 'sonarsynth repair' restores it"):
            _ = ss.open(copy)[name].values
