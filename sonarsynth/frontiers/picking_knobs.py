"""Knobs of picking: how far points lie from the surface that they are of, and how many there are."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from math import inf
from typing import Any

import numpy as np

from sonarsynth.frontiers.image_knobs import imaged
from sonarsynth.frontiers.rows import Point
from sonarsynth.pipeline import BeamformedFrame, cloud_of
from sonarsynth.pipeline.labelling import point_labels
from sonarsynth.planning import Plan
from sonarsynth.products import Arrivals
from sonarsynth.recipe.scene import Frame
from sonarsynth.validation.run_time import timed

NEAR = 0.05
"""m from the surface: points that lie on it."""


def picking_points(plan: Plan, frame: Frame, arrivals: Arrivals, beamformed: BeamformedFrame) -> Iterator[Point]:
    """Walk the settings of the chosen way of picking on what a frame heard; nothing where it has no image."""
    chosen = plan.choices.picking
    if not imaged(beamformed):
        return
    yield picking_point(plan, frame, arrivals, beamformed, "chosen", chosen.kind, chosen)
    for name, method in chosen.variants().items():
        if method != chosen:
            knob, _, setting = name.partition(" at ")
            yield picking_point(plan, frame, arrivals, beamformed, knob, setting, method)


def picking_point(
    plan: Plan, frame: Frame, arrivals: Arrivals, beamformed: BeamformedFrame, knob: str, setting: str, method: Any
) -> Point:
    """A row of the picking stage: the median distance of points from the targets that made them, exact (m)."""
    varied = replace(plan, choices=replace(plan.choices, picking=method))
    cloud, seconds = timed(partial(cloud_of, varied, frame, beamformed))
    estimates = beamformed.estimates
    distance = np.zeros(0)
    if len(cloud) and estimates is not None:
        distance = point_labels(varied, frame, arrivals, estimates, cloud).distance.astype(float)
    off = int(np.isnan(distance).sum())
    distance = distance[np.isfinite(distance)]
    return Point(
        stage="picking",
        knob=knob,
        setting=setting,
        error=float(np.median(distance)) if len(distance) else 0.0,
        unit="m",
        allowed=inf,
        seconds=seconds,
        chosen=knob == "chosen",
        also={
            "points": len(distance),
            "within_5_cm": float(np.mean(distance < NEAR)) if len(distance) else 0.0,
            "largest_m": float(distance.max(initial=0.0)),
            "of_no_target": off,
        },
    )
