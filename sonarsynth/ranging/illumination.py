"""Which snap lit each echo, where several are located: a body is lit by all of them, and so the places of its echoes by
one and by another agree; places by the wrong one are scattered.

Passive radar by broadcasts, whose transmitters send alike, has the same question: Shi, Park and Song (2017), EURASIP
Journal on Advances in Signal Processing 2017:11.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.products import REASONS, PointCloud, SourceEstimates

FAINT = 20.0
"""dB: sound so much fainter at the place of an echo than that of another snap at its own made none."""
AGREES, LIKELY = 0.15, 0.5
"""An echo is confirmed, or placed at least, where another's place by another snap is so near, over how far other snaps
would put it or have it agree with anything: of 120 random scenes of two snaps, all that were confirmed were right."""


def with_suspects(estimates: SourceEstimates) -> SourceEstimates:
    """The estimates, those that may be echoes as if they were snaps: their echoes, if any, come back as well."""
    suspect = estimates.reason == REASONS.index("may_be_an_echo")
    if not suspect.any():
        return estimates
    pick, none = suspect[:, None], np.zeros((len(suspect), 3))
    return replace(
        estimates,
        time=np.where(suspect, estimates.as_snap_time, estimates.time),
        time_error=np.where(suspect, 0.0, estimates.time_error),
        position=np.where(pick, estimates.as_snap_position, estimates.position),
        position_covariance=np.where(pick[..., None], estimates.as_snap_covariance, estimates.position_covariance),
        position_by_speed=np.where(pick, none, estimates.position_by_speed),
    )


def by_snap(clouds: list[PointCloud], rows: Ints, snaps: SourceEstimates, duration: tuple[float, float]) -> PointCloud:
    """Each point of one of `clouds` (snap,), which are the same echoes as lit by `rows` (snap,) of `snaps`: of that
    which other echoes confirm, or else of the first, the clock. Range errors hold where the others would place it.

    duration: first and last delay (s) after its own direct arrival at which echoes of any snap are looked for.
    """
    late = clouds[0].delay.astype(float) - (snaps.time[rows] - snaps.time[rows[0]])[:, None]
    there = np.array([np.isfinite(cloud.range_error) & (cloud.range > 0.0) for cloud in clouds])
    there[1:] &= (late[1:] >= duration[0]) & (late[1:] <= duration[1])
    places = np.array([cloud.position for cloud in clouds], float)
    source = snaps.position[rows]
    with np.errstate(divide="ignore", invalid="ignore"):
        away = np.linalg.norm(places, axis=2) * np.linalg.norm(places - source[:, None], axis=2)
        level = 20.0 * np.log10((snaps.pressure[rows] * np.linalg.norm(source, axis=1))[:, None] / away)
        there &= ~(level < np.fmax.reduce(np.where(there, level, np.nan), axis=0) - FAINT)
    snap, doubt = which_snap(np.where(there[..., None], places, np.nan))
    every = np.arange(len(snap))
    columns: dict[str, Any] = {
        name: np.array([vars(cloud)[name] for cloud in clouds])[snap, every]
        for name, value in vars(clouds[0]).items()
        if isinstance(value, np.ndarray)
    }
    columns["range_error"] = np.hypot(columns["range_error"], doubt).astype(np.float32)
    return replace(clouds[0], **columns, estimate=np.asarray(rows)[snap])


def which_snap(places: Floats) -> tuple[Ints, Floats]:
    """Which snap (echo,) each echo is of, by its places (snap, echo, xyz) in m by each, NaN of those that did not
    light it; and the error (echo,) in m for want of other echoes that confirm it: half of how far others place it."""
    there = np.isfinite(places[..., 0])
    apart = np.linalg.norm(places[:, None] - places[None], axis=3)  # (snap, snap, echo)
    nearest = np.where(np.isnan(apart) | np.eye(len(places), dtype=bool)[..., None], np.inf, apart).min(axis=1)
    agreeing = _agreeing(places, there)
    best, rest = agreeing.argmin(axis=0), np.partition(agreeing, 1, axis=0)[1]
    every = np.arange(places.shape[1])
    near, other = agreeing[best, every], np.minimum(rest, nearest[best, every])
    snap = np.where(near < LIKELY * other, best, there.argmax(axis=0))
    farthest = np.nan_to_num(apart[snap, :, every]).max(axis=1, initial=0.0)
    return snap, np.where(near < AGREES * other, 0.0, 0.5 * farthest)


def _agreeing(places: Floats, there: Bools) -> Floats:
    """How far (snap, echo) in m the nearest place of another echo by another snap is; infinite without any."""
    from scipy.spatial import cKDTree  # only where there are several snaps

    found = np.full(there.shape, np.inf)
    for snap in range(len(places)):
        own, others = np.flatnonzero(there[snap]), there.copy()
        others[snap] = False
        echo = np.nonzero(others)[1]
        if len(own) and len(echo):
            distance, index = cKDTree(places[others]).query(places[snap, own], range(1, len(places) + 1))
            same = (index == len(echo)) | (np.append(echo, -1)[index] == own[:, None])
            found[snap, own] = np.where(same, np.inf, distance).min(axis=1)
    return found
