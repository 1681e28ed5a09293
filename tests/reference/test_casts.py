"""Profiles from descriptions and from casts in files."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sonarsynth.environment.casts import CastError, profile_of
from sonarsynth.environment.sea import Cast, Isovelocity, Tabulated, TemperatureSalinity
from sonarsynth.equations.water.seawater import chen_millero, del_grosso, mackenzie, medwin, pressure_of_depth, teos10

REAL = Path(__file__).parents[2].parent / "shared" / "data" / "castaway_ctd.csv"

CASTAWAY = """% Device,CC0000000
% Start latitude,-36.22
%
Pressure (Decibar),Depth (Meter),Temperature (Celsius),Conductivity (MicroSiemens per Centimeter),\
Salinity (Practical Salinity Scale),Sound velocity (Meters per Second)
0.15,0.149,16.446,45033.875,35.608,1511.860
5.0,4.97,16.2,45020.0,35.64,1511.30
20.0,19.88,15.9,45000.0,35.66,1510.60
"""


def written(folder, text, name="cast.csv"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def read(folder, text, **how):
    return profile_of(Cast(path=str(written(folder, text)), **how))


@pytest.mark.skipif(not REAL.exists(), reason="the real cast is not part of the repository")
def test_a_real_cast_agrees_with_its_instrument():
    own = profile_of(Cast(path=str(REAL)))
    ours = profile_of(Cast(path=str(REAL), quantity="temperature_salinity"))
    assert len(own.depth) == 141
    np.testing.assert_array_equal(own.depth, ours.depth)
    assert np.abs(own.speed - ours.speed).max() < 0.2
    assert own.depth[0] == 0.14918969207604846
    assert own.speed[0] == 1511.8595379477067


def test_a_cast_as_the_instrument_exports_it(tmp_path):
    profile = read(tmp_path, CASTAWAY)
    np.testing.assert_array_equal(profile.depth, [0.149, 4.97, 19.88])
    np.testing.assert_array_equal(profile.speed, [1511.860, 1511.30, 1510.60])
    ours = read(tmp_path, CASTAWAY, quantity="temperature_salinity")
    np.testing.assert_array_equal(ours.speed, mackenzie([16.446, 16.2, 15.9], [35.608, 35.64, 35.66], profile.depth))
    assert not profile.speed.flags.writeable


def test_the_simple_profiles():
    assert profile_of(Isovelocity(speed=1540.0)).uniform
    assert profile_of(Isovelocity(speed=1540.0)).at(1e4) == 1540.0
    table = profile_of(Tabulated(depth=(0.0, 5.0, 5.0, 20.0), speed=(1540.0, 1540.0, 1530.0, 1520.0)))
    np.testing.assert_array_equal(table.depth, [0.0, 5.0, 5.0, 20.0])
    np.testing.assert_array_equal(table.at([-1.0, 12.5, 99.0]), [1540.0, 1525.0, 1520.0])
    water = profile_of(TemperatureSalinity(depth=(10.0, 20.0), temperature=(27.0, 25.0), salinity=(35.0, 35.0)))
    np.testing.assert_allclose(water.speed, [1539.0866, 1534.6204], atol=5.1e-5)


def test_cold_water_has_a_note_and_no_warning():
    cold = TemperatureSalinity(depth=(10.0,), temperature=(0.5,), salinity=(35.0,))
    for _ in range(2):  # the profile is kept, and the note with it
        (note,) = profile_of(cold).notes
        assert note.startswith("Mackenzie (1981): temperature 0.5 degC is outside 2 to 30 degC; medwin, chen_millero, ")
    assert profile_of(replace(cold, formula="chen_millero")).notes == ()


FORMULAS = {
    "mackenzie": lambda t, s, z: mackenzie(t, s, z),
    "medwin": lambda t, s, z: medwin(t, s, z),
    "chen_millero": lambda t, s, z: chen_millero(1.00024 * t, s, pressure_of_depth(z, 1.3)),
    "del_grosso": lambda t, s, z: del_grosso(t, s, pressure_of_depth(z, 1.3)),
    "teos10": lambda t, s, z: teos10(t, s, z, 1.3, 103.8),
}


@pytest.mark.parametrize("formula", FORMULAS)
def test_each_formula_by_description_and_by_cast(tmp_path, formula):
    if formula == "teos10":
        pytest.importorskip("gsw")
    z, t, s = np.array([0.0, 10.0, 80.0]), np.array([29.0, 28.0, 20.0]), np.array([33.0, 33.5, 35.0])
    expected = FORMULAS[formula](t, s, z)
    place = {"latitude": np.radians(1.3), "longitude": np.radians(103.8)}
    described = TemperatureSalinity(depth=tuple(z), temperature=tuple(t), salinity=tuple(s), formula=formula, **place)
    np.testing.assert_allclose(profile_of(described).speed, expected, rtol=1e-14)
    rows = "depth,temperature,salinity\n" + "\n".join(f"{a},{b},{c}" for a, b, c in zip(z, t, s, strict=True))
    np.testing.assert_allclose(read(tmp_path, rows, formula=formula, **place).speed, expected, rtol=1e-14)
    commented = "% Start latitude,1.3\n% Start longitude,103.8\n" + rows
    np.testing.assert_allclose(read(tmp_path, commented, formula=formula).speed, expected, rtol=1e-14)


def test_a_formula_that_a_cast_does_not_need_is_noted(tmp_path):
    text = f"depth,sound speed,temperature,salinity\n1,{medwin(15.0, 35.0, 1.0):.3f},15,35\n"
    (own,) = read(tmp_path, text).notes
    assert re.fullmatch(r"the file's own sound speed is within 0.0\d+ m/s of that of medwin by its .*", own)
    note, _ = read(tmp_path, text, formula="medwin").notes
    assert note == "formula medwin is not used: the file has a sound speed, 'sound speed', of its own"
    used = read(tmp_path, text, formula="medwin", quantity="temperature_salinity")
    assert used.notes == (own,)
    np.testing.assert_array_equal(used.speed, [medwin(15.0, 35.0, 1.0)])


def test_notes_of_a_cast_outlast_its_smoothing(tmp_path):
    profile = read(tmp_path, "depth,temperature,salinity\n1,10,5\n9,10,5\n", smoothing=2.0)
    assert len(profile.depth) == 5
    assert profile.notes[0].startswith("Mackenzie (1981): salinity 5 psu is outside 25 to 40 psu; medwin")


@pytest.mark.parametrize(
    "text",
    [
        "depth,sound_speed\n1,1500\n2,1510\n",
        "# made by hand\nDepth [m];Sound speed [m/s]\n1;1500\n2;1510\n",
        "depth_m;sound_velocity_m/s\n1,0;1500,0\n2,0;1510,0\n",
        "depth_m,sound_speed_m_s\n1,1500\n2,1510\n",
        "Depth (ft),SV (ft/s)\n3.280839895,4921.2598425\n6.56167979,4954.0682415\n",
        "Sound speed (km/s)\tdepth\n1.5\t1\n1.51\t2\n",
        "\ufeffdepth,c,remark\r\n1,1500,ok\r\n\r\n2,1510,\r\n",
        b"depth (m),sound speed (m/s),T (\xb0C)\n1,1500,9\n2,1510,9\n",
        "depth,sound_speed\n2,1510\n1,1500\n",  # on the way up
    ],
)
def test_tables_with_named_columns_and_units(tmp_path, text):
    profile = read(tmp_path, text)
    np.testing.assert_allclose(profile.depth, [1, 2], rtol=1e-9)
    np.testing.assert_allclose(profile.speed, [1500, 1510], rtol=1e-9)


def test_units_of_temperature_and_pressure(tmp_path):
    text = "P (MPa),Temperature (K),S\n0.1,289.15,35\n0.5,288.15,35.5\n"
    profile = read(tmp_path, text)
    np.testing.assert_allclose(profile.depth, [9.92, 49.58], atol=0.01)
    np.testing.assert_allclose(profile.speed, mackenzie([16, 15], [35, 35.5], profile.depth), rtol=1e-12)
    np.testing.assert_allclose(profile.speed, chen_millero([16, 15], [35, 35.5], [10, 50]), atol=0.1)


def test_the_latitude_of_a_comment_is_used(tmp_path):
    body = "pressure,sound speed\n100,1500\n1000,1510\n"
    equator = read(tmp_path, "% Start latitude,0.0\n" + body).depth
    pole = read(tmp_path, "% latitude: -90\n" + body).depth
    np.testing.assert_allclose(equator / pole, 9.832 / 9.780, atol=2e-4)


def test_a_changed_file_is_read_again(tmp_path):
    assert read(tmp_path, "depth,c\n1,1500\n").speed[0] == 1500
    assert read(tmp_path, "depth,c\n1,1500.5\n").speed[0] == 1500.5


HEAD = "depth,sound_speed,temperature,salinity\n"
BAD = {
    "missing": (None, "no such file or directory"),
    "empty": ("", "has no rows of numbers"),
    "names only": (HEAD, "has no rows of numbers"),
    "numbers only": ("1,1500\n2,1510\n", "line 1: a line of column names must come before the numbers"),
    "binary": (bytes(range(256)) * 4, "is not a text file"),
    "text": (HEAD + "1,1500,9,35\n\n2,fast,9,35\n", "line 4, column 'sound_speed': 'fast' is not a number"),
    "nothing": (
        "depth,c\n,1500\n-9999,1500\n",
        "no row can be used (2 with a missing value); 'depth' has no good value",
    ),
    "bad sensor": (
        "depth,temperature,salinity\n1,9,-9999\n2,8,\n",
        "no row can be used (2 with a missing value); 'salinity' has no good value; give the `salinity`",
    ),
    "kelvin": ("depth,temperature,salinity\n1,289,35\n", "289 degC is not a temperature between -5 and 50 degC (15.85"),
    "fahrenheit": ("depth,temperature,salinity\n1,68,35\n", "-5 and 50 degC (20 degC if it is in degrees Fahrenheit)"),
    "height": (HEAD + "-1,1500,9,35\n", "line 2, column 'depth': -1 m is not a depth between 0"),
    "unit": ("depth (fathoms),c\n1,1500\n", "line 1, column 'depth (fathoms)': unit 'fathoms' is not one of m, ft"),
    "decimal commas": (
        "depth,temperature,salinity\n0,5,20,1,35,0\n5,0,19,9,35,1\n",
        "line 1: 3 column names, but rows of 6 numbers: are these decimal commas?",
    ),
    "no depth": ("c,temperature\n1500,9\n", "line 1: no column of depth or pressure among 'c', 'temperature'"),
    "another speed": (
        "depth,speed\n1,1500\n",
        "among 'depth', 'speed'; a sound speed may be called sound speed, sound velocity, speed of sound, ",
    ),
    "another depth": ("z,c\n1,1500\n", "; a depth may be called depth, dep, depsm, "),
    "no speed": ("depth,salinity\n1,35\n", "line 1: no columns of sound speed, or of temperature and salinity"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_cast_is_refused_in_one_line(tmp_path, case):
    text, message = BAD[case]
    path = tmp_path / "none.csv" if text is None else written(tmp_path, text)
    with pytest.raises(CastError, match=re.escape(message)) as refused:
        profile_of(Cast(path=str(path)))
    assert "\n" not in str(refused.value)
    assert str(path) in str(refused.value)


def test_a_given_salinity_stands_for_that_of_a_sensor_that_failed(tmp_path):
    """As where there was none; a column with any good value is taken at its word."""
    rows = "\n".join(f"{z},{10 - 0.1 * z}" for z in range(1, 9))
    none = read(tmp_path, f"depth,temperature\n{rows}\n", salinity=35.0)
    failed = read(
        tmp_path, f"depth,temperature,salinity\n{rows.replace(chr(10), ',-9999' + chr(10))},-9999\n", salinity=35.0
    )
    np.testing.assert_array_equal(failed.speed, none.speed)
    own = read(tmp_path, f"depth,temperature,salinity\n{rows.replace(chr(10), ',30' + chr(10))},30\n", salinity=35.0)
    assert (own.speed < none.speed - 5.0).all()


def test_columns_that_were_asked_for_must_be_there(tmp_path):
    path = str(written(tmp_path, "depth,c\n1,1500\n"))
    with pytest.raises(CastError, match="no columns of temperature and salinity among 'depth', 'c'"):
        profile_of(Cast(path=path, quantity="temperature_salinity"))
    path = str(written(tmp_path, "depth,temperature,salinity\n1,10,35\n", "other.csv"))
    with pytest.raises(CastError, match=r"no column of sound speed among .*; a sound speed may be called sound speed"):
        profile_of(Cast(path=path, quantity="sound_speed"))
