"""Beamformers that are no delay and sum, where it is hardest: silence, one sensor, one frequency, faint and loud."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.imaging import Capon, Clean, LpMean, OrderStatistic, SubBand
from sonarsynth.products import Signals
from sonarsynth.receiver import BeamGrid, PlanarLattice, PositionTable, Sonar, elements

RATE = 196e3
LATTICE = PlanarLattice(columns=5, rows=4, pitch=0.02)
ARRAYS = {
    "lattice": LATTICE,
    "line": PlanarLattice(columns=20, rows=1, pitch=0.02),
    "all dead but one": PlanarLattice(columns=5, rows=4, pitch=0.02, dead=tuple(i for i in range(20) if i != 7)),
    "no lattice": PositionTable(positions=((0.0, 0.0, 0.0), (0.0, 0.03, 0.01), (0.01, -0.02, 0.04))),
}
METHODS = [SubBand(), LpMean(), LpMean(p=0.0, window=1e-4), OrderStatistic(), Capon(), Clean()]
WINDOW = 0.001, 0.003


def image(method, pressure, array=LATTICE, window=WINDOW):
    sonar = Sonar(array=array, beams=BeamGrid(azimuths=7, elevations=6))
    return method.image(Signals(pressure.astype(np.float32), 0.0, RATE, 0.0, 0, 0), elements(array), sonar, *window)


def noise(sensors=20, samples=700):
    return np.random.default_rng(2).normal(size=(sensors, samples))


def told_apart(method):
    return f"{method.row()} {getattr(method, 'window', None) or ''}"


@pytest.mark.parametrize("method", METHODS, ids=told_apart)
@pytest.mark.parametrize("name", ARRAYS)
def test_noise_gives_numbers_and_silence_gives_zero_in_any_array(method, name):
    array = ARRAYS[name]
    sensors = elements(array).count
    energy = image(method, noise(sensors), array).energy
    assert np.isfinite(energy).all() and (energy >= 0).all() and energy.any()
    assert not image(method, np.zeros((sensors, 700)), array).energy.any()


@pytest.mark.parametrize("method", METHODS, ids=told_apart)
def test_a_window_of_one_frequency_gives_numbers(method):
    energy = image(method, noise(), window=(0.001, 0.001 + 4.01 / RATE)).energy
    assert np.isfinite(energy).all() and energy.any()


@pytest.mark.parametrize("method", METHODS, ids=told_apart)
@pytest.mark.parametrize("amplitude", [1e-9, 1e9])
def test_energy_goes_with_the_square_of_the_pressure(method, amplitude):
    one, other = image(method, noise()).energy, image(method, amplitude * noise()).energy
    np.testing.assert_allclose(other.astype(float) / amplitude**2, one, rtol=1e-4, atol=1e-6 * one.max())


@pytest.mark.parametrize("method", METHODS, ids=told_apart)
def test_two_coherent_waves_and_nothing_else_give_numbers(method):
    same = np.tile(noise(1), (20, 1))
    energy = image(method, same + 1e-3 * np.roll(same, 3, axis=1)).energy
    assert np.isfinite(energy).all() and (energy >= 0).all()


@pytest.mark.parametrize("method", METHODS, ids=told_apart)
def test_a_signal_that_is_not_a_number_never_gives_a_number(method):
    bad = noise()
    bad[3, 400] = np.nan
    assert np.isnan(image(method, bad).energy).all()


@pytest.mark.parametrize("method", METHODS, ids=told_apart)
def test_an_array_of_dead_elements_is_refused_in_one_line(method):
    dead = PlanarLattice(columns=5, rows=4, pitch=0.02, dead=tuple(range(20)))
    with pytest.raises(ValueError, match="no live element"):
        image(method, noise(), dead)
