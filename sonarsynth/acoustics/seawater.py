"""Sea water: sound speed, absorption, and depth from pressure. Every formula says its source and where it holds.

Temperatures in degrees Celsius, salinities in psu, depths in m (positive down), frequencies in Hz; arguments broadcast.
Outside its published range a formula still answers, and warns with `OutOfRange`.
"""

from __future__ import annotations

import warnings

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats

DB_PER_KM = 1e-3  # dB/m


class OutOfRange(UserWarning):
    """A formula was used outside the range that its authors give."""


def _within(formula: str, quantity: str, values: Floats, low: float, high: float, unit: str) -> None:
    outside = (values < low) | (values > high)
    if np.any(outside):
        worst = values[outside].flat[0]
        message = f"{formula}: {quantity} {worst:g} {unit} is outside {low:g} to {high:g} {unit}"
        warnings.warn(message, OutOfRange, stacklevel=3)


def mackenzie(temperature: npt.ArrayLike, salinity: npt.ArrayLike, depth: npt.ArrayLike) -> Floats:
    """Sound speed (m/s). Mackenzie (1981), JASA 70, 807: nine terms, standard deviation 0.07 m/s.

    Holds for 2 to 30 degC, 25 to 40 psu, 0 to 8000 m.
    """
    t, s, z = (np.asarray(x, float) for x in (temperature, salinity, depth))
    _within("Mackenzie (1981)", "temperature", t, 2.0, 30.0, "degC")
    _within("Mackenzie (1981)", "salinity", s, 25.0, 40.0, "psu")
    _within("Mackenzie (1981)", "depth", z, 0.0, 8000.0, "m")
    pure = 1448.96 + t * (4.591 + t * (-5.304e-2 + t * 2.374e-4))
    salt = (1.340 - 1.025e-2 * t) * (s - 35.0)
    deep = z * (1.630e-2 + z * (1.675e-7 - 7.139e-13 * t * z))
    return np.asarray(pure + salt + deep)


def medwin(temperature: npt.ArrayLike, salinity: npt.ArrayLike, depth: npt.ArrayLike) -> Floats:
    """Sound speed (m/s). Medwin (1975), JASA 58, 1318: six terms, about 0.2 m/s.

    Holds for 0 to 35 degC, 0 to 45 psu, 0 to 1000 m.
    """
    t, s, z = (np.asarray(x, float) for x in (temperature, salinity, depth))
    _within("Medwin (1975)", "temperature", t, 0.0, 35.0, "degC")
    _within("Medwin (1975)", "salinity", s, 0.0, 45.0, "psu")
    _within("Medwin (1975)", "depth", z, 0.0, 1000.0, "m")
    pure = 1449.2 + t * (4.6 + t * (-0.055 + t * 0.00029))
    return np.asarray(pure + (1.34 - 0.010 * t) * (s - 35.0) + 0.016 * z)


def chen_millero(temperature: npt.ArrayLike, salinity: npt.ArrayLike, pressure: npt.ArrayLike) -> Floats:
    """Sound speed (m/s) at a gauge `pressure` in dbar: what most instruments report.

    Chen and Millero (1977), JASA 62, 1129, as in Fofonoff and Millard (1983), UNESCO technical papers in marine
    science 44; temperature on the scale of 1968 (1.00024 times that of 1990: 0.02 m/s). Holds for 0 to 40 degC,
    0 to 40 psu, 0 to 10 000 dbar.
    """
    t, s, dbar = (np.asarray(x, float) for x in (temperature, salinity, pressure))
    _within("Chen and Millero (1977)", "temperature", t, 0.0, 40.0, "degC")
    _within("Chen and Millero (1977)", "salinity", s, 0.0, 40.0, "psu")
    _within("Chen and Millero (1977)", "pressure", dbar, 0.0, 10e3, "dbar")
    p = 0.1 * dbar  # bar
    c0 = 1402.388 + t * (5.03711 + t * (-5.80852e-2 + t * (3.3420e-4 + t * (-1.47800e-6 + t * 3.1464e-9))))
    c1 = 0.153563 + t * (6.8982e-4 + t * (-8.1788e-6 + t * (1.3621e-7 - t * 6.1185e-10)))
    c2 = 3.1260e-5 + t * (-1.7107e-6 + t * (2.5974e-8 + t * (-2.5335e-10 + t * 1.0405e-12)))
    c3 = -9.7729e-9 + t * (3.8504e-10 - t * 2.3643e-12)
    a0 = 1.389 + t * (-1.262e-2 + t * (7.164e-5 + t * (2.006e-6 - t * 3.21e-8)))
    a1 = 9.4742e-5 + t * (-1.2580e-5 + t * (-6.4885e-8 + t * (1.0507e-8 - t * 2.0122e-10)))
    a2 = -3.9064e-7 + t * (9.1041e-9 + t * (-1.6002e-10 + t * 7.988e-12))
    a3 = 1.100e-10 + t * (6.649e-12 - t * 3.389e-13)
    b = -1.922e-2 - 4.42e-5 * t + (7.3637e-5 + 1.7945e-7 * t) * p
    d = 1.727e-3 - 7.9836e-6 * p
    fresh = c0 + p * (c1 + p * (c2 + p * c3))
    return np.asarray(fresh + s * (a0 + p * (a1 + p * (a2 + p * a3)) + b * np.sqrt(s) + d * s))


