"""Energies of beams on a grid, of a lattice folded along both of its axes."""

from __future__ import annotations

import numpy as np

from sonarsynth.acoustics.beams import first_and_spacing
from sonarsynth.acoustics.lattices import axial_focus_delay, mirrored_sensors
from sonarsynth.conventions import Floats, Ints
from sonarsynth.sonar import Elements


def fold(elements: Elements) -> tuple[Ints, Ints]:
    """Live elements as `lattices.mirrored_sensors` places them, `count` for none; and rows in use (half column,).

    Raises ValueError when the elements are not on a lattice.
    """
    if not elements.on_lattice:
        raise ValueError(
            "beamforming kind 'focused' needs an array on a lattice; use kind 'dense' for a table of positions"
        )
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
    from sonarsynth.acoustics.lanes import LANES
    from sonarsynth.acoustics.phasors import padded_bins
    from sonarsynth.beamforming.lattice_kernel import lattice_energies

    places, heights = fold(elements)
    heard = padded_bins(spectra, elements.count + 1, LANES)
    return np.asarray(
        lattice_energies(
            heard.view(np.float32).ravel(),
            heard.shape[1],
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
