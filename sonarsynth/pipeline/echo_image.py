"""The energy image of the echo window, without the direct pulse where echoes come before it is over; and the points and
the range image that its beams give."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.equations.kernels.sensor_rows import power_and_peak
from sonarsynth.imaging.image_window import energy_image, snapshots_of
from sonarsynth.pipeline.handed_on import BeamformedFrame
from sonarsynth.pipeline.stage_times import mark_stage
from sonarsynth.pipeline.synthesis import known_elements
from sonarsynth.planning import Plan, receiver_of
from sonarsynth.products import BeamSpectra, EnergyImage, PointCloud, Signals, SourceEstimates, no_points
from sonarsynth.ranging.cancelling.direct_pulse import remove, remove_others, trusted
from sonarsynth.ranging.clouds import point_cloud
from sonarsynth.ranging.range_image import range_image
from sonarsynth.ranging.received_window import ReceivedWindow
from sonarsynth.receiver import Elements, Sonar
from sonarsynth.recipe.scene import Frame


def image_of(
    plan: Plan, elements: Elements, signals: Signals, estimates: SourceEstimates, window: tuple[float, float]
) -> tuple[Signals, BeamSpectra | None, EnergyImage]:
    """The signals that the image was made of, their beams, and the image of an echo window (start, stop) in s.

    Direct pulses of later snaps are removed where the window holds them. That of the first snap is removed where the
    plan says so; then beams that may still hold too much of it are NaN.
    """
    method, sonar = plan.choices.beamforming, plan.scene.sonar
    length = plan.windows.supports.clear
    if plan.scene.processing.direct_pulse != "keep":
        signals = remove_others(signals, estimates, elements, sonar, length, window)

    def beams_of(received: Signals, start: float, stop: float) -> BeamSpectra:
        return method.beams(snapshots_of(received, sonar, start, stop), elements, sonar)

    def imaging(received: Signals, start: float, stop: float) -> EnergyImage:
        return energy_image(beams_of(received, start, stop).energies(), sonar, start, stop)

    if not plan.windows.direct_removed:
        beams = beams_of(signals, *window)
        return signals, beams, energy_image(beams.energies(), sonar, *window)
    residual = remove(signals, estimates, elements, sonar, length)
    if residual is None:  # what was located is no wave that could be taken out: no echo is told from it
        return signals, None, no_image(sonar, *window, remainder=1.0)
    beams = beams_of(residual, *window)
    image = energy_image(beams.energies(), sonar, *window)
    return residual, beams, trusted(image, signals, residual, sonar, imaging, float(estimates.time[0]) - length)


def no_image(sonar: Sonar, start: float, stop: float, remainder: float = np.nan) -> EnergyImage:
    """An image of which nothing is known."""
    silent = np.full((sonar.beams.elevations, sonar.beams.azimuths), np.nan, np.float32)
    return EnergyImage(silent, sonar.beams.azimuth, sonar.beams.elevation, start, stop, remainder)


def image_without_clock(plan: Plan, elements: Elements, signals: Signals) -> EnergyImage:
    """The image where no snap was located to tell when echoes come: of the end of the record, as long as the echo
    window."""
    stop = signals.start + (signals.pressure.shape[1] - 1) / signals.sampling_frequency
    start = max(stop - plan.windows.echo_duration, signals.start)
    return plan.choices.beamforming.image(signals, elements, plan.scene.sonar, start, stop)


def _received(plan: Plan, frame: Frame, beamformed: BeamformedFrame) -> ReceivedWindow | None:
    """What ranging needs; None where the image has no clock, for which no beams are kept."""
    image, signals, estimates, beams = beamformed.image, beamformed.imaged, beamformed.estimates, beamformed.beams
    if image is None or signals is None or estimates is None or beams is None:
        return None
    elements, sonar, supports = known_elements(plan, frame), plan.scene.sonar, plan.windows.supports
    some = np.arange(elements.count) % max(elements.count // 16, 1) == 0
    every = 0, signals.pressure.shape[1]
    loudest = power_and_peak(signals.pressure, some & (elements.gain != 0), *every)[1]
    focus, direct = plan.choices.beamforming.focus, beamformed.signals
    return ReceivedWindow(
        elements, sonar, image, beams, loudest, direct, estimates, focus, supports.late, supports.direct
    )


def cloud_of(plan: Plan, frame: Frame, beamformed: BeamformedFrame) -> PointCloud:
    """The points of a frame that has an image; `plan` is that of its sequence."""
    window, choices = _received(plan, frame, beamformed), plan.choices
    if window is None:
        return no_points()
    track = receiver_of(plan, frame).track
    cloud = point_cloud(window, choices.picking, choices.placing, frame.sonar_pose, plan.profile, track)
    mark_stage("range")
    return cloud


def range_image_of(plan: Plan, frame: Frame, beamformed: BeamformedFrame) -> npt.NDArray[np.float32] | None:
    """The range image of a frame (range, azimuth); none as for `cloud_of`. `plan` is that of its sequence."""
    window, grid = _received(plan, frame, beamformed), plan.scene.sonar.ranges
    return None if window is None or grid is None else range_image(window, grid.range, receiver_of(plan, frame).track)
