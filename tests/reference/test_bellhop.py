"""Bellhop as a neighbour: what it reads is written, what it writes is read, and its eigenrays are ours."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from sonarsynth import planning
from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.environment.casts import CastError, profile_of
from sonarsynth.environment.sound_speed import Cast
from sonarsynth.equations.water.boundary_reflection import rayleigh
from sonarsynth.export import write_bellhop
from sonarsynth.geometry.surfaces import MeshError
from sonarsynth.recipe.reading import load
from sonarsynth.targets.mesh_readers.mesh_files import read_surface
from sonarsynth.validation.bellhop import ArrivalsError, BellhopArrivals, compare_arrivals, read_arrivals
from sonarsynth.validation.bellhop.arrivals_compared import paired

HERE = Path(__file__).parent / "bellhop"


def plan_of(name, *sets):
    return planning.plan(load(HERE / f"{name}.yaml", sets), (), planning.Choices())


@pytest.mark.parametrize("name", ["uniform", "layers"])
def test_an_environment_is_written_as_it_was_for_the_recorded_run(tmp_path, name):
    files, _ = write_bellhop(plan_of(name), 0, tmp_path, name)
    assert [file.read_text() for file in files] == [(HERE / f"{name}.env").read_text()]


def test_an_environment_is_read_back_to_the_last_digit(tmp_path):
    written = plan_of("layers")
    (file,), _ = write_bellhop(written, 0, tmp_path, "layers")
    back, there = profile_of(Cast(path=str(file))), written.profile
    inside = there.depth < 30.0
    assert np.array_equal(back.depth[:-1], there.depth[inside]) and np.array_equal(back.speed[:-1], there.speed[inside])
    assert (back.depth[-1], back.speed[-1]) == (30.0, there.at(30.0))
    assert back.notes == (
        "the environment's depth is 30 m in the file, the reflection of its bottom {kind: fluid, density_ratio: 1.451, "
        "speed_ratio: 1.1073, loss_tangent: 0.01602}",
    )


def test_recorded_arrivals_are_those_of_images():
    """Uniform water: every delay, angle and level by images, with Rayleigh's coefficient."""
    found = read_arrivals(HERE / "uniform.arr").at(16.0, 6.0, 30.0)
    assert (found.frequency, found.source_depth, found.receiver_depth, found.distance) == (55e3, 16.0, 6.0, 30.0)
    assert len(found.delay) == 21 and (found.surface <= 5).all()
    up, odd = found.launch > 0, (found.surface + found.bottom) % 2 == 1
    end = np.where(odd, -6.0, 6.0)  # of the receiver, or of its image
    unfolded = np.where(up, 16.0 + 40.0 * found.bottom - end, 40.0 * found.bottom - 16.0 + end)
    length = np.hypot(30.0, unfolded)
    np.testing.assert_allclose(found.delay, length / 1500.0, atol=2e-6)  # the steepest are beams beside the ray
    np.testing.assert_allclose(np.abs(found.launch), np.arctan2(np.abs(unfolded), 30.0), atol=2e-3)
    once = np.abs(rayleigh(np.arctan2(np.abs(unfolded), 30.0), 1.8, 1.1, 0.01))
    whole = 20.0 * np.log10(length) - 20.0 * found.bottom * np.log10(once)
    strong = found.bottom <= 2
    absorbed = (found.loss - whole)[strong] / length[strong]
    assert np.ptp(absorbed) < 3e-3 and 0.005 < absorbed.mean() < 0.04  # dB/m at 55 kHz


@pytest.mark.parametrize(("name", "late"), [("uniform", 5e-8), ("layers", 4e-7)])
def test_eigenrays_are_those_of_a_recorded_run(name, late):
    """The snap of `layers` is on the bottom, and 1 mm above it in Bellhop's run: 0.67 us at most."""
    rays = compare_arrivals(plan_of(name), 0, HERE / f"{name}.arr")
    ours = [ray for ray in rays if np.isfinite(ray.delay[0])]
    assert len(ours) == {"uniform": 13, "layers": 11}[name]
    for ray in ours:
        assert abs(ray.delay[0] - ray.delay[1]) < late
        assert abs(ray.launch[0] - ray.launch[1]) < 1e-4
        assert abs(ray.arrival[0] - ray.arrival[1]) < 1e-4
        assert abs(ray.loss[0] - ray.loss[1]) < 0.06
    most = max(ray.surface + ray.bottom for ray in ours)
    alone = [ray for ray in rays if np.isnan(ray.delay[0]) and ray.surface + ray.bottom < most]
    assert alone == []


