"""Energies of beams on a grid, of a lattice folded along both of its axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.arrays.beams import first_and_spacing
from sonarsynth.equations.arrays.lattices import axial_focus_delay, half_coordinates, mirrored_sensors
from sonarsynth.imaging.delay_and_sum.zones import Lens, Zone, for_sensors, lens, quadrant, zones_of
from sonarsynth.imaging.image_window import Shading, weights
from sonarsynth.receiver import Band, BeamGrid, Elements


def check_lattice(elements: Elements) -> None:
    """Raise ValueError when the elements are not on a lattice."""
    if not elements.on_lattice:
        raise ValueError(
            "beamforming kind 'focused' needs an array on a lattice; use kind 'dense' for a table of positions"
        )


def fold(elements: Elements) -> tuple[Ints, Ints]:
    """Live elements as `lattices.mirrored_sensors` places them, `count` for none; and rows in use (half column,).

    Raises ValueError when the elements are not on a lattice.
    """
    check_lattice(elements)
    live, nobody = np.flatnonzero(elements.gain), elements.count
    places = mirrored_sensors(elements.column, elements.row, elements.columns, elements.rows, live, nobody)
    used = np.min(places, axis=2) < nobody
    heights = np.where(np.any(used, axis=1), places.shape[1] - np.argmax(used[:, ::-1], axis=1), 0)
    return places, heights


def focused_energies(
    spectra: np.ndarray,
    elements: Elements,
    weight: Floats,
    frequencies: Floats,
    azimuth: Floats,
    elevation: Floats,
    sound_speed: float,
    focus: float | None,
) -> Floats:
    """Sum over bins of |B|^2 of beams on a grid: (elevation, azimuth), in the unit of spectra (sensor, bin) squared.

    weight (sensor,); frequencies (bin,) Hz, evenly spaced; azimuth, elevation: rad, ascending, exactly
    antisymmetric; focus in m, None for plane waves. The delay of focusing is that of the middle of the picture,
    (sqrt(R^2 + q^2) - R)/c in every direction.
    """
    from sonarsynth.equations.kernels.lanes import LANES
    from sonarsynth.equations.kernels.phasors import padded_bins
    from sonarsynth.imaging.delay_and_sum.lattice_kernel import lattice_energies

    places, heights = fold(elements)
    padded = padded_bins(spectra, elements.count + 1, LANES)
    return np.asarray(
        lattice_energies(
            padded.view(np.float32).ravel(),
            padded.shape[1],
            places,
            np.append(weight, 0.0).astype(np.float32),
            axial_focus_delay(elements.columns, elements.rows, elements.pitch, focus, sound_speed),
            heights,
            elements.rows % 2 == 1,
            elements.columns % 2 == 1,
            0.5 * elements.pitch / sound_speed,
            *first_and_spacing(frequencies),
            azimuth,
            elevation,
        )
    )


@dataclass(frozen=True, eq=False)
class SteeredZone:
    """How a zone is focused and steered."""

    rows: Ints  # of the image, ascending: those of the zone and of its mirror image
    columns: Ints
    shared: bool  # whether it and its mirror images take the same delays
    places: Ints  # sensors as by `fold` where shared, else as by `fold_parts`
    heights: Ints  # rows in use, likewise
    delay: Floats  # s: (half column, half row) where shared, else (part, half column, half row, 4 mirrored sensors)
    rise: Floats  # (row, part, side of y, half column) s: half of what a wave is sooner at the next row up
    across: Floats  # (part, row, column) s: the same at the next column to port
    # where shared: (row,) and (column,), elevation and azimuth (rad) of a plane wave with the slopes that are kept
    middle: Floats  # (part, row, column) s: what it is later in the middle of the part; empty where shared


def steered(zone: Zone, elements: Elements, beams: BeamGrid, glass: Lens) -> SteeredZone:
    """The delays and the steps of a zone on a lattice."""
    rows, columns = _mirrored(zone.low, zone.high, beams.elevations), _mirrored(zone.near, zone.far, beams.azimuths)
    if zone.shared:
        y, z = (half_coordinates(count, elements.pitch) for count in (elements.columns, elements.rows))
        up, port = (np.arcsin(s) for s in zone.sines(glass, beams.elevation[rows], beams.azimuth[columns]))
        delay = glass.even(y[:, None], z, zone.centre)
        return SteeredZone(rows, columns, True, *fold(elements), delay, up, port, np.empty(0))
    y, z = (half_coordinates(count, elements.pitch) for count in (glass.part_columns, glass.part_rows))
    middle_z, middle_y = (m.ravel()[:, None, None] for m in np.meshgrid(*_middles(glass), indexing="ij"))
    delay = np.stack(
        [glass.bulge(middle_y + b * y[:, None], middle_z + a * z, zone.centre) for a in (1, -1) for b in (1, -1)], -1
    )
    u = quadrant(beams)[zone.low : zone.high, zone.near : zone.far]
    level = np.stack(np.broadcast_arrays(zone.centre[0], u[:, 0, 1]), axis=-1)[:, None, None, None, :]
    rise = glass.slope_along_z(middle_y + np.stack([y, -y]), middle_z, level, zone.centre)
    rise = level[..., 1] / glass.sound_speed - rise
    across = u[..., 0] / glass.sound_speed - glass.slope_along_y(middle_y, middle_z, u, zone.centre)
    middle = glass.bulge(middle_y, middle_z, u) - glass.bulge(middle_y, middle_z, zone.centre)
    middle -= (u[..., 0] * middle_y + u[..., 1] * middle_z) / glass.sound_speed
    half = 0.5 * elements.pitch
    folded = fold_parts(elements, glass.parts)
    return SteeredZone(rows, columns, False, *folded, delay, half * rise, half * across, middle)


def _middles(glass: Lens) -> tuple[Floats, Floats]:
    """z (part,) and y (part,) in m of the middles of the parts, in the order of rows and of columns."""
    part = 2 * np.arange(glass.parts)
    z = 0.5 * glass.pitch * (glass.rows - glass.part_rows * (1 + part))
    y = 0.5 * glass.pitch * (glass.columns - glass.part_columns * (1 + part))
    return np.asarray(z), np.asarray(y)


def fold_parts(elements: Elements, parts: int) -> tuple[Ints, Ints]:
    """Live elements of each part, of the array and of its mirror images: (mirror, part, half column, half row, 4) as
    `lattices.mirrored_sensors` places them; and rows in use (part, half column). Mirrored in y: 1, in z: 2, in both: 3.
    """
    live, nobody = np.flatnonzero(elements.gain), elements.count
    rows, columns = -(-elements.rows // parts), -(-elements.columns // parts)
    places = []
    for mirror in range(4):
        row = elements.rows - 1 - elements.row if mirror & 2 else elements.row
        column = elements.columns - 1 - elements.column if mirror & 1 else elements.column
        part = (row // rows * parts + column // columns)[live]
        places.append(
            [mirrored_sensors(column % columns, row % rows, columns, rows, live[part == p], nobody)
             for p in range(parts * parts)]
        )  # fmt: skip
    used = np.min(places, axis=(0, 4)) < nobody
    heights = np.where(np.any(used, axis=2), used.shape[2] - np.argmax(used[:, :, ::-1], axis=2), 0)
    return np.asarray(places), heights


@lru_cache(maxsize=16)
def steered_zones(
    elements: Elements, shading: Shading, beams: BeamGrid, focus: float, sound_speed: float, band: Band, parts: int
) -> tuple[SteeredZone, ...]:
    """The zones of a beam grid for an array cut into parts x parts, ready for `zoned_energies`; kept from frame to
    frame."""
    glass = lens(elements, focus, sound_speed, parts)
    cut = zones_of(glass, for_sensors(elements, weights(elements, shading), band), beams, parts)
    return tuple(steered(zone, elements, beams, glass) for zone in cut)


def _mirrored(start: int, stop: int, count: int) -> Ints:
    """Places start ... stop - 1 from the middle of `count` outwards, and their mirror images, ascending, each once."""
    upper = count // 2 + np.arange(start, stop)
    return np.unique(np.concatenate([count - 1 - upper, upper]))


def zoned_energies(
    spectra: np.ndarray,
    elements: Elements,
    weight: Floats,
    frequencies: Floats,
    beams: BeamGrid,
    sound_speed: float,
    zones: Sequence[SteeredZone],
) -> Floats:
    """As `focused_energies`, each zone with its own delays of focusing: (elevation, azimuth)."""
    from sonarsynth.equations.kernels.lanes import LANES
    from sonarsynth.equations.kernels.phasors import padded_bins
    from sonarsynth.imaging.delay_and_sum.lattice_kernel import lattice_energies
    from sonarsynth.imaging.delay_and_sum.part_kernel import part_energies

    padded = padded_bins(spectra, elements.count + 1, LANES)
    pairs, bins = padded.view(np.float32).ravel(), padded.shape[1]
    live = np.append(weight, 0.0).astype(np.float32)
    band = first_and_spacing(frequencies)
    image = np.empty((beams.elevations, beams.azimuths))
    for zone in zones:
        if zone.shared:
            odd, half = (elements.rows % 2 == 1, elements.columns % 2 == 1), 0.5 * elements.pitch / sound_speed
            image[np.ix_(zone.rows, zone.columns)] = lattice_energies(
                pairs, bins, zone.places, live, zone.delay, zone.heights, *odd, half, *band, zone.across, zone.rise
            )
            continue
        parts = round(len(zone.delay) ** 0.5)
        odd = -(-elements.rows // parts) % 2 == 1, -(-elements.columns // parts) % 2 == 1
        energy = part_energies(
            pairs, bins, zone.places, live, zone.delay, zone.heights, *odd, zone.rise, zone.across, zone.middle, *band
        )
        rows, columns = zone.rows[-energy.shape[1] :], zone.columns[-energy.shape[2] :]
        # From the far corner on: beams on an axis are their own mirror images, and are taken from the zone itself.
        image[np.ix_(beams.elevations - 1 - rows, beams.azimuths - 1 - columns)] = energy[3]
        image[np.ix_(beams.elevations - 1 - rows, columns)] = energy[2]
        image[np.ix_(rows, beams.azimuths - 1 - columns)] = energy[1]
        image[np.ix_(rows, columns)] = energy[0]
    return image
