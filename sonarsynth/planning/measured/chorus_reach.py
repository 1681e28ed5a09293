"""How far, and by how many images, a chorus is heard one snap at a time."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Floats, depth
from sonarsynth.environment.sea import Environment, Profile
from sonarsynth.equations.noise.chorus_moments import (
    PulsePower,
    Reflected,
    RingMoments,
    effective_duration,
    excess_kurtosis,
    level_moment,
    power_spectrum,
    ring_moments,
)
from sonarsynth.receiver import Sonar
from sonarsynth.recipe.scene import Scene
from sonarsynth.signals.chorus.chorus_arrivals import ChorusReach, ImageHeights, image_heights, reflected
from sonarsynth.signals.filtered_pulse import pulse_spectrum
from sonarsynth.sources.chorus import Chorus
from sonarsynth.sources.pulse_model import PulseModel
from sonarsynth.sources.snap_pulses import waveform

BEYOND, FEWER = 0.02, 0.01
"""Shares of the power that snaps beyond an automatic reach, and images beyond an automatic number, may bring."""
FARTHEST, MOST_IMAGES = 3000.0, 60
"""m, and reflections: of what is chosen by itself. In windows without a near snap those far off are still told apart in
the image: with Gaussian noise from 1000 m on its brightest beam was 5 dB too faint in the median (at 1e-4/(m2 s))."""
HORIZON = 3e4
"""m: beyond, nothing is heard."""
NEAREST = 1.0
"""m: the innermost ring, from the height of the array on outwards."""
BINS = 64
"""Frequencies of the band that moments are taken at."""


class ChorusWater(NamedTuple):
    """The water that a chorus is heard through, and who hears it."""

    environment: Environment
    profile: Profile
    sonar: Sonar
    end: float  # m: depth of the array


def chorus_reach(scene: Scene, profile: Profile, position: Floats, absorption: Floats) -> ChorusReach | None:
    """What a scene's chorus needs, for an array at a position (xyz) in m; none without a chorus, or with no snaps.

    absorption: (bin,) dB/m at `band_frequencies`.
    """
    chorus = scene.world.chorus
    if chorus is None or chorus.rate == 0.0:
        return None
    water = ChorusWater(scene.world.environment, profile, scene.sonar, float(depth(position)))
    return _reach(chorus, water, tuple(absorption.tolist()))


def band_frequencies(sonar: Sonar) -> Floats:
    """Frequencies (bin,) in Hz that moments are taken at."""
    return np.linspace(sonar.band.low, sonar.band.high, BINS)


def snap_power(model: PulseModel, widths: Floats, sonar: Sonar, absorption: Floats) -> PulsePower:
    """A snap of 1 Pa at 1 m in the band of the sonar: the mean power over its widths (width,), each as likely."""
    rate, samples, f = sonar.sampling_frequency, 1 << 14, band_frequencies(sonar)
    peak = model.pulse(0.0, 0.0).peak
    lasts = effective_duration(
        np.fft.irfft(pulse_spectrum(waveform(model), sonar.antialias, rate, samples)[1], samples), 1.0 / rate
    )
    power = np.zeros(BINS)
    for width in widths.tolist():
        frequency, spectrum = pulse_spectrum(waveform(model, width), sonar.antialias, rate, samples)
        power += np.interp(f, frequency, np.abs(spectrum) ** 2) / (peak**2 * len(widths))
    return PulsePower(f, power, absorption * np.log(10.0) / 10.0, lasts)


def image_shares(water: ChorusWater, bounces: int) -> tuple[ImageHeights, Reflected]:
    """Images by at most so many reflections, and the share of the energy that these leave."""
    heights = image_heights(water.profile, water.environment.depth, water.end, bounces)

    def share(rho: Floats, length: Floats) -> Floats:
        grazing = np.arcsin(np.minimum(heights.climb[:, None] / length, 1.0)).T
        centre = water.sonar.band.centre
        reflection = reflected(water.environment, water.profile, heights, grazing, centre)
        turn = 2.0 * np.pi * centre * reflection.delay_std  # rough: all of the energy, see `chorus_arrivals`
        return np.asarray((reflection.modulus**2 * np.where(turn > 1.0, 1.0, np.exp(-(turn**2)))).T)

    return heights, share


@lru_cache(maxsize=64)
def _reach(chorus: Chorus, water: ChorusWater, absorption: tuple[float, ...]) -> ChorusReach:
    model = chorus.snap.at_depth(water.environment.depth)
    pulse = snap_power(model, chorus.widths, water.sonar, np.array(absorption))
    edges = np.concatenate([[1e-2], NEAREST * 2.0 ** np.arange(np.ceil(np.log2(HORIZON / NEAREST)) + 1)])

    def moments(bounces: int, inner: Floats = edges) -> list[RingMoments]:
        heights, share = image_shares(water, bounces)
        return [ring_moments(a, b, heights.climb, share, pulse) for a, b in pairwise(inner)]

    bounces = chorus.images
    if bounces == "auto":
        power = np.array([sum(m.square for m in moments(n)) for n in _ORDERS])
        bounces = _ORDERS[int(np.argmax(power >= (1.0 - FEWER) * power[-1]))]
    rings = moments(bounces)
    square = np.array([m.square for m in rings])
    outside = np.append(np.cumsum(square[::-1])[::-1], 0.0) / square.sum()
    if chorus.reach == "auto":
        reach = min(float(edges[int(np.argmax(outside <= BEYOND))]), FARTHEST)
    else:
        reach = chorus.reach
    inner = np.append(edges[edges < reach], reach)
    rings = moments(bounces, inner)
    spectrum = power_spectrum(
        chorus.rate,
        level_moment(chorus.level, chorus.deviation, 2),
        np.sum([m.spectrum for m in rings], axis=0),
        pulse.power,
    )
    mean = float(np.trapezoid(spectrum, pulse.frequency))
    more = float(np.interp(np.log(reach), np.log(edges), outside))
    return ChorusReach(
        reach=reach,
        images=bounces,
        edges=inner,
        kurtosis=float(_kurtosis(chorus, rings).sum()),
        beyond=float(10.0 * np.log10(max(more, 1e-12))),
        level=float(10.0 * np.log10(mean) + 120.0),
    )


_ORDERS = (0, 1, 2, 4, 6, 8, 12, 16, 20, 24, 32, 40, 48, MOST_IMAGES)
"""Numbers of reflections to choose from."""


def _kurtosis(chorus: Chorus, rings: list[RingMoments]) -> Floats:
    """Excess kurtosis (ring,) that each ring brings, of all of them together."""
    square = sum(m.square for m in rings)
    return np.array([excess_kurtosis(chorus.rate, chorus.deviation, square, m.fourth) for m in rings])
