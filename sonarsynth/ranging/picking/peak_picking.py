"""Echoes as peaks of the volume of elevation, azimuth and delay (`Peaks`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import binary_dilation, binary_erosion, maximum_filter1d, uniform_filter

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.equations.arrays.apertures import live_gain
from sonarsynth.equations.arrays.noise_peaks import peak_level
from sonarsynth.products import EnergyImage
from sonarsynth.ranging.location import pulse_times
from sonarsynth.ranging.picking.peak_kernels import lobe_power, local_maxima
from sonarsynth.ranging.picking.picked_echoes import PickedEchoes, no_echoes
from sonarsynth.ranging.range_profiles import (
    OVERSAMPLING,
    Profiles,
    aperture_moments,
    loudest_beams,
    over_threshold,
    range_profiles,
)
from sonarsynth.ranging.received_window import ReceivedWindow

BESIDE = 2
"""Cells beside the beams over threshold that are looked at too: a peak there has its neighbours."""
LOBES = 8.0
"""Times what lobes bring of louder peaks that a peak must exceed: echoes are of more than their peaks."""
NOISE_WIDTHS = 3.0
"""Beam widths on either side of a beam whose noise is taken for its own."""
LOBE_BINS = 48
"""Frequencies that lobes are summed over."""
RESOLVED = 1.0
"""An axis of the grid as long as this, in units of the roughness of noise along it, has peaks along it."""
SIXTH = 1.0 / 6.0
OVERLAP = 0.15
"""Standard error of a peak for each part by which its width is not that of one echo, in units of its width."""
UNLIKE = 0.02
"""Part of the width that is not told from one."""
UNKNOWN = 0.5
"""Standard error of a direction along an axis that is not resolved, in half widths of the beam."""


@dataclass(frozen=True, eq=False)
class Tops:
    """Peaks between the points of the grid along one axis."""

    place: Floats  # (peak,) steps from the grid point
    gain: Floats  # (peak,) amplitude at the top over that on the grid
    bend: Floats  # (peak,) minus the second difference of the amplitude over the amplitude


def peak_echoes(
    heard: ReceivedWindow, threshold: float, dynamic_range: float, false_alarms: float, side_lobes: float
) -> PickedEchoes:
    """The peaks of the beams about those over threshold that are echoes, see `Peaks`."""
    image = heard.image
    some = over_threshold(image, threshold, heard.loudest)
    wide = binary_dilation(some, np.ones((2 * BESIDE + 1,) * 2)) & np.isfinite(image.energy)
    beams, left_out = loudest_beams(image, wide)
    if not len(beams[0]):
        return no_echoes(image, left_out)
    profiles = range_profiles(heard, beams)
    grid = BeamAxes.of(heard, profiles)
    noise = noise_power(profiles, image)
    least = noise * peak_level(false_alarms, grid.sizes(profiles))
    power = profiles.power
    floor = np.maximum(0.5 * least, power.max() * 10 ** (-dynamic_range / 10)).astype(np.float32)
    end = max(int(np.ceil(pulse_times.PULSE_HALF / profiles.step)), profiles.about) + 1
    index = np.full(image.energy.shape, -1)
    index[beams] = np.arange(len(power))
    inner = binary_erosion(index >= 0, np.ones((3, 3)), border_value=1)
    floor[~inner[beams]] = np.inf  # at the rim a slope would pass for a peak
    b, t = local_maxima(power, index, *beams, floor, grid.resolved, profiles.about, end)
    anywhere = maximum_filter1d(power.max(axis=0), 2 * profiles.about + 1)
    good = (power[b, t] * 10 ** (side_lobes / 10) >= anywhere[t]) & ~_cut(power, b, t, end)
    b, t = b[good], t[good]
    tops = _tops(power, index, beams, grid.resolved, b, t)
    height = power[b, t] * (tops[0].gain * tops[1].gain * tops[2].gain) ** 2
    keep = height >= least[b]
    keep[keep] = _own(heard, profiles, b[keep], t[keep], height[keep])
    found = [Tops(top.place[keep], top.gain[keep], top.bend[keep]) for top in tops]
    b, t, height = b[keep], t[keep], height[keep]
    return _echoes(heard, profiles, grid, found, b, t, height, noise[b], left_out=left_out)


def _cut(power: npt.NDArray[np.float32], b: Ints, t: Ints, end: int) -> Bools:
    """Whether peaks (peak,) are what the window left of a louder echo, whose own peak is at its end or beyond."""
    own, last = power[b, t], power.shape[1] - 1
    early = (t < 2 * end) & (power[:, :end].max(axis=1)[b] > own)
    late = (last - t < 2 * end) & (power[:, -end:].max(axis=1)[b] > own)
    return np.asarray(early | late)


@dataclass(frozen=True, eq=False)
class BeamAxes:
    """The axes of the beam grid, elevation and azimuth: steps, and how a beam and noise change along them."""

    step: Floats  # (2,) rad; 0 of an axis of one beam
    cells: Ints  # (2,)
    moments: Floats  # (2, 2) m2: second moments of the aperture across the middle of the beams
    wave: Floats  # (2,) rad/m: root mean square wave number of an echo, and of noise
    centre: tuple[float, float]  # rad: elevation and azimuth there

    @staticmethod
    def of(heard: ReceivedWindow, profiles: Profiles) -> BeamAxes:
        """Of the beams of an image."""
        axes = heard.image.elevation, heard.image.azimuth
        step = np.array(_steps(heard.image))
        centre = float(np.mean(axes[0][profiles.row])), float(np.mean(axes[1][profiles.column]))
        up, side = _tangents(*centre)
        across = np.array([up, side])
        k = 2 * np.pi / heard.sonar.assumed_sound_speed
        wave = k * np.array([profiles.moments.echo_frequency, profiles.moments.noise_frequency])
        moments = across @ aperture_moments(heard.elements) @ across.T
        return BeamAxes(step, np.array([len(axis) for axis in axes]), moments, wave, centre)

    @property
    def sharpness(self) -> Floats:
        """(2,) 1/rad: the amplitude of a beam falls as 1 - (sharpness x angle)^2/2."""
        return np.asarray(self.wave[0] * np.sqrt(np.diag(self.moments)))

    @property
    def roughness(self) -> Floats:
        """(2,) 1/rad: standard deviation of the derivative of noise over that of noise."""
        return np.asarray(self.wave[1] * np.sqrt(np.diag(self.moments)))

    @property
    def resolved(self) -> Bools:
        """(2,) whether peaks are told along an axis: it is longer than noise is smooth, of three beams at least."""
        return np.asarray((self.cells >= 3) & (self.step * self.cells * self.roughness > RESOLVED))

    def sizes(self, profiles: Profiles) -> Floats:
        """Lengths (3,) of the volume that is searched, as `peak_level` takes them."""
        solid = np.maximum(self.step, 1e-12).prod() * len(profiles.power)  # of the beams, whatever their outline
        whole = np.maximum(self.step * self.cells, 1e-12)
        angle = whole * np.sqrt(solid / whole.prod()) * self.roughness * self.resolved
        delay = power_length(profiles) * 2 * np.pi * profiles.moments.noise_own_band
        return np.array([*angle, delay])


def power_length(profiles: Profiles) -> float:
    """Length (s) of the profiles, without their ends, where no echo is picked."""
    return float(max(profiles.power.shape[1] * profiles.step - 2 * pulse_times.PULSE_HALF, profiles.step))


def _tangents(elevation: float, azimuth: float) -> tuple[Floats, Floats]:
    """Unit vectors (xyz) in which a direction moves as its elevation, and its azimuth, grow; the second times cos."""
    se, ce, sa, ca = np.sin(elevation), np.cos(elevation), np.sin(azimuth), np.cos(azimuth)
    return np.array([-se * ca, -se * sa, ce]), np.array([-ce * sa, ce * ca, 0.0])


def noise_power(profiles: Profiles, image: EnergyImage) -> Floats:
    """Mean power (beam,) of noise: the median over delays over ln 2, its mean over the beams within `NOISE_WIDTHS`.

    An ordered statistic, so that echoes, which are short, count little; of many beams, since a peak is far out in the
    tail: a level 5 % off at 13 times the mean is twice the false alarms. Source: Rohling (1983), IEEE Transactions on
    Aerospace and Electronic Systems 19, 608.
    """
    end = min(int(pulse_times.PULSE_HALF / profiles.step), profiles.power.shape[1] // 4)
    some = profiles.power[:, end : profiles.power.shape[1] - end : OVERSAMPLING]
    level, there = np.zeros(image.energy.shape), np.zeros(image.energy.shape)
    level[profiles.row, profiles.column] = np.median(some, axis=1) / np.log(2.0)
    there[profiles.row, profiles.column] = 1.0
    cells = [2 * int(NOISE_WIDTHS * 2 * profiles.width / step) + 1 if step else 1 for step in _steps(image)]
    around, of = (uniform_filter(x, cells, mode="constant")[profiles.row, profiles.column] for x in (level, there))
    return np.asarray(np.maximum(around / of, np.finfo(np.float32).tiny))


def _steps(image: EnergyImage) -> tuple[float, float]:
    """Steps (rad) of elevation and azimuth; 0 of an axis of one beam."""
    up, side = (float(axis[1] - axis[0]) if len(axis) > 1 else 0.0 for axis in (image.elevation, image.azimuth))
    return up, side


def _tops(
    power: npt.NDArray[np.float32], index: Ints, beams: tuple[Ints, Ints], resolved: Bools, b: Ints, t: Ints
) -> tuple[Tops, Tops, Tops]:
    """Parabolas through peaks and their neighbours, along elevation, azimuth and delay: through the cube roots of
    amplitudes, which the main lobe of a disc makes a parabola up to the fourth order (1 - y/2 + y^2/12 does)."""
    row, column = beams[0][b], beams[1][b]
    top = power[b, t].astype(float) ** SIXTH
    found = []
    for axis, (up, side, late) in enumerate(((1, 0, 0), (0, 1, 0), (0, 0, 1))):
        sides = []
        for way in (-1, 1):
            i = np.clip(row + way * up, 0, index.shape[0] - 1)
            j = np.clip(column + way * side, 0, index.shape[1] - 1)
            other = index[i, j]
            there = np.where(other >= 0, power[other, t + way * late].astype(float) ** SIXTH, top)
            sides.append(np.minimum(there, top))
        place, height = pulse_times.parabola(sides[0], top, sides[1])
        bend = 3 * (2 * top - sides[0] - sides[1]) / top
        told = axis == 2 or bool(resolved[axis])
        gain = (height / top) ** 3
        found.append(Tops(place * told, gain if told else np.ones(len(b)), bend if told else np.zeros(len(b))))
    return found[0], found[1], found[2]


def _own(heard: ReceivedWindow, profiles: Profiles, b: Ints, t: Ints, height: Floats) -> Bools:
    """Whether peaks (peak,) are more than what the lobes of the array bring of louder ones."""
    loud = np.argsort(-height, kind="stable")
    band, live = heard.sonar.band, np.flatnonzero(heard.elements.gain)
    taper = np.sin(np.pi * (np.arange(LOBE_BINS) + 0.5) / LOBE_BINS) ** 2
    c = heard.sonar.assumed_sound_speed
    brought = lobe_power(
        profiles.direction[b[loud]] / c,
        profiles.step * t[loud],
        height[loud],
        heard.elements.position[live],
        live_gain(heard.elements.gain)[live],
        np.linspace(band.low, band.high, LOBE_BINS),
        taper,
        2.0 * profiles.width / c,
    )
    own = np.empty(len(b), bool)
    own[loud] = height[loud] > LOBES * brought
    return own


def _echoes(
    heard: ReceivedWindow,
    profiles: Profiles,
    grid: BeamAxes,
    tops: list[Tops],
    b: Ints,
    t: Ints,
    height: Floats,
    noise: Floats,
    *,
    left_out: int,
) -> PickedEchoes:
    """Peaks with their directions, delays and errors; height, noise (peak,): their power, and the mean of noise."""
    image, snr = heard.image, height / noise
    row, column, moments = profiles.row[b], profiles.column[b], profiles.moments
    angles: list[Floats] = []
    errors: list[Floats] = []
    for axis, cells, place in ((image.elevation, row, tops[0]), (image.azimuth, column, tops[1])):
        n = len(angles)
        angles.append(axis[cells] + place.place * grid.step[n])
        sharp, rough = grid.sharpness[n], grid.roughness[n]
        if grid.resolved[n]:
            errors.append(_error(place.bend, grid.step[n], sharp, rough, snr))
        else:
            errors.append(np.full(len(b), UNKNOWN * max(1.0 / max(sharp, 1e-3), 0.5 * grid.step[n])))
    sharp, rough = 2 * np.pi * moments.echo_band, 2 * np.pi * moments.noise_band
    whole = profiles.step * profiles.power[b].sum(axis=1, dtype=float)
    share = np.minimum(height * np.sqrt(np.pi) / (sharp * whole), 1.0)  # a peak h exp(-(sharp t)^2) of all in its beam
    return PickedEchoes(
        azimuth=angles[1],
        elevation=angles[0],
        azimuth_error=np.minimum(errors[1], np.pi),
        elevation_error=np.minimum(errors[0], np.pi),
        delay=profiles.first + (t + tops[2].place) * profiles.step,
        delay_error=_error(tops[2].bend, profiles.step, sharp, rough, snr),
        energy=(share * image.energy[row, column]).astype(np.float32),
        snr=10 * np.log10(snr),
        slope=np.zeros(len(b)),
        overflow=left_out,
    )


def _error(bend: Floats, step: float, sharp: float, rough: float, snr: Floats) -> Floats:
    """Predicted standard error (peak,) of a peak along an axis, in the unit of `step`.

    Noise moves the top of an amplitude that falls as 1 - (sharp x)^2/2 by its derivative over the bend, of standard
    deviation rough/(sharp^2 (2 snr)^1/2). Echoes that overlap make a peak of another width than one echo has.
    """
    noise = rough / (sharp**2 * np.sqrt(2.0 * snr))
    unlike = np.maximum(np.abs(bend / (sharp * step) ** 2 - 1.0), UNLIKE)
    return np.asarray(np.hypot(noise, OVERLAP * unlike / sharp))
