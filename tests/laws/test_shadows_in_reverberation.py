"""Bodies hide what scatters behind them: from the snap, and from each part of the array as it sees it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.environment.reverberation import Reverberation
from sonarsynth.environment.sea import Absorption, Environment, Isovelocity
from sonarsynth.geometry.motion import Line, Still
from sonarsynth.planning import Plan, frame_start, plan
from sonarsynth.planning.measured.reverberation_levels import frame_scatterers
from sonarsynth.planning.notes.omissions import left_out
from sonarsynth.products.pulse_arrivals import ReverberationArrivals
from sonarsynth.receiver import Band, BandPass, PlanarLattice, Sonar
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import EchoWindow, Processing, Scene, Trajectory, World
from sonarsynth.recipe.tolerance import Accuracy
from sonarsynth.scattering.boundaries import Lambert
from sonarsynth.signals.pulse_sums.reverberation_synthesis import reverberation_pressure
from sonarsynth.sources.shrimp import SnappingShrimp
from sonarsynth.targets.shapes import Sphere
from sonarsynth.targets.target import Target
from sonarsynth.tracing.reverberation import reverberation_shadows

SPEED, DEPTH, RADIUS, MESH_ERROR = 1500.0, 6.0, 0.5, 0.02
START = np.array([2.5, 0.6, -3.6])
SAND = Reverberation(bottom=Lambert(mu=-15.0), surface=Lambert(mu=-25.0), bounces=1)
SONAR = Still(position=(0.0, 0.0, -3.0), heading=0.3)


def planned(velocity: float = 0.0, speckle: float = 0.01) -> Plan:
    """A wide array of 256 hydrophones and a snap beside it, in shallow water; a ball, which may move, before both."""
    stop = START + [0.0, velocity, 0.0]
    motion = Line(start=tuple(START), stop=tuple(stop), duration=1.0) if velocity else Still(position=tuple(START))
    ball = Target(name="ball", shape=Sphere(radius=RADIUS, edge=0.08), motion=motion)
    environment = Environment(depth=DEPTH, sound_speed=Isovelocity(speed=SPEED), absorption=Absorption(formula="none"))
    sonar = Sonar(
        array=PlanarLattice(columns=16, rows=16, pitch=0.06, face=0.02),
        band=Band(low=25e3, high=45e3),
        filter=BandPass(low=25e3, high=45e3),
        assumed_sound_speed=SPEED,
    )
    source = SnappingShrimp(position=(0.3, -0.4), height=2.2)
    world = World(environment=environment, targets=(ball,), sources=(source,), reverberation=SAND)
    processing = Processing(echo_window=EchoWindow(start=0.0, stop=14e-3))
    scene = Scene(world=world, sonar=sonar, trajectory=Trajectory(frames=1, sonar=SONAR), processing=processing)
    return plan(Recipe(seed=2, accuracy=Accuracy(speckle=speckle), scene=scene), ("signals",))


def arrivals(made: Plan, *, ball: bool = True) -> ReverberationArrivals:
    """What comes back, with the ball in the way or without: by the same scatterers."""
    frame = made.recipe.frame(0)[1]
    moment = frame.moment if ball else replace(frame.moment, bodies=())
    return frame_scatterers(made, replace(frame, moment=moment), frame_start(made, frame))


def mirrored(point: np.ndarray, by: str) -> np.ndarray:
    """The image of a point (..., xyz) in surface or bottom, named in the words of a family; else the point."""
    height = 0.0 if by.startswith("surface") else -DEPTH
    return np.asarray(point * [1.0, 1.0, -1.0] + [0.0, 0.0, 2.0 * height]) if by else point


def distance(start: np.ndarray, end: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Of segments (..., xyz) from a point (xyz), m."""
    along = end - start
    share = np.clip(((point - start) * along).sum(-1) / (along**2).sum(-1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(start + share[..., None] * along - point, axis=-1))


class Seen:
    """How far lines pass from the centre of the ball, unfolded at their reflections: those that meet it or its image
    are those that come nearer than its radius."""

    def __init__(self, made: Plan, every: ReverberationArrivals, ball: np.ndarray, some: slice) -> None:
        frame = made.recipe.frame(0)[1]
        snap, pose = frame.moment.snaps[0].position, frame.sonar_pose
        hydrophones = pose.to_world(made.elements.position[some])
        self.out, self.back = np.empty(len(every.delay)), np.empty((len(every.delay), len(hydrophones)))
        for number, name in enumerate(every.families):
            lit, heard = (name.split(f"{verb} by ")[-1] if verb in name else "" for verb in ("lit", "heard"))
            own = np.flatnonzero(every.family == number)
            images = [ball, mirrored(ball, lit or heard or "surface")]
            image = pose.position + pose.turn_to_world(every.direction[own]) * every.length[own, None]
            place = mirrored(image, heard)  # the array sees the image of a scatterer
            source = mirrored(np.broadcast_to(snap, place.shape), lit)
            self.out[own] = np.min([distance(source, place, at) for at in images], axis=0)
            self.back[own] = np.min([distance(hydrophones, image[:, None], at) for at in images], axis=0)


@pytest.mark.parametrize("velocity", [0.0, 20.0])
def test_a_ball_hides_what_lies_behind_it_as_straight_lines_and_their_images_say(velocity: float) -> None:
    """A body that moves hides where the sound meets it: 3 cm on, of a ball at 20 m/s. Only lines that pass its rim,
    where the ball is a polyhedron, may differ."""
    made, ball = planned(velocity), START
    snap = made.recipe.frame(0)[1].moment.snaps[0]
    for _ in range(4):
        ball = START + [0.0, velocity * (snap.time + np.linalg.norm(ball - snap.position) / SPEED), 0.0]
    every, found = arrivals(made, ball=False), arrivals(made)
    seen, kept = Seen(made, every, ball, slice(None, None, 5)), np.isin(every.delay, found.delay)
    shaded = []
    for number, name in enumerate(every.families):
        own = every.family == number
        dark = own & ((seen.out < RADIUS - MESH_ERROR) | (seen.back < RADIUS - MESH_ERROR).all(axis=1))
        light = own & (seen.out > RADIUS) & (seen.back > RADIUS).all(axis=1)
        assert not kept[dark].any() and kept[light].all(), name
        shaded += [name] if dark.any() else []
    assert len(shaded) == 5, shaded  # the ball is lower than what the surface sends straight back


def test_hydrophones_see_shadows_the_better_the_smaller_the_parts_that_see_alike(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of all that a body hides from some hydrophone, or seems to: the share that the line from that hydrophone says is
    not so, by parts of 256, 32 and 4."""
    made, some = planned(), slice(None, None, 5)
    every = arrivals(made, ball=False)
    seen, wrong = Seen(made, every, START, some), []
    lit = seen.out > RADIUS
    for size in (256, 32, 4):
        monkeypatch.setattr(reverberation_shadows, "PART", size)
        found = arrivals(made)
        hidden = np.ones((len(every.delay), made.elements.count), bool)
        kept = np.flatnonzero(np.isin(every.delay, found.delay))
        assert np.array_equal(every.delay[kept], found.delay)
        for part, sensors in enumerate(found.parts):
            hidden[np.ix_(kept, sensors)] = found.hidden[:, part, None]
        known = seen.back[lit] < RADIUS
        wrong.append(np.count_nonzero(hidden[lit][:, some] != known) / np.count_nonzero(known))
    assert wrong[0] > 2.0 * wrong[1] > 4.0 * wrong[2] and wrong[2] < 0.1


def test_a_part_of_the_array_hears_all_but_what_is_hidden_from_it() -> None:
    made = planned(speckle=1.0)
    frame, found = made.recipe.frame(0)[1], arrivals(made)
    hidden = np.random.default_rng(1).random(found.hidden.shape) < 0.5
    rest = made.elements, made.scene.sonar, made.absorption, frame_start(made, frame), 3000

    def pressure(of: ReverberationArrivals) -> np.ndarray:
        return reverberation_pressure(of, frame.moment.snaps, *rest)

    some = pressure(replace(found, hidden=hidden))
    assert sorted(np.concatenate(found.parts).tolist()) == list(range(made.elements.count))
    for part, sensors in enumerate(found.parts):
        heard = found.select(~hidden[:, part])
        alone = pressure(replace(heard, hidden=np.zeros_like(heard.hidden)))
        np.testing.assert_allclose(some[sensors], alone[sensors], atol=1e-6 * np.abs(alone).max())


def test_a_plan_says_how_far_diffraction_blurs_the_edges_of_shadows() -> None:
    """The first Fresnel zone, of a ball 2.6 m off at 35 kHz: sqrt(wavelength times distance) at most."""
    rows = {row.what: row for row in left_out(planned())}
    blur = float(np.sqrt(SPEED / 35e3 * np.linalg.norm(START - SONAR.position)))
    assert f"{blur:.2g} m" in rows["diffraction at the edges of shadows in the reverberation"].bound