def depth_of_pressure(pressure: npt.ArrayLike, latitude: float = 45.0) -> Floats:
    """Depth (m) of a gauge pressure in dbar at a latitude (degrees), in a standard ocean (0 degC, 35 psu).

    Saunders and Fofonoff (1976), as in Fofonoff and Millard (1983), UNESCO technical papers in marine science 44;
    within 0.1 m to 10 000 dbar in the standard ocean. The latitude changes it by 0.5 % from equator to pole.
    """
    p = np.asarray(pressure, float)
    x = np.sin(np.radians(latitude)) ** 2
    gravity = 9.780318 * (1.0 + (5.2788e-3 + 2.36e-5 * x) * x) + 1.092e-6 * p
    return np.asarray(p * (9.72659 + p * (-2.2512e-5 + p * (2.279e-10 - p * 1.82e-15))) / gravity)


def francois_garrison(
    frequency: npt.ArrayLike,
    temperature: npt.ArrayLike,
    salinity: npt.ArrayLike,
    depth: npt.ArrayLike,
    ph: npt.ArrayLike = 8.1,
) -> Floats:
    """Absorption (dB/m). Francois and Garrison (1982), JASA 72, 896 and 1879: about 5 %.

    Boric acid, magnesium sulphate and pure water. From 200 Hz (below, absorption is under 1e-5 dB/m) to 1 MHz; the 5 %
    are stated for -2 to 22 degC, 30 to 35 psu, 3500 m in 10 to 500 kHz and for 0 to 30 degC, 0 to 40 psu above; it
    warns outside -2 to 30 degC, 30 to 40 psu, 0 to 10 km.
    """
    f, t, s, z = (np.asarray(x, float) for x in (frequency, temperature, salinity, depth))
    acid = np.asarray(ph, float)
    _within("Francois and Garrison (1982)", "frequency", f, 0.0, 1e6, "Hz")
    _within("Francois and Garrison (1982)", "temperature", t, -2.0, 30.0, "degC")
    _within("Francois and Garrison (1982)", "salinity", s, 30.0, 40.0, "psu")
    _within("Francois and Garrison (1982)", "depth", z, 0.0, 10e3, "m")
    f = f / 1e3  # kHz
    kelvin = 273.0 + t
    c = 1412.0 + 3.21 * t + 1.19 * s + 0.0167 * z
    a1 = 8.86 / c * 10.0 ** (0.78 * acid - 5.0)
    f1 = 2.8 * np.sqrt(s / 35.0) * 10.0 ** (4.0 - 1245.0 / kelvin)
    a2 = 21.44 * s / c * (1.0 + 0.025 * t)
    p2 = 1.0 + z * (-1.37e-4 + z * 6.2e-9)
    f2 = 8.17 * 10.0 ** (8.0 - 1990.0 / kelvin) / (1.0 + 0.0018 * (s - 35.0))
    cold = 4.937e-4 + t * (-2.59e-5 + t * (9.11e-7 - t * 1.50e-8))
    warm = 3.964e-4 + t * (-1.146e-5 + t * (1.45e-7 - t * 6.5e-10))
    p3 = 1.0 + z * (-3.83e-5 + z * 4.9e-10)
    water = np.where(t <= 20.0, cold, warm) * p3 * f**2
    return np.asarray((a1 * _relaxation(f, f1) + a2 * p2 * _relaxation(f, f2) + water) * DB_PER_KM)


def ainslie_mccolm(
    frequency: npt.ArrayLike,
    temperature: npt.ArrayLike,
    salinity: npt.ArrayLike,
    depth: npt.ArrayLike,
    ph: npt.ArrayLike = 8.1,
) -> Floats:
    """Absorption (dB/m). Ainslie and McColm (1998), JASA 103, 1671: within 10 % of Francois and Garrison.

    Holds for 100 Hz to 1 MHz (below, absorption is negligible), -6 to 35 degC, 5 to 50 psu, pH 7.7 to 8.3, 0 to 7 km.
    """
    f, t, s, z = (np.asarray(x, float) for x in (frequency, temperature, salinity, depth))
    acid = np.asarray(ph, float)
    _within("Ainslie and McColm (1998)", "frequency", f, 0.0, 1e6, "Hz")
    _within("Ainslie and McColm (1998)", "temperature", t, -6.0, 35.0, "degC")
    _within("Ainslie and McColm (1998)", "salinity", s, 5.0, 50.0, "psu")
    _within("Ainslie and McColm (1998)", "pH", acid, 7.7, 8.3, "")
    _within("Ainslie and McColm (1998)", "depth", z, 0.0, 7e3, "m")
    f, z = f / 1e3, z / 1e3  # kHz, km
    boron = 0.106 * np.exp((acid - 8.0) / 0.56) * _relaxation(f, 0.78 * np.sqrt(s / 35.0) * np.exp(t / 26.0))
    magnesium = 0.52 * (1.0 + t / 43.0) * (s / 35.0) * np.exp(-z / 6.0) * _relaxation(f, 42.0 * np.exp(t / 17.0))
    water = 0.00049 * np.exp(-(t / 27.0 + z / 17.0)) * f**2
    return np.asarray((boron + magnesium + water) * DB_PER_KM)


def _relaxation(f: Floats, relaxation: Floats) -> Floats:
    """f_r f^2 / (f_r^2 + f^2) of a relaxation frequency f_r; 0 where there is no salt to relax (f_r = 0)."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(relaxation > 0.0, relaxation * f**2 / (relaxation**2 + f**2), 0.0))
