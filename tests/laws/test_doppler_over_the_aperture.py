"""What moves is seen from another side at each hydrophone than from the middle of the array: that is left out, and the
parts of an array leave out less."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.environment.boundaries import Rigid, SeaBottom
from sonarsynth.environment.sea import Absorption, Environment, Isovelocity
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.motion import Track
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.products import Arrivals
from sonarsynth.propagation import Straight
from sonarsynth.receiver import Elements, Sonar
from sonarsynth.receiver.subarrays import subarray
from sonarsynth.scattering import Isotropic
from sonarsynth.signals import GriddedSynthesis
from sonarsynth.signals.segments import Reception
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.state import Emission, FrameContext, Medium, Receiver, Tolerances
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Box
from sonarsynth.tracing.arrivals import trace
from tests.echoes import EAST, PROFILE, ROMANIS, C

POSE = Pose(np.array([0.0, 0.0, -5.0]), EAST)
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


def traced(moving: Moving, array: Elements, pose: Pose, bounces: int = 0) -> Arrivals:
    water = Environment(
        depth=10.0,
        sound_speed=Isovelocity(speed=C),
        absorption=Absorption(formula="none"),
        bottom=SeaBottom(reflection=Rigid()),
    )
    panel = PlacedTarget("panel", PANEL, Pose(np.array([12.0, 1.5, -4.8]), quaternion(0.6)), moving.target)
    receiver = Receiver(pose, array, SONAR, Track(pose, moving.sonar))
    left = Tolerances(negligible=0.0)
    context = FrameContext(0.0, (panel,), (SNAP,), Medium(water, PROFILE), receiver, (Isotropic(),), left)
    found = trace(context, Straight(bounces=bounces))
    return found.select(found.direct | np.isin(found.facet, FRONT))  # those that no hydrophone sees from their edge


def alone(moving: Moving, sensor: int, array: Elements = ROMANIS, bounces: int = 0) -> tuple[Arrivals, Elements]:
    """Traced to a hydrophone by itself, the middle of an array of its own."""
    part = subarray(array, np.array([sensor]))
    pose = Pose(POSE.to_world(part.centre[None])[0], POSE.orientation)
    return traced(moving, part.elements, pose, bounces), part.elements


def left_out(moving: Moving, share: float, bounces: int = 0) -> float:
    """Largest difference of Doppler between the middle of a smaller array and three hydrophones of it."""
    array = replace(ROMANIS, position=share * ROMANIS.position)
    one = traced(moving, array, POSE, bounces)
    return max(float(np.abs(one.doppler - alone(moving, int(n), array, bounces)[0].doppler).max()) for n in FAR)


@pytest.mark.parametrize("which", MOVING)
@pytest.mark.parametrize("bounces", [0, 1])
def test_doppler_left_out_is_in_proportion_to_the_array(which: str, bounces: int) -> None:
    moving = MOVING[which]
    speed = np.linalg.norm(moving.target) + np.linalg.norm(moving.sonar)
    whole = left_out(moving, 1.0, bounces)
    assert 5e-5 < whole < 2.0 * speed / C * ROMANIS.aperture / 10.0  # v/c of the angle that the array takes up
    assert 0.4 < left_out(moving, 0.5, bounces) / whole < 0.6


def test_signals_of_one_expansion_are_nearly_those_of_each_hydrophone() -> None:
    """At 6 m/s, from 12 m: a tenth of the tightest tolerance at which planners are mostly left with one expansion."""
    moving = MOVING["target"]
    part = replace(subarray(ROMANIS, FAR).elements, position=ROMANIS.position[FAR])
    exact = np.array([heard(*alone(moving, int(n)))[0] for n in FAR])
    error = heard(traced(moving, ROMANIS, POSE), part) - exact
    assert 1e-6 < np.linalg.norm(error) / np.linalg.norm(exact) < 2e-4


def heard(found: Arrivals, part: Elements) -> Floats:
    method, echoes = GriddedSynthesis(tolerance=1e-6, precision="float64"), found.select(~found.direct)
    return np.asarray(method.pressure(echoes, (SNAP,), Reception(part, SONAR, None, START, SAMPLES))[0])
