"""The link budget: levels of each snap, target and family of paths that add up, and one path of each to check."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.noise.path_sums import budget_sums
from sonarsynth.equations.scattering.facet_pulses import facet_response
from sonarsynth.labels.level_band import SLICES, Band
from sonarsynth.labels.path_powers import Powers, family
from sonarsynth.products import FAMILIES, LINK_BUDGET, Arrivals, LinkBudget

QUIET = 1e-12
"""A path that rough surfaces leave less of its power than this is not looked for in the signals."""


def link_budget(
    arrivals: Arrivals, powers: Powers, band: Band, targets: int, snap_level: Floats, error: float
) -> LinkBudget:
    """Levels (snap, target + 1, family, term) in the band that add up exactly, and the loudest path of each family.

    Each loss is the ratio of two sums of the powers of the paths, with one factor more in the second. Received is what
    they make together, with the phases of coherent paths, and scattering what is left: a target strength with what
    phases add or cancel. So received = source - loss_out + scattering - loss_in - absorption - boundary whatever the
    paths. NaN where a family has no path, or nothing comes through. snap_level (snap,) in dB re 1 uPa at 1 m, peak;
    error: bound (dB) on each level from the approximations of the chain.
    """
    shape = (len(snap_level), targets + 1, len(FAMILIES))
    own = arrivals.snap, arrivals.target, family(arrivals), powers.steps, arrivals.coherent
    cell, paths, sums, apart, best = budget_sums(*own, shape)
    size = len(paths)
    total = apart + np.bincount(cell[powers.whole], powers.whole_power, size)
    source = np.repeat(np.asarray(snap_level, float), shape[1] * shape[2])
    direct = np.arange(size) // len(FAMILIES) % (targets + 1) == targets
    with np.errstate(divide="ignore", invalid="ignore"):
        out, back, absorption, boundary = -np.diff(10.0 * np.log10(sums), axis=0)
        received = source + 10.0 * np.log10(total)
        scattering = received - source + (out + back + absorption + boundary)
        out = np.where(direct, out - scattering, out)  # nothing scatters: several ways are a smaller loss
    scattering = np.where(direct, 0.0, scattering)
    levels = np.stack([source, out, scattering, back, absorption, boundary, received], axis=-1) + 0.0
    levels[~((sums[-1] > 0.0) & (total > 0.0))] = np.nan
    met = np.flatnonzero(best >= 0)
    power, sends = powers.steps[-1, best[met]], band.energy.sum(axis=1) > 0.0
    met = met[(power > QUIET * arrivals.amplitude[best[met]] ** 2) & sends[arrivals.snap[best[met]]]]
    isolated = arrivals.select(best[met])
    alone_level = np.full(size, np.nan)
    alone_level[met] = source[met] + 10.0 * np.log10(exact_powers(isolated, band))
    return LinkBudget(
        level=levels.reshape(*shape, len(LINK_BUDGET)),
        paths=paths.reshape(shape),
        error_bound=np.where(paths > 0, error, np.nan).reshape(shape),
        isolated_level=alone_level.reshape(shape),
        isolated=isolated,
    )


def exact_powers(paths: Arrivals, band: Band) -> Floats:
    """Power (path,) over that of the snap at 1 m in the band, from the columns of each: for few paths."""
    if not len(paths.delay):
        return np.zeros(0)
    longest = float(np.ptp(paths.corner_delays, axis=1).max())
    fine = band.sliced(min(max(64.0, 4.0 * (band.high - band.low) * longest), SLICES))
    f = fine.frequency
    amplitude = paths.spreading_out * paths.scattering * paths.spreading_in * paths.boundary
    facet = facet_response(
        f, paths.coherent, paths.corner_delays, paths.coherent_fraction, paths.height_delay_std, paths.centre
    )
    lost = 10.0 ** (-np.outer(paths.absorption, 1.0 + fine.relative) / 10.0)
    delay_std = np.exp(-((2.0 * np.pi * np.outer(paths.delay_std, f)) ** 2))
    return np.asarray(amplitude**2 * (np.abs(facet) ** 2 * lost * delay_std * fine.weight[paths.snap]).sum(axis=1))
