"""From echoes to a point cloud with predicted errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.arrays.bistatic_range import bistatic_range
from sonarsynth.products import EnergyImage, PointCloud, Signals, SourceEstimates, no_points
from sonarsynth.ranging.beam_echoes import Echoes, Profiles, over_threshold, pick, range_profiles
from sonarsynth.receiver import Elements, Sonar

SLOPE = 0.7
"""Standard slope of a surface against the beam: its range changes by this share of the distance across the beam."""


@dataclass(frozen=True, eq=False)
class Solution:
    """Where echoes come from; NaN where there is no answer or an ill-conditioned one. Sonar frame."""

    position: Floats  # (beam, xyz) m
    range: Floats  # (beam,) m
    by_path: Floats  # (beam,) dr/dx, x the excess path
    by_angle: Floats  # (beam,) m/rad
    by_source: Floats  # (beam, xyz) dr/dS


Solve = Callable[[Floats, Floats, Floats], Solution]
"""Of delays (beam,) after the direct arrival, beams (beam, xyz) and the source position (xyz)."""
Pick = Callable[[Profiles, EnergyImage, float], Echoes]
"""The echo of each profile, of those of an image; the number is how local it must be (dB)."""


def isovelocity_solution(delay: Floats, beam: Floats, source: Floats, sound_speed: float) -> Solution:
    """Closed form; NaN where the target would be too near the line from source to array."""
    found = bistatic_range(sound_speed * delay, beam, source)
    r = np.where(found.ill_conditioned, np.nan, found.range)
    return Solution(r[:, None] * beam, r, found.by_path, found.by_angle, found.by_source)


def point_cloud(
    signals: Signals,
    image: EnergyImage,
    estimates: SourceEstimates,
    elements: Elements,
    sonar: Sonar,
    *,
    threshold: float,
    locality: float,
    focus: float | None,
    solve: Solve,
    direct: Signals | None = None,
    picking: Pick = pick,
) -> PointCloud:
    """Echoes of the beams over threshold, placed by `solve`; `direct`: signals with the direct pulse in them, where
    it was taken out of `signals`; `picking`: which echo of a beam's profile is taken."""
    beams, left_out = over_threshold(image, threshold, float(np.abs(signals.pressure).max(initial=0.0)))
    located = len(estimates.time) > 0 and np.isfinite(estimates.time[0]) and np.isfinite(estimates.position[0]).all()
    if not (located and len(beams[0])):
        return no_points()
    profiles = range_profiles(signals, image, estimates, elements, sonar, beams, focus, direct or signals)
    echoes = picking(profiles, image, locality)
    own = np.isfinite(echoes.delay)
    solution = solve(echoes.delay[own], profiles.direction[own], estimates.position[0])
    clock = np.hypot(echoes.delay_error, echoes.extent)[own]
    error = range_error(solution, echoes.delay[own], clock, echoes.angle_error[own], estimates, sonar)
    row, column = profiles.row[own], profiles.column[own]
    cloud = PointCloud(
        position=solution.position.astype(np.float32),
        range=solution.range.astype(np.float32),
        range_error=error.astype(np.float32),
        azimuth=image.azimuth[column],
        elevation=image.elevation[row],
        delay=echoes.delay[own].astype(np.float32),
        energy=image.energy[row, column],
        overflow=left_out,
    )
    return cloud.select(np.flatnonzero(np.isfinite(solution.range) & (solution.range > 0) & np.isfinite(error)))


def range_error(
    solution: Solution,
    delay: Floats,
    delay_error: Floats,
    angle_error: Floats,
    estimates: SourceEstimates,
    sonar: Sonar,
) -> Floats:
    """Predicted standard error (beam,) in m: beam width, clock, snap position, sound speed.

    The echo comes from `angle_error` beside the beam, where the same delay means another range (dr/dpsi), and where a
    sloping surface has another range as well (`SLOPE`). delay_error is of the clock and of the depth of the target in
    the beam: where a beam holds echoes of several delays, its axis may meet the surface of another than the loudest.
    """
    c = sonar.assumed_sound_speed
    beside = np.hypot(solution.by_angle, SLOPE * solution.range) * angle_error
    clock = solution.by_path * c * delay_error
    g = solution.by_source
    snap = np.einsum("bi,ij,bj->b", g, estimates.position_covariance[0], g)
    speed = solution.by_path * delay * sonar.sound_speed_error
    return np.asarray(np.sqrt(beside**2 + clock**2 + np.maximum(snap, 0.0) + speed**2))
