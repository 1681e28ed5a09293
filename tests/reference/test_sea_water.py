"""Sound speed, absorption and depth from pressure against the check values of their papers and of independent codes."""

import warnings

import numpy as np
import pytest

from sonarsynth.acoustics import seawater
from sonarsynth.world.environment import Absorption
from sonarsynth.world.water import absorption_db_per_m

SPEEDS = [(25, 35, 1000, 1550.744), (27, 35, 10, 1539.0866), (25, 35, 20, 1534.6204), (10, 35, 1000, 1506.2638)]

KHZ = np.array([1, 10, 25, 50, 85, 100, 110, 200])
FRANCOIS_GARRISON = {  # dB/km
    (10, 35, 0, 8.0): [0.0601, 0.9626, 4.9981, 15.3919, 29.0229, 33.6303, 36.3437, 54.4462],
    (27, 35, 10, 8.1): [0.0526, 0.6736, 2.9819, 10.7103, 27.3479, 35.6114, 41.2708, 88.8048],
    (28, 33, 20, 8.1): [0.0521, 0.6328, 2.7317, 9.8015, 25.2543, 33.0481, 38.4312, 85.0430],
}
AINSLIE_MCCOLM = {
    (10, 35, 0, 8.0): [0.0613, 0.9866, 5.1073, 15.7097, 29.6209, 34.3410, 37.1302, 56.0656],
    (27, 35, 10, 8.1): [0.0520, 0.6944, 2.9213, 10.4315, 26.9439, 35.3218, 41.1272, 91.9634],
    (28, 33, 20, 8.1): [0.0513, 0.6551, 2.6707, 9.5035, 24.7430, 32.5893, 38.0715, 87.6063],
}


@pytest.mark.parametrize(("temperature", "salinity", "depth", "speed"), SPEEDS)
def test_mackenzie_gives_its_check_values(temperature, salinity, depth, speed):
    assert seawater.mackenzie(temperature, salinity, depth) == pytest.approx(
        speed, abs=6e-5 if speed != 1550.744 else 6e-4
    )


def test_chen_millero_gives_the_check_value_of_unesco():
    assert seawater.chen_millero(40.0, 40.0, 10e3) == pytest.approx(1731.995, abs=6e-4)


def test_depth_gives_the_check_value_of_unesco():
    assert seawater.depth_of_pressure(10e3, 30.0) == pytest.approx(9712.653, abs=6e-4)


@pytest.mark.parametrize(
    ("temperature", "salinity", "depth", "teos10"),
    [(10, 35, 0, 1489.8187), (27, 35, 10, 1539.0299), (28, 33, 20, 1539.3160)],
)
def test_three_formulas_and_teos10_agree(temperature, salinity, depth, teos10):
    assert seawater.mackenzie(temperature, salinity, depth) == pytest.approx(teos10, abs=0.1)
    assert seawater.chen_millero(temperature, salinity, 1.01 * depth) == pytest.approx(teos10, abs=0.3)
    assert seawater.medwin(temperature, salinity, depth) == pytest.approx(teos10, abs=0.5)


@pytest.mark.parametrize("water", FRANCOIS_GARRISON)
def test_francois_garrison_gives_its_table(water):
    *place, ph = water
    got = seawater.francois_garrison(1e3 * KHZ, *place, ph)
    np.testing.assert_allclose(1e3 * got, FRANCOIS_GARRISON[water], rtol=0, atol=5.1e-5)


@pytest.mark.parametrize("water", AINSLIE_MCCOLM)
def test_ainslie_mccolm_gives_its_table(water):
    *place, ph = water
    got = seawater.ainslie_mccolm(1e3 * KHZ, *place, ph)
    np.testing.assert_allclose(1e3 * got, AINSLIE_MCCOLM[water], rtol=0, atol=5.1e-5)


def test_ainslie_mccolm_is_within_ten_per_cent_of_francois_garrison():
    f = np.geomspace(200, 1e6, 60)[:, None]
    depth = np.array([0.0, 100.0, 3000.0])
    ratio = seawater.ainslie_mccolm(f, 10.0, 35.0, depth, 8.0) / seawater.francois_garrison(f, 10.0, 35.0, depth, 8.0)
    assert np.abs(ratio - 1).max() < 0.1


def test_silence_at_zero_frequency_is_not_absorbed():
    assert seawater.francois_garrison(0.0, 10.0, 35.0, 0.0) == 0.0
    assert seawater.ainslie_mccolm(0.0, 10.0, 35.0, 0.0) == 0.0


def test_fresh_water_has_no_relaxation_and_says_that_it_is_out_of_range():
    with pytest.warns(seawater.OutOfRange, match="salinity 0 psu is outside 30 to 40 psu"):
        got = seawater.francois_garrison(50e3, 10.0, 0.0, 0.0)
    assert got == pytest.approx((4.937e-4 - 2.59e-4 + 9.11e-5 - 1.5e-5) * 2500 * 1e-3, rel=1e-12)


@pytest.mark.parametrize(
    ("formula", "arguments", "message"),
    [
        (seawater.mackenzie, (1.0, 35.0, 0.0), "temperature 1 degC is outside 2 to 30 degC"),
        (seawater.mackenzie, (10.0, [35.0, 24.0], 0.0), "salinity 24 psu"),
        (seawater.mackenzie, (10.0, 35.0, 9e3), "depth 9000 m"),
        (seawater.medwin, (10.0, 35.0, 1001.0), "depth 1001 m"),
        (seawater.chen_millero, (41.0, 35.0, 0.0), "temperature 41 degC"),
        (seawater.francois_garrison, (2e6, 10.0, 35.0, 0.0), "frequency 2e\\+06 Hz"),
        (seawater.ainslie_mccolm, (50e3, 10.0, 35.0, 0.0, 7.0), "pH 7"),
    ],
)
def test_a_formula_out_of_its_range_answers_and_warns(formula, arguments, message):
    with pytest.warns(seawater.OutOfRange, match=message):
        assert np.all(np.isfinite(formula(*arguments)))


def test_the_edge_of_a_range_is_in_it():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        seawater.mackenzie([2.0, 30.0], [25.0, 40.0], [0.0, 8000.0])


def test_absorption_of_a_description():
    f, depth = np.array([[25e3], [85e3]]), np.array([0.0, 10.0, 20.0])
    place = {"temperature": 27.0, "salinity": 35.0, "ph": 8.1}
    got = absorption_db_per_m(Absorption(**place), f, depth)
    assert got.shape == (2, 3)
    assert 1e3 * got[1, 1] == pytest.approx(27.3479, abs=5.1e-5)
    other = absorption_db_per_m(Absorption(formula="ainslie_mccolm", **place), f, depth)
    assert 1e3 * other[1, 1] == pytest.approx(26.9439, abs=5.1e-5)
    assert np.array_equal(absorption_db_per_m(Absorption(formula="none"), f, depth), np.zeros((2, 3)))
