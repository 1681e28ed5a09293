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
    """The largest power (range, azimuth) of the beams of an azimuth, all its elevations, at each range (range,) in m.

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
def _largest(
    power: Any, first: float, step: float, ranges: Any, beams: Any, source: Any, drift: Any, speed: float, cells: Any
) -> None:
    """Raise cells (range, azimuth) to the powers (azimuth, delay) of beams (azimuth, xyz), between delays by lines."""
    away = np.sqrt(source[0] ** 2 + source[1] ** 2 + source[2] ** 2)
    for a in range(len(beams)):
        for k in range(len(ranges)):
            r, late = ranges[k], 0.0
            for _ in range(3):  # the sonar makes way at a thousandth of the speed of sound, or less
                square = 0.0
                for x in range(3):
                    square += (r * beams[a, x] - source[x] - late * drift[x]) ** 2
                late = (r + np.sqrt(square) - away) / speed
            place = (late - first) / step
            n = int(np.floor(place))
            if n < 0 or n + 1 >= power.shape[1]:
                continue
            between = power[a, n] + (place - n) * (power[a, n + 1] - power[a, n])
            if not cells[k, a] >= between:
                cells[k, a] = between
