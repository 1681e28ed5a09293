"""Echoes as peaks of the volume of elevation, azimuth and delay (`Peaks`)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.ndimage import maximum_filter, maximum_filter1d, uniform_filter
from scipy.special import diric

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.equations.arrays.apertures import live_gain
from sonarsynth.equations.arrays.noise_peaks import peak_level
from sonarsynth.equations.arrays.spherical_wave import parabola
from sonarsynth.products import EnergyImage
from sonarsynth.ranging.location import pulse_times
from sonarsynth.ranging.picking.beyond_the_grid import louder_beyond, possible_grating_lobes
from sonarsynth.ranging.picking.peak_kernels import beside, farthest, local_maxima, medians, over_lobes, power_centres
from sonarsynth.ranging.picking.picked_echoes import PickedEchoes, no_echoes, tangents
from sonarsynth.ranging.range_profiles import (
    OVERSAMPLING,
    Profiles,
    aperture_moments,
    loudest_beams,
    over_threshold,
    range_profiles,
    residue,
)
from sonarsynth.ranging.received_window import ReceivedWindow
from sonarsynth.receiver import Elements, Sonar

BESIDE = 2
"""Cells beside the beams over threshold that are looked at too: a peak there has its neighbours."""
LOBES = 8.0
"""Times what lobes bring of louder peaks that a peak must exceed: echoes are of more than their peaks."""
GAP = 65
"""Delays about loud ones that are looked for peaks with them."""
NOISE_WIDTHS = 3.0
"""Beam widths on either side of a beam whose noise is taken for its own."""
NOISE_ADDED = 2.0
"""Amplitude of noise, in units of its root mean square, that may be in a peak."""
LOBE_BINS, LOBE_STEPS = 48, 128
"""Frequencies that lobes are summed over; steps a period at the highest that they are tabulated at: to 4e-4."""
RESOLVED = 1.0
"""An axis of the grid as long as this, in units of the roughness of noise along it, has peaks along it."""
CENTRE_WINDOW = 1.4
"""Standard deviation, in widths of a peak, of the window about it in which the centre of power is looked for."""
NOISE_CLEAR = 4.0
"""Power below that, in units of the mean power of noise, does not count for the centre."""
CENTRE_ERROR = np.array([1.3, 1.3, 0.4])
"""Standard error of a peak along elevation, azimuth and delay over how far the centre of power about it is from it
(fitted to random scenes, as `test_points_err_by_what_is_predicted` has them)."""
SURFACE_ERROR = np.array([0.05, 0.05, 0.17])
"""Standard error along these, in widths, of echoes of surfaces, not points (fitted to these)."""
UNKNOWN = 0.5
"""Standard error of a direction along an axis that is not resolved, in half widths of the beam."""
COARSE = 1.5
"""Widths from one beam to the next above which the top between them is not known: at 1.9 points were 8 errors off."""


def peak_echoes(
    window: ReceivedWindow, threshold: float, dynamic_range: float, false_alarms: float, side_lobes: float
) -> PickedEchoes:
    """The peaks of the beams about those over threshold that are echoes, see `Peaks`."""
    image = window.image
    over = over_threshold(window, threshold)
    wide = maximum_filter(over, 2 * BESIDE + 1, mode="constant") & np.isfinite(image.energy)
    beams, left_out = loudest_beams(image, wide)
    if not len(beams[0]):
        return no_echoes(image, left_out)
    whole, window = window, window.without_silence()
    profiles = range_profiles(window, beams)
    axes = Axes.of(window, profiles)
    noise = noise_power(profiles, image, silent=window is not whole)
    least = noise * peak_level(false_alarms, axes.sizes(profiles))
    power, index = profiles.power, np.full(image.energy.shape, -1)
    index[beams] = np.arange(len(power))
    b, t = _maxima(profiles, axes, index, least, dynamic_range, side_lobes)
    top_offset, gain = _tops(power, index, beams, axes.resolved, b, t)
    height = power[b, t] * gain**2
    share = height * np.sqrt(np.pi) / axes.sharpness[2] / (profiles.step * profiles.total[b])  # h exp(-(sharpness t)^2)
    energy = np.minimum(share, 1.0) * image.energy[profiles.row[b], profiles.column[b]]
    keep = (height >= least[b]) & (energy > residue(window))
    keep[keep] = _own(window, profiles, b[keep], t[keep], height[keep], noise[b[keep]])
    if not axes.resolved[:2].all():
        keep[keep] = _once(window, profiles, axes, b[keep], t[keep], height[keep])
    b, t, top_offset, height, energy = b[keep], t[keep], top_offset[keep], height[keep], energy[keep]
    centre, late = np.empty((len(b), 3)), np.argsort(t, kind="stable")
    width, clear = axes.step * axes.sharpness, NOISE_CLEAR * noise
    centre[late] = power_centres(power, index, *beams, b[late], t[late], top_offset[late], width, CENTRE_WINDOW, clear)
    snr, offset = height / noise[b], top_offset * axes.step
    error, error_product = axes.errors(snr, centre)
    return PickedEchoes(
        elevation=image.elevation[profiles.row[b]] + offset[:, 0],
        azimuth=image.azimuth[profiles.column[b]] + offset[:, 1],
        delay=profiles.first + t * profiles.step + offset[:, 2],
        elevation_error=error[:, 0],
        azimuth_error=error[:, 1],
        delay_error=error[:, 2],
        energy=energy.astype(np.float32),
        snr=10 * np.log10(snr),
        overflow=left_out,
        error_product=error_product,
    )


def _maxima(
    profiles: Profiles, axes: Axes, index: Ints, least: Floats, dynamic_range: float, side_lobes: float
) -> tuple[Ints, Ints]:
    """Beams and delays (peak,) of local maxima within both (dB), half of `least` (beam,) at least."""
    power, loudest, beams = profiles.power, profiles.loudest, (profiles.row, profiles.column)
    floor = np.maximum(0.5 * least, loudest.max() * 10 ** (-dynamic_range / 10)).astype(np.float32)
    audible = maximum_filter1d(loudest, 2 * profiles.about + 1) * np.float32(10 ** (-side_lobes / 10))
    end = max(int(np.ceil(pulse_times.PULSE_HALF / profiles.step)), profiles.about) + 1
    some = maximum_filter1d(loudest, GAP)[end : len(loudest) - end] > floor.min()
    runs = end + np.flatnonzero(np.diff(some, prepend=False, append=False)).reshape(-1, 2)
    b, t = local_maxima(power, index, *beams, floor, audible, axes.resolved, profiles.about, runs)
    whole = ~_cut(power, b, t, end)
    return b[whole], t[whole]


def _once(window: ReceivedWindow, profiles: Profiles, axes: Axes, b: Ints, t: Ints, height: Floats) -> Bools:
    """Which peaks (peak,) are the loudest of their echo, which beams along an axis that is not resolved hear alike: not
    at one delay, where the middle of the array is beside its centre."""
    middle = live_gain(window.elements.gain) @ window.elements.position / window.sonar.assumed_sound_speed
    late = t - profiles.direction[b] @ middle / profiles.step
    place = np.column_stack([profiles.row[b], profiles.column[b]]) * axes.resolved[:2]
    once, rest = np.zeros(len(b), bool), np.ones(len(b), bool)
    for p in np.argsort(-height, kind="stable"):
        if rest[p]:
            once[p] = True
            rest &= (np.abs(late - late[p]) > profiles.about + 1) | (np.abs(place - place[p]).max(axis=1) > 1)
    return once


def _cut(power: npt.NDArray[np.float32], b: Ints, t: Ints, end: int) -> Bools:
    """Whether peaks (peak,) are what the window left of a louder echo, whose own peak is at its end or beyond."""
    own, last = power[b, t], power.shape[1] - 1
    early = (t < 2 * end) & (power[b, :end].max(axis=1) > own)
    return np.asarray(early | (last - t < 2 * end) & (power[b, -end:].max(axis=1) > own))


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
        middle = image.azimuth[profiles.column].mean(), image.elevation[profiles.row].mean()
        across = tangents(*middle) * [[1.0], [np.cos(middle[1])]]  # as elevation, and azimuth, grow
        aperture = np.sqrt(np.sum(across @ aperture_moments(window.elements) * across, axis=1))  # m, rms
        k = 2 * np.pi / window.sonar.assumed_sound_speed
        return Axes(
            step=np.array([*_steps(image), profiles.step]),
            cells=np.array([*image.energy.shape, profiles.power.shape[1]]),
            sharpness=np.append(np.maximum(k * moments.echo_frequency * aperture, 1e-3), 2 * np.pi * moments.echo_band),
            roughness=np.append(k * moments.noise_frequency * aperture, 2 * np.pi * moments.noise_band),
        )

    @property
    def resolved(self) -> Bools:
        """(3,) whether peaks are told along an axis: it is longer than noise is smooth, of three cells at least."""
        return np.asarray((self.cells >= 3) & (self.step * self.cells * self.roughness > RESOLVED))

    @property
    def unresolved_error(self) -> Floats:
        """Predicted standard errors (3,) in rad, rad, s along axes that are not resolved."""
        return np.minimum(UNKNOWN * np.maximum(1.0 / self.sharpness, 0.5 * self.step), [np.pi, np.pi, np.inf])

    def sizes(self, profiles: Profiles) -> Floats:
        """Lengths (3,) of the volume that is searched, as `peak_level` takes them."""
        step = np.maximum(self.step[:2], 1e-12)
        share = len(profiles.power) / self.cells[:2].prod()  # of all beams, whatever the outline of those looked at
        angle = step * self.cells[:2] * np.sqrt(share) * self.roughness[:2] * self.resolved[:2]
        lasting = max(profiles.power.shape[1] * profiles.step - 2 * pulse_times.PULSE_HALF, profiles.step)  # s
        return np.append(angle, lasting * 2 * np.pi * profiles.moments.noise_own_band)

    def errors(self, snr: Floats, centre: Floats) -> tuple[Floats, Floats]:
        """Predicted standard errors (peak, 3) in rad, rad, s, and covariance (peak,) of angles; snr (peak,): of powers.

        Noise moves the top of an amplitude that falls as 1 - (sharp x)^2/2 by its derivative over the bend, of standard
        deviation rough/(sharp^2 (2 snr)^1/2). Where echoes overlap the `centre` of their power (peak, 3), in widths
        from the peak, is beside it: the peak is taken to err by about as much (`CENTRE_ERROR`), and that way.
        """
        sharp = self.sharpness
        noise = self.roughness / (sharp**2 * np.sqrt(2.0 * snr[:, None]))
        resolved_error = np.sqrt(noise**2 + (SURFACE_ERROR**2 + (CENTRE_ERROR * centre) ** 2) / sharp**2)
        told = self.resolved & (self.step * sharp <= COARSE)
        error = np.where(told, np.minimum(resolved_error, [np.pi, np.pi, np.inf]), self.unresolved_error)
        return error, self.resolved[:2].all() * np.prod((CENTRE_ERROR * centre / sharp)[:, :2], axis=1)


def noise_power(profiles: Profiles, image: EnergyImage, *, silent: bool = False) -> Floats:
    """Mean power (beam,) of noise: the median over delays over ln 2, its mean over the beams within `NOISE_WIDTHS`; of
    a window of which half or more is silent, and left out, what single precision rounds off.

    An ordered statistic, so that echoes, which are short, count little; of many beams, since a peak is far out in the
    tail: a level 5 % off at 13 times the mean is twice the false alarms. Source: Rohling (1983), IEEE Transactions on
    Aerospace and Electronic Systems 19, 608.
    """
    least = np.finfo(np.float32)
    if silent:
        return np.full(len(profiles.power), least.eps**2 * float(profiles.loudest.max()) + least.tiny)
    end = min(int(pulse_times.PULSE_HALF / profiles.step), profiles.power.shape[1] // 4)
    median = medians(profiles.power, end, profiles.power.shape[1] - end, OVERSAMPLING)
    place = profiles.row - profiles.row.min(), profiles.column - profiles.column.min()
    level, filled = np.zeros((2, place[0].max() + 1, place[1].max() + 1))
    level[place], filled[place] = median / np.log(2.0), 1.0
    cells = [2 * int(NOISE_WIDTHS * 2 * profiles.width / step) + 1 if step else 1 for step in _steps(image)]
    around, of = (uniform_filter(x, cells, mode="constant")[place] for x in (level, filled))
    return np.asarray(np.maximum(around / of, least.tiny))


def _steps(image: EnergyImage) -> tuple[float, float]:
    """Steps (rad) of elevation and azimuth; 0 of an axis of one beam."""
    up, across = (float(axis[1] - axis[0]) if len(axis) > 1 else 0.0 for axis in (image.elevation, image.azimuth))
    return up, across


def _tops(
    power: npt.NDArray[np.float32], index: Ints, beams: tuple[Ints, Ints], resolved: Bools, b: Ints, t: Ints
) -> tuple[Floats, Floats]:
    """Where the tops of peaks are, in steps (peak, 3) from the grid, and their amplitude over that on the grid (peak,).

    Parabolas through peaks and their neighbours on each axis: through the cube roots of amplitudes, which the main lobe
    of a disc makes a parabola up to the fourth order (1 - y/2 + y^2/12 does).
    """
    top = power[b, t].astype(float) ** (1.0 / 6.0)
    sides = np.minimum(beside(power, index, *beams, b, t).astype(float) ** (1.0 / 6.0), top)
    offset, height = parabola(sides[:, 0], top, sides[:, 1])
    return offset.T * resolved, np.prod((height[resolved] / top) ** 3, axis=0)


def _own(window: ReceivedWindow, profiles: Profiles, b: Ints, t: Ints, height: Floats, noise: Floats) -> Bools:
    """Whether peaks (peak,) are more than what the lobes of the array bring of louder ones, in the grid and beyond."""
    least = np.maximum(np.sqrt(height) - NOISE_ADDED * np.sqrt(noise), 0.0) ** 2  # without what noise may add
    u, delay = profiles.direction[b], profiles.step * t.astype(float)
    own = _over(window, profiles.width, u, delay, height, least)
    p, line = possible_grating_lobes(window, profiles, b, t, least / LOBES)
    p, line = p[own[p]], line[own[p]]
    beyond = louder_beyond(window, profiles, b[p], t[p], height[p], line)
    if len(beyond[0]):
        u, delay, height = (np.concatenate(both) for both in zip((u, delay, height), beyond, strict=True))
        asked = np.append(np.where(own, least, np.inf), np.full(len(u) - len(b), np.inf))
        own &= _over(window, profiles.width, u, delay, height, asked)[: len(own)]
    return own


def _over(
    window: ReceivedWindow, width: float, direction: Floats, delay: Floats, height: Floats, least: Floats
) -> Bools:
    """Whether `least` (peak,) is more than what lobes bring of louder peaks from directions (peak, xyz), at delays
    (peak,) in s, of heights (peak,)."""
    loud, sonar, own = np.argsort(-height, kind="stable"), window.sonar, np.empty(len(height), bool)
    c, rate, lasting = sonar.assumed_sound_speed, LOBE_STEPS * sonar.band.high, 2.0 / (sonar.band.high - sonar.band.low)
    position, weight, table = _lobes(window.elements, sonar)
    peaks = direction[loud] / c, delay[loud], height[loud]
    own[loud] = over_lobes(*peaks, position, weight, 2.0 * width / c, lasting, least[loud] / LOBES, table, rate)
    return own


@lru_cache(maxsize=8)
def _lobes(elements: Elements, sonar: Sonar) -> tuple[Floats, Floats, Floats]:
    """What `over_lobes` takes of an array: positions (sensor, xyz) and weights (sensor,) of live sensors, the table."""
    band, live, rate = sonar.band, np.flatnonzero(elements.gain), LOBE_STEPS * sonar.band.high
    position = elements.position[live]
    longest = 4.0 * farthest(position) / sonar.assumed_sound_speed + 2.0 / (band.high - band.low)
    table = _lobe_table(band.low, band.high, rate, int(np.ceil(longest * rate)) + 2)
    return position, live_gain(elements.gain)[live], table


def _lobe_table(low: float, high: float, rate: float, steps: int) -> Floats:
    """Sum (2, delay) over the band low to high (Hz), tapered, at delays in steps of 1/rate (Hz), `steps` either way."""
    delay = np.arange(-steps, steps + 1) / rate
    bin_angle, taper_angle = 2.0 * np.pi * delay * (high - low) / (LOBE_BINS - 1), 2.0 * np.pi / LOBE_BINS
    # sin^2 is a constant and a cosine: three sums of a geometric series
    size = diric(bin_angle, LOBE_BINS)
    size += 0.5 * (diric(bin_angle + taper_angle, LOBE_BINS) + diric(bin_angle - taper_angle, LOBE_BINS))
    turn = np.pi * (low + high) * delay
    return np.ascontiguousarray([size * np.cos(turn), size * np.sin(turn)])
