"""Steering the stored signals: what the array hears in the direction of a hit, a far hit and a miss."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import ASSUMED_SPEED, Floats, direction
from sonarsynth.equations.arrays.apertures import focus_delay, live_gain
from sonarsynth.equations.arrays.gates import gate_taper
from sonarsynth.evaluation import beam_widths
from sonarsynth.pictures.figures.sheet import Beam
from sonarsynth.pictures.store_reading import StoredFrame, beam_grid, needed, read

if TYPE_CHECKING:
    import xarray as xr

CLEAR = 1.5
"""A miss is at least this many beam widths off every target."""

EXTREME = 0.1
"""The nearest and the farthest tenth of a target are "near" and "far"."""


def beams(tree: xr.DataTree, frame: StoredFrame) -> list[Beam]:
    """A close hit, a far hit and a close miss on the far side; none without signals, a source to count time from or a
    target in view."""
    pressure = read(tree, "signals/pressure", frame.index)
    start = read(tree, "signals/start", frame.index)
    if (
        not len(frame.snap)
        or pressure is None
        or start is None
        or not np.isfinite(start)
        or not np.isfinite(pressure).any()
    ):
        return []
    azimuth, elevation = beam_grid(tree)
    chosen = choose(frame, azimuth, elevation, np.rad2deg(beam_widths(tree)))
    if not chosen:
        return []
    cells = np.array(list(chosen.values()))
    along = direction(np.deg2rad(azimuth[cells[:, 1]]), np.deg2rad(elevation[cells[:, 0]]))
    clock = direct_arrival(tree, frame)
    time, pressures = steer(tree, frame, pressure.astype(float), float(start), along)
    return [
        Beam(
            name=name,
            azimuth=float(azimuth[column]),
            elevation=float(elevation[row]),
            time=time - clock,
            pressure=pressures[i],
            expected=_expected(tree, frame, along[i] * frame.true_range[row, column]),
            measured=_measured(frame, azimuth[column], elevation[row], _step(azimuth)),
        )
        for i, (name, (row, column)) in enumerate(chosen.items())
    ]


def choose(frame: StoredFrame, azimuth: Floats, elevation: Floats, width: Floats) -> dict[str, tuple[int, int]]:
    """Beams (row, column) by name; width (2,) in deg: of a beam, along azimuth and elevation.

    Empty where no beam points at a target.

    Near and far are the brightest beams of the nearest and the farthest tenth of the true ranges; the miss is the beam
    next to the far hit that is `CLEAR` beam widths off every target.
    """
    on = (frame.target >= 0) & np.isfinite(frame.true_range)
    if not on.any():
        return {}
    bright = np.zeros(on.shape) if frame.energy is None else np.nan_to_num(frame.energy)
    near, far = np.quantile(frame.true_range[on], [EXTREME, 1.0 - EXTREME])
    hit = _brightest(bright, on & (frame.true_range <= near))
    far_hit = _brightest(bright, on & (frame.true_range >= far))
    step = (_step(elevation), _step(azimuth))
    row, column = np.indices(on.shape)
    off = ~on
    for r, c in zip(*np.nonzero(on & ~_surrounded(on)), strict=True):
        off &= np.hypot((row - r) * step[0] / width[1], (column - c) * step[1] / width[0]) >= CLEAR
    chosen = {"close hit": hit, "far hit": far_hit}
    if off.any():
        distance = np.hypot((row - far_hit[0]) * step[0], (column - far_hit[1]) * step[1])
        towards_hit = (row - far_hit[0]) * (hit[0] - far_hit[0]) + (column - far_hit[1]) * (hit[1] - far_hit[1]) > 0
        distance = np.where(off, distance + 1e3 * towards_hit, np.inf)
        miss = np.unravel_index(np.argmin(distance), on.shape)
        chosen["far miss"] = (int(miss[0]), int(miss[1]))
    return chosen


def _surrounded(on: np.ndarray) -> np.ndarray:
    """Beams (elevation, azimuth) whose four neighbours are all on a target."""
    wide = np.pad(on, 1)
    return np.asarray(wide[:-2, 1:-1] & wide[2:, 1:-1] & wide[1:-1, :-2] & wide[1:-1, 2:])


def _brightest(energy: Floats, among: np.ndarray) -> tuple[int, int]:
    row, column = np.unravel_index(np.argmax(np.where(among, energy, -1.0)), energy.shape)
    return int(row), int(column)


def _step(centres: Floats) -> float:
    return float(centres[1] - centres[0]) if len(centres) > 1 else 1.0


def direct_arrival(tree: xr.DataTree, frame: StoredFrame) -> float:
    """When the snap was heard at the array centre (s): as located; without source estimates as it truly was."""
    times = read(tree, "source_estimates/time", frame.index)
    if times is not None and np.isfinite(times).any():
        return float(times[np.isfinite(times)][0])
    snap_time = needed(tree, "truth/emissions/time", frame.index)
    return float(snap_time[0] + np.linalg.norm(frame.snap[0]) / assumed_speed(tree, frame.index))


def assumed_speed(tree: xr.DataTree, frame: int) -> float:
    """Speed of sound (m/s) that the sonar assumes in a frame: a coordinate where that varies."""
    varied = [
        c for c in tree.to_dataset().coords.values() if ASSUMED_SPEED in str(c.attrs.get("long_name")).split(", ")
    ]
    return float(varied[0][frame]) if varied else float(tree.attrs["assumed_sound_speed"])


def _measured(frame: StoredFrame, azimuth: float, elevation: float, step: float) -> float:
    """Delay (s) of the point nearest to a direction (deg), NaN where there is none within half a step of the grid."""
    apart = np.abs(frame.point_direction - [azimuth, elevation]).max(axis=1)
    near = int(np.argmin(apart)) if len(apart) else 0
    return float(frame.point_delay[near]) if len(apart) and apart[near] <= 0.51 * step else float("nan")


def _expected(tree: xr.DataTree, frame: StoredFrame, point: Floats) -> float:
    """Delay (s) of the echo from a true point (xyz) after the direct arrival, at the sonar's assumed sound speed."""
    if not np.isfinite(point).all() or not len(frame.snap):
        return float("nan")
    snap = frame.snap[0]
    path = np.linalg.norm(snap - point) + np.linalg.norm(point) - np.linalg.norm(snap)
    return float(path / assumed_speed(tree, frame.index))


