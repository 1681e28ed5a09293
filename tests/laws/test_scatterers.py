"""Scatterers without a body: closed forms of one, the integral of many, and what they leave alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth.conventions import NO_TARGET
from sonarsynth.description import FieldError
from sonarsynth.environment.scatterers import BottomPatch, Net, Stones, Swarm
from sonarsynth.environment.sea import Absorption, Environment, Isovelocity, Profile
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.motion import Track
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.products import ORIGINS, Arrivals, Kind
from sonarsynth.propagation import AutoTracing
from sonarsynth.receiver import PositionTable, Sonar, elements
from sonarsynth.scattering import Isotropic
from sonarsynth.sources.snap_models import Gabor
from sonarsynth.state import Emission, FrameContext, Medium, Receiver, Tolerances
from sonarsynth.tracing.arrivals import trace
from tests.bodies import ball

ROOT = Path(__file__).resolve().parents[2]
C, BOTTOM = 1500.0, 12.0
WATER = Medium(
    Environment(depth=BOTTOM, sound_speed=Isovelocity(speed=C), absorption=Absorption(formula="none")),
    Profile(np.array([0.0]), np.array([C])),
)
ARRAY = elements(PositionTable(positions=((0.0, -0.1, 0.0), (0.0, 0.1, 0.1), (0.0, 0.0, -0.1))))
POSE = Pose(np.array([0.0, 0.0, -5.0]), quaternion(0.5 * np.pi))
SOURCE = np.array([6.0, -4.0, -7.0])
SNAP = Emission(SOURCE, 0.0, Gabor(frequency=50e3, cycles=8.0), None)


def traced(
    *fields: BottomPatch | Net | Stones | Swarm,
    bodies: tuple[PlacedTarget, ...] = (),
    speed: float = 0.0,
    seed: int = 0,
) -> Arrivals:
    loose = tuple(field.scatterers(BOTTOM, np.random.default_rng(seed)) for field in fields)
    receiver = Receiver(POSE, ARRAY, Sonar(), Track(POSE, np.array([speed, 0.0, 0.0])) if speed else None)
    laws, exact = (Isotropic(strength=0.1),) * len(bodies), Tolerances(negligible=0.0)
    context = FrameContext(0.0, bodies, (SNAP,), WATER, receiver, laws, exact, scatterers=loose)
    return trace(context, AutoTracing(bounces=0))


def test_a_stone_is_heard_as_a_large_sphere() -> None:
    found = traced(Stones(positions=((10.0, 3.0),), radius=0.2))
    one = found.select(found.kind == Kind.REVERBERATION)
    place = np.array([10.0, 3.0, 0.2 - BOTTOM])
    out, back = np.linalg.norm(place - SOURCE), np.linalg.norm(place - POSE.position)
    assert len(one.delay) == 1 and one.target[0] == NO_TARGET
    assert one.delay[0] == pytest.approx((out + back) / C, rel=1e-12)
    assert abs(one.amplitude[0]) == pytest.approx(0.1 / (out * back), rel=1e-12)
    np.testing.assert_allclose(POSE.turn_to_world(one.direction)[0], (place - POSE.position) / back, atol=1e-12)


def test_a_swarm_sends_the_power_of_its_members_from_within_its_ellipsoid_and_the_water() -> None:
    swarm = Swarm(centre=(9.0, 2.0, -0.3), axes=(1.0, 2.0, 0.5), members=3000, strength=-45.0)
    place = swarm.scatterers(BOTTOM, np.random.default_rng(1)).position
    off = (place - swarm.centre) / swarm.axes
    assert (np.sum(off**2, axis=1) < 1.0).all() and (place[:, 2] < 0.0).all() and place[:, 2].max() > -0.02
    below = Swarm(centre=(9.0, 2.0, -6.0), axes=(0.5, 0.5, 0.5), members=3000, strength=-45.0)
    found = traced(below)
    assert len(found.delay) - 1 == 3000, "and the direct path"
    own = found.kind == Kind.REVERBERATION
    out, back = (np.linalg.norm(np.array(below.centre) - x) for x in (SOURCE, POSE.position))
    power = (found.amplitude[own] ** 2).sum() * (out * back) ** 2
    assert 10.0 * np.log10(power) == pytest.approx(-45.0 + 10.0 * np.log10(3000), abs=0.1)
    assert abs(np.sign(found.amplitude[own]).mean()) < 0.1
    with pytest.raises(ValueError, match="out of the water"):
        Swarm(centre=(9.0, 2.0, 2.0)).scatterers(BOTTOM, np.random.default_rng(1))


@pytest.mark.parametrize("height", [0.3, 1e-3, 2e-6])
@pytest.mark.parametrize("afloat", [True, False])
def test_a_swarm_of_which_little_is_in_the_water_is_spread_evenly_in_that(height: float, afloat: bool) -> None:
    """The middle of a cap of a ball is 3 (2 r - h)^2/(4 (3 r - h)) from that of the ball. Members that were drawn in
    all of it took 13 s a frame where 1 mm was in the water, and for ever where next to nothing was."""
    r, count = 0.5, 4000
    up = r - height if afloat else height - r - BOTTOM
    swarm = Swarm(centre=(0.0, 0.0, up), axes=(r, r, r), members=count)
    place = swarm.scatterers(BOTTOM, np.random.default_rng(1)).position
    away = np.abs(place[:, 2] - up)
    assert (np.linalg.norm(place - swarm.centre, axis=1) <= r).all() and np.ptp(place[:, 2]) <= height
    middle = 0.75 * (2.0 * r - height) ** 2 / (3.0 * r - height)
    assert away.mean() == pytest.approx(middle, abs=5.0 * away.std() / np.sqrt(count))
    with pytest.raises(ValueError, match="out of the water"):
        Swarm(centre=(0.0, 0.0, up + (1 if afloat else -1) * height), axes=(r, r, r)).scatterers(
            BOTTOM, np.random.default_rng(1)
        )


def test_knots_of_a_net_are_where_its_corners_say_and_in_phase() -> None:
    net = Net(corner=(8.0, -1.0, -2.0), along=(0.0, 2.0, 0.0), down=(0.0, 0.0, -3.0), columns=5, rows=7)
    place = net.scatterers(BOTTOM, np.random.default_rng(1)).position.reshape(7, 5, 3)
    np.testing.assert_allclose(
        place[[0, 0, -1, -1], [0, -1, 0, -1]], [[8, -1, -2], [8, 1, -2], [8, -1, -5], [8, 1, -5]]
    )
    np.testing.assert_allclose(place[3, 2], (8.0, 0.0, -3.5))
    found = traced(net)
    own = found.kind == Kind.REVERBERATION
    assert own.sum() == 35 and len(set(np.sign(found.amplitude[own]))) == 1
    with pytest.raises(ValueError, match="out of the water"):
        replace(net, down=(0.0, 0.0, -30.0)).scatterers(BOTTOM, np.random.default_rng(1))
    tank = ss.load(ROOT / "configs" / "tank.yaml", ["scene.world.scatterers=[{kind: net, corner: [1, 0, -5]}]"])
    with pytest.raises(FieldError, match=r"scatterers.*out of the water"):
        tank.frame(0)


def test_an_array_that_moves_hears_each_scatterer_at_its_retarded_time() -> None:
    places = ((8.0, 4.0), (9.0, -6.0), (30.0, 5.0))
    found = traced(Stones(positions=places, radius=0.2), speed=5.0)
    late = np.sort(found.delay[found.kind == Kind.REVERBERATION])
    expected = []
    for east, north in places:
        place = np.array([east, north, 0.2 - BOTTOM])
        out = np.linalg.norm(place - SOURCE) / C
        heard = out
        for _ in range(20):
            heard = out + np.linalg.norm(place - POSE.position - [5.0 * heard, 0.0, 0.0]) / C
        expected.append(heard)
    np.testing.assert_allclose(late, np.sort(expected), atol=1e-9)


def test_pieces_of_the_bottom_bring_the_integral_of_lamberts_law_over_it() -> None:
    patch = BottomPatch(centre=(7.0, 2.0), radius=6.0, pieces=4000, strength=-20.0)
    power = sum(float(np.sum(traced(patch, seed=seed).amplitude[1:] ** 2)) for seed in range(3)) / 3.0
    r, turn = np.meshgrid(6.0 * (np.arange(400) + 0.5) / 400, 2.0 * np.pi * np.arange(400) / 400, indexing="ij")
    place = np.stack([7.0 + r * np.cos(turn), 2.0 + r * np.sin(turn), np.full(r.shape, -BOTTOM)], axis=-1)
    out, back = (np.linalg.norm(place - end, axis=-1) for end in (SOURCE, POSE.position))
    sines = (BOTTOM + SOURCE[2]) / out * (BOTTOM + POSE.position[2]) / back
    density = 0.01 * sines / (out * back) ** 2 * r * (6.0 / 400) * (2.0 * np.pi / 400)
    assert power == pytest.approx(float(density.sum()), rel=0.04)  # 12 000 places: 1 % of standard deviation


def test_bodies_hide_scatterers_and_are_not_hidden_by_them() -> None:
    stones = Stones(positions=((8.0, 0.0), (8.0, 6.0)), radius=0.1)
    middle = 0.5 * (np.array([8.0, 0.0, 0.1 - BOTTOM]) + POSE.position)
    body = ball(middle, subdivisions=1)
    alone, both = traced(bodies=(body,)), traced(stones, bodies=(body,))
    loose = both.kind == Kind.REVERBERATION
    assert both.facet[loose].tolist() == [1], "the ball stands between the first stone and the array"
    for name, value in both.select(~loose).columns.items():
        np.testing.assert_array_equal(value, alone.columns[name], err_msg=name)


def test_a_stone_is_in_image_and_cloud_and_is_no_target() -> None:
    sets = [
        "scene.world.scatterers=[{kind: stones, positions: [[1.0, 0.2]], radius: 8 cm}]",
        "scene.world.targets.0.shape={kind: cylinder, radius: 2 cm, length: 6 cm, edge: 1 cm}",
    ]
    recipe = ss.load(ROOT / "configs" / "tank.yaml", sets)
    tree = ss.render(recipe, 0)
    cloud = tree["cloud"].to_dataset()
    own = cloud["origin"].values == ORIGINS.index("reverberation")
    x, y = cloud["x"].values[own], cloud["y"].values[own]  # the array looks along x of the world
    assert own.any() and (np.hypot(x - 1.0, y - 0.2) < 0.1).any()
    assert (cloud["target"].values[own] == NO_TARGET).all()
    budget = tree["link_budget"]["paths"].values
    without = replace(recipe.scene.world, scatterers=())
    quiet = ss.render(replace(recipe, scene=replace(recipe.scene, world=without)), 0)
    np.testing.assert_array_equal(budget, quiet["link_budget"]["paths"].values)


@pytest.mark.parametrize(
    "entry", ["{kind: stones, positions: [[1, 0]], radius: 40 cm}", "{kind: bottom_patch, centre: [2e6, 0], radius: 1}"]
)
def test_scatterers_outside_the_water_are_refused_in_one_line(entry: str) -> None:
    recipe = ss.load(ROOT / "configs" / "tank.yaml", [f"scene.world.scatterers=[{entry}]"])
    with pytest.raises(ValueError, match=r"world\.scatterers\.0: a scatterer is .* at frame 0"):
        ss.plan(recipe)


@pytest.mark.parametrize(("window", "said"), [("{}", True), ("{start: 0, stop: 60 ms}", False)])
def test_the_plan_says_of_which_scatterers_nothing_is_heard(window: str, said: bool) -> None:
    """The record is as long as targets need: nothing came of a swarm 40 m off, without a word."""
    swarm = "scene.world.scatterers=[{kind: swarm, centre: [40, 3, -2], strength: -10, members: 5}]"
    sets = [swarm, "scene.world.environment.depth=8 m", f"scene.processing.echo_window={window}", "rays=null"]
    made = ss.plan(ss.load(ROOT / "configs" / "tank.yaml", sets), ["signals"])
    assert any(note.startswith("scene.world.scatterers.0: no echo of them comes") for note in made.warnings) == said
    without = ss.plan(ss.load(ROOT / "configs" / "tank.yaml", ["scene.world.scatterers=[]", *sets[1:]]), ["signals"])
    heard, silent = (ss.render(one, 0)["signals/pressure"].values.astype(float) for one in (made, without))
    assert (np.abs(heard - silent).max() < 1e-6) == said  # parts are summed by themselves, in single precision
