"""Laws of rays that are followed: reflection, Snell, arcs, the tank of figure 14 and the L shape of figure 15."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import Environment, Isovelocity, Profile
from sonarsynth.geometry import Pose, quaternion, unit
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.propagation import AutoTracing, Refracted
from sonarsynth.scattering import MirrorLobe
from sonarsynth.state import Medium
from sonarsynth.tracing.ray_fan import EVENTS, RayFan, fan
from tests.bodies import mesh_from

TANK = Environment(depth=0.3, sound_speed=Isovelocity(speed=1480.0))
TANK_PROFILE = Profile(np.array([0.0, 0.1, 0.2, 0.3]), np.array([1482.0, 1481.0, 1478.0, 1477.5]))


def cylinder() -> PlacedTarget:
    mesh = mesh_from(trimesh.creation.cylinder(radius=0.05, height=0.3, sections=48))
    lying = Pose(np.array([0.7, 0.02, -0.16]), quaternion(0.3, 0.5 * np.pi, 0.0))
    return PlacedTarget("cylinder", mesh, lying, np.zeros(3))


def downward(*degrees: float, azimuth: float = 0.0) -> Floats:
    angle = np.deg2rad(degrees)
    return np.stack([np.cos(angle) * np.cos(azimuth), np.cos(angle) * np.sin(azimuth), -np.sin(angle)], axis=-1)


def at(found: RayFan, event: str) -> np.ndarray:
    return np.flatnonzero(found.event == EVENTS.index(event))


@pytest.fixture(scope="module")
def tank() -> RayFan:
    origin = np.array([0.0, 0.0, -0.15])
    aims = np.concatenate([downward(-25.0, 3.0, 40.0), downward(-2.0, 5.0, azimuth=0.08)])
    return fan(Medium(TANK, TANK_PROFILE), (cylinder(),), origin, aims, 1.2e-3)


def test_rays_reflect_at_the_angle_at_which_they_arrive(tank: RayFan) -> None:
    for event in ("surface", "bottom", "facet"):
        assert len(at(tank, event)), event
    flat = np.concatenate([at(tank, "surface"), at(tank, "bottom")])
    before = unit(tank.position[flat] - tank.position[flat - 1])  # the chord: within its half turn of the ray
    after = tank.direction[flat]
    np.testing.assert_allclose(before * [1, 1, -1], after, atol=2e-3)
    np.testing.assert_allclose(tank.position[at(tank, "bottom"), 2], -0.3, atol=1e-15)
    np.testing.assert_allclose(tank.position[at(tank, "surface"), 2], 0.0, atol=1e-15)
    hit = at(tank, "facet")
    target = cylinder()
    normal = target.pose.turn_to_world(target.mesh.normal[tank.facet[hit]])
    arriving = unit(tank.position[hit] - tank.position[hit - 1])
    leaving = tank.direction[hit]
    np.testing.assert_allclose(np.sum(normal * leaving, axis=1), -np.sum(normal * arriving, axis=1), atol=2e-3)
    np.testing.assert_allclose(np.cross(normal, leaving), np.cross(normal, arriving), atol=2e-3)
    corner = target.pose.to_world(target.mesh.centroid[tank.facet[hit]])
    np.testing.assert_allclose(np.sum(normal * (tank.position[hit] - corner), axis=1), 0.0, atol=1e-12)


def test_rays_keep_snells_invariant_between_facets(tank: RayFan) -> None:
    c = TANK_PROFILE.at(-tank.position[:, 2])
    p = np.hypot(tank.direction[:, 0], tank.direction[:, 1]) / c
    for ray in range(5):
        mine = np.flatnonzero(tank.ray == ray)
        leg = np.cumsum(tank.event[mine] == EVENTS.index("facet"))
        for n in range(leg[-1] + 1):
            np.testing.assert_allclose(p[mine][leg == n], p[mine][leg == n][0], rtol=1e-12)


def test_times_and_lengths_grow_evenly_and_end_on_time(tank: RayFan) -> None:
    ends = at(tank, "end")
    assert len(ends) == 5
    np.testing.assert_allclose(tank.time[ends], 1.2e-3, rtol=1e-14)
    same = tank.ray[1:] == tank.ray[:-1]
    speed = (np.diff(tank.length) / np.where(np.diff(tank.time) > 0, np.diff(tank.time), np.nan))[same]
    assert np.nanmin(speed) > 1477.0
    assert np.nanmax(speed) < 1483.0
    chord = np.linalg.norm(np.diff(tank.position, axis=0), axis=1)[same]
    assert (chord <= np.diff(tank.length)[same] * (1 + 1e-12)).all()
    assert (tank.position[:, 2] <= 0).all()
    assert (tank.position[:, 2] >= -0.3).all()


def test_a_ray_in_one_gradient_is_an_arc_of_the_closed_form_radius() -> None:
    deep = Environment(depth=2000.0, sound_speed=Isovelocity(speed=1500.0))
    profile = Profile(np.array([0.0, 2000.0]), np.array([1450.0, 1550.0]))  # 0.05 per second
    found = fan(Medium(deep, profile), (), np.array([0.0, 0.0, -1000.0]), downward(10.0, 0.0, -2.0), 4.0, spacing=50.0)
    for ray, angle in enumerate(np.deg2rad([10.0, 0.0, -2.0])):
        x, z = found.position[found.ray == ray][:, [0, 2]].T
        radius = 1500.0 / (0.05 * np.cos(angle))
        centre = radius * np.sin(angle), -1000.0 + radius * np.cos(angle)  # where the speed would be 0
        np.testing.assert_allclose(np.hypot(x - centre[0], z - centre[1]), radius, rtol=1e-13)
        s = found.length[found.ray == ray]
        phi = angle - s / radius
        time = (np.arcsinh(np.tan(angle)) - np.arcsinh(np.tan(phi))) / 0.05
        np.testing.assert_allclose(found.time[found.ray == ray], time, rtol=1e-11, atol=1e-15)
    assert len(at(found, "turning point")) >= 1


def test_arcs_do_not_depend_on_where_they_are_cut() -> None:
    origin, aims = np.array([0.0, 0.0, -0.12]), downward(-20.0, 0.0, 7.0)
    coarse, fine = (fan(Medium(TANK, TANK_PROFILE), (), origin, aims, 2e-3, spacing=s) for s in (np.inf, 0.01))
    assert len(fine.ray) > 3 * len(coarse.ray)
    np.testing.assert_allclose(fine.position[at(fine, "end")], coarse.position[at(coarse, "end")], atol=1e-10)


def test_a_fan_and_an_eigenray_agree() -> None:
    start, end = np.array([[0.0, 0.0, -0.05]]), np.array([[2.0, 1.0, -0.25]])
    path = Refracted().connect(TANK_PROFILE, 0.3, start, end)
    followed = fan(Medium(TANK, TANK_PROFILE), (), start[0], path.departure[:1], float(path.travel_time[0]))
    np.testing.assert_allclose(followed.position[-1], end[0], atol=1e-9)
    np.testing.assert_allclose(followed.length[-1], path.length[0], rtol=1e-9)
    np.testing.assert_allclose(followed.direction[-1], path.arrival[0], atol=1e-9)


def l_shape() -> PlacedTarget:
    upright = trimesh.creation.box((0.2, 4.0, 4.0), transform=trimesh.transformations.translation_matrix([0, 0, 2.0]))
    lying = trimesh.creation.box((3.0, 4.0, 0.2), transform=trimesh.transformations.translation_matrix([1.6, 0, 0.1]))
    mesh = mesh_from(trimesh.util.concatenate([upright, lying]))
    return PlacedTarget("l", mesh, Pose(np.array([8.0, 6.0, -12.0]), quaternion(-0.5 * np.pi)), np.zeros(3))


def test_rays_that_meet_the_l_shape_are_sent_on_to_the_shrimp_with_the_lobes_coefficient() -> None:
    water = Environment(depth=20.0, sound_speed=Isovelocity(speed=1540.0))
    shrimp = np.array([1.0, 10.0, -10.0])
    law = MirrorLobe(width=0.3)
    azimuth, down = np.meshgrid(np.deg2rad(np.linspace(20, 55, 12)), np.deg2rad(np.linspace(-5, 25, 7)))
    aims = np.stack([np.cos(down) * np.cos(azimuth), np.cos(down) * np.sin(azimuth), -np.sin(down)], -1).reshape(-1, 3)
    for profile in (
        Profile(np.array([0.0]), np.array([1540.0])),
        Profile(np.array([0.0, 20.0]), np.array([1545.0, 1530.0])),
    ):
        found = fan(
            Medium(water, profile), (l_shape(),), np.array([0.0, 0.0, -9.0]), aims, 0.03,
            towards=shrimp, laws=(law,), propagation=AutoTracing(), centre=55e3,
        )  # fmt: skip
        arrived, hit = at(found, "arrival"), at(found, "facet")
        assert len(arrived) > 10
        assert len(hit) == np.isfinite(found.coefficient).sum()
        assert np.array_equal(np.sort(found.ray[arrived]), np.flatnonzero(found.coefficient > 0))
        np.testing.assert_allclose(found.position[arrived], np.tile(shrimp, (len(arrived), 1)), atol=1e-4)
        assert (found.length[arrived] >= 0).all()
        placed = l_shape()
        normal = placed.pose.turn_to_world(placed.mesh.normal[found.facet[hit]])
        mirrored = found.direction[hit]
        on = unit(shrimp - found.position[hit])
        arriving = mirrored - 2 * np.sum(mirrored * normal, axis=1)[:, None] * normal
        ones = np.ones(len(hit))
        expected = law.amplitude(arriving, on, normal, ones) / law.amplitude(arriving, mirrored, normal, ones)
        got = found.coefficient[found.ray[hit]]
        free = got > 0
        np.testing.assert_allclose(got[free], expected[free], rtol=1e-4 if profile.uniform else 0.05, atol=1e-6)
        assert (got[~free] == 0).all()
        delta = np.arccos(np.clip(np.sum(mirrored * on, axis=1), -1, 1))
        order = np.argsort(delta[free])
        spread = np.corrcoef(delta[free][order], got[free][order])[0, 1]
        assert spread < -0.8  # decreasing the farther they deviate from the mirrored angle


def test_rays_stop_after_their_bounces() -> None:
    found = fan(Medium(TANK, TANK_PROFILE), (), np.array([0.0, 0.0, -0.1]), downward(45.0), 1.0, 3)
    kinds = [EVENTS[e] for e in found.event if EVENTS[e] in ("surface", "bottom")]
    assert kinds == ["bottom", "surface", "bottom", "surface"]
    assert not len(at(found, "end"))


@pytest.mark.parametrize("speeds", [(1500.0, 1490.0, 1500.0), (1500.0, 1510.0, 1500.0), (1500.0, 1500.0, 1500.0)])
def test_a_level_ray_on_a_node_stays_or_bends_away_but_ends(speeds: tuple[float, float, float]) -> None:
    profile = Profile(np.array([0.0, 0.15, 0.3]), np.array(speeds))
    found = fan(Medium(TANK, profile), (), np.array([0.0, 0.0, -0.15]), np.array([[0.0, 1.0, 0.0]]), 1e-3)
    assert found.time[-1] == pytest.approx(1e-3)
    assert np.isfinite(found.position).all()
    assert (speeds[1] > speeds[0]) == (abs(found.position[-1, 2] + 0.15) > 1e-3)


def test_vertical_rays_go_up_and_down() -> None:
    found = fan(Medium(TANK, TANK_PROFILE), (), np.array([0.5, 0.5, -0.1]), np.array([[0.0, 0.0, -1.0]]), 2e-3)
    np.testing.assert_allclose(found.position[:, :2], 0.5, atol=1e-15)
    assert {"surface", "bottom"} <= {EVENTS[e] for e in found.event}


def test_a_fan_without_an_end_or_outside_the_water_is_refused() -> None:
    with pytest.raises(ValueError, match="finite duration"):
        fan(Medium(TANK, TANK_PROFILE), (), np.zeros(3), downward(3.0), np.inf)
    with pytest.raises(ValueError, match="not in the water"):
        fan(Medium(TANK, TANK_PROFILE), (), np.array([0.0, 0.0, -1.0]), downward(3.0), 1.0)
    with pytest.raises(ValueError, match="laws, a propagation"):
        fan(Medium(TANK, TANK_PROFILE), (), np.array([0.0, 0.0, -0.1]), downward(3.0), 1e-3, towards=np.zeros(3))
