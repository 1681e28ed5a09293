"""Peaks of the volume: finer than the grid, no more false alarms than asked for, errors that keep their word."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.ndimage import maximum_filter

from sonarsynth import render
from sonarsynth.conventions import azimuth_elevation, direction
from sonarsynth.environment.noise import FlatNoise
from sonarsynth.environment.sea import Profile
from sonarsynth.equations.arrays.noise_peaks import expected_peaks, peak_level
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.imaging import FocusedDelayAndSum
from sonarsynth.imaging.image_window import snapshots_of
from sonarsynth.planning import plan
from sonarsynth.ranging import BeamAxis, FirstEcho, Peaks, SensorDelays
from sonarsynth.ranging.location.triggered import Triggered
from sonarsynth.ranging.picking.peak_kernels import local_maxima, medians, over_lobes
from sonarsynth.ranging.picking.peak_picking import LOBE_STEPS, _lobes
from sonarsynth.receiver import BeamGrid, PlanarLattice, Romanis, Sonar, elements
from sonarsynth.receiver.hydrophones import PositionTable
from sonarsynth.state import Receiver, Survey
from tests.heard import add_noise, cloud_of, hear_echoes
from tests.scenes import point_scene

C = 1540.0
ARRAY = elements(Romanis())
POSE = Pose(np.array([0.0, 0.0, -8.0]), quaternion(np.pi / 2))
SNAP = np.array([9.0, -5.0, -6.0])
WATER = Profile(np.array([0.0]), np.array([C]))
MARGIN = 6e-4


def sonar(step: float = 0.5, span: float = 30.0) -> Sonar:
    """A sonar that knows the speed of sound exactly; step and span of its beams in degrees."""
    count, wide = round(span / step) + 1, np.radians(span)
    grid = BeamGrid(azimuths=count, elevations=count, azimuth_span=wide, elevation_span=wide)
    return Sonar(assumed_sound_speed=C, sound_speed_error=0.0, beams=grid)


@lru_cache
def heard(targets, strengths=None):
    """Signals of a direct pulse and of echoes of points, first and last echo, and the snap as exactly known."""
    places = [np.array(target) for target in targets]
    signals, first, last = hear_echoes(ARRAY, SNAP, places, np.array(strengths or [1.0] * len(places)))
    found = SensorDelays().locate(signals, Receiver(POSE, ARRAY, sonar()), Survey(-POSE.to_world(SNAP)[2], WATER), 1)
    known = replace(found, position=SNAP[None], position_covariance=np.zeros((1, 3, 3)))
    return signals, first, last, known


def points(targets, noise=0.0, seed=0, instrument=None, strengths=None, picking=Peaks()):  # noqa: B008
    signals, first, last, known = heard(targets, strengths)
    instrument = instrument or sonar()
    noisy = add_noise(signals, noise, np.random.default_rng(seed))
    image = FocusedDelayAndSum().image(noisy, ARRAY, instrument, first - MARGIN, last + MARGIN)
    return cloud_of(noisy, image, known, ARRAY, instrument, POSE, WATER, picking=picking)


def spherical(r, azimuth, elevation):
    return tuple(r * direction(np.array([azimuth]), np.array([elevation]))[0])


COLUMN = tuple((0.3, 0.3, z) for z in np.arange(-0.1, 0.11, 0.0125))


def planned_before(places, picking):
    """A point 40 m ahead of hydrophones at these places, in beams 1 degree apart."""
    told = Triggered(time_error=1e-9, position_error=1e-6)
    grid = BeamGrid(azimuth_span=np.deg2rad(20), azimuths=21, elevation_span=np.deg2rad(20), elevations=21)
    recipe = point_scene((40.0, 3.0, -47.0), (10.0, 3.0, -55.0), array=PositionTable(positions=places), beams=grid)
    world, processing = recipe.scene.world, replace(recipe.scene.processing, locating=told, picking=picking)
    world = replace(world, environment=replace(world.environment, noise=FlatNoise(level=20.0)))
    return plan(replace(recipe, scene=replace(recipe.scene, world=world, processing=processing)))


@pytest.mark.parametrize(
    ("places", "lacks"),
    [
        (((0.0, 0.3, 0.2),), "one hydrophone tells no azimuth and no elevation"),
        (COLUMN, "17 hydrophones, of no extent there, tell no azi"),
    ],
)
def test_an_echo_without_a_direction_is_one_point_and_the_plan_says_so(places, lacks):
    """Wherever the hydrophones are: of those beside the middle of the array beams heard it sooner or later, as 78."""
    planned = planned_before(places, Peaks())
    cloud = render(planned, 0)["cloud"]
    assert int(cloud["count"]) == 1 and float(cloud["azimuth_error"][0]) > 90.0
    assert any(line.startswith(lacks) for line in planned.warnings)


@pytest.mark.parametrize("picking", [BeamAxis(), FirstEcho()])
def test_points_on_axes_of_beams_err_by_any_angle_that_no_hydrophone_tells(picking):
    """A column of hydrophones tells no azimuth, which was predicted as well as the elevation."""
    cloud = render(planned_before(COLUMN, picking), 0)["cloud"].dataset
    own = cloud.isel(point=slice(int(cloud["count"])))
    assert own["azimuth_error"].min() > 90.0 and own["elevation_error"].max() < 10.0


@pytest.mark.parametrize("step", [0.25, 0.5, 0.75])
@pytest.mark.parametrize(("azimuth", "elevation", "r"), [(0.0, 0.0, 20.0), (0.103, -0.148, 20.0), (-0.2, 0.07, 23.0)])
def test_a_point_is_where_it_is_finer_than_the_grid(azimuth, elevation, r, step):
    """To 0.25 mrad, a fiftieth of the beam, wherever it lies between beams; the axis of the nearest is up to 6 off."""
    cloud = points((spherical(r, azimuth, elevation),), instrument=sonar(step))
    assert len(cloud) == 1
    assert abs(cloud.azimuth[0] - azimuth) < 2.5e-4
    assert abs(cloud.elevation[0] - elevation) < 2.5e-4
    assert abs(cloud.range[0] - r) < 2e-3


@pytest.mark.parametrize("picking", [Peaks(), BeamAxis()])
def test_beams_apart_by_more_than_their_width_predict_it(picking):
    """3 degrees, where beams are 1.3 wide: nothing tells where between two of them an echo is."""
    ratios = []
    for azimuth, elevation in np.random.default_rng(2).uniform(-0.15, 0.15, (12, 2)):
        cloud = points((spherical(20.0, azimuth, elevation),), instrument=sonar(3.0), picking=picking)
        for top in np.argsort(cloud.energy)[-1:]:
            ratios.append((cloud.azimuth[top] - azimuth) / cloud.azimuth_error[top])
            ratios.append((cloud.elevation[top] - elevation) / cloud.elevation_error[top])
    assert len(ratios) > 10 and 0.3 < np.std(ratios) < 1.5 and np.abs(ratios).max() < 3.5


def test_a_slope_at_the_rim_of_the_beams_looked_at_is_no_peak():
    """However few beams are looked at, the points are those of all of them."""
    targets = (spherical(20.0, 0.05, 0.02), spherical(20.6, 0.09, 0.02))
    all_of_them = points(targets, strengths=(1.0, 0.5), picking=Peaks(threshold=40.0))
    assert len(all_of_them) == 2
    for threshold in (0.1, 3.0, 12.0):
        some = points(targets, strengths=(1.0, 0.5), picking=Peaks(threshold=threshold))
        far = np.linalg.norm(some.position[:, None] - all_of_them.position, axis=2).min(axis=1)
        assert 1 <= len(some) <= 2 and (far < 1e-3).all()


@pytest.mark.parametrize(("before", "after"), [(2e-3, 6e-3), (1.4e-3, 6e-3), (6e-3, 1.4e-3)])
def test_points_of_the_part_of_a_window_that_has_sound_are_those_of_the_whole(before, after):
    """Wherever in the window that is; a click that no beam hears of, at one end, makes all of the window count."""
    targets = spherical(20.0, 0.05, 0.02), spherical(20.2, 0.09, -0.03), spherical(20.5, -0.11, 0.08)
    signals, first, last, known = heard(targets, (1.0, 0.5, 0.3))
    quiet = np.zeros((ARRAY.count, 1200), np.float32)
    count = 1e-4 * np.abs(signals.pressure).max()
    rounded = np.hstack([quiet, np.round(signals.pressure / count) * count, quiet]).astype(np.float32)
    click = rounded.copy()
    start = signals.start - quiet.shape[1] / signals.sampling_frequency
    sample = round((first - before + 2e-4 - start) * signals.sampling_frequency)
    click[0, sample - 30 : sample] += np.float32(2e-6 * np.abs(rounded).max())
    silent, sounding = (replace(signals, pressure=p, start=start) for p in (rounded, click))
    window, clouds = (first - before, last + after), []
    few, many = (snapshots_of(x, sonar(), *window).without_silence(5e-4).frequency for x in (silent, sounding))
    assert len(few) <= 0.5 * len(many) + 1
    for received in (silent, sounding):
        image = FocusedDelayAndSum().image(received, ARRAY, sonar(), *window)
        clouds.append(cloud_of(received, image, known, ARRAY, sonar(), POSE, WATER, direct=silent))
    part, whole = clouds
    assert len(part) == len(whole) >= 3
    for name in ("range", "azimuth", "elevation"):
        off = getattr(part, name) - getattr(whole, name)
        assert np.all(np.abs(off) < 0.02 * getattr(whole, f"{name}_error")), name
    np.testing.assert_allclose(part.energy, whole.energy, rtol=2e-3)


def test_two_echoes_in_one_direction_are_two_points_and_closer_than_the_pulse_one():
    far = [spherical(r, 0.05, 0.02) for r in (20.0, 20.1)]
    cloud = points(tuple(far))
    assert np.sort(cloud.range) == pytest.approx([20.0, 20.1], abs=0.01)
    near = [spherical(r, 0.05, 0.02) for r in (20.0, 20.002)]
    cloud = points(tuple(near))
    assert len(cloud) == 1 and 19.99 < cloud.range[0] < 20.012


@pytest.mark.long
def test_errors_are_as_predicted():
    """Pulls of azimuth, elevation and range, of 400 echoes and more, 13 to 24 dB over the noise: of points, where
    errors are those of noise."""
    random, pulls = np.random.default_rng(1), []
    for scene in range(6):
        places = [
            spherical(r, *random.uniform(-0.2, 0.2, 2)) for r in 17.0 + np.arange(6) + random.uniform(-0.2, 0.2, 6)
        ]
        for draw in range(12):
            noise = 10 ** random.uniform(-1.1, -0.8)
            cloud = points(tuple(places), noise, 100 * scene + draw, picking=Peaks(false_alarms=1e-3))
            near = np.linalg.norm(cloud.position[:, None] - np.array(places), axis=2)
            for i, p in zip(near.argmin(axis=0), range(6), strict=True):
                if near[i, p] < 0.5:
                    azimuth, elevation = azimuth_elevation(np.array(places[p]))
                    pulls.append(
                        [
                            (cloud.azimuth[i] - azimuth) / cloud.azimuth_error[i],
                            (cloud.elevation[i] - elevation) / cloud.elevation_error[i],
                            (cloud.range[i] - np.linalg.norm(places[p])) / cloud.range_error[i],
                        ]
                    )
    assert len(pulls) >= 400
    spread = np.sqrt(np.mean(np.square(pulls), axis=0))
    assert ((spread > 0.8) & (spread < 1.2)).all(), spread


@pytest.mark.parametrize("kind", ["gaussian", "impulsive"])
def test_as_many_false_alarms_as_asked_for(kind):
    """Within a factor 1.5, in noise alone: 5 a frame, in 16 frames. Impulsive: one sample in 20 ten times larger."""
    signals, first, _, known = heard(((20.0, 0.0, 0.0),), (1e-9,))
    instrument, random, count = sonar(), np.random.default_rng(4), 0
    start, stop = first - 2e-3, first + 2e-3
    for _ in range(16):
        rough = random.standard_normal(signals.pressure.shape, dtype=np.float32)
        if kind == "impulsive":
            rough *= np.where(random.random(rough.shape, dtype=np.float32) < 0.05, 10.0, 1.0)
        noisy = replace(signals, pressure=(1e-4 * rough).astype(np.float32))
        image = FocusedDelayAndSum().image(noisy, ARRAY, instrument, start, stop)
        picking = Peaks(false_alarms=5.0, threshold=30.0, dynamic_range=60.0, side_lobes=60.0)
        cloud = cloud_of(noisy, image, known, ARRAY, instrument, POSE, WATER, picking=picking, direct=signals)
        count += len(cloud)
    assert 80 / 1.5 < count < 80 * 1.5


def test_peaks_of_noise_in_one_dimension_are_the_upcrossings_of_rice():
    """Of an envelope: sqrt(lambda/pi) sqrt(I) exp(-I) a unit length (Rice, 1944), and exp(-I) for where it starts."""
    level, length = 9.0, 40.0
    rice = length * np.sqrt(level / np.pi) * np.exp(-level) + np.exp(-level)
    assert expected_peaks(level, np.array([length])) == pytest.approx(rice, rel=1e-12)
    assert expected_peaks(level, np.array([length, 0.0, 0.0])) == pytest.approx(rice, rel=1e-12)
    sizes = np.array([40.0, 30.0, 200.0])
    assert expected_peaks(peak_level(0.1, sizes), sizes) == pytest.approx(0.1, rel=1e-9)
    assert peak_level(0.01, sizes) > peak_level(0.1, sizes) > peak_level(0.1, sizes[:2])


@pytest.mark.parametrize("stop", [11, 12, 19, 60])
def test_medians_are_those_of_sorted_powers(stop):
    """Of an odd and an even number, where many are alike, and of silence."""
    random = np.random.default_rng(0)
    loud = random.exponential(size=(40, 60)) ** 6
    for powers in (loud, np.round(loud), 1e-40 * loud, 0.0 * loud):
        power = powers.astype(np.float32)
        np.testing.assert_array_equal(medians(power, 3, stop, 4), np.median(power[:, 3:stop:4], axis=1))


def test_local_maxima_are_those_of_a_filter():
    random = np.random.default_rng(0)
    volume = random.random((7, 9, 60)).astype(np.float32)
    row, column = (x.ravel() for x in np.mgrid[:7, :9])
    index = np.arange(63).reshape(7, 9)
    edge, floor, least = np.array([True, True]), np.full(63, 0.5, np.float32), np.ones(60, np.float32)
    least[::2] = 0.0  # at every other delay nothing is loud enough
    b, t = local_maxima(
        volume.reshape(63, 60), index, row, column, floor, least, edge, 3, np.array([[5, 30], [30, 55]])
    )
    top = (volume == maximum_filter(volume, (3, 3, 7), mode="constant")) & (volume > 0.5) & (least == 0.0)
    top[[0, -1]] = top[:, [0, -1]] = False
    top[:, :, :5] = top[:, :, -5:] = False
    expected = np.argwhere(top)
    assert len(expected) > 5
    assert {(int(row[i]), int(column[i]), int(s)) for i, s in zip(b, t, strict=True)} == set(map(tuple, expected))


@pytest.mark.parametrize("share", [0.98, 1.02])
def test_what_lobes_bring_is_what_a_beam_hears_of_a_wave(share):
    """Against beams of a wave with that spectrum, made sensor by sensor, at the grating lobe and elsewhere."""
    array, instrument = elements(PlanarLattice(columns=12, rows=8, pitch=0.05, face=0.0)), sonar()
    f, taper = np.linspace(25e3, 85e3, 48), np.sin(np.pi * (np.arange(48) + 0.5) / 48) ** 2
    u = direction(np.array([0.1, -0.38, 0.3]), np.array([0.0, 0.02, 0.1]))
    delay, power = np.array([0.0, 2e-5, -1e-5]), np.array([3.0, 2.0, 1.0])
    position, weight, table = _lobes(array, instrument)
    brought = np.zeros(3)
    for i in range(3):
        for j in range(i):
            wave = taper * np.exp(2j * np.pi * f * (array.position @ (u[i] - u[j]) / C + delay[i] - delay[j])[:, None])
            brought[i] += power[j] * abs(weight @ wave.sum(axis=1) / taper.sum()) ** 2
    assert brought[1] > 1e-4
    least, rate = share * brought + [1e-12, 0.0, 0.0], LOBE_STEPS * instrument.band.high
    own = over_lobes(u / C, delay, power, position, weight, 1e-5, 2.0 / 60e3, least, table, rate)
    assert own.tolist() == [True, share > 1.0, share > 1.0]


def test_a_grating_lobe_is_no_echo_and_an_echo_there_is():
    """A loud echo 14 degrees to port, and what a lattice with 5 cm between its elements hears of it at -18."""
    loud = spherical(20.0, 0.245, 0.0)
    wide = sonar(span=50.0)
    assert len(points((loud,), instrument=wide, picking=Peaks(side_lobes=30.0, dynamic_range=22.0))) == 1
    both = points((loud, spherical(21.0, -0.2, 0.05)), instrument=wide, strengths=(1.0, 0.3))
    assert np.sort(both.azimuth) == pytest.approx([-0.2, 0.245], abs=1e-3)


@pytest.mark.parametrize("azimuth", [0.5, -0.6, 0.75])
def test_a_grating_lobe_of_an_echo_from_beyond_the_view_is_no_echo(azimuth):
    """The view ends at 25 degrees: a loud echo from further off the axis makes no point, whether alone or beside a
    fainter one that is in view, which keeps its own."""
    loud, wide = spherical(22.0, azimuth, 0.02), sonar(span=50.0)
    alone = points((loud,), instrument=wide, picking=Peaks(side_lobes=30.0, dynamic_range=22.0))
    assert len(alone) == 0
    both = points((loud, spherical(21.0, -0.2, 0.05)), instrument=wide, strengths=(1.0, 0.3))
    assert both.azimuth == pytest.approx([-0.2], abs=1e-3)


def test_no_echo_is_picked_at_the_edge_of_the_view():
    """Its peak may be outside: a target half a beam beyond the last beam makes no point."""
    narrow = sonar(span=10.0)
    assert len(points((spherical(20.0, np.radians(5.4), 0.0),), instrument=narrow)) == 0
    assert len(points((spherical(20.0, np.radians(4.0), 0.0),), instrument=narrow)) == 1


def test_where_echoes_overlap_points_lie_among_them_within_their_errors():
    """Six points closer than a beam and a pulse: further beyond them than three predicted errors, one in fifty."""
    random, beyond, errors = np.random.default_rng(4), [], []
    for _ in range(30):
        middle = np.array([20.0, *random.uniform(-0.2, 0.2, 2)])
        places = middle + random.uniform(-1.0, 1.0, (6, 3)) * [0.02, 0.012, 0.012]
        targets = tuple(spherical(*place) for place in places)
        cloud = points(targets, strengths=tuple(random.uniform(0.3, 1.0, 6)))
        found = np.stack([cloud.range, cloud.azimuth, cloud.elevation], axis=1)
        error = np.stack([cloud.range_error, cloud.azimuth_error, cloud.elevation_error], axis=1)
        outside = np.maximum(places.min(axis=0) - found, found - places.max(axis=0))
        beyond += (outside / error).max(axis=1).tolist()
        errors += error[:, 1].tolist()
    assert len(beyond) >= 30 and np.mean(np.array(beyond) > 3.0) <= 0.02
    assert np.median(errors) < 0.012  # half of a beam: errors say something


def test_extremes_give_points_where_targets_are_or_none():
    """One row of beams, clipped signals, a target that fills the view, and silence."""
    target = spherical(20.0, 0.05, 0.0)
    row = replace(sonar(), beams=BeamGrid(azimuths=61, elevations=1, azimuth_span=0.5, elevation_span=0.1))
    (line,) = [points((target,), instrument=row)]
    assert len(line) == 1 and abs(line.azimuth[0] - 0.05) < 1e-3 and 0.005 < line.elevation_error[0] < 1.0
    signals, first, last, known = heard((target,))
    loud = np.abs(signals.pressure[:, -600:]).max()
    clipped = replace(signals, pressure=np.clip(signals.pressure, -0.3 * loud, 0.3 * loud))
    image = FocusedDelayAndSum().image(clipped, ARRAY, sonar(), first - MARGIN, last + MARGIN)
    cloud = cloud_of(clipped, image, known, ARRAY, sonar(), POSE, WATER, direct=signals)
    assert np.linalg.norm(cloud.position - target, axis=1).min() < 0.05
    silent = replace(signals, pressure=np.zeros_like(signals.pressure))
    nothing = FocusedDelayAndSum().image(silent, ARRAY, sonar(), first - MARGIN, last + MARGIN)
    assert len(cloud_of(silent, nothing, known, ARRAY, sonar(), POSE, WATER, direct=signals)) == 0
    random = np.random.default_rng(5)
    full = points(tuple(spherical(random.uniform(19.5, 20.5), *random.uniform(-0.25, 0.25, 2)) for _ in range(60)))
    assert len(full) > 10
    for name in ("range", "range_error", "azimuth_error", "elevation_error", "snr", "energy"):
        assert np.isfinite(getattr(full, name)).all(), name
