"""What a beamformer must do, whatever its method: closed-form waves in, images out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.conventions import direction
from sonarsynth.imaging import DenseDelayAndSum, FocusedDelayAndSum
from sonarsynth.imaging.image_window import energy_image
from sonarsynth.imaging.steering import Steering
from sonarsynth.products import Signals
from sonarsynth.receiver import Band, BeamGrid, PlanarLattice, PositionTable, Romanis, Sonar, elements
from tests.lattice import lattice_energies

SPEED = 1540.0
RATE = 196e3
METHODS = [FocusedDelayAndSum(focus=None), DenseDelayAndSum(focus=None)]
ARRAY = PlanarLattice(columns=9, rows=8, pitch=0.02)
SONAR = Sonar(array=ARRAY, beams=BeamGrid(azimuths=21, elevations=17))
WINDOW = (0.001, 0.004)


def pulse(t):
    """Gaussian pulse: all of its energy but 1e-9 lies in 25 to 85 kHz."""
    return np.exp(-0.5 * (2 * np.pi * 7e3 * t) ** 2) * np.cos(2 * np.pi * 55e3 * t)


def heard(delay, samples=1000, amplitude=1.0):
    """Signals whose sensors hear the pulse at `delay` (sensor,) after 2.5 ms."""
    t = np.arange(samples) / RATE - 2.5e-3
    pressure = (amplitude * pulse(t - delay[:, None])).astype(np.float32)
    return Signals(pressure, 0.0, RATE, 0.0, 0, 0)


def plane_wave(array, azimuth, elevation, amplitude=1.0):
    return heard(-elements(array).position @ direction(azimuth, elevation) / SPEED, amplitude=amplitude)


def spherical_wave(array, source):
    """Unit pressure at the array centre; closed form at every sensor."""
    distance = np.linalg.norm(source - elements(array).position, axis=1)
    radius = np.linalg.norm(source)
    return heard((distance - radius) / SPEED, amplitude=(radius / distance)[:, None])


def brightest(image):
    row, column = np.unravel_index(np.argmax(image.energy), image.energy.shape)
    return row, column


def total_energy():
    t = np.arange(-2000, 2001) / (8 * RATE)
    return np.sum(pulse(t) ** 2) / (8 * RATE)


@pytest.mark.parametrize("method", [FocusedDelayAndSum(focus=8.0), DenseDelayAndSum(focus=8.0)])
@pytest.mark.parametrize(("row", "column"), [(2, 3), (2, 17), (14, 3), (14, 17), (8, 10)])
def test_point_source_is_brightest_in_its_own_beam(method, row, column):
    source = 8.0 * direction(SONAR.beams.azimuth[column], SONAR.beams.elevation[row])
    image = method.image(spherical_wave(ARRAY, source), elements(ARRAY), SONAR, *WINDOW)
    assert brightest(image) == (row, column)


@pytest.mark.parametrize("method", METHODS)
def test_port_is_positive_azimuth_and_up_is_positive_elevation(method):
    """A wave that the port (+y) sensors hear first comes from a positive azimuth; likewise up."""
    y, z = elements(ARRAY).position[:, 1], elements(ARRAY).position[:, 2]
    grid = SONAR.beams
    port = method.image(heard(-y * 1e-4), elements(ARRAY), SONAR, *WINDOW)
    assert grid.azimuth[brightest(port)[1]] > 0
    up = method.image(heard(-z * 1e-4), elements(ARRAY), SONAR, *WINDOW)
    assert grid.elevation[brightest(up)[0]] > 0


@pytest.mark.parametrize("method", [FocusedDelayAndSum(focus=5.0), DenseDelayAndSum(focus=5.0)])
def test_mirrored_source_mirrors_the_image(method):
    source = np.array([5.0, 1.1, -0.7])
    image = method.image(spherical_wave(ARRAY, source), elements(ARRAY), SONAR, *WINDOW).energy
    port = method.image(spherical_wave(ARRAY, source * [1, -1, 1]), elements(ARRAY), SONAR, *WINDOW).energy
    up = method.image(spherical_wave(ARRAY, source * [1, 1, -1]), elements(ARRAY), SONAR, *WINDOW).energy
    np.testing.assert_allclose(port[:, ::-1], image, atol=1e-6 * image.max())
    np.testing.assert_allclose(up[::-1], image, atol=1e-6 * image.max())


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("row", "column"), [(8, 10), (3, 16)])
def test_energy_of_a_plane_wave_is_its_integral_of_pressure_squared(method, row, column):
    wave = plane_wave(ARRAY, SONAR.beams.azimuth[column], SONAR.beams.elevation[row])
    image = method.image(wave, elements(ARRAY), SONAR, *WINDOW)
    assert image.energy[row, column] == pytest.approx(total_energy(), rel=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_energy_does_not_depend_on_the_length_of_the_window(method):
    wave = plane_wave(ARRAY, 0.0, 0.0)
    for window in [(0.001, 0.004), (0.00213, 0.00301), (0.0, 0.005)]:
        image = method.image(wave, elements(ARRAY), SONAR, *window)
        assert image.energy[8, 10] == pytest.approx(total_energy(), rel=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_a_sound_outside_the_window_is_not_heard(method):
    wave = plane_wave(ARRAY, 0.1, 0.2)
    image = method.image(wave, elements(ARRAY), SONAR, 0.0035, 0.0049)
    assert image.energy.max() < 1e-12 * total_energy()


@pytest.mark.parametrize("method", METHODS)
def test_dead_elements_are_left_out_of_the_mean(method):
    broken = PlanarLattice(columns=9, rows=8, pitch=0.02, dead=(0, 1, 2, 33, 71))
    wave = plane_wave(ARRAY, SONAR.beams.azimuth[14], SONAR.beams.elevation[5])
    wave.pressure[[0, 1, 2, 33, 71]] = 1e3  # whatever a dead element gives
    image = method.image(wave, elements(broken), SONAR, *WINDOW)
    assert image.energy[5, 14] == pytest.approx(total_energy(), rel=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_one_sensor_hears_alike_in_every_direction(method):
    array = PlanarLattice(columns=1, rows=1, pitch=0.05)
    image = method.image(plane_wave(array, 0.2, 0.1), elements(array), SONAR, *WINDOW).energy
    np.testing.assert_allclose(image, total_energy(), rtol=2e-6)


@pytest.mark.parametrize("method", METHODS)
def test_one_beam_is_that_of_the_axis(method):
    alone = replace(SONAR, beams=BeamGrid(azimuths=1, elevations=1))
    image = method.image(plane_wave(ARRAY, 0.0, 0.0), elements(ARRAY), alone, *WINDOW)
    assert image.energy.shape == (1, 1)
    assert image.energy[0, 0] == pytest.approx(total_energy(), rel=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_the_sonar_steers_at_the_sound_speed_that_it_assumes(method):
    """At an assumed speed c' a wave from azimuth a is seen at sin a' = (c'/c) sin a."""
    grid = BeamGrid(azimuths=801, elevations=1)
    image = method.image(
        plane_wave(ARRAY, 0.3, 0.0),
        elements(ARRAY),
        Sonar(array=ARRAY, beams=grid, assumed_sound_speed=1600.0),
        *WINDOW,
    )
    assert grid.azimuth[np.argmax(image.energy[0])] == pytest.approx(np.arcsin(np.sin(0.3) * 1600 / SPEED), abs=2e-3)


def test_beam_of_the_508_elements_is_as_wide_as_published():
    """Half-power width at 25, 50, 85 kHz, c = 1540: 2.88, 1.44, 0.85 deg (equal-area disc 1.260 m: 1.03 lambda/D)."""
    array = elements(Romanis())
    grid = BeamGrid(azimuths=801, azimuth_span=np.deg2rad(4.0), elevations=1)
    azimuth = grid.azimuth
    for frequency, width in [(25e3, 2.88), (50e3, 1.44), (85e3, 0.85)]:
        still = np.ones((508, 1), np.complex64)
        beams = lattice_energies(still, array, array.gain / 508, np.array([frequency]), grid, SPEED, None)[0]
        half = azimuth[beams >= 0.5 * beams.max()]
        assert np.rad2deg(half[-1] - half[0]) == pytest.approx(width, abs=0.02)


def test_first_grating_lobe_lies_a_wavelength_per_pitch_off_the_axis():
    """Boresight, 85 kHz, 49.53 mm: sin a = lambda/pitch, 21.5 deg, as bright as the main lobe; none inside that."""
    array = elements(Romanis())
    grid = BeamGrid(azimuths=2001, azimuth_span=np.deg2rad(50.0), elevations=1)
    azimuth = grid.azimuth
    still = np.ones((508, 1), np.complex64)
    beams = lattice_energies(still, array, array.gain / 508, np.array([85e3]), grid, SPEED, None)[0]
    side = azimuth > np.deg2rad(5.0)
    lobe = azimuth[side][np.argmax(beams[side])]
    assert lobe == pytest.approx(np.arcsin(SPEED / 85e3 / 0.04953), abs=np.deg2rad(0.03))
    assert np.rad2deg(lobe) == pytest.approx(21.5, abs=0.1)
    assert beams[side].max() == pytest.approx(beams.max(), rel=1e-3)
    assert beams[side & (azimuth < lobe - np.deg2rad(2.0))].max() < 0.05 * beams.max()


@pytest.mark.parametrize("kind", [FocusedDelayAndSum, DenseDelayAndSum])
def test_shading_keeps_the_wave_and_lowers_the_side_lobes(kind):
    grid = BeamGrid(azimuths=301, elevations=1)
    sonar = Sonar(array=ARRAY, beams=grid, band=Band(low=50e3, high=60e3))
    side = grid.azimuth > np.deg2rad(20.0)
    uniform, hann = (
        kind(focus=None, shading=shading).image(plane_wave(ARRAY, 0.0, 0.0), elements(ARRAY), sonar, *WINDOW).energy[0]
        for shading in ("uniform", "hann")
    )
    assert hann[150] == pytest.approx(uniform[150], rel=1e-5)
    assert hann[side].max() < 0.2 * uniform[side].max()
    assert np.sum(hann > 0.5 * hann.max()) > np.sum(uniform > 0.5 * uniform.max())


def test_an_array_off_any_lattice_needs_the_dense_kind():
    array = PositionTable(positions=((0.0, 0.0, 0.0), (0.0, 0.13, 0.02), (0.01, -0.1, 0.07)))
    sonar = Sonar(array=array, beams=BeamGrid(azimuths=3, elevations=3))
    wave = plane_wave(array, sonar.beams.azimuth[2], sonar.beams.elevation[0])
    with pytest.raises(ValueError, match="kind 'dense'"):
        FocusedDelayAndSum().image(wave, elements(array), sonar, *WINDOW)
    image = DenseDelayAndSum(focus=None).image(wave, elements(array), sonar, *WINDOW)
    assert brightest(image) == (0, 2)
    assert image.energy[0, 2] == pytest.approx(total_energy(), rel=1e-6)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("start", "stop", "message"),
    [
        (-0.001, 0.002, "outside the signals"),
        (0.004, 0.006, "outside the signals"),
        (0.003, 0.003, "holds no sample"),
        (0.003, 0.002, "holds no sample"),
        (np.nan, np.nan, "holds no sample"),
        (0.003, 0.003 + 1.01 / RATE, "resolves no frequency"),
    ],
)
def test_a_window_that_was_not_recorded_is_refused(method, start, stop, message):
    with pytest.raises(ValueError, match=message):
        method.image(plane_wave(ARRAY, 0.0, 0.0), elements(ARRAY), SONAR, start, stop)


def test_energies_of_another_shape_than_the_grid_are_refused():
    with pytest.raises(ValueError, match=r"shape \(357,\), and its beams \(17, 21\)"):
        energy_image(np.ones(357), SONAR, *WINDOW)


def test_a_beamformer_that_would_be_delay_and_sum_under_another_name_is_refused():
    with pytest.raises(TypeError, match="Misspelt has neither energies nor steer"):
        type("Misspelt", (Steering,), {"energy": Steering.energies})
    type("OfItsOwn", (Steering,), {"steer": Steering.steer})
