"""Faces of elements hear the slowness of a bent wavefront where they are: one expansion against each alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import Absorption, Environment, Isovelocity, Profile
from sonarsynth.geometry import Pose
from sonarsynth.geometry.motion import Track
from sonarsynth.products import Arrivals
from sonarsynth.propagation import Refracted
from sonarsynth.receiver import Elements, Sonar
from sonarsynth.receiver.subarrays import subarray
from sonarsynth.signals import DirectSum, GriddedSynthesis
from sonarsynth.signals.array_paths import array_paths, arrival_directions, towards
from sonarsynth.signals.segments import Reception
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.state import Emission, FrameContext, Medium, Receiver
from sonarsynth.tracing.arrivals import trace
from tests.echoes import EAST, ROMANIS, C

POSE = Pose(np.array([0.0, 0.0, -5.0]), EAST)
SNAPS = tuple(Emission(np.array([14.0, y, z]), 0.0, LogarithmicBubble(), None) for y, z in ((-5.0, -9.5), (-4.0, -9.0)))
SONAR = Sonar()
FAR = np.array([int(np.argmax(np.linalg.norm(ROMANIS.position, axis=1))), int(np.argmin(ROMANIS.position[:, 2])), 300])
START, SAMPLES = 0.008, 1000
WATER = Environment(depth=10.0, sound_speed=Isovelocity(speed=C), absorption=Absorption(formula="none"))


def profile(gradient: float) -> Profile:
    """Of a sound speed (m/s) that grows by `gradient` (1/s) with depth."""
    return Profile(np.array([0.0, 10.0]), np.array([C, C + 10.0 * gradient]))


def traced(gradient: float, array: Elements, pose: Pose, moving: Track | None = None) -> Arrivals:
    water, receiver = Medium(WATER, profile(gradient)), Receiver(pose, array, SONAR, moving)
    return trace(FrameContext(0.0, (), SNAPS, water, receiver), Refracted(bounces=0))


def alone(gradient: float, array: Elements, sensor: int) -> tuple[Arrivals, Elements]:
    part = subarray(array, np.array([sensor]))
    pose = Pose(POSE.to_world(part.centre[None])[0], POSE.orientation)
    return traced(gradient, part.elements, pose), part.elements


def smaller(share: float) -> Elements:
    return replace(ROMANIS, position=share * ROMANIS.position)


def slownesses(gradient: float, array: Elements) -> tuple[float, float]:
    """Largest error of slownesses across faces at three hydrophones, times the sound speed: of wavefronts, and of
    straight rays."""
    front, errors = array_paths(traced(gradient, array, POSE), SNAPS, array), []
    bent, straight = arrival_directions(front, array.position), towards(front, array.position)[0]
    for sensor in FAR:
        own, _ = alone(gradient, array, int(sensor))
        exact = own.direction * front.sound_speed / own.sound_speed
        errors.append([np.abs(some[:, sensor] - exact)[:, 1:].max() for some in (bent, straight)])
    first, second = np.array(errors).max(axis=0)
    return float(first), float(second)


def test_slownesses_are_those_of_rays_to_each_hydrophone_to_the_third_order_of_the_aperture() -> None:
    whole, straight = slownesses(5.0, ROMANIS)
    half, straight_of_half = slownesses(5.0, smaller(0.5))
    assert straight > 1e-3
    assert whole < 0.01 * straight
    assert 0.4 < straight_of_half / straight < 0.6
    assert half < whole / 5.0  # 8 in the limit


def test_the_straight_limit_is_that_of_straight_rays() -> None:
    gap = slownesses(1e-3, ROMANIS)[1]
    assert gap < 1e-3 * slownesses(1.0, ROMANIS)[1] * 1.1
    front = array_paths(traced(0.0, ROMANIS, POSE), SNAPS, ROMANIS)
    assert (arrival_directions(front, ROMANIS.position) == towards(front, ROMANIS.position)[0]).all()


@pytest.mark.parametrize("velocity", [(1.0, 2.0, 0.0), (0.0, 10.0, 0.0), (10.0, 0.0, 0.0)])
def test_a_face_that_moves_hears_the_wave_from_where_it_is_by_then(velocity: tuple[float, float, float]) -> None:
    """Within u/c of the angle that the array takes up, which is under 3e-4 at 10 m/s."""
    track = Track(POSE, np.array(velocity))
    front = array_paths(traced(0.0, ROMANIS, POSE, track), SNAPS, ROMANIS)
    source, moving, late = (
        front.direction[0] / front.curvature[0],
        POSE.turn_to_body(track.velocity),
        np.zeros((508, 1)),
    )
    for _ in range(6):  # until each meets the sphere that grows from the source
        ahead = source - ROMANIS.position - moving * late
        distance = np.linalg.norm(ahead, axis=1)[:, None]
        late = (distance - np.linalg.norm(source)) / C
    allowed = np.linalg.norm(velocity) / C * float(front.curvature.max()) * ROMANIS.aperture
    assert allowed < 3e-4
    assert np.abs(arrival_directions(front, ROMANIS.position)[0] - ahead / distance).max() < allowed


def test_signals_of_one_expansion_are_those_of_each_hydrophone() -> None:
    found, part = traced(5.0, ROMANIS, POSE), over_far()
    theirs = []
    for sensor in FAR:
        own, element = alone(5.0, ROMANIS, int(sensor))
        theirs.append(heard(DirectSum(), own, element)[0])
    error = np.linalg.norm(heard(DirectSum(), found, part) - theirs) / np.linalg.norm(theirs)
    assert error < 3e-4


@pytest.mark.parametrize("gradient", [0.5, 5.0])
def test_kernel_deposit_is_the_direct_sum(gradient: float) -> None:
    found, part = traced(gradient, ROMANIS, POSE), over_far()
    together = replace(found, delay=found.delay - found.delay + found.delay.mean())  # in one stretch, and one tile
    for some in (found, together):
        fast, slow = (
            heard(m, some, part) for m in (GriddedSynthesis(tolerance=1e-6, precision="float64"), DirectSum())
        )
        assert np.linalg.norm(fast - slow) < 2e-5 * np.linalg.norm(slow)  # tails that are cut


def over_far() -> Elements:
    """Three hydrophones of the array; the first is the farthest out."""
    return replace(subarray(ROMANIS, FAR).elements, position=ROMANIS.position[FAR])


def heard(method: GriddedSynthesis | DirectSum, found: Arrivals, part: Elements) -> Floats:
    return np.asarray(method.pressure(found, SNAPS, Reception(part, SONAR, None, START, SAMPLES))[0])
