"""Frames for training: what they hold is what xarray reads, bit for bit, and what the recipe renders."""

from __future__ import annotations

import json
import multiprocessing
import pickle
import shutil
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import sonarsynth as ss
from sonarsynth.evaluation.detectors import true_objects
from sonarsynth.export.coco_files import write_coco
from sonarsynth.loading import Frames, RenderedFrames
from sonarsynth.loading.training_samples import FLOOR
from sonarsynth.recipe import Recipe
from sonarsynth.store import Damage, Mismatch
from sonarsynth.store.frame_reading import FrameReader

BUILT = range(2, 18)
EVERY = ("boxes", "mask", "points", "range", "range_boxes", "range_mask")


def same(one: dict[str, Any], other: dict[str, Any]) -> bool:
    return one.keys() == other.keys() and all(np.array_equal(one[k], other[k], equal_nan=True) for k in one)


@pytest.mark.parametrize("split", [None, "train", "test"])
def test_samples_are_of_the_built_frames_of_a_split(partly_built: Path, split: str | None) -> None:
    tree = ss.open(partly_built)
    data = Frames(partly_built, split=split, image="energy", targets=EVERY, signals=True)
    built = np.array(BUILT)
    number = None if split is None else ["train", "validation", "test"].index(split)
    expected = built if number is None else built[tree["split"].values[built] == number]
    assert data.frames.tolist() == expected.tolist() and len(data) > 0
    objects = true_objects(tree, data.frames)
    for row, frame in enumerate(data.frames.tolist()):
        sample = data[row]
        assert sample["frame"] == frame
        np.testing.assert_array_equal(sample["image"], tree["image/energy"].values[frame])
        np.testing.assert_array_equal(sample["pressure"], tree["signals/pressure"].values[frame])
        np.testing.assert_array_equal(sample["range"], tree["truth/beams/range"].values[frame])
        own = objects.frame == frame
        np.testing.assert_array_equal(sample["boxes"], objects.box[own].astype(np.float32))
        assert sample["categories"].tolist() == objects.category[own].tolist()
        whose = tree["truth/beams/target"].values[frame]
        names = np.array([*tree["truth/targets/category"].values[frame], -1])
        np.testing.assert_array_equal(sample["mask"], names[whose])
        cells = tree["range_image/target"].values[frame]
        np.testing.assert_array_equal(sample["range_mask"], names[cells])
        assert {0, 1} <= set(cells.ravel()) and sample["range_targets"].tolist() == [0], "the rock is clutter"
        rows, columns = np.nonzero(cells == 0)
        box = [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
        assert sample["range_boxes"].tolist() == [box] and sample["range_categories"].tolist() == [names[0]]
        count = int(tree["cloud/count"].values[frame])
        np.testing.assert_array_equal(sample["points"][:, 1], tree["cloud/y"].values[frame, :count])
        floats = [value for value in sample.values() if np.asarray(value).dtype.kind == "f"]
        assert {value.dtype for value in floats} == {np.dtype(np.float32)}


def test_levels_are_re_the_brightest_beam(partly_built: Path) -> None:
    levels, energy = Frames(partly_built), Frames(partly_built, image="energy")
    for row in range(len(levels)):
        level, plain = levels[row]["image"], energy[row]["image"]
        assert level.dtype == np.float32 and level.max() == 0.0 and np.isfinite(level).all()
        expected = np.maximum(10.0 * np.log10(plain / plain.max()), FLOOR)
        np.testing.assert_allclose(level, expected, atol=1e-4)
    cells, stored = Frames(partly_built, image="range_db"), ss.open(partly_built)["range_image/energy"].values
    for row, frame in enumerate(cells.frames.tolist()):
        expected = np.maximum(10.0 * np.log10(np.nan_to_num(stored[frame]) / np.nanmax(stored[frame]) + 1e-30), FLOOR)
        np.testing.assert_allclose(cells[row]["image"], expected, atol=1e-4)


def test_batches_are_the_samples_in_the_order_asked(partly_built: Path) -> None:
    data = Frames(partly_built, targets=("boxes", "mask"))
    rows = [7, 0, 11, 0, 3]
    samples = data.__getitems__(rows)
    assert all(same(sample, data[row]) for sample, row in zip(samples, rows, strict=True))
    batch = data.collate(samples)
    assert batch["image"].shape == (5, 9, 11) and batch["frame"].tolist() == data.frames[rows].tolist()
    assert [box.shape[1] for box in batch["boxes"]] == [4] * 5
    samples[0]["image"][:] = 7.0
    assert not (data[7]["image"] == 7.0).any(), "a sample is the caller's own"
    with pytest.raises(IndexError):
        data[16]


def take(data: Frames, row: int) -> dict[str, Any]:
    return data[row]


def test_it_is_pickled_and_read_by_processes_that_are_forked(partly_built: Path) -> None:
    data = Frames(partly_built, targets=EVERY)
    expected = [data[row] for row in range(4)]  # files are open now
    again = pickle.loads(pickle.dumps(data))
    assert all(same(again[row], sample) for row, sample in enumerate(expected))
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("fork")) as pool:
        found = list(pool.map(take, [data] * 4, range(4)))
    assert all(same(one, sample) for one, sample in zip(found, expected, strict=True))


