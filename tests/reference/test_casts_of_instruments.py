"""Files of casts as each make writes them, by generators of their layouts: the water that went in comes out."""

from __future__ import annotations

import bz2
import gzip
import io
import zipfile

import numpy as np
import pytest

from sonarsynth.environment.casts import CastError, profile_of
from sonarsynth.environment.sound_speed import Cast
from sonarsynth.equations.water.seawater import chen_millero, del_grosso, depth_of_pressure, practical_salinity

LATITUDE = 43.5
P = np.array([1.0, 5.0, 12.0, 20.0, 40.0])  # dbar
T = np.array([16.0, 15.2, 12.5, 11.0, 9.5])  # degC, scale of 1990
S = np.array([33.0, 33.1, 33.4, 33.6, 33.9])
Z = depth_of_pressure(P, LATITUDE)
C = chen_millero(1.00024 * T, S, P)


def rows(*columns, join=","):
    return "".join(join.join(f"{v:.5f}" for v in row) + "\n" for row in zip(*columns, strict=True))


def sea_bird(names, *columns, extra="", binary=False):
    head = f"* Sea-Bird SBE 9 Data File:\n* NMEA Latitude = 43 30.00 N\n# nquan = {len(names)}\n"
    head += "".join(f"# name {i} = {name}\n" for i, name in enumerate(names))
    head += f"# bad_flag = -9.990e-29\n# file_type = {'binary' if binary else 'ascii'}\n{extra}*END*\n"
    if binary:
        return head.encode() + np.stack(columns, axis=1).astype("<f4").tobytes()
    return head + "".join("".join(f"{v:11.5f}" for v in row) + "\n" for row in zip(*columns, strict=True))


def valeport(names, units, *columns):
    head = "[Application]\nTitle=Valeport Datalog X2\nLatitude=43.5\nLongitude=-70\n[Columns]\n[Data]\n"
    table = rows(*columns, join="\t").replace("\n", "\t\n")
    return f"{head}Date/Time\t{names}\n\t{units}\n" + "".join(f"2020/06/02 10:00\t{r}\n" for r in table.splitlines())


CM = ("prDM: Pressure, Digiquartz [db]", "t090C: Temperature [ITS-90, deg C]", "sal00: Salinity, Practical [PSU]")
FILES = {
    "sea-bird speeds": sea_bird((CM[0], "svCM: Sound Velocity [Chen-Millero, m/s]"), P, C),
    "sea-bird scale of 1968": sea_bird((CM[0], "t068C: Temperature [ITS-68, deg C]", CM[2]), P, 1.00024 * T, S),
    "sea-bird binary": sea_bird(CM, P, T, S, binary=True),
    "valeport": valeport("Depth\tSound Velocity\tTemperature", "m\tms-1\tDegC", Z, C, T),
    "valeport, units one column off": "Latitude :\t43.5\nDate / Time\tSOUND VELOCITY;DBAR\tPRESSURE;C\tTEMPERATURE;\n"
    + "".join(f"22/02/2012 07:11\t{r}\n" for r in rows(C, P, T, join="\t").splitlines()),
    "aml": "[MeasurementMetadata]\nLatitude=43.5\nColumns=Date,Time,SV,Pressure\nUnits=yyyy-mm-dd,hh:mm:ss,m/s,dbar\n\n"
    "[MeasurementData]\n" + "".join(f"2020-06-23,00:07:21,{r}\n" for r in rows(C, P).splitlines()),
    "sippican": "// MK21 EXPORT DATA FILE  (EDF)\nNum Data Fields  :  3\nField1  :  Time (sec)\nField2  :  Depth (m)\n"
    "Field3  :  Sound Velocity (m/s)\n// Data\n" + rows(Z, Z, C, join="\t"),
    "rbr": "Time,Conductivity,Temperature,Sea pressure,Depth,Salinity,Speed of sound\n"
    + "".join(f"2020-11-06 11:07,0,{r}\n" for r in rows(T, P, Z, S, C).splitlines()),
    "sea and sun": "Position : Lat.:  043\u00b0 30.0' N\n; Datasets    Press     Temp    SALIN    SOUND\n"
    ";            [ dbar]  [ degC]  [  ppt]  [  m/s]\n;\n" + rows(P, P, T, S, C, join="  "),
    "kongsberg asvp": "( SoundVelocity  1.0 0 201203212242 43.5 -70.5 -1 0 0 OMS P 5 )\n" + rows(Z, C, join=" "),
    "kongsberg s12": "$MVS12,00010,0005,220142,20,05,2017," + rows(Z, C, T, S),
    "hypack": "FTP NEW 3 43.5 -122.4 15:47 08/19/2019\n" + rows(Z, C, join=" "),
    "caris": "[SVP_VERSION_2]\nx.svp\nSection 2012-126 14:33:12 43:30:00 -70:45:16 Created\n" + rows(Z, C, join=" "),
    "uctd": "*Lat 43.5\n*DeviceType=90745 UCTD\n*scan# D[m] SV[m/s] T[degC] P[dbar]\n" + rows(P, Z, C, T, P, join=" "),
    "digibar": "CALC,0004,08-30-2017,1,meters\nDEPTH (M) VELOCITY (M/S) TEMP (C)\n"
    + rows(Z, C, T, join=" ")
    + "Bottom 9\n",
}


