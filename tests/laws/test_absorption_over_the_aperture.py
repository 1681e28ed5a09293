"""Water absorbs along the way to each hydrophone, not to the middle of the array: one expansion against each alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.equations.water.seawater import ainslie_mccolm
from sonarsynth.products import Arrivals
from sonarsynth.receiver import POINT, PositionTable, elements
from sonarsynth.signals import DirectSum, GriddedSynthesis
from sonarsynth.signals.segments import Reception
from tests.echoes import ROMANIS
from tests.laws.test_synthesis import SNAPS, SONAR, C, arrivals, some_of

FAR = np.argsort(np.linalg.norm(ROMANIS.position, axis=1))[[-1, -2, -200]]


def sea(frequency: Floats) -> Floats:
    return np.asarray(ainslie_mccolm(frequency, 20.0, 35.0, 5.0, 8.0))


def from_points(points: Floats, place: Floats, loss: float) -> Arrivals:
    """Spherical waves from points (point, xyz) that reach `place` (xyz), through water that absorbs `loss` (dB/m)."""
    away = points - place
    distance = np.linalg.norm(away, axis=1)
    sent = 10.0 ** (-loss * distance / 20.0) / distance
    return replace(arrivals(distance / C, away, distance, sent, loss=loss * distance), centre=SONAR.band.centre)


def points_at(distance: float, count: int, spread: float) -> Floats:
    random = np.random.default_rng(3)
    return distance * np.array([0.9, 0.3, -0.3]) + spread * random.uniform(-1.0, 1.0, (count, 3))


def window(distance: float) -> tuple[float, int]:
    return (distance - 2.0) / C, 1024


@pytest.mark.parametrize("count", [1, 60])
@pytest.mark.parametrize("distance", [3.0, 20.0, 300.0])
def test_an_expansion_absorbs_what_the_way_to_each_hydrophone_does(distance: float, count: int) -> None:
    points, rate, (start, samples) = points_at(distance, count, 0.3), float(sea(SONAR.band.centre)), window(distance)
    part = ROMANIS.select(FAR)
    whole, _ = DirectSum().pressure(
        from_points(points, np.zeros(3), rate), SNAPS, Reception(part, SONAR, sea, start, samples)
    )
    single = replace(POINT, face=ROMANIS.face)
    for row, sensor in zip(whole, FAR, strict=True):
        here = from_points(points, ROMANIS.position[sensor], rate)
        alone, _ = DirectSum().pressure(here, SNAPS, Reception(single, SONAR, sea, start, samples))
        assert np.abs(alone).max() > 0.0
        # a wave from here and one from the middle round otherwise
        assert np.abs(row - alone[0]).max() < 1e-9 * np.abs(alone).max()


@pytest.mark.long
@pytest.mark.parametrize("count", [1, 300])
@pytest.mark.parametrize("face", [0.0, 49.53e-3])
def test_the_fast_synthesis_absorbs_as_the_exact_sum(count: int, face: float) -> None:
    points, rate, (start, samples) = points_at(6.0, count, 0.4), float(sea(SONAR.band.centre)), window(6.0)
    of = from_points(points, np.zeros(3), rate)
    part = some_of(ROMANIS, 16, face)
    exact, _ = DirectSum().pressure(of, SNAPS, Reception(part, SONAR, sea, start, samples))
    fast = GriddedSynthesis(width=10, precision="float64", tolerance=1e-7)
    got, _ = fast.pressure(of, SNAPS, Reception(part, SONAR, sea, start, samples))
    assert np.abs(got - exact).max() < 5e-7 * np.abs(exact).max()


def test_absorption_that_is_strong_is_absorbed_at_every_hydrophone() -> None:
    """3 dB/m at the centre, a hundred times that of the sea: 3 dB more over the array than to its middle."""

    def strong(frequency: Floats) -> Floats:
        return 100.0 * sea(frequency)

    points, rate, (start, samples) = points_at(6.0, 100, 0.4), float(strong(SONAR.band.centre)), window(6.0)
    of = from_points(points, np.zeros(3), rate)
    part = some_of(ROMANIS, 16)
    exact, _ = DirectSum().pressure(of, SNAPS, Reception(part, SONAR, strong, start, samples))
    got, _ = GriddedSynthesis().pressure(of, SNAPS, Reception(part, SONAR, strong, start, samples))
    assert np.abs(got - exact).max() < 1.5e-4 * np.abs(exact).max()


def test_a_hydrophone_farther_away_hears_less_of_the_high_frequencies() -> None:
    """In line with the source the spectra of two hydrophones differ by spreading and the water's absorption alone."""
    apart, distance = 0.5, 20.0
    line = elements(PositionTable(positions=((0.25, 0.0, 0.0), (-0.25, 0.0, 0.0))))
    of = from_points(np.array([[distance, 0.0, 0.0]]), np.zeros(3), float(sea(SONAR.band.centre)))
    start, samples = window(distance)
    for method in (DirectSum(), GriddedSynthesis(width=10, precision="float64", tolerance=1e-7)):
        signals = method.signals(of, SNAPS, Reception(line, SONAR, sea, start, samples))
        near, far = np.abs(np.fft.rfft(signals.pressure.astype(float), axis=1))
        f = np.fft.rfftfreq(samples, 1.0 / SONAR.sampling_frequency)
        some = (f > SONAR.band.low) & (f < SONAR.band.high)
        spreading = (distance + 0.5 * apart) / (distance - 0.5 * apart)
        lost = 20.0 * np.log10(near[some] / far[some] / spreading)
        assert lost == pytest.approx(sea(f[some]) * apart, abs=5e-5)
