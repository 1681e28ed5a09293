"""The logarithmic bubble against its own formula in many digits, and a closed form."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from sonarsynth.conventions import Floats
from sonarsynth.equations.bubble import snap_pressure
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.validation.run_time import timed
from sonarsynth.validation.validation_rows import Row

CASE = "logarithmic bubble"
DIGITS, CLOSED = "40 digits", "closed form"
MODEL = LogarithmicBubble()
BUBBLE = snap_pressure.Bubble(MODEL.a, MODEL.k, MODEL.m, MODEL.q, MODEL.density)
TAU = 1.0 / abs(BUBBLE.q)


def logarithmic_rows(quick: bool) -> list[Row]:
    """Radius, its derivatives, pressure, spectrum and impulse. Needs mpmath."""
    return [*_wall_rows(quick), *_collapse_rows(), *_spectrum_rows(quick)]


def _cost(run: Callable[[], Any], count: int) -> float:
    """CPU time (us) of one of `count`."""
    return 1e6 * timed(lambda: [run() for _ in range(20)], 5)[1] / 20.0 / count


def _row(reference: str, quantity: str, unit: str, expected: float, error: Any, cost: float, points: int) -> Row:
    of = "us a frequency" if "spectrum" in quantity else "us a time"
    return Row(CASE, reference, quantity, unit, expected, abs(float(error)), cost, of, {"evaluations": points})


def _computed(t: Floats) -> Floats:
    return np.array([*snap_pressure.wall(t, BUBBLE), snap_pressure.pressure(t, BUBBLE)])


def _wall_rows(quick: bool) -> Iterator[Row]:
    times = -np.geomspace(1e-9, 2e-3, 6 if quick else 40)
    cost = _cost(lambda: _computed(times), len(times))
    exact = np.array([_many_digits(float(t)) for t in times]).T
    miss = np.abs(_computed(times) - exact) / np.abs(_scale(exact))
    for name, error in zip(("radius", "speed", "acceleration", "pressure"), miss, strict=True):
        yield _row(DIGITS, name, "of terms", 2e-14, error.max(), cost, len(times))


def _scale(exact: Floats) -> Floats:
    """What an error is relative to: the value, or the terms of a pressure that cancel where it changes its sign."""
    R, R1, R2, _ = exact
    pressure = BUBBLE.density * np.abs(R) * (np.abs(R * R2) + 2.0 * R1 * R1)
    return np.array([R, np.abs(R1) + np.abs(R * BUBBLE.k), np.abs(R2) + np.abs(R1 * BUBBLE.k), pressure])


def _many_digits(t: float) -> tuple[float, ...]:
    """R, R', R'' and the pressure from the formula of R alone, its derivatives by the series of its parts."""
    import mpmath as mp

    with mp.workdps(40):
        a, k, m, q, rho = (mp.mpf(v) for v in BUBBLE)
        R = mp.taylor(lambda s: a * (1 + mp.erf(k * (s - m) / mp.sqrt(2))) * mp.log(1 + q * s), mp.mpf(t), 2)
        R0, R1, R2 = R[0], R[1], 2 * R[2]
        return float(R0), float(R1), float(R2), float(rho * R0 * (R0 * R2 + 2 * R1 * R1))


def _collapse_rows() -> Iterator[Row]:
    """With its growth frozen, R = A ln(1 + x/tau), and the peak is at ln(1 + x/tau) = (3 - sqrt 5)/2."""
    frozen = BUBBLE._replace(k=1e-3, m=-1e6)
    L = (3.0 - np.sqrt(5.0)) / 2.0
    factor = L * (2.0 - L) * np.exp(-2.0 * L)  # 0.28790
    size = frozen.density * (2.0 * frozen.a) ** 3 / TAU**2
    minimum = minimize_scalar(
        lambda x: -float(snap_pressure.pressure(-x, frozen)),
        bounds=(0.1 * TAU, TAU),
        method="bounded",
        options={"xatol": 1e-12},
    )
    cost = _cost(lambda: snap_pressure.pressure(-TAU, frozen), 1)
    yield _row(CLOSED, "peak, growth frozen", "1", 1e-9, -minimum.fun / size / factor - 1.0, cost, 1)
    yield _row(CLOSED, "net impulse", "Pa s", 0.0, float(snap_pressure.impulse(0.0, BUBBLE)), cost, 1)
    x, w = snap_pressure.quadrature(BUBBLE, 2e5)
    p = snap_pressure.pressure(-x, BUBBLE)
    cost = _cost(lambda: snap_pressure.pressure(-x, BUBBLE), x.size)
    yield _row(CLOSED, "net impulse, summed", "1", 1e-13, (w @ p) / (w @ np.abs(p)), cost, x.size)


def _spectrum_rows(quick: bool) -> Iterator[Row]:
    """The spectrum by adaptive quadrature of the formula in many digits."""
    import mpmath as mp

    f = np.array([25e3]) if quick else np.array([0.0, 2e3, 25e3, 110e3])
    with mp.workdps(20):
        a, k, m, q, rho = (mp.mpf(v) for v in BUBBLE)

        def flow(t: Any) -> Any:
            """rho R^2 R', whose derivative is the pressure: the spectrum is i 2 pi f times its own."""
            z = k * (t - m) / mp.sqrt(2)
            G, L = mp.erfc(-z), mp.log1p(q * t)
            return rho * (a * G * L) ** 2 * a * (mp.sqrt(2 / mp.pi) * k * mp.exp(-z * z) * L + G * q / (1 + q * t))

        exact = []
        for frequency in f.tolist():
            w = 2 * mp.pi * mp.mpf(frequency)
            edges = [mp.mpf(v) for v in _edges(frequency)]
            exact.append(complex(1j * w * mp.quad(lambda t, w=w: flow(t) * mp.expj(-w * t), edges, maxdegree=6)))
    near = np.linspace(500.0, 4000.0, 500)  # where it is largest
    cost = _cost(lambda: snap_pressure.spectrum(near, BUBBLE), near.size)
    largest = np.abs(snap_pressure.spectrum(near, BUBBLE)).max()
    miss = np.abs(snap_pressure.spectrum(f, BUBBLE) - np.array(exact)).max() / largest
    yield _row("quadrature, 20 digits", "spectrum", "of peak", 1e-11, miss, cost, f.size)


def _edges(frequency: float) -> Floats:
    """Panels of two periods at most, short ones about the collapse."""
    start = snap_pressure.onset(BUBBLE)
    longest = 2.0 / frequency if frequency > 0.0 else 3e-4
    graded = -TAU * np.append(0.0, 2.0 ** np.arange(-2, 20))
    even = np.arange(0.0, start, -min(longest, 3e-4))
    fine = graded[graded > -longest * 0.7]
    joined = np.unique(np.concatenate([fine, even[even < fine.min()], [start]]))
    return np.asarray(joined)
