"""Ranging echoes: a point is where it is, a hull's points lie on the hull, and predicted errors keep their word."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from sonarsynth.conventions import azimuth_elevation, direction
from sonarsynth.environment.sea import Profile, Tabulated
from sonarsynth.geometry import Pose, quaternion, unit
from sonarsynth.imaging import FocusedDelayAndSum
from sonarsynth.ranging import BeamAxis, IsovelocityPlacing, RefractedPlacing, SensorDelays
from sonarsynth.ranging.clouds import true_directions
from sonarsynth.ranging.location.refraction import first_rays, refracted_solution
from sonarsynth.ranging.placing.solution import isovelocity_solution
from sonarsynth.receiver import Romanis, Sonar, elements
from sonarsynth.state import Receiver, Survey
from tests.heard import STRAIGHT, add_noise, cloud_of, hear, hear_echoes

C = 1540.0
ARRAY = elements(Romanis())
SONAR = Sonar(assumed_sound_speed=C)
POSE = Pose(np.array([0.0, 0.0, -8.0]), quaternion(np.pi / 2))
SNAP = np.array([9.0, -5.0, -6.0])
WATER = Profile(np.array([0.0]), np.array([C]))
AXIS = BeamAxis()
MARGIN = 6e-4  # s before the first and after the last echo


def process(signals, first, last, method=AXIS, source=SNAP, pose=POSE, profile=WATER, placing=STRAIGHT):
    found = SensorDelays().locate(signals, Receiver(pose, ARRAY, SONAR), Survey(-pose.to_world(source)[2], WATER), 1)
    image = FocusedDelayAndSum().image(signals, ARRAY, SONAR, first - MARGIN, last + MARGIN)
    how = {"picking": method, "placing": placing}
    return cloud_of(signals, image, found, ARRAY, SONAR, pose, profile, **how), image


def points(cloud):
    return cloud.position, cloud.range.astype(float), cloud.range_error.astype(float)


@pytest.mark.parametrize("target", [(20.0, 0.0, 0.0), (18.0, 4.0, -3.0), (19.0, -6.0, 4.0), (22.0, 5.0, 6.0)])
@pytest.mark.parametrize("placing", [IsovelocityPlacing(), RefractedPlacing()])
def test_a_point_scatterer_is_where_it_is(target, placing):
    target = np.array(target)
    signals, first, last = hear_echoes(ARRAY, SNAP, [target], np.array([1.0]))
    cloud, _ = process(signals, first, last, placing=placing)
    place, r, error = points(cloud)
    assert 1 <= len(cloud) <= 12
    miss = np.linalg.norm(place - target, axis=1)
    cell = SONAR.beams.azimuth[1] - SONAR.beams.azimuth[0]
    assert miss.min() < cell * np.linalg.norm(target)
    assert np.max(miss) < 3 * cell * np.linalg.norm(target)
    assert np.all(np.abs(r - np.linalg.norm(target)) < 3 * error)
    delay = (np.linalg.norm(target - SNAP) + np.linalg.norm(target) - np.linalg.norm(SNAP)) / C
    assert cloud.delay[miss.argmin()] == pytest.approx(delay, abs=1e-6)


def test_two_echoes_in_one_beam_take_the_louder():
    target = np.array([20.0, 0.0, 0.0])
    signals, first, last = hear_echoes(ARRAY, SNAP, [target, 1.03 * target], np.array([1.0, 0.5]))
    _, r, error = points(process(signals, first, last)[0])
    assert np.all(np.abs(r - 20.0) < 3 * error)
    assert np.abs(r - 20.0).min() < 0.05


def test_a_weak_target_beside_a_strong_one_is_no_ghost_but_ghosts_are():
    """10 dB weaker, elsewhere and at another delay: kept; side lobes of the strong one at its delay: not."""
    strong, weak = np.array([20.0, 3.0, 0.0]), np.array([19.0, -4.0, 2.0])
    signals, first, last = hear_echoes(ARRAY, SNAP, [strong, weak], np.array([1.0, 0.35]))
    cloud, _ = process(signals, first, last, BeamAxis(threshold=20.0))
    u = unit(cloud.position.astype(float))
    cosine = np.stack([u @ unit(strong), u @ unit(weak)])
    assert np.all(np.degrees(np.arccos(np.clip(cosine.max(axis=0), -1, 1))) < 2.0)
    assert (cosine.argmax(axis=0) == 1).any()
    assert (cosine.argmax(axis=0) == 0).any()


def test_a_higher_threshold_only_takes_points_away():
    targets = [np.array([20.0, y, z]) for y, z in ((4.0, 0.0), (-3.0, 3.0), (1.0, -4.0))]
    signals, first, last = hear_echoes(ARRAY, SNAP, targets, np.array([1.0, 0.6, 0.4]))
    clouds = [process(signals, first, last, BeamAxis(threshold=t))[0] for t in (12.0, 6.0, 1.0)]
    kept = [set(zip(cloud.azimuth, cloud.elevation, cloud.range, strict=True)) for cloud in clouds]
    assert kept[0] > kept[1] > kept[2] > set()


def test_noise_gives_no_points():
    signals, first, last = hear_echoes(ARRAY, SNAP, [np.array([20.0, 0.0, 0.0])], np.array([1e-6]))
    noisy = add_noise(signals, 1e-3, np.random.default_rng(0))
    cloud, image = process(noisy, first, last)
    assert (image.energy > image.energy.max() / 10**1.2).mean() > 0.5  # the threshold alone would give thousands
    assert len(cloud) == 0


@lru_cache
def hull(length=1.6, radius=0.095, edge=0.016):
    """A closed hull: cylinder with half-ellipsoids at both ends. Patches: centre, outward normal, area."""
    n, m = round(length / edge), round(2 * np.pi * radius / edge)
    end, middle = 0.2, 0.5 * length - 0.2
    x = np.linspace(-0.5 * length, 0.5 * length, 8 * n)
    beyond = np.clip((np.abs(x) - middle) / end, 0, 1)
    a = radius * np.sqrt(1 - beyond**2)
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(a)))])
    at = np.interp((np.arange(n) + 0.5) / n * arc[-1], arc, x)
    rho = radius * np.sqrt(1 - np.clip((np.abs(at) - middle) / end, 0, 1) ** 2)
    angle = 2 * np.pi * (np.arange(m) + 0.5 * (np.arange(n)[:, None] % 2)) / m
    centre = np.stack([at[:, None] + 0 * angle, rho[:, None] * np.cos(angle), rho[:, None] * np.sin(angle)], axis=-1)
    lean = np.sign(at) * np.clip(np.abs(at) - middle, 0, None) / end**2
    normal = unit(
        np.stack([lean[:, None] + 0 * angle, centre[..., 1] / radius**2, centre[..., 2] / radius**2], axis=-1)
    )
    area = np.broadcast_to((arc[-1] / n * 2 * np.pi * rho / m)[:, None], (n, m))
    return centre.reshape(-1, 3), normal.reshape(-1, 3), area.ravel()


def hull_range(beam, centre, heading, length=1.6, radius=0.095):
    """Range (beam,) to the same hull along unit vectors, by marching; NaN for a miss."""
    turn = np.array([[np.cos(heading), np.sin(heading), 0], [-np.sin(heading), np.cos(heading), 0], [0, 0, 1.0]])
    start, u = turn @ -centre, beam @ turn.T
    far = np.linalg.norm(centre)
    t = far + np.linspace(-1.0, 1.0, 8001)
    p = start + t[:, None] * u[:, None]
    beyond = np.clip((np.abs(p[..., 0]) - (0.5 * length - 0.2)) / 0.2, 0, None)
    inside = (p[..., 1] ** 2 + p[..., 2] ** 2) / radius**2 + beyond**2 <= 1
    return np.where(inside.any(axis=1), t[inside.argmax(axis=1)], np.nan)


def lobe(centre, normal, area, source):
    """The lobe round the mirror direction, amplitude sqrt(area sigma0); 0 where not lit or not seen."""
    away, out = unit(centre - source), unit(-centre)
    tilt = np.sum(unit(out - away) * normal, axis=1)
    lit = (np.sum(away * normal, axis=1) < 0) & (np.sum(out * normal, axis=1) > 0) & (tilt > 0.1)
    slope = np.radians(20.0) / np.sqrt(8)
    tilt = np.where(lit, tilt, 1.0)
    density = np.exp(-(1 / tilt**2 - 1) / (2 * slope**2)) / (8 * np.pi * slope**2 * tilt**4)
    return np.where(lit, np.sqrt(area * density), 0.0)


def hull_frame(y, z, turn, source, method):
    """Points of one frame: range error and predicted error of those whose beam meets the hull, and how many do not."""
    body, heading = np.array([20.0, y, z]), 0.5 * np.pi + turn
    axes = np.array([[np.cos(heading), -np.sin(heading), 0], [np.sin(heading), np.cos(heading), 0], [0, 0, 1.0]])
    centre, normal, area = hull()
    centre, normal = centre @ axes.T + body, normal @ axes.T
    amplitude = lobe(centre, normal, area, source)
    some = amplitude > 1e-3 * amplitude.max()
    signals, first, last = hear_echoes(ARRAY, source, centre[some], amplitude[some])
    cloud, _ = process(signals, first, last, method, source)
    place, r, error = points(cloud)
    true = hull_range(direction(cloud.azimuth, cloud.elevation), body, heading)
    met = np.isfinite(true)
    near = np.abs(np.array(azimuth_elevation(place)) - np.array(azimuth_elevation(body))[:, None])
    return (r - true)[met], error[met], np.count_nonzero(~met), near


FRAMES = [(-4.2, 0.3, 0.1), (-1.5, -0.1, 0.0), (0.4, 0.0, -0.15), (2.2, -0.4, 0.2), (4.3, 0.2, -0.1)]
SNAPS = [(9.0, -5.0, -6.0), (12.0, 6.0, -5.0)]


@lru_cache
def hull_statistics(locality):
    rows = [
        hull_frame(*frame, np.array(snap), BeamAxis(locality=locality))
        for frame, snap in zip(FRAMES, SNAPS + SNAPS + SNAPS[:1], strict=True)
    ]
    miss, error, off, near = zip(*rows, strict=True)
    return np.concatenate(miss), np.concatenate(error), sum(off), np.concatenate(near, axis=1)


def test_points_of_a_hull_lie_on_it():
    """1.6 m hull of patches at 20 m: median under 5 cm and nine in ten within three predicted errors."""
    miss, error, off, near = hull_statistics(0.5)
    assert len(miss) >= len(FRAMES)
    assert np.median(np.abs(miss)) < 0.05
    assert np.mean(np.abs(miss) < 3 * error) >= 0.9
    assert np.median(error) < 0.15
    assert off <= len(miss)
    assert np.degrees(near[0].max()) < 4.0  # none is further than the hull is long and a beam is wide
    assert np.degrees(near[1].max()) < 2.0


def test_echoes_that_belong_to_another_beam_are_what_is_left_out():
    """Without the check there are many more points, most of them off the hull, and the rest are worse."""
    miss, _, off, _ = hull_statistics(0.5)
    more, _, more_off, _ = hull_statistics(60.0)
    assert len(more) + more_off > 2 * (len(miss) + off)
    assert np.median(np.abs(more)) > np.median(np.abs(miss))
    assert more_off / len(more) > off / len(miss)


def test_a_louder_snap_changes_no_delay():
    """Ten times louder, and its echo too: the same points."""
    target = np.array([20.0, 2.0, 1.0])
    signals, first, last = hear_echoes(ARRAY, SNAP, [target], np.array([1.0]))
    cloud, _ = process(signals, first, last)
    far = np.linalg.norm(target - SNAP)
    louder = hear(signals, ARRAY, SNAP, 0.0, 9.0)
    louder = hear(louder, ARRAY, target, far / C, 9.0 / far)
    again, _ = process(louder, first, last)
    assert np.allclose(again.delay, cloud.delay, atol=2e-8, equal_nan=True)
    assert np.allclose(again.range, cloud.range, rtol=1e-6, equal_nan=True)


def time_in_gradient(a, b, surface, gradient):
    """Travel time between points in c = surface + gradient * depth: 2 asinh(|g| d/(2 sqrt(c1 c2)))/|g|."""
    d = np.linalg.norm(np.asarray(a) - b, axis=-1)
    c1, c2 = (surface - gradient * np.asarray(p)[..., 2] for p in (a, b))
    return 2 * np.arcsinh(abs(gradient) * d / (2 * np.sqrt(c1 * c2))) / abs(gradient)


@pytest.mark.parametrize("gradient", [0.1, -1.0, 4.0, 1e-9])
def test_refracted_range_in_a_constant_gradient(gradient):
    """Against the exact travel time of one gradient layer, and the arc's own direction at the array."""
    surface = 1540.0 + 8.0 * -gradient  # 1540 m/s at the sonar
    profile = Profile(np.array([0.0, 60.0]), surface + gradient * np.array([0.0, 60.0]))
    targets = POSE.to_world(np.array([[20.0, 3.0, 2.0], [25.0, -6.0, -4.0], [15.0, 0.0, 0.0]]))
    snap = POSE.to_world(SNAP)
    delay = time_in_gradient(targets, snap, surface, gradient) + time_in_gradient(
        targets, POSE.position, surface, gradient
    )
    delay = delay - time_in_gradient(snap, POSE.position, surface, gradient)
    rays = first_rays(profile, POSE.position[None], targets)
    assert np.allclose(rays.travel_time, time_in_gradient(targets, POSE.position, surface, gradient), rtol=1e-12)
    beam = POSE.turn_to_body(rays.departure)
    found = refracted_solution(delay, beam, SNAP, C, POSE, profile)
    assert np.allclose(POSE.to_world(found.position), targets, atol=1e-6)
    assert np.allclose(found.range, np.linalg.norm(targets - POSE.position, axis=1), atol=1e-6)


