"""Beamforming where it is hardest: far and near foci, whole turns between neighbours."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.equations.arrays.apertures import focus_delay
from sonarsynth.imaging import DenseDelayAndSum, FocusedDelayAndSum
from sonarsynth.products import Signals
from sonarsynth.receiver import BeamGrid, PlanarLattice, Sonar, elements
from tests.lattice import lattice_energies

SPEED = 1540.0
RATE = 196e3
ARRAY = PlanarLattice(columns=5, rows=4, pitch=0.02)
SONAR = Sonar(array=ARRAY, beams=BeamGrid(azimuths=7, elevations=6))


def noise():
    pressure = np.random.default_rng(2).normal(size=(20, 700))
    return Signals(pressure.astype(np.float32), 0.0, RATE, 0.0, 0, 0)


@pytest.mark.parametrize("method", [FocusedDelayAndSum, DenseDelayAndSum])
def test_a_far_focus_is_a_plane_wave(method):
    far = method(focus=1e12).image(noise(), elements(ARRAY), SONAR, 0.001, 0.003).energy
    plane = method(focus=None).image(noise(), elements(ARRAY), SONAR, 0.001, 0.003).energy
    np.testing.assert_allclose(far, plane, rtol=1e-6)


@pytest.mark.parametrize("method", [FocusedDelayAndSum, DenseDelayAndSum])
def test_a_focus_within_the_array_gives_numbers(method):
    image = method(focus=0.001).image(noise(), elements(ARRAY), SONAR, 0.001, 0.003).energy
    assert np.isfinite(image).all()
    assert (image > 0).all()


def test_a_focus_on_an_element_gives_its_delay():
    q = np.array([0.0, 0.3, 0.4])
    assert focus_delay(q[None], q / 0.5, 0.5, SPEED)[0] == pytest.approx(-0.5 / SPEED)


def test_whole_turns_between_neighbours():
    """One bin whose wavelength is the pitch, at the grating lobe: the recurrence has nothing to turn."""
    parts = elements(PlanarLattice(columns=40, rows=40, pitch=0.1))
    grid = BeamGrid(azimuths=3, azimuth_span=np.pi - 1e-12, elevations=1)
    ones = np.ones((1600, 1), np.complex64)
    energy = lattice_energies(ones, parts, parts.gain / 1600, np.array([15400.0]), grid, SPEED, None)
    np.testing.assert_allclose(energy, 1.0, rtol=1e-6)
