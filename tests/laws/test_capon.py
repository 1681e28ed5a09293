"""Capon's beamformer: an echo beside a strong source, and delay and sum where the loading outweighs the sound."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.conventions import direction
from sonarsynth.equations.arrays.apertures import focus_delay
from sonarsynth.imaging import Capon, DenseDelayAndSum
from sonarsynth.imaging.image_window import snapshots_of
from sonarsynth.imaging.lattice_blocks import subarrays
from sonarsynth.products import Signals
from sonarsynth.receiver import Band, BeamGrid, PlanarLattice, PositionTable, Romanis, Sonar, elements
from tests.dense import dense_energies

RATE, SAMPLES = 196e3, 600
ROMANIS = elements(Romanis())
SONAR = Sonar(array=Romanis(), beams=BeamGrid(azimuths=51, elevations=11), band=Band(low=42e3, high=43e3))
WINDOW = 0.001, 0.0028
ROW, ECHO, SOURCE = 5, 18, 33  # 15 degrees apart


def plane_wave(column, amplitude, time):
    """Pressure (sensor, sample) of a pulse of 13 kHz half width about 43 kHz."""
    f = np.fft.rfftfreq(SAMPLES, 1.0 / RATE)
    u = direction(SONAR.beams.azimuth[column], SONAR.beams.elevation[ROW])
    delay = time - ROMANIS.position @ u / SONAR.assumed_sound_speed
    pulse = np.exp(-0.5 * ((f - 43e3) / 8e3) ** 2)
    return amplitude * np.fft.irfft(pulse * np.exp(-2j * np.pi * f * delay[:, None]), SAMPLES)


def signals(pressure):
    return Signals(np.asarray(pressure, np.float32), 0.0, RATE, 0.0, 0, 0)


def away(level):
    """Median away from the two columns and their row."""
    return float(np.median(np.delete(level, [ROW - 1, ROW, ROW + 1], axis=0)))


@pytest.mark.parametrize(("side", "floor"), [(6, -15.5), (8, -18.0)])
def test_an_echo_30_db_under_a_source_15_degrees_off_keeps_its_level(side, floor):
    """The spectrum 1/(a^H R^-1 a) has its loading for a floor, 10 lg(1e-3/side^2) under the source; beams have not."""
    echo, source = plane_wave(ECHO, 10.0**-1.5, 1.9e-3), plane_wave(SOURCE, 1.0, 1.5e-3)
    method, both = Capon(focus=None, subarray=side), signals(echo + source)
    own = DenseDelayAndSum(focus=None).image(signals(echo), ROMANIS, SONAR, *WINDOW).energy[ROW, ECHO]
    level = 10.0 * np.log10(method.image(both, ROMANIS, SONAR, *WINDOW).energy / own)
    assert level[ROW, ECHO] == pytest.approx(0.0, abs=0.15)
    assert level[ROW, SOURCE] == pytest.approx(30.0, abs=0.15)
    window = snapshots_of(both, SONAR, *WINDOW)
    blocks, spectrum = subarrays(ROMANIS, side), 0.0
    for k, heard in method._focused(window, ROMANIS, SONAR):
        spectrum = spectrum + window.unit / blocks.forms(method._inverse(blocks.covariance(heard)), k, SONAR.beams)
    assert 10.0 * np.log10(spectrum[ROW, ECHO] / own) == pytest.approx(0.0, abs=0.15)
    assert away(10.0 * np.log10(spectrum / own)) == pytest.approx(floor, abs=0.3)
    assert away(level) < floor - 20.0


def test_beams_that_echoes_are_picked_from_pass_the_echo_and_not_the_source():
    echo, source = plane_wave(ECHO, 10.0**-1.5, 1.9e-3), plane_wave(SOURCE, 1.0, 1.5e-3)
    u = direction(SONAR.beams.azimuth[[ECHO]], SONAR.beams.elevation[ROW])
    method = Capon(focus=None)
    beam = method.beams(snapshots_of(signals(echo + source), SONAR, *WINDOW), ROMANIS, SONAR).spectra(u)[0]
    alone = method.beams(snapshots_of(signals(echo), SONAR, *WINDOW), ROMANIS, SONAR).spectra(u)[0]
    np.testing.assert_allclose(beam, alone, atol=0.03 * np.abs(alone).max())


def test_with_much_loading_it_is_delay_and_sum_of_the_blocks():
    array = PlanarLattice(columns=6, rows=5, pitch=0.02)
    parts, sonar = elements(array), Sonar(array=array, beams=BeamGrid(azimuths=7, elevations=4))
    heard = signals(np.random.default_rng(2).normal(size=(30, SAMPLES)))
    image = Capon(focus=None, subarray=3, loading=1e6).image(heard, parts, sonar, *WINDOW).energy
    window = snapshots_of(heard, sonar, *WINDOW)
    frequency, spectra, unit = window.frequency, window.spectra, window.unit
    u = direction(sonar.beams.azimuth, sonar.beams.elevation[:, None]).reshape(-1, 3)
    delay = focus_delay(parts.position, u, None, sonar.assumed_sound_speed)
    members = subarrays(parts, 3).members
    plain = [dense_energies(spectra[b], delay[:, b], np.full(9, 1.0 / 9.0), frequency) for b in members]
    assert len(members) == 12
    np.testing.assert_allclose(image.ravel(), unit * np.mean(plain, axis=0), rtol=1e-5)


def test_with_much_loading_it_is_delay_and_sum_where_there_is_no_lattice():
    random = np.random.default_rng(3)
    array = PositionTable(positions=tuple(map(tuple, random.normal(scale=0.03, size=(9, 3)).tolist())))
    parts, sonar = elements(array), Sonar(array=array, beams=BeamGrid(azimuths=7, elevations=4))
    heard = signals(random.normal(size=(9, SAMPLES)))
    image = Capon(focus=2.0, loading=1e6).image(heard, parts, sonar, *WINDOW).energy
    np.testing.assert_allclose(image, DenseDelayAndSum(focus=2.0).image(heard, parts, sonar, *WINDOW).energy, rtol=1e-4)
