"""The energy image of the echo window, without the direct pulse where echoes come before it is over."""

from __future__ import annotations

import numpy as np

from sonarsynth.imaging.image_window import energy_image, snapshots_of
from sonarsynth.planning import Plan
from sonarsynth.products import BeamSpectra, EnergyImage, Signals, SourceEstimates
from sonarsynth.ranging.cancelling.direct_pulse import remove, remove_others, trusted
from sonarsynth.receiver import Elements, Sonar


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
