"""A rough target is heard to a hundredth from one view of the array, to a thousandth from parts of it, or sensors."""

from pathlib import Path

import pytest

from sonarsynth import planning
from sonarsynth.recipe import reading

REMUS = Path(__file__).resolve().parents[2] / "configs" / "remus.yaml"
SMOOTH, ROUGH = "{kind: kirchhoff}", "{kind: kirchhoff, roughness: 2 mm, slope: 0.2}"


@pytest.mark.parametrize(
    ("law", "signal", "parts"),
    [
        (ROUGH, 1e-2, (1, "centre")),
        pytest.param(ROUGH, 1e-3, (8, "sensors"), marks=pytest.mark.long),
        pytest.param(SMOOTH, 1e-3, (1, "sensors"), marks=pytest.mark.long),
    ],
)
def test_a_plan_takes_as_few_views_as_will_do(law: str, signal: float, parts: tuple[int, str]) -> None:
    sets = (f"accuracy.signal={signal}", f"scene.physics.scattering={law}", "scene.trajectory.frames=2")
    made = planning.plan(reading.load(REMUS, sets), {"signals"})
    assert (made.choices.subarrays, made.choices.occlusion) == parts
    assert made.errors.expansion < 0.6 * signal
