"""A rough target is heard to a thousandth from one wavefront a path over the whole array."""

from pathlib import Path

import pytest

from sonarsynth import planning
from sonarsynth.recipe import reading

REMUS = Path(__file__).resolve().parents[2] / "configs" / "remus.yaml"


@pytest.mark.parametrize(
    "law", ["{kind: kirchhoff, roughness: 2 mm, slope: 0.2}", pytest.param("{kind: kirchhoff}", marks=pytest.mark.long)]
)
def test_a_thousandth_takes_one_expansion(law: str) -> None:
    sets = ("accuracy.signal=1e-3", f"scene.physics.scattering={law}", "scene.trajectory.frames=2")
    made = planning.plan(reading.load(REMUS, sets), {"signals"})
    assert made.choices.subarrays == 1
    assert made.choices.occlusion == "sensors"
    assert made.errors.expansion < 5e-4
