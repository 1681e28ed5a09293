"""Polynomials over the aperture, to the third degree and to the fifth: what they leave falls with the next power."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sonarsynth import planning
from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import Absorption, Environment, Isovelocity, Profile
from sonarsynth.equations.arrays.apertures import aperture_terms
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.planning import choosing
from sonarsynth.planning.choosing import PerSensorReference
from sonarsynth.products import Arrivals
from sonarsynth.propagation import Refracted
from sonarsynth.receiver import Elements, Romanis, Sonar, elements
from sonarsynth.receiver.subarrays import subarray
from sonarsynth.recipe import reading
from sonarsynth.signals import DirectSum, GriddedSynthesis
from sonarsynth.signals.array_paths import array_paths, delay_and_gain
from sonarsynth.signals.direct_sum import exact_signals
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.state import Emission, FrameContext, Medium, Receiver, Tolerances
from sonarsynth.tracing.arrivals import trace
from sonarsynth.tracing.expansion.wavefront_polynomials import terms_of

POSE = Pose(np.array([0.0, 0.0, -5.0]), quaternion(0.5 * np.pi))
ROMANIS = elements(Romanis())
SNAP = Emission(np.array([5.0, -2.0, -9.0]), 0.0, LogarithmicBubble(), None)
SONAR = Sonar()
PROFILE = Profile(np.array([0.0, 10.0]), np.array([1500.0, 1700.0]))
WATER = Environment(depth=10.0, sound_speed=Isovelocity(speed=1500.0), absorption=Absorption(formula="none"))
FAR = np.array([int(np.argmax(np.linalg.norm(ROMANIS.position, axis=1))), int(np.argmin(ROMANIS.position[:, 2])), 300])
TANK = Path(__file__).parents[2] / "configs" / "tank.yaml"


def traced(array: Elements, pose: Pose, degree: int = 3) -> Arrivals:
    receiver, left = Receiver(pose, array, SONAR), Tolerances(degree=degree)
    context = FrameContext(0.0, (), (SNAP,), Medium(WATER, PROFILE), receiver, tolerances=left)
    return trace(context, Refracted(bounces=0))


def error(degree: int, share: float) -> float:
    """Largest error (s) of the delays at three hydrophones of a smaller array, each traced by itself."""
    array = replace(ROMANIS, position=share * ROMANIS.position)
    front, errors = array_paths(traced(array, POSE, degree), (SNAP,), array), []
    delay, _ = delay_and_gain(front, array.position)
    for sensor in FAR:
        part = subarray(array, np.array([sensor]))
        own = traced(part.elements, Pose(POSE.to_world(part.centre[None])[0], POSE.orientation))
        errors.append(abs(front.delay[0] + delay[0, sensor] - own.delay[0]))
    return max(errors)


def test_what_is_left_falls_with_the_power_after_the_degree() -> None:
    cubic, quintic = error(3, 1.0), error(5, 1.0)
    assert cubic > 1e-10
    assert quintic < 0.1 * cubic
    assert error(3, 0.5) < cubic / 10.0  # 16 in the limit
    assert error(5, 0.5) < quintic / 30.0 + 1e-14  # 64, or rounding


def test_there_are_as_many_terms_as_monomials() -> None:
    q = np.random.default_rng(1).normal(size=(7, 3))
    every = aperture_terms(q, 2.0, terms_of(5))
    powers = [(a, b, d - a - b) for d in range(6) for a in range(d, -1, -1) for b in range(d - a, -1, -1)]
    exact = np.stack([np.prod((q / 2.0) ** np.array(p), axis=1) for p in powers], axis=1)
    assert every.shape == (7, 56)
    np.testing.assert_allclose(every, exact, rtol=1e-13)
    assert (every[:, : terms_of(3)] == aperture_terms(q, 2.0)).all()


def test_kernel_deposit_is_the_direct_sum_to_the_fifth_degree() -> None:
    found = traced(ROMANIS, POSE, 5)
    assert found.delay_terms.shape == found.amplitude_terms.shape == (1, 56)
    part = replace(subarray(ROMANIS, FAR).elements, position=ROMANIS.position[FAR])
    together = found.select(np.zeros(2, int))  # alone it is its own tile
    for some in (found, replace(together, delay=together.delay + [0.0, 1e-4])):
        fast, slow = (
            heard(m, some, part) for m in (GriddedSynthesis(tolerance=1e-6, precision="float64"), DirectSum())
        )
        assert np.linalg.norm(fast - slow) < 2e-5 * np.linalg.norm(slow)


def heard(method: GriddedSynthesis | DirectSum, found: Arrivals, part: Elements) -> Floats:
    make = method.pressure if isinstance(method, GriddedSynthesis) else exact_signals
    return np.asarray(make(found, (SNAP,), part, SONAR, None, 0.002, 800)[0])


@pytest.mark.parametrize(("signal", "degree"), [(1e-3, 3), pytest.param(1e-5, 5, marks=pytest.mark.long)])
def test_a_planner_takes_the_fifth_degree_before_it_cuts_the_array(signal: float, degree: int) -> None:
    made = planning.plan(reading.recipe_of(reading.read(TANK, [f"accuracy.signal={signal}"])))
    assert made.choices.subarrays == 1 and made.choices.degree == degree
    measured = PerSensorReference.of(made, 0)
    assert measured.error(1, degree=made.choices.degree) < signal
    if degree == 5:
        assert measured.error(1, degree=3) > signal
        (stage,) = (s for s in made.stages if s.stage == "trace")
        assert "degree 5" in stage.method


def test_choices_of_before_are_cubic() -> None:
    without = {k: v for k, v in planning.Choices().as_json().items() if k != "degree"}
    assert planning.choices_from(without).degree == 3
    with pytest.raises(ValueError, match="degree"):
        planning.choices_from(without | {"degree": 4})


def test_fainter_echoes_are_kept_before_the_array_is_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where what is left out as too faint is what errs, no number of subarrays would help."""

    class Measured:
        def error(self, parts: int, occlusion: str = "centre", degree: int = 3, faint: float = 1.0) -> float:
            return float(np.hypot(7e-4 * np.sqrt(faint), 1e-4 / parts**2))

    monkeypatch.setattr(PerSensorReference, "of", staticmethod(lambda plan, index: Measured()))
    plan = planning.plan(reading.recipe_of(reading.read(TANK)), products=())
    cut = choosing._subarrays(plan, [0])
    assert (cut.parts, cut.faint) == (1, choosing.LESS_FAINT[0]) and cut.error < 3e-4
