"""The axes along which peaks are looked for, and how far peaks err along them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Bools, Floats, Ints, direction
from sonarsynth.equations.arrays.bistatic_range import bistatic_range, path_by_beam
from sonarsynth.products import EnergyImage
from sonarsynth.ranging.location import pulse_times
from sonarsynth.ranging.range_profiles import Profiles, aperture_moments
from sonarsynth.ranging.received_window import ReceivedWindow

RESOLVED = 1.0
"""An axis of the grid as long as this, in units of the roughness of noise along it, has peaks along it."""
CENTRE_ERROR = np.array([1.3, 1.3, 0.4])
"""Standard error of a peak along elevation, azimuth and delay over how far the centre of power about it is from it
(fitted to random scenes, as `test_points_err_by_what_is_predicted` has them)."""
SURFACE_ERROR = np.array([0.05, 0.05, 0.17])
"""Standard error along these, in widths, of echoes of surfaces, not points (fitted to these)."""
TOLD_APART = 0.7
"""Widths in delay by which parts of a surface that overlap in a peak differ (fitted to these and shipped recipes)."""
UNKNOWN = 0.5
"""Standard error of a direction along an axis that is not resolved, in half widths of the beam."""


@dataclass(frozen=True, eq=False)
class Axes:
    """The axes of the volume, elevation (rad), azimuth (rad) and delay (s): how an echo and noise change along them."""

    step: Floats  # (3,) 0 of an axis of one beam
    cells: Ints  # (3,)
    sharpness: Floats  # (3,) the amplitude of an echo falls as 1 - (sharpness x)^2/2; 1/sharpness: its width
    roughness: Floats  # (3,) standard deviation of the derivative of noise over that of noise, where an echo is

    @staticmethod
    def of(window: ReceivedWindow, profiles: Profiles) -> Axes:
        """Of the beams of an image."""
        image, moments = window.image, profiles.moments
        middle = float(np.mean(image.elevation[profiles.row])), float(np.mean(image.azimuth[profiles.column]))
        across = _tangents(*middle)
        aperture = np.sqrt(np.sum(across @ aperture_moments(window.elements) * across, axis=1))  # m, rms
        k = 2 * np.pi / window.sonar.assumed_sound_speed
        return Axes(
            step=np.array([*grid_steps(image), profiles.step]),
            cells=np.array([*image.energy.shape, profiles.power.shape[1]]),
            sharpness=np.append(k * moments.echo_frequency * aperture, 2 * np.pi * moments.echo_band),
            roughness=np.append(k * moments.noise_frequency * aperture, 2 * np.pi * moments.noise_band),
        )

    @property
    def resolved(self) -> Bools:
        """(3,) whether peaks are told along an axis: it is longer than noise is smooth, of three cells at least."""
        return np.asarray((self.cells >= 3) & (self.step * self.cells * self.roughness > RESOLVED))

    def sizes(self, profiles: Profiles) -> Floats:
        """Lengths (3,) of the volume that is searched, as `peak_level` takes them."""
        step = np.maximum(self.step[:2], 1e-12)
        share = len(profiles.power) / self.cells[:2].prod()  # of all beams, whatever the outline of those looked at
        angle = step * self.cells[:2] * np.sqrt(share) * self.roughness[:2] * self.resolved[:2]
        lasting = max(profiles.power.shape[1] * profiles.step - 2 * pulse_times.PULSE_HALF, profiles.step)  # s
        return np.append(angle, lasting * 2 * np.pi * profiles.moments.noise_own_band)

    def errors(self, snr: Floats, centre: Floats, later: Floats) -> tuple[Floats, Floats]:
        """Predicted standard errors (peak, 3) in rad, rad, s, and covariance (peak,) of angles; snr (peak,): of powers.

        Noise moves the top of an amplitude that falls as 1 - (sharp x)^2/2 by its derivative over the bend, of standard
        deviation rough/(sharp^2 (2 snr)^1/2). Where echoes overlap the `centre` of their power (peak, 3), in widths
        from the peak, is beside it: the peak is taken to err by about as much (`CENTRE_ERROR`), and that way. Parts of
        a surface at one range are heard `later` (peak, 2), s per rad, and so told apart: what overlaps in a peak, and
        what it errs by, lies along the line of one delay. C^-1 = D^-1 + l l^T/(TOLD_APART width)^2 is that of surfaces.
        """
        sharp = np.maximum(self.sharpness, [1e-3, 1e-3, 0.0])
        noise = self.roughness / (sharp**2 * np.sqrt(2.0 * snr[:, None]))
        surface = np.broadcast_to((SURFACE_ERROR / sharp) ** 2, noise.shape).copy()
        apart = surface[:, :2] * later * self.resolved[:2].all()
        narrowed = apart / np.sqrt((TOLD_APART / sharp[2]) ** 2 + np.sum(apart * later, axis=1))[:, None]
        surface[:, :2] -= narrowed**2
        resolved_error = np.sqrt(noise**2 + surface + (CENTRE_ERROR * centre / sharp) ** 2)
        unresolved_error = UNKNOWN * np.maximum(1.0 / sharp, 0.5 * self.step)
        error = np.minimum(np.where(self.resolved, resolved_error, unresolved_error), [np.pi, np.pi, np.inf])
        product = np.prod((CENTRE_ERROR * centre / sharp)[:, :2], axis=1) - np.prod(narrowed, axis=1)
        return error, self.resolved[:2].all() * product


def later_beside(window: ReceivedWindow, elevation: Floats, azimuth: Floats, delay: Floats) -> Floats:
    """How much later (peak, 2), in s per rad of elevation and azimuth, an echo beside a peak at its range is."""
    c, source, beam = window.sonar.assumed_sound_speed, window.estimates.position[0], direction(azimuth, elevation)
    by_beam = path_by_beam(beam, bistatic_range(c * delay, beam, source).range, source)
    return np.asarray(np.nan_to_num(np.einsum("axp,px->pa", _tangents(elevation, azimuth), by_beam) / c))


def _tangents(elevation: npt.ArrayLike, azimuth: npt.ArrayLike) -> Floats:
    """Vectors (2, xyz, ...): how directions (...) move as their elevation, and their azimuth, grow."""
    se, ce, sa, ca = np.sin(elevation), np.cos(elevation), np.sin(azimuth), np.cos(azimuth)
    return np.array([[-se * ca, -se * sa, ce], [-ce * sa, ce * ca, 0.0 * ce]])


def grid_steps(image: EnergyImage) -> tuple[float, float]:
    """Steps (rad) of elevation and azimuth; 0 of an axis of one beam."""
    up, across = (float(axis[1] - axis[0]) if len(axis) > 1 else 0.0 for axis in (image.elevation, image.azimuth))
    return up, across
