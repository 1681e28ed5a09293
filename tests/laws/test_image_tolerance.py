"""Images err by no more than a recipe allows, in frames too in which its plan did not measure that."""

from __future__ import annotations

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth.imaging import FocusedDelayAndSum
from sonarsynth.planning.measured.image_errors import exact_beams, signals_of_frame

FRAMES = (5, 21, 38, 51)
"""Of 64; a plan measures in the first, the last and the middle."""
BOX = "scene.world.targets.0.shape={kind: box, size: [1.5 m, 0.5 m, 0.5 m], edge: 3 cm}"


@pytest.mark.parametrize(
    ("allowed", "change"),
    [(0.1, (BOX,)), (0.1, ("scene.processing.beamforming.focus=15 m",)), (0.03, ())],
)
def test_images_err_by_what_is_allowed(allowed: float, change: tuple[str, ...]) -> None:
    """Root mean square over beams and frames; no frame by more than half as much again. Where few frequencies alone
    erred by more than was allowed, 0.03, the array was cut into 16 by 16 subarrays, and they were kept."""
    plan = ss.plan(ss.load("configs/remus.yaml", [f"accuracy.image_db={allowed}", *change]))
    method, errors = plan.choices.beamforming, []
    assert isinstance(method, FocusedDelayAndSum) and plan.errors.image <= allowed
    assert method.subarrays in ((1, 1), (2, 2))
    for index in FRAMES:
        signals = signals_of_frame(plan, index)
        assert signals is not None
        beams = exact_beams(plan.at(index), method, *signals)
        assert beams is not None
        errors.append(beams.error(plan.at(index), method))
    assert np.sqrt(np.mean(np.square(errors))) < allowed
    assert max(errors) < 1.5 * allowed, errors


def test_plans_say_that_single_frames_err_by_more() -> None:
    """The plan measures 0.063 dB in three frames; frame 56 errs by 0.128, where it said nothing of others."""
    plan = ss.plan(ss.load("configs/thermocline.yaml"))
    (said,) = (stage.error for stage in plan.stages if stage.stage == "beamform")
    assert "in the worst frame measured; others may err two to three times as much" in said
    signals = signals_of_frame(plan, 56)
    assert signals is not None
    beams = exact_beams(plan.at(56), plan.choices.beamforming, *signals)
    assert beams is not None
    assert beams.error(plan.at(56), plan.choices.beamforming) < 3.0 * plan.errors.image
