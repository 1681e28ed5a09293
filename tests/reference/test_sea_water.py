"""Sound speed, absorption and depth from pressure against the check values of their papers and of independent codes."""

import itertools
import sys
import warnings
from typing import get_args

import numpy as np
import pytest

from sonarsynth.environment.absorption import absorption_db_per_m, absorption_notes
from sonarsynth.environment.hydrography import SpeedFormula, sea_water_speed
from sonarsynth.environment.sea import Absorption
from sonarsynth.equations.water import seawater
from sonarsynth.equations.water.formula_ranges import noted

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


COMPARED = {  # degC, psu, m: TEOS-10 (75 terms), Mackenzie, Del Grosso, Chen and Millero (as Wong and Zhu refitted it)
    (10, 35, 0): (1489.8187, 1489.8034, 1489.7894, 1489.8321),
    (27, 35, 10): (1539.0299, 1539.0866, 1539.1726, 1539.2624),
    (28, 33, 20): (1539.3160, 1539.3561, 1539.4439, 1539.5629),
    (15, 0, 0): (1465.9191, 1465.1735, 1465.9227, 1465.9439),
}
SEAS = [place for place in COMPARED if place[1] > 0]


@pytest.mark.parametrize("place", COMPARED)
@pytest.mark.filterwarnings("ignore::sonarsynth.equations.water.seawater.OutOfRange")
def test_each_formula_gives_the_published_comparison(place):
    t, s, z = place
    _, mackenzie, del_grosso, chen_millero = COMPARED[place]
    pressure = seawater.pressure_of_depth(z)
    assert seawater.mackenzie(t, s, z) == pytest.approx(mackenzie, abs=6e-5)
    assert seawater.del_grosso(t, s, pressure) == pytest.approx(del_grosso, abs=6e-5 if z == 0 else 1e-3)
    assert seawater.chen_millero(1.00024 * t, s, pressure) == pytest.approx(chen_millero, abs=5e-3)


@pytest.mark.parametrize("place", COMPARED)
def test_teos10_gives_the_published_comparison(place):
    pytest.importorskip("gsw")
    assert seawater.teos10(*place, 1.3, 103.8) == pytest.approx(COMPARED[place][0], abs=1e-4)
    assert seawater.teos10(*place) == pytest.approx(COMPARED[place][0], abs=1.1e-3)  # of standard salt


def test_teos10_gives_the_example_of_its_documentation():
    gsw = pytest.importorskip("gsw")
    absolute = np.array([34.7118, 34.8915, 35.0256, 34.8472, 34.7366, 34.7324])
    conservative = np.array([28.8099, 28.4392, 22.7862, 10.2262, 6.8272, 4.3236])
    p = np.array([10.0, 50.0, 125.0, 250.0, 600.0, 1000.0])
    expected = [1542.478379, 1542.572504, 1530.740258, 1494.430078, 1487.391369, 1483.937418]
    t = gsw.t_from_CT(absolute, conservative, p)
    for longitude in (None, 188.0):  # of standard salt, and at the place of the example
        practical = gsw.SP_from_SR(absolute) if longitude is None else gsw.SP_from_SA(absolute, p, longitude, 4.0)
        got = seawater.teos10(t, practical, -gsw.z_from_p(p, 4.0), 4.0, longitude)
        np.testing.assert_allclose(got, expected, rtol=0, atol=1e-6)


def test_teos10_is_near_the_gibbs_function():
    gsw = pytest.importorskip("gsw")
    t, s = np.linspace(0.0, 32.0, 33)[:, None], np.array([0.0, 20.0, 35.0, 40.0])
    exact = gsw.sound_speed_t_exact(gsw.SR_from_SP(s), t, gsw.p_from_z(-10.0, 45.0))
    assert np.abs(seawater.teos10(t, s, 10.0) - exact).max() < 0.16
    assert seawater.teos10(27.0, 35.0, 10.0) - 1539.1708 == pytest.approx(-0.141, abs=1e-3)


@pytest.mark.parametrize("place", SEAS)
def test_formulas_agree_with_the_gibbs_function_of_teos10(place):
    gsw = pytest.importorskip("gsw")
    t, s, z = place
    exact = gsw.sound_speed_t_exact(gsw.SR_from_SP(s), t, gsw.p_from_z(-z, 45.0))
    for formula in get_args(SpeedFormula):
        least = 0.25 if formula == "medwin" else 0.2
        assert sea_water_speed(formula, t, s, z, 45.0, None)[0] == pytest.approx(exact, abs=least), formula


def test_formulas_agree_as_far_as_is_said():
    """0.43 m/s over the upper 200 m, three of them 0.18; 1.15 over the upper 1000."""
    formulas = get_args(SpeedFormula) if _installed("gsw") else get_args(SpeedFormula)[:4]
    t, s = np.linspace(2.0, 30.0, 15)[:, None, None], np.linspace(30.0, 40.0, 6)[:, None]
    for bottom, most, best in ((200.0, 0.435, 0.185), (1000.0, 1.15, 0.63)):
        z = np.linspace(0.0, bottom, 5)
        speed = {f: sea_water_speed(f, t, s, z, 45.0, None)[0] for f in formulas}
        for a, b in itertools.combinations(formulas, 2):
            assert np.abs(speed[a] - speed[b]).max() < (most if {a, b} & {"medwin", "chen_millero"} else best), (a, b)


