"""Snaps straight below the array, where an azimuth says little: predicted errors hold that, and are no more than pi."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.environment.sea import Profile
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.ranging import SensorDelays
from sonarsynth.receiver import PlanarLattice, Sonar, elements
from sonarsynth.state import Receiver, Survey
from tests.heard import hear_direct

C, BELOW = 1540.0, 6.0
ARRAY = PlanarLattice(columns=12, rows=12, pitch=0.1, face=0.0)


def azimuth(x: float, y: float, noise: float) -> tuple[float, float]:
    """How far off (rad) that of a snap x m ahead and y m to port is, and the predicted error."""
    source, random = np.array([x, y, -BELOW]), np.random.default_rng(3)
    signals = hear_direct(elements(ARRAY), source, noise=noise, random=random, samples=1200)
    receiver = Receiver(
        Pose(np.array([0.0, 0.0, -40.0]), quaternion(0.0)), elements(ARRAY), Sonar(array=ARRAY, assumed_sound_speed=C)
    )
    water = Profile(np.array([0.0]), np.array([C]))
    found = SensorDelays(on_bottom=False).locate(signals, receiver, Survey(60.0, water), 1)
    off = (found.azimuth[0] - np.arctan2(y, x) + np.pi) % (2.0 * np.pi) - np.pi
    return float(off), float(found.azimuth_error[0])


@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (-1e-9, 0.0), (0.01, 0.02), (-0.04, 0.01), (0.0, 0.1)])
def test_below_the_array_any_azimuth_may_be_the_right_one(x: float, y: float, noise: float) -> None:
    off, predicted = azimuth(x, y, noise)
    assert abs(off) < 2.0 * predicted
    assert predicted <= np.pi


def test_beside_it_predicted_errors_are_those_of_the_wavefront() -> None:
    """30 degrees beside the pole, and as large as the share of the sound speed's error: under a degree."""
    off, predicted = azimuth(3.0, 1.5, 0.0)
    assert abs(off) < 2.0 * predicted < np.deg2rad(1.0)
