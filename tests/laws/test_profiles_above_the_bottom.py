"""Nodes of a profile below the bottom are left out, and the last is on it: no ray is below."""

from __future__ import annotations

import numpy as np

import sonarsynth as ss
from sonarsynth.environment.casts import profile_of

BOX = """
title: a box under a cast
scene:
  world:
    environment:
      depth: 60 m
      sound_speed: {kind: cast, path: cast.csv}
    targets:
      - {name: box, shape: {kind: box, size: [1, 1, 1]}, motion: {kind: still, position: [15, 2, -14]}}
    sources: [{kind: snapping_shrimp, position: [12, -6, -20]}]
  sonar: {array: {kind: planar_lattice, columns: 4, rows: 4, pitch: 5 cm}}
  trajectory: {frames: 2, sonar: {kind: still, position: [0, 0, -10], heading: 90 deg}}
"""


def test_what_is_below_the_bottom_needs_no_nodes(tmp_path):
    depth = np.array([1.0, 10.0, 30.0, 61.0, 70.0, 80.0])
    rows = "".join(f"{z:.4f},{c:.6f}\n" for z, c in zip(depth, 1500.0 + np.sqrt(depth), strict=True))
    (tmp_path / "cast.csv").write_text("depth (m),sound speed (m/s)\n" + rows)
    (tmp_path / "box.yaml").write_text(BOX)
    plan = ss.plan(ss.load(tmp_path / "box.yaml"), products=["signals"])
    whole = profile_of(plan.scene.world.environment.sound_speed)
    assert len(whole.depth) == 6
    np.testing.assert_array_equal(plan.profile.depth, [*whole.depth[:3], 60.0])
    np.testing.assert_array_equal(plan.profile.speed, [*whole.speed[:3], whole.at(60.0)])
    assert [row.why for row in plan.left_out if "nodes" in row.what] == ["2 of 6: no sound goes there"]


def test_a_cast_that_changes_is_read_again(tmp_path):
    (tmp_path / "box.yaml").write_text(BOX)
    for speed in (1500.0, 1510.0):
        (tmp_path / "cast.csv").write_text(f"depth (m),sound speed (m/s)\n1,{speed}\n30,1505\n80,{speed + 2.0:.2f}\n")
        assert ss.plan(ss.load(tmp_path / "box.yaml"), products=["signals"]).profile.speed[0] == speed
