"""Moving targets and arrays: against times and directions solved point by point on the moving world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.geometry import Pose
from sonarsynth.geometry.motion import Circle, Motion, Track, Waypoint, Waypoints, pose, spin, velocity
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.products import Arrivals
from sonarsynth.propagation import AutoTracing
from sonarsynth.receiver import POINT
from sonarsynth.scattering import Isotropic, MirrorLobe
from sonarsynth.state import FrameContext, Medium, Receiver
from sonarsynth.tracing.arrivals import trace
from tests.bodies import ball
from tests.laws.test_traced_families import (
    ARRAY,
    BOTTOM_DEPTH,
    RIGID,
    ROMANIS,
    SONAR,
    SOURCE,
    THERMOCLINE,
    UNIFORM,
    C,
    images,
    snap,
)  # fmt: skip

STILL = np.zeros(3)


def run(
    v=STILL, u=STILL, *times: float, bodies=None, bounces=0, array=POINT, law=None, sonar=SONAR, **more
) -> Arrivals:
    """Arrivals at an array that moves at u m/s of snaps at some times, from bodies that move at v."""
    bodies = (ball(),) if bodies is None else bodies
    bodies = tuple(b if b.motion else replace(b, velocity=np.array(v)) for b in bodies)
    receiver = Receiver(sonar, array, track=more.get("moving", Track(sonar, np.array(u, float))))
    water, laws = Medium(RIGID, more.get("profile", UNIFORM)), (law or Isotropic(strength=1.0),) * len(bodies)
    snaps = tuple(snap(t) for t in times or (0.0,))
    return trace(FrameContext(0.0, bodies, snaps, water, receiver, laws), AutoTracing(bounces=bounces))


def heard(emitted: float, centre, v, u, source, array) -> tuple[float, float]:
    """When sound emitted at a time from a source (image) meets a facet, and is heard by an array (image)."""
    met = emitted
    for _ in range(20):
        met = emitted + np.linalg.norm(centre + v * met - source) / C
    at = met
    for _ in range(20):
        at = met + np.linalg.norm(centre + v * met - (array + u * at)) / C
    return met, at


@pytest.mark.parametrize("time", [0.0, -0.1, 1.0])
@pytest.mark.parametrize("u", [(0.0, 0.0, 0.0), (2.0, -1.0, 0.3)])
@pytest.mark.parametrize("v", [(0.0, 0.0, 0.0), (1.4, 0.0, 0.0), (-30.0, 2.0, 0.5)])
def test_delays_and_stretches_of_echoes_by_every_family(v, u, time: float) -> None:
    """Long before and after the instant of the frame too, and by surface and bottom, when the target is elsewhere."""
    v, u = np.array(v), np.array(u)
    body = ball(tuple(np.array([15.0, 1.0, -6.0]) - v * time))
    found = run(v, u, time, bodies=(body,), bounces=1)
    centre = body.pose.to_world(body.mesh.centroid)
    seen = set()
    for i in np.flatnonzero(~found.direct)[::41]:
        options = []
        for source, s1, b1 in images(SOURCE, 1):
            for array, s2, b2 in images(ARRAY, 1):
                if (s1 + s2, b1 + b2) == (found.surface[i], found.bottom[i]) and (s2 > 0) + 2 * (
                    b2 > 0
                ) == found.arrives_by[i]:
                    flip = np.array([1.0, 1.0, -1.0 if s2 + b2 else 1.0])
                    at, later = (
                        heard(time + t, centre[found.facet[i]], v, flip * u, source, array)[1] for t in (0.0, 1e-3)
                    )
                    options.append((at, (later - at) / 1e-3 - 1.0))
        at, doppler = min(options, key=lambda o: abs(o[0] - found.delay[i]))
        fast = np.linalg.norm(v) + np.linalg.norm(u)
        assert found.delay[i] == pytest.approx(at, abs=5e-12)
        assert found.doppler[i] == pytest.approx(doppler, abs=2e-9 + 2e-6 * fast**2 / 30.0 + 1e-7 * fast)
        seen.add((found.surface[i], found.bottom[i]))
    assert len(seen) == 3


def test_still_things_change_nothing_and_a_receding_target_stretches_the_pulse() -> None:
    a, b = run(bounces=1), run(bounces=1, moving=None)
    assert all(np.array_equal(getattr(a, n), getattr(b, n)) for n in ("delay", "direction", "radius", "doppler"))
    away = run((2.0, 0.0, 0.0), bodies=(ball((15.0, 0.0, -5.0)),))
    echoes = away.doppler[~away.direct]
    assert (echoes > 0).all() and echoes.max() < 2 * 2.0 / C * 1.01
    assert away.doppler[away.direct] == pytest.approx(0.0, abs=0)


@pytest.mark.parametrize("time", [0.0, -0.1, 0.1])
def test_an_echo_is_that_of_the_target_at_rest_where_the_sound_meets_each_facet(time: float) -> None:
    """Directions at the facet, so amplitudes by its law, both ways of spreading, and where it is seen."""
    v, law, body = np.array([0.0, 20.0, 0.5]), MirrorLobe(width=0.2), ball((15.0, -20.0 * time, -6.0))
    found = run(v, STILL, time, bodies=(body,), law=law)
    centre = body.pose.to_world(body.mesh.centroid)
    echo = np.flatnonzero(~found.direct)
    loud = echo[found.amplitude[echo] > 1e-3 * found.amplitude[echo].max()]
    for i in loud[:: len(loud) // 8]:
        met, _ = heard(time, centre[found.facet[i]], v, STILL, SOURCE, ARRAY)
        there = replace(body, pose=Pose(body.pose.position + v * met, body.pose.orientation))
        still = run(bodies=(there,), law=law, moving=None)
        (j,) = np.flatnonzero(still.facet == found.facet[i])
        for name in ("amplitude", "scattering", "spreading_out", "spreading_in", "direction", "radius", "point"):
            np.testing.assert_allclose(getattr(found, name)[i], getattr(still, name)[j], rtol=1e-9, err_msg=name)


CIRCLE = Circle(centre=(18.0, 0.0, -5.0), radius=4.0, speed=6.0, bearing=4.5)
TURNING = Circle(centre=(0.0, 3.0, -5.0), radius=3.0, speed=1.5, bearing=np.pi)
CORNER = Waypoints(
    points=(
        Waypoint(time=-1.0, position=(15.0, 5.0, -6.0), heading=3.0),
        Waypoint(time=-0.08, position=(15.0, 1.0, -6.0), heading=2.0),
        Waypoint(time=1.0, position=(18.0, 1.0, -5.0), heading=1.0),
    )
)


def on(motion: Motion) -> PlacedTarget:
    return replace(ball(), pose=pose(motion, 0.0), velocity=velocity(motion, 0.0), motion=motion)


@pytest.mark.parametrize("motion", [CIRCLE, CORNER], ids=["circle", "waypoints"])
def test_a_target_that_turns_is_met_as_it_has_turned(motion: Motion) -> None:
    for time in (-0.1, 0.1):
        body = on(motion)
        found = run(STILL, STILL, time, bodies=(body,), law=MirrorLobe(width=0.3))
        echo = np.flatnonzero(~found.direct)
        loud = echo[found.amplitude[echo] > 0.1 * found.amplitude[echo].max()]
        for i in loud[:: max(len(loud) // 4, 1)]:
            place, met = body.mesh.centroid[found.facet[i]], time
            for _ in range(50):
                met = time + np.linalg.norm(pose(motion, met).to_world(place) - SOURCE) / C
            there = pose(motion, met)
            at = met + np.linalg.norm(there.to_world(place) - ARRAY) / C
            assert found.delay[i] == pytest.approx(at, abs=1e-9)  # half its acceleration times tau_1 squared
            still = run(bodies=(replace(ball(), pose=there),), law=MirrorLobe(width=0.3), moving=None)
            (j,) = np.flatnonzero(still.facet == found.facet[i])
            assert found.amplitude[i] == pytest.approx(still.amplitude[j], rel=1e-6)


def test_an_array_that_turns_hears_echoes_where_it_points_then() -> None:
    motion = Circle(centre=(0.0, 3.0, -5.0), radius=3.0, speed=1.5, bearing=np.pi)
    track = Track(pose(motion, 0.0), velocity(motion, 0.0), motion)
    found = run(STILL, STILL, 0.1, sonar=track.pose, moving=track)
    for i in range(0, len(found.delay), 40):
        then = pose(motion, found.delay[i])
        np.testing.assert_allclose(then.to_world(found.radius[i] * found.direction[i]), found.point[i], atol=1e-6)


def test_a_body_hides_another_where_it_is_when_the_sound_passes() -> None:
    """A board that has come between by the time of a late snap, and was not there before."""
    hider, v = ball((10.0, -7.4, -5.5), radius=1.5), np.array([0.0, 80.0, 0.0])
    bodies = (ball(), replace(hider, velocity=v, motion=None))

    def lit(time: float) -> int:
        moved = tuple(replace(b, velocity=w) for b, w in zip(bodies, (STILL, v), strict=True))
        receiver, laws = Receiver(SONAR, POINT, track=Track(SONAR, STILL)), (Isotropic(strength=1.0),) * 2
        context = FrameContext(0.0, moved, (snap(time),), Medium(RIGID, UNIFORM), receiver, laws)
        found = trace(context, AutoTracing(bounces=0))
        return int((found.target == 0).sum())

    assert lit(0.0) > 100
    assert lit(0.1) == 0


@pytest.mark.parametrize("bounces", [0, 1])
def test_snaps_together_are_heard_as_each_alone(bounces: int) -> None:
    """Through bent water too: what is traced for several snaps together is what each would have by itself."""
    times, v, u = (-0.1, 0.0, 1e-4, 0.1), (3.0, 2.0, 0.0), (0.5, 0.0, 0.0)
    both = (ball(), ball((19.0, -3.0, -5.0)))
    together = run(v, u, *times, bodies=both, bounces=bounces, profile=THERMOCLINE)
    assert (np.diff(3 * together.snap + (together.target >= 0)) >= 0).all()
    for number, time in enumerate(times):
        mine = together.select(together.snap == number)
        alone = run(v, u, time, bodies=both, bounces=bounces, profile=THERMOCLINE)
        assert np.array_equal(mine.facet, alone.facet)
        np.testing.assert_allclose(mine.delay, alone.delay, atol=1e-10)
        np.testing.assert_allclose(mine.amplitude, alone.amplitude, rtol=1e-5)


@pytest.mark.parametrize("turns", [False, True])
@pytest.mark.parametrize("bottom", [False, True])
def test_families_that_are_traced_apart_are_all_of_those_together_and_each_once(bottom: bool, turns: bool) -> None:
    """Of what hardly turns, bodies or also the sonar, each family for itself, or some, through bent water: no path is
    lost, and none is heard twice. Sound of a snap on the bottom, and of its image there, is one."""
    slow = replace(CIRCLE, speed=1e-3)
    lit = replace(snap(), position=np.array([4.0, -7.0, -BOTTOM_DEPTH])) if bottom else snap()
    bodies, track = (on(slow), ball((19.0, -3.0, -5.0))), Track(SONAR, np.array([0.5, 0.0, 0.0]))
    if turns:
        own = replace(TURNING, speed=1e-3)
        track = Track(pose(own, 0.0), velocity(own, 0.0), own)
    water, laws = Medium(RIGID, THERMOCLINE), (Isotropic(strength=1.0),) * 2
    context = FrameContext(0.0, bodies, (lit,), water, Receiver(track.pose, POINT, track=track), laws)
    together, *apart = (
        trace(replace(context, tolerances=replace(context.tolerances, shared=shared)), AutoTracing(bounces=3))
        for shared in (1e3, 1e-9, 0.0)
    )
    known = np.lexsort((np.round(together.delay, 9), together.facet, together.target))
    for of in apart:
        order = np.lexsort((np.round(of.delay, 9), of.facet, of.target))
        assert not np.array_equal(order, known)
        for name in ("target", "facet", "surface", "bottom", "lit_by", "arrives_by"):
            assert np.array_equal(getattr(together, name)[known], getattr(of, name)[order]), name
        for name in ("delay", "amplitude"):
            np.testing.assert_allclose(getattr(of, name)[order], getattr(together, name)[known], rtol=1e-5)


@pytest.mark.parametrize("u", [(0.5, 0.0, 0.0), (1.5, -0.5, 0.2), (0.0, 10.0, 0.0), (10.0, 0.0, 0.0), TURNING], ids=str)
@pytest.mark.parametrize("far", [4.0, 20.0])
def test_each_sensor_of_a_moving_array_meets_the_wavefront_when_it_is_there(u, far: float) -> None:
    """Of the snap, its reflections and echoes: places by wavefronts are 3 cm off where u/c of their curvature lacks."""
    q, v, body = ROMANIS.position, np.array([-2.0, 3.0, 0.0]), ball((far, 1.0, -6.0), radius=0.3)
    motion = u if isinstance(u, Circle) else None
    track = Track(pose(u, 0.0), velocity(u, 0.0), u) if motion else Track(SONAR, np.array(u))
    found = run(v, bodies=(body,), bounces=1, array=ROMANIS, sonar=track.pose, moving=track)
    found = found.select(found.direct | ((found.surface + found.bottom == 0) & (np.arange(len(found.delay)) % 9 == 0)))
    apart = np.linalg.norm(found.radius[:, None, None] * found.direction[:, None, :] - q, axis=-1)
    beside = (apart - found.radius[:, None]) / found.sound_speed + found.expansion.over("delay", q)
    places = {(s, b): source for source, s, b in images(SOURCE, 1)}
    assert found.direct.sum() == 3 and len(found.delay) > 6
    for i, late in enumerate(found.delay[:, None] + beside):
        source, sent = places[found.surface[i], found.bottom[i]], 0.0
        if not found.direct[i]:
            centre = body.pose.to_world(body.mesh.centroid[found.facet[i]])
            sent, _ = heard(0.0, centre, v, STILL, SOURCE, ARRAY)
            source = centre + v * sent
        for n in np.linspace(0, len(q) - 1, 40).astype(int):
            at = late[n]
            for _ in range(6):
                at = sent + np.linalg.norm(track.later(at).pose.to_world(q[n]) - source) / C
            assert abs(late[n] - at) < (3e-9 if motion else 1e-10) + 2.0 * found.expansion.error[i]
    assert found.expansion.error.max() < 1e-8


@pytest.mark.parametrize("of", [pose, velocity, spin])
def test_a_kind_of_motion_that_a_function_does_not_know_is_named(of: Callable[[Motion, float], object]) -> None:
    class Bobbing:
        def __repr__(self) -> str:
            return "Bobbing()"

    with pytest.raises(AssertionError, match="Bobbing"):
        of(Bobbing(), 0.0)  # type: ignore[arg-type]
