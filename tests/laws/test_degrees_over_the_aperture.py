"""Cubics over the aperture: what they leave falls with the fourth power of its size, and where that is too much the
array is cut into parts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sonarsynth import planning
from sonarsynth.environment.sea import Absorption, Environment, Isovelocity, Profile
from sonarsynth.geometry import Pose
from sonarsynth.planning import choosing
from sonarsynth.planning.choosing import PerSensorReference
from sonarsynth.products import Arrivals
from sonarsynth.products.array_expansion import aperture_terms, stacked
from sonarsynth.propagation import Refracted
from sonarsynth.receiver import Elements, Sonar
from sonarsynth.receiver.subarrays import subarray
from sonarsynth.recipe import reading
from sonarsynth.signals.array_paths import array_paths, delay_and_gain
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.state import Emission, FrameContext, Medium, Receiver
from sonarsynth.tracing.arrivals import trace
from tests.echoes import EAST, ROMANIS

POSE = Pose(np.array([0.0, 0.0, -5.0]), EAST)
SNAP = Emission(np.array([5.0, -2.0, -9.0]), 0.0, LogarithmicBubble(), None)
SONAR = Sonar()
PROFILE = Profile(np.array([0.0, 10.0]), np.array([1500.0, 1700.0]))
WATER = Environment(depth=10.0, sound_speed=Isovelocity(speed=1500.0), absorption=Absorption(formula="none"))
FAR = np.array([int(np.argmax(np.linalg.norm(ROMANIS.position, axis=1))), int(np.argmin(ROMANIS.position[:, 2])), 300])
TANK = Path(__file__).parents[2] / "configs" / "tank.yaml"


def traced(array: Elements, pose: Pose) -> Arrivals:
    context = FrameContext(0.0, (), (SNAP,), Medium(WATER, PROFILE), Receiver(pose, array, SONAR))
    return trace(context, Refracted(bounces=0))


def error(share: float) -> float:
    """Largest error (s) of the delays at three hydrophones of a smaller array, each traced by itself."""
    array = replace(ROMANIS, position=share * ROMANIS.position)
    front, errors = array_paths(traced(array, POSE), (SNAP,), array), []
    delay, _ = delay_and_gain(front, array.position)
    for sensor in FAR:
        part = subarray(array, np.array([sensor]))
        own = traced(part.elements, Pose(POSE.to_world(part.centre[None])[0], POSE.orientation))
        errors.append(abs(front.delay[0] + delay[0, sensor] - own.delay[0]))
    return max(errors)


def test_what_is_left_falls_with_the_power_after_the_degree() -> None:
    cubic = error(1.0)
    assert cubic > 1e-10
    assert error(0.5) < cubic / 10.0  # 16 in the limit


def test_terms_over_the_aperture_are_the_monomials() -> None:
    q = np.random.default_rng(1).normal(size=(7, 3))
    powers = [(a, b, d - a - b) for d in range(4) for a in range(d, -1, -1) for b in range(d - a, -1, -1)]
    exact = np.stack([np.prod((q / 2.0) ** np.array(p), axis=1) for p in powers], axis=1)
    np.testing.assert_allclose(aperture_terms(q, 2.0), exact, rtol=1e-13)


@pytest.mark.parametrize("signal", [1e-3, pytest.param(1e-5, marks=pytest.mark.long)])
def test_a_planner_cuts_the_array_where_one_expansion_errs_too_much(signal: float) -> None:
    made = planning.plan(reading.recipe_of(reading.read(TANK, [f"accuracy.signal={signal}"])))
    measured = PerSensorReference.of(made, 0)
    assert measured.error(made.choices.subarrays) < signal
    assert (made.choices.subarrays > 1) == (measured.error(1) > signal)


def test_choices_of_before_are_cubic() -> None:
    choices = planning.Choices()
    assert planning.choices_from(choices.as_json() | {"degree": 3}) == choices
    with pytest.raises(ValueError, match="degree"):
        planning.choices_from(choices.as_json() | {"degree": 5})


def test_fainter_echoes_are_kept_before_the_array_is_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where what is left out as too faint is what errs, no number of subarrays would help."""

    class Measured:
        def error(self, parts: int, occlusion: str = "centre", faint: float = 1.0) -> float:
            return float(np.hypot(7e-4 * np.sqrt(faint), 1e-4 / parts**2))

        def own_views(self) -> float:
            return 0.0

    monkeypatch.setattr(PerSensorReference, "of", staticmethod(lambda plan, index, **how: Measured()))
    plan = planning.plan(reading.recipe_of(reading.read(TANK, ["accuracy.signal=1e-3"])), products=())
    cut = choosing._subarrays(plan, [0])
    assert (cut.parts, cut.faint) == (1, choosing.FAINTER) and cut.error < 3e-4


@pytest.mark.parametrize(("sequences", "occlusion"), [(1, "centre"), (2, "sensors")])
def test_occlusion_that_matters_where_it_was_measured_is_followed_where_it_was_not(
    monkeypatch: pytest.MonkeyPatch, sequences: int, occlusion: str
) -> None:
    """Within the tolerance in one sequence, it may be beyond in the next, where another body stands in the way."""

    class Measured:
        def error(self, parts: int, occlusion: str = "centre", faint: float = 1.0) -> float:
            return {"centre": 6e-4, "sensors": 3e-4}[occlusion]

        def own_views(self) -> float:
            return 0.0

    monkeypatch.setattr(PerSensorReference, "of", staticmethod(lambda plan, index, **how: Measured()))
    plan = planning.plan(reading.recipe_of(reading.read(TANK, [f"repeats={sequences}"])), products=())
    assert choosing._subarrays(plan, [0]).occlusion == occlusion


def test_rows_of_blocks_keep_their_type_where_some_lack_columns() -> None:
    """Bits of who is hidden from which hydrophone are bytes: of paths that none are known of, 0."""
    joined = stacked([np.zeros((2, 0), np.uint8), np.full((1, 3), 7, np.uint8)])
    assert joined.dtype == np.uint8 and joined.tolist() == [[0, 0, 0], [0, 0, 0], [7, 7, 7]]
