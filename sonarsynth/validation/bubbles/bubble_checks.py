"""Bubbles that collapse, against the equation as it is printed, and published levels.

Keller-Miksis and Rayleigh-Plesset in R and t; published levels; error against run time over the solver's tolerance.
What is conserved, what is refused, and Rayleigh's closed form are in the table of extremes.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Final

import numpy as np

from sonarsynth.conventions import REFERENCE_PRESSURE, Floats
from sonarsynth.equations.bubble import bubble_collapse, bubble_pulse, pulses
from sonarsynth.equations.bubble.bubble_collapse import Cavity, Collapse
from sonarsynth.validation.references.printed_bubble import PrintedBubble, printed_bubble
from sonarsynth.validation.run_time import timed
from sonarsynth.validation.validation_rows import Row

RADIUS, DEPTH = 3.5e-3, 5.0  # m
PRINTED, TABLE = "the printed equation", "table of levels"
TOLERANCE: Final = 1e-9
"""Relative: what the solver's default of 1e-10 is to give."""
LOOSER: Final = (1e-3, 1e-6, 1e-8)
"""Tolerances of the solver, all but its default."""
HERTZ = np.arange(600) * 1e3
"""Frequencies of a period of 1 ms, longer than a snap and its rebound."""
SAMPLES = 1 << 14

LEVELS: Final = {
    100.0: (228.1, 206.9, 202.6),
    300.0: (223.2, 207.2, 203.0),
    1000.0: (215.5, 207.2, 203.4),
    2000.0: (209.8, 206.1, 203.0),
    3000.0: (206.1, 204.5, 202.1),
}
"""Gas (Pa) at 5 m: peak, and peak to peak below 200 and 100 kHz (dB re 1 uPa at 1 m)."""
DEEPER: Final = {(0.0, 1000.0): 209.7, (0.0, 3000.0): 199.1, (20.0, 1000.0): 223.9, (20.0, 3000.0): 216.6}
"""Depth (m) and gas (Pa): peak (dB re 1 uPa at 1 m)."""
HALF_DIGIT: Final = 0.06
"""dB: half a digit of the table, and a little."""


def described(gas: float, depth: float = DEPTH, *, compressible: bool = True, core: bool = False) -> Cavity:
    """The bubble of all cases: 3.5 mm, in water of 20 degC."""
    ambient = bubble_collapse.ambient_pressure(depth)
    h = bubble_collapse.hard_core(RADIUS, gas, ambient) if core else 0.0
    return Cavity(RADIUS, gas, ambient, core=h, compressible=compressible)


@cache
def exact(cavity: Cavity) -> PrintedBubble:
    """A bubble and its rebound by the printed equation, kept."""
    return printed_bubble(cavity)


def solved(cavity: Cavity, tolerance: float = 1e-10) -> tuple[Collapse, float]:
    """A bubble and its rebound as they are solved, and the CPU time that takes (ms)."""
    bubble, seconds = timed(lambda: bubble_collapse.collapse.__wrapped__(cavity, 0, tolerance), 5)
    return bubble, 1e3 * seconds


def row(
    case: str, reference: str, quantity: str, unit: str, expected: float, error: float, cost: float, bubble: Collapse
) -> Row:
    """A row of a solved bubble."""
    counts = {"evaluations": bubble.evaluations}
    return Row(case, reference, quantity, unit, expected, abs(float(error)), cost, "ms a bubble", counts)


def worst(values: tuple[float, ...], expected: tuple[float, ...]) -> float:
    """The largest relative error."""
    return float(np.abs(np.array(values) / expected - 1.0).max())


def equation_rows(quick: bool) -> Iterator[Row]:
    """Collapse and rebound by both equations, and with a hard core."""
    for gas in (1000.0,) if quick else (100.0, 1000.0):
        for equation, compressible in (("Rayleigh-Plesset", False), ("Keller-Miksis", True)):
            yield from printed_rows(f"{equation}, {gas:g} Pa", *solved(described(gas, compressible=compressible)))
        yield from printed_rows(f"Keller-Miksis with a hard core, {gas:g} Pa", *solved(described(gas, core=True)))