def _installed(name):
    try:
        __import__(name)
    except ImportError:
        return False
    return True


def test_teos10_without_gsw_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "gsw", None)
    with pytest.raises(ImportError, match=r"^teos10 needs gsw \(pip install 'sonarsynth\[teos10\]'\): ") as refused:
        seawater.teos10(10.0, 35.0, 0.0)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("water", [(30.0, 35.0, 3000.0), (-3.0, 35.0, 0.0), (10.0, 45.0, 0.0), (10.0, 2.0, 1000.0)])
def test_teos10_warns_outside_the_funnel(water):
    pytest.importorskip("gsw")
    with pytest.warns(seawater.OutOfRange, match=f"TEOS-10: {water[0]:g} degC with {water[1]:g} psu at {water[2]:g} m"):
        assert np.isfinite(seawater.teos10(*water))


@pytest.mark.parametrize("latitude", [0.0, 30.0, 45.0, 90.0])
def test_pressure_is_the_inverse_of_depth(latitude):
    z = np.array([0.0, 1e-3, 10.0, 1000.0, 9600.0])
    p = seawater.pressure_of_depth(z, latitude)
    np.testing.assert_allclose(seawater.depth_of_pressure(p, latitude), z, rtol=1e-14, atol=1e-15)
    assert seawater.pressure_of_depth(9712.653, 30.0) == pytest.approx(10e3, abs=6e-4)


def test_ainslie_mccolm_at_the_place_where_another_code_differs():
    """20 kHz, 0 degC, 30 psu, pH 7: the formula gives 3.6691 dB/km (the package `sonar` prints 7.656)."""
    with pytest.warns(seawater.OutOfRange, match="pH 7 is outside 7.7 to 8.3$"):
        assert 1e3 * seawater.ainslie_mccolm(20e3, 0.0, 30.0, 0.0, 7.0) == pytest.approx(3.6691, abs=5.1e-5)


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
        (seawater.mackenzie, (300.0, 35.0, 0.0), "temperature 300 degC"),
        (seawater.mackenzie, ([1.0, 15.0, 50.0, 31.0], 35.0, 0.0), "temperature 50 degC"),
        (seawater.mackenzie, (10.0, 35.0, -1.0), "depth -1 m is outside 0 to 8000 m"),
        (seawater.del_grosso, (10.0, 0.0, 0.0), "salinity 0 psu is outside 30 to 40 psu"),
        (seawater.del_grosso, (10.0, 35.0, 9807.0), "pressure 9807 dbar is outside 0 to 9806.65 dbar"),
        (seawater.depth_of_pressure, (10001.0,), "pressure 10001 dbar"),
        (seawater.francois_garrison, (2e6, 10.0, 35.0, 0.0), "frequency 2000 kHz is outside 0 to 1000 kHz"),
        (seawater.francois_garrison, (50e3, 10.0, 35.0, 0.0, 10.0), "pH 10 is outside 7.7 to 8.3"),
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


def test_a_missing_value_is_not_out_of_range():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.isnan(seawater.mackenzie(np.nan, 35.0, 0.0))
        assert seawater.mackenzie([], [], []).shape == (0,)


def test_notes_are_taken_instead_of_warnings():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with noted() as notes:
            for _ in range(3):
                seawater.mackenzie(31.0, 0.0, 0.0)
            with noted() as inner:
                seawater.medwin(40.0, 35.0, 0.0)
    assert notes == [
        "Mackenzie (1981): temperature 31 degC is outside 2 to 30 degC",
        "Mackenzie (1981): salinity 0 psu is outside 25 to 40 psu",
    ]
    assert inner == ["Medwin (1975): temperature 40 degC is outside 0 to 35 degC"]
    with pytest.warns(seawater.OutOfRange):
        seawater.mackenzie(31.0, 35.0, 0.0)


def test_absorption_out_of_range_is_silent_and_has_notes():
    hot = Absorption(temperature=32.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert absorption_db_per_m(hot, 50e3, 10.0) > 0.0
        notes = absorption_notes(hot, 50e3, 10.0)
    assert notes == (
        "Francois and Garrison (1982): temperature 32 degC is outside -2 to 30 degC; ainslie_mccolm holds there",
    )
    assert absorption_notes(Absorption(), [25e3, 85e3], 10.0) == ()
    assert absorption_notes(Absorption(formula="none", temperature=32.0), 50e3, 10.0) == ()
    fresh = absorption_notes(Absorption(salinity=0.0), 50e3, 10.0)
    assert fresh == ("Francois and Garrison (1982): salinity 0 psu is outside 30 to 40 psu",)


def test_absorption_of_a_description():
    f, depth = np.array([[25e3], [85e3]]), np.array([0.0, 10.0, 20.0])
    place = {"temperature": 27.0, "salinity": 35.0, "ph": 8.1}
    got = absorption_db_per_m(Absorption(**place), f, depth)
    assert got.shape == (2, 3)
    assert 1e3 * got[1, 1] == pytest.approx(27.3479, abs=5.1e-5)
    other = absorption_db_per_m(Absorption(formula="ainslie_mccolm", **place), f, depth)
    assert 1e3 * other[1, 1] == pytest.approx(26.9439, abs=5.1e-5)
    assert np.array_equal(absorption_db_per_m(Absorption(formula="none"), f, depth), np.zeros((2, 3)))
