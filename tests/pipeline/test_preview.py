"""`preview`: its numbers against those by hand, and that it makes no sound."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth.pictures.preview_figures.distribution_figure import distribution_figure
from sonarsynth.pictures.preview_figures.overview_figure import overview_figure
from sonarsynth.pictures.preview_figures.preview_pictures import overview
from sonarsynth.recipe.sampled_geometry import FACETS, sample_geometry, spread

ROOT = Path(__file__).resolve().parents[2]
GRID = ROOT / "configs" / "grid.yaml"


def ball(name: str, *place: float, heading: float = 0.0, size: float = 0.3) -> ss.Target:
    motion = ss.Still(position=place, heading=heading)  # type: ignore[arg-type]
    return ss.Target(name=name, shape=ss.Sphere(radius=size, edge=0.2), motion=motion)


def recipe(*targets: ss.Target, frames: int = 3) -> ss.Recipe:
    """A sonar at (0, 0, -5) that looks north, with the default beams of 50 by 50 deg."""
    world = ss.World(environment=ss.Environment(depth=20.0, sound_speed=ss.Isovelocity(speed=1500.0)), targets=targets)
    sonar = ss.Still(position=(0.0, 0.0, -5.0), heading=0.0)
    return ss.Recipe(scene=ss.Scene(world=world, trajectory=ss.Trajectory(frames=frames, sonar=sonar)))


def test_range_and_angles_of_a_still_target() -> None:
    """3-4-12-13: 3 m west (port), 12 m north, 4 m up; it heads east, so the sonar is astern to starboard."""
    found = sample_geometry(recipe(ball("one", -3.0, 12.0, -1.0, heading=np.pi / 2)))
    assert found.columns["range"] == pytest.approx(np.full(3, 13.0), rel=1e-12)
    assert found.columns["azimuth"] == pytest.approx(np.full(3, np.rad2deg(np.arctan2(3.0, 12.0))), rel=1e-12)
    assert found.columns["elevation"] == pytest.approx(np.full(3, np.rad2deg(np.arcsin(4.0 / 13.0))), rel=1e-12)
    assert found.columns["aspect"] == pytest.approx(np.full(3, -np.rad2deg(np.arctan2(12.0, 3.0))), rel=1e-12)
    assert found.columns["visible"] == pytest.approx(np.ones(3))
    assert found.in_view.tolist() == [1, 1, 1]


def test_what_is_behind_another_or_outside_the_view_is_not_visible() -> None:
    """One ahead, a smaller one in its shadow, one abeam, and one whose middle is on the edge of the view."""
    edge = 20.0 * np.tan(np.deg2rad(25.0))
    found = sample_geometry(
        recipe(
            ball("near", 0.0, 10.0, -5.0),
            ball("hidden", 0.0, 16.0, -5.0, size=0.2),
            ball("abeam", 12.0, 0.0, -5.0),
            ball("edge", -edge, 20.0, -5.0),
            frames=1,
        )
    )
    near, hidden, abeam, at_the_edge = found.columns["visible"]
    assert (near, hidden, abeam) == (1.0, 0.0, 0.0)
    assert at_the_edge == pytest.approx(0.5, abs=0.1)
    assert found.in_view.tolist() == [2]
    value = found.as_json()
    assert value["targets"]["hidden"] == {"frames": 1, "frames_in_view": 0}
    assert value["range"]["by_target"]["hidden"]["count"] == 0
    assert value["visible"]["by_target"]["hidden"]["greatest"] == 0.0


def test_the_facets_that_stand_for_all_are_spread_over_the_body() -> None:
    fine = ss.Target(name="fine", shape=ss.Sphere(radius=0.3, edge=0.02), motion=ss.Still(position=(0.0, 10.0, -5.0)))
    edge = 10.0 * np.tan(np.deg2rad(25.0))
    half = replace(fine, motion=ss.Still(position=(edge, 10.0, -5.0)))
    made = recipe(fine, frames=1)
    assert len(made.scene.mesh_of(0).faces) > 4 * FACETS
    assert sample_geometry(made).columns["visible"].tolist() == [1.0]
    assert sample_geometry(recipe(half, frames=1)).columns["visible"][0] == pytest.approx(0.5, abs=0.1)


def test_a_scene_without_targets_has_none_in_view_and_is_drawn() -> None:
    empty = recipe()
    found = sample_geometry(empty)
    assert found.in_view.tolist() == [0, 0, 0]
    value = found.as_json()
    assert value["range"]["all"] == {
        "count": 0,
        **dict.fromkeys(("least", "lower_quartile", "median", "upper_quartile", "greatest", "mean")),
    }
    json.dumps(value, allow_nan=False)
    distribution_figure(found).draw_without_rendering()
    overview_figure(overview(empty, 0)).draw_without_rendering()


def test_of_one_range_the_axis_has_the_range_itself() -> None:
    """Not parts of a millimetre, and an offset apart to add to them."""
    figure = distribution_figure(sample_geometry(recipe(ball("one", -3.0, 12.0, -1.0), frames=1)))
    figure.draw_without_rendering()
    assert [axes.xaxis.get_offset_text().get_text() for axes in figure.axes] == [""] * len(figure.axes)


def test_a_grid_is_counted_by_sequence_and_split() -> None:
    made = ss.load(GRID)
    value = sample_geometry(made).as_json()
    assert (value["sampled_sequences"], value["sampled_frames"]) == (24, 144)
    assert value["sequences_by_split"] == {"train": 12, "validation": 6, "test": 6}
    assert sum(part["count"] for part in value["range"]["by_split"].values()) == value["range"]["all"]["count"]
    first = [made.frame(made.first_frame(n))[1].moment.bodies[0].pose.position for n in range(24)]
    found = sample_geometry(made, most_frames=1)
    assert found.step.tolist() == [0, 5] * 24  # two of each at least
    apart = np.linalg.norm(np.array(first) - [0.0, 0.0, -8.0], axis=1)
    assert found.columns["range"][::2] == pytest.approx(apart, rel=1e-12)


def test_of_many_sequences_no_value_of_a_grid_is_passed_over() -> None:
    """Every second of an even number would all have the same value of an entry of two."""
    chosen = spread(10_000, 100)
    assert len(set(chosen.tolist())) == 100
    assert (chosen // 100).tolist() == list(range(100))
    assert 30 <= int((chosen % 2).sum()) <= 70
    assert spread(5, 100).tolist() == [0, 1, 2, 3, 4]


def test_the_numbers_are_made_without_compiled_kernels_and_without_a_store(tmp_path: Path) -> None:
    """numba, zarr and xarray are not even loaded for the numbers; drawing compiles nothing, and writes pictures."""
    code = f"""
import sys
import sonarsynth as ss
from sonarsynth.recipe.sampled_geometry import sample_geometry
made = ss.load({str(ROOT / "configs" / "tank.yaml")!r})
sample_geometry(made)
print(sorted({{"numba", "zarr", "xarray"}} & set(sys.modules)))
files = ss.preview(made, "out")
print([file.name for file in files])
"""
    cache = tmp_path / "kernels"
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
    )
    assert done.stdout.splitlines() == ["[]", "['scene-0.png', 'distributions.png', 'preview.json']"]
    assert not list(cache.rglob("*.nbc"))
    assert sorted(path.name for path in tmp_path.iterdir() if path != cache) == ["out"]
