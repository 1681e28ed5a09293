"""One echo a beam, on its axis: its delay after the direct pulse, and whether it comes from that beam's direction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import maximum_filter1d

from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.arrays.spherical_wave import parabola
from sonarsynth.products import EnergyImage
from sonarsynth.ranging import ranging_kernels
from sonarsynth.ranging.location import pulse_times
from sonarsynth.ranging.picking.peak_picking import Axes
from sonarsynth.ranging.picking.picked_echoes import PickedEchoes, no_echoes
from sonarsynth.ranging.range_profiles import OVERSAMPLING, Profiles, loudest_beams, over_threshold, range_profiles
from sonarsynth.ranging.received_window import ReceivedWindow

GHOST = 8.0
"""An echo is a ghost or a side lobe where another beam holds this many dB more at the same delay."""
NOISE = 16.0
"""An echo must stand this many dB above the median of its own beam: noise does so once in 10^12 samples."""
OWN_WIDTH = 0.3
"""Standard angle between a beam and the echo that is loudest in it, in half widths."""
INTERFERENCE = 0.25
"""Standard error of a peak's delay where echoes overlap, in units of the resolution."""


@dataclass(frozen=True, eq=False)
class AxisEchoes:
    """One echo a beam: the peak of its profile. NaN delay where there is none of its own."""

    delay: Floats  # (beam,) s after the direct arrival
    delay_error: Floats  # (beam,) s
    angle_error: Floats  # (beam,) rad: how far from the beam the echo may come from, along axes that tell directions
    snr: Floats  # (beam,) dB


def axis_echoes(
    window: ReceivedWindow,
    threshold: float,
    locality: float,
    change: Callable[[Profiles, AxisEchoes], AxisEchoes] = lambda _, echoes: echoes,
) -> PickedEchoes:
    """The loudest echo of each beam within `threshold` dB of the loudest beam, on its axis; `change`: of what is
    picked, before it is taken."""
    beams, left_out = loudest_beams(window.image, over_threshold(window, threshold))
    if not len(beams[0]):
        return no_echoes(window.image, left_out)
    profiles = range_profiles(window, beams)
    echoes = change(profiles, pick(profiles, window.image, locality))
    own = np.isfinite(echoes.delay)
    row, column = profiles.row[own], profiles.column[own]
    axes = Axes.of(window, profiles)
    angle = np.maximum(echoes.angle_error[own, None], axes.step[:2] / np.sqrt(12.0))  # anywhere in the cell of a beam
    angle = np.where(axes.resolved[:2], angle, axes.unresolved_error[:2])
    return PickedEchoes(
        azimuth=window.image.azimuth[column],
        elevation=window.image.elevation[row],
        azimuth_error=angle[:, 1] / np.maximum(np.cos(window.image.elevation[row]), 0.1),
        elevation_error=angle[:, 0],
        delay=echoes.delay[own],
        delay_error=echoes.delay_error[own],
        energy=window.image.energy[row, column],
        snr=echoes.snr[own],
        overflow=left_out,
    )


def pick(profiles: Profiles, image: EnergyImage, locality: float) -> AxisEchoes:
    """The peak of every profile, kept where it is the beam's own.

    At the delay of its peak, no beam within a beam width may hold `locality` dB more, or the echo comes from there; and
    no beam at all `GHOST` dB more, or it comes through a side lobe or a grating lobe; and it must stand out of the
    noise. Nearer to an end of the profile than half a pulse (`pulse_times.PULSE_HALF`) a peak is what the window left
    of an echo, whose own peak may be outside: that is none.
    """
    power, count = profiles.power, len(profiles.power)
    rows = np.arange(count)
    top = np.clip(power.argmax(axis=1), 1, power.shape[1] - 2)
    own = power[rows, top]
    offset, _ = parabola(*(np.sqrt(power[rows, top + i]) for i in (-1, 0, 1)))
    near = np.maximum(_loudest_near(profiles, image, top), own)
    anywhere = maximum_filter1d(profiles.loudest, profiles.about * 2 + 1)[top]
    noise = np.median(power[:, ::OVERSAMPLING], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        excess = 10 * np.log10(near / own)
        good = (own > 0) & (excess <= locality) & (own * 10 ** (GHOST / 10) >= anywhere)
        good &= own >= noise * 10 ** (NOISE / 10)
        good &= np.minimum(top, power.shape[1] - 1 - top) * profiles.step >= pulse_times.PULSE_HALF
        off_beam = profiles.width * np.hypot(np.sqrt(excess / 3), OWN_WIDTH) / np.sqrt(2.0)  # of either angle
        jitter = profiles.resolution * np.hypot(np.sqrt(0.5 * noise / own), INTERFERENCE)
        snr = 10 * np.log10(own / noise * np.log(2.0))
    delay = profiles.first + (top + offset) * profiles.step
    return AxisEchoes(np.where(good, delay, np.nan), jitter, off_beam, snr)


def _loudest_near(profiles: Profiles, image: EnergyImage, top: Ints) -> npt.NDArray[np.float32]:
    """Largest power (beam,), about the delay of each beam's own peak, in the beams within a beam width of it."""
    rows, columns = image.energy.shape
    index = np.full((rows, columns), -1)
    index[profiles.row, profiles.column] = np.arange(len(top))
    reach = 2 * profiles.width
    up, across = (_cells(grid, reach) for grid in (image.elevation, image.azimuth))
    beams = profiles.row, profiles.column, index, up, across, profiles.direction, reach
    return np.asarray(ranging_kernels.loudest_near(profiles.power, top, profiles.about, *beams))


def _cells(grid: Floats, reach: float) -> int:
    """Grid cells within `reach` (rad), one at least, where there is more than one."""
    step = float(grid[1] - grid[0]) if len(grid) > 1 else np.inf
    return min(max(int(np.ceil(reach / step)), 1), len(grid) - 1)
