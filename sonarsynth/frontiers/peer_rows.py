"""Rows of the peers, beside ours: on the same arrivals or signals, against the same exact computation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from sonarsynth.conventions import evenly
from sonarsynth.frontiers.exact_frame import golden, signal_point
from sonarsynth.frontiers.image_knobs import image_of, imaged
from sonarsynth.frontiers.peers import (
    acoular_image,
    finufft_signals,
    installed,
    likeness,
    plain,
    thesis_image,
    thesis_pulse,
)
from sonarsynth.frontiers.rows import Point
from sonarsynth.frontiers.signal_knobs import FINER
from sonarsynth.imaging import DenseDelayAndSum
from sonarsynth.pipeline import BeamformedFrame
from sonarsynth.planning import Plan
from sonarsynth.planning.measured.sampled_arrivals import reception_of
from sonarsynth.products import Arrivals
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals import GriddedSynthesis
from sonarsynth.validation.run_time import timed

THESIS_BEAMS = 24
"""Bright beams that the thesis's loop is timed on."""
EPSILONS = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8)
"""Errors that FINUFFT is asked for."""
PLAIN = "point hydrophones, one absorption"


def synthesis_peers(plan: Plan, frame: Frame, arrivals: Arrivals) -> Iterator[Point]:
    """FINUFFT and our synthesis on paths and hydrophones as plain as FINUFFT needs them; `arrivals`: at the whole
    array."""
    if not installed("finufft"):
        yield absent("synthesis", "FINUFFT")
        return
    paths = plain(arrivals, plan, frame)
    if not len(paths.delay):
        return
    reception = reception_of(plan, frame)._replace(elements=replace(plan.elements, face=0.0), absorption=None)
    arguments = (paths, frame.moment.snaps, reception)
    exact = golden(plan, FINER).pressure(*arguments)[0]

    def row(name: str, setting: str, pressure: np.ndarray, seconds: float) -> Point:
        error = float(np.linalg.norm(pressure - exact) / np.linalg.norm(exact))
        return signal_point(
            plan, "synthesis", name, setting, error, seconds, role="peer", also={"paths": len(paths.delay)}, note=PLAIN
        )

    for asked in EPSILONS:
        pressure, seconds = timed(partial(finufft_signals, plan, frame, paths, asked))
        yield row("FINUFFT", f"{asked:g}", pressure, seconds)
    method = plan.choices.synthesis
    if isinstance(method, GriddedSynthesis):
        pressure, seconds = timed(lambda: method.pressure(*arguments)[0])
        yield row("ours, on the same", "chosen", pressure, seconds)


def image_peers(plan: Plan, frame: Frame, arrivals: Arrivals, beamformed: BeamformedFrame) -> Iterator[Point]:
    """The thesis's loop, and Acoular: errors whatever the scale of the image."""
    if not imaged(beamformed):
        return
    assert beamformed.image is not None and beamformed.imaged is not None
    sonar, focus = plan.scene.sonar, getattr(plan.choices.beamforming, "focus", None)
    slow = DenseDelayAndSum(focus=focus, shading="uniform")
    exact = np.asarray(image_of(plan, beamformed, slow).energy, float)
    bright = np.flatnonzero(exact.ravel() >= 0.01 * exact.max())
    beams = bright[evenly(len(bright), THESIS_BEAMS)]
    if len(beams) > 1 and (~arrivals.direct).any():
        pulse = thesis_pulse(frame.moment.snaps[0], plan)
        energy, seconds = thesis_image(plan, arrivals, pulse, sonar.sampling_frequency, beams, sonar.band.centre)
        note = f"cost from {len(beams)} beams; whatever the scale"
        yield _image_row(
            plan, "the thesis's loop", likeness(energy, exact.ravel()[beams]), seconds * exact.size / len(beams), note
        )
    if not installed("acoular"):
        yield absent("image", "Acoular")
        return
    energy, seconds = acoular_image(
        plan, beamformed.imaged, beamformed.image.start, beamformed.image.stop, focus or 1e6
    )
    yield _image_row(plan, "Acoular", likeness(energy, exact), seconds, "whatever the scale")


def _image_row(plan: Plan, name: str, like: dict[str, float], seconds: float, note: str) -> Point:
    return Point(
        stage="image",
        knob=name,
        setting="BeamformerTime" if name == "Acoular" else "every ray, every beam",
        error=like["rms_error_db"],
        unit="dB",
        allowed=plan.recipe.accuracy.image_db,
        seconds=seconds,
        role="peer",
        also={"largest_db": like["largest_error_db"], "correlation": like["correlation"]},
        note=note,
    )


def absent(stage: str, name: str) -> Point:
    """The row of a peer that is not there."""
    nothing = float("nan")
    return Point(stage, name, "not installed", nothing, "", nothing, nothing, role="peer", note="not installed")
