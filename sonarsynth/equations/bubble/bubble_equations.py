"""The collapse of a cavitation bubble: Rayleigh-Plesset (water without compression) and Keller-Miksis (first order).

    (1 - R'/c) R R'' + 3/2 (1 - R'/3c) R'^2 = (1 + R'/c) (p_B - p_inf)/rho + R/(rho c) dp_B/dt
    p_B = p_v + p_g0 ((R0^3 - h^3)/(R^3 - h^3))^g - 2 s/R - 4 mu R'/R

from rest at R0. Sources: Keller and Miksis (1980), JASA 68, 628; Prosperetti and Lezzi (1986), JFM 168, 457; the hard
core h: Loefstedt, Barber and Putterman (1993). R falls by powers of ten in nanoseconds, so the clock is stretched
(Sundman's transform) and every unknown stays of order one: with x = R/R0, U^2 = (p_inf - p_v)/rho and T = R0/U,

    dt = T x^(5/2) ds,   dq/ds = W x^3/(x^3 - (h/R0)^3),   dW/ds = F(q, W),   W = (R'/U) x^(3/2),

where q is a third of the logarithm of the gas's volume: R > h in every trial step, and ln R can go to minus infinity.
The pressure at 1 m is rho (R^2 R'' + 2 R R'^2) with R'' from the equation: (p_inf - p_v) R0 x^-2 (F + W^2/2), which
does not cancel.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np


class Cavity(NamedTuple):
    """A bubble at rest at its largest, SI; the defaults are water at 20 degC."""

    radius: float  # m, R0
    gas_pressure: float  # Pa, of the gas at R0; 0 is an empty cavity
    ambient_pressure: float  # Pa
    vapour_pressure: float = 2339.0  # Pa
    surface_tension: float = 0.0725  # N/m
    viscosity: float = 1e-3  # Pa s
    density: float = 998.0  # kg/m3
    sound_speed: float = 1482.0  # m/s
    exponent: float = 1.4  # of the gas, 1 is isothermal
    core: float = 0.0  # m, radius h of the gas pressed solid
    compressible: bool = True  # Keller-Miksis; False is Rayleigh-Plesset


class Numbers(NamedTuple):
    """The cavity in units of R0, U and the pressure that drives it."""

    gas: float
    tension: float
    viscous: float
    mach: float  # U/c; 0 without compression
    exponent: float
    core3: float  # (h/R0)^3
    speed: float  # U, m/s
    time: float  # T, s
    drive: float  # Pa


def ambient_pressure(depth: float, density: float = 998.0, gravity: float = 9.81, surface: float = 101325.0) -> float:
    """Pressure (Pa) at a depth (m)."""
    return surface + density * gravity * depth


def hard_core(radius: float, gas_pressure: float, ambient: float, ratio: float = 8.86) -> float:
    """Radius (m) of the gas pressed solid: that of the gas at ambient pressure (isothermal) over 8.86 (argon), 8.5
    (air)."""
    return float(radius * np.cbrt(gas_pressure / ambient) / ratio)


def numbers(cavity: Cavity) -> Numbers:
    """Raises ValueError for a cavity that cannot collapse."""
    R0, gas, ambient, vapour, tension, viscosity, rho, c, g, core, compressible = cavity
    if not all(np.isfinite(cavity)) or min(R0, rho, c) <= 0 or min(gas, vapour, tension, viscosity, core) < 0 or g < 1:
        raise ValueError(
            f"a cavity must have a size, a density and no negative pressures, and an exponent >= 1: {cavity}"
        )
    drive = ambient - vapour
    if drive <= 0:
        raise ValueError(f"the ambient pressure of {ambient:.6g} Pa is not above the vapour's {vapour:.6g} Pa")
    outside = ambient + 2 * tension / R0
    if gas + vapour >= outside:
        raise ValueError(f"the bubble does not collapse: {gas + vapour:.6g} Pa inside, {outside:.6g} Pa outside")
    if core >= R0 or (core > 0 and gas == 0):
        raise ValueError(f"a hard core of {core:.6g} m needs gas, in a bubble that is larger, not of {R0:.6g} m")
    U = float(np.sqrt(drive / rho))
    return Numbers(
        gas / drive,
        2 * tension / (R0 * drive),
        4 * viscosity * U / (R0 * drive),
        U / c if compressible else 0.0,
        g,
        (core / R0) ** 3,
        U,
        R0 / U,
        drive,
    )


def ratio(q: Any, n: Numbers) -> Any:
    """x = R/R0 of the logarithm q."""
    return np.cbrt(n.core3 + (1.0 - n.core3) * np.exp(3.0 * q)) if n.core3 else np.exp(q)


def force(q: Any, W: Any, n: Numbers) -> tuple[Any, Any, Any]:
    """x = R/R0, dW/ds, and dq/ds over W: the equation times x^3, with R'' and its 3/2 R'^2 joined so that nothing
    cancels."""
    x = ratio(q, n)
    x3, root = x * x * x, np.sqrt(x)
    swell = 1.0 + n.core3 * np.exp(-3.0 * q) / (1.0 - n.core3)
    gas = n.gas * np.exp(-3.0 * n.exponent * q) * x3
    M = n.mach * W / (x * root)
    damping = n.viscous * n.mach / x  # 4 mu R''/R in dp_B/dt, moved to the left
    push = (1.0 + M) * (gas - x3) - n.tension * x * x - n.viscous * root * W - 3.0 * n.exponent * M * gas * swell
    return x, (push + W * W * (1.5 * damping - M)) / (1.0 - M + damping), swell


def unrest(q: Any, W: Any, n: Numbers) -> Any:
    """How far the bubble is from an equilibrium: its motion, and the force on it relative to those that make it up."""
    x, F, _ = force(q, W, n)
    return np.abs(W) + np.abs(F) / x**3 / (1.0 + n.gas * np.exp(-3.0 * n.exponent * q) + n.tension / x)
