"""Geometries and arrays that have no answer, or hardly one: NaN or a large error, never a wrong number."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from sonarsynth.conventions import direction
from sonarsynth.environment.sea import Profile
from sonarsynth.equations.arrays.bistatic_range import bistatic_range, excess_path
from sonarsynth.equations.arrays.spherical_wave import plane_wave, spherical_wave, wavefront_delays
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.products import REASONS, EnergyImage
from sonarsynth.ranging import IsovelocityPlacing, RefractedPlacing, SensorDelays
from sonarsynth.ranging.location.locating_method import unlocatable
from sonarsynth.receiver import BeamGrid, PlanarLattice, PositionTable, Romanis, Sonar, elements
from sonarsynth.state import Receiver, Survey
from tests.heard import add_noise, cloud_of, hear_direct, hear_echoes, silence

C = 1540.0
AHEAD = np.array([1.0, 0.0, 0.0])
POSE = Pose(np.array([0.0, 0.0, -5.0]), quaternion(np.pi / 2))
WATER = Profile(np.array([0.0]), np.array([C]))


def test_no_path_is_shorter_than_the_direct_one():
    found = bistatic_range(-1e-6, direction(0.4, 0.0), 20.0 * AHEAD)
    assert np.isnan(found.range)
    assert found.ill_conditioned


def test_target_behind_the_source():
    """psi = 0 and L > b: r = (L + b)/2."""
    found = bistatic_range(6.0, AHEAD, 20.0 * AHEAD)
    assert found.range == pytest.approx(23.0, rel=1e-15)
    assert found.by_path == pytest.approx(0.5)
    assert not found.ill_conditioned


def test_source_behind_the_array():
    """psi = pi: r = x/2, whatever the baseline."""
    assert bistatic_range(6.0, AHEAD, -20.0 * AHEAD).range == pytest.approx(3.0, rel=1e-15)


def test_target_at_the_array_and_at_the_source():
    source = np.array([9.0, -5.0, -6.0])
    assert bistatic_range(0.0, AHEAD, source).range == 0.0
    b = np.linalg.norm(source)
    towards = source / b
    assert excess_path(towards, b, source) == pytest.approx(0.0, abs=1e-12)
    assert np.isnan(bistatic_range(1.0, AHEAD, np.zeros(3)).range)  # no direction to a source at the array


def nothing(found, reason):
    """Whether every row says nothing but why."""
    numbers = [value for value in vars(found).values() if value.dtype.kind == "f"]
    return all(np.isnan(v).all() for v in numbers) and (found.reason == REASONS.index(reason)).all()


def locate(signals, array, depth, snaps=1, **sonar):
    return SensorDelays().locate(
        signals, Receiver(POSE, array, Sonar(assumed_sound_speed=C, **sonar)), Survey(float(depth), WATER), snaps
    )


@pytest.mark.parametrize(
    ("positions", "reason"),
    [
        (((0.0, 0.0, 0.0),), "1 live hydrophone:"),
        (((0.0, 0.1, 0.0), (0.0, 0.1, 0.0)), "2 live hydrophones:"),
        (((0.0, 0.1, 0.0),) * 5, "one place"),
        (tuple((0.0, 0.1 * i, 0.0) for i in range(8)), "one line"),
    ],
)
def test_arrays_that_cannot_tell_a_direction(positions, reason):
    array = elements(PositionTable(positions=positions))
    found = locate(hear_direct(array, [9.0, -5.0, -6.0]), array, 11.0)
    assert nothing(found, "array_tells_no_direction")
    assert reason in unlocatable(array)
    delay = wavefront_delays(array.position, AHEAD, 0.1, C)
    assert np.isnan(plane_wave(delay, array.position, C)[0]).all()
    assert spherical_wave(delay, array.position, C, np.ones(len(delay)), AHEAD) is None


def test_dead_sensors_can_leave_a_line():
    array = elements(PlanarLattice(columns=4, rows=2, pitch=0.1, dead=(4, 5, 6, 7)))
    assert "one line" in unlocatable(array)
    assert unlocatable(elements(Romanis())) is None


def test_three_sensors_tell_the_direction_and_the_depth_the_rest():
    array = elements(PositionTable(positions=((0.0, 0.4, 0.0), (0.0, -0.3, 0.2), (0.0, -0.1, -0.4))))
    source = np.array([40.0, -15.0, -20.0])
    found = locate(hear_direct(array, source), array, 25.0)
    assert np.linalg.norm(found.position[0] - source) < 0.3
    assert found.range_from_depth[0] == pytest.approx(np.linalg.norm(source), rel=0.005)
    assert np.linalg.norm(found.position[0] - source) < 3 * np.sqrt(np.trace(found.position_covariance[0]))


def test_silence():
    array = elements(Romanis())
    found = locate(silence(array, 0.0, 600), array, 11.0, snaps=2)
    assert found.time.shape == (2,)
    assert nothing(found, "nothing_heard")
    assert locate(silence(array, 0.0, 600), array, 11.0, snaps=0).position.shape == (0, 3)


def test_noise_alone_is_no_snap():
    array = elements(Romanis())
    noise = add_noise(silence(array, 0.0, 1500), 1.0, np.random.default_rng(2))
    assert np.isnan(locate(noise, array, 11.0).time).all()


@pytest.mark.parametrize("vertical", [direction(0.0, -1.2), direction(0.0, -0.5 * np.pi)])
def test_snap_below(vertical):
    """To straight down, where azimuth means nothing, its error is large and the position still good."""
    source = 8.0 * vertical
    array = elements(Romanis(face=0.0))
    found = locate(hear_direct(array, source), array, 5.0 - source[2])
    assert np.linalg.norm(found.position[0] - source) < 3 * np.sqrt(np.trace(found.position_covariance[0]))
    assert np.linalg.norm(found.position[0] - source) < 0.05
    assert found.range_from_depth[0] == pytest.approx(8.0, abs=0.05)
    assert abs(found.elevation[0] - np.arcsin(vertical[2])) < 0.05


def test_snap_straight_above():
    source = np.array([0.5, 0.0, 4.0])
    array = elements(Romanis(face=0.0))
    found = locate(hear_direct(array, source), array, 5.0 - source[2])  # a "bottom" above the sonar: a shelf
    assert np.linalg.norm(found.position[0] - source) < 0.02


def test_a_nearly_horizontal_bearing_makes_the_depth_useless_and_says_so():
    source = np.array([20.0, 3.0, -0.05])
    array = elements(Romanis())
    found = locate(hear_direct(array, source, noise=1e-4, random=np.random.default_rng(0)), array, 5.06)
    assert found.range_from_depth_error[0] > 10.0
    assert abs(found.range_from_depth[0] - np.linalg.norm(source)) < 3 * found.range_from_depth_error[0]
    assert np.linalg.norm(found.position[0] - source) < 0.1


def test_a_bearing_that_never_meets_the_bed_has_no_range_from_depth():
    source = np.array([20.0, 3.0, 2.0])
    array = elements(Romanis())
    found = locate(hear_direct(array, source), array, 25.0)
    assert np.isnan(found.range_from_depth[0])
    assert np.isnan(found.range_from_depth_error[0])
    assert np.linalg.norm(found.position[0] - source) < 0.05  # by curvature


def test_a_depth_that_the_wavefront_contradicts_is_not_used():
    source = np.array([12.0, 3.0, -6.0])
    array = elements(Romanis())
    signals = hear_direct(array, source)
    agreed, apart = locate(signals, array, 11.0), locate(signals, array, 13.0)
    assert agreed.bottom_used[0] == 1 and apart.bottom_used[0] == 0
    assert np.linalg.norm(apart.position[0] - source) < 1e-3
    assert np.array_equal([apart.azimuth, apart.elevation], [agreed.azimuth, agreed.elevation])
    assert nothing(locate(signals, array, 9.0), "outside_the_water")  # under the bottom there are images only


def heard_target(array, target, source):
    signals, first, last = hear_echoes(array, source, [target], np.array([1.0]))
    return signals, first - 5e-4, last + 5e-4


def points_of(method, array, sonar, signals, image, source):
    found = SensorDelays().locate(signals, Receiver(POSE, array, sonar), Survey(5.0 - source[2], WATER), 1)
    return cloud_of(signals, image, found, array, sonar, POSE, WATER, placing=method)


@pytest.mark.parametrize("method", [IsovelocityPlacing(), RefractedPlacing()])
def test_clouds_of_nothing(method):
    array = elements(PlanarLattice(columns=8, rows=8, pitch=0.1))
    grid = BeamGrid(azimuths=5, elevations=3)
    sonar = Sonar(assumed_sound_speed=C, beams=grid)
    signals, start, stop = heard_target(array, [20.0, 1.0, 0.5], np.array([9.0, -5.0, -6.0]))
    empty = EnergyImage(np.zeros((3, 5), np.float32), grid.azimuth, grid.elevation, start, stop)
    unheard = EnergyImage(np.full((3, 5), np.nan, np.float32), grid.azimuth, grid.elevation, np.nan, np.nan)
    full = EnergyImage(np.ones((3, 5), np.float32), grid.azimuth, grid.elevation, start, stop)
    nobody = silence(array, signals.start, signals.pressure.shape[1])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for heard, image in ((signals, empty), (signals, unheard), (nobody, full), (nobody, empty)):
            cloud = points_of(method, array, sonar, heard, image, np.array([9.0, -5.0, -6.0]))
            assert len(cloud) == 0 and cloud.position.shape == (0, 3) and cloud.overflow == 0


@pytest.mark.parametrize("method", [IsovelocityPlacing(), RefractedPlacing()])
def test_a_target_on_the_baseline_gives_no_point(method):
    array = elements(PlanarLattice(columns=12, rows=12, pitch=0.05))
    source = np.array([18.0, 0.5, -1.0])
    sonar = Sonar(assumed_sound_speed=C, beams=BeamGrid(azimuths=1, elevations=1, azimuth_span=0.1, elevation_span=0.1))
    signals, start, stop = heard_target(array, 0.5 * source + [0.0, 0.3, 0.3], source)
    image = EnergyImage(np.ones((1, 1), np.float32), sonar.beams.azimuth, sonar.beams.elevation, start, stop)
    assert len(points_of(method, array, sonar, signals, image, source)) == 0


def test_one_beam_suffices_for_a_point():
    array = elements(PlanarLattice(columns=16, rows=16, pitch=0.05))
    source, target = np.array([9.0, -5.0, -6.0]), np.array([20.0, 0.0, 0.0])
    sonar = Sonar(assumed_sound_speed=C, beams=BeamGrid(azimuths=1, elevations=1))
    signals, start, stop = heard_target(array, target, source)
    image = EnergyImage(np.ones((1, 1), np.float32), sonar.beams.azimuth, sonar.beams.elevation, start, stop)
    for method in (IsovelocityPlacing(), RefractedPlacing()):
        cloud = points_of(method, array, sonar, signals, image, source)
        assert cloud.range[0] == pytest.approx(20.0, abs=0.01)
        assert np.allclose(cloud.position[0], target, atol=0.01)


def test_a_snap_so_near_that_plane_waves_mean_nothing():
    """Less than an aperture and a half away: the sphere is found from a plane wave all the same."""
    source = np.array([0.9, 0.2, -0.3])
    array = elements(Romanis(face=0.0))
    found = locate(hear_direct(array, source), array, 5.3)
    assert np.linalg.norm(found.position[0] - source) < 2e-3


@pytest.mark.parametrize("gradient", [1e-12, 1.0, 50.0])
def test_gradients_of_any_size_leave_a_bearing(gradient):
    """And a bearing along the bottom, where a ray bends most and the depth says nothing."""
    array, source = elements(Romanis()), np.array([20.0, 3.0, -0.05])
    profile = Profile(np.array([0.0, 10.0]), C + gradient * np.array([-5.0, 5.0]))
    found = SensorDelays().locate(
        hear_direct(array, source), Receiver(POSE, array, Sonar(assumed_sound_speed=C)), Survey(5.05, profile), 1
    )
    assert found.elevation[0] == pytest.approx(np.arcsin(source[2] / np.linalg.norm(source)), abs=1e-5)
    known = np.isfinite(found.position_covariance).all()
    assert known == (gradient < 0.1) and found.reason[0] == (0 if known else REASONS.index("range_unknown"))
