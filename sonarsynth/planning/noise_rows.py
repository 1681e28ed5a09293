"""Rows of a plan for each part of the noise: its level, what its coherence errs by, and what it costs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import REFERENCE_PRESSURE, depth
from sonarsynth.description.method import FrameSize
from sonarsynth.environment.noise import Noise
from sonarsynth.environment.noise.noise_field import SECONDS as DRAW_SECONDS
from sonarsynth.receiver import SensorErrors
from sonarsynth.signals.noise.drawing import coherence_error, seconds

if TYPE_CHECKING:
    from sonarsynth.planning.plans import Plan

ELECTRONICS, SENSORS = "electronics", "sensors"
"""Stages beside the parts of the noise."""
ERROR_SECONDS = 40e-9
"""Of one core to filter a sample of one channel."""
NoiseRow = tuple[str, str, str, str, float, int]
"""As `costs.Row`."""


def part_names(noises: tuple[Noise, ...]) -> tuple[str, ...]:
    """What each part of the noise is called: by its kind, numbered where there are several."""
    kinds = [noise.kind for noise in noises]
    return tuple(
        f"noise {kind}" + (f" {kinds[:n].count(kind) + 1}" if kinds.count(kind) > 1 else "")
        for n, kind in enumerate(kinds)
    )


def noise_rows(plan: Plan, size: FrameSize) -> list[NoiseRow]:
    """A row for each part of the noise."""
    scene, elements = plan.scene, plan.elements
    noises = scene.world.environment.noises
    pose = plan.recipe.frame(0)[1].sonar_pose
    sound_speed = float(plan.profile.at(depth(pose.position)))
    centre, rows = np.array([scene.sonar.band.centre]), list[NoiseRow]()
    for name, noise in zip(part_names(noises), noises, strict=True):
        level = 10.0 * np.log10(float(noise.density(centre)[0]) / REFERENCE_PRESSURE**2)
        said = f"{level:.1f} dB re 1 uPa2/Hz at {centre[0] / 1e3:.3g} kHz"
        way, error, work = (
            "independent between hydrophones",
            "none",
            noise.cost(size),
        )
        if noise.directions is not None:
            wrong, way = coherence_error(noise.directions, elements, pose, scene.sonar, sound_speed)
            way, error = f"{noise.directions.kind}: {way}", f"{wrong:.2g} of the coherence"
            work = seconds(noise.directions, elements, plan.sizes["sample"])
        elif noise.correlated:
            way = "by its cross spectral density"
        rows.append((name, f"{noise.row()}, {way}", said, error, work, 0))
    return [*rows, *_channel_rows(plan)]


def _channel_rows(plan: Plan) -> list[NoiseRow]:
    """Rows of the errors of the channels and of their noise."""
    sonar, rows, sizes = plan.scene.sonar, list[NoiseRow](), plan.sizes
    each = sizes["sensor"] * sizes["sample"]
    if (errors := sonar.sensor_errors) is not None:
        usual = SensorErrors()
        given = [name for name in vars(usual) if getattr(errors, name) != getattr(usual, name) and name != "known"]
        method = f"{', '.join(given) or 'no errors'}; processing knows {errors.known}"
        rows.append(
            (SENSORS, method.replace("_", " "), "requested", "none", ERROR_SECONDS * each, 36 * sizes["sensor"])
        )
    if sonar.electronics is not None:
        said = f"{sonar.electronics.level:.1f} dB re 1 uPa2/Hz"
        rows.append((ELECTRONICS, "independent between channels", said, "none", DRAW_SECONDS * each, 0))
    return rows
