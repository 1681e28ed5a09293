"""Motion along tracks in files: what was sampled comes back, in the right place on the Earth, without jumps."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

import sonarsynth as ss
from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.geometry import rotation_matrix
from sonarsynth.geometry.motion import Circle, Line, RecordedTrack, Track, pose, spin, velocity
from sonarsynth.geometry.recorded_track import east_north
from sonarsynth.geometry.track_files import TrackError
from sonarsynth.recipe.reading import load, loads

TIMES = np.array([0.0, 1.0, 2.5, 3.0, 7.0, 9.0])
WITHIN = (0.0, 0.3, 2.6, 5.0, 8.99, 9.0)


def written(path, names, *columns):
    rows = zip(*(np.broadcast_to(c, np.shape(columns[0])).tolist() for c in columns), strict=True)
    path.write_text("\n".join([names, *(",".join(map(repr, row)) for row in rows), ""]))
    return str(path)


def gpx(points, extra=""):
    clock = "<time>2024-05-01T10:00:{:09.6f}Z</time>"
    body = "".join(f'<trkpt lat="{a!r}" lon="{b!r}">{extra}{clock.format(t)}</trkpt>' for t, a, b in points)
    space = "http" + "://www.topografix.com/GPX/1/1"
    return f'<?xml version="1.0"?><gpx xmlns="{space}"><trk><trkseg>{body}</trkseg></trk></gpx>'


def test_samples_of_uniform_motion_give_that_motion_and_velocity(tmp_path):
    start, v = np.array([10.0, 3.0, -6.0]), np.array([1.2, -0.7, 0.1])
    x, y, z = (start + TIMES[:, None] * v).T
    track = RecordedTrack(
        path=written(tmp_path / "a.csv", "Time (s);X;Y;Depth (cm)".replace(";", ","), TIMES, x, y, -100 * z)
    )
    line = Line(start=tuple(start), stop=tuple(start + 9.0 * v), duration=9.0)
    for t in (-0.5, *WITHIN, 9.7):  # straight on beyond the ends, while sound is under way
        ours, true = pose(track, t), pose(line, t)
        np.testing.assert_allclose(ours.position, true.position, atol=1e-12)
        np.testing.assert_allclose(ours.orientation, true.orientation, atol=1e-12)
        np.testing.assert_allclose(velocity(track, t), v, atol=1e-12)
        np.testing.assert_allclose(spin(track, t), 0.0, atol=1e-12)
    assert not Track(pose(track, 1.0), velocity(track, 1.0), track, 1.0).still


def test_samples_of_a_circle_give_it_to_the_third_order(tmp_path):
    circle = Circle(centre=(0.0, 0.0, -5.0), radius=20.0, speed=2.0)
    worst = []
    for step in (1.0, 0.5):
        t = np.arange(0.0, 40.0 + step, step)
        x, y, z = np.array([pose(circle, a).position for a in t]).T
        track = RecordedTrack(path=written(tmp_path / "a.csv", "t,x,y,z", t, x, y, z))
        some = np.linspace(5.0, 35.0, 60)
        place = max(np.linalg.norm(pose(track, a).position - pose(circle, a).position) for a in some)
        speed = max(np.linalg.norm(velocity(track, a) - velocity(circle, a)) for a in some)
        turn = max(np.linalg.norm(spin(track, a) - spin(circle, a)) for a in some)
        ahead = max(np.abs(pose(track, a).rotation - pose(circle, a).rotation).max() for a in some)
        worst.append(np.array([place, speed, turn, ahead]))
    assert (worst[0] < [7e-3, 4e-2, 4e-2, 3e-2]).all()  # m, m/s, rad/s, rad: points 2 m apart
    assert worst[1][0] < 0.35 * worst[0][0]


def test_velocity_is_continuous_and_the_derivative_of_the_place(tmp_path):
    random = np.random.default_rng(3)
    t = np.cumsum(random.uniform(0.5, 2.0, 12))
    columns = [*random.normal(0, 3, (2, 12)), random.uniform(3, 9, 12), *random.uniform(-20, 20, (3, 12))]
    track = RecordedTrack(path=written(tmp_path / "a.csv", "t,x,y,depth,heading,pitch,roll", t, *columns))
    t = t - t[0]
    h = 1e-6
    for at in t[1:-1]:
        np.testing.assert_allclose(velocity(track, at - 1e-9), velocity(track, at + 1e-9), atol=1e-6)
        np.testing.assert_allclose(spin(track, at - 1e-9), spin(track, at + 1e-9), atol=1e-6)
    for at in 0.5 * (t[1:] + t[:-1]):
        before, after = pose(track, at - h), pose(track, at + h)
        np.testing.assert_allclose(velocity(track, at), (after.position - before.position) / (2 * h), atol=1e-7)
        turning = (after.rotation - before.rotation) / (2 * h) @ rotation_matrix(pose(track, at).orientation).T
        np.testing.assert_allclose(spin(track, at), [turning[2, 1], turning[0, 2], turning[1, 0]], atol=1e-7)


def test_angles_turn_the_short_way_and_a_body_that_stands_keeps_its_course(tmp_path):
    path = written(
        tmp_path / "a.csv", "t,x,y,z,heading", [0.0, 1.0, 2.0], 0.0, 0.0, -3.0, np.array([350.0, 10.0, 30.0])
    )
    ahead = pose(RecordedTrack(path=path), 0.5).turn_to_world([1.0, 0.0, 0.0])
    assert np.degrees(np.arctan2(ahead[0], ahead[1])) == pytest.approx(0.0, abs=2.0)
    x = np.array([0.0, 1.0, 2.0, 2.0, 2.0, 2.0, 2.0])
    path = written(tmp_path / "b.csv", "t,x,y,z", np.arange(7.0), x, -x, -3.0)
    for t in (0.5, 4.5, 6.0):
        np.testing.assert_allclose(
            pose(RecordedTrack(path=path), t).turn_to_world([1.0, 0.0, 0.0]), [0.5**0.5, -(0.5**0.5), 0.0], atol=1e-9
        )


def test_a_body_stands_between_two_points_at_one_place(tmp_path):
    """It swung away from there and back, by a ninth of the way that it had come or had to go."""
    x, y = np.array([[0.0, 0.0, 20.0, 20.0, 20.0, 20.0], [3.0, 3.0, 3.0, 3.0, 23.0, 23.0]])
    track = RecordedTrack(path=written(tmp_path / "a.csv", "t,x,y,z", np.arange(0.0, 60.0, 10.0), x, y, -5.0 + 0.0 * x))
    for begin, place, ahead in (
        (-3.0, (0.0, 3.0), (1.0, 0.0)),
        (20.0, (20.0, 3.0), None),
        (40.0, (20.0, 23.0), (0, 1)),
    ):
        for late in (0.0, 3.0, 7.0, 10.0):
            there = pose(track, begin + late)
            np.testing.assert_allclose(there.position, (*place, -5.0), atol=1e-12)
            np.testing.assert_allclose(velocity(track, begin + late), 0.0, atol=1e-12)
            if ahead is not None:
                np.testing.assert_allclose(there.turn_to_world(np.array([1.0, 0.0, 0.0])), (*ahead, 0.0), atol=1e-12)


def test_places_on_the_earth_are_those_of_the_radii_of_curvature():
    """Along a meridian by its arc (a quadrature), along a parallel by its chord, beside the bending of the plane."""
    a, e2 = 6378137.0, 0.00669437999014
    for phi, lam in np.radians([(1.3, 103.8), (-36.0, 174.0), (69.0, -20.0)]):
        origin = (phi, lam)
        for metres in (10.0, 1000.0, 10000.0):
            step = metres / 6.37e6
            arc = quad(lambda p: a * (1 - e2) / (1 - e2 * np.sin(p) ** 2) ** 1.5, phi, phi + step, epsabs=1e-9)[0]
            east, north = east_north(np.array(phi + step), np.array(lam), origin)
            assert abs(east) < 1e-8 and north == pytest.approx(arc, abs=1e-8 + metres**3 / 6.3e6**2 / 5)
            flat = a / np.sqrt(1 - e2 * np.sin(phi) ** 2) * np.cos(phi)
            east, north = east_north(np.array(phi), np.array(lam + step), origin)
            assert east == pytest.approx(flat * np.sin(step), abs=1e-8)
            assert north == pytest.approx(flat * np.sin(phi) * (1 - np.cos(step)), abs=1e-8)


def test_csv_and_gpx_of_one_way_are_one_motion(tmp_path):
    t = np.array([5.0, 6.0, 7.5])
    lat, lon = 1.2 + 1e-5 * t, 103.8 - 2e-5 * t
    (tmp_path / "a.gpx").write_text(gpx(zip(t.tolist(), lat.tolist(), lon.tolist(), strict=True), "<ele>-4.0</ele>"))
    table = written(tmp_path / "a.csv", "time,Latitude (deg),lon,depth", t, lat, lon, 4.0)
    dated = tmp_path / "b.csv"
    rows = [
        f"2024-05-01T10:00:{a:04.1f}+00:00\t{b!r}\t{c!r}\t4.0"
        for a, b, c in zip(t, lat.tolist(), lon.tolist(), strict=True)
    ]
    dated.write_text("\n".join(["# a ship", "utc\tlat\tlon\tdepth (m)", *rows]))
    found = [RecordedTrack(path=str(p), offset=(5.0, 0.0, 0.0)) for p in (tmp_path / "a.gpx", table, dated)]
    for at in (0.0, 0.7, 2.5):
        places = [pose(one, at).position for one in found]
        np.testing.assert_allclose(places[1:], [places[0]] * 2, atol=1e-7)
    np.testing.assert_allclose(pose(found[0], 0.0).position, [5.0, 0.0, -4.0], atol=1e-9)
    late = RecordedTrack(path=table, start=6.0, origin=tuple(np.radians([1.2, 103.8])), depth=2.0)
    assert pose(late, 0.0).position[2] == -2.0
    assert pose(late, -1.0).position[1] == pytest.approx(5e-5 * 110_574, rel=1e-3)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t,x,y,z\n0,1,2,-3\n1,2,x,-3\n", "line 3, column 'y': 'x' is not a number"),
        ("t,x,y,z\n0,1,2,-3\n0,2,2,-3\n", "line 3: is not later than the point before it"),
        ("t,x,y,z\n0,1,2,-3\n", "a track needs two points, and there is 1"),
        ("t,x,y\n0,1,2\n1,2,2\n", "has no column of depth or z: give the `depth`"),
        ("x,y,z\n0,1,2\n", "line 1: no column of time among 'x', 'y', 'z'"),
        ("t,x,z\n0,1,2\n", "line 1: no columns of x and y, or of latitude and longitude"),
        ("t,lat,lon,z\n0,91,0,-1\n1,0,0,-1\n", "line 2, column 'lat': 91 is no latitude in degrees"),
        ("t,lat,lon,z\n0,1,0,-1\n1,5,0,-1\n", "km from its origin"),
        ("t,x,y,z\n0,1,2,-3\n1,5,1,2,-3\n", "line 3: has 5 values in 4 columns"),
        ("t,x,east [mm],y,z\n0,1,1,2,-3\n", "line 1: two columns of x, 'x' and 'east [mm]': leave out one"),
        ("t,x,y,lat,lon,z\n0,1,2,1.2,103.8,-3\n", "by 'x' and 'y' and also 'lat' and 'lon': leave out one pair"),
        ("t,x (furlong),y,z\n0,1,2,-3\n", "line 1, column 'x (furlong)': unit 'furlong' is not one of m, km"),
        ("t,x,y,z\n0,1,2,-3\nsoon,2,2,-3\n", "'soon' is not a number or a date"),
        ("t,x,y,z\n0,1,2,-3\n1,1e300,2,-3\n", "is not finite, or too large"),
        ("", "is empty"),
        ("\udcff", "is neither CSV nor GPX"),
        ("<gpx/>", "has no track"),
        ("<kml/>", "is no GPX file"),
        ('<!DOCTYPE gpx [<!ENTITY a "b">]><gpx/>', "declares a document type or entities"),
        ('<gpx><trk><trkpt lat="1" lon="2"/></trk></gpx>', "point 1: has no time"),
        ('<gpx><trk><trkpt lon="2"><time>2024-05-01</time></trkpt></trk></gpx>', "point 1, lat: '' is not a number"),
        ("<gpx><trk>", "is not XML"),
    ],
)
def test_a_bad_track_is_refused_in_one_line(tmp_path, text, said):
    file = tmp_path / "a.csv"
    file.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(TrackError) as refused:
        pose(RecordedTrack(path=str(file)), 0.0)
    assert said in str(refused.value) and str(file) in str(refused.value) and "\n" not in str(refused.value)


RECIPE = """\
title: a track
scene:
  world:
    environment: {depth: 12 m, sound_speed: {kind: isovelocity, speed: 1540}}
    targets:
      - {name: body, shape: {kind: sphere, radius: 0.3 m}, motion: {kind: track, path: way.csv}}
    sources: [{position: [12, 8], kind: snapping_shrimp}]
  sonar: {array: {kind: planar_lattice, columns: 5, rows: 4, pitch: 5 cm}}
  trajectory: {frames: 3, interval: 0.5}
"""


def test_a_recipe_stamps_its_track_and_refuses_frames_outside_it(tmp_path, capsys):
    recipe = tmp_path / "a.yaml"
    recipe.write_text(RECIPE)
    way = tmp_path / "way.csv"
    written(way, "t,x,y,z", [0.0, 1.0], np.array([10.0, 11.0]), 1.0, -5.0)
    made = load(recipe)
    before = made.digest
    assert np.allclose(made.frame(2)[1].moment.bodies[0].velocity, [1.0, 0.0, 0.0])
    assert loads(ss.dump(made), resolved=True) == made
    written(way, "t,x,y,z", [0.0, 0.9], np.array([10.0, 11.0]), 1.0, -5.0)
    assert load(recipe).digest != before
    assert run(app, ["plan", str(recipe)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "a.yaml:6: scene.world.targets.0.motion: " in said
    assert "is from 0 to 0.9 s of the motions, but frame 2 of a sequence is at 1 s (see `start`)" in said
    way.unlink()
    assert run(app, ["plan", str(recipe)]) == 2
    assert "no such file: way.csv" in capsys.readouterr().err
