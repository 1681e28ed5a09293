"""Power of beams against range, in cells of a grid of ranges and azimuths: the image of a sonar that pings."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats, direction
from sonarsynth.geometry.motion import Track
from sonarsynth.ranging.range_profiles import echo_filter
from sonarsynth.ranging.received_window import ReceivedWindow


def range_image(received: ReceivedWindow, ranges: Floats, track: Track | None) -> npt.NDArray[np.float32]:
    """The largest power (range, azimuth) of the beams of an azimuth, all its elevations, in the cells about ranges
    (range,) in m, evenly spaced.

    Each beam is matched to the direct pulse, as for the cloud, and 1 is an echo as strong as that. A range r in the
    direction u of a beam is heard so late after the direct pulse:

        t = (r + |r u - s(t)| - |s|)/c

    s: the first located snap, in the frame of a sonar that goes on along its track until it hears the echo. NaN beyond
    the echo window, and where no snap was located, or nothing of it is recorded.
    """
    image, found, drift = received.image, received.estimates, np.zeros(3)
    cells = np.full((len(ranges), len(image.azimuth)), np.nan, np.float32)
    if not received.located:
        return cells
    echoes, window = echo_filter(received), received.beams.snapshots
    first = window.start - float(found.time[0])
    if track is not None and not track.still:
        between = 0.5 * (float(found.time[0]) + window.start + 0.5 * window.duration)
        velocity, spin = track.later(between).in_own_frame
        drift = -(velocity + np.cross(spin, found.position[0]))
    for elevation in image.elevation:
        beams = direction(image.azimuth, np.full(len(image.azimuth), elevation))
        power = echoes.profiles(beams)[1]
        speed = received.sonar.assumed_sound_speed
        _largest(power, first, echoes.step, ranges, beams, found.position[0], drift, speed, cells)
    return cells / np.float32(echoes.unity) if echoes.unity > 0.0 else np.full_like(cells, np.nan)


@compiled
def _edges(
    ranges: Any, beam: Any, source: Any, drift: Any, speed: float, first: float, step: float, edges: Any
) -> None:
    """When echoes from ranges (range,) in the direction of a beam are heard, into edges (range,): in steps after the
    first delay."""
    x, y, z = source
    away = np.sqrt(x * x + y * y + z * z)
    for k in range(len(ranges)):
        r, late = ranges[k], 0.0
        for _ in range(3):  # the sonar makes way at a hundredth of the speed of sound, or less
            a = r * beam[0] - x - late * drift[0]
            b = r * beam[1] - y - late * drift[1]
            c = r * beam[2] - z - late * drift[2]
            late = (r + np.sqrt(a * a + b * b + c * c) - away) / speed
        edges[k] = (late - first) / step


@compiled
def _largest(
    power: Any, first: float, step: float, ranges: Any, beams: Any, source: Any, drift: Any, speed: float, cells: Any
) -> None:
    """Raise cells (range, azimuth) to the largest of the powers (azimuth, delay) of beams (azimuth, xyz) in each, by
    lines between delays: at its ends, and at all delays in it. Cells with their middle beyond all delays have none."""
    half = 0.5 * (ranges[1] - ranges[0]) if len(ranges) > 1 else 0.0
    last, edges = power.shape[1] - 1, np.empty(len(ranges) + 1)
    bounds = np.append(ranges - half, ranges[-1] + half)
    for a in range(len(beams)):
        _edges(bounds, beams[a], source, drift, speed, first, step, edges)
        for k in range(len(ranges)):
            begin, end = edges[k], edges[k + 1]
            if not (last > 0 and 0.0 <= 0.5 * (begin + end) < last):
                continue
            loudest = max(_between(power[a], begin), _between(power[a], end))
            for m in range(max(int(np.ceil(begin)), 0), min(int(np.floor(end)), last) + 1):
                loudest = max(loudest, power[a, m])
            if not cells[k, a] >= loudest:
                cells[k, a] = loudest


@compiled
def _between(power: Any, place: float) -> Any:
    """Power at a place among delays (delay,), by a line between two of them; beyond them, at the next."""
    place = min(max(place, 0.0), len(power) - 1.0)
    n = min(int(place), len(power) - 2)
    return power[n] + np.float32(place - n) * (power[n + 1] - power[n])
