"""The reverberation of a frame: families of paths, which of them are worth it, and the scatterers that make them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.environment.reverberation import Reverberation
from sonarsynth.products.pulse_arrivals import ReverberationArrivals
from sonarsynth.randomness import number
from sonarsynth.state import FrameContext
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
from sonarsynth.tracing.reverberation.reverberation_shadows import Shadows

MOST = 1_000_000
"""Scatterers of a frame."""


def reverberation_arrivals(
    described: Reverberation, context: FrameContext, listening: ReverberationWindow, seed: int, key: int | str
) -> ReverberationArrivals:
    """What reaches the array of the sound of snaps that light; seed and key: of the sequence.

    Scatterers are as many as make the contrast of what a hydrophone hears err by `speckle`, at all times. Their
    expected energy is that of the strengths, exactly, whatever their number; but for those that a body hides from the
    snap, or from the array (`reverberation_shadows`).
    """
    snaps, medium, receiver = context.snaps, context.medium, context.receiver
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
    shadows = Shadows.of(context)
    drawn = [_drawn(described, f, x, context, shadows, listening, number(seed, f.owner, key))
             for f, x in zip(audible, expected, strict=True)]  # fmt: skip
    return _joined(drawn, audible, names, tuple(left_out), shadows, context)


class _DrawnScatterers(NamedTuple):
    """Scatterers of a family."""

    paths: ScatteredPaths
    gain: Floats
    energy: Floats
    keep: Ints
    hidden: Bools  # (kept, part)


def _drawn(
    described: Reverberation,
    family: Family,
    expected: Floats,
    context: FrameContext,
    shadows: Shadows,
    listening: ReverberationWindow,
    seed: int,
) -> _DrawnScatterers:
    medium, receiver = context.medium, context.receiver
    occupied = np.flatnonzero(expected > 0.0)
    cells = Cells(family.cells.key[occupied], family.cells.low[occupied], family.cells.size)
    count = counts(seed, cells, expected[occupied])
    position, cell, sign = scatterers(seed, cells, count)
    snap, end = context.snaps[family.emission], end_depths(position, family.owner)
    out = out_ways(medium, snap, end, described.bounces, family.owner)[family.out]
    back = back_ways(medium, receiver, end, described.bounces, family.owner)[family.back]
    paths = scattered_paths(position, snap, medium, receiver, out, back)
    cross = strength(described, family.owner, paths, medium, receiver.centre) * cells.measure / expected[occupied][cell]
    cross *= texture(seed, position, described.patch, described.patchiness)
    turn = np.where(np.floor(sign * 2.0 ** (4 + 5 * family.out + family.back)) % 2.0, -1.0, 1.0)
    energy = cross * paths.flux * listening.sent[family.emission]
    keep = np.flatnonzero((energy > 0.0) & (paths.delay > listening.start) & (paths.delay < listening.stop))
    keep = keep[shadows.lit(family.emission, snap.position, position[keep], paths.way_out[keep], out.bounces)]
    hidden = shadows.hidden(family.emission, position[keep], paths.way_back[keep], back.bounces)
    heard = ~hidden.all(axis=1)
    return _DrawnScatterers(paths, turn * np.sqrt(cross) * paths.amplitude, energy, keep[heard], hidden[heard])


def _joined(
    drawn: list[_DrawnScatterers],
    families: list[Family],
    names: tuple[str, ...],
    left_out: tuple[tuple[str, float], ...],
    shadows: Shadows,
    context: FrameContext,
) -> ReverberationArrivals:
    def joined(values: list[Floats], shape: tuple[int, ...] = ()) -> Floats:
        return np.concatenate([np.zeros((0, *shape)), *(v[p.keep] for v, p in zip(values, drawn, strict=True))])

    count = [len(p.keep) for p in drawn]
    paths, delay = [p.paths for p in drawn], joined([p.paths.delay for p in drawn])
    none = np.zeros(len(delay))
    return ReverberationArrivals(
        delay=delay,
        direction=context.receiver.turn_to_array(joined([p.towards for p in paths], (3,)), delay),
        length=joined([p.back for p in paths]),
        gain=joined([p.gain for p in drawn]),
        phase=none,
        delay_std=none,
        sound_speed=context.receiver.speed(context.medium),
        lit_from=joined([p.out for p in paths]),
        emission=np.repeat([f.emission for f in families], count).astype(np.int64),
        family=np.repeat([names.index(f.name) for f in families], count).astype(np.int64),
        energy=joined([p.energy for p in drawn]),
        hidden=np.concatenate([np.zeros((0, len(shadows.parts)), bool), *(p.hidden for p in drawn)]),
        families=names,
        left_out=left_out,
        parts=shadows.parts,
    )