def test_only_rays_that_are_alike_are_pairs_and_the_nearest_first():
    def ours(launch):
        return SimpleNamespace(family="direct", event=[], time=[0.02], elevation=[launch, 0.0], transmission_loss=30.0)

    def theirs(delay, launch):
        none, one = np.zeros(1, int), np.ones(1)
        return BellhopArrivals(
            55e3, 16.0, 6.0, 30.0, delay * one, 30.0 * one, 0 * one, launch * one, 0 * one, none, none
        )

    rays = paired([ours(0.0), ours(0.02)], theirs(0.02, 0.021))
    assert [ray.launch[1] for ray in rays if ray.launch[0] == 0.02] == [0.021] and len(rays) == 2
    for other in (theirs(0.021, 0.0), theirs(0.02, 0.1)):
        assert sorted(ray.family for ray in paired([ours(0.0)], other)) == ["Bellhop alone", "direct"]


ENV = """'A title, with: an apostrophe''s comma'
100.0 /
1 ! media
'SVF' /
51  0.0  60.0
  0.0  1.5200D3 0.0 1.0 0 0
 20.0, 1510.0 /
 40.0 /
 60.0 1505.0 /
'A~' 0.0
 60.0 1600.0 200.0 1.8 0.5 0.0 /
"""


def test_an_environment_is_read_by_the_rules_of_fortran(tmp_path):
    file = tmp_path / "a.env"
    file.write_text(ENV)
    found = profile_of(Cast(path=str(file)))
    assert found.depth.tolist() == [0.0, 20.0, 40.0, 60.0]
    assert found.speed.tolist() == [1520.0, 1510.0, 1510.0, 1505.0]  # what a `/` leaves out is as before
    loss = 0.5e-3 * 100.0 / (20 / np.log(10)) * 1600.0 / (2 * np.pi * 100.0)  # 0.5 dB/(m kHz)
    assert "by a spline" in found.notes[0]
    assert found.notes[1] == (
        f"the environment's depth is 60 m in the file, the reflection of its bottom {{kind: fluid, density_ratio: 1.8, "
        f"speed_ratio: {1600 / 1505:.6g}, loss_tangent: {loss:.4g}}}, without its shear waves of 200 m/s; its "
        "bathymetry, a.bty, can be given as the `relief`"
    )


def test_a_loss_in_a_unit_that_is_not_known_is_not_said(tmp_path):
    file = tmp_path / "a.env"
    file.write_text(ENV.replace("'SVF'", "'SVm'"))
    note = profile_of(Cast(path=str(file))).notes[1]
    assert "its loss (unit 'm') is not read" in note and "loss_tangent" not in note


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("'SVF'", "'HVF'", 4, "a sound speed that varies in three dimensions"),
        ("'SVF'", "'AVF'", 4, "an analytic sound speed (option 'A') is not supported"),
        ("'SVF'", "'SVF ~'", 4, "an altimetry file (option '~') is not supported"),
        ("'SVF'", "'XVF'", 4, "option 'X' is no way of Bellhop's to interpolate"),
        ("1 ! media", "3", 3, "3 media: layers under the water are not supported"),
        (" 20.0, 1510.0", " x 1510.0", 7, "'x' is not a number"),
        (" 20.0, 1510.0", " 20.0, nan", 7, "'nan' is not a finite number"),
        ("1 ! media", "1d999", 3, "'1d999' is not a finite number"),
        (" 40.0 /", " 10.0" + 5000 * " " + "'", 9, "the node at 10 m is not below the one before"),  # over at once
        (" 40.0 /", " 10.0 /", 8, "the node at 10 m is not below the one before"),
        (" 60.0 1505.0", " 70.0 1505.0", 9, "the node at 70 m is below the bottom, 60 m"),
        ("51  0.0  60.0", "51 /", 5, "has 1 values where a Bellhop environment has 3 or more"),
    ],
)
def test_what_is_not_supported_is_named_in_one_line(tmp_path, old, new, line, said):
    file = tmp_path / "a.env"
    file.write_text(ENV.replace(old, new, 1))
    with pytest.raises(CastError) as refused:
        profile_of(Cast(path=str(file)))
    assert str(refused.value).startswith(f"{file}, line {line}: ") and said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_cut_environment_and_profiles_over_range_are_refused(tmp_path):
    file = tmp_path / "a.env"
    file.write_text(ENV.partition(" 40.0")[0])
    with pytest.raises(CastError, match=r"ends where more of a Bellhop environment must follow"):
        profile_of(Cast(path=str(file)))
    file.write_text("2\n0.0 10.0\n1500 1501\n1510 1511\n")
    with pytest.raises(CastError, match=r"is a \.ssp of Bellhop"):
        profile_of(Cast(path=str(file)))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text[: len(text) // 2], "is cut off"),
        (lambda text: text.replace("'2D'", "'3D'"), "is of BELLHOP3D"),
        (lambda text: text.replace("          21\n", "  1e9\n"), "is cut off"),
        (lambda text: text.replace("0.122970447", "nan"), "are of no arrival"),
        (lambda text: text.replace("0.122970447", "x"), "is no file of arrivals"),
        (lambda text: "", "is cut off"),
        (lambda text: text.replace("16.0000000", "12.0"), "has no source and receiver where a snap and the array are"),
        (lambda text: text.replace("16.0000000", "16.2"), "has no source and receiver where a snap and the array are"),
    ],
)
def test_broken_arrivals_are_refused_in_one_line(tmp_path, change, said):
    file = tmp_path / "a.arr"
    file.write_text(change((HERE / "uniform.arr").read_text()))
    with pytest.raises(ArrivalsError) as refused:
        compare_arrivals(plan_of("uniform"), 0, file)
    assert said in str(refused.value) and str(file) in str(refused.value) and "\n" not in str(refused.value)


