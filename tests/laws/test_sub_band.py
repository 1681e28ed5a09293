"""Sub-bands: grating lobes fall, plane waves keep their energy, nothing is more than in delay and sum."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.conventions import direction
from sonarsynth.imaging import FocusedDelayAndSum, SubBand
from sonarsynth.imaging.sub_band import weighted_geometric_mean
from sonarsynth.products import Signals
from sonarsynth.receiver import Band, BeamGrid, Romanis, Sonar, elements

RATE = 196e3
SONAR = Sonar(array=Romanis(), beams=BeamGrid(azimuths=101, elevations=11), band=Band(low=25e3, high=85e3))
ROMANIS = elements(Romanis())
ROW, COLUMN = 5, 90  # the echo, at the edge of the view
WINDOW = 0.001, 0.0025


def flat(f):
    return ((f > 20e3) & (f < 90e3)).astype(float)


def snap(f):
    return np.exp(-0.5 * ((f - 40e3) / 15e3) ** 2)


def plane_wave(spectrum, samples=600):
    f = np.fft.rfftfreq(samples, 1.0 / RATE)
    u = direction(SONAR.beams.azimuth[COLUMN], SONAR.beams.elevation[ROW])
    delay = 1.75e-3 - ROMANIS.position @ u / SONAR.assumed_sound_speed
    pressure = np.fft.irfft(spectrum(f) * np.exp(-2j * np.pi * f * delay[:, None]), samples)
    return Signals(pressure.astype(np.float32), 0.0, RATE, 0.0, 0, 0)


def levels(method, wave):
    """dB of the plane wave itself, and of the brightest beam of the other half of the image, re the plane wave."""
    energy = method.image(wave, ROMANIS, SONAR, *WINDOW).energy.astype(float)
    return energy[ROW, COLUMN], 10.0 * np.log10(energy[:, :70].max() / energy[ROW, COLUMN])


@pytest.mark.parametrize(("spectrum", "smeared", "left"), [(flat, -12.3, -28.0), (snap, -11.4, -22.6)])
def test_the_grating_lobe_of_a_broadband_echo_falls_and_the_echo_stays(spectrum, smeared, left):
    """The lobe stands in some sub-bands only (8 of them: -11 to -27 dB by the study that this follows)."""
    wave = plane_wave(spectrum)
    plain, lobe = levels(FocusedDelayAndSum(focus=None), wave)
    kept, lower = levels(SubBand(focus=None), wave)
    assert lobe == pytest.approx(smeared, abs=1.0)
    assert lower == pytest.approx(left, abs=1.0)
    assert kept == pytest.approx(plain, rel=1e-5)


def test_one_band_is_delay_and_sum_and_more_bands_never_give_more():
    noise = Signals(np.random.default_rng(3).normal(size=(508, 600)).astype(np.float32), 0.0, RATE, 0.0, 0, 0)
    plain = FocusedDelayAndSum(focus=None).image(noise, ROMANIS, SONAR, *WINDOW).energy
    np.testing.assert_allclose(SubBand(focus=None, bands=1).image(noise, ROMANIS, SONAR, *WINDOW).energy, plain, 1e-5)
    assert (SubBand(focus=None).image(noise, ROMANIS, SONAR, *WINDOW).energy <= plain * (1.0 + 1e-5)).all()


def test_the_mean_of_equal_references_is_geometric():
    energy = np.array([[1.0, 0.0, 3.0], [4.0, 5.0, 3.0], [16.0, 5.0, 3.0]])
    np.testing.assert_allclose(weighted_geometric_mean(energy, np.full(3, 2.0)), [12.0, 0.0, 9.0])
    np.testing.assert_allclose(weighted_geometric_mean(energy, np.array([2.0, 0.0, 2.0])), [8.0, 0.0, 6.0])
    assert not weighted_geometric_mean(energy, np.zeros(3)).any()
