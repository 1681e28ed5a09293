"""A lattice folded along both of its axes, and the energies of its beams."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sonarsynth.acoustics.arrays import focus_delay
from sonarsynth.conventions import Floats, Ints
from sonarsynth.sonar import Elements


@dataclass(frozen=True, eq=False)
class FoldedLattice:
    """A lattice folded along both of its axes. Places count from the middle outwards."""

    places: Ints  # (column, row, 4) sensors at (+z, +y), (+z, -y), (-z, +y), (-z, -y); `sensors` where there is none
    heights: Ints  # (column,) rows in use
    height: Floats  # (row,) m: |z|
    width: Floats  # (column,) m: |y|


def fold(elements: Elements) -> FoldedLattice:
    """The lattice of live elements, folded. Raises ValueError when the elements are not on a lattice."""
    if not elements.on_lattice:
        raise ValueError(
            "beamforming kind 'focused' needs an array on a lattice; use kind 'dense' for a table of positions"
        )
    half_columns, half_rows = (elements.columns + 1) // 2, (elements.rows + 1) // 2
    places = np.full((half_columns, half_rows, 4), elements.count)
    live = np.flatnonzero(elements.gain)
    # Twice the lattice coordinate, a whole number: 1, 3, 5... for an even number of elements, 0, 2, 4... for an odd.
    along_y = elements.columns - 1 - 2 * elements.column[live]
    along_z = elements.rows - 1 - 2 * elements.row[live]
    corner = 2 * (along_z < 0) + (along_y < 0)
    places[np.abs(along_y) // 2, np.abs(along_z) // 2, corner] = live
    used = np.min(places, axis=2) < elements.count
    heights = np.where(np.any(used, axis=1), half_rows - np.argmax(used[:, ::-1], axis=1), 0)
    half = 0.5 * elements.pitch
    width = half * np.arange((elements.columns + 1) % 2, elements.columns, 2, dtype=float)
    height = half * np.arange((elements.rows + 1) % 2, elements.rows, 2, dtype=float)
    return FoldedLattice(places, heights, height, width)


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
    from sonarsynth.acoustics.lanes import LANES
    from sonarsynth.acoustics.phasors import padded_bins
    from sonarsynth.beamforming.lattice_kernel import lattice_energies

    lattice = fold(elements)
    sensors = np.stack(np.broadcast_arrays(0.0, lattice.width[:, None], lattice.height), axis=-1)
    delay = focus_delay(sensors.reshape(-1, 3), np.array([1.0, 0.0, 0.0]), focus, sound_speed).reshape(
        sensors.shape[:2]
    )
    heard = padded_bins(spectra, elements.count + 1, LANES)
    return np.asarray(
        lattice_energies(
            heard.view(np.float32).ravel(),
            heard.shape[1],
            lattice.places,
            np.append(weight, 0.0).astype(np.float32),
            delay,
            lattice.heights,
            elements.rows % 2 == 1,
            elements.columns % 2 == 1,
            0.5 * elements.pitch / sound_speed,
            float(frequencies[0]),
            float(frequencies[1] - frequencies[0]) if len(frequencies) > 1 else 1.0,
            azimuth,
            elevation,
        )
    )
