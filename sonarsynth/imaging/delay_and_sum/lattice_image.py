"""Energies of beams on a grid, of a lattice folded along both of its axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.arrays.beams import first_and_spacing
from sonarsynth.equations.arrays.lattices import half_coordinates, mirrored_sensors, rows_in_use
from sonarsynth.imaging.delay_and_sum.zones import Lens, Subarrays, Zone, lens, quadrant, zones_of
from sonarsynth.receiver import BeamGrid, Elements


def check_lattice(elements: Elements) -> None:
    """Raise ValueError when the elements are not on a lattice."""
    if not elements.on_lattice:
        raise ValueError(
            "beamforming kind 'focused' needs an array on a lattice; use kind 'dense' for a table of positions"
        )


@dataclass(frozen=True, eq=False)
class SteeredZone:
    """How a zone is focused and steered: what `lattice_kernel.lattice_energies` takes."""

    columns: slice  # of the image: those to port that are in the zone
    odd: tuple[bool, bool]  # whether a subarray has an odd number of rows, and of columns
    places: Ints  # (mirror, subarray, half column, half row, 4) sensors
    heights: Ints  # (subarray, half column) rows in use
    delay: Floats  # (subarray, half column, half row, side of y) s
    rise: Floats  # (row, subarray, side of y, half column) s
    across: Floats  # (subarray, row, column) s
    middle: Floats  # (subarray, row, column) s


def steered(zone: Zone, elements: Elements, beams: BeamGrid, glass: Lens) -> SteeredZone:
    """The delays and the steps of a zone on a lattice."""
    middle_column = beams.azimuths // 2
    columns = slice(middle_column + zone.columns.start, middle_column + zone.columns.stop)
    half = 0.5 * elements.pitch
    y, z = (half_coordinates(count, elements.pitch) for count in (glass.subarray_columns, glass.subarray_rows))
    odd = glass.subarray_rows % 2 == 1, glass.subarray_columns % 2 == 1
    places, heights = _fold(elements, glass)
    middle_z, middle_y = (m.ravel()[:, None, None] for m in np.meshgrid(*_middles(glass), indexing="ij"))
    delay = np.stack([glass.even_bulge(middle_y + b * y[:, None], middle_z, z, zone.centre) for b in (1, -1)], -1)
    u = quadrant(beams)[:, zone.columns]
    level = np.stack(np.broadcast_arrays(zone.centre[0], u[:, 0, 1]), axis=-1)[:, None, None, None, :]
    rise = level[..., 1] / glass.sound_speed - glass.slope_along_z(middle_y + np.stack([y, -y]), middle_z, level)
    across = u[..., 0] / glass.sound_speed - glass.slope_along_y(middle_y, middle_z, u, zone.centre)
    middle = glass.bulge(middle_y, middle_z, u) - glass.bulge(middle_y, middle_z, zone.centre)
    middle -= (u[..., 0] * middle_y + u[..., 1] * middle_z) / glass.sound_speed
    return SteeredZone(columns, odd, places, heights, delay, half * rise, half * across, middle)


def _middles(glass: Lens) -> tuple[Floats, Floats]:
    """z (subarray,) and y (subarray,) in m of the middles of subarrays, in the order of rows and of columns."""
    z = 0.5 * glass.pitch * (glass.rows - glass.subarray_rows * (1 + 2 * np.arange(glass.up)))
    y = 0.5 * glass.pitch * (glass.columns - glass.subarray_columns * (1 + 2 * np.arange(glass.across)))
    return np.asarray(z), np.asarray(y)


def _fold(elements: Elements, glass: Lens) -> tuple[Ints, Ints]:
    """Live elements of each subarray, of the array and of its mirror images, as `SteeredZone` has them, `count` for
    none; and rows in use. Mirrored in y: 1, in z: 2, in both: 3."""
    live, nobody = np.flatnonzero(elements.gain), elements.count
    rows, columns = glass.subarray_rows, glass.subarray_columns
    places = []
    for mirror in range(4):
        row = elements.rows - 1 - elements.row if mirror & 2 else elements.row
        column = elements.columns - 1 - elements.column if mirror & 1 else elements.column
        part = (row // rows * glass.across + column // columns)[live]
        places.append(
            [mirrored_sensors(column % columns, row % rows, columns, rows, live[part == p], nobody)
             for p in range(glass.across * glass.up)]
        )  # fmt: skip
    return np.asarray(places), rows_in_use(np.min(places, axis=(0, 4)) < nobody)


@lru_cache(maxsize=16)
def steered_zones(
    elements: Elements, beams: BeamGrid, focus: float | None, sound_speed: float, subarrays: Subarrays
) -> tuple[SteeredZone, ...]:
    """The zones of a beam grid for an array cut into subarrays, ready for `lattice_image`; kept from frame to
    frame. Focus in m, None for plane waves.

    Raises ValueError when the elements are not on a lattice.
    """
    check_lattice(elements)
    glass = lens(elements, focus, sound_speed, subarrays)
    return tuple(steered(zone, elements, beams, glass) for zone in zones_of(beams))


def lattice_image(
    spectra: np.ndarray, elements: Elements, weight: Floats, frequencies: Floats, beams: BeamGrid,
    zones: Sequence[SteeredZone],
) -> Floats:  # fmt: skip
    """Sum over bins of |B|^2 of beams on a grid: (elevation, azimuth), in the unit of spectra (sensor, bin) squared.

    weight (sensor,); frequencies (bin,) Hz, evenly spaced.
    """
    from sonarsynth.equations.kernels.lanes import LANES
    from sonarsynth.equations.kernels.phasors import padded_bins
    from sonarsynth.imaging.delay_and_sum.lattice_kernel import lattice_energies

    padded = padded_bins(spectra, elements.count + 1, LANES)
    pairs, bins = padded.view(np.float32).ravel(), padded.shape[1]
    live = np.append(weight, 0.0).astype(np.float32)
    image = np.zeros((beams.elevations, beams.azimuths))
    for zone in zones:
        sensors, steps = (zone.places, live, zone.delay, zone.heights, *zone.odd), (zone.rise, zone.across, zone.middle)
        energy = np.asarray(lattice_energies(pairs, bins, *sensors, *steps, *first_and_spacing(frequencies)))
        for mirror, seen in enumerate((image, image[:, ::-1], image[::-1], image[::-1, ::-1])):
            seen[beams.elevations // 2 :, zone.columns] += energy[mirror]
    # beams on an axis are their own mirror images: the mean of both, so that images of what is mirrored are
    if beams.elevations % 2:
        image[beams.elevations // 2] *= 0.5
    if beams.azimuths % 2:
        image[:, beams.azimuths // 2] *= 0.5
    return image
