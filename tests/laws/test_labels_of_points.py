"""Labels of points: whose echo each is, by the paths that its beam hears at its delay."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest
import trimesh
from scipy.optimize import minimize

from sonarsynth.casting.surface_distances import surface_distances
from sonarsynth.conventions import azimuth_elevation, direction
from sonarsynth.geometry import Pose
from sonarsynth.geometry.motion import ConstantVelocity, Still
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.labels import Band, SonarTiming, label_points
from sonarsynth.labels.attribution_of_points import attribution
from sonarsynth.labels.point_kernels import loud_at
from sonarsynth.pipeline import trace_frame
from sonarsynth.pipeline.labelling import band_of
from sonarsynth.planning import plan
from sonarsynth.products import FAMILIES, ORIGINS, Arrivals, PointCloud, PointLabels
from sonarsynth.propagation import AutoTracing
from sonarsynth.receiver import POINT, BandPass, BeamGrid, PlanarLattice
from sonarsynth.receiver import Band as ReceiverBand
from sonarsynth.receiver import elements as elements_of
from sonarsynth.receiver.hydrophones import PositionTable
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import Frame
from sonarsynth.scattering import Kirchhoff
from sonarsynth.signals import GriddedSynthesis
from sonarsynth.signals.filtered_pulse import pulse_spectrum
from sonarsynth.signals.segments import Reception
from sonarsynth.sources.shrimp import SnappingShrimp
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Box, Sphere
from sonarsynth.targets.target import Target
from tests.scenes import point_scene, remus

ARRAY = PlanarLattice(columns=12, rows=10, pitch=0.05)


class Made(NamedTuple):
    """A frame, and what labels need of it."""

    plan: Any
    frame: Frame
    arrivals: Arrivals
    band: Band
    listening: SonarTiming


def made(recipe: Recipe, focus: float | None = 20.0, snap: int = 0) -> Made:
    resolved = plan(recipe)
    traced = trace_frame(resolved, 0)
    arrivals, sonar = traced.arrivals, resolved.scene.sonar
    clock = arrivals.delay[arrivals.direct & (arrivals.snap == snap)].min()
    late = np.zeros(len(traced.frame.moment.snaps))  # the clock is that of their time 0
    listening = SonarTiming(
        resolved.elements, sonar.assumed_sound_speed, focus, float(clock), traced.frame.sonar_track, late
    )
    return Made(resolved, traced.frame, arrivals, band_of(resolved, traced.frame.moment.snaps), listening)


def several(**more: Any) -> Recipe:
    """Two bodies and two snaps at once in shallow water, with every path of one bounce on the way to the array."""
    base = remus(1, array=ARRAY, beams=BeamGrid(elevation_span=np.deg2rad(120), azimuth_span=np.deg2rad(90)))
    still = [Still(position=at, heading=0.7) for at in ((15.0, 2.0, -4.0), (14.0, -3.0, -6.0))]
    targets = (
        Target(name="ball", shape=Sphere(radius=0.3, edge=0.1), motion=still[0]),
        Target(name="crate", shape=Box(size=(0.8, 0.5, 0.4), edge=0.1), motion=still[1]),
    )
    loud = SnappingShrimp(position=(9.0, 5.0), source_level=200.0)
    shrimp = (loud, SnappingShrimp(position=(10.0, -6.0), snap_times=(3e-3,)))
    scene = base.scene
    physics = replace(scene.physics, tracing=AutoTracing(bounces=1))
    world = replace(scene.world, targets=targets, sources=shrimp)
    return replace(base, scene=replace(scene, world=world, physics=physics, **more))


@pytest.fixture(scope="module")
def crowd() -> Made:
    return made(several())


def labels_at(case: Made, beam: np.ndarray, delay: np.ndarray, energy: float = 1e-300) -> list[dict[str, Any]]:
    """Labels of points in beams (point, xyz) at delays (point,) s at the array centre, 20 m away, one at a time."""
    rows = []
    for u, t in zip(beam, delay, strict=True):
        azimuth, elevation = (np.atleast_1d(a) for a in azimuth_elevation(u))
        far, late = np.full(1, 20.0, np.float32), np.full(1, t - case.listening.clock)
        cloud = PointCloud(20.0 * u[None], far, far, azimuth, far, elevation, far, late, np.full(1, energy), far)
        arrivals, moment = case.arrivals, case.frame.moment
        found: PointLabels = label_points(cloud, arrivals, case.band, moment, case.listening)
        rows.append({name: value[0] for name, value in vars(found).items()})
    return rows


def held(case: Made, beam: np.ndarray, delay: np.ndarray) -> float:
    """Energy that all paths together bring a beam at a delay."""
    clock = case.listening.clock
    return float(attribution(case.arrivals, case.band, case.listening, beam, delay - clock, np.ones(1)).energy.sum())


def groups(arrivals: Arrivals) -> dict[tuple[int, ...], np.ndarray]:
    """Paths of each target and snap, of one way to the array and one to the target."""
    keys = np.stack([arrivals.target, arrivals.snap, arrivals.arrives_by, arrivals.lit_by], axis=1)
    return {tuple(key): np.flatnonzero((keys == key).all(axis=1)) for key in np.unique(keys, axis=0).tolist()}


def heard_alone(case: Made, beam: np.ndarray, delay: np.ndarray) -> tuple[list[tuple[int, ...]], np.ndarray]:
    """Power (point, group) of each group alone: signals, spherical beams, the pulse taken out, at the delay."""
    sonar, c = case.plan.scene.sonar, case.listening.sound_speed
    snaps, fs, samples = case.frame.moment.snaps, sonar.sampling_frequency, 8192
    start = float(delay.min()) - 0.01
    frequency, wave = pulse_spectrum(snaps[0].waveform, sonar.antialias, fs, samples)
    inside = (frequency > sonar.band.low) & (frequency < sonar.band.high)
    f, wave = frequency[inside], wave[inside]
    taper = np.sin(np.pi * (f - sonar.band.low) / (sonar.band.high - sonar.band.low)) ** 2
    matched = taper * wave.conj() / (np.abs(wave) ** 2 + 0.03 * np.abs(wave).max() ** 2)
    q, focus = case.plan.elements.position, case.listening.focus
    late = (np.linalg.norm(focus * beam[:, None] - q, axis=2) - focus) / c  # (beam, sensor)
    steering = np.exp(2j * np.pi * f * late[..., None]) / len(q)
    found, power = groups(case.arrivals), []
    for rows in found.values():
        alone = case.arrivals.select(rows)
        absorption = case.plan.absorption
        p = (
            GriddedSynthesis()
            .signals(alone, snaps, Reception(case.plan.elements, sonar, absorption, start, samples))
            .pressure
        )
        spectra = np.fft.rfft(p.astype(float), axis=1)[:, inside]
        beams = np.einsum("bqf,qf->bf", steering, spectra)
        power.append(np.abs((beams * matched * np.exp(2j * np.pi * f * (delay[:, None] - start))).sum(axis=1)) ** 2)
    return list(found), np.array(power).T


def test_what_each_group_brings_is_what_its_signals_alone_have_there(crowd: Made) -> None:
    """By signals of each group alone: the loudest where it stands out by 3 dB, powers within 20 dB to 1 dB, medians."""
    random, a = np.random.default_rng(5), crowd.arrivals
    echoes = np.flatnonzero(~a.direct)
    some = random.choice(echoes, 32, p=np.abs(a.amplitude[echoes]) / np.abs(a.amplitude[echoes]).sum())
    beam = a.direction[some] + random.normal(size=(32, 3)) * np.where(np.arange(32) % 2, 0.01, 0.15)[:, None]
    beam[:, 0] = np.abs(beam[:, 0])
    beam /= np.linalg.norm(beam, axis=1, keepdims=True)
    delay = a.delay[some] + random.normal(size=32) * 1e-5
    names, exact = heard_alone(crowd, beam, delay)
    most = np.full(32, np.inf)  # what a beam holds bounds nothing
    found = attribution(a, crowd.band, crowd.listening, beam, delay - crowd.listening.clock, most)
    ours = [tuple(row) for row in np.stack([found.target, found.snap, found.family, found.lit_by], axis=1).tolist()]
    exact = exact[:, [names.index(name) for name in ours]]
    order = np.sort(exact, axis=1)
    clear = order[:, -1] > 2.0 * order[:, -2]
    assert clear.sum() > 20 and len(set(exact.argmax(axis=1)[clear].tolist())) > 4
    assert np.array_equal(found.owner[clear], exact.argmax(axis=1)[clear])
    near = exact > 0.01 * exact.max(axis=1, keepdims=True)
    apart = 10.0 * np.log10(found.power[near] / exact[near])
    assert np.median(np.abs(apart - np.median(apart))) < 1.0


def test_a_beam_holds_the_energy_of_the_signal_that_a_path_brings(crowd: Made) -> None:
    """Of each snap as loud as it is: its direct pulse alone, at one hydrophone, whatever the level of the other."""
    sonar = crowd.plan.scene.sonar
    for row in np.flatnonzero(crowd.arrivals.direct & (crowd.arrivals.surface + crowd.arrivals.bottom == 0)):
        alone, snaps = crowd.arrivals.select(np.array([row])), crowd.frame.moment.snaps
        start, fs = alone.delay[0] - 0.02, sonar.sampling_frequency
        signals = GriddedSynthesis().signals(alone, snaps, Reception(POINT, sonar, crowd.plan.absorption, start, 8192))
        f, wave = np.fft.rfftfreq(8192, 1.0 / fs), np.fft.rfft(signals.pressure[0].astype(float)) / fs
        energy = 2.0 * np.sum(np.abs(wave[(f > sonar.band.low) & (f < sonar.band.high)]) ** 2) * fs / 8192
        case = crowd._replace(arrivals=alone, listening=replace(crowd.listening, elements=POINT))
        found = attribution(
            alone, case.band, case.listening, alone.direction, alone.delay - case.listening.clock, np.full(1, np.inf)
        )
        assert found.energy.sum() == pytest.approx(energy, rel=0.02)


def test_a_table_of_the_pattern_says_what_the_sensors_say(crowd: Made) -> None:
    """The same array as a table of positions is heard sensor by sensor, in and out of focus."""
    places = PositionTable(positions=tuple(map(tuple, crowd.plan.elements.position.tolist())), face=0.05)
    a, random = crowd.arrivals, np.random.default_rng(1)
    some = random.choice(len(a.delay), 40)
    beam, most = a.direction[some], np.full(40, np.inf)
    for focus in (20.0, 4.0):
        listening = replace(crowd.listening, focus=focus)
        two = [
            attribution(a, crowd.band, one, beam, a.delay[some] - one.clock, most)
            for one in (listening, replace(listening, elements=elements_of(places)))
        ]
        loud = two[1].power > 1e-3 * two[1].power.max(axis=1, keepdims=True)
        apart = np.abs(10.0 * np.log10(two[0].power[loud] / two[1].power[loud]))
        assert np.median(apart) < (0.3 if focus == 20.0 else 1.0)
        assert (two[0].owner == two[1].owner).mean() > 0.95


def test_a_point_on_a_path_is_of_its_target_snap_and_way(crowd: Made) -> None:
    """By the loudest path of each group: ghosts come by surface and bottom, from where the images are."""
    a, seen = crowd.arrivals, set()
    for (target, snap, way, lit), paths in groups(a).items():
        rows = paths[(a.target[paths] >= 0) & (a.direction[paths, 0] > 0.2)]
        for loudest in rows[np.argsort(-np.abs(a.amplitude[rows]))[:10]]:
            (label,) = labels_at(crowd, a.direction[[loudest]], a.delay[[loudest]])
            if tuple(label[name] for name in ("target", "emission", "family", "lit_by")) == (target, snap, way, lit):
                break  # else another group is louder there: how often is asked below
        else:
            continue
        seen.add((target, snap, way))
        assert ORIGINS[label["origin"]] == "main lobe"
        body = crowd.frame.moment.bodies[target]
        centre = np.linalg.norm(body.pose.position - crowd.frame.sonar_pose.position)
        assert abs(label["true_range"] - centre) < 0.6
        if FAMILIES[way] == "surface":
            assert a.direction[loudest, 2] > 0.3
        if FAMILIES[way] == "bottom":
            assert a.direction[loudest, 2] < -0.2
    direct = {key[:2] for key in seen if key[2] == 0}
    assert {key[0] for key in direct} == {key[1] for key in direct} == {0, 1}
    assert {key[2] for key in seen} >= {0, 1, 2}


def test_the_snap_itself_is_no_target_and_what_no_path_brings_is_unexplained(crowd: Made) -> None:
    a = crowd.arrivals
    other = np.flatnonzero(a.direct & (a.snap == 1) & (a.surface + a.bottom == 0))
    energy = held(crowd, a.direction[other], a.delay[other])
    (label,) = labels_at(crowd, a.direction[other], a.delay[other], energy)
    assert ORIGINS[label["origin"]] == "snap itself"
    assert (label["target"], label["emission"], label["facet"]) == (-1, 1, -1) and np.isnan(label["true_range"])
    (label,) = labels_at(crowd, a.direction[other], a.delay.max(keepdims=True) + 5e-3, energy)
    assert ORIGINS[label["origin"]] == "unexplained"
    assert all(label[name] == -1 for name in ("target", "emission", "family", "lit_by", "facet"))
    assert np.isnan(label["true_range"]) and np.isnan(label["distance"])


def test_what_was_taken_out_explains_nothing(crowd: Made) -> None:
    """A beam that holds no more than the echoes bring has no direct pulse in it, wherever one would be."""
    a = crowd.arrivals
    first = np.flatnonzero(a.direct & (a.surface + a.bottom == 0) & (a.snap == 0))[0]
    echo = np.flatnonzero(~a.direct)[np.abs(a.amplitude[~a.direct]).argmax()]
    other = a.direct & (a.snap == 1)
    towards = np.where(other[:, None], a.direction[echo], a.direction)
    together = replace(a, delay=np.where(other, a.delay[echo], a.delay), direction=towards)
    case = crowd._replace(arrivals=together, listening=replace(crowd.listening, clock=float(a.delay[first])))
    whole = held(case, a.direction[[echo]], a.delay[[echo]])
    loud, faint = (labels_at(case, a.direction[[echo]], a.delay[[echo]], e)[0] for e in (whole, 1e-300))
    assert loud["target"] == -1 and ORIGINS[loud["origin"]] == "snap itself"
    assert faint["target"] == a.target[echo] and faint["emission"] == a.snap[echo]


@pytest.mark.parametrize(
    ("turn", "origin"), [(0.0, "main lobe"), (0.055, "side lobe"), (1.0, "grating lobe"), (-1.0, "grating lobe")]
)
def test_beams_beside_a_point_hear_it_by_the_lobes_of_the_array(turn: float, origin: str) -> None:
    """turn: of the sine between two grating lobes at the middle of the band; point hydrophones hear these as well."""
    array = PlanarLattice(columns=24, rows=20, pitch=0.05, face=0.0)
    case = made(point_scene((20.0, 0.0, -50.0), (12.0, 5.0, -60.0), array=array))
    a = case.arrivals
    echo = np.flatnonzero(~a.direct)[:1]
    u = a.direction[echo[0]].copy()
    u[1] += turn * 1500.0 / (55e3 * 0.05)
    u[0] = np.sqrt(1.0 - u[1] ** 2 - u[2] ** 2)
    (label,) = labels_at(case, u[None], a.delay[echo])
    assert (label["target"], ORIGINS[label["origin"]]) == (0, origin)


def test_a_target_behind_a_planar_array_is_a_mirror_image_in_front() -> None:
    case = made(point_scene((-18.0, 3.0, -49.0), (12.0, 5.0, -60.0), array=ARRAY))
    a = case.arrivals
    echo = np.flatnonzero(~a.direct)[:1]
    assert a.direction[echo[0], 0] < -0.9
    beam = a.direction[echo] * [-1.0, 1.0, 1.0]
    (label,) = labels_at(case, beam, a.delay[echo])
    assert (label["target"], ORIGINS[label["origin"]]) == (0, "mirror image")
    assert abs(label["true_range"] - np.linalg.norm([-18.0, 3.0, 1.0])) < 0.01
    assert (
        abs(label["distance"] - np.linalg.norm(20.0 * beam[0] - case.frame.sonar_pose.to_body([-18.0, 3.0, -49.0])))
        < 0.01
    )


def test_a_smooth_ball_in_a_narrow_band_is_where_it_glints() -> None:
    """By the shortest way over the sphere, 2 to 3 cm nearer than the mean of what echoes by its power."""
    radius = 0.2
    array, source, middle = (np.array(at) for at in ((0.0, 0.0, -50.0), (12.0, 5.0, -60.0), (20.0, 2.0, -50.0)))
    narrow = {"band": ReceiverBand(low=35e3, high=45e3), "filter": BandPass(low=35e3, high=45e3)}
    recipe = point_scene(tuple(middle), tuple(source), array=ARRAY, **narrow)
    ball = replace(recipe.scene.world.targets[0], shape=Sphere(radius=radius))
    world, physics = replace(recipe.scene.world, targets=(ball,)), replace(recipe.scene.physics, scattering=Kirchhoff())
    case = made(replace(recipe, scene=replace(recipe.scene, world=world, physics=physics)), focus=None)

    def way(angles: np.ndarray) -> np.ndarray:
        place = middle + radius * direction(*angles)
        return np.linalg.norm(place - source) + np.linalg.norm(place - array)

    start = azimuth_elevation(array + source - 2.0 * middle)
    place = middle + radius * direction(*minimize(way, start, options={"gtol": 1e-9}).x)
    away = np.linalg.norm(place - array)
    beam = case.frame.sonar_pose.to_body(place) / away
    (label,) = labels_at(case, beam[None], np.array([(np.linalg.norm(place - source) + away) / 1500.0]))
    assert label["target"] == 0 and abs(label["true_range"] - away) < 0.004


@pytest.mark.parametrize("seed", [0, 2])
def test_a_true_range_is_one_of_the_body_where_its_echoes_cancel(seed: int) -> None:
    """Faces of a smooth box against each other in a narrow band, at 60 delays from its first echo to its last: the mean
    of all that echoes, by what it adds to the sum, is up to 36 cm off it there."""
    recipe = point_scene((12.0, 2.0, -52.0), (9.0, -5.0, -60.0), array=ARRAY, band=ReceiverBand(low=35e3, high=50e3))
    size = tuple(np.random.default_rng(seed).uniform(0.2, 1.0, 3))
    box = replace(
        recipe.scene.world.targets[0], shape=Box(size=size), motion=Still(position=(12.0, 2.0, -52.0), heading=seed)
    )
    world, physics = replace(recipe.scene.world, targets=(box,)), replace(recipe.scene.physics, scattering=Kirchhoff())
    case = made(replace(recipe, scene=replace(recipe.scene, world=world, physics=physics)), focus=None)
    echoes, (body,) = case.arrivals.delay[~case.arrivals.direct], case.frame.moment.bodies
    delay = np.linspace(echoes.min(), echoes.max(), 60)
    towards = case.frame.sonar_pose.to_body(body.pose.position)
    found = labels_at(case, np.tile(towards / np.linalg.norm(towards), (60, 1)), delay)
    array = case.frame.sonar_pose.position
    nearest = surface_distances(body, array[None])[0]
    farthest = np.linalg.norm(body.pose.to_world(body.mesh.vertices) - array, axis=1).max()
    true = np.array([label["true_range"] for label in found if label["target"] == 0])
    assert len(true) > 50 and true.min() > nearest - 1e-4 and true.max() < farthest + 1e-4


def test_true_ranges_are_of_where_the_sound_met_what_moves() -> None:
    """At 25 m/s, with a snap 50 ms before the instant: the meeting solved for here, by straight paths."""
    recipe = point_scene((20.0, 2.0, -50.0), (12.0, 5.0, -60.0), array=ARRAY)
    velocity = 25.0
    target = replace(
        recipe.scene.world.targets[0], motion=ConstantVelocity(start=(20.0, 2.0, -50.0), heading=0.0, speed=velocity)
    )
    shrimp = replace(recipe.scene.world.sources[0], snap_times=(-0.05,))
    world = replace(recipe.scene.world, targets=(target,), sources=(shrimp,))
    case = made(replace(recipe, scene=replace(recipe.scene, world=world)))
    a, met = case.arrivals, 0.0
    for _ in range(50):
        where = np.array([20.0, 2.0 + velocity * met, -50.0])  # heading 0: north
        met = -0.05 + np.linalg.norm(where - [12.0, 5.0, -60.0]) / 1500.0
    echo = np.flatnonzero(~a.direct)[:1]
    (label,) = labels_at(case, a.direction[echo], a.delay[echo])
    assert met < -0.03 and label["target"] == 0
    assert abs(label["true_range"] - np.linalg.norm(where - [0.0, 0.0, -50.0])) < 0.005
    place = case.frame.sonar_pose.to_world(20.0 * a.direction[echo[0]])
    assert abs(label["distance"] - np.linalg.norm(place - where)) < 0.005


def test_distances_from_a_surface_are_those_of_the_nearest_triangle() -> None:
    """Against trimesh's closest points on every triangle, inside the body, on it and far from it."""
    mesh = mesh_of(Box(size=(1.0, 0.6, 0.4), edge=0.15))
    body = PlacedTarget("box", mesh, Pose(np.array([3.0, -2.0, -5.0]), np.array([0.8, 0.0, 0.6, 0.0])), np.zeros(3))
    random = np.random.default_rng(2)
    points = body.pose.to_world(np.concatenate([random.normal(size=(60, 3)) * s for s in (0.1, 1.0, 30.0)]))
    points = np.concatenate([points, body.pose.to_world(mesh.vertices[:5])])
    triangles = body.pose.to_world(mesh.vertices)[mesh.faces]
    exact = [
        np.linalg.norm(trimesh.triangles.closest_point(triangles, np.tile(p, (len(triangles), 1))) - p, axis=1).min()
        for p in points
    ]
    assert surface_distances(body, points) == pytest.approx(np.array(exact), rel=1e-9, abs=1e-12)


