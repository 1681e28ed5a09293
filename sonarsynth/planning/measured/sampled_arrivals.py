"""The arrivals of a frame by the methods of its plan, at the whole array or at a part of it."""

from __future__ import annotations

from sonarsynth.geometry import Pose
from sonarsynth.planning.plans import Plan
from sonarsynth.products import Arrivals
from sonarsynth.receiver.subarrays import Subarray
from sonarsynth.recipe.scene import Frame
from sonarsynth.tracing.arrivals import trace

FACETS = 10.0
"""Change of an echo by the mean over its facet, over the array, that is left out, over the error of signals: the whole
of the echoes of cylinders, spheres and a REMUS-100 erred by a tenth to a fiftieth of it."""
AMPLITUDES = 0.1
"""Share of the error of signals that amplitudes over the aperture may err by, for a lower degree to do."""


def arrivals_of(plan: Plan, frame: Frame, part: Subarray | None = None) -> Arrivals:
    """Every path of a frame to the middle of the array, or of a part of it, expanded over its hydrophones.

    What is not traced to any hydrophone, as where parts are, is seen by the array's middle alone. `plan` is that of
    the frame's sequence. Raises ValueError for anything outside the water.
    """
    scene, sonar = plan.scene, plan.scene.sonar
    sonar_track = frame.sonar_track if part is None else frame.sonar_track.part(part.centre)
    return trace(
        scene.world.environment,
        plan.profile,
        frame.moment,
        frame.sonar_pose if part is None else subarray_pose(frame.sonar_pose, part),
        plan.elements if part is None else part.elements,
        plan.absorption_at_depths,
        plan.propagation,
        scene.laws,
        band=(sonar.band.low, sonar.band.high),
        moving=sonar_track if scene.physics.doppler else None,
        shared=plan.recipe.accuracy.signal,
        negligible=plan.choices.negligible,
        enough=AMPLITUDES * plan.recipe.accuracy.cheap,
        alike=FACETS * plan.recipe.accuracy.signal,
        degree=plan.choices.degree,
        occlusion=plan.choices.occlusion if part is not None or plan.choices.subarrays == 1 else "centre",
    )


def subarray_pose(pose: Pose, part: Subarray) -> Pose:
    """The pose of a part of an array that has a pose."""
    return Pose(pose.to_world(part.centre[None, :])[0], pose.orientation)
