"""What theory says of a chorus at a hydrophone: spectrum, directions, and how often it is loud."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise

import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.special import ndtr

from sonarsynth.conventions import Floats, depth
from sonarsynth.equations.arrays.apertures import element_directivity
from sonarsynth.equations.noise import filters
from sonarsynth.equations.noise.arrival_counts import CountMoments, path_counts
from sonarsynth.equations.noise.chorus_moments import Reflected, effective_duration, level_moment
from sonarsynth.planning import Plan, receiver_of
from sonarsynth.planning.measured.chorus_reach import ChorusWater, image_shares
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals.chorus.chorus_arrivals import ChorusReach, ImageHeights
from sonarsynth.signals.filtered_pulse import fir, pulse_spectrum
from sonarsynth.signals.pulse_sums.adding_pulses import CAVITY
from sonarsynth.sources.chorus import Chorus
from sonarsynth.sources.pulse_model import PulseModel
from sonarsynth.sources.snap_pulses import waveform
from sonarsynth.state import Receiver

DISTANCES, AZIMUTHS = 6, 90
"""Of snaps: distances in each ring, and directions, that rates are summed over."""
TURNS, LENGTHS, FINER = 24, 20, 4
"""Of the table of peaks behind the filter: directions along y and along z, path lengths, samples of one."""
PANELS = 24
"""Nodes between edges of the elevation."""


@dataclass(frozen=True, eq=False)
class ChorusModel:
    """A chorus as an array at rest hears it; all paths are heard through the face of a hydrophone."""

    chorus: Chorus
    reach: ChorusReach
    heights: ImageHeights
    share: Reflected  # of the energy that reflections leave
    plan: Plan
    receiver: Receiver

    @property
    def energy(self) -> float:
        """Mean square pressure of snaps at 1 m (Pa2) times their number a m2 and s."""
        return self.chorus.rate * level_moment(self.chorus.level, self.chorus.deviation, 2)

    @cached_property
    def climb(self) -> Floats:
        """(image,) m that rays climb."""
        return np.maximum(self.heights.climb, CAVITY)

    @cached_property
    def edges(self) -> tuple[float, ...]:
        """Sines of the elevation, rising, between which the intensity is smooth."""
        lowest = self.climb / np.hypot(self.reach.reach, self.climb)
        least = float(lowest.min())
        steps = np.geomspace(least, 1.0, 2 + int(np.ceil(-np.log2(least))))
        above = np.unique(np.append(steps, lowest).round(12))
        above = above[np.append(True, np.diff(above) > 1e-9)]
        return tuple(np.concatenate([-above[::-1], above]).tolist())

    def intensity(self, sine: Floats, absorption: float) -> Floats:
        """Energy per unit of sine (node,), relative to that of a snap at 1 m times the snaps a m2: sum of 2 pi V^2
        exp(-a r)/|sine| over the images whose rays come from there; absorption: dB/m."""
        flat, away = np.asarray(sine, float).ravel(), np.maximum(np.abs(np.asarray(sine, float)).ravel(), 1e-12)
        length = self.climb[:, None] / away
        far = length * np.sqrt(1.0 - np.minimum(away, 1.0) ** 2)
        arrives = (far <= self.reach.reach * (1.0 + 1e-9)) & (np.sign(flat) == -self.heights.turns[:, None])
        intensity = self.share(far[0], length) * 10.0 ** (-absorption * length / 10.0)
        return np.asarray(2.0 * np.pi * np.where(arrives, intensity, 0.0).sum(axis=0) / away).reshape(np.shape(sine))

    def in_front(self, sine: Floats) -> Floats:
        """Share (...) of the azimuths, at sines (...) of the elevation, from which sound comes before the array."""
        ahead = self.receiver.pose.turn_to_world(np.array([1.0, 0.0, 0.0]))
        flat = np.sqrt(np.maximum(1.0 - sine**2, 0.0)) * np.hypot(ahead[0], ahead[1])
        return np.asarray(np.arccos(np.clip(-sine * ahead[2] / np.maximum(flat, 1e-15), -1.0, 1.0)) / np.pi)

    def power(self, absorption: float, low: float = -1.0, high: float = 1.0, behind: float = 1.0) -> float:
        """The integral of the intensity over sines from low to high, without faces; behind: what the baffle leaves of
        the energy of sound from behind the array."""

        def received(sine: Floats) -> Floats:
            front = self.in_front(sine)
            return self.intensity(sine, absorption) * (front + (1.0 - front) * behind)

        node, weight = np.polynomial.legendre.leggauss(PANELS)
        inner = [low, *(edge for edge in self.edges if low < edge < high), high]
        return sum(
            0.5 * (b - a) * float(weight @ received(0.5 * (a + b) + 0.5 * (b - a) * node)) for a, b in pairwise(inner)
        )

    def pulse_energy(self, frequency: Floats) -> Floats:
        """|S|^2 (bin,) in s^2 of snaps of 1 Pa behind the filter, the mean over their widths."""
        sonar, model = self.receiver.sonar, self.model
        samples = self.samples
        spectra = []
        for width in self.chorus.widths.tolist():
            f, spectrum = pulse_spectrum(waveform(model, width), sonar.antialias, sonar.sampling_frequency, samples)
            spectra.append(np.abs(spectrum) ** 2)
        peak = model.pulse(0.0, 0.0).peak
        return np.asarray(np.interp(frequency, f, np.mean(spectra, axis=0)) / peak**2)

    @property
    def pulse_duration(self) -> float:
        """(int s^2)^2 / int s^4 in s of a snap behind the filter."""
        sonar = self.receiver.sonar
        _, spectrum = pulse_spectrum(waveform(self.model), sonar.antialias, sonar.sampling_frequency, self.samples)
        return effective_duration(np.fft.irfft(spectrum), 1.0 / sonar.sampling_frequency)

    @cached_property
    def model(self) -> PulseModel:
        """Of a snap, on the bottom."""
        return self.chorus.snap.at_depth(self.plan.medium.depth)

    @cached_property
    def samples(self) -> int:
        """That hold a filtered snap."""
        sonar = self.receiver.sonar
        lasts = 4.0 * filters.duration(fir(sonar.antialias)) + 2e-3
        return 1 << int(np.ceil(np.log2(lasts * sonar.sampling_frequency)))

    @cached_property
    def _peaks(self) -> RegularGridInterpolator:
        """dB of the largest sample of snaps behind the filter, re their peak before any, over the path length and
        the sizes of the direction along y and z."""
        sonar, elements = self.receiver.sonar, self.receiver.elements
        turns = TURNS if elements.face else 2  # a point hears all directions alike
        reach, step = np.hypot(self.reach.reach, self.climb.max()), np.linspace(0.0, 1.0, turns)
        lengths = np.linspace(0.0, reach, LENGTHS)  # decibels fall almost as the length grows
        f, spectrum = pulse_spectrum(waveform(self.model), sonar.antialias, sonar.sampling_frequency, self.samples)
        used = np.flatnonzero(np.abs(spectrum) > 1e-6 * np.abs(spectrum).max())
        lost = self.plan.absorption(f[used])
        y, z = np.meshgrid(step, step, indexing="ij")
        towards = np.stack([np.zeros_like(y), y, z], axis=-1)[:, :, None, :]
        face = element_directivity(f[used], towards, elements.face, self.receiver.speed(self.plan.medium))
        table = np.empty((LENGTHS, turns, turns))
        for number, length in enumerate(lengths.tolist()):
            received = np.zeros((turns, turns, FINER * self.samples // 2 + 1), complex)
            received[..., used] = spectrum[used] * face * 10.0 ** (-lost * length / 20.0)
            wave = np.abs(np.fft.irfft(received, axis=-1)) * FINER * sonar.sampling_frequency
            largest = wave.reshape(turns, turns, -1, FINER).max(axis=2)
            table[number] = (20.0 * np.log10(np.maximum(largest, 1e-300))).mean(axis=-1)
        table -= 20.0 * np.log10(self.model.pulse(0.0, 0.0).peak)
        return RegularGridInterpolator((lengths, step, step), table, bounds_error=False, fill_value=None)

    @cached_property
    def _places(self) -> tuple[Floats, Floats, Floats]:
        """Horizontal distances (node,) in m; snaps/s (node,) there; gain (node, image) in dB of pressure, without
        absorption."""
        x, w = np.polynomial.legendre.leggauss(DISTANCES)
        rho, area = [], []
        for low, high in pairwise(self.reach.edges.tolist()):
            nodes = np.exp(0.5 * np.log(low * high) + 0.5 * np.log(high / low) * x)
            rho.append(nodes)
            area.append(np.pi * np.log(high / low) * w * nodes**2)
        away = np.concatenate(rho)
        length = np.maximum(np.hypot(away, self.climb[:, None]), CAVITY)
        share = self.share(away, length)
        gain = 10.0 * np.log10(np.maximum(share, 1e-30)) - 20.0 * np.log10(length)
        return away, self.chorus.rate * np.concatenate(area), gain.T

    @property
    def _behind(self) -> float:
        """dB: of sound from behind the array, which the baffle weakens."""
        return float(20.0 * np.log10(max(self.receiver.sonar.behind, 1e-15)))

    @cached_property
    def _received(self) -> tuple[Floats, Floats, Floats]:
        """Of snaps in all directions: gain (place, path) in dB from the source level to the largest sample at a
        hydrophone, delay (place, path) in s, and snaps/s (place,)."""
        away, rate, gain = self._places
        length = np.hypot(away[:, None], self.climb)
        around = 2.0 * np.pi * (np.arange(AZIMUTHS) + 0.5) / AZIMUTHS
        flat = (away[:, None] / length)[:, None, :]
        shape = (len(away), AZIMUTHS, len(self.climb))
        up = np.broadcast_to((-self.climb * self.heights.turns / length)[:, None, :], shape)
        towards = np.stack([flat * np.cos(around)[:, None], flat * np.sin(around)[:, None], up], axis=-1)
        towards = self.receiver.pose.turn_to_body(towards)
        long = np.broadcast_to(length[:, None, :], up.shape)
        sizes = np.abs(towards[..., 1:])
        received = gain[:, None, :] + self._peaks(np.stack([long, sizes[..., 0], sizes[..., 1]], axis=-1))
        received = received + np.where(towards[..., 0] < 0.0, self._behind, 0.0)
        delay = np.broadcast_to((length * self.heights.slowness)[:, None, :], received.shape)
        paths = len(self.climb)
        return received.reshape(-1, paths), delay.reshape(-1, paths), np.repeat(rate / AZIMUTHS, AZIMUTHS)

    def loud(self, levels: Floats) -> list[CountMoments]:
        """Arrivals whose largest sample is above each level (level,) in dB re 1 uPa. Snaps of a cluster are taken as
        one by one."""
        gain, delay, rate = self._received
        wide = float(np.hypot(self.chorus.deviation, 20.0 / np.log(10.0) * self.chorus.width))
        return path_counts(gain, delay, rate, (self.chorus.level, wide), levels)

    def energies(self, edges: Floats, seconds: float) -> Floats:
        """Energy (bin,) of paths by the sine of the elevation, over that of a snap at 1 m, between edges (bin + 1,),
        behind the baffle."""
        absorption = float(self.plan.absorption(self.receiver.centre))
        energy = partial(self.power, absorption, behind=self.receiver.sonar.behind**2)
        return np.array([seconds * self.chorus.rate * energy(a, b) for a, b in pairwise(edges.tolist())])

    def counts(self, edges: Floats, seconds: float, level: float) -> Floats:
        """Number (bin,) of paths whose peak at the centre, behind the baffle and before any filter, is above a level
        (dB re 1 uPa)."""
        away, rate, gain = self._places
        length = np.hypot(away[:, None], self.climb)
        needed = level - gain + float(self.plan.absorption(self.receiver.centre)) * length
        sine = -self.climb * self.heights.turns / length
        front, behind = self.in_front(sine), self._behind
        over, deviation = self.chorus.level - needed, max(self.chorus.deviation, 1e-9)
        share = front * ndtr(over / deviation) + (1.0 - front) * ndtr((over + behind) / deviation)
        often = rate[:, None] * share
        return seconds * np.histogram(sine.ravel(), edges, weights=often.ravel())[0]


def chorus_model(plan: Plan, first: Frame) -> ChorusModel | None:
    """The model of the chorus of a plan, at the array of a frame; None where it has none that sounds."""
    chorus, reach = plan.scene.world.chorus, plan.chorus
    if chorus is None or reach is None:
        return None
    receiver = receiver_of(plan, first)
    end = float(depth(first.sonar_pose.position))
    water = ChorusWater(plan.scene.world.environment, plan.profile, plan.scene.sonar, end)
    heights, share = image_shares(water, reach.images)
    return ChorusModel(chorus, reach, heights, share, plan, receiver)
