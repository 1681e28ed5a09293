"""Bubbles where they are extreme: each is solved, and right, or refused with the reason; the rows say which."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from sonarsynth.sources.snap_models import KellerMiksis
from sonarsynth.validation.bubbles.bubble_checks import SERIES, exact, row, series_rows, solved
from sonarsynth.validation.validation_rows import Row

GASES: Final = (1.0, 10.0, 100.0, 1000.0, 10e3)  # Pa
DEPTHS: Final = (0.0, 10.0, 100.0, 1000.0)  # m
HIGHEST = 110e3  # Hz, of the pulse that a described snap is asked for
OF = "ms a bubble"


def extreme_rows(quick: bool) -> Iterator[Row]:
    """Gas from next to nothing to a tenth of an atmosphere, from the surface down to 1 km."""
    for gas in GASES[::3] if quick else GASES:
        for depth in DEPTHS[::3] if quick else DEPTHS:
            yield from _solved_or_refused(gas, depth)


def verdict(model: KellerMiksis, depth: float) -> str:
    """Why a described snap is refused at a depth (m), in one line; nothing for one that is solved."""
    try:
        pulse = model.pulse(depth, HIGHEST)
    except ValueError as error:
        return str(error)
    return "" if np.isfinite(pulse.strength).all() and np.isfinite(pulse.peak) else "its pulse is not finite, unsaid"


def _solved_or_refused(gas: float, depth: float) -> Iterator[Row]:
    """The snap's verdict against the wall speed of the series; and what was solved, whether refused or not."""
    model = KellerMiksis(gas_pressure=gas)
    of = model.cavity(depth)
    bubble, cost = solved(of)
    best = exact(of)
    case = f"Keller-Miksis, {gas:g} Pa at {depth:g} m"
    mach = best.fastest / of.sound_speed
    refusal = verdict(model, depth)
    note = f"refused: {refusal}" if refusal else f"solved, Mach {mach:.2g}"
    right = (mach > model.largest_mach) == ("largest_mach" in refusal) and (refusal == "" or "largest_mach" in refusal)
    counts = {"evaluations": bubble.evaluations}
    yield Row(case, SERIES, "verdict", "wrong", 0.0, float(not right), cost, OF, counts, None, note)
    yield row(case, SERIES, "largest wall speed", "1", 1e-3, bubble.mach / mach - 1.0, cost, bubble)
    yield from series_rows(case, bubble, cost)
