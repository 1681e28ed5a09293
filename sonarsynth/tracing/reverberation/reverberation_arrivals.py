"""The reverberation of a frame: families of paths, which of them are worth it, and the scatterers that make them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Floats, Ints, depth
from sonarsynth.environment.boundaries import SeaBottom, SeaSurface, Sediment
from sonarsynth.environment.boundary_numbers import coefficient, rms_height
from sonarsynth.environment.reverberation import Reverberation
from sonarsynth.equations.reverberation.speckle import scatterers_per_pulse
from sonarsynth.products.pulse_arrivals import PulseArrivals
from sonarsynth.randomness import number
from sonarsynth.scattering.boundaries import BoundarySite
from sonarsynth.sources.sound_source import Emission
from sonarsynth.state import Medium, Receiver
from sonarsynth.tracing.reverberation.cells import Cells, cells_about, counts, scatterers, side_for, texture
from sonarsynth.tracing.reverberation.geometry_of_paths import ScatteredPaths, back_ways, out_ways, scattered_paths
from sonarsynth.tracing.reverberation.ways import Way

STEP = 0.5e-3
"""s: time in which what arrives is counted."""
FAINT, UNDER_NOISE = 40.0, 10.0
"""dB: a family is left out that is at all times so far under all of the reverberation; or so far under the noise of a
beam, even if all of it came from one direction."""
MOST = 1_000_000
"""Scatterers of a frame."""


class Listening(NamedTuple):
    """What is listened for."""

    start: float  # s: of the record, after the instant of the frame
    stop: float
    bandwidth: float  # Hz
    speckle: float  # error of the contrast that is allowed
    sent: Floats  # (snap,) Pa2 s: energy of each pulse in the band at 1 m
    noise: float  # Pa2: power of the noise of a beam in the band


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

    @staticmethod
    def _whole() -> tuple[str, ...]:
        return ("sound_speed", "families", "left_out")


class _Family(NamedTuple):
    """Paths of one emission by the cells of one owner, one way out and one way back."""

    owner: str
    emission: int
    out: int  # number of the way
    back: int
    name: str
    cells: Cells
    paths: ScatteredPaths
    energy: Floats  # (cell,) Pa2 s, as if all of it came from its middle


def reverberation_arrivals(
    described: Reverberation,
    snaps: tuple[Emission, ...],
    medium: Medium,
    receiver: Receiver,
    listening: Listening,
    seed: int,
    key: int | str,
) -> ReverberationArrivals:
    """What reaches the array of the sound of snaps that light; seed and key: of the sequence.

    Scatterers are as many as make the contrast of what a hydrophone hears err by `speckle`, at all times. Their
    expected energy is that of the strengths, exactly,
    whatever their number.
    """
    families = list(_families(described, snaps, medium, receiver, listening))
    bins = max(int(np.ceil((listening.stop - listening.start) / STEP)), 1)

    def rate(some: list[_Family]) -> Floats:
        rates = np.zeros(bins)
        for f in some:
            np.add.at(rates, _bin(f.paths.delay, listening, bins), f.energy / STEP)
        return rates

    whole = rate(families)
    heard, left_out = list[_Family](), list[tuple[str, float]]()
    names = tuple(dict.fromkeys(f.name for f in families))
    for name in names:
        some = [f for f in families if f.name == name]
        own = rate(some)
        if (own > np.maximum(10.0 ** (-FAINT / 10.0) * whole, 10.0 ** (-UNDER_NOISE / 10.0) * listening.noise)).any():
            heard += some
        elif own.any():
            left_out.append((name, float(10.0 * np.log10(own.sum() / whole.sum()))))
    expected = _expected(heard, listening, bins)
    total = sum(float(x.sum()) for x in expected)
    if total > MOST:
        raise ValueError(
            f"reverberation needs {total:.2g} scatterers a frame, more than {MOST}: raise accuracy.speckle"
        )
    parts = [_drawn(described, f, x, snaps, medium, receiver, listening, number(seed, f.owner, key))
             for f, x in zip(heard, expected, strict=True)]  # fmt: skip
    return _joined(parts, heard, names, tuple(left_out), receiver.pose.rotation, receiver.speed(medium))


def _expected(heard: list[_Family], listening: Listening, bins: int) -> list[Floats]:
    """How many scatterers each cell of each family has, on average.

    As the root of what it sends, so that those of quiet directions are quiet too. Of so many (i) with energies e the
    spread of intensities is sum e^1.5 sum e^0.5/(sum e)^2: those that arrive together are as many as that takes.
    """
    many = scatterers_per_pulse(listening.speckle) * listening.bandwidth * STEP
    which = [_bin(f.paths.delay, listening, bins) for f in heard]
    whole, steep = np.zeros(bins), np.zeros(bins)
    for f, b in zip(heard, which, strict=True):
        np.add.at(whole, b, f.energy)
        np.add.at(steep, b, f.energy**1.5)
    each = many * np.divide(steep, whole**2, out=np.zeros(bins), where=whole > 0.0)
    return [each[b] * np.sqrt(f.energy) for f, b in zip(heard, which, strict=True)]


def _bin(delay: Floats, listening: Listening, bins: int) -> Ints:
    return np.clip(((delay - listening.start) / STEP).astype(np.int64), 0, bins - 1)


def _families(
    described: Reverberation, snaps: tuple[Emission, ...], medium: Medium, receiver: Receiver, listening: Listening
) -> Iterator[_Family]:
    fastest = float(medium.profile.speed.max())
    lit = [(n, snap) for n, snap in enumerate(snaps) if snap.illuminates and listening.sent[n] > 0.0]
    longest = max((listening.stop - snap.time for _, snap in lit), default=0.0)
    side = side_for(0.5 * fastest * longest)
    for n, snap in lit:
        reach = 0.5 * fastest * (listening.stop - snap.time)
        if reach <= 0.0:
            continue
        middle = 0.5 * (snap.position + receiver.pose.position)[:2]
        for owner in described.owners:
            cells = cells_about(middle, reach, side, owner, medium.depth)
            yield from _of_owner(described, n, snap, owner, cells, medium, receiver, listening)


def _of_owner(
    described: Reverberation,
    n: int,
    snap: Emission,
    owner: str,
    cells: Cells,
    medium: Medium,
    receiver: Receiver,
    listening: Listening,
) -> Iterator[_Family]:
    spare = 0.5 * cells.size[0] / float(medium.profile.speed.min())
    end = _end_depth(cells.middle, owner)
    backs = back_ways(medium, receiver, end, described.bounces, owner)
    for i, out in enumerate(out_ways(medium, snap, end, described.bounces, owner)):
        for j, back in enumerate(backs):
            if out.bounces + back.bounces > described.bounces:
                continue
            paths = scattered_paths(cells.middle, snap, medium, receiver, out, back)
            far = np.maximum(paths.out, spare), np.maximum(paths.back, spare)
            tame = (paths.out * paths.back / (far[0] * far[1])) ** 2  # a cell about the source: of its mean distance
            energy = _strength(described, owner, paths, medium, receiver) * paths.flux * tame
            energy *= cells.measure * listening.sent[n]
            energy[(paths.delay < listening.start - spare) | (paths.delay > listening.stop + spare)] = 0.0
            if energy.any():
                yield _Family(owner, n, i, j, _name(owner, out, back), cells, paths, energy)


def _end_depth(place: Floats, owner: str) -> Floats:
    """Depths of scatterers: one for all of a boundary."""
    return np.asarray(depth(place if owner == "volume" else place[:1]), float)


def _name(owner: str, out: Way, back: Way) -> str:
    """A family in words."""

    def by(way: Way) -> str:
        many = {"surface": way.surface, "bottom": way.bottom}
        return " and ".join(f"{name} {count}" if count > 1 else name for name, count in many.items() if count)

    ends = [f"{what} by {by(way)}" for what, way in (("lit", out), ("heard", back)) if way.bounces]
    return owner + (f" {' and '.join(ends)}" if ends else "")


def _strength(
    described: Reverberation, owner: str, paths: ScatteredPaths, medium: Medium, receiver: Receiver
) -> Floats:
    """Cross-section (point,) per m2, or m3, and sr."""
    return strength_at(described, owner, paths, medium, receiver.centre)


def strength_at(
    described: Reverberation, owner: str, paths: ScatteredPaths, medium: Medium, frequency: float
) -> Floats:
    """The same at any frequency (Hz)."""
    if owner == "volume":
        return np.full(len(paths.delay), 10.0 ** ((described.volume or 0.0) / 10.0))
    law = described.bottom if owner == "bottom" else described.surface
    environment = medium.environment
    boundary: SeaSurface | SeaBottom = environment.bottom if owner == "bottom" else environment.surface
    wind = boundary.wind_speed if isinstance(boundary, SeaSurface) else None
    made = boundary.reflection
    site = BoundarySite(
        frequency,
        2.0 * np.pi * frequency / float(medium.profile.at(medium.depth if owner == "bottom" else 0.0)),
        lambda grazing: np.abs(coefficient(boundary, grazing, frequency)),
        wind,
        rms_height(boundary),
        made.name if isinstance(made, Sediment) else None,
    )
    return np.zeros(len(paths.delay)) if law is None else law.strength(paths.angles, site)


class _Drawn(NamedTuple):
    """Scatterers of a family."""

    paths: ScatteredPaths
    gain: Floats
    energy: Floats
    keep: Ints


def _drawn(
    described: Reverberation,
    family: _Family,
    expected: Floats,
    snaps: tuple[Emission, ...],
    medium: Medium,
    receiver: Receiver,
    listening: Listening,
    seed: int,
) -> _Drawn:
    some = np.flatnonzero(expected > 0.0)
    cells = Cells(family.cells.key[some], family.cells.low[some], family.cells.size)
    count = counts(seed, cells, expected[some])
    place, cell, sign = scatterers(seed, cells, count)
    snap, end = snaps[family.emission], _end_depth(place, family.owner)
    out = out_ways(medium, snap, end, described.bounces, family.owner)[family.out]
    back = back_ways(medium, receiver, end, described.bounces, family.owner)[family.back]
    paths = scattered_paths(place, snap, medium, receiver, out, back)
    cross = _strength(described, family.owner, paths, medium, receiver) * cells.measure / expected[some][cell]
    cross *= texture(seed, place, described.patch, described.patchiness)
    turn = np.where(np.floor(sign * 2.0 ** (4 + 5 * family.out + family.back)) % 2.0, -1.0, 1.0)
    energy = cross * paths.flux * listening.sent[family.emission]
    keep = np.flatnonzero((energy > 0.0) & (paths.delay > listening.start) & (paths.delay < listening.stop))
    return _Drawn(paths, turn * np.sqrt(cross) * paths.amplitude, energy, keep)


def _joined(
    parts: list[_Drawn],
    heard: list[_Family],
    names: tuple[str, ...],
    left_out: tuple[tuple[str, float], ...],
    rotation: Floats,
    sound_speed: float,
) -> ReverberationArrivals:
    def joined(values: list[Floats], shape: tuple[int, ...] = ()) -> Floats:
        return np.concatenate([np.zeros((0, *shape)), *(v[p.keep] for v, p in zip(values, parts, strict=True))])

    count = [len(p.keep) for p in parts]
    paths, delay = [p.paths for p in parts], joined([p.paths.delay for p in parts])
    none = np.zeros(len(delay))
    return ReverberationArrivals(
        delay=delay,
        direction=joined([p.towards for p in paths], (3,)) @ rotation,
        length=joined([p.back for p in paths]),
        gain=joined([p.gain for p in parts]),
        phase=none,
        delay_std=none,
        sound_speed=sound_speed,
        lit_from=joined([p.out for p in paths]),
        emission=np.repeat([f.emission for f in heard], count).astype(np.int64),
        family=np.repeat([names.index(f.name) for f in heard], count).astype(np.int64),
        energy=joined([p.energy for p in parts]),
        families=names,
        left_out=left_out,
    )