def profile(folder, content, name="cast", **how):
    file = folder / name
    file.write_bytes(content if isinstance(content, bytes) else content.encode("latin-1"))
    return profile_of(Cast(path=str(file), **how))


@pytest.mark.parametrize("make", FILES)
def test_the_water_that_was_written_is_read(tmp_path, make):
    made = profile(tmp_path, FILES[make], formula="chen_millero", latitude=np.radians(LATITUDE))
    np.testing.assert_allclose(made.depth, Z, atol=2e-4)
    np.testing.assert_allclose(made.speed, C, atol=2e-4)


def test_an_absurd_salinity_beside_a_sound_speed_is_not_compared(tmp_path):
    wrong = np.array([33.0, 1e30, 1e300, 33.6, 33.9])
    head = "Depth (m),Temperature (degC),Salinity (psu),Sound speed (m/s)\n"
    made = profile(tmp_path, head + rows(Z, T, wrong, C))
    np.testing.assert_allclose(made.speed, C, atol=1e-4)
    assert "is within" in made.notes[-1] and "chen_millero" in made.notes[-1]


@pytest.mark.parametrize(("formula", "name"), [(chen_millero, "svCM"), (del_grosso, "svDM")])
def test_the_files_own_sound_speed_is_compared(tmp_path, formula, name):
    speed = formula(T * (1.00024 if formula is chen_millero else 1.0), S, P)
    text = sea_bird((*CM, f"{name}: Sound Velocity [m/s]"), P, T, S, np.round(speed, 2))
    (note,) = profile(tmp_path, text).notes
    off = float(note.split("within ")[1].split()[0])
    assert off <= 0.02 and f"that of {formula.__name__} by" in note


def test_the_latitude_of_the_head_is_used(tmp_path):
    text = sea_bird((CM[0], "svCM: Sound Velocity [Chen-Millero, m/s]"), 100 * P, C)
    np.testing.assert_allclose(profile(tmp_path, text).depth, depth_of_pressure(100 * P, 43.5), rtol=1e-7)
    south = text.replace("43 30.00 N", "80 30.00 S")
    np.testing.assert_allclose(profile(tmp_path, south).depth, depth_of_pressure(100 * P, -80.5), rtol=1e-7)


def test_packed_files_are_read_as_what_they_hold(tmp_path):
    text = FILES["sea-bird speeds"].encode()
    box = io.BytesIO()
    with zipfile.ZipFile(box, "w") as archive:
        archive.writestr("cast.cnv", text)
    for packed in (gzip.compress(text), bz2.compress(text), box.getvalue()):
        np.testing.assert_allclose(profile(tmp_path, packed).speed, C, atol=1e-4)
    with zipfile.ZipFile(box, "a") as archive:
        archive.writestr("other.cnv", text)
    with pytest.raises(CastError, match="archive of 2 files"):
        profile(tmp_path, box.getvalue())
    with pytest.raises(CastError, match="unpacks to more than 64 MiB"):
        profile(tmp_path, gzip.compress(bytes(1 << 27), 1))


