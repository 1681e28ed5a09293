"""The plan of one frame with other sources in the place of the recipe's: elsewhere, louder, or of another pulse."""

from __future__ import annotations

from dataclasses import replace

from sonarsynth.description import FieldError
from sonarsynth.planning.listening_windows import listening_windows
from sonarsynth.planning.measured.ray_bending import propagation
from sonarsynth.planning.measured.sampled_frames import SampledScene
from sonarsynth.planning.notes.product_checks import check_located, check_windows
from sonarsynth.planning.notes.scene_checks import check_frame, check_shrimp
from sonarsynth.planning.plans import Plan
from sonarsynth.sources import Source


def plan_with(plan: Plan, index: int, sources: tuple[Source, ...]) -> Plan:
    """The plan of frame `index`, which is of the sequence of `plan`, with other sources.

    Bodies, water, sonar, choices and random streams stay; the window is the shortest that holds what is heard now.
    Raises FieldError for a source that is out of the water, in a body or among the hydrophones, or whose pulse cannot
    be made; and where sound from there takes ways that the plan was not made for.
    """
    changed = replace(plan, sources=sources)
    scene, frame = changed.scene, changed.frame(index)
    check_shrimp(scene)
    check_frame(scene, frame)
    check_located(scene, frame, plan.products)
    model, signal = plan.propagation, plan.recipe.accuracy.signal
    fits = model == model.exact() or propagation(scene, plan.profile, (frame,), signal) == model
    if not fits:
        raise FieldError(
            ("scene", "world", "sources"),
            "sound bends on its way from there more than this plan follows: plan a recipe that has the source there",
        )
    windows = listening_windows(plan.recipe, [SampledScene(scene, plan.profile, (frame,))])
    check_windows(scene, windows)
    emissions = len(frame.moment.snaps)
    sizes = {"sample": windows.samples, "emission": emissions}
    sizes["estimate"] = plan.sizes["estimate"] + emissions - plan.sizes["emission"]
    return replace(changed, windows=windows, sizes=plan.sizes | sizes)
