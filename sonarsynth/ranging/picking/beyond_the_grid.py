"""Echoes from beyond the beam grid, which a lattice hears in the grid by its grating lobes."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats, Ints, azimuth_elevation
from sonarsynth.ranging.picking.peak_kernels import farthest, loudest_lines
from sonarsynth.ranging.range_profiles import BEAMS_AT_ONCE, Profiles
from sonarsynth.ranging.received_window import ReceivedWindow

LINE = 2e3
"""Hz: width over which spectra are summed to find the line that a lobe makes of an echo."""
FAINT = 0.25
"""A line is followed only from this share of the power on that lobes must bring a peak to count: in `reef.yaml` lines
that did count had twice this share and more."""


def louder_beyond(
    window: ReceivedWindow, profiles: Profiles, b: Ints, t: Ints, height: Floats, counts: Floats
) -> tuple[Floats, Ints, Floats]:
    """Directions (echo, xyz), steps of delay and heights of echoes beyond the grid that are louder than peaks in it (b:
    beam, t: delay, height), where these may be grating lobes of them; counts (peak,): power that lobes must bring a
    peak to count.

    A lobe brings of an echo a line: that of the frequency at which all sensors of the lattice are in step. Where it is
    is seen in the spectrum of the peak's own beam, and with it whence the echo comes: directions whose components along
    the lattice are whole multiples of c/(f pitch) off. A line is f over the rows or columns wide, whichever are fewer,
    at most: no lobe brings much more than that part of the spectrum does.
    """
    elements, c, f = window.elements, window.sonar.assumed_sound_speed, window.beams.snapshots.frequency
    none = np.zeros((0, 3)), np.zeros(0, int), np.zeros(0)
    if not (elements.on_lattice and len(b)):
        return none
    line, brought = _lines(profiles, f, b, t, min(elements.rows, elements.columns))
    may_count = brought > FAINT * counts
    b, t, height, line = b[may_count], t[may_count], height[may_count], line[may_count]
    most = int(2.0 * elements.pitch * f[-1] / c)
    orders = np.stack(np.meshgrid(*2 * [np.arange(-most, most + 1)]), axis=-1).reshape(-1, 2)
    along = profiles.direction[b, None, 1:] + orders * (c / (elements.pitch * line))[:, None, None]
    square = np.sum(along**2, axis=2)
    peak, order = np.nonzero((square < 1.0) & orders.any(axis=1))
    u = np.column_stack([np.sqrt(1.0 - square[peak, order]), along[peak, order]])
    azimuth, elevation = azimuth_elevation(u)
    image = window.image
    inside = (azimuth >= image.azimuth[0]) & (azimuth <= image.azimuth[-1])
    inside &= (elevation >= image.elevation[0]) & (elevation <= image.elevation[-1])
    peak, u = peak[~inside], u[~inside]
    if not len(peak):
        return none
    far = np.linalg.norm(u - profiles.direction[b[peak]], axis=1) * (farthest(elements.position) / c / profiles.step)
    first, last = np.maximum(np.ceil(t[peak] - far), 0.0).astype(int), (t[peak] + far).astype(int) + 1
    late, loudest = np.empty(len(u), int), np.empty(len(u))
    for block in range(0, len(u), BEAMS_AT_ONCE):
        for n, power in enumerate(profiles.filter.profiles(u[block : block + BEAMS_AT_ONCE])[1], block):
            late[n] = first[n] + power[first[n] : last[n]].argmax()
            loudest[n] = power[late[n]]
    louder = loudest > height[peak]
    return u[louder], late[louder], loudest[louder]


def _lines(profiles: Profiles, f: Floats, b: Ints, t: Ints, steps: int) -> tuple[Floats, Floats]:
    """Frequencies (peak,) at which the spectra of peaks are largest, about their delays, and the power that the part of
    the spectrum about it that is f/steps wide, or `LINE`, would bring a peak by itself."""
    spacing = f[1] - f[0] if len(f) > 1 else LINE
    width = max(int(LINE / spacing), 1)
    line, power = loudest_lines(profiles.spectra, b, profiles.step * spacing * t, width)
    bins = np.minimum(np.maximum(width, f[line] / (steps * spacing)), len(f))
    return f[line], power * (bins / profiles.filter.length) ** 2
