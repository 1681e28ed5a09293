"""Beams of an array: their spectra, and their energy.

The beam of direction u (unit vector to the source) is

    B(f) = sum_q g_q P_q(f) exp(+i 2 pi f tau_q) / sum_q g_q,

with tau_q the time by which sensor q hears a source at u later than the array centre does: a plane wave of pressure p
from u gives back p.
Source: any text on arrays, e.g. Van Trees (2002), Optimum Array Processing, sections 2.2 and 6.2.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.arrays.apertures import focus_delay, live_gain
from sonarsynth.equations.arrays.lattices import axial_focus_delay, mirrored_sensors


def first_and_spacing(frequencies: Floats) -> tuple[float, float]:
    """First of evenly spaced frequencies (bin,) and the distance between two (Hz); 1 Hz where there is but one."""
    return float(frequencies[0]), float(frequencies[1] - frequencies[0]) if len(frequencies) > 1 else 1.0


def beam_spectra(
    spectra: npt.NDArray[np.complex64],
    frequencies: Floats,
    position: npt.ArrayLike,
    gain: npt.ArrayLike,
    directions: npt.ArrayLike,
    sound_speed: float,
    focus: float | None,
) -> npt.NDArray[np.complex64]:
    """Spectra (beam, bin) of beams steered in `directions` (beam, xyz) and focused at `focus` (m; None: plane waves).

    spectra (sensor, bin) at evenly spaced frequencies (bin,) Hz; position (sensor, xyz) m; gain (sensor,), 0 for a dead
    element. Any array, exact spherical delays, float32 sums: error 2e-6 of the largest |B|. Raises ValueError when no
    element is live.
    """
    from sonarsynth.equations.kernels.phasors import steered_sums

    weight = live_gain(gain)
    u = np.asarray(directions, float)
    delay = focus_delay(position, u, focus, sound_speed)
    return steered_sums(spectra, delay, weight, *first_and_spacing(frequencies))


def lattice_beam_spectra(
    spectra: npt.NDArray[np.complex64],
    frequencies: Floats,
    column: Ints,
    row: Ints,
    shape: tuple[int, int],
    *,
    pitch: float,
    gain: npt.ArrayLike,
    directions: npt.ArrayLike,
    sound_speed: float,
    focus: float | None,
) -> npt.NDArray[np.complex64]:
    """As `beam_spectra` for elements of a lattice, focused in every direction as on the axis; several times as fast.

    column, row (sensor,): 0 at port (+y) and at the top (+z), of `shape` (columns, rows) `pitch` (m) apart, centred on
    the origin in the plane x = 0. The delay of focusing is (sqrt(R^2 + q^2) - R)/c, so that rows and columns separate:
    off the axis that is not quite a sphere (`imaging.FocusedDelayAndSum` has a table). Beams of one elevation share
    the sums over rows. Float32 sums: error 1e-6 of the largest |B| (508 elements), 3e-6 for 64 in a row, 1.3e-5 for
    300. Raises ValueError when no element is live.
    """
    from sonarsynth.equations.arrays.lattice_beams import lattice_sums

    weight = live_gain(gain)
    places = mirrored_sensors(column, row, *shape, np.flatnonzero(weight), len(weight))
    delay = axial_focus_delay(*shape, pitch, focus, sound_speed)
    step = np.asarray(directions, float) * (-pitch / sound_speed)
    odd = shape[1] % 2 == 1, shape[0] % 2 == 1
    first, spacing = first_and_spacing(frequencies)
    return lattice_sums(
        spectra, places, weight, delay, step[:, 2], step[:, 1], odd=odd, frequency=first, spacing=spacing
    )