def test_refraction_is_nothing_in_uniform_water():
    random = np.random.default_rng(3)
    beam = direction(random.uniform(-0.4, 0.4, 50), random.uniform(-0.3, 0.3, 50))
    delay = random.uniform(0.005, 0.03, 50)
    straight = isovelocity_solution(delay, beam, SNAP, C)
    bent = refracted_solution(delay, beam, SNAP, C, POSE, WATER)
    wet = np.isfinite(bent.range)
    dry = ~np.isfinite(straight.range) | (POSE.to_world(straight.position)[:, 2] > 0)
    assert np.array_equal(wet, ~dry)
    assert np.allclose(bent.position[wet], straight.position[wet], atol=1e-8)


@pytest.mark.parametrize("speed", [0.0, 1.0, 10.0])
@pytest.mark.parametrize("heard", [SNAP + [0.0, 0.0, 0.5], np.array([0.05, 0.1, -0.3])], ids=["snap", "ping"])
def test_ranges_are_from_where_a_moving_array_hears_the_echo(heard: np.ndarray, speed: float) -> None:
    """By the time at which it does, solved for, to r (v/c)^2; of an array at rest they are up to 8 cm off at 10 m/s.
    An array that pings has left its own transmitter behind by more than that is off it."""
    velocity = speed * unit(np.array([3.0, 1.0, -0.2]))  # the array is at 0 at the snap
    target = direction(np.linspace(-0.4, 0.4, 9), np.linspace(0.3, -0.3, 9)) * np.linspace(10.0, 30.0, 9)[:, None]

    def arrival(place, sent):
        at = sent
        for _ in range(20):
            at = sent + np.linalg.norm(place - np.multiply.outer(at, velocity), axis=-1) / C
        return at

    direct = arrival(heard, 0.0)
    delay = arrival(target, np.linalg.norm(target - heard, axis=1) / C) - direct
    away, source = target - np.outer(direct + delay, velocity), heard - direct * velocity
    plain = isovelocity_solution(delay, unit(away), source, C)
    found = plain.as_array_moves(source, -np.outer(delay, velocity))
    r = np.linalg.norm(away, axis=1)
    assert np.all(np.abs(found.range - r) < 1e-9 + 0.6 * r * (speed / C) ** 2)
    assert np.allclose(found.position, found.range[:, None] * unit(away), atol=1e-12)
    assert speed == 0.0 or np.abs(plain.range - r).max() > 0.005 * speed


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_beams_of_a_moving_array_look_where_sound_comes_from(turn: float) -> None:
    """By when each sensor meets the wave of a far source; as for rest, beams are up to v/c of their slant beside it."""
    velocity, far = np.array([9.0, -4.0, 1.0]), 1e5
    lean = np.array([[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])
    u, q = direction(np.linspace(-0.5, 0.6, 7), np.linspace(0.4, -0.3, 7)), ARRAY.position @ lean.T
    heard = []
    for source in far * u:
        late = np.zeros(len(q))
        for _ in range(6):
            late = (np.linalg.norm(source - q - np.outer(late, velocity), axis=1) - far) / C
        within = np.linalg.lstsq(q, -C * late, rcond=1e-6)[0]
        heard.append(within + np.sqrt(1.0 - within @ within) * lean[:, 0])
    found = true_directions(np.array(heard), velocity / C, lean[:, 0])
    assert np.abs(found - u).max() < 2e-5  # the square of v/c is 4e-5, the aperture over the distance 5e-6
    assert np.abs(heard - u).max() > 2e-3


def test_the_description_of_the_water_overrides_the_water():
    target = np.array([20.0, 0.0, 0.0])
    signals, first, last = hear_echoes(ARRAY, SNAP, [target], np.array([1.0]))
    wrong = Profile(np.array([0.0]), np.array([1500.0]))
    believed = RefractedPlacing(profile=Tabulated(depth=(0.0,), speed=(C,)))
    right, _ = process(signals, first, last, placing=believed, profile=wrong)
    plain, _ = process(signals, first, last, placing=RefractedPlacing(), profile=WATER)
    off, _ = process(signals, first, last, placing=RefractedPlacing(), profile=wrong)
    assert np.array_equal(right.range, plain.range, equal_nan=True)
    assert np.nanmax(np.abs(off.range - plain.range)) > 0.2
