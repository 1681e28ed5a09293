"""Sequences of different length, whose sources sound more or less often: the store has room for the most."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from sonarsynth import evaluation, planning, schedule, store
from sonarsynth.pipeline import render
from sonarsynth.recipe import Recipe, reading

UNEVEN = """\
grid:
  - {name: first, path: sources.one.snap_times, values: [[], [1 ms]]}
  - {name: second, path: sources.two.snap_times, values: [[], [0], [0, 5 ms]]}
variations:
  - {name: length, path: trajectory.frames, kind: integers, low: 1, high: 4}
  - {name: away, path: sources.one.position.0, kind: uniform, low: 18 m, high: 22 m}
splits: {train: 0.5, test: 0.5}
"""
SOURCES = """\
    sources:
      - {kind: snapping_shrimp, name: one, position: [20, 1]}
      - {kind: snapping_shrimp, name: two, position: [4, 9], snap_times: []}
"""


@pytest.fixture(scope="module")
def recipe(small_text: str, tmp_path_factory: pytest.TempPathFactory) -> Recipe:
    lines = small_text.splitlines(keepends=True)
    start = next(n for n, line in enumerate(lines) if line.strip() == "sources:")
    stop = next(n for n in range(start + 1, len(lines)) if not lines[n].startswith("      "))
    file = tmp_path_factory.mktemp("uneven") / "uneven.yaml"
    file.write_text("".join(lines[:start]) + SOURCES + "".join(lines[stop:]) + UNEVEN)
    return reading.load(file)


@pytest.fixture(scope="module")
def built(recipe: Recipe, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("uneven") / "uneven.zarr"
    assert schedule.build(recipe, path, workers=0).ok
    return path


def test_frames_are_those_of_each_sequence_in_turn(recipe: Recipe, built: Path) -> None:
    lengths = [recipe.scene_of(n).trajectory.frames for n in range(6)]
    assert len(set(lengths)) > 1
    with xr.open_datatree(built, engine="zarr") as tree:
        assert tree.sizes["frame"] == sum(lengths) == recipe.frames
        assert tree["trajectory"].values.tolist() == np.repeat(range(6), lengths).tolist()
        assert tree["step"].values.tolist() == [step for length in lengths for step in range(length)]
        assert tree["length"].values.tolist() == np.repeat(lengths, lengths).tolist()
    for index in range(recipe.frames):
        frame = recipe.frame(index)[1]
        assert recipe.sequence(index) == frame.trajectory
        assert recipe.first_frame(frame.trajectory) + frame.step == index


def test_emissions_are_there_and_the_rest_of_their_axis_is_empty(recipe: Recipe, built: Path) -> None:
    with xr.open_datatree(built, engine="zarr") as tree:
        emissions = tree["truth/emissions"].to_dataset()
        assert emissions.sizes["emission"] == 3
        for index in range(recipe.frames):
            here = emissions.isel(frame=index)
            snaps = recipe.frame(index)[1].moment.snaps
            assert np.array_equal(here.time.values[: len(snaps)], [snap.time for snap in snaps])
            assert np.array_equal(here.position.values[: len(snaps)], np.reshape([s.position for s in snaps], (-1, 3)))
            assert (here.source.values >= 0).sum() == len(snaps)
            assert not np.isfinite(here.time.values[len(snaps) :]).any()
            level = tree["link_budget/received_level"].isel(frame=index)
            assert not np.isfinite(level.values[len(snaps) :]).any()
            assert np.isfinite(level.values[: len(snaps)]).any() == bool(snaps)
            heard = np.isfinite(tree["image/start"].values[index])
            assert heard or not snaps
    assert not store.verify(built, [evaluation.check]).problems


def test_the_truth_of_a_frame_is_that_of_a_recipe_of_its_own(recipe: Recipe) -> None:
    """The last sequence, all of its values written down: nothing is drawn, and there is nothing else."""
    alone = replace(recipe, scene=recipe.scene_of(5), grid=(), variations=(), splits=None)
    plans = [planning.plan(one, ()) for one in (recipe, alone)]
    for step in range(alone.frames):
        whole, own = render(plans[0], recipe.first_frame(5) + step), render(plans[1], step)
        for name in ("position", "time", "level"):
            assert np.array_equal(whole[f"truth/emissions/{name}"], own[f"truth/emissions/{name}"])
        assert np.array_equal(whole["truth/targets/position"], own["truth/targets/position"])
