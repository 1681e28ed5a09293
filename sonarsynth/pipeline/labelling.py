"""Labels that need a plan: the number of the frame, the band of levels, and whose echo each point is."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.geometry.motion import Track
from sonarsynth.labels import SLICES, Band, SonarTiming, label_points
from sonarsynth.pipeline.stored_values import Values, of_isolated, sensor_values, table
from sonarsynth.pipeline.synthesis import errors_of, known_elements
from sonarsynth.planning import Plan
from sonarsynth.planning.pulse_durations import lateness
from sonarsynth.products import Arrivals, LinkBudget, PointCloud, PointLabels, SourceEstimates
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals.direct_sum import relative_absorption
from sonarsynth.signals.filtered_pulse import snap_gains
from sonarsynth.signals.isolated_paths import energy_in_slices, lateness_in_slices, measured_levels
from sonarsynth.sources.snap_pulses import Waveform
from sonarsynth.state import Emission


def expansion_error(plan: Plan, arrivals: Arrivals) -> float:
    """Error (dB) of a level from expanding wavefronts and amplitudes over the aperture, as measured at its probes.

    A beam of sensors that are up to phi out of phase loses at most 20 log10 cos phi. NaN where a sensor has no ray.
    """
    if not np.isfinite([arrivals.wavefront_error, arrivals.amplitude_error]).all():
        return float("nan")
    phase = min(2 * np.pi * plan.scene.sonar.band.high * arrivals.wavefront_error, 1.5)
    return float(20 * np.log10((1.0 + arrivals.amplitude_error) / np.cos(phase)))


def band_of(plan: Plan, snaps: tuple[Emission, ...]) -> Band:
    """The band that levels are taken in: one, and what is known of it, for all frames whose snaps are alike."""
    return _band(plan, tuple(snap.waveform for snap in snaps), tuple(snap_gains(snaps).tolist()))


@lru_cache(maxsize=2)
def _band(plan: Plan, waveforms: tuple[Waveform, ...], gains: tuple[float, ...]) -> Band:
    """The same of pulses and factors on them, one a snap."""
    sonar = plan.scene.sonar
    alike = np.array([energy_in_slices(waveform, sonar, SLICES) for waveform in waveforms]).reshape(-1, SLICES)
    energy = alike * np.array(gains)[:, None] ** 2
    late = np.array([lateness_in_slices(waveform, sonar, SLICES) for waveform in waveforms]).reshape(-1, SLICES)
    band = Band(sonar.band.low, sonar.band.high, energy, np.zeros(SLICES), late)
    return replace(band, relative=relative_absorption(plan.absorption, band.frequency, sonar.band.centre))


def isolated_levels(plan: Plan, frame: Frame, budget: LinkBudget, snap_level: Floats) -> Floats:
    """Levels (snap, target + 1, family) in dB of the isolated paths of the link budget, measured in signals of each."""
    method, sonar = plan.choices.synthesis, plan.scene.sonar
    measured = measured_levels(method, budget.isolated, frame.moment.snaps, sonar, plan.absorption)
    return of_isolated(budget, snap_level[budget.isolated.snap] + measured)


def point_labels(
    plan: Plan,
    frame: Frame,
    arrivals: Arrivals,
    estimates: SourceEstimates,
    cloud: PointCloud,
    scattered: Arrivals | None = None,
) -> PointLabels:
    """Whose echo each point of a cloud is; scattered: paths of what scatters in surface, bottom and water."""
    sonar = plan.scene.sonar
    moves = plan.scene.physics.doppler
    moment = frame.moment if moves else replace(frame.moment, bodies=tuple(body.frozen for body in frame.moment.bodies))
    listening = SonarTiming(
        known_elements(plan, frame),
        sonar.assumed_sound_speed,
        plan.choices.beamforming.focus,
        float(estimates.time[0]) if len(estimates.time) else np.nan,
        frame.sonar_track if moves else Track(frame.sonar_pose, np.zeros(3)),
        np.array([lateness(snap.waveform, sonar) for snap in frame.moment.snaps]),
    )
    return label_points(cloud, arrivals, band_of(plan, frame.moment.snaps), moment, listening, scattered)


def frame_values(plan: Plan, frame: Frame) -> Values:
    """Which frame it is."""
    split = plan.recipe.split(frame.index)
    values = table("/", trajectory=frame.trajectory, step=frame.step, time=frame.time, split=split)
    drawn = errors_of(plan, frame)
    return values if drawn is None else values | sensor_values(drawn)
