"""The snaps of a chorus beyond its reach, as Gaussian noise: of their spectrum, from where they come."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Floats, depth
from sonarsynth.environment.noise import NoiseField
from sonarsynth.environment.sea import Profile
from sonarsynth.equations.bubble import pulses
from sonarsynth.equations.noise.chorus_moments import NODES, PulsePower, excess_kurtosis, level_moment
from sonarsynth.planning.measured.chorus_reach import (
    BEYOND,
    HORIZON,
    ChorusWater,
    band_frequencies,
    image_shares,
    snap_power,
)
from sonarsynth.receiver import Sonar
from sonarsynth.recipe.scene import Scene
from sonarsynth.signals.chorus.chorus_arrivals import ChorusReach
from sonarsynth.signals.pulse_sums.adding_pulses import CAVITY
from sonarsynth.sources.chorus import Chorus

KNOTS = 128
"""Frequencies that the spectrum is worked out at."""
OCTAVES, FINER = 7, 2
"""Of the sine of the elevation, above and below the horizon, that directions are told apart in, and parts of each."""


@dataclass(frozen=True)
class DistantDirections:
    """As `NoiseDirections`: the same intensity between two edges, that of the mean over the band."""

    edges: tuple[float, ...]  # sines
    powers: tuple[float, ...]  # of each stretch between them, in any unit
    toward = None

    def intensity(self, sine: Floats) -> Floats:
        """As `NoiseDirections.intensity`."""
        interval = np.searchsorted(self.edges, sine, side="right") - 1
        return np.asarray(self.powers)[np.clip(interval, 0, len(self.powers) - 1)]


@dataclass(frozen=True, eq=False)
class DistantChorus(NoiseField):
    """Snaps beyond the reach of a chorus, all together."""

    kind = "distant_chorus"
    frequency: Floats  # (knot,) Hz
    decibels: Floats  # (knot,) dB re 1 Pa2/Hz, before the filter
    share: float  # of the power of the whole chorus in the band
    kurtosis: float  # excess, that these snaps one by one would add to that of the whole; Gaussian noise adds none
    directions: DistantDirections = DistantDirections((-1.0, 1.0), (1.0,))

    def density(self, frequency: Floats) -> Floats:
        """As `NoiseField.density`: straight lines between decibels."""
        return np.asarray(10.0 ** (np.interp(frequency, self.frequency, self.decibels) / 10.0))


def distant_chorus(
    scene: Scene, profile: Profile, position: Floats, absorption: Callable[[Floats], Floats], reach: ChorusReach | None
) -> DistantChorus | None:
    """What a scene's chorus brings from beyond its reach, at an array at a position (xyz) m.

    absorption: dB/m at frequencies (Hz). None where that is not asked for, or under `BEYOND` of the power.
    """
    chorus = scene.world.chorus
    if chorus is None or reach is None or not chorus.distant or reach.beyond < 10.0 * np.log10(BEYOND):
        return None
    water = ChorusWater(scene.world.environment, profile, scene.sonar, float(depth(position)))
    lost = (absorption(knots(scene.sonar)), absorption(band_frequencies(scene.sonar)))
    within = 10.0 ** ((reach.level - 120.0) / 10.0)  # Pa2
    return _distant(chorus, water, (reach.reach, reach.images, within), tuple(tuple(loss.tolist()) for loss in lost))


def knots(sonar: Sonar) -> Floats:
    """Frequencies (knot,) in Hz of the spectrum."""
    return np.linspace(0.0, 0.5 * sonar.sampling_frequency, KNOTS + 1)[1:]


class _FarPaths(NamedTuple):
    """Paths to distances (node,), by images, as sums stand for integrals over the bottom."""

    share: Floats  # (image, node): 2 pi rho drho V^2/r^2
    length: Floats  # (image, node) m
    sine: Floats  # (image, node) of the elevation that they come from
    area: Floats  # (node,) m2

    @classmethod
    def of(cls, water: ChorusWater, reach: float, images: int) -> _FarPaths:
        heights, share = image_shares(water, images)
        x, weight = np.polynomial.legendre.leggauss(NODES)
        edges = np.geomspace(reach, max(HORIZON, 2.0 * reach), 2 + int(np.log2(max(HORIZON / reach, 1.0))))
        steps = np.log(edges[1:] / edges[:-1])[:, None]
        rho = (np.sqrt(edges[1:] * edges[:-1])[:, None] * np.exp(0.5 * steps * x)).ravel()
        area = np.pi * (steps * weight).ravel() * rho**2
        climb = np.maximum(heights.climb, CAVITY)[:, None]
        length = np.hypot(rho, climb)
        return cls(area * share(rho, length) / length**2, length, -heights.turns[:, None] * climb / length, area)


@lru_cache(maxsize=16)
def _distant(
    chorus: Chorus, water: ChorusWater, reach: tuple[float, int, float], absorption: tuple[tuple[float, ...], ...]
) -> DistantChorus:
    """reach: m, images, and the mean square pressure (Pa2) of what is within."""
    frequency, sonar = knots(water.sonar), water.sonar
    model = chorus.snap.at_depth(water.environment.depth)
    far = _FarPaths.of(water, *reach[:2])
    unit_pulse = model.pulse(0.0, 1.2 * float(chorus.widths.max()) * frequency[-1])
    bare = [np.abs(pulses.spectrum(frequency, pulses.scaled(unit_pulse, 1.0, width))) ** 2 for width in chorus.widths]
    lost = np.array(absorption[0]) * np.log(10.0) / 10.0
    spread = np.array([np.sum(far.share * np.exp(-a * far.length)) for a in lost])
    square = level_moment(chorus.level, chorus.deviation, 2)
    density = 2.0 * chorus.rate * square * np.mean(bare, axis=0) / unit_pulse.peak**2 * spread
    pulse = snap_power(model, chorus.widths, sonar, np.array(absorption[1]))
    energy = far.share * _energy(pulse, far.length)
    brought = float(energy.sum())
    total = reach[2] / (chorus.rate * square) + brought
    fourth = float(np.sum(energy**2 / far.area)) / pulse.duration
    return DistantChorus(
        frequency=frequency,
        decibels=10.0 * np.log10(np.maximum(density, 1e-300)),
        directions=_directions(far.sine, energy),
        share=brought / total,
        kurtosis=excess_kurtosis(chorus.rate, chorus.deviation, total, fourth),
    )


def _energy(pulse: PulsePower, length: Floats) -> Floats:
    """Energy (...) in Pa2 s of a snap of 1 Pa at 1 m behind the filter, after lengths (...) in m of absorption."""
    step = pulse.frequency[1] - pulse.frequency[0]
    return np.asarray(
        2.0 * step * sum(p * np.exp(-a * length) for p, a in zip(pulse.power, pulse.absorbed, strict=True))
    )


def _directions(sine: Floats, energy: Floats) -> DistantDirections:
    """Where energy (image, node) comes from."""
    top = min(float(np.abs(sine).max()) * (1.0 + 1e-9), 1.0)
    above = np.append(0.0, top * 2.0 ** (np.arange(1 - OCTAVES * FINER, 1) / FINER))
    edges = np.unique(np.concatenate([-above, above]))
    brought = np.histogram(sine, edges, weights=energy)[0]
    filled = np.flatnonzero(brought > 0.0)
    span = slice(filled[0], filled[-1] + 1)
    return DistantDirections(
        tuple(edges[filled[0] : filled[-1] + 2].tolist()), tuple((brought / np.diff(edges))[span].tolist())
    )