def test_of_a_cast_the_way_down_in_the_water_is_used(tmp_path):
    """In the air and at the surface, down with a heave, up again; a flag and a row without its speed between."""
    z = [-0.3, 0.1, 5, 10, 9, 9.5, 15, 20, 25, 30, 20, 10, 1]
    c = [0.0, 1500, 1501, 1502, 1409, 1409, 1503, -9999, np.nan, 1505, 1409, 1409, 1409]
    made = profile(tmp_path, "Depth (m),Sound speed (m/s)\n" + rows(z, c))
    np.testing.assert_array_equal(made.depth, [0.1, 5, 10, 15, 30])
    np.testing.assert_array_equal(made.speed, [1500, 1501, 1502, 1503, 1505])
    (note,) = made.notes
    assert note == (
        "cast (table): 5 of 13 rows used; left out: 3 with a missing value, 3 of the way up, 2 of heave loops"
    )
    up = profile(tmp_path, "Depth (m),Sound speed (m/s)\n" + rows(z[:-4:-1] + [40.0], c[-3:] + [1400.0]))
    assert up.depth.max() == 40.0


def test_conductivity_makes_salinity_and_a_salinity_may_be_given(tmp_path):
    gsw = pytest.importorskip("gsw")
    conductivity = gsw.C_from_SP(S, T, P)
    np.testing.assert_allclose(practical_salinity(conductivity, T, P), S, atol=2e-4)
    head = "Pressure (dbar),Temperature (degC),Conductivity ({})\n"
    for unit, factor in (("mS/cm", 1.0), ("S/m", 0.1), ("uS/cm", 1000.0)):
        text = head.format(unit) + rows(P, T, factor * conductivity)
        made = profile(tmp_path, text, formula="chen_millero", latitude=np.radians(LATITUDE))
        np.testing.assert_allclose(made.speed, C, atol=1e-3)
    probe = "Depth (m),Temperature (degC)\n" + rows(Z, T)
    with pytest.raises(CastError, match="give the `salinity`"):
        profile(tmp_path, probe)
    given = profile(tmp_path, probe, salinity=33.0, formula="chen_millero", latitude=np.radians(LATITUDE))
    np.testing.assert_allclose(given.speed, chen_millero(1.00024 * T, 33.0, P), atol=1e-3)


def argo(folder, engine, name="argo.nc"):
    xr = pytest.importorskip("xarray")
    if engine == "h5netcdf":
        pytest.importorskip("h5netcdf")
    bad = np.full(len(P), np.nan)
    made = xr.Dataset(
        {
            "PRES": (("N_PROF", "N_LEVELS"), np.stack([bad, P, P]), {"units": "decibar"}),
            "TEMP": (("N_PROF", "N_LEVELS"), np.stack([bad, T + 5, T]), {"units": "degree_Celsius"}),
            "PSAL": (("N_PROF", "N_LEVELS"), np.stack([bad, S, S]), {"units": "psu"}),
            "TEMP_QC": (("N_PROF", "N_LEVELS"), np.array([["9"] * 5, ["1"] * 5, ["1", "1", "4", "1", "1"]], "S1")),
            "LATITUDE": (("N_PROF",), [0.0, LATITUDE, LATITUDE]),
        },
        attrs={"title": "Argo float vertical profile"},
    )
    made.to_netcdf(folder / name, engine=engine)
    return str(folder / name)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("engine", ["scipy", "h5netcdf"])
def test_profiles_in_netcdf(tmp_path, engine):
    path = argo(tmp_path, engine)
    warm = profile_of(Cast(path=path, formula="chen_millero"))
    np.testing.assert_allclose(warm.speed, chen_millero(1.00024 * (T + 5), S, P), atol=1e-3)
    assert warm.notes[0] == "profile 1 of 3 along N_PROF"
    cold = profile_of(Cast(path=path, formula="chen_millero", profile=2))
    np.testing.assert_allclose(cold.speed, C[[0, 1, 3, 4]], atol=1e-3)  # one is flagged as bad
    with pytest.raises(CastError, match="has no profile 3, only 3"):
        profile_of(Cast(path=path, profile=3))


