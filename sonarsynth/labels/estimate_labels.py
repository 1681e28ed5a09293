"""Which true snap each estimate came from: a label, found from the paths of the frame. Locating knows nothing of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sonarsynth.conventions import NO_TARGET, Bools, Floats, Ints, azimuth_elevation
from sonarsynth.conventions import direction as towards
from sonarsynth.products import Arrivals, SourceEstimates

SIGMAS = 4.0
"""Standard errors within which an estimate may miss its snap."""
PULSES = 1.0
"""The same in units of 1/bandwidth: arrivals nearer in time are one to the array."""
BEAMS = 0.25
"""The same in half-power beam widths at the centre of the band."""


@dataclass(frozen=True, eq=False)
class Direct:
    """Direct paths of snaps, that met neither surface nor bottom nor target, as the array centre hears them."""

    snap: Ints  # (path,)
    time: Floats  # (path,) s: of the peak of the pulse's envelope in the band
    direction: Floats  # (path, xyz) unit vector towards where it comes from, sonar frame


def direct_paths(arrivals: Arrivals, envelope: Callable[[int, float, float], float]) -> Direct:
    """The direct paths of a frame.

    envelope: of the index of a snap, the absorption on its way (dB at the centre of the band) and its Doppler: when the
    envelope of its pulse peaks in the band, s after its collapse.
    """
    rows = np.flatnonzero(arrivals.direct & (arrivals.surface == 0) & (arrivals.bottom == 0))
    rows = rows[(arrivals.occluded[rows, :1] < 128).all(axis=1)]  # that reach the centre of the array
    rows = rows[np.lexsort((arrivals.delay[rows], arrivals.snap[rows]))]
    snap = arrivals.snap[rows]
    heard = zip(snap.tolist(), arrivals.absorption[rows].tolist(), arrivals.doppler[rows].tolist(), strict=True)
    late = [envelope(*path) for path in heard]
    return Direct(snap, arrivals.delay[rows] + np.array(late), arrivals.direction[rows])


def heard_first(direct: Direct, snaps: int) -> tuple[Floats, Floats, Floats]:
    """Arrival (s), azimuth and elevation (rad) of the first direct path of each snap (snap,); NaN without one."""
    time, azimuth, elevation = np.full((3, snaps), np.nan)
    snap, first = np.unique(direct.snap, return_index=True)  # sorted by time
    time[snap] = direct.time[first]
    azimuth[snap], elevation[snap] = azimuth_elevation(direct.direction[first])
    return time, azimuth, elevation


def emissions(estimates: SourceEstimates, direct: Direct, bandwidth: float, beam: float) -> Ints:
    """Index of the snap that each estimate (row,) came from, by time and direction; -1 for none.

    An estimate comes from the nearest direct path within its predicted errors and what the array resolves in time
    (1/`bandwidth`, Hz) and direction (`beam`, rad: half-power beam width). Nearest: by both, in those units. An image
    in surface or bottom, or an echo, is no snap.
    """
    emission = np.full(len(estimates.time), NO_TARGET)
    if not len(direct.snap):
        return emission
    with np.errstate(invalid="ignore"):
        pointing = towards(estimates.azimuth, estimates.elevation)
        late = np.abs(estimates.time[:, None] - direct.time)
        aside = np.linalg.norm(pointing[:, None] - direct.direction, axis=2)
        turned = np.hypot(estimates.azimuth_error * np.cos(estimates.elevation), estimates.elevation_error)
        far = np.hypot(
            late / (SIGMAS * estimates.time_error + PULSES / bandwidth)[:, None],
            aside / (SIGMAS * turned + BEAMS * beam)[:, None],
        )
    far = np.where(np.isfinite(far), far, np.inf)
    nearest = far.argmin(axis=1)
    near: Bools = far[np.arange(len(emission)), nearest] <= 1.0
    emission[near] = direct.snap[nearest[near]]
    return emission
