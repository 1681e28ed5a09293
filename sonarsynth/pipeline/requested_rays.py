"""The rays that a recipe asks for, followed through a frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sonarsynth.description import FieldError
from sonarsynth.planning import Plan
from sonarsynth.tracing.ray_fan import fan

if TYPE_CHECKING:
    from sonarsynth.tracing.ray_fan import RayFan


def follow_rays(plan: Plan, index: int) -> RayFan:
    """The rays that the recipe asks for, followed through a frame. Raises FieldError where it asks for none."""
    request = plan.recipe.rays
    if request is None:
        raise FieldError((), "the recipe asks for no rays: add 'rays:', with directions or a grid")
    plan = plan.at(index)
    scene, frame = plan.recipe.frame(index)
    if request.towards_shrimp and not frame.moment.snaps:
        raise FieldError(("rays", "towards_shrimp"), "the scene has no shrimp")
    return fan(
        plan.medium,
        frame.moment.bodies,
        frame.sonar_pose.position,
        frame.sonar_pose.turn_to_world(request.rays()),
        request.duration,
        request.bounces,
        towards=frame.moment.snaps[0].position if request.towards_shrimp else None,
        laws=scene.laws,
        centre=scene.sonar.band.centre,
        propagation=plan.propagation,
    )
