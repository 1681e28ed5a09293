"""The same arrays whatever the order, the shards, the locale, the time zone, the hash seed and the folder."""

from __future__ import annotations

import os
import random
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import zarr
from threadpoolctl import threadpool_info, threadpool_limits

from sonarsynth import pipeline
from sonarsynth.planning import Plan
from sonarsynth.schedule import build

ROOT = Path(__file__).resolve().parents[2]


def contents(path: Path) -> dict[str, bytes]:
    """Every array of a store, as bytes."""
    found = zarr.open_group(path, mode="r").members(max_depth=None)
    arrays = {name: np.asarray(array[...]) for name, array in found if isinstance(array, zarr.Array)}
    return {n: str(a.tolist()).encode() if a.dtype.kind in "TO" else a.tobytes() for n, a in arrays.items()}


@pytest.fixture(scope="module")
def expected(reference: Path) -> dict[str, bytes]:
    return contents(reference)


@pytest.mark.parametrize("shard_frames", [1, 20])
def test_another_number_of_frames_in_a_shard(
    tmp_path: Path, small_plan: Plan, expected: dict[str, bytes], shard_frames: int
) -> None:
    made = replace(small_plan, shard_frames=shard_frames)
    assert build(made, tmp_path / "s.zarr", workers=0).ok
    assert contents(tmp_path / "s.zarr") == expected


def test_several_worker_processes(tmp_path: Path, small_plan: Plan, expected: dict[str, bytes]) -> None:
    """One is in test_object_store and test_surviving, of running schedulers in test_building."""
    report = build(replace(small_plan, shard_frames=3), tmp_path / "s.zarr", workers=2)
    assert (report.ok, report.written, report.workers) == (True, 20, 2)
    assert report.worker_peak_bytes > 1e7
    assert contents(tmp_path / "s.zarr") == expected


def test_another_order(tmp_path: Path, small_plan: Plan, expected: dict[str, bytes]) -> None:
    frames = list(range(20))
    random.Random(5).shuffle(frames)
    for first in range(0, 20, 5):
        build(small_plan, tmp_path / "s.zarr", frames=frames[first : first + 5], workers=0)
    assert contents(tmp_path / "s.zarr") == expected


@pytest.mark.long
def test_another_locale_time_zone_hash_seed_and_folder(
    tmp_path: Path, small_file: Path, expected: dict[str, bytes]
) -> None:
    place = tmp_path / "elsewhere"
    place.mkdir()
    env = os.environ | {"LC_ALL": "C", "TZ": "Pacific/Chatham", "PYTHONHASHSEED": "4242", "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "sonarsynth", "build", "../small.yaml", "s.zarr", "--workers", "0", "--no-predict"]
    subprocess.run(command, cwd=place, env=env, check=True, capture_output=True)
    assert contents(place / "s.zarr") == expected


def test_a_frame_has_one_thread_for_linear_algebra_and_gives_the_others_back(
    small_plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    def threads() -> list[int]:
        return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]

    seen: list[int] = []

    def seeing(*_: object) -> None:
        seen.extend(threads())
        raise InterruptedError

    monkeypatch.setattr(pipeline, "values_at", seeing)
    with threadpool_limits(2, user_api="blas"):
        assert set(threads()) == {2}
        with pytest.raises(InterruptedError):
            pipeline.render(small_plan, 0)
        assert set(threads()) == {2}
    assert set(seen) == {1}
