"""Arrays focused in subarrays against sums in float64, and how many are chosen."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.conventions import direction
from sonarsynth.equations.arrays.apertures import focus_delay
from sonarsynth.imaging import AutoBeamforming, DenseDelayAndSum, FocusedDelayAndSum
from sonarsynth.imaging.delay_and_sum.focus_error import focus_error, subarrays_for
from sonarsynth.imaging.delay_and_sum.zones import cuts
from sonarsynth.products import Signals
from sonarsynth.receiver import BeamGrid, PlanarLattice, PositionTable, Romanis, Sonar, elements
from tests.lattice import lattice_energies, stated_delays, stated_energies

SPEED = 1540.0
ROMANIS = Romanis(dead=(3, 200, 201, 202))
RECTANGLE, LONG = PlanarLattice(columns=20, rows=8, pitch=0.04), PlanarLattice(columns=96, rows=1, pitch=0.04)


def uniform(array):
    return array.gain / array.gain.sum()


def grid(span, count):
    return BeamGrid(
        azimuth_span=np.deg2rad(span),
        azimuths=count,
        elevation_span=np.deg2rad(0.8 * span),
        elevations=count - 6,
    )


@pytest.mark.parametrize("cut", [(1, 1), (2, 2), (3, 1), (2, 4)])
@pytest.mark.parametrize(
    ("array", "beams"),
    [
        (Romanis(dead=(0, 77)), BeamGrid(azimuths=13, elevations=8)),
        (PlanarLattice(columns=7, rows=5, pitch=0.05), BeamGrid(azimuths=6, elevations=9)),
        (PlanarLattice(columns=9, rows=1, pitch=0.05), BeamGrid(azimuths=7, elevations=1)),
        (PlanarLattice(columns=1, rows=4, pitch=0.05), BeamGrid(azimuths=1, elevations=6)),
    ],
)
def test_kernel_equals_sums_with_the_delays_that_the_zones_state(array, beams, cut):
    array = elements(array)
    random = np.random.default_rng(sum(cut))
    spectra = random.normal(size=(array.count, 70)) + 1j * random.normal(size=(array.count, 70))
    frequencies = 25e3 + 800.0 * np.arange(70)
    fast = lattice_energies(spectra.astype(np.complex64), array, uniform(array), frequencies, beams, SPEED, 4.0, cut)
    exact = stated_energies(spectra, array, uniform(array), frequencies, beams, SPEED, 4.0, cut)
    np.testing.assert_allclose(fast, exact, atol=2e-6 * exact.max())


def test_subarrays_of_one_hydrophone_leave_nothing_out():
    """Then every beam has the delays of a sphere to each: the image is that of the exact sum."""
    array, beams = elements(PlanarLattice(columns=5, rows=3, pitch=0.2)), grid(50, 13)
    every = focus_delay(array.position, direction(beams.azimuth, beams.elevation[:, None]).reshape(-1, 3), 2.0, SPEED)
    every = every.reshape(beams.elevations, beams.azimuths, -1)
    for where, delay in stated_delays(array, beams, SPEED, 2.0, (5, 3)):
        np.testing.assert_allclose(delay, every[where], atol=1e-12)


def test_error_falls_with_subarrays_and_with_distance():
    array, sonar = elements(ROMANIS), Sonar(array=ROMANIS, beams=grid(50, 31))
    by_cut = [focus_error(array, "uniform", sonar, 10.0, cut) for cut in ((1, 1), (2, 2), (4, 4), (8, 8))]
    by_focus = [focus_error(array, "uniform", sonar, focus, (2, 2)) for focus in (2.0, 5.0, 10.0, 20.0, 50.0)]
    assert all(np.diff(by_cut) < 0)
    assert all(np.diff(by_focus) < 0)
    assert focus_error(array, "uniform", sonar, None, (1, 1)) < 1e-4


def test_as_many_subarrays_as_are_needed_and_no_more():
    array, sonar = elements(RECTANGLE), Sonar(array=RECTANGLE, beams=grid(50, 31))
    tried, few = cuts(array, 5.0), subarrays_for(array, "uniform", sonar, 5.0)
    assert few not in (None, (1, 1))
    errors = [focus_error(array, "uniform", sonar, 5.0, cut) for cut in (few, tried[tried.index(few) - 1])]
    assert errors[0] <= 0.1 < errors[1]
    assert subarrays_for(array, "uniform", sonar, 1e4) == (1, 1)
    assert subarrays_for(elements(LONG), "uniform", Sonar(array=LONG, beams=grid(50, 31)), 0.5) is None


def heard(array, source, rate=196e3):
    delay = (np.linalg.norm(source - array.position, axis=1) - np.linalg.norm(source)) / SPEED
    t = np.arange(1000) / rate - 2.5e-3 - delay[:, None]
    pressure = np.exp(-0.5 * (2 * np.pi * 7e3 * t) ** 2) * np.cos(2 * np.pi * 55e3 * t)
    return Signals(pressure.astype(np.float32), 0.0, rate, 0.0, 0, 0)


def test_auto_is_right_to_a_tenth_of_a_decibel_where_one_subarray_is_not():
    sonar = Sonar(array=RECTANGLE, beams=grid(50, 31))
    array = elements(RECTANGLE)
    signals = heard(array, 5.0 * direction(sonar.beams.azimuth[30], sonar.beams.elevation[24]))
    window = (0.001, 0.004)
    dense = DenseDelayAndSum(focus=5.0).image(signals, array, sonar, *window).energy
    bright = dense >= 0.01 * dense.max()

    def error(method):
        return np.abs(10 * np.log10(method.image(signals, array, sonar, *window).energy / dense))[bright].max()

    assert error(FocusedDelayAndSum(focus=5.0, subarrays=(1, 1))) > 0.2
    assert error(FocusedDelayAndSum(focus=5.0)) < 0.1
    assert error(AutoBeamforming(focus=5.0)) < 0.1


def test_auto_is_dense_where_subarrays_will_not_do_and_focused_elsewhere():
    sonar, array = Sonar(array=RECTANGLE, beams=grid(50, 31)), elements(RECTANGLE)
    assert AutoBeamforming(focus=None).chosen(array, sonar) == FocusedDelayAndSum(focus=None, subarrays=(1, 1))
    near = AutoBeamforming(focus=5.0, shading="hann").chosen(array, sonar)
    assert isinstance(near, FocusedDelayAndSum)
    assert (near.shading, near.focus) == ("hann", 5.0)
    assert isinstance(near.subarrays, tuple)
    long = Sonar(array=LONG, beams=sonar.beams)
    assert AutoBeamforming(focus=0.5).chosen(elements(LONG), long) == DenseDelayAndSum(focus=0.5)
    table = elements(PositionTable(positions=((0.0, 0.0, 0.0), (0.0, 0.1, 0.03))))
    assert AutoBeamforming().chosen(table, sonar) == DenseDelayAndSum()


@pytest.mark.parametrize("cut", [(0, 1), (2, 17), 2, "some"])
def test_subarrays_are_1_to_16_each_way(cut):
    with pytest.raises(ValueError, match="subarrays"):
        FocusedDelayAndSum(subarrays=cut)
