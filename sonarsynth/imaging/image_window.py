"""Before a beamformer: spectra of a window of the signals. After it: the image of its energies."""

from __future__ import annotations

from typing import Literal

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.arrays.apertures import hann_shading, live_gain
from sonarsynth.equations.arrays.gates import frequency_spacing, gate_of, gate_samples
from sonarsynth.products import EnergyImage, Signals, Snapshots
from sonarsynth.receiver import Elements, Sonar

QUIET = 1e-7
"""Share of the energy in a window that may be left out at each end."""

Shading = Literal["uniform", "hann"]
"""Weights over the aperture: equal, or lower towards the rim (lower side lobes, a wider beam)."""


def snapshots_of(signals: Signals, sonar: Sonar, start: float, stop: float) -> Snapshots:
    """Spectra of the window from start to stop (s, clock of the signals) in the sonar's band.

    Raises ValueError when the window reaches outside the signals, or is too short to resolve the band.
    """
    from sonarsynth.equations.kernels.sensor_rows import heard_power

    rate, band = signals.sampling_frequency, (sonar.band.low, sonar.band.high)
    first, count = gate_samples(start, stop, signals.start, rate, signals.pressure.shape[1])
    gate = gate_of(signals.pressure, rate, first, count, band, heard_power(signals, first, first + count)[0])
    spacing, begin = frequency_spacing(count, rate), signals.start + first / rate
    return Snapshots(gate.frequency, spacing, gate.bins, gate, begin, count, rate, gate.power)


def sounding(power: Floats) -> tuple[int, int]:
    """First sample, and the one after the last, of the part of a power (sample,) that has all of its energy but `QUIET`
    before it and as much after it."""
    silence = QUIET * power.sum()
    before, after = np.cumsum(power), np.cumsum(power[::-1])
    first, stop = int(np.searchsorted(before, silence)), len(power) - int(np.searchsorted(after, silence))
    return first, max(first, stop)


def weights(elements: Elements, shading: Shading) -> Floats:
    """Weight of each element (sensor,), of sum one. Raises ValueError when none is live."""
    if shading == "uniform":
        return live_gain(elements.gain)
    return live_gain(elements.gain * hann_shading(elements.position, elements.aperture + 0.5 * elements.pitch))


def energy_image(energy: Floats, sonar: Sonar, start: float, stop: float) -> EnergyImage:
    """The image of energies (elevation, azimuth) in Pa2 s on the sonar's grid. Raises ValueError for another shape."""
    grid = sonar.beams.elevations, sonar.beams.azimuths
    if energy.shape != grid:
        raise ValueError(f"energies of an image have the shape {energy.shape}, and its beams {grid}")
    return EnergyImage(energy.astype(np.float32), sonar.beams.azimuth, sonar.beams.elevation, start, stop)
