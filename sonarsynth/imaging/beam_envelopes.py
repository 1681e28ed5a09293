"""Range-resolved beams: the level of every beam of the grid against delay."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import REFERENCE_PRESSURE, Floats, direction
from sonarsynth.equations.arrays.gates import fast_length, frequency_spacing
from sonarsynth.imaging.steering import BEAMS_AT_ONCE
from sonarsynth.products import BeamSpectra
from sonarsynth.receiver import Sonar


def envelope_delays(duration: float, sonar: Sonar) -> Floats:
    """Times (delay,) in s after the first sample of a window of `duration` (s), one over the bandwidth apart.

    There are as many as the window has frequencies in band, so that mean squares add up to the energy (Parseval).
    """
    rate = sonar.sampling_frequency
    count = int(np.floor(duration * rate + 1e-6))
    spacing = frequency_spacing(count, rate)
    lowest, highest = np.ceil(sonar.band.low / spacing - 1e-9), np.floor(sonar.band.high / spacing + 1e-9)
    bins = int(min(highest, (fast_length(count) - 1) // 2) - lowest) + 1
    step = 1.0 / (bins * spacing)
    return np.asarray(step * np.arange(min(int(np.ceil(count / rate / step)), bins)), float)


def envelope_levels(beams: BeamSpectra, sonar: Sonar, delays: int) -> Floats:
    """Mean square pressure over a period of the carrier, by the envelope: (elevation, azimuth, delay) dB re 1 uPa.

    delays: how many, from the first on, as `envelope_delays` has them; -inf in silence.
    Source: the analytic signal, e.g. Van Trees (2002), Optimum Array Processing, appendix A.
    """
    from scipy.fft import ifft

    window = beams.snapshots
    bins, length = len(window.frequency), fast_length(window.samples)
    u = direction(sonar.beams.azimuth, sonar.beams.elevation[:, None]).reshape(-1, 3)
    level = np.empty((len(u), delays))
    for low in range(0, len(u), BEAMS_AT_ONCE):
        block = slice(low, low + BEAMS_AT_ONCE)
        # of a real signal: twice its positive frequencies; a sum over bins where ifft takes the mean
        envelope = np.abs(ifft(beams.spectra(u[block]), axis=1)[:, :delays]) * (2.0 * bins / length)
        with np.errstate(divide="ignore"):
            level[block] = 20.0 * np.log10(envelope / (np.sqrt(2.0) * REFERENCE_PRESSURE))
    return level.reshape(sonar.beams.elevations, sonar.beams.azimuths, delays)