def test_a_point_is_labelled_by_its_own_direction_and_not_by_that_of_others() -> None:
    """Of two points at one delay the one towards the target is its echo; alone or beside others, alike."""
    case = made(point_scene((20.0, 0.0, -50.0), (12.0, 5.0, -60.0), array=ARRAY))
    late = case.arrivals.delay[~case.arrivals.direct][0] - case.listening.clock
    azimuth, far = np.array([0.5, 0.0]), np.full(2, 20.0, np.float32)
    place = 20.0 * direction(azimuth, np.zeros(2))
    energy = np.full(2, 1e-300)
    cloud = PointCloud(place, far, far, azimuth, far, np.zeros(2), far, np.full(2, late), energy, far)
    found = label_points(cloud, case.arrivals, case.band, case.frame.moment, case.listening)
    assert found.target[1] == 0 and found.distance[1] < 0.1 and not found.distance[0] < 5.0
    for i in range(2):
        alone = label_points(cloud.select(np.array([i])), case.arrivals, case.band, case.frame.moment, case.listening)
        assert all(np.array_equal(vars(found)[n][i], v[0], equal_nan=True) for n, v in vars(alone).items())


def test_paths_left_out_as_faint_bring_their_group_no_more_than_their_share() -> None:
    """The fainter ones of each group, and those no point is about; one step of two more would bring too much."""
    random, share = np.random.default_rng(4), 1e-3
    code, amplitude, delay = random.integers(0, 4, 800), 10.0 ** random.uniform(-4.0, 0.0, 800), np.zeros(800)
    delay[::50], power = 1.0, amplitude**2
    kept = loud_at(np.zeros(1), 0.5, delay, amplitude, code, share)
    near = loud_at(np.zeros(1), 2.0, delay, amplitude, code, share)
    assert np.array_equal(kept, near[delay[near] == 0.0])
    for group in range(4):
        own = np.flatnonzero(code == group)
        faint, loud = np.setdiff1d(own, near), np.intersect1d(own, near)
        assert 0.0 < power[faint].sum() <= share * power[own].sum()
        assert power[faint].max() <= power[loud].min()
        assert power[own[power[own] <= 2.0 * power[loud].min()]].sum() > share * power[own].sum()