def test_older_arrivals_are_read_too(tmp_path):
    """Before `'2D'`: the numbers of depths and ranges in the first line, then the depths and ranges."""
    text = (HERE / "uniform.arr").read_text().split("\n")
    file = tmp_path / "a.arr"
    file.write_text("\n".join(["55000.0 1 1 1", "16.0", "6.0", "30.0", *text[5:]]))
    old, new = (read_arrivals(path).at(16.0, 6.0, 30.0) for path in (file, HERE / "uniform.arr"))
    assert np.array_equal(old.delay, new.delay) and np.array_equal(old.bottom, new.bottom)


def test_the_command_writes_environments_and_tables_of_reflection(tmp_path, capsys):
    table = "{kind: table, grazing: [0 deg, 30 deg, 90 deg], loss: [0, 3, 20], phase: [180 deg, 90 deg, 0]}"
    sets = [f"scene.world.environment.bottom={{reflection: {table}, rms_height: 2 cm}}"]
    given = ["export", str(HERE / "uniform.yaml"), "--to", "bellhop", "--out", str(tmp_path), "--set", sets[0]]
    assert run(app, given) == 0
    printed = capsys.readouterr().out
    assert run(app, given) == 2 and "is not an empty folder" in capsys.readouterr().err
    assert "uniform_frame0_snap0.brc" in printed and "a roughness of 0.02 m rms takes nothing" in printed
    angle, modulus, phase = np.loadtxt(tmp_path / "uniform_frame0_snap0.brc", skiprows=1).T
    np.testing.assert_allclose(-20 * np.log10(modulus), np.interp(angle, [0, 30, 90], [0, 3, 20]), atol=1e-6)
    np.testing.assert_allclose(phase, np.interp(angle, [0, 30, 90], [180, 90, 0]), atol=1e-6)
    assert "'F' 0.0" in (tmp_path / "uniform_frame0_snap0.env").read_text()


@pytest.mark.parametrize(
    "given", [("uniform.yaml", "--to", "bellhop", "--relative-to", "sonar"), ("a.zarr", "--set", "seed=2")]
)
def test_options_of_the_other_export_are_refused(tmp_path, capsys, given):
    assert run(app, ["export", str(HERE / given[0]), *given[1:], "--out", str(tmp_path / "x")]) == 2
    assert "is for" in capsys.readouterr().err and not list(tmp_path.iterdir())


GULF = "'Gulf'\n1000.0\n1\n'QVW'\n0 0.0 50.0\n0.0 1500.0 /\n20.0 1500.0 /\n50.0 1500.0 /\n'A' 0.0\n50.0 1800.0 /\n"


