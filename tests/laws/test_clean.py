"""CLEAN: point echoes come out at their levels, their side lobes do not."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.conventions import direction
from sonarsynth.imaging import Clean, FocusedDelayAndSum
from sonarsynth.imaging.clean import cleaned
from sonarsynth.products import Signals
from sonarsynth.receiver import Band, BeamGrid, PlanarLattice, Sonar, elements

RATE, SAMPLES = 196e3, 1000
ARRAY = PlanarLattice(columns=16, rows=16, pitch=0.0125)
PARTS = elements(ARRAY)
SONAR = Sonar(array=ARRAY, beams=BeamGrid(azimuths=51, elevations=31), band=Band(low=40e3, high=60e3))
WINDOW = 0.0005, 0.0045
LOUD, FAINT = (15, 20), (15, 33)  # 13 degrees: on the first side lobe of the loud one


def plane_wave(place, amplitude, time):
    f = np.fft.rfftfreq(SAMPLES, 1.0 / RATE)
    u = direction(SONAR.beams.azimuth[place[1]], SONAR.beams.elevation[place[0]])
    delay = time - PARTS.position @ u / SONAR.assumed_sound_speed
    pulse = np.exp(-0.5 * ((f - 50e3) / 8e3) ** 2)
    return amplitude * np.fft.irfft(pulse * np.exp(-2j * np.pi * f * delay[:, None]), SAMPLES)


def image(method, pressure):
    heard = Signals(pressure.astype(np.float32), 0.0, RATE, 0.0, 0, 0)
    return method.image(heard, PARTS, SONAR, *WINDOW).energy.astype(float)


def test_two_echoes_come_out_at_their_levels_and_nothing_else_does():
    loud, faint = plane_wave(LOUD, 1.0, 1.5e-3), plane_wave(FAINT, 10.0 ** (-15.0 / 20.0), 3.1e-3)
    dirty, clean = (image(method, loud + faint) for method in (FocusedDelayAndSum(focus=None), Clean(focus=None)))
    one = image(FocusedDelayAndSum(focus=None), loud)[LOUD]
    level = 10.0 * np.log10(np.maximum(clean, 1e-6 * one) / one)
    assert (level[LOUD], level[FAINT]) == pytest.approx((0.0, -15.0), abs=1.0)
    row, column = np.indices(level.shape)
    apart = np.minimum(*(np.hypot(row - r, column - c) for r, c in (LOUD, FAINT)))
    assert level[apart > 9.0].max() < -20.0
    assert 10.0 * np.log10(dirty[apart > 9.0].max() / one) > -20.0, "side lobes stood there"


def test_points_are_found_whatever_an_echo_looks_like():
    spread = np.array([1.0, 0.02, 0.3, 0.02, 0.1])

    def point(place):
        return np.array(
            [[spread[abs(column - place[1])] if abs(column - place[1]) < 5 else 0.0 for column in range(9)]]
        )

    dirty = 4.0 * point((0, 1)) + point((0, 5))
    np.testing.assert_allclose(cleaned(dirty, point, 0.5, 60.0, 500), [[0, 4, 0, 0, 0, 1, 0, 0, 0]], atol=1e-4)
    np.testing.assert_allclose(
        cleaned(dirty, point, 0.5, 60.0, 1) - dirty, [[0, 0, 0, -0.6, 0, -0.2, 0, 0, 0]], atol=0.05
    )