def test_rendered_frames_are_those_of_the_store(varied: Recipe, partly_built: Path) -> None:
    stored = Frames(partly_built, split="train", targets=("boxes", "mask"))
    rendered = RenderedFrames(varied, split="train", targets=("boxes", "mask"), seed=3)
    found = {}
    for _, sample in zip(range(4), rendered, strict=False):
        found[sample["frame"]] = sample
    where = {int(frame): row for row, frame in enumerate(stored.frames)}
    both = found.keys() & where.keys()
    assert both and all(same(found[frame], stored[where[frame]]) for frame in both)
    assert rendered.categories == stored.categories == ("target",)
    parts = [RenderedFrames(varied, split="train", seed=3, part=(k, 3)).frames for k in range(3)]
    assert sorted(np.concatenate(parts).tolist()) == sorted(rendered.frames.tolist())
    assert rendered.frames.tolist() != sorted(rendered.frames.tolist())


def test_a_damaged_file_is_no_data(partly_built: Path, tmp_path: Path) -> None:
    copy = tmp_path / "s.zarr"
    shutil.copytree(partly_built, copy)
    (file, *_) = sorted((copy / "signals" / "pressure").glob("c.*"))
    content = bytearray(file.read_bytes())
    for at in (20, len(content) - 30, len(content) - 2):  # a chunk, the index, the checksum of the index
        file.write_bytes(bytes(content[:at]) + bytes([content[at] ^ 16]) + bytes(content[at + 1 :]))
        with pytest.raises(Damage, match="checksum is wrong"):
            _ = [FrameReader(copy).array("signals/pressure")[frame] for frame in range(20)]
    file.write_bytes(bytes(content[:10]))
    with pytest.raises(Damage):
        _ = [FrameReader(copy).array("signals/pressure")[frame] for frame in range(20)]
    file.unlink()
    file.symlink_to(partly_built / "zarr.json")
    with pytest.raises(OSError, match="link"):
        _ = [FrameReader(copy).array("signals/pressure")[frame] for frame in range(20)]


@pytest.mark.parametrize(
    "name", ["image/energy", "signals/pressure", "truth/targets/pixel_box", "truth/sonar_position"]
)
def test_a_missing_file_is_no_data(partly_built: Path, tmp_path: Path, name: str) -> None:
    """zarr takes it for one of fill values: images of -60 dB everywhere, frames without boxes, or fewer frames."""
    copy = tmp_path / "s.zarr"
    shutil.copytree(partly_built, copy)
    (file, *_) = sorted((copy / name).glob("c.*"))
    file.unlink()
    with pytest.raises(Damage, match=f"^{name}/{file.name}: the file is missing: 'sonarsynth repair' restores it$"):
        Frames(copy, signals=True)
    if name != "truth/sonar_position":
        assert len(Frames(copy, image="none", targets="points")) == 16
    if name == "image/energy":
        plain = xr.open_datatree(copy, engine="zarr")
        for use, said in (
            (lambda: ss.detect(copy), "energy/c.0.0.0: the file"),
            (lambda: write_coco(ss.open(copy), tmp_path, np.arange(2, 18)), "energy/c.0.0.0: the file"),
            (lambda: ss.detect(plain), "energy: that of frame 2"),
            (lambda: write_coco(plain, tmp_path, np.arange(2, 18)), "energy: that of frame 2"),
        ):
            with pytest.raises(Damage, match=f"^image/{said} is missing: 'sonarsynth repair' restores it"):
                use()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"shape": [20, 10**6, 10**6]}, "does not lie as sonarsynth writes it"),
        ({"codecs": [{"name": "gzip"}]}, "does not lie as"),
        ({"data_type": "object"}, "does not lie as|cannot be read"),
        ({"chunk_grid": {}}, "metadata cannot be read"),
        ({"shape": [20, 9, 12]}, "does not lie as"),
        (
            {"shape": [20, 9, 12], "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [8, 9, 12]}}},
            "not of the size that the array has",
        ),
    ],
)
def test_metadata_are_not_believed(partly_built: Path, tmp_path: Path, change: dict[str, Any], said: str) -> None:
    """Of a store without marks, by which nobody knows what they were."""
    copy = tmp_path / "s.zarr"
    shutil.copytree(partly_built, copy, ignore=shutil.ignore_patterns(".marks"))
    document = json.loads((copy / "zarr.json").read_text())
    document["consolidated_metadata"]["metadata"]["image/energy"] |= change
    (copy / "zarr.json").write_text(json.dumps(document))
    with pytest.raises((Mismatch, Damage), match=said):
        _ = FrameReader(copy).array("image/energy")[2]


def test_what_is_not_there_is_said(partly_built: Path, tmp_path: Path) -> None:
    for options, said in (
        ({"image": "picture"}, "image: must be one of db, energy, range_db, none, not 'picture'"),
        ({"targets": "box"}, "targets: must be of boxes, mask, range, points, range_boxes, range_mask, not 'box'"),
        ({"split": "exam"}, "split: must be one of train, validation, test, not 'exam'"),
    ):
        with pytest.raises(ss.FieldError, match=said):
            Frames(partly_built, **options)  # type: ignore[arg-type]
    with pytest.raises(Mismatch, match="is no store of sonarsynth"):
        Frames(tmp_path)
    with pytest.raises(Mismatch, match="copy the store"):
        Frames("s3://bucket/s.zarr")
