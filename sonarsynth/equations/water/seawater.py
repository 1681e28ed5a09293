"""Sea water: sound speed, absorption, and depth from pressure. Every formula says its source and where it holds.

Temperatures in degrees Celsius, salinities in psu, depths in m (positive down), frequencies in Hz; arguments broadcast.
Outside its published range a formula still answers, and warns with `OutOfRange`.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats
from sonarsynth.equations.water import formula_ranges
from sonarsynth.equations.water.formula_ranges import OutOfRange

__all__ = [
    "OutOfRange",
    "ainslie_mccolm",
    "chen_millero",
    "del_grosso",
    "depth_of_pressure",
    "francois_garrison",
    "mackenzie",
    "medwin",
    "practical_salinity",
    "pressure_of_depth",
    "teos10",
]

DB_PER_KM = 1e-3  # dB/m
DBAR_PER_KG_CM2 = 9.80665


def mackenzie(temperature: npt.ArrayLike, salinity: npt.ArrayLike, depth: npt.ArrayLike) -> Floats:
    """Sound speed (m/s). Mackenzie (1981), JASA 70, 807: nine terms, standard deviation 0.07 m/s.

    Holds for 2 to 30 degC, 25 to 40 psu, 0 to 8000 m.
    """
    t, s, z = (np.asarray(x, float) for x in (temperature, salinity, depth))
    formula_ranges.MACKENZIE.check(temperature=t, salinity=s, depth=z)
    pure = 1448.96 + t * (4.591 + t * (-5.304e-2 + t * 2.374e-4))
    salt = (1.340 - 1.025e-2 * t) * (s - 35.0)
    deep = z * (1.630e-2 + z * (1.675e-7 - 7.139e-13 * t * z))
    return np.asarray(pure + salt + deep)


def medwin(temperature: npt.ArrayLike, salinity: npt.ArrayLike, depth: npt.ArrayLike) -> Floats:
    """Sound speed (m/s). Medwin (1975), JASA 58, 1318: six terms, about 0.2 m/s.

    Holds for 0 to 35 degC, 0 to 45 psu, 0 to 1000 m.
    """
    t, s, z = (np.asarray(x, float) for x in (temperature, salinity, depth))
    formula_ranges.MEDWIN.check(temperature=t, salinity=s, depth=z)
    pure = 1449.2 + t * (4.6 + t * (-0.055 + t * 0.00029))
    return np.asarray(pure + (1.34 - 0.010 * t) * (s - 35.0) + 0.016 * z)


def chen_millero(temperature: npt.ArrayLike, salinity: npt.ArrayLike, pressure: npt.ArrayLike) -> Floats:
    """Sound speed (m/s) at a gauge `pressure` in dbar: what most instruments report.

    Chen and Millero (1977), JASA 62, 1129, as in Fofonoff and Millard (1983), UNESCO technical papers in marine
    science 44; temperature on the scale of 1968 (1.00024 times that of 1990: 0.02 m/s). Holds for 0 to 40 degC,
    0 to 40 psu, 0 to 10 000 dbar.
    """
    t, s, dbar = (np.asarray(x, float) for x in (temperature, salinity, pressure))
    formula_ranges.CHEN_MILLERO.check(temperature=t, salinity=s, pressure=dbar)
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


def del_grosso(temperature: npt.ArrayLike, salinity: npt.ArrayLike, pressure: npt.ArrayLike) -> Floats:
    """Sound speed (m/s) at a gauge `pressure` in dbar: standard deviation 0.05 m/s.

    Del Grosso (1974), JASA 56, 1084, with the coefficients of Wong and Zhu (1995), JASA 97, 1732, for temperatures on
    the scale of 1990. Travel times across oceans favour it: Dushaw et al. (1993), JASA 93, 255. Holds for 0 to 30 degC,
    30 to 40 psu, 0 to 1000 kg/cm2 (9807 dbar).
    """
    t, s, dbar = (np.asarray(x, float) for x in (temperature, salinity, pressure))
    formula_ranges.DEL_GROSSO.check(temperature=t, salinity=s, pressure=dbar)
    p = dbar / DBAR_PER_KG_CM2
    heat = t * (5.012285 + t * (-5.51184e-2 + t * 2.21649e-4))
    salt = s * (1.329530 + s * 1.288598e-4)
    deep = p * (0.1560592 + p * (2.449993e-5 - p * 8.833959e-9))
    mixed = s * t * (-1.275936e-2 + t * 9.688441e-5 + p * (-3.406824e-4 + s * 4.857614e-6))
    mixed += t * p * (6.353509e-3 - t**2 * 4.383615e-7 + p * (-1.593895e-6 + t * 2.656174e-8 + p * 5.222483e-10))
    return np.asarray(1402.392 + heat + salt + deep + mixed - 1.616745e-9 * (s * p) ** 2)


def teos10(
    temperature: npt.ArrayLike,
    salinity: npt.ArrayLike,
    depth: npt.ArrayLike,
    latitude: float = 45.0,
    longitude: float | None = None,
) -> Floats:
    """Sound speed (m/s) of the equation of state of 2010, by gsw; temperature in situ, practical salinity.

    IOC, SCOR and IAPSO (2010), in the 75 terms of Roquet et al. (2015), Ocean Modelling 90, 29: within 0.16 m/s of the
    Gibbs function itself, 0.14 m/s below it at 27 degC. latitude and longitude in degrees. The composition of sea water
    is that at the longitude and latitude, or the standard one where no longitude is given (0.02 m/s in most seas).
    Holds in the oceanographic funnel of McDougall et al. (2003), J. Atmos. Ocean. Technol. 20, 730: to 40 degC and 0
    to 42 g/kg down to 500 dbar, narrower below. Raises ImportError without gsw.
    """
    try:
        import gsw
    except ImportError as error:
        raise ImportError(f"teos10 needs gsw (pip install 'sonarsynth[teos10]'): {error}") from None
    t, s, z = np.broadcast_arrays(*(np.asarray(x, float) for x in (temperature, salinity, depth)))
    p = gsw.p_from_z(-z, latitude)
    absolute = gsw.SR_from_SP(s) if longitude is None else gsw.SA_from_SP(s, p, longitude, latitude)
    conservative = gsw.CT_from_t(absolute, t, p)
    outside = np.asarray(gsw.infunnel(absolute, conservative, p)) == 0.0
    if np.any(outside):
        i = np.flatnonzero(outside)[0]
        formula_ranges.say(
            f"TEOS-10: {t.flat[i]:g} degC with {s.flat[i]:g} psu at {z.flat[i]:g} m is outside the oceanographic "
            "funnel (McDougall et al. 2003)"
        )
    return np.asarray(gsw.sound_speed(absolute, conservative, p))


def depth_of_pressure(pressure: npt.ArrayLike, latitude: float = 45.0) -> Floats:
    """Depth (m) of a gauge pressure in dbar at a latitude (degrees), in a standard ocean (0 degC, 35 psu).

    Saunders and Fofonoff (1976), as in Fofonoff and Millard (1983), UNESCO technical papers in marine science 44;
    within 0.1 m to 10 000 dbar in the standard ocean. The latitude changes it by 0.5 % from equator to pole.
    """
    p = np.asarray(pressure, float)
    formula_ranges.FOFONOFF_MILLARD.check(pressure=p)
    return _standard_depth(p, latitude)


def pressure_of_depth(depth: npt.ArrayLike, latitude: float = 45.0) -> Floats:
    """Gauge pressure (dbar) at a depth (m) and a latitude (degrees): the inverse of `depth_of_pressure`."""
    z = np.asarray(depth, float)
    p = z.copy()
    for _ in range(20):  # the slope dz/dp is within 4 % of 1: each step leaves 4 % of the error
        p = p + (z - _standard_depth(p, latitude))
    formula_ranges.FOFONOFF_MILLARD.check(pressure=p)
    return np.asarray(p)


def practical_salinity(conductivity: npt.ArrayLike, temperature: npt.ArrayLike, pressure: npt.ArrayLike) -> Floats:
    """Practical salinity (psu) of a conductivity (mS/cm), a temperature (degC, scale of 1990) and a pressure (dbar).

    The scale of 1978: Perkin and Lewis (1980), IEEE J. Oceanic Eng. 5, 9, as in Fofonoff and Millard (1983), UNESCO
    technical papers in marine science 44. Holds for 2 to 42 psu, -2 to 35 degC; NaN without conductivity.
    """
    t90, p = np.asarray(temperature, float), np.asarray(pressure, float)
    t = 1.00024 * t90
    ratio = np.asarray(conductivity, float) / 42.914
    depth = p * (2.070e-5 + p * (-6.370e-10 + 3.989e-15 * p))
    of_pressure = 1.0 + depth / (1.0 + t * (3.426e-2 + 4.464e-4 * t) + (4.215e-1 - 3.107e-3 * t) * ratio)
    of_temperature = 0.6766097 + t * (2.00564e-2 + t * (1.104259e-4 + t * (-6.9698e-7 + 1.0031e-9 * t)))
    root = np.sqrt(np.where(ratio > 0, ratio / (of_pressure * of_temperature), np.nan))
    standard = np.polynomial.polynomial.polyval(root, (0.0080, -0.1692, 25.3851, 14.0941, -7.0261, 2.7081))
    warm = np.polynomial.polynomial.polyval(root, (0.0005, -0.0056, -0.0066, -0.0375, 0.0636, -0.0144))
    return np.asarray(standard + (t - 15.0) / (1.0 + 0.0162 * (t - 15.0)) * warm)


def _standard_depth(p: Floats, latitude: float) -> Floats:
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
    warns outside -2 to 30 degC, 30 to 40 psu, pH 7.7 to 8.3, 0 to 10 km.
    """
    f, t, s, z = (np.asarray(x, float) for x in (frequency, temperature, salinity, depth))
    acid = np.asarray(ph, float)
    formula_ranges.FRANCOIS_GARRISON.check(frequency=f, temperature=t, salinity=s, ph=acid, depth=z)
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
    formula_ranges.AINSLIE_MCCOLM.check(frequency=f, temperature=t, salinity=s, ph=acid, depth=z)
    f, z = f / 1e3, z / 1e3  # kHz, km
    boron = 0.106 * np.exp((acid - 8.0) / 0.56) * _relaxation(f, 0.78 * np.sqrt(s / 35.0) * np.exp(t / 26.0))
    magnesium = 0.52 * (1.0 + t / 43.0) * (s / 35.0) * np.exp(-z / 6.0) * _relaxation(f, 42.0 * np.exp(t / 17.0))
    water = 0.00049 * np.exp(-(t / 27.0 + z / 17.0)) * f**2
    return np.asarray((boron + magnesium + water) * DB_PER_KM)


def _relaxation(f: Floats, relaxation: Floats) -> Floats:
    """f_r f^2 / (f_r^2 + f^2) of a relaxation frequency f_r; 0 where there is no salt to relax (f_r = 0)."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(relaxation > 0.0, relaxation * f**2 / (relaxation**2 + f**2), 0.0))
