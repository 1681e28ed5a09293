"""What a focused lattice gets wrong, and how many parts a tolerance needs: its error model.

The error is that of one beam, for sources at the focus with a flat spectrum over the band: its energy with the delays
that the zones leave out, against that with the delays of a sphere. The beams tried are those at the corners of the
zones where most is left out; the sources are those that such a beam hears: in its main lobe, its first side lobes, and
where the lattice has ghosts.

An estimate, no bound: of its numbers (`MARGIN`, where sources are, how many beams) some were chosen on the 508-element
disc and a rectangle of 20 by 8. On 160 cases that nothing was chosen on (five other arrays, 2 to 14 zones, 4 to 40 m,
151 with an error above 0.002 dB) it was 1.9 times the error of whole images at the median, but under 0.9 of it in 14,
and 0.16 of it at worst: 13 of them with 11 or 14 zones.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.arrays.apertures import focus_delay
from sonarsynth.imaging.delay_and_sum.zones import Lens, Zone, corners, for_sensors, lens, quadrant, zones_of
from sonarsynth.imaging.image_window import Shading, weights
from sonarsynth.receiver import Band, BeamGrid, Elements, Sonar

PARTS = (0, 1, 2, 3, 4, 6, 8, 12, 16)
"""Numbers of parts along each axis of an array that are tried; 0: the delay of the axis in all directions."""

MARGIN = 1.1
"""The worst source lies between those that are tried."""

BINS = 64
BEAMS = 16
"""Beams that are tried."""

RAYS, REACH = 12, 0.15 * np.arange(1, 19)
"""Sources around a beam: in so many directions, how far in wavelengths (middle of the band) over the array's width."""

GHOSTS, BESIDE = 24, 0.3 * np.arange(-4, 5)
"""Sources along each ridge of ghosts, which move with frequency, and beside it (in the same measure)."""


def focus_error(
    elements: Elements,
    weight: Floats,
    beams: BeamGrid,
    sound_speed: float,
    focus: float | None,
    band: Band,
    parts: int,
    within: float = 20.0,
) -> float:
    """Estimate of the largest error (dB) of the image of a source at the focus, over beams `within` dB of its peak.

    weight (sensor,), of sum one; focus in m, None for plane waves (no error); `parts` as for `FocusedDelayAndSum`.
    within 0: the energy that is lost in the beam of the source itself.
    """
    if focus is None:
        return 0.0
    glass, moments = lens(elements, focus, sound_speed, parts), for_sensors(elements, weight, band)
    cut = zones_of(glass, moments, beams, parts)
    u = quadrant(beams)

    def left_out(zone: Zone, at: tuple[int, int]) -> float:
        if within == 0.0:
            even, odd = zone.variances(glass, moments, u[at][None])
            return float(even[0] + odd[0])
        return zone.estimate(glass, moments, u[at][None])

    tried = [(zone, at, left_out(zone, at)) for zone in cut for at in corners(zone)]
    tried.sort(key=lambda row: -row[2])
    live = weight > 0
    largest = 0.0
    for which, (zone, at, _) in enumerate(tried[:BEAMS]):
        # The array may be lopsided: each beam in another quadrant than the one before.
        mirror = np.array([1.0 - 2.0 * (which % 2), 1.0 - 2.0 * (which // 2 % 2)])
        array = elements.position[live][:, 1:] * mirror
        error = _beam_error(
            array, weight[live], elements.pitch, glass, zone, u[at], view=_view(beams), band=band, within=within
        )
        largest = max(largest, error)
    return largest


def _view(beams: BeamGrid) -> Floats:
    """Largest (yz) of the direction of a beam."""
    return np.array([np.sin(0.5 * beams.azimuth_span), np.sin(0.5 * beams.elevation_span)])


def _beam_error(
    array: Floats, weight: Floats, pitch: float, glass: Lens, zone: Zone, u: Floats, *, view: Floats, band: Band,
    within: float,
) -> float:  # fmt: skip
    """Largest error (dB) of the beam of direction u (yz) for sources that it hears; array (sensor, yz) m."""
    from sonarsynth.equations.kernels.phasors import steered_sums

    frequencies = np.linspace(band.low, band.high, BINS)
    sources = np.concatenate([u[None], _around(u, np.ptp(array, axis=0) + pitch, pitch, glass, view, band)])
    if within == 0.0:
        sources = sources[:1]
    position = np.column_stack([np.zeros(len(array)), array])
    delay = focus_delay(position, _unit(np.concatenate([u[None], sources])), glass.focus, glass.sound_speed)
    left_out = zone.left_out(glass, array[:, 0], array[:, 1], u[None])[0]
    spacing = frequencies[1] - frequencies[0]
    levels = []
    for steering in (delay[0], delay[0] - left_out):
        spectra = np.exp(2j * np.pi * frequencies * steering[:, None]).astype(np.complex64)
        sums = steered_sums(spectra, -delay[1:], weight, frequencies[0], spacing)
        levels.append(10.0 * np.log10(np.mean(np.square(np.abs(sums).astype(float)), axis=1)))
    exact, approximate = levels
    if within == 0.0:
        return float(abs(approximate[0] - exact[0]))
    return MARGIN * float(np.max(np.abs(approximate - exact)[exact >= -within]))


def _around(u: Floats, size: Floats, pitch: float, glass: Lens, view: Floats, band: Band) -> Floats:
    """Directions (source, yz) in view whose sources a beam of direction u (yz) hears."""
    wavelength = glass.sound_speed / band.centre
    angle = 2.0 * np.pi * np.arange(RAYS) / RAYS
    rays = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    lobes = (REACH[:, None, None] * rays).reshape(-1, 2) * (wavelength / size)
    ridge = glass.sound_speed / (pitch * np.linspace(band.low, band.high, GHOSTS))
    beside = BESIDE * wavelength
    along_y = np.stack(np.meshgrid(np.append(ridge, -ridge), beside / size[1], indexing="ij"), axis=-1)
    along_z = np.stack(np.meshgrid(beside / size[0], np.append(ridge, -ridge), indexing="ij"), axis=-1)
    ghosts = np.concatenate([along_y.reshape(-1, 2), along_z.reshape(-1, 2)])
    ghosts = u + ghosts
    # A source just outside the picture stands for one at its edge, heard by a beam inside: there less is left out.
    return np.concatenate([u + lobes, ghosts[np.all(np.abs(ghosts) <= view, axis=1)]])


def _unit(u: Floats) -> Floats:
    """Unit vectors (..., xyz) to the front of directions (..., yz)."""
    x = np.sqrt(np.maximum(1.0 - np.sum(u * u, axis=-1, keepdims=True), 0.0))
    return np.concatenate([x, u], axis=-1)


@lru_cache(maxsize=64)
def parts_needed(
    elements: Elements, shading: Shading, sonar: Sonar, focus: float | None, error_db: float
) -> int | None:
    """The fewest parts whose `focus_error` is not above error_db (dB), None if all are too few; kept from frame to
    frame."""
    weight, band, speed = weights(elements, shading), sonar.band, sonar.assumed_sound_speed
    tried = ((parts, focus_error(elements, weight, sonar.beams, speed, focus, band, parts)) for parts in PARTS)
    return next((parts for parts, error in tried if error <= error_db), None)
