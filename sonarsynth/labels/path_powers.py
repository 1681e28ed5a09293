"""How much of a snap's energy each path brings in the band, and paths whose phases count, together.

Of a path with spectrum H(f) times that of the snap at 1 m, S(f), the level over the source level is

    10 log10( sum_f |H(f) S(f)|^2 / sum_f |S(f)|^2 )

over the band of the sonar; of paths together, H is the sum of those that are coherent, and the powers of others add.
Coherent paths so far apart in time that their pulses do not overlap add by power too, as the energy of their sum does.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.noise.path_sums import coherent_sums, mean_powers, power_steps
from sonarsynth.labels.level_band import SLICES, Band
from sonarsynth.products import FAMILIES, Arrivals

FEWEST, MOST = 16, SLICES
"""Slices of the band that are looked at: enough for one path, and for echoes as long as 960 over the bandwidth (16 ms
of 60 kHz, a body of 12 m); of longer ones they are a sample, which errs by 0.12 dB rms, 0.26 dB at most in 16."""


class Powers(NamedTuple):
    """Powers of paths over that of the snap at 1 m, in the band."""

    steps: Floats  # (step, path) with one factor more in each: scattering, way out, way in, absorption, boundaries
    whole: Ints = np.zeros(0, np.int64)  # (group,) a path of each: coherent, of a snap, target and family, overlapping
    whole_power: Floats = np.zeros(0)  # (group,) of their sum
    part: Ints = np.zeros(0, np.int64)  # (part,) a path of each part of a group: by the boundaries touched last
    part_power: Floats = np.zeros(0)  # (part,) of their sum
    part_direction: Floats = np.zeros((0, 3))  # (part, xyz) by the share of each path in that power, times the power


def family(arrivals: Arrivals) -> Ints:
    """Index into FAMILIES of each arrival (path,)."""
    return np.asarray((arrivals.surface > 0) + 2 * (arrivals.bottom > 0))


def path_powers(arrivals: Arrivals, band: Band) -> Powers:
    """Powers in the band of each path, and of coherent ones together."""
    few = band.sliced(FEWEST)
    columns = arrivals.coherent, arrivals.coherent_fraction, arrivals.height_delay_std, arrivals.absorption
    blurs = arrivals.delay_std, arrivals.echo_delay_std
    bins = few.frequency, few.relative, few.weight
    # echo: with the facet's own roughness, which is no loss at a boundary
    facet, *means = mean_powers(arrivals.snap, *columns, *blurs, *bins, arrivals.centre)
    together: tuple[Any, ...] = ()
    if arrivals.coherent.any():
        rows = np.flatnonzero(arrivals.coherent)
        mean, together = _coherent(arrivals, rows, band)
        with np.errstate(divide="ignore", invalid="ignore"):
            for power in means:
                power[rows] = np.nan_to_num(power[rows] / facet[rows]) * mean
    ways = arrivals.scattering, arrivals.spreading_out, arrivals.spreading_in
    return Powers(power_steps(*ways, arrivals.absorption, arrivals.boundary, np.stack(means)), *together)


def _groups(arrivals: Arrivals, rows: Ints, apart: float) -> tuple[Ints, Ints, Floats, float]:
    """Group (row,) of each path, and part of a group that it is in (row,); mean delay (group,); length of the longest.

    Groups are paths of one snap, target and family; silences longer than `apart` (s) divide them.
    """
    delay, early, late = (
        x[rows] for x in (arrivals.delay, arrivals.corner_delays.min(axis=1), arrivals.corner_delays.max(axis=1))
    )
    cell = (arrivals.snap[rows] * (arrivals.target.max() + 2) + arrivals.target[rows] + 1) * len(FAMILIES)
    cell = cell + family(arrivals)[rows]
    order = np.lexsort((delay + early, cell))
    new = np.ones(len(rows), bool)
    for start, stop in _runs(cell[order]):
        members = order[start:stop]
        ends = np.maximum.accumulate((delay + late)[members])
        new[start + 1 : stop] = (delay + early)[members[1:]] > ends[:-1] + apart
    group = np.empty(len(rows), np.int64)
    group[order] = np.cumsum(new) - 1
    count = np.bincount(group)
    middle = np.bincount(group, delay) / count
    first, last = np.full(len(count), np.inf), np.full(len(count), -np.inf)
    np.minimum.at(first, group, delay + early)
    np.maximum.at(last, group, delay + late)
    _, part = np.unique(group * len(FAMILIES) + arrivals.arrives_by[rows], return_inverse=True)
    return group, part, middle, float((last - first).max())


def _runs(sorted_values: Ints) -> zip[tuple[int, int]]:
    """First and last + 1 of each run of equal values."""
    edges = np.flatnonzero(np.diff(sorted_values)) + 1
    return zip([0, *edges.tolist()], [*edges.tolist(), len(sorted_values)], strict=True)


def _coherent(arrivals: Arrivals, rows: Ints, band: Band) -> tuple[Floats, tuple[Any, ...]]:
    """Mean power (row,) of what each facet does to the pulse, and, as `Powers` has them, the paths of these rows
    together."""
    apart = band.pulse
    group, part, middle, longest = _groups(arrivals, rows, apart)
    fine = band.sliced(float(np.clip((band.high - band.low) * (longest + apart), FEWEST, MOST)))
    f, slope = fine.frequency, fine.frequency / arrivals.centre
    weight = fine.weight * slope**2
    _, representative = np.unique(group, return_index=True)
    paths = arrivals.select(rows)
    least = _least(paths.delay_std, group)
    loss = np.bincount(group, paths.absorption) / np.bincount(group)
    real, imaginary, mean = coherent_sums(
        part,
        paths.snap,
        paths.amplitude,
        paths.phase,
        paths.delay - middle[group],
        paths.corner_delays,
        paths.absorption - loss[group],
        np.maximum(paths.delay_std**2 - least[group] ** 2, 0.0),
        paths.direction,
        f,
        fine.relative,
        weight,
        int(part.max()) + 1,
    )
    sums = real + 1j * imaginary
    _, first = np.unique(part, return_index=True)
    owner = group[first]  # (part,) its group
    absorbed = 10.0 ** (-np.outer(loss, fine.relative) / 10.0) * np.exp(-np.outer(least**2, (2.0 * np.pi * f) ** 2))
    share = weight[paths.snap[representative]] * absorbed  # (group, bin) of the energy
    total = np.zeros((len(loss), len(f)), complex)
    np.add.at(total, owner, sums[:, 0])
    whole_power = (np.abs(total) ** 2 * share).sum(axis=1)
    products = (np.conj(sums[:, :1]) * sums).real @ share[owner][:, :, None]
    return mean, (rows[representative], whole_power, rows[first], products[:, 0, 0], products[:, 1:, 0])


def _least(values: Floats, group: Ints) -> Floats:
    out = np.full(int(group.max()) + 1, np.inf)
    np.minimum.at(out, group, values)
    return out
