"""Echoes from beyond the beam grid, which a lattice hears in the grid by its grating lobes."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats, Ints, azimuth_elevation
from sonarsynth.ranging.picking.peak_kernels import farthest, loudest_between, loudest_lines
from sonarsynth.ranging.range_profiles import Profiles
from sonarsynth.ranging.received_window import ReceivedWindow

LINE = 2e3
"""Hz: width over which spectra are summed to find the line that a lobe makes of an echo."""
FAINT = 0.25
"""A line is followed only from this share of the power on that lobes must bring a peak to count: in `reef.yaml` lines
that did count had twice this share and more."""

FARTHEST = 12
"""Orders of grating lobes that are looked along at most: all those of hydrophones 6 wavelengths apart."""
AT_ONCE = 2048
"""Directions whose profiles are held at once."""


def possible_grating_lobes(
    window: ReceivedWindow, profiles: Profiles, b: Ints, t: Ints, counts: Floats
) -> tuple[Ints, Floats]:
    """Which peaks (b: beam, t: delay) may be grating lobes of echoes beyond the grid, and the frequencies of the lines
    that they are; counts (peak,): power that lobes must bring a peak to count.

    A lobe brings of an echo a line: that of the frequency at which all sensors of the lattice are in step. Where it is
    is seen in the spectrum of the peak's own beam. A line is f over the rows or columns wide, whichever are fewer, at
    most: no lobe brings much more than that part of the spectrum does.
    """
    elements, f = window.elements, window.beams.snapshots.frequency
    if not (elements.on_lattice and len(b) and _orders(window, profiles)):
        return np.zeros(0, int), np.zeros(0)
    spacing = f[1] - f[0] if len(f) > 1 else LINE
    width = max(int(LINE / spacing), 1)
    line, power = loudest_lines(profiles.spectra, b, profiles.step * spacing * t, width)
    bins = np.minimum(np.maximum(width, f[line] / (min(elements.rows, elements.columns) * spacing)), len(f))
    brought = power * (bins / profiles.filter.length) ** 2
    may_count = np.flatnonzero(brought > FAINT * counts)
    return may_count, f[line[may_count]]


def _orders(window: ReceivedWindow, profiles: Profiles) -> int:
    """Up to which order grating lobes of echoes from anywhere are in the beams, `FARTHEST` at most."""
    farthest_lobe = 1.0 + np.abs(profiles.direction[:, 1:]).max()
    shortest = window.sonar.assumed_sound_speed / window.beams.snapshots.frequency[-1]
    return min(int(farthest_lobe * window.elements.pitch / shortest), FARTHEST)


def louder_beyond(
    window: ReceivedWindow, profiles: Profiles, b: Ints, t: Ints, height: Floats, line: Floats
) -> tuple[Floats, Floats, Floats]:
    """Directions (echo, xyz), delays (s) and heights of echoes beyond the grid that are louder than peaks in it (b:
    beam, t: delay, height), where these are grating lobes of them at the frequencies line (peak,): from directions
    whose components along the lattice are whole multiples of c/(f pitch) off."""
    elements, c, image = window.elements, window.sonar.assumed_sound_speed, window.image
    most = _orders(window, profiles)
    orders = np.mgrid[-most : most + 1, -most : most + 1].reshape(2, -1).T
    along = profiles.direction[b, None, 1:] + orders * (c / (elements.pitch * line))[:, None, None]
    square = np.sum(along**2, axis=2)
    peak, order = np.nonzero((square < 1.0) & orders.any(axis=1))
    u = np.column_stack([np.sqrt(1.0 - square[peak, order]), along[peak, order]])
    azimuth, elevation = azimuth_elevation(u)
    inside = (azimuth >= image.azimuth[0]) & (azimuth <= image.azimuth[-1])
    inside &= (elevation >= image.elevation[0]) & (elevation <= image.elevation[-1])
    peak, u = peak[~inside], u[~inside]
    far = np.linalg.norm(u - profiles.direction[b[peak]], axis=1) * (farthest(elements.position) / c / profiles.step)
    first, last = np.maximum(np.ceil(t[peak] - far), 0.0).astype(int), (t[peak] + far).astype(int) + 1
    late, loudest = np.zeros((2, len(u)))
    for low in range(0, len(u), AT_ONCE):
        some = slice(low, low + AT_ONCE)
        late[some], loudest[some] = loudest_between(profiles.filter.profiles(u[some])[1], first[some], last[some])
    louder = loudest > height[peak]
    return u[louder], profiles.step * late[louder], loudest[louder]
