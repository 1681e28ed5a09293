"""Laws of eigenrays as polylines: they come to the receiver, keep Snell's invariant, lie on closed-form curves."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.conventions import Floats, depth
from sonarsynth.environment.sea import Environment, Isovelocity, Profile
from sonarsynth.equations.rays.ray_solutions import Eigenrays, Water, eigenrays, water
from sonarsynth.state import Medium
from sonarsynth.tracing.ray_fan import EVENTS, LEFT, RayFan, fan, follow_eigenrays

MISS = 1.1 * LEFT
"""Of the length of a ray: how far the last point but one of its polyline is from leading to the receiver."""


def event(name: str) -> int:
    return EVENTS.index(name)


def layered(nodes: list[float], speed: list[float]) -> Water:
    return water(np.array(nodes), np.array(speed), nodes[-1])


WATERS = {
    "one speed": layered([0, 100], [1500, 1500]),
    "rising": layered([0, 100], [1490, 1510]),
    "falling": layered([0, 100], [1510, 1490]),
    "thermocline": layered([0, 20, 22, 100], [1540, 1540, 1530, 1531]),
    "duct": layered([0, 30, 50, 100], [1520, 1500, 1500, 1530]),
    "jump down": layered([0, 40, 40, 100], [1520, 1520, 1500, 1505]),
    "jump up": layered([0, 40, 40, 100], [1500, 1500, 1520, 1525]),
    "many layers": layered(list(np.linspace(0, 100, 31)), list(1500 + 8 * np.cos(np.arange(31) ** 2))),
    "faint": layered([0, 100], [1500, 1500 + 1e-11]),
    "steep": layered([0, 1e-6, 100], [1500, 1510, 1500]),
}


def pairs(layers: Water, count: int = 40, seed: int = 1) -> tuple[Floats, Floats]:
    """Ends anywhere, and where it matters: on boundaries and nodes, one above the other, level, close."""
    rng = np.random.default_rng(seed)
    bottom_depth = layers.depth[-1]
    start = np.column_stack([rng.uniform(-0.5, 0.5, (count, 2)) * bottom_depth, -rng.uniform(0, bottom_depth, count)])
    end = np.column_stack([rng.uniform(-3, 3, (count, 2)) * bottom_depth, -rng.uniform(0, bottom_depth, count)])
    end[:4, :2] = start[:4, :2]
    end[4:8, 2] = start[4:8, 2]
    start[8:10, 2], start[10:12, 2], end[12:14, 2], end[14:16, 2] = 0.0, -bottom_depth, 0.0, -bottom_depth
    start[16:20, 2], end[18:22, 2] = -layers.depth[1], -layers.depth[1]
    end[22:24] = start[22:24] + [1e-6, 0.0, 0.0]
    end[22:24, 2] = np.clip(end[22:24, 2] + 1e-6, -bottom_depth, 0.0)
    return start, end


def found(layers: Water, start: Floats, end: Floats, vertices: int = 3) -> Eigenrays:
    distance = np.hypot(*(end - start)[:, :2].T)
    return eigenrays(layers, depth(start), depth(end), distance, vertices, vertices)


def ends(lines: RayFan) -> tuple[np.ndarray, np.ndarray]:
    """First and last point of each ray."""
    rays = np.arange(len(lines.coefficient))
    return np.searchsorted(lines.ray, rays), np.searchsorted(lines.ray, rays, side="right") - 1


@pytest.fixture(scope="module", params=WATERS, ids=lambda name: name.replace(" ", "-"))
def case(request: pytest.FixtureRequest) -> tuple[Water, Floats, Floats, Eigenrays, RayFan]:
    layers = WATERS[request.param]
    start, end = pairs(layers)
    rays = found(layers, start, end)
    return layers, start, end, rays, follow_eigenrays(layers, start, end, rays, 1e-3)


def test_rays_that_are_followed_come_to_the_receiver(case: tuple[Water, Floats, Floats, Eigenrays, RayFan]) -> None:
    """A ray is led to its end over the last of its arcs: by no more than is left of its travel time."""
    _, start, end, rays, lines = case
    first, last = ends(lines)
    np.testing.assert_array_equal(lines.position[first], start[rays.pair])
    np.testing.assert_array_equal(lines.position[last], end[rays.pair])
    same = lines.ray[1:] == lines.ray[:-1]
    chord = np.linalg.norm(np.diff(lines.position, axis=0), axis=1)[same]
    arc, of = np.diff(lines.length)[same], rays.length[lines.ray[1:][same]]
    assert (arc >= -MISS * of).all()
    assert (chord <= arc + MISS * of).all()
    np.testing.assert_allclose(chord, arc, rtol=1e-3, atol=1e-6)  # sagitta 1 mm


def test_times_lengths_angles_and_counts_are_those_of_the_eigenray(
    case: tuple[Water, Floats, Floats, Eigenrays, RayFan],
) -> None:
    layers, _, _, rays, lines = case
    first, last = ends(lines)
    np.testing.assert_allclose(lines.time[last], rays.travel_time, rtol=1e-12)
    np.testing.assert_allclose(lines.length[last], rays.length, rtol=1e-12)
    np.testing.assert_allclose(lines.direction[first, 2], rays.start_sine, atol=1e-9)
    np.testing.assert_allclose(lines.direction[last, 2], rays.end_sine, atol=1e-9)
    for name, count in (("surface", rays.surface), ("bottom", rays.bottom), ("turning point", rays.turning)):
        there = lines.event == event(name)
        np.testing.assert_array_equal(np.bincount(lines.ray[there], minlength=len(count)), count)
    z = depth(lines.position)
    assert (z[lines.event == event("surface")] == 0.0).all()
    assert (z[lines.event == event("bottom")] == layers.depth[-1]).all()
    assert (z >= 0.0).all()
    assert (z <= layers.depth[-1]).all()


def test_snells_invariant_holds_at_every_point(case: tuple[Water, Floats, Floats, Eigenrays, RayFan]) -> None:
    layers, _, _, rays, lines = case
    z = depth(lines.position)
    clear = ~np.isin(z, layers.depth[1:][np.diff(layers.depth) == 0.0])  # on a jump there are two speeds
    cosine = np.hypot(lines.direction[:, 0], lines.direction[:, 1])
    c = np.interp(z, layers.depth, layers.speed)
    expected = (rays.slowness[lines.ray] * c)[clear]
    np.testing.assert_allclose(cosine[clear], expected, rtol=1e-11, atol=1e-15)


def test_in_water_of_one_speed_vertices_lie_on_the_line_to_the_image_of_the_source() -> None:
    layers = WATERS["one speed"]
    start, end = np.array([[3.0, -2.0, -20.0]]), np.array([[83.0, 58.0, -70.0]])
    rays = found(layers, start, end, 5)
    lines = follow_eigenrays(layers, start, end, rays, 1e-3)
    assert len(rays.pair) == 11  # direct and two for each number of reflections
    for ray in range(len(rays.pair)):
        mine = np.flatnonzero(lines.ray == ray)
        assert len(mine) == 2 + rays.surface[ray] + rays.bottom[ray]
        part = np.hypot(*(lines.position[mine] - start[0])[:, :2].T) / 100.0
        np.testing.assert_allclose(lines.length[mine], part * rays.length[ray], rtol=1e-13)
        unfolded = np.sqrt(rays.length[ray] ** 2 - 100.0**2) * part  # depth travelled up and down together
        bend = np.abs(np.diff(depth(lines.position[mine]))).cumsum()
        np.testing.assert_allclose(bend, unfolded[1:], rtol=1e-12)


def test_in_one_gradient_points_lie_on_a_circle_about_where_the_speed_would_be_zero() -> None:
    layers = layered([0, 2000], [1450, 1550])  # 0.05 per second
    start, end = np.array([[0.0, 0.0, -500.0]]), np.array([[9000.0, 0.0, -900.0]])
    rays = found(layers, start, end, 1)
    lines = follow_eigenrays(layers, start, end, rays, 0.01)
    turned = np.flatnonzero(rays.turning == 1)
    assert len(turned) > 0
    assert len(lines.ray) > 50
    for ray in turned:
        x, z = lines.position[lines.ray == ray][:, [0, 2]].T
        radius, sine = 1.0 / (0.05 * rays.slowness[ray]), rays.start_sine[ray]
        centre = -radius * sine, 1450.0 / 0.05  # a height above the surface of c0/g
        np.testing.assert_allclose(np.hypot(x - centre[0], z - centre[1]), radius, rtol=1e-13)


def test_polylines_and_rays_that_are_followed_are_the_same() -> None:
    nodes, speed = np.array([0.0, 30.0, 50.0, 100.0]), np.array([1520.0, 1500.0, 1502.0, 1530.0])
    layers, sea = water(nodes, speed, 100.0), Environment(depth=100.0, sound_speed=Isovelocity(speed=1500.0))
    start, end = np.array([[0.0, 0.0, -35.0]]), np.array([[640.0, 480.0, -45.0]])
    rays = found(layers, start, end, 4)
    lines = follow_eigenrays(layers, start, end, rays, 1e-3)
    first, _ = ends(lines)
    assert {"surface", "bottom", "turning point"} <= {EVENTS[e] for e in lines.event}
    for ray in range(len(rays.pair)):
        mine = lines.ray == ray
        aim = lines.direction[first[ray]][None]
        followed = fan(Medium(sea, Profile(nodes, speed)), (), start[0], aim, rays.travel_time[ray])
        np.testing.assert_allclose(followed.position[-1], end[0], atol=1e-7)
        for name in ("surface", "bottom", "turning point"):
            ours, theirs = mine & (lines.event == event(name)), followed.event == event(name)
            np.testing.assert_allclose(lines.time[ours], followed.time[theirs], rtol=1e-9, atol=1e-12)
            np.testing.assert_allclose(lines.position[ours], followed.position[theirs], atol=1e-4)


def test_the_sagitta_is_kept() -> None:
    layers = WATERS["rising"]
    start, end = np.array([[0.0, 0.0, -50.0]]), np.array([[600.0, 0.0, -40.0]])
    rays = found(layers, start, end, 2)
    coarse, fine = (follow_eigenrays(layers, start, end, rays, s) for s in (0.05, 1e-5))
    for ray in range(len(rays.pair)):
        corner, point = (lines.position[lines.ray == ray] for lines in (coarse, fine))
        off = np.abs(np.interp(point[:, 0], corner[:, 0], corner[:, 2]) - point[:, 2])
        assert off.max() <= 0.05 * 1.1
    assert len(coarse.ray) < len(fine.ray) / 10


def test_coincident_ends_are_a_point_without_a_direction() -> None:
    layers = WATERS["thermocline"]
    place = np.array([[1.0, 2.0, -30.0]])
    rays = found(layers, place, place, 0)
    lines = follow_eigenrays(layers, place, place, rays, 1e-3)
    np.testing.assert_array_equal(lines.position, np.repeat(place, 2, axis=0))
    assert np.isnan(lines.direction).all()


def test_no_ray_gives_no_points() -> None:
    layers = WATERS["falling"]
    start, end = np.array([[0.0, 0.0, -1.0]]), np.array([[5000.0, 0.0, -1.0]])  # in the shadow
    rays = found(layers, start, end, 0)
    lines = follow_eigenrays(layers, start, end, rays, 1e-3)
    assert len(rays.pair) == len(lines.ray) == 0
    assert lines.position.shape == (0, 3)
