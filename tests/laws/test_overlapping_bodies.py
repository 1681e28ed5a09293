"""Bodies that take the same place are named with the frames; those that only touch, or are apart, are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth.geometry import Pose
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.planning.measured.sampled_frames import sample_frames
from sonarsynth.planning.notes.target_notes import mirror_notes, overlap_notes
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.overlaps import overlap
from sonarsynth.targets.shapes import Box, LShape, Shape, Sphere

UNTURNED = np.array([1.0, 0.0, 0.0, 0.0])
TILTED = np.array([0.6, 0.0, 0.64, 0.48])
BALL, CUBE = Sphere(radius=0.5, edge=0.1), Box(size=(1.0, 1.0, 1.0))
PLATE = Box(size=(2.0, 2.0, 0.01))
FINE = Sphere(radius=0.5, edge=0.02)


def body(shape: Shape, at: tuple[float, float, float], turn: np.ndarray = UNTURNED) -> PlacedTarget:
    return PlacedTarget("b", mesh_of(shape), Pose(np.array(at), turn), np.zeros(3))


CASES = {
    "the same place": (body(BALL, (0, 0, -5)), body(BALL, (0, 0, -5)), "coincide"),
    "the same hull, as fine": (body(FINE, (0, 0, -5)), body(FINE, (0, 0, -5)), "coincide"),
    "turned in its place": (body(CUBE, (0, 0, -5)), body(CUBE, (0, 0, -5), np.array([0.5, 0.5, 0.5, 0.5])), "coincide"),
    "a ball in a box": (body(CUBE, (0, 0, -5)), body(Sphere(radius=0.2, edge=0.05), (0.1, 0, -5)), "second is inside"),
    "a box in a ball": (body(Box(size=(0.2, 0.2, 0.2)), (0, 0, -5)), body(BALL, (0, 0, -5)), "first is inside"),
    "a corner": (body(CUBE, (0, 0, -5), TILTED), body(CUBE, (0.9, 0.4, -5.5)), "overlap"),
    "crossed plates, no corner within": (body(PLATE, (0, 0, -5)), body(PLATE, (0, 0, -5), TILTED), "overlap"),
    "a rod through a plate": (body(PLATE, (0, 0, -5)), body(Box(size=(0.1, 0.1, 4.0)), (0.7, 0.3, -5)), "overlap"),
    "by a millimetre": (body(CUBE, (0, 0, -5)), body(CUBE, (0.999, 0, -5)), "overlap"),
    "face on face": (body(CUBE, (0, 0, -5)), body(CUBE, (1.0, 0, -5)), None),
    "one on another, smaller": (body(CUBE, (0, 0, -5)), body(Box(size=(0.4, 0.4, 0.4)), (0.1, 0.2, -4.3)), None),
    "in the notch of an L": (
        body(LShape(height=2.0, length=2.0, width=1.0, thickness=0.2), (0, 0, -5)),
        body(Sphere(radius=0.2, edge=0.05), (0.9, 0.0, -4.1)),
        None,
    ),
    "spheres of boxes that meet, boxes that do not": (body(PLATE, (0, 0, -5)), body(PLATE, (0, 0, -4.9)), None),
    "apart": (body(BALL, (0, 0, -5)), body(BALL, (3, 0, -5)), None),
}


@pytest.mark.parametrize("case", CASES)
def test_how_two_bodies_overlap(case: str) -> None:
    one, other, expected = CASES[case]
    found = overlap(one, other)
    assert (found is None) == (expected is None), found
    if expected is not None:
        assert expected in str(found)
        back = overlap(other, one)
        swapped = {"first": "second", "second": "first"}.get(expected.split()[0], "")
        assert expected.replace(expected.split()[0], swapped) in str(back) if swapped else expected in str(back)


def test_a_pair_of_spheres_overlaps_as_far_as_their_radii_reach() -> None:
    """Meshes are inscribed: spheres of 0.5 m and edges of 0.1 m end up to 1 mm inside."""
    for gap in (-0.02, 0.02):
        found = overlap(body(BALL, (0, 0, -5)), body(BALL, ((1.0 + gap) * 0.6, (1.0 + gap) * 0.8, -5)))
        assert (found is None) == (gap > 0.0)


def test_an_empty_mesh_overlaps_nothing() -> None:
    none = PlacedTarget(
        "none", Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32)), Pose(np.zeros(3), UNTURNED), np.zeros(3)
    )
    assert overlap(none, body(BALL, (0, 0, -5))) is None


def recipe(*targets: ss.Target, frames: int = 1) -> ss.Recipe:
    world = ss.World(
        environment=ss.Environment(depth=20.0, sound_speed=ss.Isovelocity(speed=1540.0)),
        targets=targets,
        sources=(ss.SnappingShrimp(position=(6.0, 8.0)),),
    )
    sonar = ss.Sonar(array=ss.PlanarLattice(columns=4, rows=4, pitch=0.05))
    trajectory = ss.Trajectory(
        frames=frames, interval=1.0, sonar=ss.Still(position=(0.0, 0.0, -5.0), heading=np.pi / 2)
    )
    return ss.Recipe(scene=ss.Scene(world=world, sonar=sonar, trajectory=trajectory))


def ball(name: str, position: tuple[float, float, float]) -> ss.Target:
    return ss.Target(name=name, shape=ss.Sphere(radius=0.3, edge=0.08), motion=ss.Still(position=position))


def test_two_coincident_targets_are_noted_in_the_plan() -> None:
    said = ss.plan(recipe(ball("one", (10.0, 0.0, -5.0)), ball("two", (10.0, 0.0, -5.0)))).warnings
    (note,) = [line for line in said if "coincide in frame 0" in line]
    assert note.startswith("one and two coincide in frame 0")


def test_the_frames_in_which_bodies_meet_are_named() -> None:
    passing = ss.Target(
        name="passing",
        shape=ss.Sphere(radius=0.3, edge=0.08),
        motion=ss.Line(start=(10.0, -4.0, -5.0), stop=(10.0, 4.0, -5.0), duration=8.0),
    )
    (look,) = sample_frames(recipe(ball("still", (10.0, 0.0, -5.0)), passing, frames=9))
    (note,) = overlap_notes(look)
    assert note.startswith("still and passing coincide in 1 of 9 frames examined (first: frame 4)")


@pytest.mark.parametrize(
    ("place", "noted"),
    [((-10.0, 0.0, -5.0), True), ((-10.0, 30.0, -5.0), False), ((10.0, 0.0, -5.0), False), ((0.0, 8.0, -5.0), False)],
)
def test_a_target_behind_a_planar_array_is_noted_where_its_mirror_image_is_in_view(
    place: tuple[float, float, float], noted: bool
) -> None:
    (look,) = sample_frames(recipe(ball("ball", place)))
    found = [line for line in mirror_notes(look) if line.startswith("ball: behind the array in frame 0")]
    assert len(found) == noted
    if noted:
        assert found[0] in ss.plan(recipe(ball("ball", place))).warnings


def test_an_array_with_depth_tells_front_from_back() -> None:
    flat = recipe(ball("ball", (-10.0, 0.0, -5.0)))
    places = tuple((0.1 * x, 0.1 * y, 0.1 * z) for x in range(2) for y in range(2) for z in range(2))
    deep = replace(
        flat, scene=replace(flat.scene, sonar=replace(flat.scene.sonar, array=ss.PositionTable(positions=places)))
    )
    assert mirror_notes(sample_frames(deep)[0]) == []
