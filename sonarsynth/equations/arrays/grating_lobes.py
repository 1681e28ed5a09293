"""Grating lobes of a lattice: other directions in which a plane wave is in step at all of its sensors."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats, Ints

LOBE_ANGLES = 256
"""Angles at which lobes of pulses are looked for."""


def grating_lobes(direction: Floats, frequency: Floats, pitch: float, sound_speed: float) -> Floats:
    """Directions (lobe, frequency, xyz) of beams that hear a plane wave from `direction` (xyz) as loud as a beam there.

    Of a square lattice in the plane x = 0, ahead of it (x > 0): frequency (Hz), pitch (m), sound speed (m/s). NaN at
    frequencies without this lobe; lobes of no frequency are left out. Components along the lattice differ by
    whole multiples of c/(f pitch) (Van Trees 2002, Optimum Array Processing, section 2.5).
    """
    step = sound_speed / (np.asarray(frequency, float) * pitch)
    highest_order = int(np.floor(2.0 / step.min()))
    orders = np.stack(np.meshgrid(*2 * [np.arange(-highest_order, highest_order + 1)]), axis=-1).reshape(-1, 2)
    orders = orders[orders.any(axis=1)]
    along = direction[1:] + orders[:, None, :] * step[:, None]
    ahead = 1.0 - (along**2).sum(axis=-1)
    exists = ahead > 0.0
    lobes = np.concatenate([np.sqrt(np.maximum(ahead, 0.0))[..., None], along], axis=-1)
    lobes[~exists] = np.nan
    return np.asarray(lobes[exists.any(axis=1)])


def lattice_pitch(position: Floats) -> float:
    """Pitch (m) of the square lattice that sensors (sensor, xyz) are on, in the plane x = 0; 0 where they are not."""
    across = np.concatenate([np.diff(np.unique(position[:, axis].round(6))) for axis in (1, 2)])
    pitch = float(across.min(initial=np.inf))
    steps = (position[:, 1:] - position[0, 1:]) / pitch
    on_lattice = np.isfinite(pitch) and np.abs(steps - steps.round()).max() < 1e-2 and not np.ptp(position[:, 0]) > 1e-6
    return pitch if on_lattice else 0.0


def loudest_lobe(
    counts: Ints, pitch: float, frequency: Floats, power: Floats, sound_speed: float, apart: float
) -> tuple[float, float]:
    """How far (difference of sines) the loudest grating lobe of a pulse is from its main lobe along an axis of a
    lattice, and its energy over that of the main lobe; (NaN, 0) where there is none within `apart`.

    Pulses of many frequencies have lobes at many angles, each of a part of the energy. counts (column,): sensors in
    each column; pitch (m); frequency (bin,) Hz, and the energy (bin,) of the pulse there, in any unit; sound speed in
    m/s.
    """
    nearest, farthest = (sound_speed / (pitch * f) for f in (frequency[-1], frequency[0]))
    if len(counts) < 2 or not (nearest < apart and power.sum() > 0.0):
        return float("nan"), 0.0
    steps = 1 << int(np.ceil(np.log2(64 * len(counts))))
    pattern = np.abs(np.fft.fft(counts, steps) / counts.sum()) ** 2  # over a period: of a phase of one cycle a column
    sines = np.linspace(nearest, min(farthest, apart), LOBE_ANGLES)
    cycles = np.outer(sines, frequency) * (pitch / sound_speed)
    energy = np.interp(cycles % 1.0, np.arange(steps + 1) / steps, np.append(pattern, pattern[0])) @ power
    loudest = int(energy.argmax())
    return float(sines[loudest]), float(energy[loudest] / power.sum())
