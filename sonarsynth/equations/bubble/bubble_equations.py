"""The collapse of a cavitation bubble by the equation of Keller and Miksis (first order in the wall's Mach number).

    (1 - R'/c) R R'' + 3/2 (1 - R'/3c) R'^2 = (1 + R'/c) (p_B - p_inf)/rho + R/(rho c) dp_B/dt
    p_B = p_v + p_g0 (R0/R)^(3 g) - 2 s/R - 4 mu R'/R

from rest at R0. Sources: Keller and Miksis (1980), JASA 68, 628; Prosperetti and Lezzi (1986), JFM 168, 457. R falls by
powers of ten in nanoseconds, so the clock is stretched (Sundman's transform) and every unknown stays of order one: with
x = R/R0 = exp(q), U^2 = (p_inf - p_v)/rho and T = R0/U,

    dt = T x^(5/2) ds,   dq/ds = W,   dW/ds = F(q, W),   W = (R'/U) x^(3/2).

The pressure at 1 m is rho (R^2 R'' + 2 R R'^2) with R'' from the equation: (p_inf - p_v) R0 x^-2 (F + W^2/2), which
does not cancel.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np


class Cavity(NamedTuple):
    """A bubble at rest at its largest, SI; the defaults are water at 20 degC."""

    radius: float  # m, R0
    gas_pressure: float  # Pa, of the gas at R0
    ambient_pressure: float  # Pa
    vapour_pressure: float = 2339.0  # Pa
    surface_tension: float = 0.0725  # N/m
    viscosity: float = 1e-3  # Pa s
    density: float = 998.0  # kg/m3
    sound_speed: float = 1482.0  # m/s
    exponent: float = 1.4  # of the gas, 1 is isothermal


class Numbers(NamedTuple):
    """The cavity in units of R0, U and the pressure that drives it."""

    gas: float
    tension: float
    viscous: float
    mach: float  # U/c
    exponent: float
    speed: float  # U, m/s
    time: float  # T, s
    drive: float  # Pa


def ambient_pressure(depth: float) -> float:
    """Pressure (Pa) at a depth (m)."""
    return 101325.0 + 998.0 * 9.81 * depth


def numbers(cavity: Cavity) -> Numbers:
    """Raises ValueError for a cavity that cannot collapse."""
    R0, gas, ambient, vapour, tension, viscosity, rho, c, g = cavity
    drive = ambient - vapour
    if drive <= 0:
        raise ValueError(f"the ambient pressure of {ambient:.6g} Pa is not above the vapour's {vapour:.6g} Pa")
    outside = ambient + 2 * tension / R0
    if gas + vapour >= outside:
        raise ValueError(f"the bubble does not collapse: {gas + vapour:.6g} Pa inside, {outside:.6g} Pa outside")
    U = float(np.sqrt(drive / rho))
    return Numbers(
        gas / drive, 2 * tension / (R0 * drive), 4 * viscosity * U / (R0 * drive), U / c, g, U, R0 / U, drive
    )


def force(q: Any, W: Any, n: Numbers) -> tuple[Any, Any]:
    """x = R/R0 and dW/ds: the equation times x^3, with R'' and its 3/2 R'^2 joined so that nothing cancels."""
    x = np.exp(q)
    x3, root = x * x * x, np.sqrt(x)
    gas = n.gas * np.exp(-3.0 * n.exponent * q) * x3
    M = n.mach * W / (x * root)
    damping = n.viscous * n.mach / x  # 4 mu R''/R in dp_B/dt, moved to the left
    push = (1.0 + M) * (gas - x3) - n.tension * x * x - n.viscous * root * W - 3.0 * n.exponent * M * gas
    return x, (push + W * W * (1.5 * damping - M)) / (1.0 - M + damping)
