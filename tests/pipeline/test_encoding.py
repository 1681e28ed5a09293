"""Files of shards: to the byte those that zarr writes, from the same metadata."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import zarr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numcodecs import blosc
from zarr.core.buffer import default_buffer_prototype
from zarr.errors import ZarrUserWarning

from sonarsynth import store
from sonarsynth.planning import Plan
from sonarsynth.store.encoding import encoded, encoded_whole
from sonarsynth.store.layout import ArrayLayout, layout_of


@pytest.fixture(scope="module")
def laid_out(tmp_path_factory: pytest.TempPathFactory, small_plan: Plan) -> Path:
    """Short last shard: 20 frames, 8 a shard."""
    path = tmp_path_factory.mktemp("encoding") / "small.zarr"
    store.create(path, small_plan)
    return path


def by_zarr(path: Path, array: ArrayLayout, shard: int, block: np.ndarray) -> bytes | None:
    file = path / array.file(shard)
    file.unlink(missing_ok=True)
    target = zarr.open_group(path, mode="r+")[array.path]
    assert isinstance(target, zarr.Array)
    target[shard * array.shard : shard * array.shard + len(block)] = block
    written = file.read_bytes() if file.exists() else None
    file.unlink(missing_ok=True)
    return written


def test_what_no_frame_changes_is_as_zarr_writes_it(laid_out: Path, tmp_path: Path) -> None:
    path = shutil.copytree(laid_out, tmp_path / "again.zarr", ignore=shutil.ignore_patterns(".marks"))
    root = zarr.open_group(path, mode="r+", use_consolidated=False)
    for name, array in root.members(max_depth=None):
        metadata = array.metadata.to_buffer_dict(default_buffer_prototype())["zarr.json"].to_bytes()
        assert metadata == (path / name / "zarr.json").read_bytes(), name
        for file in (path / name).glob("c*") if isinstance(array, zarr.Array) else ():
            values = array[...]
            file.unlink()
            with zarr.config.set({"array.write_empty_chunks": True}):
                zarr.open_array(path / name, mode="r+")[...] = values
    with pytest.warns(ZarrUserWarning, match="Consolidated"):
        zarr.consolidate_metadata(path)
    for file in laid_out.rglob("*"):
        assert (
            file.is_dir()
            or ".marks" in file.parts
            or file.read_bytes() == (path / file.relative_to(laid_out)).read_bytes()
        ), file


def in_chunks(array: ArrayLayout, block: np.ndarray) -> list[np.ndarray]:
    return [block[at : at + array.chunk] for at in range(0, len(block), array.chunk)]


def numbers(array: ArrayLayout, frames: int, seed: int, noise: float) -> np.ndarray:
    made = 100.0 * noise * np.random.default_rng(seed).normal(size=(frames, *array.shape[1:]))
    return made.astype(array.dtype)


@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 99), shard=st.integers(0, 2), gone=st.sets(st.integers(0, 7)), noise=st.sampled_from([0, 1]))
def test_every_array_is_encoded_as_by_zarr(
    laid_out: Path, small_plan: Plan, seed: int, shard: int, gone: set[int], noise: int
) -> None:
    layout = layout_of(small_plan)
    region = layout.region(shard)
    for array in {(a.dtype, a.chunk, a.shape[1:]): a for a in layout.arrays}.values():
        block = numbers(array, len(region), seed, noise)
        block[[frame for frame in gone if frame < len(block)]] = array.variable.fill
        assert encoded(array, in_chunks(array, block)) == by_zarr(laid_out, array, shard, block), array.path


def test_what_is_all_fill_has_no_file(small_plan: Plan) -> None:
    for array in layout_of(small_plan).arrays:
        block = np.full((8, *array.shape[1:]), array.variable.fill, array.dtype)
        assert encoded(array, in_chunks(array, block)) is None
        assert encoded(array, in_chunks(array, numbers(array, 8, 1, 1.0))) is not None


def test_numbers_of_another_byte_order_make_the_same_file(small_plan: Plan) -> None:
    for array in layout_of(small_plan).arrays:
        block = numbers(array, 8, 2, 1.0)
        other = block.astype(array.dtype.newbyteorder(">"))
        assert encoded(array, in_chunks(array, other)) == encoded(array, in_chunks(array, block))


def test_a_large_array_makes_the_same_file_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Threads of blosc put its blocks into the file in the order in which they end, unless zarr was imported."""
    monkeypatch.setattr(blosc, "use_threads", None)
    signals = np.random.default_rng(1).normal(size=(8, 64, 4000)).astype("f4")
    assert len({encoded_whole(signals) for _ in range(6)}) == 1


def test_one_frame_a_shard_is_one_chunk(small_plan: Plan, tmp_path: Path) -> None:
    made = replace(small_plan, shard_frames=1)
    store.create(tmp_path / "s.zarr", made)
    for array in layout_of(made).arrays:
        block = numbers(array, 1, 3, 1.0)
        assert encoded(array, in_chunks(array, block)) == by_zarr(tmp_path / "s.zarr", array, 4, block), array.path