def printed_rows(case: str, bubble: Collapse, cost: float) -> Iterator[Row]:
    """Every number of a bubble and its rebound, and the waveform, against the printed equation."""
    best = exact(bubble.cavity)
    (low, high), (first, last) = best.radii, best.times
    again = bubble.largest[0]
    yield row(case, PRINTED, "smallest radius", "1", TOLERANCE, bubble.minimum_radius / low - 1.0, cost, bubble)
    yield row(case, PRINTED, "collapse time", "1", 0.1 * TOLERANCE, bubble.collapse_time / first - 1.0, cost, bubble)
    rebound = (again.time + bubble.collapse_time, again.radius)
    yield row(case, PRINTED, "rebound", "1", TOLERANCE, worst(rebound, (last, high)), cost, bubble)
    pressure = float(bubble_collapse.pressure(0.0, bubble)) / best.pressures[0]
    yield row(case, PRINTED, "pressure at the collapse", "1", 1e-7, pressure - 1.0, cost, bubble)
    expected, own = waveform(exact_spectrum(best)), waveform(spectrum(bubble))
    miss = np.abs(expected - own).max() / np.abs(expected).max()
    yield row(case, PRINTED, "waveform below 200 kHz", "of peak", 1e-8, miss, cost, bubble)


def exact_spectrum(best: PrintedBubble) -> np.ndarray:
    """Spectrum (Pa s) of a bubble and its rebound at HERTZ, from the collapse on: a sum over nodes."""
    time = best.node - best.times[0]
    return np.asarray(np.exp(-2j * np.pi * np.outer(HERTZ, time)) @ (best.weight * best.pressure))


def spectrum(bubble: Collapse) -> np.ndarray:
    """The same of a solved bubble, as snaps have it; its ends are not faded."""
    return pulses.spectrum(HERTZ, bubble_pulse.pulse(bubble, float(HERTZ[-1]), fade=0.0))


def waveform(S: np.ndarray, corner: float = 200e3) -> Floats:
    """Pressure (Pa at 1 m) of a spectrum behind a Butterworth filter of fourth order, forwards and backwards."""
    passed = S / (1.0 + (HERTZ / corner) ** 8)
    return np.asarray(np.fft.irfft(passed, SAMPLES) * SAMPLES * HERTZ[1])


def tolerance_rows(quick: bool) -> Iterator[Row]:
    """Radii and time of a hard collapse (Mach 0.74) over the solver's tolerance, which local errors add up to."""
    best = exact(described(100.0))
    for tolerance in LOOSER[1:2] if quick else LOOSER:
        bubble, cost = solved(described(100.0), tolerance)
        case, bound = f"Keller-Miksis, 100 Pa, tolerance {tolerance:g}", 30.0 * tolerance
        radii = worst((bubble.minimum_radius, bubble.largest[0].radius), best.radii)
        yield row(case, PRINTED, "smallest radius, rebound", "1", bound, radii, cost, bubble)
        yield row(case, PRINTED, "collapse time", "1", bound, bubble.collapse_time / best.times[0] - 1.0, cost, bubble)


def level_rows(quick: bool) -> Iterator[Row]:
    """Peak source levels, before filters and behind them, as tabled."""
    for gas, (raw, *limited) in LEVELS.items():
        bubble, cost = solved(described(gas))
        case = f"Keller-Miksis, {gas:g} Pa"
        yield row(case, TABLE, "peak", "dB", HALF_DIGIT, bubble_pulse.source_level(bubble) - raw, cost, bubble)
        S = spectrum(bubble)
        for corner, level in zip((200.0, 100.0), limited, strict=True):
            peak_to_peak = 20.0 * np.log10(np.ptp(waveform(S, 1e3 * corner)) / REFERENCE_PRESSURE)
            yield row(case, TABLE, f"p-p below {corner:g} kHz", "dB", HALF_DIGIT, peak_to_peak - level, cost, bubble)
    for (depth, gas), level in {} if quick else DEEPER.items():
        bubble, cost = solved(described(gas, depth))
        case = f"Keller-Miksis, {gas:g} Pa at {depth:g} m"
        yield row(case, TABLE, "peak", "dB", HALF_DIGIT, bubble_pulse.source_level(bubble) - level, cost, bubble)
