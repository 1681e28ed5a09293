"""What moves is seen from another side at each hydrophone: one expansion over the array against each alone."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.environment.boundaries import Rigid, SeaBottom
from sonarsynth.environment.sea import Absorption, Environment, Isovelocity, Profile
from sonarsynth.equations.arrays.apertures import aperture_terms
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.motion import Track
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.products import Arrivals
from sonarsynth.propagation import Refracted, Straight
from sonarsynth.receiver import Elements, Romanis, Sonar, elements
from sonarsynth.receiver.subarrays import subarray
from sonarsynth.scattering import Isotropic
from sonarsynth.signals import DirectSum, GriddedSynthesis
from sonarsynth.signals.array_paths import array_paths, delay_and_gain
from sonarsynth.signals.direct_sum import exact_signals
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.state import Emission, FrameContext, Medium, Receiver, Tolerances
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Box
from sonarsynth.tracing.arrivals import trace

C = 1500.0
PROFILE = Profile(np.array([0.0]), np.array([C]))
POSE = Pose(np.array([0.0, 0.0, -5.0]), quaternion(0.5 * np.pi))
ROMANIS = elements(Romanis())
SNAP = Emission(np.array([14.0, -5.0, -9.5]), 0.0, LogarithmicBubble(), None)
SONAR = Sonar()
PANEL = mesh_of(Box(size=(0.006, 0.3, 0.2), edge=0.05))
FRONT = np.flatnonzero(PANEL.normal[:, 0] < -0.9)
STILL, FAST = np.zeros(3), np.array([1.0, 6.0, -2.0])


class Moving(NamedTuple):
    """Velocities (xyz), m/s."""

    target: Floats
    sonar: Floats


MOVING = {"target": Moving(FAST, STILL), "array": Moving(STILL, FAST), "both": Moving(FAST, -FAST)}
FAR = np.array([int(np.argmax(np.linalg.norm(ROMANIS.position, axis=1))), int(np.argmin(ROMANIS.position[:, 1])), 300])
START, SAMPLES = 0.010, 1600


def traced(
    moving: Moving, array: Elements, pose: Pose, *, bounces: int = 0, enough: float = 0.0, profile: Profile = PROFILE
) -> Arrivals:
    water = Environment(
        depth=10.0,
        sound_speed=Isovelocity(speed=C),
        absorption=Absorption(formula="none"),
        bottom=SeaBottom(reflection=Rigid()),
    )
    panel = PlacedTarget("panel", PANEL, Pose(np.array([12.0, 1.5, -4.8]), quaternion(0.6)), moving.target)
    rays = Straight if profile.uniform else Refracted
    receiver = Receiver(pose, array, SONAR, Track(pose, moving.sonar))
    left = Tolerances(negligible=0.0, quadratic=enough)
    context = FrameContext(0.0, (panel,), (SNAP,), Medium(water, profile), receiver, (Isotropic(),), left)
    found = trace(context, rays(bounces=bounces))
    return found.select(found.direct | np.isin(found.facet, FRONT))  # those that no hydrophone sees from their edge


def alone(
    moving: Moving, sensor: int, array: Elements = ROMANIS, *, bounces: int = 0, profile: Profile = PROFILE
) -> tuple[Arrivals, Elements]:
    """Traced to a hydrophone by itself, the middle of an array of its own."""
    part = subarray(array, np.array([sensor]))
    pose = Pose(POSE.to_world(part.centre[None])[0], POSE.orientation)
    return traced(moving, part.elements, pose, bounces=bounces, profile=profile), part.elements


def doppler(found: Arrivals, array: Elements, sensor: int) -> Floats:
    """Doppler (path,) at a hydrophone."""
    terms = aperture_terms(array.position[sensor], array.aperture)
    return np.asarray(found.doppler + found.doppler_terms @ terms[: found.doppler_terms.shape[1]])


def smaller(share: float) -> Elements:
    return replace(ROMANIS, position=share * ROMANIS.position)


def worst(moving: Moving, array: Elements, bounces: int) -> tuple[float, float]:
    """Largest error of Doppler at three hydrophones, of one expansion and of that of the array centre for all."""
    one = traced(moving, array, POSE, bounces=bounces)
    errors = []
    for sensor in FAR:
        own, _ = alone(moving, int(sensor), array, bounces=bounces)
        mine = np.abs(doppler(one, array, int(sensor)) - own.doppler).max()
        errors.append((mine, np.abs(one.doppler - own.doppler).max()))
    first, second = zip(*errors, strict=True)
    return max(first), max(second)


@pytest.mark.parametrize("which", MOVING)
@pytest.mark.parametrize("bounces", [0, 1])
def test_doppler_is_that_of_each_hydrophone_to_the_third_order_of_the_aperture(which: str, bounces: int) -> None:
    whole, centre = worst(MOVING[which], ROMANIS, bounces)
    half, centre_of_half = worst(MOVING[which], smaller(0.5), bounces)
    assert centre > 5e-5  # v/c of the angle that the array takes up
    assert whole < 0.02 * centre
    assert 0.4 < centre_of_half / centre < 0.6
    assert half < max(whole / 5.0, 4e-4 * centre)  # 8 in the limit, down to squares of v/c


def test_signals_of_one_expansion_are_those_of_each_hydrophone() -> None:
    method, moving = DirectSum(), MOVING["target"]
    one, part = echoes(moving), over_far()
    theirs = []
    for sensor in FAR:
        found, element = alone(moving, int(sensor))
        theirs.append(heard(method, found.select(~found.direct), element)[0])
    exact = np.array(theirs)
    error, worse = (np.linalg.norm(heard(method, f, part) - exact) / np.linalg.norm(exact) for f in (one, flat(one)))
    assert worse > 5e-5
    assert error < 0.01 * worse


def over_far() -> Elements:
    """Three hydrophones of the array; the first is the farthest out."""
    return replace(subarray(ROMANIS, FAR).elements, position=ROMANIS.position[FAR])


def echoes(moving: Moving) -> Arrivals:
    found = traced(moving, ROMANIS, POSE)
    return found.select(~found.direct)


def flat(found: Arrivals) -> Arrivals:
    """With the Doppler of the array centre everywhere."""
    return replace(found, doppler_terms=np.zeros((len(found.delay), 0)))


@pytest.mark.long
@pytest.mark.parametrize("amplify", [1.0, 20.0])
def test_kernel_deposit_adds_what_the_direct_sum_adds(amplify: float) -> None:
    """To the first power: the second is left out."""
    found = echoes(MOVING["both"])
    found = replace(found, doppler_terms=amplify * found.doppler_terms)
    part = over_far()
    fast, slow = (
        heard(method, found, part) - heard(method, flat(found), part)
        for method in (GriddedSynthesis(tolerance=1e-7, precision="float64"), DirectSum())
    )
    assert np.linalg.norm(slow) > 1e-4 * amplify * np.linalg.norm(heard(DirectSum(), found, part))
    assert np.linalg.norm(fast - slow) < 2e-3 * amplify * np.linalg.norm(slow)


def heard(method: GriddedSynthesis | DirectSum, found: Arrivals, part: Elements) -> Floats:
    if isinstance(method, GriddedSynthesis):
        return np.asarray(method.pressure(found, (SNAP,), part, SONAR, None, START, SAMPLES)[0])
    return exact_signals(found, (SNAP,), part, SONAR, None, START, SAMPLES)[0]


def test_one_path_alone_is_the_direct_sum() -> None:
    found = traced(MOVING["array"], ROMANIS, POSE)
    found = found.select(found.direct)
    assert len(found.delay) == 1 and found.doppler_terms.any()
    fast, slow = (
        np.asarray(m.signals(found, (SNAP,), ROMANIS, SONAR, None, 0.009, 800).pressure, float)
        for m in (GriddedSynthesis(tolerance=1e-6, precision="float64"), DirectSum())
    )
    assert np.linalg.norm(fast - slow) / np.linalg.norm(slow) < 1e-6


def test_nothing_is_carried_where_it_would_not_be_heard() -> None:
    slow = Moving(0.1 * FAST, STILL)
    assert traced(slow, ROMANIS, POSE, enough=Tolerances().quadratic).doppler_terms.shape[1] == 0
    assert traced(Moving(STILL, STILL), ROMANIS, POSE).doppler_terms.shape[1] == 0
    assert traced(MOVING["target"], ROMANIS, POSE, enough=Tolerances().quadratic).doppler_terms.shape[1] > 0


def test_delays_of_bent_rays_from_what_moves_are_those_of_each_hydrophone() -> None:
    """Where bent rays turn otherwise over the aperture than straight ones, what moves is heard at another time too."""
    sloped, errors = Profile(np.array([0.0, 10.0]), np.array([1480.0, 1580.0])), []
    one, straight = (traced(MOVING["target"], ROMANIS, POSE, profile=sloped, enough=enough) for enough in (0.0, 1.0))
    for sensor in FAR:
        own, element = alone(MOVING["target"], int(sensor), profile=sloped)
        (exact,) = delays(own, element, [0])
        errors.append([np.abs(delays(f, ROMANIS, [int(sensor)])[0] - exact).max() for f in (one, straight)])
    mine, without = np.array(errors).max(axis=0)
    assert without > 1e-10
    assert mine < 0.1 * without


def delays(found: Arrivals, array: Elements, sensors: list[int]) -> list[Floats]:
    """Delay (path,) of echoes at each of some hydrophones."""
    front = array_paths(found.select(~found.direct), (SNAP,), array)
    delay, _ = delay_and_gain(front, array.position)
    return [front.delay + delay[:, sensor] for sensor in sensors]