@pytest.mark.filterwarnings("ignore")
def test_a_grid_of_places_wants_a_place(tmp_path):
    xr = pytest.importorskip("xarray")
    shape = (len(Z), 2, 2)
    warmer = np.broadcast_to(T[:, None, None], shape) + np.array([[0.0, 1.0], [2.0, 3.0]])
    dims = ("depth", "lat", "lon")
    grid = xr.Dataset(
        {
            "t_an": (dims, warmer, {"units": "degrees_celsius"}),
            "s_an": (dims, np.broadcast_to(S[:, None, None], shape)),
        },
        coords={"depth": Z, "lat": [43.5, 10.0], "lon": [-70.5, 0.0]},
    )
    grid.to_netcdf(tmp_path / "woa.nc", engine="scipy")
    with pytest.raises(CastError, match="give the `latitude` and the `longitude`"):
        profile_of(Cast(path=str(tmp_path / "woa.nc")))
    here = {"latitude": np.radians(43.0), "longitude": np.radians(-71.0)}
    made = profile_of(Cast(path=str(tmp_path / "woa.nc"), formula="chen_millero", **here))
    np.testing.assert_allclose(made.speed, C, atol=2e-3)


def test_what_is_no_cast_is_said_with_what_is_read(tmp_path):
    for content, message in (
        (b"\0\1\2\3" * 50, "is not a text file, nor netCDF; read are Sea-Bird"),
        ("a,b\n1,2\n3,4\n", "no column of depth or pressure among 'a', 'b'; read are Sea-Bird CNV"),
        (sea_bird(CM[:2], P, T), "no columns of sound speed, or of temperature and salinity"),
        (b"CDF\1" + bytes(40), "no profile of depth or pressure"),
        (b"CDF\1" + b"\0\7" * 40, "cannot be read as netCDF"),
        ("depth,c\n" + "2.0,1500\n" * 20, "is no cast: 1 of"),
        ("depth,c\n" + rows(-Z, C), "is not a depth between 0 and"),
    ):
        with pytest.raises(CastError) as refused:
            profile(tmp_path, content)
        assert message in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("head", "rows"),
    [
        ("Temperature (ITS-90, deg F);Depth (salt water, m);Salinity (psu)", "50;0;35 50;20;35"),
        ("Depth [salt water, ft];Temperature (deg C, ITS-90);Salinity (psu)", "0;10;35 65.6168;10;35"),
        ("Depth (m);Temperature (C);Conductivity", "0;10;38.1 20;10;38.1"),
    ],
)
def test_units_beside_scales_are_those_of_the_column(tmp_path, head, rows):
    """At 10 m, 10 degC and 35 psu (38.1 mS/cm) sound travels at 1490.0 m/s. Source: Mackenzie (1981)."""
    file = tmp_path / "cast.csv"
    file.write_text("\n".join([head, *rows.split()]) + "\n")
    assert profile_of(Cast(path=str(file))).at(10.0) == pytest.approx(1490.0, abs=0.5)


def test_a_conductivity_that_may_be_in_siemens_a_metre_is_refused(tmp_path):
    file = tmp_path / "cast.csv"
    file.write_text("Depth (m),Temperature (C),Conductivity\n0,10,3.8\n10,10,3.8\n")
    with pytest.raises(ValueError, match="'Conductivity': has no unit, and could be in S/m"):
        profile_of(Cast(path=str(file)))


def test_names_of_two_words_in_columns_cut_at_spaces_are_refused_where_rows_are_shorter(tmp_path):
    file = tmp_path / "cast.txt"
    file.write_text("Sound Speed Depth Temp Sal\n1500 0 13 35\n1501 5 14 35\n1502 35 15 35\n")
    with pytest.raises(ValueError, match="5 column names, but rows of 4 numbers"):
        profile_of(Cast(path=str(file)))


def test_rows_at_one_depth_are_averaged_and_that_is_said(tmp_path):
    z, c = [1.0, 2.0, 2.0, 2.0, 3.0], [1500.0, 1501.0, 1502.0, 1506.0, 1504.0]
    made = profile(tmp_path, "Depth (m),Sound speed (m/s)\n" + rows(z, c))
    np.testing.assert_array_equal(made.depth, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(made.speed, [1500.0, 1503.0, 1504.0])
    assert made.notes == ("cast (table): 5 of 5 rows used; 2 at the depth of another are averaged with it",)
