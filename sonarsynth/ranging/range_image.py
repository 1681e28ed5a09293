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


def range_image(received: ReceivedWindow, ranges: Floats, track: Track | None = None) -> npt.NDArray[np.float32]:
    """The largest power (range, azimuth) of the beams of an azimuth, all its elevations, in the cells about ranges
    (range,) in m, evenly spaced.

    Each beam is matched to the direct pulse, as for the cloud, and 1 is an echo as strong as that. A range r in the
    direction u of a beam is heard so late after the direct pulse:

        t = (r + |r u - s(t)| - |s|)/c

    s: the first located snap, in the frame of a sonar that goes on along its track until it hears the echo. NaN beyond
    the echo window, and where no snap was located.
    """
    image, found, drift = received.image, received.estimates, np.zeros(3)
    cells = np.full((len(ranges), len(image.azimuth)), np.nan, np.float32)
    if not received.located:
        return cells
    echoes, window = echo_filter(received), received.beams.snapshots
    first = window.start - float(found.time[0])
    if track is not None and not track.still:
        velocity, spin = track.pose.turn_to_body(track.velocity), track.pose.turn_to_body(track.spin)
        drift = -(velocity + np.cross(spin, found.position[0]))
    for elevation in image.elevation:
        beams = direction(image.azimuth, np.full(len(image.azimuth), elevation))
        power = echoes.profiles(beams)[1]
        speed = received.sonar.assumed_sound_speed
        _largest(power, first, echoes.step, ranges, beams, found.position[0], drift, speed, cells)
    return cells / np.float32(echoes.unity)


@compiled
def _place(r: float, beam: Any, source: Any, drift: Any, speed: float) -> float:
    """When (s) an echo from a range in the direction of a beam is heard, after the direct pulse."""
    away, late = np.sqrt(source[0] ** 2 + source[1] ** 2 + source[2] ** 2), 0.0
    for _ in range(3):  # the sonar makes way at a hundredth of the speed of sound, or less
        square = 0.0
        for x in range(3):
            square += (r * beam[x] - source[x] - late * drift[x]) ** 2
        late = (r + np.sqrt(square) - away) / speed
    return late


@compiled
def _largest(
    power: Any, first: float, step: float, ranges: Any, beams: Any, source: Any, drift: Any, speed: float, cells: Any
) -> None:
    """Raise cells (range, azimuth) to the powers (azimuth, delay) of beams (azimuth, xyz): in the middle of a cell, by
    lines between delays, and at all delays in it."""
    half = 0.5 * (ranges[1] - ranges[0]) if len(ranges) > 1 else 0.0
    last = power.shape[1] - 1
    for a in range(len(beams)):
        end = (_place(ranges[0] - half, beams[a], source, drift, speed) - first) / step
        for k in range(len(ranges)):
            begin, end = end, (_place(ranges[k] + half, beams[a], source, drift, speed) - first) / step
            middle = 0.5 * (begin + end)
            n = int(np.floor(middle))
            if n < 0 or n + 1 > last:
                continue
            loudest = power[a, n] + (middle - n) * (power[a, n + 1] - power[a, n])
            for m in range(max(int(np.ceil(begin)), 0), min(int(np.floor(end)), last) + 1):
                loudest = max(loudest, power[a, m])
            if not cells[k, a] >= loudest:
                cells[k, a] = loudest
