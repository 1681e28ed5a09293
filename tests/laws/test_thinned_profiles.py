"""Fewer layers of a measured profile: exact below the bottom, as few as the accuracy allows above it."""

from __future__ import annotations

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth.environment.casts import profile_of
from sonarsynth.planning.measured.ray_bending import propagation
from sonarsynth.planning.measured.thinned_profile import polyline, thinned

BOX = """
title: a box under a cast
scene:
  world:
    environment:
      depth: 60 m
      sound_speed: {{kind: cast, path: cast.csv}}
    targets:
      - {{name: box, shape: {{kind: box, size: [1, 1, 1]}}, motion: {{kind: still, position: [15, 2, -14]}}}}
    sources: [{{kind: snapping_shrimp, position: [12, -6, -20]}}]
  sonar: {{array: {{kind: planar_lattice, columns: 4, rows: 4, pitch: 5 cm}}}}
  trajectory: {{frames: 2, sonar: {{kind: still, position: [0, 0, -10], heading: 90 deg}}}}
accuracy: {{signal: {signal}}}
"""


def recipe(folder, depth, speed, signal=1e-3):
    rows = "".join(f"{z:.4f},{c:.6f}\n" for z, c in zip(depth, speed, strict=True))
    (folder / "cast.csv").write_text("depth (m),sound speed (m/s)\n" + rows)
    (folder / "box.yaml").write_text(BOX.format(signal=signal))
    return ss.load(folder / "box.yaml")


def thin(made):
    scene = made.scene_of(0)
    profile = profile_of(scene.world.environment.sound_speed)
    model = propagation(scene, profile, [made.frame(0)[1]], made.accuracy.signal)
    return profile, *thinned(model, made, 0, profile)


Z = np.linspace(0.5, 90.0, 1800)
SMOOTH = 1520.0 - 0.15 * Z - 4.0 * np.tanh((Z - 15.0) / 6.0)


def test_layers_are_as_few_as_the_accuracy_allows(tmp_path):
    counts = []
    for signal in (1e-2, 1e-3, 1e-4):
        profile, fewer, error = thin(recipe(tmp_path, Z, SMOOTH, signal))
        assert error <= 0.2 * signal
        assert np.abs(fewer.at(profile.depth) - profile.speed)[profile.depth < 60].max() < 0.2
        counts.append(len(fewer.depth))
    assert len(profile.depth) == 1800 and counts == sorted(counts) and counts[0] < 60 < counts[2] < 180


def test_what_is_straight_needs_no_nodes_and_what_is_below_the_bottom_none(tmp_path):
    _, fewer, error = thin(recipe(tmp_path, Z, np.interp(Z, [0, 30, 90], [1520.0, 1515.0, 1500.0])))
    assert len(fewer.depth) <= 10 and error <= 2e-4
    few = np.array([1.0, 10.0, 30.0, 61.0, 70.0, 80.0])
    profile, cut, error = thin(recipe(tmp_path, few, 1500.0 + np.sqrt(few)))
    assert error == 0.0
    np.testing.assert_array_equal(cut.depth, profile.depth[:4])
    np.testing.assert_array_equal(cut.speed, profile.speed[:4])


def test_exact_recipes_keep_every_node_above_the_bottom(tmp_path):
    made = ss.loads(
        ss.dump(recipe(tmp_path, Z, SMOOTH)).replace("exact: false", "exact: true"), folder=tmp_path, resolved=True
    )
    profile, same, error = thin(made)
    assert error == 0.0 and len(same.depth) == np.count_nonzero(profile.depth < 60.0) + 1


@pytest.mark.parametrize("height", [0.3, 0.01, 1e-9])
def test_a_polyline_is_nowhere_off_by_more_than_its_height(height):
    random = np.random.default_rng(2)
    depth = np.cumsum(random.uniform(0.0, 1.0, 400))
    speed = 1500.0 + np.cumsum(random.normal(0.0, 0.05, 400))
    kept = polyline(depth, speed, height)
    assert kept[0] and kept[-1]
    assert np.abs(np.interp(depth, depth[kept], speed[kept]) - speed).max() <= height
