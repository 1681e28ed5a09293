"""Locating a snap: signs, exactness, and errors that keep their word."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.conventions import azimuth_elevation, direction, scattered
from sonarsynth.environment.sea import Profile
from sonarsynth.environment.sound_speed import mean_gradient
from sonarsynth.equations.arrays.spherical_wave import envelope_peak, tangent_plane
from sonarsynth.equations.arrays.wavefront_errors import bending_covariance
from sonarsynth.equations.rays.ray_solutions import eigenrays, water
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.motion import Hover, Track, pose, velocity
from sonarsynth.planning.notes.source_notes import OBLIQUE, oblique_error
from sonarsynth.products import Signals, SourceEstimates
from sonarsynth.ranging import SensorDelays
from sonarsynth.ranging.location.locating import FEW
from sonarsynth.ranging.location.refraction import first_rays
from sonarsynth.ranging.location.source_position import ACCEPTED, SILENT, UNRESOLVED
from sonarsynth.ranging.location.triggered import Triggered
from sonarsynth.receiver import Band, PlanarLattice, Romanis, Sonar, elements
from sonarsynth.state import Receiver, Survey, Trigger
from tests.heard import RATE, envelope_late, hear, hear_direct, pulse_spectrum, silence

C = 1540.0
ROMANIS = elements(Romanis())
SMALL_ARRAY = PlanarLattice(columns=12, rows=12, pitch=0.1, face=0.04953)
SMALL = elements(SMALL_ARRAY)
AHEAD = Pose(np.array([0.0, 0.0, -5.0]), quaternion(np.pi / 2))
WATER = Profile(np.array([0.0]), np.array([C]))


def locate(
    signals, array, source, pose=AHEAD, sonar=None, depth_error=0.0, snaps=1, method=None, profile=WATER
) -> SourceEstimates:
    """With the bottom where the source is, but for depth_error."""
    depth = -pose.to_world(np.asarray(source, float))[2] + depth_error
    method, receiver = method or SensorDelays(), Receiver(pose, array, sonar or Sonar(assumed_sound_speed=C))
    return method.locate(signals, receiver, Survey(float(depth), profile), snaps)


@pytest.mark.parametrize(("columns", "rows"), [(64, 64), (46, 46), (16, 8), (8, 128), (128, 8), (65, 63), (2, 200)])
def test_sensors_of_the_first_fit_are_all_over_the_array(columns, rows):
    """As wide and as high as it is, whatever its rows and columns: those of one row tell no direction."""
    q = elements(PlanarLattice(columns=columns, rows=rows, pitch=0.05)).position
    few = q[scattered(FEW, len(q))]
    assert len(few) <= 64
    assert np.all(few[:, 1:].std(axis=0) > 0.9 * q[:, 1:].std(axis=0))
    assert abs(np.corrcoef(few[:, 1:].T)[0, 1]) < 0.25  # of 64 by chance: 0.13


@pytest.mark.parametrize("azimuth", [-0.4, 0.5])
@pytest.mark.parametrize("elevation", [-0.6, -0.15])
def test_four_quadrants(azimuth, elevation):
    """Port is +y and up is +z; upwards the same, where the bottom is overhead (a sonar that hangs upside down)."""
    for turn in (1.0, -1.0):
        source = 12.0 * direction(azimuth, turn * elevation)
        pose = Pose(AHEAD.position, quaternion(np.pi / 2, 0.0, 0.0 if turn > 0 else np.pi))
        found = locate(hear_direct(ROMANIS, source), ROMANIS, source, pose)
        assert found.azimuth[0] == pytest.approx(azimuth, abs=1e-5)
        assert found.elevation[0] == pytest.approx(turn * elevation, abs=1e-5)
        assert np.linalg.norm(found.position[0] - source) < 1e-3
        assert found.range_from_depth[0] == pytest.approx(12.0, abs=1e-3)
        assert found.range_from_curvature[0] == pytest.approx(12.0, abs=2e-3)
        assert found.time[0] == pytest.approx(12.0 / C + envelope_late(), abs=3 * found.time_error[0])


def test_an_array_of_which_every_second_sensor_stands_in_one_line():
    """The first fit is made of some sensors where these do: here they tell no direction, and all are taken."""
    array, source = elements(PlanarLattice(columns=2, rows=64, pitch=0.05)), 12.0 * direction(0.3, -0.2)
    found = locate(hear_direct(array, source), array, source)
    assert found.reason[0] == ACCEPTED
    assert found.azimuth[0] == pytest.approx(0.3, abs=1e-3)
    assert found.elevation[0] == pytest.approx(-0.2, abs=1e-4)


def test_what_is_fainter_than_the_converter_rounds_is_no_pulse():
    """Counts here and there before a snap, in a record that is silent besides: it was looked at with all sensors."""
    source, step = 12.0 * direction(0.3, -0.2), 1e-3
    heard = hear_direct(ROMANIS, source)
    first = int((12.0 / C - 2.5e-3 - heard.start) * RATE)
    counts = np.zeros_like(heard.pressure)
    counts[::3, first : first + 40] = step
    found = locate(replace(heard, pressure=heard.pressure + counts, quantum=step), ROMANIS, source, snaps=2)
    assert found.reason.tolist() == [ACCEPTED, SILENT]


def test_a_planar_array_hears_what_is_behind_it_in_front():
    behind, mirrored = np.array([-9.0, 4.0, -3.0]), np.array([9.0, 4.0, -3.0])
    found = locate(hear_direct(ROMANIS, behind), ROMANIS, mirrored)
    assert np.linalg.norm(found.position[0] - mirrored) < 1e-3


@pytest.mark.parametrize("noise", [0.0, 3e-3])
@pytest.mark.parametrize("toward", [direction(0.5 * np.pi, -0.2), direction(0.0, -0.5 * np.pi)])
def test_a_source_in_the_plane_of_the_array_errs_by_what_is_predicted(toward, noise):
    """Where delays change by the square of the angle out of the plane: 13 predicted errors off before, 10 mm."""
    source, bare = 8.0 * toward, elements(Romanis(face=0.0))
    known = Sonar(assumed_sound_speed=C, sound_speed_error=0.0)
    found = locate(hear_direct(bare, source, C, noise, np.random.default_rng(1)), bare, source, sonar=known)
    error = np.linalg.norm(found.position[0] - source)
    assert error < 3.0 * np.sqrt(np.trace(found.position_covariance[0])) and error < 0.02 and (error < 5e-3 or noise)


def test_moving_and_turning_everything_changes_nothing():
    source = np.array([9.0, -5.0, -6.0])
    signals = hear_direct(ROMANIS, source)
    turned = Pose(np.array([120.0, -40.0, -9.0]), quaternion(2.0))
    here, there = locate(signals, ROMANIS, source), locate(signals, ROMANIS, source, turned)
    for name, value in vars(here).items():
        assert np.allclose(value, getattr(there, name), rtol=1e-9, atol=1e-12), name


@pytest.mark.parametrize("swings", [{"surge": 3.0, "sway": 2.0, "heave": 1.0}, {"yaw": 0.4}, "all"], ids=str)
def test_an_array_that_moves_and_turns_locates_as_one_at_rest(swings):
    """Sensors come towards the wave while it passes them: for rest, directions would be off by v/c times a tangent, and
    times by what faces hear differently there, 2 ns. To an array that turns the wave is bent as one from elsewhere: at
    57 degrees a second its range is off by 8 mm of 12 m. It is half a second after the instant of the frame, when it
    moved and turned otherwise, and was at another depth above the bottom."""
    swings = {"surge": 3.0, "sway": 2.0, "heave": 1.0, "yaw": 0.4} if swings == "all" else swings
    motion = Hover(position=(0.0, 0.0, -5.0), heading=np.pi / 2, period=2.0, phase=0.6, **swings)
    source, late, wait = np.array([9.0, -5.0, -6.0]), np.zeros(SMALL.count), 0.5
    there = pose(motion, wait + np.linalg.norm(source) / C)  # when it hears the snap
    for _ in range(4):
        then = [pose(motion, wait + np.linalg.norm(source) / C + seconds) for seconds in late.tolist()]
        moved = there.to_body([at.to_world(place) for at, place in zip(then, SMALL.position, strict=True)])
        late = (np.linalg.norm(source - moved, axis=1) - np.linalg.norm(source)) / C
    signals = hear_direct(replace(SMALL, position=moved), source)
    signals, arrival = replace(signals, start=signals.start + wait), np.linalg.norm(source) / C + envelope_late()
    track = Track(pose(motion, 0.0), velocity(motion, 0.0), motion)
    survey = Survey(-float(there.to_world(source)[2]), WATER)
    receivers = (
        Receiver(at, SMALL, Sonar(assumed_sound_speed=C), on) for at, on in ((track.pose, track), (there, None))
    )
    known, taken_for_still = (SensorDelays().locate(signals, receiver, survey, 1) for receiver in receivers)
    assert np.linalg.norm(known.position[0] - source) < 1e-3
    assert abs(known.range_from_depth[0] - np.linalg.norm(source)) < 1e-3
    assert abs(known.time[0] - wait - arrival) < 5e-10
    assert np.linalg.norm(taken_for_still.position[0] - source) > (2e-2 if "surge" in swings else 2e-3)
    ranges = (estimates.range_from_curvature[0] for estimates in (known, taken_for_still))
    off, off_for_still = (abs(r - np.linalg.norm(source)) for r in ranges)
    assert off < 1e-4 and off_for_still > 5e-3


def test_what_a_trigger_tells_is_seen_from_where_the_array_is_when_it_hears():
    """It closes in on the source, which then is as far as sound has come."""
    source, velocity = np.array([20.0, -5.0, -6.0]), np.array([10.0, 2.0, 0.0])
    track, told = Track(AHEAD, AHEAD.turn_to_world(velocity)), (Trigger(0.0, AHEAD.to_world(source)),)
    receiver = Receiver(AHEAD, SMALL, Sonar(assumed_sound_speed=C), track)
    found = Triggered().locate(silence(SMALL, 0.0, 8), receiver, Survey(20.0, WATER, told), 1)
    arrival = float(found.time[0])
    np.testing.assert_allclose(found.position[0], source - velocity * arrival, atol=1e-6)
    assert np.linalg.norm(found.position[0]) == pytest.approx(C * arrival, rel=1e-9)


def test_a_later_clock_moves_only_the_time():
    source = np.array([9.0, -5.0, -6.0])
    signals = hear_direct(ROMANIS, source)
    here = locate(signals, ROMANIS, source)
    later = locate(replace(signals, start=signals.start + 1.0), ROMANIS, source)
    assert later.time[0] - here.time[0] == pytest.approx(1.0, abs=1e-12)
    assert np.allclose(later.position, here.position, atol=1e-5)


def test_dead_sensors_do_not_matter():
    dead = tuple(range(0, 508, 7))
    array = elements(Romanis(dead=dead))
    source = np.array([12.0, 6.0, -5.0])
    signals = hear_direct(array, source)
    signals.pressure[list(dead)] = 50.0 * np.random.default_rng(0).standard_normal((len(dead), 1)).astype(np.float32)
    found = locate(signals, array, source)
    assert np.linalg.norm(found.position[0] - source) < 1e-3


def test_an_echo_close_behind_the_pulse_does_little():
    """40 dB down and 0.7 ms later, from elsewhere."""
    source, near = np.array([12.0, 6.0, -5.0]), np.array([4.0, -1.0, -0.5])
    late = np.linalg.norm(source) / C + 0.7e-3 - np.linalg.norm(near) / C
    signals = hear(
        hear_direct(ROMANIS, source), ROMANIS, near, late, 0.01 * np.linalg.norm(near) / np.linalg.norm(source)
    )
    found = locate(signals, ROMANIS, source)
    assert abs(found.elevation[0] - azimuth_elevation(source)[1]) < 1e-4
    assert np.linalg.norm(found.position[0] - source) < 0.02


@pytest.mark.parametrize("decibels", [0.0, 1.0, 2.5, 4.0])
def test_unlike_gains_are_neither_another_pulse_nor_noise(decibels):
    """Gains are positive and in phase, whatever their spread: directions err as they say, not less and not more."""
    source, off = np.array([9.0, 5.0, -4.0]), []
    true = np.array(azimuth_elevation(source))
    sonar = Sonar(assumed_sound_speed=C, sound_speed_error=0.0, bed_depth_error=0.0)
    for seed in range(12):
        random = np.random.default_rng(seed)
        signals = hear_direct(SMALL, source, C, 0.003 * 20.0 / np.linalg.norm(source), random, samples=700)
        gain = 10.0 ** (decibels * random.standard_normal((SMALL.count, 1)) / 20.0)
        signals = replace(signals, pressure=(signals.pressure * gain).astype(np.float32))
        found = locate(signals, SMALL, source, sonar=sonar)
        assert found.reason[0] == ACCEPTED
        errors = np.array([found.azimuth_error[0], found.elevation_error[0]])
        off.append((np.array([found.azimuth[0], found.elevation[0]]) - true) / errors)
    assert 0.57 < np.sqrt(np.mean(np.square(off))) < 1.43, "three standard errors of a root mean square of 24 numbers"


def test_another_pulse_at_the_same_time_is_told():
    """As loud by half and from elsewhere: no place is claimed."""
    source, other = np.array([12.0, 6.0, -5.0]), np.array([12.0, -4.0, -5.0])
    late = (np.linalg.norm(source) - np.linalg.norm(other)) / C
    signals = hear(hear_direct(SMALL, source, samples=700), SMALL, other, late, 0.5)
    assert locate(signals, SMALL, source).reason[0] == UNRESOLVED


def test_the_face_of_the_elements_is_known():
    """Far off the axis the face changes the sign of the upper band, sensor by sensor differently: no bias is left."""
    source = np.array([6.0, 4.5, -4.0])
    found = locate(hear_direct(ROMANIS, source), ROMANIS, source)
    assert np.linalg.norm(found.position[0] - source) < 2e-3
    assert found.residual[0] < 1e-9


def tries(count, noise, speed_error, depth_error):
    """Errors over predicted errors of many snaps: noise, sound speed and depth off as the instrument fears."""
    random = np.random.default_rng(11)
    sonar = Sonar(array=SMALL_ARRAY, assumed_sound_speed=C, sound_speed_error=speed_error, bed_depth_error=depth_error)
    rows = []
    for _ in range(count):
        source = random.uniform(6.0, 25.0) * direction(random.uniform(-0.5, 0.5), random.uniform(-0.7, -0.1))
        speed = C + speed_error * random.standard_normal()
        # noise re the pulse on the axis at this distance
        peak = 20.0 / np.linalg.norm(source)
        signals = hear_direct(SMALL, source, speed, noise * peak, random, samples=700)
        off = depth_error * random.standard_normal()
        b = locate(signals, SMALL, source, sonar=sonar, depth_error=off)
        azimuth, elevation = azimuth_elevation(source)
        r = np.linalg.norm(source)
        rows.append(
            [
                (b.azimuth[0] - azimuth) / b.azimuth_error[0],
                (b.elevation[0] - elevation) / b.elevation_error[0],
                (b.range_from_depth[0] - r) / b.range_from_depth_error[0],
                (b.range_from_curvature[0] - r) / b.range_from_curvature_error[0],
                *((b.position[0] - source) / np.sqrt(np.diag(b.position_covariance[0]))),
            ]
        )
    return np.array(rows)


@pytest.mark.parametrize(
    ("noise", "speed_error", "depth_error"),
    [(0.0, 1.0, 0.05), (0.003, 0.0, 0.05), (0.01, 1.0, 0.05), (0.001, 0.3, 0.001)],
)
def test_errors_are_honest(noise, speed_error, depth_error):
    """Within three predicted errors in 95 % of cases at least, and not because errors are called huge."""
    rows = tries(120, noise, speed_error, depth_error)
    assert np.isfinite(rows).all()
    assert np.mean(np.abs(rows) < 3, axis=0).min() >= 0.95
    spread = np.sqrt(np.mean(rows**2, axis=0))
    assert spread.min() > 0.5
    assert spread.max() < 1.5


def test_without_any_error_the_rest_is_within_the_floor():
    rows = tries(40, 0.0, 0.0, 1e-9)
    assert np.abs(rows).max() < 3


def test_snaps_are_found_loudest_first():
    near, far = np.array([8.0, -3.0, -5.0]), np.array([14.0, 6.0, -5.0])
    start = round(4e-3 * RATE) / RATE
    signals = hear(silence(ROMANIS, start, 1800), ROMANIS, far, 0.0, 1.0)
    signals = hear(signals, ROMANIS, near, 1e-3, 1.0)
    found = locate(signals, ROMANIS, near, snaps=3)
    assert np.linalg.norm(found.position[0] - near) < 0.01
    assert np.linalg.norm(found.position[1] - far) < 0.02
    assert found.time[0] == pytest.approx(1e-3 + np.linalg.norm(near) / C + envelope_late(), abs=1e-6)
    assert np.isnan(found.position[2]).all()
    assert np.isnan(found.time[2])


def test_the_image_of_a_snap_in_the_surface_is_no_snap():
    source = np.array([9.0, -5.0, -6.0])
    image = np.array([9.0, -5.0, 16.0])  # the sonar is 5 m down
    start = round(6e-3 * RATE) / RATE
    signals = hear(hear(silence(ROMANIS, start, 2400), ROMANIS, source, 0.0, 1.0), ROMANIS, image, 0.0, -1.0)
    found = locate(signals, ROMANIS, source, snaps=2)
    assert np.linalg.norm(found.position[0] - source) < 0.01
    assert np.isnan(found.position[1]).all()


def refracted_signals(array, source, pose, profile):
    """The pulse along rays through a profile; sensors one by one."""
    sea = water(profile.depth, profile.speed, 100.0)
    sensors = np.vstack([pose.to_world(array.position), pose.position])
    start = pose.to_world(source)
    across = sensors[:, :2] - start[:2]
    rays = eigenrays(sea, np.full(len(sensors), -start[2]), -sensors[:, 2], np.hypot(*across.T))
    assert len(rays.travel_time) == len(sensors)
    heading = across[-1] / np.linalg.norm(across[-1])
    arriving = np.array([*(np.sqrt(1 - rays.end_sine[-1] ** 2) * heading), rays.end_sine[-1]])
    arrival = rays.travel_time[:-1]
    first = round((arrival.mean() - 1e-3) * RATE) / RATE
    total = silence(array, first, 800).pressure
    for q in range(array.count):
        alone = replace(array, position=np.zeros((1, 3)), gain=np.ones(1), face=0.0)
        away = np.linalg.norm(source - array.position[q])
        unheard = Signals(np.zeros((1, 800), np.float32), first, RATE, 0.0, 0, 0)
        total[q] = hear(unheard, alone, [away, 0.0, 0.0], arrival[q] - away / C, 1.0).pressure[0]
    return Signals(total, first, RATE, 0.0, 0, 0), -pose.turn_to_body(arriving)


def test_refraction_is_undone_by_the_profile():
    profile = Profile(np.array([0.0, 4.0, 8.0, 20.0]), np.array([1546.0, 1545.0, 1537.0, 1535.0]))
    pose = Pose(np.array([3.0, 2.0, -5.0]), quaternion(0.7, 0.05, 0.02))
    source = np.array([9.0, -5.0, -6.0])
    array = elements(PlanarLattice(columns=9, rows=9, pitch=0.15, face=0.0))
    signals, seen = refracted_signals(array, source, pose, profile)
    straight = locate(signals, array, source, pose)
    traced = locate(signals, array, source, pose, method=SensorDelays(refraction=True), profile=profile)
    assert np.linalg.norm(straight.position[0] - source) > 0.03
    assert np.linalg.norm(traced.position[0] - source) < 1e-3
    assert np.allclose([traced.azimuth[0], traced.elevation[0]], np.ravel(azimuth_elevation(seen)), atol=1e-5)


def test_no_error_of_the_assumed_speed_enters_where_rays_are_traced():
    """Over 48 draws of noise, of the bottom's depth and of the assumed speed each coordinate errs by what is predicted:
    along the axis of the array it was predicted to err by 2.4 times as much, for a speed that is off by 4 m/s."""
    profile = Profile(np.array([0.0, 4.0, 8.0, 20.0]), np.array([1546.0, 1545.0, 1537.0, 1535.0]))
    source, random = np.array([9.0, -5.0, -6.0]), np.random.default_rng(2)
    array = elements(PlanarLattice(columns=6, rows=6, pitch=0.2, face=0.0))
    signals, _ = refracted_signals(array, source, AHEAD, profile)
    scaled = []
    for _ in range(48):
        noise = random.normal(0.0, 0.02 * np.abs(signals.pressure).max(), signals.pressure.shape)
        heard = replace(signals, pressure=(signals.pressure + noise).astype(np.float32))
        sonar = Sonar(array=SMALL_ARRAY, assumed_sound_speed=random.normal(C, 4.0), sound_speed_error=4.0)
        depth_error, tracing = random.normal(0.0, sonar.bed_depth_error), SensorDelays(refraction=True)
        found = locate(heard, array, source, AHEAD, sonar, depth_error, method=tracing, profile=profile)
        error = found.position[0] - source
        scaled.append(error / np.sqrt(np.diag(found.position_covariance[0])))
    assert np.all(np.abs(np.sqrt(np.mean(np.square(scaled), axis=0)) - 1.0) < 0.3), scaled


def bent(random, kind):
    """A profile of a random gradient of some kind, 20 m deep."""
    g = random.choice([-1, 1]) * 10 ** random.uniform(-1.5, 0.5)
    if kind == "gradient":
        return Profile(np.array([0.0, 40.0]), C + g * (np.array([0.0, 40.0]) - 10))
    if kind == "layer":
        z = random.uniform(8.0, 16.0)
        return Profile(np.array([0.0, z - 1, z + 1, 40.0]), C + 1.5 * g * np.array([-1, -1, 1, 1]))
    if kind == "thermocline":
        z, drop = random.uniform(14.0, 17.0), random.uniform(1.0, 8.0)
        return Profile(np.array([0.0, z, z + 1.5, 40.0]), C - drop * np.array([0, 0, 1, 1]))
    return Profile(np.sort(random.uniform(0.0, 25.0, 6)), random.normal(C, 2.0, 6))


@pytest.mark.parametrize("kind", ["gradient", "layer", "rough", "thermocline"])
def test_errors_of_straight_rays_are_honest_in_bending_water(kind):
    """In little noise, speed and depth as far off as the sonar says: places err by what is predicted along and across,
    within three of it in nine cases of ten. Thermoclines were predicted to move them by three times too much, and they
    were 1 to 6 cm off in the middle: what bending does is known, and so the depth of the bottom undoes most of it."""
    random = np.random.default_rng(5)
    array = elements(PlanarLattice(columns=5, rows=5, pitch=0.25, face=0.0))
    miss, pulls, scaled, elevations = [], [], [], []
    for _ in range(24):
        profile = bent(random, kind)
        pose = Pose(np.array([0.0, 0.0, -random.uniform(4, 14)]), quaternion(1.0, random.uniform(-0.1, 0.1), 0.2))
        across, along = random.uniform(-0.4, 0.4), random.uniform(10.0, 30.0)
        ahead = pose.turn_to_world(np.array([1.0, across, 0.0]))[:2]
        source = pose.to_body(np.array([*(pose.position[:2] + along * ahead), -20.0]))
        signals, seen = refracted_signals(array, source, pose, profile)
        speed = float(profile.at(-pose.position[2]))
        noise = random.normal(0.0, 0.003 * np.abs(signals.pressure).max(), signals.pressure.shape)
        signals = replace(signals, pressure=(signals.pressure + noise).astype(np.float32))
        assumed = random.normal(speed, 0.1)
        sonar = Sonar(array=SMALL_ARRAY, assumed_sound_speed=assumed, sound_speed_error=0.1, bed_depth_error=0.01)
        found = locate(signals, array, source, pose, sonar, random.normal(0.0, 0.01), profile=profile)
        error = found.position[0] - source
        miss.append(np.linalg.norm(error))
        away = source / np.linalg.norm(source)
        axes = np.array([away, tangent_plane(away)[1]])
        pulls.append(axes @ error / np.sqrt(np.diag(axes @ found.position_covariance[0] @ axes.T)))
        scaled.append(np.sqrt(error @ np.linalg.solve(found.position_covariance[0], error)))
        elevations.append((found.elevation[0] - azimuth_elevation(seen)[1]) / found.elevation_error[0])
    placed = np.isfinite(scaled)  # a place that is known to a fifth of its range is given
    assert placed.mean() > 0.5 and np.mean(np.array(scaled)[placed] < 3.76) >= 0.9
    assert np.mean(np.abs(elevations) < 3) >= 0.9
    assert np.all(np.abs(np.sqrt(np.nanmean(np.square(pulls), axis=0)) - 1.0) < 0.5), np.sqrt(
        np.nanmean(np.square(pulls), axis=0)
    )
    assert np.nanmedian(miss) < 0.02, np.nanmedian(miss)  # of those that have a place


@pytest.mark.parametrize("gradient", [0.02, -0.3, 1.5])
def test_the_angle_of_bending_is_that_of_the_arc(gradient):
    """Between ray and chord, in water of one gradient."""
    depth, snap, array = np.array([0.0, 60.0]), np.array([12.0, 9.0, -20.0]), np.array([0.0, 0.0, -8.0])
    profile = Profile(depth, C + gradient * (depth - 8.0))
    ray = first_rays(profile, snap[None], array[None])
    chord = snap - array
    distance = np.linalg.norm(chord)
    u = chord / distance
    g = mean_gradient(profile, 8.0, 20.0, 1.0)
    assert g == pytest.approx(abs(gradient), rel=1e-9)
    covariance = bending_covariance(tangent_plane(u) @ [0, 0, 1], u[2], distance, g, C, 0.6)
    angle = np.arcsin(np.linalg.norm(np.cross(u, -ray.arrival[0])))
    assert np.sqrt(np.trace(covariance[:2, :2])) == pytest.approx(angle, rel=0.02)


def test_mean_gradients():
    jump = Profile(np.array([0.0, 10.0, 10.0, 30.0]), np.array([1500.0, 1500.0, 1504.0, 1504.0]))
    assert mean_gradient(jump, 5.0, 15.0, 1.0) == pytest.approx(0.4)
    assert mean_gradient(jump, 15.0, 5.0, 1.0) == pytest.approx(0.4)
    assert mean_gradient(jump, 20.0, 25.0, 1.0) == 0.0
    slope = Profile(np.array([0.0, 10.0]), np.array([1500.0, 1501.0]))
    assert mean_gradient(slope, 5.0, 5.0, 1.0) == pytest.approx(0.1)  # at one depth: that of its neighbourhood
    assert mean_gradient(WATER, 5.0, 15.0, 1.0) == 0.0


def test_uniform_water_of_any_speed_changes_nothing():
    """What the instrument assumes is its own; only gradients are held against straight rays."""
    source = np.array([9.0, -5.0, -6.0])
    signals = hear_direct(ROMANIS, source)
    here = locate(signals, ROMANIS, source)
    there = locate(signals, ROMANIS, source, profile=Profile(np.array([0.0, 9.0]), np.array([1500.0, 1500.0])))
    for name, value in vars(here).items():
        assert np.array_equal(value, getattr(there, name)), name


@pytest.mark.parametrize("speed", [1500.0, 1532.0, 1548.0])
def test_the_note_on_the_speed_of_sound_names_the_error_of_directions(speed):
    source, method = 100.0 * direction(np.deg2rad(OBLIQUE), 0.0), SensorDelays(on_bottom=False)
    found = locate(hear_direct(SMALL, source, sound_speed=speed), SMALL, source, method=method)
    assert abs(np.rad2deg(found.azimuth[0]) - OBLIQUE) == pytest.approx(oblique_error(C / speed), rel=0.02)


@pytest.mark.parametrize("off", [(28.0, 12.0), (31.0, 27.0), (40.0, 12.0)])
def test_the_time_of_a_pulse_is_right_where_the_faces_have_a_null_in_the_band(off):
    """Bins that no face hears are known as well as the noise allows: the envelope peaks when it does without faces."""
    source = 14.0 * direction(*np.deg2rad([off[0], -off[1]]))
    array = elements(PlanarLattice(columns=12, rows=12, pitch=0.05, face=0.05))
    found = locate(hear_direct(array, source), array, source)
    assert found.time[0] == pytest.approx(14.0 / C + envelope_late(), abs=3e-9)
    noisy = locate(hear_direct(array, source, noise=3e-7, random=np.random.default_rng(3)), array, source)
    assert abs(noisy.time[0] - found.time[0]) < 3.0 * noisy.time_error[0] < 1e-6


@pytest.mark.parametrize(("count", "face"), [(12, 0.04953), (8, 0.042)])
def test_without_noise_the_time_of_a_pulse_errs_by_what_is_predicted_at_any_angle(count, face):
    """Also near the plane of the array, where nulls of the faces run through the band; and what is heard before a pulse
    is no pulse that lasts until then."""
    lattice = PlanarLattice(columns=count, rows=count, pitch=0.06, face=face)
    array, off = elements(lattice), []
    for degrees in (-75.0, -70.0, -60.0, -45.0, -30.0, -20.0, 0.0, 20.0, 40.0, 65.0, 72.5):
        source = 12.0 * direction(np.deg2rad(degrees), -0.02)
        sonar = Sonar(array=lattice, assumed_sound_speed=C, sound_speed_error=0.0)
        found = locate(hear_direct(array, source), array, source, sonar=sonar, method=SensorDelays(on_bottom=False))
        off.append((found.time[0] - 12.0 / C - envelope_late()) / found.time_error[0])
    assert np.max(np.abs(off)) < 4.0 and np.sqrt(np.mean(np.square(off))) < 1.5


def test_the_time_of_a_pulse_is_right_where_a_null_of_the_faces_lies_between_two_bins():
    """In a band of eight bins, as the null moves through it with the source's angle."""
    lattice, band = PlanarLattice(columns=6, rows=6, pitch=0.06, face=0.06), Band(low=25e3, high=50e3)
    array, f, off = elements(lattice), np.linspace(20e3, 60e3, 801), []
    sonar = Sonar(array=lattice, band=band, assumed_sound_speed=C, sound_speed_error=0.0)
    late = envelope_peak(f, pulse_spectrum(f), band.low, band.high)[0]
    for degrees in np.arange(25.0, 75.0, 2.5):
        source = 12.0 * direction(np.deg2rad(degrees), -0.02)
        found = locate(hear_direct(array, source), array, source, sonar=sonar, method=SensorDelays(on_bottom=False))
        off.append((found.time[0] - 12.0 / C - late) / found.time_error[0])
    assert np.max(np.abs(off)) < 4.0
