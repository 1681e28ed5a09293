"""What a beamformer errs by, as measured in a few frames against exact delays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sonarsynth.conventions import Floats, Ints, direction
from sonarsynth.description.method import Demand
from sonarsynth.imaging.image_window import snapshots_of
from sonarsynth.planning.listening_windows import frame_start
from sonarsynth.planning.measured.sampled_arrivals import reception_of, sampled_arrivals
from sonarsynth.planning.plans import Plan
from sonarsynth.products import Signals
from sonarsynth.signals.auto_synthesis import DEFAULT_ERROR, deposit_for
from sonarsynth.signals.filtered_pulse import snap_levels

WITHIN = 20.0
"""dB below the brightest beam: down to there beams are compared."""
COMPARED = 250
"""Beams that are, at most: the error of six shipped recipes came out as of a thousand, to 4 %."""
SAFETY = 1.25
"""What was measured in some frames, or at some hydrophones, may be so much more in others."""


@dataclass(frozen=True, eq=False)
class ExactBeams:
    """Bright beams of a frame with the exact delays of a focus: what images are compared with."""

    signals: Signals
    start: float  # s: of the echo window
    stop: float
    row: Ints  # (beam,) elevation index
    column: Ints  # (beam,) azimuth index
    energy: Floats  # (beam,) Pa2 s

    def error(self, plan: Plan, method: Any) -> float:
        """Root mean square error (dB) of an image by `method`."""
        image = method.image(self.signals, plan.elements, plan.scene.sonar, self.start, self.stop).energy.astype(float)
        with np.errstate(divide="ignore"):
            wrong = 10.0 * np.log10(image[self.row, self.column] / self.energy)
        return float(np.sqrt(np.mean(wrong**2)))


def beamformer(plan: Plan, indices: Sequence[int]) -> tuple[Any, float]:
    """The beamformer of a plan, and its error: root mean square in dB, over beams within 20 dB of the brightest."""
    accuracy, exact = plan.recipe.accuracy, dict[Any, list[ExactBeams]]()

    def error(method: Any) -> float:
        if method.exact() not in exact:
            signals = (signals_of_frame(plan, index) for index in indices)
            beams = (exact_beams(plan, method, *sample) for sample in signals if sample is not None)
            exact[method.exact()] = [frame for frame in beams if frame is not None]
        return max((frame.error(plan, method) for frame in exact[method.exact()]), default=0.0)

    demand = Demand(accuracy.image_db / SAFETY, accuracy.exact, error, plan.elements)
    return plan.scene.processing.beamforming.resolve(demand)


def exact_beams(plan: Plan, method: Any, signals: Signals, start: float, stop: float) -> ExactBeams | None:
    """Beams of signals from start to stop (s) that are bright as `method` has them, by the exact delay and sum of its
    focus and weights; None in silence."""
    slow = method.exact()
    elements, sonar = plan.elements, plan.scene.sonar
    energy = method.image(signals, elements, sonar, start, stop).energy.astype(float)
    if not energy.any():
        return None
    row, column = np.nonzero(energy >= energy.max() * 10.0 ** (-WITHIN / 10.0))
    every = -(-len(row) // COMPARED)
    row, column = row[::every], column[::every]
    snapshots = snapshots_of(signals, sonar, start, stop)
    beams = direction(sonar.beams.azimuth[column], sonar.beams.elevation[row])
    exact = np.sum(np.abs(slow.steer(snapshots, elements, sonar, beams)).astype(float) ** 2, axis=1)
    return ExactBeams(signals, start, stop, row, column, snapshots.unit * exact)


def signals_of_frame(plan: Plan, index: int) -> tuple[Signals, float, float] | None:
    """Signals of a frame without noise, and its echo window; None where no snap or no echo is heard."""
    plan = plan.at(index)
    frame = plan.recipe.frame(index)[1]
    arrivals, snaps = sampled_arrivals(plan, frame), frame.moment.snaps
    if not arrivals.direct.any() or arrivals.direct.all():
        return None
    start, samples = frame_start(plan, frame), plan.windows.samples
    sonar = plan.scene.sonar
    # Not by the plan's own method: direct sums would take minutes, and the same signals go into both images.
    imaged = arrivals.select(~arrivals.direct) if plan.windows.direct_removed else arrivals
    signals = deposit_for(DEFAULT_ERROR).signals(imaged, snaps, reception_of(plan, frame))
    direct, levels = arrivals.select(arrivals.direct), np.array(snap_levels(snaps))
    loudest = np.argmax(levels[direct.snap] + 20.0 * np.log10(np.abs(direct.amplitude)))
    clock = float(direct.delay[loudest])
    end = signals.start + samples / sonar.sampling_frequency
    begin, stop = clock + plan.windows.echo_start, min(clock + plan.windows.echo_stop, end)
    sampled = signals.pressure[:, int(np.ceil((begin - start) * sonar.sampling_frequency)) :]
    return (signals, begin, stop) if begin < stop and sampled.any() else None