def steer(
    tree: xr.DataTree, frame: StoredFrame, pressure: Floats, start: float, along: Floats
) -> tuple[Floats, Floats]:
    """Time (sample,) in s and pressure (beam, sample) in Pa of beams in the echo window, in the sonar's band.

    pressure (sensor, sample) from `start` (s); along (beam, xyz). Focused on the middle of the target.
    """
    rate = float(needed(tree, "signals/sampling_frequency"))
    band = (float(tree.attrs["band_low"]), float(tree.attrs["band_high"]))
    first, count = _echo_window(tree, frame, pressure.shape[1], rate, start)
    weight, position = live_gain(needed(tree, "signals/gain")), needed(tree, "signals/position")
    live = weight > 0.0
    frequency = np.fft.rfftfreq(count, 1.0 / rate)
    inside = (frequency >= band[0]) & (frequency <= band[1])
    gate = pressure[live, first : first + count] * gate_taper(count, rate)
    spectra = np.fft.rfft(gate, axis=1)[:, inside] * weight[live, None]
    focus = float(np.median(frame.true_range[frame.target >= 0]))
    steered = np.zeros((len(along), len(frequency)), complex)
    for beam, delay in zip(
        steered, focus_delay(position[live], along, focus, assumed_speed(tree, frame.index)), strict=True
    ):
        beam[inside] = np.sum(spectra * np.exp(2j * np.pi * delay[:, None] * frequency[inside]), axis=0)
    return start + (first + np.arange(count)) / rate, np.fft.irfft(steered, count, axis=1)


def _echo_window(tree: xr.DataTree, frame: StoredFrame, samples: int, rate: float, start: float) -> tuple[int, int]:
    """First sample and number of samples of the echo window; without an image, what follows the direct arrival."""
    begin, end = read(tree, "image/start", frame.index), read(tree, "image/stop", frame.index)
    if begin is None or end is None or not np.isfinite(begin) or not np.isfinite(end):
        begin, end = np.asarray(direct_arrival(tree, frame) + 0.5e-3), np.asarray(start + samples / rate)
    first = min(max(0, int(np.ceil((float(begin) - start) * rate))), samples - 2)
    return first, max(2, min(samples, int(np.ceil((float(end) - start) * rate))) - first)
