"""Labels of source estimates: the true time, direction and place of each snap, and which snap each estimate is of."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.arrays.apertures import half_power_width
from sonarsynth.labels.estimate_labels import Direct, direct_paths, emissions, heard_first
from sonarsynth.pipeline.stored_values import Values, table
from sonarsynth.planning import Plan
from sonarsynth.products import Arrivals, Signals, SourceEstimates
from sonarsynth.ranging.location.association import in_record
from sonarsynth.ranging.range_profiles import aperture_moments
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals.direct_sum import relative_absorption
from sonarsynth.signals.filtered_pulse import envelope_delay
from sonarsynth.sources.snap_pulses import Waveform
from sonarsynth.state import Emission


def heard_directly(plan: Plan, arrivals: Arrivals, snaps: tuple[Emission, ...]) -> Direct:
    """The direct paths of a frame, with the time at which the envelope of each pulse peaks in the band."""
    return direct_paths(arrivals, lambda snap, *way: _envelope(plan, snaps[snap].waveform, *way))


@lru_cache(maxsize=16)  # a snap that rests sounds alike in every frame
def _envelope(plan: Plan, waveform: Waveform, absorption: float, doppler: float) -> float:
    """As the `envelope` of `direct_paths`, of a pulse."""
    sonar = plan.scene.sonar

    def loss(f: Floats) -> Floats:
        return absorption * relative_absorption(plan.absorption, f, sonar.band.centre)

    return envelope_delay(waveform, sonar, loss, doppler)


def estimate_truth(plan: Plan, frame: Frame, direct: Direct) -> Values:
    """When and from where the array hears each snap directly, in degrees, and where the snap is then."""
    snaps, track = frame.moment.snaps, frame.sonar_track
    time, azimuth, elevation = heard_first(direct, len(snaps))
    place = np.full((len(snaps), 3), np.nan)
    moves = plan.scene.physics.doppler and not track.still
    for n in np.flatnonzero(np.isfinite(time)):
        own = track.later(float(time[n])).pose if moves else frame.sonar_pose
        place[n] = own.to_body(snaps[n].position)
    angles = {"azimuth": np.rad2deg(azimuth), "elevation": np.rad2deg(elevation)}
    return table("/truth/emissions", arrival=time, position_at_arrival=place, **angles)


def emission_values(
    plan: Plan, direct: Direct, estimates: SourceEstimates, signals: Signals, snaps: tuple[Emission, ...]
) -> Values:
    """Which snap each estimate came from, and whether the first estimate, the clock, is of a snap that illuminates."""
    band = plan.scene.sonar.band
    emission = emissions(estimates, direct, band.high - band.low, beam_widths(plan).min())
    clock = in_record(estimates, signals, *plan.windows.echo)[:1].any() and emission[0] >= 0
    usable = np.int8(clock and snaps[int(emission[0])].illuminates)
    return table("/source_estimates", emission=emission, usable=usable)


def beam_widths(plan: Plan) -> Floats:
    """Half-power widths (2,) in rad of a beam on the axis of the array, along azimuth and elevation, at the centre of
    the band; no more than 1."""
    wavenumber = plan.scene.sonar.band.centre / plan.scene.sonar.assumed_sound_speed
    extent = np.sqrt(np.diag(aperture_moments(plan.elements))[1:])
    return np.minimum(half_power_width(extent, wavenumber), 1.0)
