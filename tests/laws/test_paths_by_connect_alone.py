"""A propagation model that only joins points is traced as one that knows more of itself: shortcuts change nothing."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.description import description
from sonarsynth.environment.boundaries import Rigid, SeaBottom
from sonarsynth.environment.sea import Environment, Isovelocity, Profile
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.products import Arrivals, Paths
from sonarsynth.propagation import PathModel, Refracted, Straight
from sonarsynth.propagation.bounces import Bounces
from sonarsynth.propagation.path_model import KnownRays
from sonarsynth.receiver import Romanis, elements
from sonarsynth.scattering import Isotropic
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.state import Emission, FrameContext, Medium, Receiver, Tolerances
from sonarsynth.tracing.arrivals import trace
from tests.bodies import ball

DEPTH = 12.0
SONAR = Pose(np.array([0.0, 0.0, -5.0]), quaternion(0.5 * np.pi))
ARRAY = elements(Romanis())
WATER = Environment(depth=DEPTH, sound_speed=Isovelocity(speed=1540.0), bottom=SeaBottom(reflection=Rigid()))
UNIFORM = Profile(np.array([0.0, DEPTH]), np.array([1540.0, 1540.0]))
THERMOCLINE = Profile(np.array([0.0, 7.0, 8.5, DEPTH]), np.array([1541.0, 1541.0, 1534.6, 1534.5]))
CASES = {"straight": (Straight(bounces=1), UNIFORM), "refracted": (Refracted(bounces=1), THERMOCLINE)}


@description
class Joined(PathModel):
    """The paths of another model, and nothing else of it."""

    kind: Literal["joined"] = "joined"
    bounces: Bounces = 1
    bent: bool

    def connect(self, profile: Profile, environment_depth: float, start: Floats, end: Floats) -> Paths:
        """As `PathModel.connect`."""
        model: PathModel = (Refracted if self.bent else Straight)(bounces=self.bounces)
        return model.connect(profile, environment_depth, start, end)


def traced(model: PathModel, profile: Profile) -> Arrivals:
    snap = Emission(np.array([6.0, 5.0, -9.0]), 0.0, LogarithmicBubble(), None)
    law, all_of_it = (Isotropic(strength=1.0),), Tolerances(negligible=0.0)
    water, receiver = Medium(WATER, profile), Receiver(SONAR, ARRAY)
    return trace(FrameContext(0.0, (ball(),), (snap,), water, receiver, law, all_of_it), model)


def wavefronts(found: Arrivals) -> Floats:
    """Delays (path, sensor) s over that at the array centre."""
    q = ARRAY.position
    far = np.linalg.norm(found.radius[:, None, None] * found.direction[:, None, :] - q, axis=-1)
    late = (far - found.radius[:, None]) / found.sound_speed
    late = late + found.expansion.over("delay", q)
    return np.asarray(late)


@pytest.mark.parametrize("case", CASES)
def test_shortcuts_of_a_model_change_no_arrival_anywhere_on_the_array(case: str) -> None:
    model, profile = CASES[case]
    known, joined = traced(model, profile), traced(Joined(bent=case == "refracted"), profile)
    orders = [np.lexsort((np.round(a.delay, 10), a.bottom, a.surface, a.facet, a.target)) for a in (known, joined)]
    for name in ("target", "facet", "surface", "bottom"):
        assert np.array_equal(getattr(known, name)[orders[0]], getattr(joined, name)[orders[1]])
    for name, close in (("delay", 1e-11), ("amplitude", 1e-9), ("direction", 1e-7)):
        np.testing.assert_allclose(getattr(known, name)[orders[0]], getattr(joined, name)[orders[1]], atol=close)
    late = [wavefronts(a.select(order)) for a, order in zip((known, joined), orders, strict=True)]
    np.testing.assert_allclose(late[0], late[1], atol=2e-8)  # s, over the array: a thousandth of a period


def test_a_model_of_which_nothing_is_known_says_so() -> None:
    model = Joined(bent=True)
    assert not model.layered and not model.straight(UNIFORM)
    assert model.beside(UNIFORM, DEPTH, KnownRays(*np.zeros((3, 1, 3))), np.zeros((1, 3))) is None
    assert model.direct == Joined(bent=True, bounces=0) and model.exact() is model and model.row() == "joined rays"
