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
    """The image of an echo window (start, stop) in s, the signals that it was made of, and their beams.

    The direct pulses of later snaps that are heard in the window are taken out; of the first one, where the plan says
    so. Where the plan takes the direct pulse out, what may be left of it is asked for in every beam.
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
    """The image of the last part of the record that is as long as the echo window, where no snap says when echoes
    come."""
    stop = signals.start + (signals.pressure.shape[1] - 1) / signals.sampling_frequency
    start = max(stop - (plan.windows.echo_stop - plan.windows.echo_start), signals.start)
    return plan.choices.beamforming.image(signals, elements, plan.scene.sonar, start, stop)
