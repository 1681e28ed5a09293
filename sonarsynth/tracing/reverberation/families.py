"""Families of paths of reverberation: what each sends to the array, and how many scatterers that is worth."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Floats, Ints, depth
from sonarsynth.environment.boundaries import SeaBottom, SeaSurface
from sonarsynth.environment.boundary_numbers import coefficient, rms_height
from sonarsynth.environment.reverberation import Reverberation
from sonarsynth.equations.reverberation.speckle import SINC, scatterers_per_pulse
from sonarsynth.products.pulse_arrivals import ReverberationArrivals
from sonarsynth.scattering.boundaries import BoundarySite
from sonarsynth.sources.sound_source import Emission
from sonarsynth.state import Medium, Receiver
from sonarsynth.tracing.reverberation.cells import Cells, cells_about, side_for
from sonarsynth.tracing.reverberation.geometry_of_paths import ScatteredPaths, back_ways, out_ways, scattered_paths
from sonarsynth.tracing.reverberation.ways import UnfoldedPaths

STEP = 0.5e-3
"""s: time in which what arrives is counted."""
FAINT, UNDER_NOISE = 40.0, 10.0
"""dB: a family is left out that is at all times so far under all of the reverberation; or so far under the noise of a
beam, even if all of it came from one direction."""


class ReverberationWindow(NamedTuple):
    """What is listened for."""

    start: float  # s: of the record, after the instant of the frame
    stop: float
    bandwidth: float  # Hz
    speckle: float  # error of the contrast that is allowed
    spread: float  # how many times as many scatterers that takes as if those that arrive together were alike
    sent: Floats  # (snap,) Pa2 s: energy of each pulse in the band at 1 m
    noise: float  # Pa2: power of the noise of a beam in the band


class Family(NamedTuple):
    """Paths of one emission by the cells of one owner, one way out and one way back."""

    owner: str
    emission: int
    out: int  # number of the way
    back: int
    name: str
    cells: Cells
    paths: ScatteredPaths
    energy: Floats  # (cell,) Pa2 s, as if all of it came from its middle


def all_families(
    described: Reverberation,
    snaps: tuple[Emission, ...],
    medium: Medium,
    receiver: Receiver,
    listening: ReverberationWindow,
) -> Iterator[Family]:
    """Of all snaps that light, by everything that scatters: those that send anything within the record."""
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
    listening: ReverberationWindow,
) -> Iterator[Family]:
    spare = spare_time(cells, medium)
    end = end_depths(cells.middle, owner)
    backs = back_ways(medium, receiver, end, described.bounces, owner)
    for i, out in enumerate(out_ways(medium, snap, end, described.bounces, owner)):
        for j, back in enumerate(backs):
            if out.bounces + back.bounces > described.bounces:
                continue
            paths = scattered_paths(cells.middle, snap, medium, receiver, out, back)
            far = np.maximum(paths.out, 0.5 * cells.size[0]), np.maximum(paths.back, 0.5 * cells.size[0])
            tame = (paths.out * paths.back / (far[0] * far[1])) ** 2  # a cell about the source: of its mean distance
            energy = strength(described, owner, paths, medium, receiver.centre) * paths.flux * tame
            energy *= cells.measure * listening.sent[n]
            energy[(paths.delay < listening.start - spare) | (paths.delay > listening.stop + spare)] = 0.0
            if energy.any():
                yield Family(owner, n, i, j, _name(owner, out, back), cells, paths, energy)


def spare_time(cells: Cells, medium: Medium) -> float:
    """s: what a cell scatters arrives within so much of what its middle does: by half a diagonal out, half one back."""
    return float(np.linalg.norm(cells.size)) / float(medium.profile.speed.min())


def end_depths(position: Floats, owner: str) -> Floats:
    """Depths of scatterers: one for all of a boundary."""
    return np.asarray(depth(position if owner == "volume" else position[:1]), float)


def _name(owner: str, out: UnfoldedPaths, back: UnfoldedPaths) -> str:
    """A family in words."""

    def by(path: UnfoldedPaths) -> str:
        many = {"surface": path.surface, "bottom": path.bottom}
        return " and ".join(f"{name} {count}" if count > 1 else name for name, count in many.items() if count)

    ends = [f"{verb} by {by(path)}" for verb, path in (("lit", out), ("heard", back)) if path.bounces]
    return owner + (f" {' and '.join(ends)}" if ends else "")


def strength(described: Reverberation, owner: str, paths: ScatteredPaths, medium: Medium, frequency: float) -> Floats:
    """Cross-section (point,) per m2, or m3, and sr, at a frequency (Hz). Raises ValueError for a boundary that a law
    does not fit."""
    if owner == "volume":
        return np.full(len(paths.delay), 10.0 ** ((described.volume or 0.0) / 10.0))
    law = described.bottom if owner == "bottom" else described.surface
    site = site_of(owner, medium, frequency)
    return np.zeros(len(paths.delay)) if law is None else law.checked_strength(paths.angles, site)


def site_of(owner: str, medium: Medium, frequency: float) -> BoundarySite:
    """Bottom or surface, as laws see it at a frequency (Hz)."""
    environment = medium.environment
    boundary: SeaSurface | SeaBottom = environment.bottom if owner == "bottom" else environment.surface
    wind = boundary.wind_speed if isinstance(boundary, SeaSurface) else None
    return BoundarySite(
        frequency,
        2.0 * np.pi * frequency / float(medium.profile.at(medium.depth if owner == "bottom" else 0.0)),
        lambda grazing: np.abs(coefficient(boundary, grazing, frequency)),
        wind,
        rms_height(boundary),
        boundary.reflection.sediment,
    )


def expected_counts(families: list[Family], listening: ReverberationWindow, bins: int) -> list[Floats]:
    """How many scatterers each cell of each family has, on average.

    As the root of what it sends, so that those of quiet directions are quiet too. Of so many (i) with energies e the
    spread of intensities is sum e^1.5 sum e^0.5/(sum e)^2: those that arrive together are as many as that takes.
    """
    many = scatterers_per_pulse(listening.speckle, listening.spread) * listening.bandwidth * STEP
    which = [time_bins(f.paths.delay, listening, bins) for f in families]
    total, steep = np.zeros(bins), np.zeros(bins)
    for f, b in zip(families, which, strict=True):
        np.add.at(total, b, f.energy)
        np.add.at(steep, b, f.energy**1.5)
    scale = many * np.divide(steep, total**2, out=np.zeros(bins), where=total > 0.0)
    return [scale[b] * np.sqrt(f.energy) for f, b in zip(families, which, strict=True)]


def contrast_error(arrivals: ReverberationArrivals, bandwidth: float) -> float:
    """By what part <I^2>/<I>^2 at a hydrophone of this bandwidth (Hz) is over that of very many, 2: J/(2 n), n the
    scatterers within 1/bandwidth that their energies are as good as, in steps of time weighed by their energy."""
    _, step = np.unique(np.floor(arrivals.delay / STEP).astype(np.int64), return_inverse=True)
    energy, squares = (np.bincount(step, arrivals.energy**power) for power in (1, 2))
    return float(0.5 * SINC * bandwidth * STEP * (squares / energy).sum() / energy.sum())


def time_bins(delay: Floats, listening: ReverberationWindow, bins: int) -> Ints:
    """Numbers (...) of the steps of time that delays (...) fall in; those outside in the first or the last."""
    return np.clip(((delay - listening.start) / STEP).astype(np.int64), 0, bins - 1)
