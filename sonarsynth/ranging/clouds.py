"""From echoes to a point cloud with predicted errors."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sonarsynth.conventions import Floats, azimuth_elevation, depth
from sonarsynth.description.method import returned_rows
from sonarsynth.environment.sea import Profile
from sonarsynth.equations.arrays.apertures import defocus_spread
from sonarsynth.geometry import Pose, unit
from sonarsynth.geometry.motion import Track
from sonarsynth.products import PointCloud, SourceEstimates, no_points
from sonarsynth.ranging.illumination import by_snap, with_suspects
from sonarsynth.ranging.picking.picked_echoes import PickedEchoes, tangents
from sonarsynth.ranging.placing.solution import Solution
from sonarsynth.ranging.range_profiles import aperture_moments
from sonarsynth.ranging.received_window import ReceivedWindow
from sonarsynth.receiver import Sonar
from sonarsynth.receiver.mirror_images import plane_normal

if TYPE_CHECKING:
    from sonarsynth.ranging.picking import PickingMethod
    from sonarsynth.ranging.placing import PlacingMethod

LEAST_HEIGHT = 0.5
"""m: above and below the middle of the way of an echo, over which gradients are taken at least."""


def point_cloud(
    window: ReceivedWindow, picking: PickingMethod, placing: PlacingMethod, sonar_pose: Pose, profile: Profile,
    track: Track | None = None,
) -> PointCloud:  # fmt: skip
    """The echoes of `picking` where `placing` puts them, each by the located snap that lit it (`illumination`); none of
    an echo that has no place, and none at all where no snap was located. profile: the sound speed of the water; track:
    of a sonar that moves, which places are relative to where it hears the echo."""
    if not window.located:
        return no_points()
    echoes = returned_rows(picking, "picks", picking.picks(window), PickedEchoes, "delay", ("azimuth", "delay"), {})
    velocity, spin, snaps = np.zeros(3), np.zeros(3), window.estimates
    if track is not None and not track.still:
        middle = 0.5 * float(np.mean(echoes.delay)) if len(echoes.delay) else 0.0
        clock = float(snaps.time[0])
        sonar_pose, (velocity, spin) = track.later(clock).pose, track.later(clock + middle).in_own_frame
        echoes = _at_true_directions(echoes, velocity, window)
    placer = _Placer(placing, sonar_pose, profile, velocity, spin)
    snaps = with_suspects(snaps)
    rows = np.flatnonzero(np.isfinite(snaps.position).all(axis=1))
    clouds = [_placed(echoes, window, snaps, int(row), placer) for row in rows]
    if len(rows) == 1:
        (cloud,) = clouds
    else:
        start, stop = (t - float(snaps.time[0]) for t in (window.image.start, window.image.stop))
        cloud = by_snap(clouds, rows, snaps, (start, stop))
    return cloud.select(np.flatnonzero(np.isfinite(cloud.range) & (cloud.range > 0) & np.isfinite(cloud.range_error)))


class _Placer(NamedTuple):
    """What places are computed with."""

    placing: PlacingMethod
    pose: Pose
    profile: Profile
    velocity: Floats  # (xyz) m/s: of the sonar, in its own frame
    spin: Floats  # (xyz) rad/s


def _placed(
    echoes: PickedEchoes, window: ReceivedWindow, snaps: SourceEstimates, row: int, placer: _Placer
) -> PointCloud:
    """A point of every echo, as lit by a row of `snaps`; NaN where there is no place."""
    source, beam = snaps.position[row], echoes.beam
    delay = echoes.delay - float(snaps.time[row] - snaps.time[0])
    wide = {"position": (3,), "by_source": (3,)}
    solution = placer.placing.place(delay, beam, source, window.sonar, placer.pose, placer.profile)
    solution = returned_rows(placer.placing, "place", solution, Solution, "range", (), wide, len(beam))
    if placer.velocity.any() or placer.spin.any():
        shift = -delay[:, None] * (placer.velocity + np.cross(placer.spin, source))
        solution = solution.as_array_moves(source, shift)
    late = window.late if row == 0 else np.hypot(window.late, np.hypot(snaps.time_error[0], snaps.time_error[row]))
    echoes = echoes.but(delay_error=np.hypot(echoes.delay_error, late))
    echoes = _with_defocus(echoes, solution.range, window)
    error = range_error(solution, echoes, snaps, window.sonar, row)
    if not placer.profile.uniform:
        echoes = _with_bending(echoes, beam, solution.range, placer.pose, placer.profile)
    return PointCloud(
        position=solution.position.astype(np.float32),
        range=solution.range.astype(np.float32),
        range_error=error.astype(np.float32),
        azimuth=echoes.azimuth,
        azimuth_error=echoes.azimuth_error,
        elevation=echoes.elevation,
        elevation_error=echoes.elevation_error,
        delay=echoes.delay.astype(np.float32),
        energy=echoes.energy,
        snr=echoes.snr.astype(np.float32),
        overflow=echoes.overflow,
    )


def _with_defocus(echoes: PickedEchoes, distance: Floats, window: ReceivedWindow) -> PickedEchoes:
    """Echoes with what beams that are not focused at their distance (echo,) m add to the errors of directions."""
    across = tangents(echoes.azimuth, echoes.elevation)
    extent = np.sqrt(np.maximum(np.sum(across @ aperture_moments(window.elements) * across, axis=-1), 0.0))
    wavenumber = 2.0 * np.pi * window.sonar.band.centre / window.sonar.assumed_sound_speed
    with np.errstate(divide="ignore"):
        curvature = 1.0 / distance - (1.0 / window.focus if window.focus else 0.0)
    return echoes.further_off(*defocus_spread(extent, curvature, wavenumber))


def _with_bending(
    echoes: PickedEchoes, beam: Floats, distance: Floats, sonar_pose: Pose, profile: Profile
) -> PickedEchoes:
    """Echoes with what bent rays add to the errors of directions, which are those of rays as they arrive: an arc is
    r g cos a/(2c) beside its chord in the vertical plane, r the distance (echo,) m, g the mean gradient of the sound
    speed on the way."""
    up, own = sonar_pose.rotation[2], float(depth(sonar_pose.position))
    other = np.maximum(own - distance * (beam @ up), 0.0)
    middle, half = 0.5 * (own + other), np.maximum(0.5 * np.abs(other - own), LEAST_HEIGHT)
    gradient = (profile.at(middle + half) - profile.at(middle - half)) / (2.0 * half)
    arc = 0.5 * distance * np.abs(gradient) / float(profile.at(own))
    return echoes.further_off(*arc * (tangents(echoes.azimuth, echoes.elevation) @ up))


def _at_true_directions(echoes: PickedEchoes, velocity: Floats, window: ReceivedWindow) -> PickedEchoes:
    """Echoes where they come from, of beams that an array at rest would hear them in; velocity (xyz): m/s."""
    live, c = window.elements.position[window.elements.gain != 0], window.sonar.assumed_sound_speed
    normal = plane_normal(live, c / window.sonar.band.centre)
    azimuth, elevation = azimuth_elevation(true_directions(echoes.beam, velocity / c, normal))
    return echoes.but(azimuth=azimuth, elevation=elevation)


def true_directions(beam: Floats, mach: Floats, normal: Floats | None) -> Floats:
    """Where (echo, xyz) waves come from that an array which moves by `mach` (xyz) m per m of sound hears in beams
    (echo, xyz) that are steered for one at rest.

    A sensor q meets a plane wave from u at -q.u/(c (1 + u.mach)): in the plane of the array, to which there is a
    `normal`, the beam is u/(1 + u.mach). An array with depth (None) hears it in the beam u.
    """
    if normal is None:
        return beam
    along, u = beam @ normal, beam
    for _ in range(3):
        within = (beam - along[:, None] * normal) * (1.0 + u @ mach)[:, None]
        rest = np.sqrt(np.maximum(1.0 - np.sum(within**2, axis=1), 0.0))
        u = within + np.copysign(rest, along)[:, None] * normal
    return unit(u)


def range_error(
    solution: Solution, echoes: PickedEchoes, estimates: SourceEstimates, sonar: Sonar, row: int = 0
) -> Floats:
    """Predicted standard error (echo,) in m of the range of where an echo was made, lit by a row of `estimates`:
    direction, clock, snap position, sound speed, and what placing itself leaves out.

    The same delay means another range in another direction (dr/dpsi, psi the angle between beam and source). Another
    sound speed moves the snap as well, which makes up for some of what it does to the range.
    """
    c = sonar.assumed_sound_speed
    beside = solution.by_angle * _angle_error(echoes, estimates.position[row])
    clock = solution.by_path * c * echoes.delay_error
    g = solution.by_source
    snap = np.sum(g @ estimates.position_covariance[row] * g, axis=1)
    moved = g @ estimates.position_by_speed[row] * sonar.sound_speed_error  # which `snap` holds
    speed = solution.by_speed * sonar.sound_speed_error
    both = np.maximum(snap + speed * (speed + 2.0 * moved), 0.0)
    return np.asarray(np.sqrt(beside**2 + clock**2 + both + solution.model_error**2))


def _angle_error(echoes: PickedEchoes, source: Floats) -> Floats:
    """Standard error (echo,) in rad of the angle between echo and source."""
    beam, across = echoes.beam, tangents(echoes.azimuth, echoes.elevation)
    away = source - (beam @ source)[:, None] * beam
    toward = unit(np.where(away.any(axis=1, keepdims=True), away, across[1]))
    up, port = np.sum(across * toward, axis=-1)
    level = np.cos(echoes.elevation)
    variance = (port * level * echoes.azimuth_error) ** 2 + (up * echoes.elevation_error) ** 2
    return np.asarray(np.sqrt(np.maximum(variance + 2.0 * port * level * up * echoes.error_product, 0.0)))
