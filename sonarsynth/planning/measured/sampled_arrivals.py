"""The arrivals of a frame by the methods of its plan, at the whole array or a part of it; and what is heard there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import Profile
from sonarsynth.geometry import Pose
from sonarsynth.planning.listening_windows import frame_start
from sonarsynth.planning.plans import Plan
from sonarsynth.products import Arrivals
from sonarsynth.randomness import stream
from sonarsynth.receiver import Elements, Sonar
from sonarsynth.receiver.subarrays import Subarray
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals import Synthesis
from sonarsynth.signals.segments import Reception
from sonarsynth.state import FrameContext, Receiver, Survey, Tolerances
from sonarsynth.tracing.arrivals import trace

SAMPLE = 2500
"""Facets that errors are measured on, about, where there are over four times as many."""
FEW_LAYERS = 1000
"""Layers of the sea up to which so many are: a ray costs as many steps as it crosses layers, and with more layers there
are as many fewer facets."""


def arrivals_of(plan: Plan, frame: Frame, subarray: Subarray | None = None) -> Arrivals:
    """Every path of a frame to the middle of the array, or of a part of it, expanded over its hydrophones.

    `plan` is that of the frame's sequence. Raises ValueError for anything outside the water.
    """
    return trace(context_of(plan, frame, subarray), plan.propagation)


def sampled_arrivals(plan: Plan, frame: Frame, subarray: Subarray | None = None) -> Arrivals:
    """The same by way of about `SAMPLE` facets, which err as all do where their powers add; where facets add with their
    phases, by way of all: of these the sum is smaller than its parts, and what they err by is not."""
    context = context_of(plan, frame, subarray)
    adds = not any(law.coherent or law.passes_sound for law in plan.scene.laws)
    every = one_facet_in(plan.profile, sum(len(mesh.faces) for mesh in plan.scene.meshes), SAMPLE)
    tolerances = replace(context.tolerances, every=every if adds and every > 4 else 1)
    return trace(replace(context, tolerances=tolerances), plan.propagation)


def one_facet_in(profile: Profile, facets: int, sample: int) -> int:
    """One of how many facets to look at, for about `sample` in all; for fewer in water of many layers."""
    return max(int(facets * max(len(profile.depth) / FEW_LAYERS, 1.0) / sample), 1)


def context_of(plan: Plan, frame: Frame, subarray: Subarray | None = None) -> FrameContext:
    """What a frame is traced in, at the array or a part of it.

    What is not traced to any hydrophone, as where parts are, is seen by the array's middle alone.
    """
    choices, accuracy, receiver = plan.choices, plan.recipe.accuracy, receiver_of(plan, frame, subarray)
    tolerances = Tolerances(
        negligible=choices.negligible,
        shared=accuracy.signal,
        occlusion=choices.occlusion if subarray is not None or choices.subarrays == 1 else "centre",
    )
    world = frame.moment
    everything = world.time, world.bodies, world.snaps, plan.medium, receiver, plan.scene.laws, tolerances
    return FrameContext(*everything, scatterers=world.scatterers)


def behind_baffle(arrivals: Arrivals, sonar: Sonar) -> Arrivals:
    """Arrivals, with what the baffle leaves of those from behind."""
    if not sonar.baffle:
        return arrivals
    gain = np.where(arrivals.direction[:, 0] < 0.0, sonar.behind, 1.0)
    return replace(arrivals, amplitude=arrivals.amplitude * gain)


def receiver_of(plan: Plan, frame: Frame, subarray: Subarray | None = None) -> Receiver:
    """The array of a frame, or a part of it."""
    pose, track, own = frame.sonar_pose, frame.sonar_track, plan.elements
    if subarray is not None:
        pose, track, own = subarray_pose(pose, subarray), track.part(subarray.centre), subarray.elements
    return Receiver(pose, own, plan.scene.sonar, track if plan.scene.physics.doppler else None)


def survey_of(plan: Plan, frame: Frame) -> Survey:
    """What the sonar knows of the water of a frame, and what a trigger tells it."""
    random = stream(frame.seed, "trigger", frame.key, frame.step)
    told = plan.scene.processing.locating.told(frame.moment.snaps, receiver_of(plan, frame), random)
    return Survey(plan.scene.world.environment.depth, plan.profile, told)


def reception_of(plan: Plan, frame: Frame) -> Reception:
    """What hears the arrivals of a frame, and when."""
    return Reception(plan.elements, plan.scene.sonar, plan.absorption, frame_start(plan, frame), plan.windows.samples)


def subarray_pose(pose: Pose, subarray: Subarray) -> Pose:
    """The pose of a part of an array that has a pose."""
    return Pose(pose.to_world(subarray.centre[None, :])[0], pose.orientation)


def pressures(
    plan: Plan, frame: Frame, arrivals: Arrivals, elements: Elements, method: Synthesis
) -> tuple[Floats, Floats]:
    """Echoes and direct arrivals (sensor, sample) in Pa, each by itself, of given arrivals."""
    reception, received = reception_of(plan, frame)._replace(elements=elements), []
    for mask in (~arrivals.direct, arrivals.direct):
        arguments = arrivals.select(mask), frame.moment.snaps, reception
        unrounded = getattr(method, "pressure", None)
        received.append(unrounded(*arguments)[0] if unrounded is not None else method.signals(*arguments).pressure)
    return np.asarray(received[0], float), np.asarray(received[1], float)
