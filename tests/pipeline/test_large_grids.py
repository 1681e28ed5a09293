"""Datasets too large to look at whole: a part is looked at, and each other frame checked when it is rendered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from sonarsynth import planning, schedule, store
from sonarsynth.description import FieldError
from sonarsynth.pipeline import Values
from sonarsynth.planning import Plan
from sonarsynth.planning.measured import sampled_frames
from sonarsynth.recipe import Recipe, reading


def large(small_text: str) -> Recipe:
    """30 000 frames, most of which no plan looks at."""
    text = small_text.replace("frames: 20", "frames: 3").replace(
        "{kind: line, start: [10, 0, -5], stop: [10, 1, -5], duration: 1}",
        "{kind: course, start: [10, 0, -5], speed: 1}",
    )
    varied = (
        "variations:\n"
        "  - {name: away, path: scene.world.targets.0.motion.start.0, kind: uniform, low: 8 m, high: 14 m}\n"
        "  - {name: deep, path: scene.world.targets.0.motion.start.2, kind: normal, mean: -6 m, deviation: 1.4 m}\n"
        "repeats: 10000\n"
    )
    return reading.loads(text + varied)


def test_of_a_large_dataset_a_part_is_looked_at_and_the_rest_checked_when_rendered(
    small_text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sampled_frames, "MAX_SAMPLED_FRAMES", 60)
    recipe = large(small_text)
    made = planning.plan(recipe)
    assert made.looked_at == 60
    assert any("based on 60 of 30000 frames" in note for note in made.warnings)
    deep = {n: float(str(recipe.spanned.drawn(n)[1].value.value).split()[0]) for n in range(0, 9000)}
    bad = min(deep, key=lambda n: abs(deep[n] + 0.3))  # the box reaches 0.2 m out of the water
    unseen = next(n for n in range(1, 9000) if not np.isfinite(made.windows.start[3 * n]) and -8 < deep[n] < -4)
    frames = (3 * bad, 3 * unseen, 3 * unseen + 2)
    report = schedule.build(made, tmp_path / "s.zarr", frames=frames, workers=0)
    assert report.written == 2
    (failure,) = report.failures
    assert failure.frame == 3 * bad and failure.error.startswith(
        "FieldError: variations.0: scene.world.targets.0.motion"
    )
    assert "above the surface at frame" in failure.error and "deep = -0." in failure.error and "\n" not in failure.error
    with xr.open_datatree(tmp_path / "s.zarr", engine="zarr") as tree:
        assert tree["signals/outside"].values[list(frames[1:])].tolist() == [0, 0]


def test_unseen_frames_are_laid_as_they_would_be_if_seen(small_text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first sample of a frame is the same whether or not the plan looked at it."""
    recipe = large(small_text)
    monkeypatch.setattr(sampled_frames, "MAX_SAMPLED_FRAMES", 60)
    few = planning.plan(recipe)
    frame = recipe.frame(0)[1]
    known = few.windows.start[0]
    few.windows.start[0] = np.nan
    assert planning.frame_start(few.at(0), frame) == known


def test_a_frame_that_does_not_fit_is_refused(small_text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sampled_frames, "MAX_SAMPLED_FRAMES", 60)
    recipe = large(small_text)
    made = planning.plan(recipe)
    unseen = next(f for f in range(0, 30000, 3) if not np.isfinite(made.windows.start[f]))
    for change, message in (
        ({"samples": made.windows.samples // 2}, "longer than the sampled frames"),
        ({"echo_stop": 0.5 * made.windows.echo_stop}, "echoes outside the window"),
    ):
        tight = replace(made, windows=replace(made.windows, **change)).at(unseen)
        with pytest.raises(FieldError, match=message):
            planning.frame_start(tight, recipe.frame(unseen)[1])


def test_a_single_long_trajectory_is_looked_at_from_end_to_end(
    small_text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sampled_frames, "MAX_SAMPLED_FRAMES", 7)
    made = planning.plan(reading.loads(small_text))
    assert np.flatnonzero(np.isfinite(made.windows.start)).tolist() == [0, 3, 6, 10, 13, 16, 19]


def test_a_million_frames_take_under_a_million_files() -> None:
    remus = reading.load(Path(__file__).resolve().parents[2] / "configs" / "remus.yaml")
    made = planning.plan(remus, ("image", "cloud"))
    many = replace(remus, repeats=15625)
    million = replace(made, recipe=many, sizes=made.sizes | {"frame": many.frames})
    laid = store.layout_of(replace(million, shard_frames=planning._shard_frames(million)))
    assert laid.frames == 10**6
    assert laid.files() < 10**6


def test_a_store_has_no_more_files_than_its_layout_says(
    tmp_path: Path, small_plan: Plan, made_up: Callable[[Plan, int], Values]
) -> None:
    store.create(tmp_path / "s.zarr", small_plan)
    laid = store.layout_of(small_plan)
    for shard in range(laid.shards):
        values = {frame: made_up(small_plan, frame) for frame in laid.region(shard)}
        store.write_shard(tmp_path / "s.zarr", small_plan, shard, values)
    there = len(list((tmp_path / "s.zarr").rglob("*")))
    assert there <= laid.files() < 1.5 * there
