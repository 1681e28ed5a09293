"""Spectra of ambient noise and of quantisation."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import REFERENCE_PRESSURE, Floats


def wenz_components(frequency: npt.ArrayLike, shipping: float, wind_speed: float) -> dict[str, Floats]:
    """Spectral levels (dB re 1 uPa2/Hz) of turbulence, shipping, wind and thermal noise at frequencies (Hz, positive).

    shipping runs from 0 to 1, wind_speed is in m/s. Nominal from 1 Hz to 100 kHz; the wind part is too loud above 50
    kHz and 15 m/s. Sources: Coates (1989), Underwater Acoustic Systems; Stojanovic (2007), ACM WUWNet; thermal: Mellen
    (1952), JASA 24, 478.
    """
    with np.errstate(divide="ignore"):
        f = np.asarray(frequency, float) / 1e3
        lg = np.log10(f)
        return {
            "turbulence": 17.0 - 30.0 * lg,
            "shipping": 40.0 + 20.0 * (shipping - 0.5) + 26.0 * lg - 60.0 * np.log10(f + 0.03),
            "wind": 50.0 + 7.5 * np.sqrt(wind_speed) + 20.0 * lg - 40.0 * np.log10(f + 0.4),
            "thermal": -15.0 + 20.0 * lg,
        }


def wenz_level(frequency: npt.ArrayLike, shipping: float, wind_speed: float) -> Floats:
    """Spectral level (dB re 1 uPa2/Hz) of the four components together, at frequencies (Hz, positive)."""
    levels = wenz_components(frequency, shipping, wind_speed).values()
    return np.asarray(10.0 * np.log10(sum(10.0 ** (level / 10.0) for level in levels)))


def knudsen_level(frequency: npt.ArrayLike, sea_state: float) -> Floats:
    """Spectral level (dB re 1 uPa2/Hz) of the sea at a sea state (0.5 or more), at frequencies (Hz, positive).

    Source: Knudsen, Alford and Emling (1948), Journal of Marine Research 7, 410: lines of 5 dB an octave.
    """
    return np.asarray(56.0 + 19.0 * np.log10(sea_state) - 17.0 * np.log10(np.asarray(frequency, float) / 1e3))


def rain_level(frequency: npt.ArrayLike, rate: float) -> Floats:
    """Spectral level (dB re 1 uPa2/Hz) of rain of a rate (mm/h), at frequencies (Hz, positive).

    Source: Ma, Nystuen and Lien (2005), JASA 117, 3555, at 5 kHz; 3 dB less each octave, good to 5 dB.
    """
    return np.asarray(42.4 + 15.4 * np.log10(rate) - 10.0 * np.log10(np.asarray(frequency, float) / 5e3))


def power_density(level: npt.ArrayLike) -> Floats:
    """One-sided power spectral density (Pa2/Hz) of a spectral level (dB re 1 uPa2/Hz)."""
    return np.asarray(REFERENCE_PRESSURE**2 * 10.0 ** (np.asarray(level, float) / 10.0))


def quantisation_density(quantum: float, sampling_frequency: float) -> float:
    """One-sided power spectral density (Pa2/Hz) of rounding to whole counts: q^2/12 spread over half the sampling
    rate."""
    return quantum**2 / (6.0 * sampling_frequency)
