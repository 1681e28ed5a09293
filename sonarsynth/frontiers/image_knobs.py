"""Knobs of the image and of the cloud: how beams are focused, and how delays become places."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any, get_args

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from sonarsynth.conventions import Floats
from sonarsynth.frontiers.exact_frame import exact_plan
from sonarsynth.frontiers.rows import Point
from sonarsynth.imaging import Beamformer, DenseDelayAndSum, FocusedDelayAndSum
from sonarsynth.imaging.delay_and_sum.zones import cuts
from sonarsynth.pipeline import BeamformedFrame, cloud_of
from sonarsynth.planning import Plan
from sonarsynth.products import EnergyImage, PointCloud
from sonarsynth.ranging import IsovelocityPlacing, Placing
from sonarsynth.receiver import Elements
from sonarsynth.recipe.scene import Frame
from sonarsynth.validation.run_time import timed

BRIGHT = 20.0
"""dB under the brightest beam: beams that count."""
TRIED = 5
"""Ways to cut the array into subarrays that are walked."""

BESIDE = 0.02
"""rad of direction, and m of path: points of two clouds that are further apart are not one."""


def image_points(plan: Plan, beamformed: BeamformedFrame, peers: bool) -> Iterator[Point]:
    """Walk the beamformers on the signals of a frame, other images too (`peers`); nothing where it has no image."""
    chosen: Any = plan.choices.beamforming
    slow = exact_plan(plan).choices.beamforming
    if not imaged(beamformed):
        return
    exact, slowest = timed(lambda: image_of(plan, beamformed, slow))
    settings: list[tuple[str, str, Any]] = []
    if plan.elements.on_lattice and isinstance(slow, DenseDelayAndSum):
        fast: Any = FocusedDelayAndSum(focus=slow.focus, shading=slow.shading)
        methods = [replace(fast, subarrays=cut) for cut in cuts(plan.elements, slow.focus)[:TRIED]]
        settings += [("subarrays", method.row(), method) for method in methods]
        if slow.focus is not None:
            settings += [("focus", "plane waves", replace(fast, focus=None))]
    if getattr(chosen, "bins", "") == "few":
        settings.append(("bins", "all bins", replace(chosen, bins="all")))
    for knob, setting, method in [("chosen", chosen.row(), chosen), *settings]:
        if knob != "chosen" and method == chosen:
            continue
        if method == slow:
            image, seconds = exact, slowest
        else:
            image, seconds = timed(partial(image_of, plan, beamformed, method))
        yield image_point(plan, image.energy, exact.energy, knob, setting, seconds, chosen=knob == "chosen")
    if chosen != slow:
        yield image_point(plan, exact.energy, exact.energy, "exact", "dense", slowest)
    for method in other_images(slow, plan.elements) if peers else ():
        image, seconds = timed(partial(image_of, plan, beamformed, method))
        point = image_point(plan, image.energy, exact.energy, "another image", method.row(), seconds)
        yield replace(point, role="peer")


def other_images(slow: Any, elements: Elements) -> list[Any]:
    """Beamformers that make another image than delay and sum, focused as `slow` is: what differs is no error."""
    kinds = [kind for kind in get_args(get_args(Beamformer)[0]) if kind().exact().kind != slow.kind]
    methods = [kind(focus=slow.focus) if "focus" in kind.__dataclass_fields__ else kind() for kind in kinds]
    return [method for method in methods if not method.refusal(elements)]


def imaged(beamformed: BeamformedFrame) -> bool:
    """Whether a frame has an image."""
    return beamformed.image is not None and bool(np.isfinite(beamformed.image.start))


def image_of(plan: Plan, beamformed: BeamformedFrame, method: Any) -> EnergyImage:
    """The image of what a frame heard, by a method."""
    assert beamformed.image is not None and beamformed.imaged is not None
    image: EnergyImage = method.image(
        beamformed.imaged, plan.elements, plan.scene.sonar, beamformed.image.start, beamformed.image.stop
    )
    return image


def off_by(energy: npt.NDArray[Any], exact: npt.NDArray[Any]) -> Floats:
    """Errors (beam,) in dB of the beams that count: those within `BRIGHT` dB of the brightest."""
    bright = exact >= 10.0 ** (-BRIGHT / 10.0) * exact.max()
    with np.errstate(divide="ignore"):
        return np.asarray(10.0 * np.log10(np.asarray(energy, float)[bright] / np.asarray(exact, float)[bright]))


def image_point(
    plan: Plan,
    energy: npt.NDArray[Any],
    exact: npt.NDArray[Any],
    knob: str,
    setting: str,
    seconds: float,
    *,
    chosen: bool = False,
) -> Point:
    """A row of the image stage."""
    error = off_by(energy, exact)
    return Point(
        stage="image",
        knob=knob,
        setting=setting,
        error=float(np.sqrt(np.mean(error**2))) if len(error) else 0.0,
        unit="dB",
        allowed=plan.recipe.accuracy.image_db,
        seconds=seconds,
        chosen=chosen,
        also={"largest_db": float(np.abs(error).max(initial=0.0)), "beams": len(error)},
    )


def range_points(plan: Plan, frame: Frame, beamformed: BeamformedFrame) -> Iterator[Point]:
    """Walk the methods of placing on what is picked of a frame; nothing where it has no image."""
    chosen, slow = plan.choices.placing, exact_plan(plan).choices.placing
    if not imaged(beamformed):
        return
    exact, slowest = timed(lambda: placed(plan, frame, beamformed, slow))
    for method in dict.fromkeys((chosen, IsovelocityPlacing(), slow)):
        if method == slow:
            cloud, seconds = exact, slowest
        else:
            cloud, seconds = timed(partial(placed, plan, frame, beamformed, method))
        yield range_point(plan, cloud, exact, method, seconds, chosen=method == chosen)


def placed(plan: Plan, frame: Frame, beamformed: BeamformedFrame, method: Placing) -> PointCloud:
    """The point cloud of what a frame heard, its echoes placed by a method."""
    return cloud_of(replace(plan, choices=replace(plan.choices, placing=method)), frame, beamformed)


def range_point(
    plan: Plan, cloud: PointCloud, exact: PointCloud, method: Any, seconds: float, *, chosen: bool
) -> Point:
    """A row of the range stage."""
    metres, angle, alone = apart(cloud, exact)
    return Point(
        stage="range",
        knob="method",
        setting=method.kind,
        error=float(np.max(metres, initial=0.0)),
        unit="m",
        allowed=plan.recipe.accuracy.range_m,
        seconds=seconds,
        chosen=chosen,
        also={
            "median": float(np.median(metres)) if len(metres) else 0.0,
            "direction_rad": float(np.max(angle, initial=0.0)),
            "points": len(metres),
            "in_one_alone": alone,
        },
    )


def apart(cloud: PointCloud, exact: PointCloud) -> tuple[Floats, Floats, int]:
    """Differences of the points that two clouds share, in range (point,) m and direction (point,) rad; and how many
    points are in one of them alone.

    Points are shared that are each other's nearest in direction and delay, within `BESIDE` rad and metres.
    """
    if not (len(cloud) and len(exact)):
        return np.zeros(0), np.zeros(0), len(cloud) + len(exact)
    points, exact_points = (np.column_stack([c.azimuth, c.elevation, 1500.0 * c.delay]) for c in (cloud, exact))
    far, partner = cKDTree(exact_points).query(points, distance_upper_bound=BESIDE)
    shared = np.flatnonzero(np.isfinite(far))
    back = cKDTree(points).query(exact_points[partner[shared]])[1]
    shared = shared[back == shared]
    partner = partner[shared]
    a, b = cloud.position[shared].astype(float), exact.position[partner].astype(float)
    angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("pi,pi->p", a, b))
    metres = np.abs(cloud.range[shared].astype(float) - exact.range[partner])
    return metres, angle, len(cloud) + len(exact) - 2 * len(shared)
