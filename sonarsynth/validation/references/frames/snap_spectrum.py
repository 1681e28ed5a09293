"""What a hydrophone makes of a snap at each frequency: pulse, filter and the absorption of the water."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import Absorption
from sonarsynth.receiver import Filter, LowPass
from sonarsynth.state import Emission
from sonarsynth.validation.references.frames.path_sum import point_spectrum

MICROPASCAL = 1e-6


def spectrum(snap: Emission, step: float, bins: int, longer: float = 0.0) -> np.ndarray:
    """Spectrum (bin,) in Pa s, at frequencies bin * step (Hz), of a snap at 1 m that lasts 1 + longer times as long:
    of gain p(t/width), its collapse at 0."""
    pulse = snap.model.pulse(0.0, step * bins * snap.width * (1.0 + max(longer, 0.1)))
    level = 1.0 if snap.source_level is None else MICROPASCAL * 10.0 ** (snap.source_level / 20.0) / pulse.peak
    times = snap.width * (1.0 + longer)
    return snap.gain * level * times * point_spectrum(times * pulse.time, pulse.strength, step, bins)


@lru_cache(maxsize=8)
def _passed(chosen: Filter) -> tuple[Floats, Floats, float, float]:
    """Integral of the transform of a Kaiser window (Kaiser 1974) up to frequencies, and the band."""
    a = chosen.attenuation
    beta = 0.1102 * (a - 8.7) if a > 50.0 else 0.5842 * max(a - 21.0, 0.0) ** 0.4 + 0.07886 * max(a - 21.0, 0.0)
    half = 0.5 * (a - 7.95) / (2.285 * 2.0 * np.pi * chosen.transition)
    low, high = (0.0, chosen.cutoff) if isinstance(chosen, LowPass) else (chosen.low, chosen.high)
    f = np.linspace(0.0, 6.0 * high + 20.0 * chosen.transition, 1 << 18)
    argument = np.emath.sqrt(beta**2 - (2.0 * np.pi * half * f) ** 2)
    window = 2.0 * half * np.real(np.sinc(argument / (1j * np.pi)))  # sinh x/x
    step = f[1]
    # Simpson's rule at every other sample
    integral = np.concatenate([[0.0], np.cumsum((window[:-2:2] + 4.0 * window[1:-1:2] + window[2::2]) * step / 3.0)])
    return f[::2][: len(integral)], integral, low, high


def duration(snap: Emission, chosen: Filter) -> float:
    """How long (s) either side of its collapse a filtered snap lasts at most."""
    pulse = snap.model.pulse(0.0, 0.0 if isinstance(chosen, LowPass) else chosen.high)
    ringing = (chosen.attenuation - 7.95) / (2.285 * 4.0 * np.pi * chosen.transition)
    return float(ringing + snap.width * max(-pulse.start, pulse.end))


def filter_response(chosen: Filter, frequency: Floats) -> Floats:
    """Response (frequency,) of the anti-alias filter: an ideal band through the transform of a Kaiser window, over that
    in the middle of the band."""
    f, integral, low, high = _passed(chosen)

    def up_to(x: Floats) -> Floats:
        return np.asarray(np.sign(x) * np.interp(np.abs(x), f, integral))

    def band(x: Floats) -> Floats:
        return up_to(x + high) - up_to(x + low) + up_to(x - low) - up_to(x - high)

    middle = np.array([0.0 if low == 0.0 else 0.5 * (low + high)])
    return np.asarray(band(np.asarray(frequency, float)) / band(middle))


def absorption(described: Absorption, frequency: Floats, depth: Floats) -> Floats:
    """Absorption (depth, frequency) in dB/m by Francois and Garrison (1982), JASA 72, 1879, or Ainslie and McColm
    (1998), JASA 103, 1671."""
    if described.formula == "none":
        return np.zeros((len(depth), len(frequency)))
    t, s, ph = described.temperature, described.salinity, described.ph
    f, z = frequency[None, :] / 1e3, depth[:, None]
    if described.formula == "ainslie_mccolm":
        z = z / 1e3
        f1, f2 = 0.78 * np.sqrt(s / 35.0) * np.exp(t / 26.0), 42.0 * np.exp(t / 17.0)
        boron = 0.106 * f1 * f**2 / (f1**2 + f**2) * np.exp((ph - 8.0) / 0.56)
        salt = 0.52 * (1.0 + t / 43.0) * (s / 35.0) * f2 * f**2 / (f2**2 + f**2) * np.exp(-z / 6.0)
        return np.asarray((boron + salt + 0.00049 * f**2 * np.exp(-(t / 27.0 + z / 17.0))) / 1e3)
    c = 1412.0 + 3.21 * t + 1.19 * s + 0.0167 * z
    f1 = 2.8 * np.sqrt(s / 35.0) * 10.0 ** (4.0 - 1245.0 / (273.0 + t))
    f2 = 8.17 * 10.0 ** (8.0 - 1990.0 / (273.0 + t)) / (1.0 + 0.0018 * (s - 35.0))
    boron = 8.86 / c * 10.0 ** (0.78 * ph - 5.0) * f1 * f**2 / (f1**2 + f**2)
    salt = 21.44 * s / c * (1.0 + 0.025 * t) * (1.0 - 1.37e-4 * z + 6.2e-9 * z**2) * f2 * f**2 / (f2**2 + f**2)
    if t <= 20.0:
        pure = 4.937e-4 - 2.59e-5 * t + 9.11e-7 * t**2 - 1.5e-8 * t**3
    else:
        pure = 3.964e-4 - 1.146e-5 * t + 1.45e-7 * t**2 - 6.5e-10 * t**3
    return np.asarray((boron + salt + pure * (1.0 - 3.83e-5 * z + 4.9e-10 * z**2) * f**2) / 1e3)
