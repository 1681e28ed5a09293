"""Laws of the arrivals: geometry, wavefronts, reciprocity, scaling, occlusion, and legs that are used again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import Environment, Isovelocity, Profile
from sonarsynth.geometry import Pose, quaternion, unit
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.products import Arrivals
from sonarsynth.propagation import AutoTracing, Refracted, Straight
from sonarsynth.receiver import POINT, Elements, PositionTable, Romanis, elements
from sonarsynth.scattering import Isotropic, MirrorLobe, Scatterers
from sonarsynth.scattering.scatterers import PointScatterer
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.state import Emission, FrameContext, Medium, Receiver
from sonarsynth.tracing.arrivals import direct_sound, trace, trace_each
from sonarsynth.tracing.expansion.probe_sensors import probes
from sonarsynth.tracing.facet_paths import way_to_array
from tests.bodies import mesh_from

ENVIRONMENT = Environment(depth=30.0, sound_speed=Isovelocity(speed=1540.0))
UNIFORM = Profile(np.array([0.0, 30.0]), np.array([1540.0, 1540.0]))
LAYERED = Profile(np.array([0.0, 8.0, 13.0, 30.0]), np.array([1541.0, 1540.0, 1535.0, 1534.0]))
ROMANIS = elements(Romanis())
SONAR = Pose(np.array([0.0, 0.0, -10.0]), quaternion(0.5 * np.pi))


def hull(subdivisions: int = 3) -> Mesh:
    return mesh_from(trimesh.creation.icosphere(subdivisions=subdivisions), [0.8, 0.1, 0.1])


HULL = hull()


def body(
    position: tuple[float, float, float], heading: float = 0.4, mesh: Mesh = HULL, name: str = "hull"
) -> PlacedTarget:
    return PlacedTarget(name, mesh, Pose(np.array(position), quaternion(heading, 0.1, 0.2)), np.zeros(3))


def snap(position: tuple[float, float, float], time: float = 0.0) -> Emission:
    return Emission(np.array(position), time, LogarithmicBubble(), None)


def run(
    bodies: tuple[PlacedTarget, ...] = (body((20.0, 1.0, -11.0)),),
    snaps: tuple[Emission, ...] = (snap((3.0, 6.0, -30.0)),),
    profile: Profile = UNIFORM,
    law: MirrorLobe | Isotropic | None = None,
    sonar: Pose = SONAR,
    array: Elements = ROMANIS,
    absorption: float = 0.02,
    bounces: int = 0,
) -> Arrivals:
    medium = Medium(ENVIRONMENT, profile, absorption)
    laws = (law or MirrorLobe(),) * len(bodies)
    return trace(FrameContext(0.0, bodies, snaps, medium, Receiver(sonar, array), laws), AutoTracing(bounces=bounces))


def delays(found: Arrivals, q: Floats) -> Floats:
    """Delay (path, sensor) by the formula of `Arrivals`."""
    far = np.linalg.norm(found.radius[:, None, None] * found.direction[:, None, :] - q, axis=-1)
    return found.delay[:, None] + (far - found.radius[:, None]) / found.sound_speed + found.expansion.over("delay", q)


def test_in_uniform_water_times_distances_and_amplitudes_are_those_of_straight_lines() -> None:
    law = MirrorLobe(diffuse=0.0, reflectivity=0.9)
    found = run(law=law, snaps=(snap((3.0, 6.0, -30.0), 0.25),))
    assert found.expansion.delay.shape[1] == 0
    assert found.wavefront_error == 0
    assert found.direct[0]
    assert not found.direct[1:].any()
    source = np.array([3.0, 6.0, -30.0])
    out = np.linalg.norm(found.point - source, axis=1)
    back = np.linalg.norm(found.point - SONAR.position, axis=1)
    np.testing.assert_allclose(found.delay, 0.25 + (out + back) / 1540.0, rtol=1e-14)
    np.testing.assert_allclose(found.length, out + back, rtol=1e-14)
    np.testing.assert_allclose(found.radius, back, rtol=1e-14)
    np.testing.assert_allclose(SONAR.to_world(found.radius[:, None] * found.direction), found.point, atol=1e-12)
    q = ROMANIS.position
    exact = np.linalg.norm(found.point[:, None, :] - SONAR.to_world(q), axis=-1) / 1540.0
    np.testing.assert_allclose(delays(found, q) - found.delay[:, None] + back[:, None] / 1540.0, exact, rtol=1e-13)
    loss = 10 ** (-0.02 * (out + back) / 20)
    np.testing.assert_allclose(found.amplitude[0], loss[0] / back[0], rtol=1e-14)
    np.testing.assert_allclose(found.amplitude[1:], (found.scattering * loss / back)[1:] / out[1:], rtol=1e-13)
    placed = body((20.0, 1.0, -11.0))
    normal = placed.pose.turn_to_world(HULL.normal)[found.facet[1:]]
    to_facet, to_array = unit(found.point[1:] - source), unit(SONAR.position - found.point[1:])
    expected = law.amplitude(to_facet, to_array, normal, HULL.area[found.facet[1:]])
    np.testing.assert_allclose(found.scattering[1:], law.polarity(HULL)[found.facet[1:]] * expected, rtol=1e-12)
    np.testing.assert_allclose(found.point[1:], placed.pose.to_world(HULL.centroid[found.facet[1:]]), atol=1e-12)


def test_every_facet_that_is_lit_and_seen_arrives_once_and_no_other() -> None:
    found = run(law=Isotropic())
    placed = body((20.0, 1.0, -11.0))
    centroid, normal = placed.pose.to_world(HULL.centroid), placed.pose.turn_to_world(HULL.normal)
    lit = np.sum(normal * (centroid - [3.0, 6.0, -30.0]), axis=1) < 0
    seen = np.sum(normal * (SONAR.position - centroid), axis=1) > 0
    assert np.array_equal(found.facet[1:], np.flatnonzero(lit & seen))


def test_arrivals_are_sorted_by_snap_target_and_facet() -> None:
    bodies = (body((20.0, 1.0, -11.0)), body((15.0, -3.0, -12.0), name="other"))
    snaps = (snap((3.0, 6.0, -30.0)), snap((8.0, -6.0, -30.0), 1e-3))
    for profile in (UNIFORM, LAYERED):
        found = run(bodies, snaps, profile)
        keys = np.stack([found.snap, found.target, found.facet], axis=1)
        assert np.array_equal(np.lexsort(keys.T[::-1]), np.arange(len(keys)))
        assert set(found.target) == {-1, 0, 1}
        assert set(found.snap) == {0, 1}


def alone(context: FrameContext, bounces: int = 0) -> Arrivals:
    """Traced by a process that has traced nothing before."""
    way_to_array.cache_clear()
    direct_sound.cache_clear()
    return trace(context, AutoTracing(bounces=bounces))


def equal(found: Arrivals, other: Arrivals) -> bool:
    """Whether two frames have the same paths, bit for bit."""
    return all(np.array_equal(value, other.columns[name], equal_nan=True) for name, value in found.columns.items())


@pytest.mark.parametrize(("profile", "bounces"), [(UNIFORM, 0), (UNIFORM, 1), (LAYERED, 0)])
def test_legs_of_the_array_side_serve_a_moved_shrimp(profile: Profile, bounces: int) -> None:
    bodies = (body((20.0, 1.0, -11.0)), body((15.0, 0.5, -11.5), name="other"))
    water, laws = Medium(ENVIRONMENT, profile, 0.02), (MirrorLobe(),) * 2
    choices = [(), *((snap(p),) for p in ((3.0, 6.0, -30.0), (10.0, -9.0, -29.0), (25.0, 3.0, -30.0)))]
    context = FrameContext(0.0, bodies, (), water, Receiver(SONAR, ROMANIS), laws)
    anew = [alone(replace(context, snaps=snaps), bounces) for snaps in choices]
    together = trace_each(context, AutoTracing(bounces=bounces), choices)
    later = [trace(replace(context, snaps=snaps), AutoTracing(bounces=bounces)) for snaps in choices]
    assert all(map(equal, anew, together)) and all(map(equal, anew, later))


@pytest.mark.parametrize(("profile", "bounces"), [(UNIFORM, 0), (LAYERED, 1)])
def test_what_a_frame_before_had_serves_another_only_where_all_that_it_depends_on_is_the_same(
    profile: Profile, bounces: int
) -> None:
    still, snaps = body((20.0, 1.0, -11.0)), (snap((3.0, 6.0, -30.0)),)
    one = FrameContext(
        0.0, (still,), snaps, Medium(ENVIRONMENT, profile, 0.02), Receiver(SONAR, ROMANIS), (MirrorLobe(),)
    )
    warmer, propagation = Profile(profile.depth, profile.speed + 0.5), AutoTracing(bounces=bounces)
    stones = Scatterers("volume", PointScatterer(0.1), np.array([[18.0, 0.0, -12.0]]), np.zeros((1, 3)), np.ones(1))
    lower = replace(SONAR, position=SONAR.position - [0.0, 0.0, 0.1])
    others = [
        replace(one, bodies=(body((20.0, 1.001, -11.0)),)),
        replace(one, bodies=(body((20.0, 1.0, -11.0), heading=0.41),)),
        replace(one, bodies=(body((20.0, 1.0, -11.0), mesh=hull(2)),)),
        replace(one, bodies=(still, body((18.0, 1.0, -11.0))), laws=one.laws * 2),
        replace(one, receiver=replace(one.receiver, pose=lower)),
        replace(one, receiver=replace(one.receiver, elements=elements(Romanis(pitch=0.06)))),
        replace(one, medium=replace(one.medium, profile=warmer)),
        replace(one, bodies=(still, body((1.5, 3.0, -20.0))), laws=one.laws * 2),  # hides the snap itself
        replace(one, snaps=(snap((3.0, 6.001, -30.0)),)),
        replace(one, snaps=(snap((3.0, 6.0, -30.0), 1e-9),)),
        replace(one, medium=replace(one.medium, environment=replace(ENVIRONMENT, depth=31.0), profile=warmer)),
        replace(one, tolerances=replace(one.tolerances, every=2)),
        replace(one, scatterers=(stones,)),
        replace(one, laws=(Isotropic(),)),
        replace(one, medium=replace(one.medium, absorption=0.05)),
    ]
    anew, own = [alone(other, bounces) for other in others], alone(one, bounces)
    assert not any(anew[7].direct) or bounces
    for other, expected in zip(others, anew, strict=True):
        assert equal(trace(other, propagation), expected) and not equal(expected, own)
        assert equal(trace(one, propagation), own)


@pytest.mark.parametrize("time", [-50.0, 1e4])
def test_whatever_the_clock_says_when_the_snap_sounds_changes_nothing_but_delays(time: float) -> None:
    now, then = run(profile=LAYERED).columns, run(profile=LAYERED, snaps=(snap((3.0, 6.0, -30.0), time),)).columns
    np.testing.assert_allclose(then.pop("delay") - time, now.pop("delay"), rtol=0, atol=1e-11)
    for name, value in now.items():
        np.testing.assert_array_equal(then[name], value, err_msg=name)


def test_moving_everything_together_changes_nothing() -> None:
    turn = Pose(np.array([120.0, -70.0, 0.0]), quaternion(1.1))  # heading about the vertical only
    here = run()
    moved_body = replace(
        body((20.0, 1.0, -11.0)),
        pose=Pose(turn.to_world([20.0, 1.0, -11.0]), compose(turn, body((0.0, 0.0, 0.0)).pose)),
    )
    there = run(
        (moved_body,),
        (snap(tuple(turn.to_world([3.0, 6.0, -30.0]))),),
        sonar=Pose(turn.to_world(SONAR.position), compose(turn, SONAR)),
    )
    assert np.array_equal(here.facet, there.facet)
    np.testing.assert_allclose(there.delay, here.delay, rtol=1e-13)
    np.testing.assert_allclose(there.direction, here.direction, atol=1e-13)
    np.testing.assert_allclose(there.amplitude, here.amplitude, rtol=1e-10)
    np.testing.assert_allclose(there.expansion.amplitude, here.expansion.amplitude, atol=1e-9)


def compose(outer: Pose, inner: Pose) -> Floats:
    from sonarsynth.geometry import quaternion_product

    return quaternion_product(outer.orientation, inner.orientation)


@pytest.mark.parametrize("profile", [UNIFORM, LAYERED])
def test_source_and_array_may_change_places(profile: Profile) -> None:
    here, there = (0.0, 0.0, -10.0), (3.0, 6.0, -28.0)
    forth = run(snaps=(snap(there),), profile=profile, array=POINT)
    back = run(snaps=(snap(here),), profile=profile, array=POINT, sonar=Pose(np.array(there), SONAR.orientation))
    assert np.array_equal(forth.facet, back.facet)
    np.testing.assert_allclose(forth.delay, back.delay, rtol=1e-13)
    np.testing.assert_allclose(forth.amplitude, back.amplitude, rtol=1e-9)


def test_isotropic_facets_in_uniform_water_need_no_terms_at_all() -> None:
    found = run(law=Isotropic())
    assert found.expansion.delay.shape == found.expansion.amplitude.shape == (len(found.delay), 0)


def test_the_lobe_varies_over_the_aperture_as_the_terms_say() -> None:
    law = MirrorLobe()
    found = run(law=law)
    placed = body((20.0, 1.0, -11.0))
    q = ROMANIS.position[::7]
    sensor = SONAR.to_world(q)
    echo = found.select(~found.direct)
    normal, area = placed.pose.turn_to_world(HULL.normal)[echo.facet], HULL.area[echo.facet]
    incident = unit(echo.point - [3.0, 6.0, -30.0])
    away = sensor - echo.point[:, None, :]
    exact = law.amplitude(incident[:, None, :], unit(away), normal[:, None, :], area[:, None])
    everywhere = (exact > 0).all(axis=1)
    exact *= law.polarity(HULL)[echo.facet][:, None]
    model = echo.scattering[:, None] * (1 + echo.expansion.over("amplitude", q))
    assert everywhere.mean() > 0.9
    assert np.abs(model - exact)[everywhere].max() < 2e-3 * np.abs(exact).max()
    assert np.abs(exact / echo.scattering[:, None] - 1)[everywhere].max() > 0.2  # without the terms


def test_a_body_in_between_hides_facets_and_the_direct_snap() -> None:
    screen = mesh_from(trimesh.creation.box((0.1, 3.0, 3.0)))
    wall = PlacedTarget("wall", screen, Pose(np.array([10.0, 0.5, -10.5]), quaternion(0.5 * np.pi)), np.zeros(3))
    for profile in (UNIFORM, LAYERED):
        alone, shielded = run(profile=profile), run((body((20.0, 1.0, -11.0)), wall), profile=profile)
        assert (alone.target == 0).any()
        assert not (shielded.target == 0).any()
        assert (shielded.target == -1).any()
        behind = run((wall,), (snap((18.0, 1.0, -11.0)),), profile=profile)
        assert len(behind.delay) == 0


def test_refracted_wavefronts_fit_rays_traced_to_every_sensor() -> None:
    found = run(profile=LAYERED)
    assert 0 < found.wavefront_error < 2e-7
    some = found.select(np.arange(0, len(found.delay), 23))
    sensor = SONAR.to_world(ROMANIS.position)
    worst = 0.0
    for i in range(len(some.delay)):
        start = np.broadcast_to(some.point[i], sensor.shape)
        paths = Refracted().connect(LAYERED, 30.0, start, sensor)
        centre = Refracted().connect(LAYERED, 30.0, some.point[i : i + 1], SONAR.position[None, :])
        assert len(paths.pair) == len(sensor)
        exact = paths.travel_time - centre.travel_time[0]
        model = (delays(some.select(np.array([i])), ROMANIS.position) - some.delay[i])[0]
        worst = max(worst, float(np.abs(model - exact).max()))
    assert worst < 3 * found.wavefront_error
    np.testing.assert_array_equal(some.expansion.over("delay", np.zeros((1, 3))), 0.0)


def test_straight_rays_take_the_mean_slowness_of_their_depths() -> None:
    start, end = np.array([[0.0, 0.0, -2.0], [0.0, 0.0, -13.0]]), np.array([[30.0, 4.0, -25.0], [9.0, 0.0, -13.0]])
    paths = Straight().connect(LAYERED, 30.0, start, end)
    z = np.linspace(2.0, 25.0, 400001)
    mean = np.mean(1 / LAYERED.at(0.5 * (z[1:] + z[:-1])))
    np.testing.assert_allclose(paths.travel_time, paths.length * [mean, 1 / 1535.0], rtol=1e-10)
    np.testing.assert_allclose(paths.spreading, 1 / np.linalg.norm(end - start, axis=1), rtol=1e-15)


def test_probes_spread_over_the_aperture_and_small_arrays_use_what_they_have() -> None:
    probe = probes(ROMANIS)
    assert len(set(probe.sensor)) == len(probe.sensor) == 15
    assert np.linalg.norm(probe.position, axis=1).max() == ROMANIS.aperture
    line = elements(PositionTable(positions=tuple((0.0, 0.1 * i, 0.0) for i in range(5))))
    for array in (line, POINT):
        found = run(profile=LAYERED, array=array)
        assert np.isfinite(found.wavefront_error)
        assert np.isfinite(found.expansion.delay).all()
        assert (found.expansion.delay[:, 0] == 0).all()


def test_a_target_out_of_the_water_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match="target 'hull' reaches above the surface"):
        run((body((20.0, 1.0, -0.05)),))
    with pytest.raises(ValueError, match="target 'hull' reaches below the bottom"):
        run((body((20.0, 1.0, -29.95)),))
