"""The sentences of conventions.py, each with a test of its sign."""

import numpy as np
import pytest

from sonarsynth.conventions import Unit, azimuth_elevation, depth, direction
from sonarsynth.geometry import Pose, quaternion, quaternion_product, rotation_matrix
from sonarsynth.geometry.motion import Circle, Line, Still, Waypoint, Waypoints, pose, velocity
from sonarsynth.randomness import stream

NORTH, EAST, SOUTH, WEST = 0.0, 0.5 * np.pi, np.pi, -0.5 * np.pi


@pytest.mark.parametrize(
    ("heading", "ahead"),
    [(NORTH, (0, 1, 0)), (EAST, (1, 0, 0)), (SOUTH, (0, -1, 0)), (WEST, (-1, 0, 0))],
)
def test_heading_is_clockwise_from_north(heading: float, ahead: tuple[int, int, int]) -> None:
    assert Pose(np.zeros(3), quaternion(heading)).turn_to_world([1, 0, 0]) == pytest.approx(np.array(ahead), abs=1e-15)


def test_port_is_left_and_z_is_up() -> None:
    heading_east = Pose(np.zeros(3), quaternion(EAST))
    assert heading_east.turn_to_world([0, 1, 0]) == pytest.approx(np.array([0, 1, 0]), abs=1e-15)  # north is to port
    assert heading_east.turn_to_world([0, 0, 1]) == pytest.approx(np.array([0, 0, 1]), abs=1e-15)


def test_pitch_lifts_the_nose_and_roll_lowers_starboard() -> None:
    assert Pose(np.zeros(3), quaternion(EAST, pitch=0.1)).turn_to_world([1, 0, 0])[2] == pytest.approx(np.sin(0.1))
    assert Pose(np.zeros(3), quaternion(EAST, roll=0.1)).turn_to_world([0, -1, 0])[2] == pytest.approx(-np.sin(0.1))


def test_azimuth_to_port_and_elevation_up_are_positive() -> None:
    azimuth, elevation = azimuth_elevation([[1, 1, 0], [1, 0, 1]])
    assert azimuth == pytest.approx(np.array([np.pi / 4, 0]))
    assert elevation == pytest.approx(np.array([0, np.pi / 4]))
    there = direction(0.3, -0.2)
    assert azimuth_elevation(there) == pytest.approx((0.3, -0.2))
    assert depth([0, 0, -7.0]) == 7.0


def test_a_pose_there_and_back_is_the_identity() -> None:
    place = Pose(np.array([1.0, -2.0, 3.0]), quaternion(0.3, 0.2, -1.0))
    points = np.random.default_rng(0).normal(size=(10, 3))
    assert place.to_body(place.to_world(points)) == pytest.approx(points)
    matrix = rotation_matrix(place.orientation)
    assert matrix @ matrix.T == pytest.approx(np.eye(3)) and np.linalg.det(matrix) == pytest.approx(1)
    half = quaternion(0.1)
    product = rotation_matrix(quaternion_product(half, place.orientation))
    assert product == pytest.approx(rotation_matrix(half) @ matrix)


@pytest.mark.parametrize(
    ("text", "symbol", "value"), [("25 kHz", "Hz", 25e3), ("50 deg", "rad", np.deg2rad(50)), ("30 cm", "m", 0.3)]
)
def test_texts_with_units(text: str, symbol: str, value: float) -> None:
    assert Unit(symbol).parse(text) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("text", ["25", "25 m", "kHz", "1e3Hz", ""])
def test_a_text_without_its_unit_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"Hz"):
        Unit("Hz").parse(text)


MOTIONS = [
    Still(position=(1.0, 2.0, -3.0)),
    Line(start=(0.0, 0.0, -5.0), stop=(3.0, 4.0, -5.0), duration=2.0),
    Circle(centre=(1.0, 1.0, -4.0), radius=3.0, speed=1.2),
    Waypoints(
        points=(
            Waypoint(time=0.0, position=(0.0, 0.0, -5.0)),
            Waypoint(time=2.0, position=(2.0, 0.0, -5.0)),
            Waypoint(time=3.0, position=(2.0, 3.0, -6.0)),
        )
    ),
]


@pytest.mark.parametrize("motion", MOTIONS, ids=lambda m: m.kind)
def test_velocity_is_the_derivative_of_position(motion) -> None:
    for time in (0.5, 1.3, 2.5):
        step = 1e-6
        moved = pose(motion, time + step).position - pose(motion, time - step).position
        assert velocity(motion, time) == pytest.approx(moved / (2 * step), abs=1e-6)


@pytest.mark.parametrize("motion", MOTIONS[1:], ids=lambda m: m.kind)
def test_bodies_head_along_their_track(motion) -> None:
    for time in (0.5, 1.3, 2.5):
        ahead, v = pose(motion, time).turn_to_world([1, 0, 0]), velocity(motion, time)
        horizontal = v * [1, 1, 0]
        assert ahead @ horizontal == pytest.approx(np.linalg.norm(horizontal))


@pytest.mark.parametrize(
    ("places", "headings"),
    [
        ([(0, 0), (5, 0), (5, 0), (5, 5)], [90, 90, 0, 0]),  # it waits as it came, and turns where it goes on
        ([(0, 0), (0, 0), (5, 0)], [90, 90, 90]),  # it waits as it will leave
        ([(0, 0), (5, 0), (5, 0), (5, 0)], [90, 90, 90, 90]),  # nothing comes after
        ([(0, 0, 70), (0, 0), (0, 0)], [70, 70, 70]),
        ([(0, 0), (0, 0), (0, 0, 70)], [70, 70, 70]),
        ([(0, 0), (0, 0), (0, 0)], [0, 0, 0]),  # of which nothing is known
    ],
)
def test_a_body_that_waits_at_a_waypoint_keeps_its_heading(
    places: list[tuple[float, ...]], headings: list[float]
) -> None:
    """It turned north. The same where it goes straight up."""
    for climb in (0.0, 1.0):
        motion = Waypoints(
            points=tuple(
                Waypoint(time=i, position=(x, y, climb * i - 9.0), heading=np.deg2rad(own[0]) if own else None)
                for i, (x, y, *own) in enumerate(places)
            )
        )
        for i, heading in enumerate(headings):
            ahead = pose(motion, i).to_world(np.array([[1.0, 0.0, 0.0]]))[0] - pose(motion, i).position
            expected = [np.sin(np.deg2rad(heading)), np.cos(np.deg2rad(heading)), 0.0]
            np.testing.assert_allclose(ahead, expected, atol=1e-12, err_msg=f"waypoint {i}")


def test_headings_of_waypoints_turn_the_short_way() -> None:
    motion = Waypoints(
        points=(
            Waypoint(time=0.0, position=(0.0, 0.0, -1.0), heading=np.deg2rad(350)),
            Waypoint(time=1.0, position=(1.0, 0.0, -1.0), heading=np.deg2rad(10)),
        )
    )
    assert pose(motion, 0.5).turn_to_world([1, 0, 0]) == pytest.approx(np.array([0, 1, 0]), abs=1e-12)
    assert velocity(motion, 1.5) == pytest.approx(np.zeros(3))


def test_streams_depend_on_their_path_alone() -> None:
    assert stream(1, "noise", 2).random() == stream(1, "noise", 2).random()
    draws = {
        stream(*key).random() for key in [(1, "noise", 2), (1, "noise", 3), (2, "noise", 2), (1, "noise", "2"), (1,)]
    }
    assert len(draws) == 5
