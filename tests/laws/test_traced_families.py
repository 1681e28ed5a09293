"""Paths by surface and bottom in a frame: against images, the straight limit, rays to every sensor; what hides them."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from sonarsynth.environment.boundaries import FluidHalfSpace, Rigid, SeaBottom, SeaSurface
from sonarsynth.environment.sea import Environment, Isovelocity, Profile
from sonarsynth.equations.water.boundary_reflection import rayleigh
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.products import Arrivals
from sonarsynth.propagation import AutoTracing, Refracted, Straight
from sonarsynth.receiver import POINT, Romanis, elements
from sonarsynth.scattering import Isotropic, MirrorLobe
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.state import Emission, FrameContext, Medium, Receiver
from sonarsynth.tracing.arrivals import trace
from tests.bodies import ball, mesh_from

BOTTOM_DEPTH, C = 12.0, 1530.0
SOURCE, ARRAY = np.array([6.0, 5.0, -9.0]), np.array([0.0, 0.0, -5.0])
SONAR = Pose(ARRAY, quaternion(0.5 * np.pi))
ROMANIS = elements(Romanis())
UNIFORM = Profile(np.array([0.0, BOTTOM_DEPTH]), np.array([C, C]))
THERMOCLINE = Profile(np.array([0.0, 7.0, 8.5, BOTTOM_DEPTH]), np.array([1541.0, 1541.0, 1534.6, 1534.5]))
RIGID = Environment(depth=BOTTOM_DEPTH, sound_speed=Isovelocity(speed=C), bottom=SeaBottom(reflection=Rigid()))


def snap(time: float = 0.0) -> Emission:
    return Emission(SOURCE, time, LogarithmicBubble(), None)


def run(
    bodies=None, profile=UNIFORM, environment=RIGID, bounces=2, law=None, array=POINT, tracing=None, source=SOURCE,
    sonar=SONAR,
) -> Arrivals:  # fmt: skip
    snaps = (Emission(source, 0.0, LogarithmicBubble(), None),)
    bodies = (ball(),) if bodies is None else bodies
    tracing = tracing or AutoTracing(bounces=bounces)
    laws = (law or Isotropic(strength=1.0),) * len(bodies)
    return trace(FrameContext(0.0, bodies, snaps, Medium(environment, profile), Receiver(sonar, array), laws), tracing)


def images(point: np.ndarray, most: int) -> list[tuple[np.ndarray, int, int]]:
    """Images of a point in surface and bottom, with the number of mirrors of each kind: one mirroring after another."""
    found = [(point, 0, 0)]
    for first in ("surface", "bottom"):
        place, counts, mirror = point, [0, 0], first
        for _ in range(most):
            height = 0.0 if mirror == "surface" else -BOTTOM_DEPTH
            place = np.array([place[0], place[1], 2 * height - place[2]])
            counts[mirror == "bottom"] += 1
            found.append((place, *counts))
            mirror = "bottom" if mirror == "surface" else "surface"
    return found


@pytest.mark.parametrize("most", [0, 1, 2, 3])
def test_in_uniform_water_every_path_is_that_of_an_image_of_source_and_array(most: int) -> None:
    body = ball()
    expected = []
    for facet, (centre, normal) in enumerate(
        zip(body.pose.to_world(body.mesh.centroid), body.pose.turn_to_world(body.mesh.normal), strict=True)
    ):
        for source, s1, b1 in images(SOURCE, most):
            for array, s2, b2 in images(ARRAY, most):
                out, back = np.linalg.norm(centre - source), np.linalg.norm(centre - array)
                if s1 + b1 + s2 + b2 <= most and normal @ (centre - source) < 0 and normal @ (array - centre) > 0:
                    expected.append((facet, (out + back) / C, (-1.0) ** (s1 + s2) / out / back, s1 + s2, b1 + b2))
    for source, s, b in images(SOURCE, most):
        far = np.linalg.norm(source - ARRAY)
        expected.append((-1, far / C, (-1.0) ** s / far, s, b))
    found = run(bounces=most)
    rows = np.stack([found.facet, found.delay, found.amplitude, found.surface, found.bottom], axis=1)
    expected = np.array(expected)
    assert rows.shape == expected.shape
    ways = [np.lexsort((np.round(r[:, 1], 12), r[:, 0])) for r in (rows, expected)]
    np.testing.assert_allclose(rows[ways[0]], expected[ways[1]], rtol=1e-11, atol=1e-16)
    assert (found.phase == 0).all() and (found.delay_std == 0).all()


def test_rays_in_nearly_uniform_water_are_the_straight_ones() -> None:
    nearly = Profile(np.array([0.0, BOTTOM_DEPTH]), np.array([C, C + 1e-7]))
    for law in (Isotropic(strength=1.0), MirrorLobe()):
        straight = run(law=law, array=ROMANIS, tracing=Straight(bounces=2))
        bent = run(law=law, array=ROMANIS, profile=nearly, tracing=Refracted(bounces=2))
        keys = [np.lexsort((np.round(a.delay, 11), a.facet)) for a in (straight, bent)]
        for name in ("facet", "surface", "bottom", "arrives_by"):
            assert np.array_equal(getattr(straight, name)[keys[0]], getattr(bent, name)[keys[1]])
        np.testing.assert_allclose(straight.delay[keys[0]], bent.delay[keys[1]], atol=1e-11)
        np.testing.assert_allclose(straight.direction[keys[0]], bent.direction[keys[1]], atol=1e-7)
        np.testing.assert_allclose(straight.amplitude[keys[0]], bent.amplitude[keys[1]], rtol=1e-6)


@pytest.mark.parametrize("profile", [UNIFORM, THERMOCLINE])
def test_wavefronts_of_all_families_reach_every_sensor_when_rays_do(profile: Profile) -> None:
    found = run(profile=profile, array=ROMANIS)
    model, q = Refracted(bounces=2), ROMANIS.position
    where = SONAR.to_world(q)
    far = np.linalg.norm(found.radius[:, None, None] * found.direction[:, None, :] - q, axis=-1)
    late = (far - found.radius[:, None]) / found.sound_speed
    late = late + found.expansion.over("delay", q)
    centre = model.connect(profile, BOTTOM_DEPTH, found.point, np.broadcast_to(ARRAY, found.point.shape))
    leg = {}
    for i in range(len(centre.pair)):
        leg.setdefault((centre.pair[i], centre.surface[i], centre.bottom[i]), []).append(centre.travel_time[i])
    checked = set()
    for i in np.linspace(0, len(found.delay) - 1, 60).astype(int):
        paths = model.connect(profile, BOTTOM_DEPTH, np.broadcast_to(found.point[i], where.shape), where)
        for family in set(zip(paths.surface, paths.bottom, strict=True)):
            some = (paths.surface == family[0]) & (paths.bottom == family[1])
            way = [0, 1, 2, 3][(family[0] > 0) + 2 * (family[1] > 0)]
            one_each = np.bincount(paths.pair[some], minlength=len(where)).max() == 1 and some.sum() == len(where)
            if way != found.arrives_by[i] or not one_each or len(leg.get((i, *family), [])) != 1:
                continue
            exact = paths.travel_time[some] - leg[i, *family][0]
            if abs(exact - late[i]).max() > 1e-6:
                continue  # another ray of this family: of two bounces, up first or down first
            assert abs(exact - late[i]).max() <= 2.0 * found.wavefront_error + 1e-15
            checked.add(way)
    assert checked >= {0, 1, 2}


def test_the_bed_gives_its_coefficient_and_phase_and_the_surface_changes_the_sign() -> None:
    fluid = FluidHalfSpace(density_ratio=1.8, speed_ratio=1.15, loss_tangent=0.02)
    environment = Environment(
        depth=BOTTOM_DEPTH,
        sound_speed=Isovelocity(speed=C),
        bottom=SeaBottom(reflection=fluid, rms_height=0.003),
        surface=SeaSurface(rms_height=0.001),
    )
    found = run(bodies=(), environment=environment, bounces=1)
    assert list(zip(found.surface, found.bottom, strict=True)) == [(0, 0), (0, 1), (1, 0)]
    drop = [np.hypot(SOURCE[2] - ARRAY[2], 0), 2 * BOTTOM_DEPTH + SOURCE[2] + ARRAY[2], -SOURCE[2] - ARRAY[2]]
    level = np.hypot(*(SOURCE - ARRAY)[:2])
    grazing = np.arctan2(drop, level)
    expected = complex(rayleigh(grazing[1], 1.8, 1.15, 0.02))
    assert found.boundary[1] == pytest.approx(abs(expected), rel=1e-12)
    assert found.phase[1] == pytest.approx(np.angle(expected), abs=1e-12)
    assert found.boundary[2] == -1.0 and found.phase[2] == 0.0
    np.testing.assert_allclose(
        found.delay_std, [0.0, *(2 * np.array([0.003, 0.001]) * np.sin(grazing[1:]) / C)], rtol=1e-12
    )


def plate(centre, half, normal_axis: int) -> PlacedTarget:
    """A thin board across one axis."""
    size = np.full(3, 2.0 * half)
    size[normal_axis] = 0.02
    mesh = mesh_from(trimesh.creation.box(size))
    return PlacedTarget("board", mesh, Pose(np.array(centre), quaternion(0.0)), np.zeros(3))


@pytest.mark.parametrize("profile", [UNIFORM, THERMOCLINE])
@pytest.mark.parametrize(("height", "hides"), [(-0.3, (1, 0)), (-BOTTOM_DEPTH + 0.3, (0, 1)), (-7.0, (0, 0))])
def test_a_board_hides_the_paths_that_it_stands_in_and_no_others(profile, height: float, hides) -> None:
    free = run(bodies=(), profile=profile, bounces=1)
    drop = {
        (0, 0): 0.5,
        (1, 0): ARRAY[2] / (ARRAY[2] + SOURCE[2]),
        (0, 1): (BOTTOM_DEPTH + ARRAY[2]) / (2 * BOTTOM_DEPTH + ARRAY[2] + SOURCE[2]),
    }
    met = ARRAY + drop[hides] * (SOURCE - ARRAY)  # where the path meets the boundary, or its middle
    shaded = run(bodies=(plate((met[0], met[1], height), 0.6, 2),), profile=profile, bounces=1)
    shaded = shaded.select(shaded.direct)
    families = [set(zip(a.surface.tolist(), a.bottom.tolist(), strict=True)) for a in (free, shaded)]
    assert families[0] == {(0, 0), (1, 0), (0, 1)}
    assert families[0] - families[1] == {hides}


def test_a_facet_is_lit_from_below_by_the_bed_alone() -> None:
    board = plate(
        (9.0, 3.0, -9.0 - 0.01), 0.3, 2
    )  # its upper face level with the source, its lower face sees the bottom
    direct, reflected = (run(bodies=(board,), bounces=n) for n in (0, 2))
    normals = board.pose.turn_to_world(board.mesh.normal)
    down = {i for i in range(len(normals)) if normals[i, 2] < -0.9}
    assert not down & set(direct.facet)
    by_bed = reflected.select(np.isin(reflected.facet, list(down)))
    assert len(by_bed.delay) and (by_bed.bottom >= 2).all()


def test_the_echo_of_a_ghost_comes_from_the_mirrored_place() -> None:
    found = run(array=ROMANIS)
    ghosts = found.select(~found.direct & (found.arrives_by == 1))
    towards = SONAR.turn_to_world(ghosts.direction)
    mirrored = np.array([15.0, 1.0, 6.0]) - ARRAY
    assert (towards @ mirrored / np.linalg.norm(mirrored) > np.cos(0.3 / 15)).all()


def test_a_snap_on_the_bottom_and_its_image_there_are_one() -> None:
    """Of one strength to a snap a hair above the bottom, whose two ways add up when they come together: each of no more
    than two reflections, and its image with one more. The way by surface, bottom and surface has three."""
    fluid = SeaBottom(reflection=FluidHalfSpace(density_ratio=1.8, speed_ratio=1.15, loss_tangent=0.02))
    environment = Environment(depth=BOTTOM_DEPTH, sound_speed=Isovelocity(speed=C), bottom=fluid)
    totals = []
    for height in (0.0, 1e-7):
        place = np.array([6.0, 5.0, -BOTTOM_DEPTH + height])
        found = run(environment=environment, source=place, bounces=3 if height else 2)
        found = found.select((found.direct | (found.arrives_by == 0)) & (found.surface < 2))
        row = np.where(found.direct, 320, found.facet)
        value = np.zeros((321, 2), complex)
        np.add.at(value, (row, found.surface), found.amplitude * np.exp(1j * found.phase))
        totals.append(value)
        assert (found.surface + found.bottom).max() == (3 if height else 2)
        assert found.direct.sum() == (6 if height else 3)
    assert (np.abs(totals[0]) > 0.0).sum(axis=0).min() > 50
    np.testing.assert_allclose(totals[0], totals[1], rtol=1e-4, atol=1e-7)


@pytest.mark.parametrize("profile", [UNIFORM, THERMOCLINE], ids=["uniform", "thermocline"])
def test_the_sound_of_a_snap_on_the_bottom_is_one_path_that_each_sensor_hears_as_both(profile: Profile) -> None:
    """As it hears those of a snap a hair above the bottom, which come apart: directly, and by the surface, the last
    reflection that is followed. Its grazing angle is its own."""
    fluid = FluidHalfSpace(density_ratio=1.8, speed_ratio=1.15, loss_tangent=0.02)
    environment = Environment(depth=BOTTOM_DEPTH, sound_speed=Isovelocity(speed=C), bottom=SeaBottom(reflection=fluid))
    heard, errors = [], []
    for height in (0.0, 1e-7):
        place = np.array([6.0, 5.0, height - BOTTOM_DEPTH])
        found = run((), profile, environment, bounces=2 if height else 1, array=ROMANIS, source=place)
        found = found.select(np.argsort(found.delay)[: 4 if height else 2])  # then come two reflections, launched up
        assert (found.surface.sum(), found.bottom.sum()) == ((2, 2) if height else (1, 0))
        q, over = ROMANIS.position, found.expansion.over
        far = np.linalg.norm(found.radius[:, None, None] * found.direction[:, None] - q, axis=-1)
        size = (found.amplitude * found.radius)[:, None] / far * (1.0 + over("amplitude", q))
        each = size * np.exp(1j * (found.phase[:, None] + over("phase", q)))
        heard.append([each[found.surface == n].sum(axis=0) for n in (0, 1)])
        errors.append(2.0 * np.pi * 85e3 * found.wavefront_error + found.amplitude_error)
    wrong = np.abs(np.subtract(*heard)) / np.abs(heard[1])
    assert wrong.max() < max(2.0 * sum(errors), 1e-5) and sum(errors) < 3e-3
    if profile is UNIFORM:
        for pressure, image in zip(heard[0], (place, place * (1.0, 1.0, -1.0)), strict=True):
            ray = SONAR.to_world(q) - image
            distance = np.linalg.norm(ray, axis=1)
            both = 1.0 + rayleigh(np.arcsin(np.abs(ray[:, 2]) / distance), 1.8, 1.15, 0.02)
            np.testing.assert_allclose(pressure, np.sign(-image[2]) * both / distance, rtol=2e-3)


def test_a_snap_on_the_surface_and_its_image_there_cancel() -> None:
    """Directly and by the bottom, the last reflection that is followed."""
    assert not len(run(bounces=1, source=np.array([6.0, 5.0, 0.0])).delay)
    assert len(run(bounces=1, source=np.array([6.0, 5.0, -1e-6])).delay) > 100


def test_a_body_at_the_foot_of_a_ray_that_turns_and_then_meets_the_bed_hides_it_both_ways() -> None:
    """Launched upwards, it turns: the bottom is the first boundary that it meets."""
    falling = Profile(np.array([0.0, 20.0]), np.array([1520.0, 1500.0]))
    environment = Environment(depth=20.0, sound_speed=Isovelocity(speed=1510.0), bottom=SeaBottom(reflection=Rigid()))
    ends = np.array([[0.0, 0.0, -10.0], [360.0, 0.0, -10.0]])
    foot = ball((232.958, 0.0, -19.65))
    for source, array in (ends, ends[::-1]):
        where = {"source": source, "sonar": Pose(array, quaternion(0.5 * np.pi)), "tracing": Refracted(bounces=1)}
        kept = [run(bodies, falling, environment, **where) for bodies in ((), (foot,))]
        by_bed = [int((a.bottom[a.direct] == 1).sum()) for a in kept]
        assert by_bed == [2, 1]


def test_straight_rays_are_straight_in_any_water() -> None:
    falling = Profile(np.array([0.0, BOTTOM_DEPTH]), np.array([1530.0, 1500.0]))
    middle = 0.5 * (SOURCE + ARRAY)
    found = run(bodies=(ball(tuple(middle), 0.05),), profile=falling, bounces=0, tracing=Straight())
    assert not found.direct.any()
    assert run(bodies=(), profile=falling, array=ROMANIS, tracing=Straight(bounces=1)).wavefront_error == 0.0
