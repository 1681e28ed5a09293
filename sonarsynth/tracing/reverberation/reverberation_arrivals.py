"""The reverberation of a frame: families of paths, which of them are worth it, and the scatterers that make them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.environment.reverberation import Reverberation
from sonarsynth.equations.reverberation.speckle import SINC
from sonarsynth.products.pulse_arrivals import PulseArrivals
from sonarsynth.randomness import number
from sonarsynth.sources.sound_source import Emission
from sonarsynth.state import Medium, Receiver
from sonarsynth.tracing.reverberation.cells import Cells, counts, scatterers, texture
from sonarsynth.tracing.reverberation.families import (
    FAINT,
    STEP,
    UNDER_NOISE,
    Family,
    ReverberationWindow,
    all_families,
    end_depths,
    expected_counts,
    spare_time,
    strength,
    time_bins,
)
from sonarsynth.tracing.reverberation.geometry_of_paths import ScatteredPaths, back_ways, out_ways, scattered_paths

MOST = 1_000_000
"""Scatterers of a frame."""


@dataclass(frozen=True, eq=False)
class ReverberationArrivals(PulseArrivals):
    """As `PulseArrivals`, with

    lit_from    (path,)       m     length of the way out
    emission    (path,)       -     number of the emission
    family      (path,)       -     number of the family, of `families`
    energy      (path,)       Pa2 s received at the array centre in the band, absorbed as at its centre
    """

    lit_from: Floats
    emission: Ints
    family: Ints
    energy: Floats
    families: tuple[str, ...]
    left_out: tuple[tuple[str, float], ...]  # families left out, and dB re all of the reverberation of the frame

    @property
    def before(self) -> Floats:
        """As `PulseArrivals.before`."""
        return self.lit_from

    def contrast_error(self, bandwidth: float) -> float:
        """By what part <I^2>/<I>^2 at a hydrophone of this bandwidth (Hz) is over that of very many, 2: J/(2 n), n the
        scatterers within 1/bandwidth that their energies are as good as, in steps of time weighed by their energy."""
        _, step = np.unique(np.floor(self.delay / STEP).astype(np.int64), return_inverse=True)
        energy, squares = (np.bincount(step, self.energy**power) for power in (1, 2))
        return float(0.5 * SINC * bandwidth * STEP * (squares / energy).sum() / energy.sum())

    @staticmethod
    def _whole() -> tuple[str, ...]:
        return ("sound_speed", "families", "left_out")


def reverberation_arrivals(
    described: Reverberation,
    snaps: tuple[Emission, ...],
    medium: Medium,
    receiver: Receiver,
    listening: ReverberationWindow,
    seed: int,
    key: int | str,
) -> ReverberationArrivals:
    """What reaches the array of the sound of snaps that light; seed and key: of the sequence.

    Scatterers are as many as make the contrast of what a hydrophone hears err by `speckle`, at all times. Their
    expected energy is that of the strengths, exactly, whatever their number.
    """
    families = list(all_families(described, snaps, medium, receiver, listening))
    spare = max((spare_time(f.cells, medium) for f in families), default=0.0)
    counted = listening._replace(start=listening.start - spare, stop=listening.stop + spare)
    bins = max(int(np.ceil((counted.stop - counted.start) / STEP)), 1)

    def rate(group: list[Family]) -> Floats:
        rates = np.zeros(bins)
        for f in group:
            np.add.at(rates, time_bins(f.paths.delay, counted, bins), f.energy / STEP)
        return rates

    total_rate = rate(families)
    audible, left_out = list[Family](), list[tuple[str, float]]()
    names = tuple(dict.fromkeys(f.name for f in families))
    for name in names:
        group = [f for f in families if f.name == name]
        own = rate(group)
        if (
            own > np.maximum(10.0 ** (-FAINT / 10.0) * total_rate, 10.0 ** (-UNDER_NOISE / 10.0) * listening.noise)
        ).any():
            audible += group
        elif own.any():
            left_out.append((name, float(10.0 * np.log10(own.sum() / total_rate.sum()))))
    expected = expected_counts(audible, counted, bins)
    total = sum(float(x.sum()) for x in expected)
    if total > MOST:
        raise ValueError(
            f"reverberation needs {total:.2g} scatterers a frame, more than {MOST}: raise accuracy.speckle"
        )
    drawn = [_drawn(described, f, x, snaps, medium, receiver, listening, number(seed, f.owner, key))
             for f, x in zip(audible, expected, strict=True)]  # fmt: skip
    return _joined(drawn, audible, names, tuple(left_out), receiver, receiver.speed(medium))


class _DrawnScatterers(NamedTuple):
    """Scatterers of a family."""

    paths: ScatteredPaths
    gain: Floats
    energy: Floats
    keep: Ints


def _drawn(
    described: Reverberation,
    family: Family,
    expected: Floats,
    snaps: tuple[Emission, ...],
    medium: Medium,
    receiver: Receiver,
    listening: ReverberationWindow,
    seed: int,
) -> _DrawnScatterers:
    occupied = np.flatnonzero(expected > 0.0)
    cells = Cells(family.cells.key[occupied], family.cells.low[occupied], family.cells.size)
    count = counts(seed, cells, expected[occupied])
    position, cell, sign = scatterers(seed, cells, count)
    snap, end = snaps[family.emission], end_depths(position, family.owner)
    out = out_ways(medium, snap, end, described.bounces, family.owner)[family.out]
    back = back_ways(medium, receiver, end, described.bounces, family.owner)[family.back]
    paths = scattered_paths(position, snap, medium, receiver, out, back)
    cross = strength(described, family.owner, paths, medium, receiver.centre) * cells.measure / expected[occupied][cell]
    cross *= texture(seed, position, described.patch, described.patchiness)
    turn = np.where(np.floor(sign * 2.0 ** (4 + 5 * family.out + family.back)) % 2.0, -1.0, 1.0)
    energy = cross * paths.flux * listening.sent[family.emission]
    keep = np.flatnonzero((energy > 0.0) & (paths.delay > listening.start) & (paths.delay < listening.stop))
    return _DrawnScatterers(paths, turn * np.sqrt(cross) * paths.amplitude, energy, keep)


def _joined(
    drawn: list[_DrawnScatterers],
    families: list[Family],
    names: tuple[str, ...],
    left_out: tuple[tuple[str, float], ...],
    receiver: Receiver,
    sound_speed: float,
) -> ReverberationArrivals:
    def joined(values: list[Floats], shape: tuple[int, ...] = ()) -> Floats:
        return np.concatenate([np.zeros((0, *shape)), *(v[p.keep] for v, p in zip(values, drawn, strict=True))])

    count = [len(p.keep) for p in drawn]
    paths, delay = [p.paths for p in drawn], joined([p.paths.delay for p in drawn])
    none = np.zeros(len(delay))
    return ReverberationArrivals(
        delay=delay,
        direction=receiver.turn_to_array(joined([p.towards for p in paths], (3,)), delay),
        length=joined([p.back for p in paths]),
        gain=joined([p.gain for p in drawn]),
        phase=none,
        delay_std=none,
        sound_speed=sound_speed,
        lit_from=joined([p.out for p in paths]),
        emission=np.repeat([f.emission for f in families], count).astype(np.int64),
        family=np.repeat([names.index(f.name) for f in families], count).astype(np.int64),
        energy=joined([p.energy for p in drawn]),
        families=names,
        left_out=left_out,
    )