def test_of_profiles_over_range_one_is_taken_by_its_number(tmp_path):
    """Speeds are those of the .ssp beside the environment, not the environment's own; a change of it is seen."""
    file, beside = tmp_path / "gulf.env", tmp_path / "gulf.ssp"
    file.write_text(GULF)
    with pytest.raises(CastError, match=r"gulf\.ssp: no such file"):
        profile_of(Cast(path=str(file)))
    beside.write_text("2\n0.0 12.5\n1536 1530\n1506,1507\n1503 1501.5 ! m/s\n")
    for number, speeds, off in ((0, [1536.0, 1506.0, 1503.0], 6), (1, [1530.0, 1507.0, 1501.5], 6)):
        profile = profile_of(Cast(path=str(file), profile=number))
        assert profile.depth.tolist() == [0.0, 20.0, 50.0] and profile.speed.tolist() == speeds
        assert (
            f"profile {number} of 2, at {12.5 * number:g} km" in profile.notes[0] and f"{off} m/s" in profile.notes[0]
        )
    digests = set()
    for cell in ("1536", "1537"):
        beside.write_text(f"2\n0.0 12.5\n{cell} 1530\n1506 1507\n1503 1501.5\n")
        recipe = load(HERE / "layers.yaml", [f"scene.world.environment.sound_speed={{kind: cast, path: {file}}}"])
        digests.add(recipe.digest)
        assert profile_of(recipe.scene.world.environment.sound_speed).speed[0] == float(cell)
    assert len(digests) == 2
    for cells, message in (
        ("2\n0.0\n1 2\n", r"gulf\.ssp: has 1 rows of sound speeds, its environment has 3 depths"),
        ("2\n0.0 12.5\n1536\n1506 1507\n1503 1501.5\n", r"gulf\.ssp, line 3: has 1 numbers, not 2"),
        ("2\n0.0 12.5\n1536 x\n1506 1507\n1503 1501.5\n", r"gulf\.ssp, line 3: 'x' is not a number"),
    ):
        beside.write_text(cells)
        with pytest.raises(CastError, match=message):
            profile_of(Cast(path=str(file)))
    beside.write_text("2\n0.0 12.5\n1536 1530\n1506 1507\n")
    with pytest.raises(CastError, match=r"give the \.env beside it"):
        profile_of(Cast(path=str(beside)))


def test_a_bathymetry_is_a_surface_over_its_ranges(tmp_path):
    """A line of depths is alike across; a grid with axes by their ends is the same as with axes in full."""
    line, grid = tmp_path / "line.bty", tmp_path / "grid.bty"
    line.write_text("'L'\n3\n0.0 20\n0.010 15\n0.03 20\n")
    vertices, faces = read_surface(line)
    along = np.unique(vertices[:, [0, 2]], axis=0)
    assert along.tolist() == [[0.0, -20.0], [10.0, -15.0], [30.0, -20.0]] and len(faces) == 4
    assert set(vertices[:, 1]) == {-15.0, 15.0}
    told = []
    for relief in ("null", f"{{shape: {{path: {line}, offset: [0, 0, 20], edge: 2 m}}}}"):
        told.append(write_bellhop(plan_of("uniform", f"scene.world.relief={relief}"), 0, tmp_path, "x")[1])
    assert set(told[1]) - set(told[0]) == {"the bottom is flat: the relief is left out"}
    surfaces = []
    for axis in ("0 0.010 0.020", "0 0.020 /"):
        grid.write_text(f"'R'\n3\n{axis}\n2\n-0.005 0.005\n20 15 20\n20 14 20\n")
        surfaces.append(read_surface(grid))
    assert all(np.array_equal(*pair) for pair in zip(*surfaces, strict=True))
    assert surfaces[0][0][4].tolist() == [10.0, 5.0, -14.0]  # x, y, z of the second row's middle
    for text, message in (
        ("'L'\n3\n0 20\n0.01 15\n", "line 3|cut off"),
        ("'R'\n2\n0 1\n2\n0 1\n20 20\n", "1 rows of depths, not 2"),
        ("X\n2\n0 20\n1 20\n", "line 1: is no option"),
        ("'L'\n2\n0 20\n0 20\n", "neither only rise nor only fall"),
        ("'L'\n2\n0 20\n1 inf\n", "line 4: 'inf' is not a finite number"),
    ):
        line.write_text(text)
        with pytest.raises(MeshError, match=message):
            read_surface(line)
