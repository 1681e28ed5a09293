"""Where each formula of the environment holds, as its authors say, and what is said outside.

A formula outside its range still answers, and warns with `OutOfRange`; within `noted()` it adds to a list instead.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

Bounds = tuple[float, float, str]
"""Least and greatest value, and their unit."""

_notes: ContextVar[list[str] | None] = ContextVar("notes", default=None)


class OutOfRange(UserWarning):
    """A formula was used outside the range that its authors give."""


@contextmanager
def noted() -> Iterator[list[str]]:
    """What formulas say of their ranges goes into the list, each line once, and nothing warns.

    For the thread (or task) that enters it alone. An inner one keeps its notes from an outer one.
    """
    notes: list[str] = []
    token = _notes.set(notes)
    try:
        yield notes
    finally:
        _notes.reset(token)


def say(message: str, stacklevel: int = 2) -> None:
    """Note a line, or warn with it (`OutOfRange`) on behalf of the caller so many frames up."""
    notes = _notes.get()
    if notes is None:
        warnings.warn(message, OutOfRange, stacklevel=stacklevel + 1)
    elif message not in notes:
        notes.append(message)


@dataclass(frozen=True)
class Range:
    """Where a formula holds: the bounds of each of its arguments, both of them in it."""

    formula: str
    bounds: Mapping[str, Bounds]

    def check(self, **values: npt.ArrayLike) -> None:
        """Warn or note, one line a quantity, with the value that is farthest outside. NaN is not outside."""
        for name, given in values.items():
            low, high, unit = self.bounds[name]
            value = np.asarray(given, float)
            outside = (value < low) | (value > high)
            if not np.any(outside):
                continue
            farthest = value.flat[np.argmax(np.where(outside, np.maximum(low - value, value - high), -np.inf))]
            quantity = name.replace("_", " ") if name != "ph" else "pH"
            within = f"{_shown(low, unit)} to {_shown(high, unit)}"
            message = f"{self.formula}: {quantity} {_said(farthest, unit)} is outside {within} {_unit(unit)}"
            say(message.rstrip(), 3)


def _shown(value: float, unit: str) -> str:
    return f"{value / 1e3 if unit == 'Hz' else value:.6g}"


def _unit(unit: str) -> str:
    return "kHz" if unit == "Hz" else unit


def _said(value: float, unit: str) -> str:
    return f"{_shown(value, unit)} {_unit(unit)}".rstrip()


MACKENZIE: Final = Range(
    "Mackenzie (1981)",
    {"temperature": (2.0, 30.0, "degC"), "salinity": (25.0, 40.0, "psu"), "depth": (0.0, 8e3, "m")},
)
MEDWIN: Final = Range(
    "Medwin (1975)", {"temperature": (0.0, 35.0, "degC"), "salinity": (0.0, 45.0, "psu"), "depth": (0.0, 1e3, "m")}
)
CHEN_MILLERO: Final = Range(
    "Chen and Millero (1977)",
    {"temperature": (0.0, 40.0, "degC"), "salinity": (0.0, 40.0, "psu"), "pressure": (0.0, 10e3, "dbar")},
)
DEL_GROSSO: Final = Range(
    "Del Grosso (1974)",
    {"temperature": (0.0, 30.0, "degC"), "salinity": (30.0, 40.0, "psu"), "pressure": (0.0, 9806.65, "dbar")},
)
FOFONOFF_MILLARD: Final = Range("Fofonoff and Millard (1983)", {"pressure": (0.0, 10e3, "dbar")})

FRANCOIS_GARRISON: Final = Range(
    "Francois and Garrison (1982)",
    {
        "frequency": (0.0, 1e6, "Hz"),
        "temperature": (-2.0, 30.0, "degC"),
        "salinity": (30.0, 40.0, "psu"),
        "ph": (7.7, 8.3, ""),
        "depth": (0.0, 10e3, "m"),
    },
)
"""The authors say "all oceanic conditions": the pH is that of Ainslie and McColm. At 10 boric acid absorbs 30 times as
much as at 8.1."""
AINSLIE_MCCOLM: Final = Range(
    "Ainslie and McColm (1998)",
    {
        "frequency": (0.0, 1e6, "Hz"),
        "temperature": (-6.0, 35.0, "degC"),
        "salinity": (5.0, 50.0, "psu"),
        "ph": (7.7, 8.3, ""),
        "depth": (0.0, 7e3, "m"),
    },
)

APL_SEDIMENTS: Final = Range("sediments of APL-UW TR 9407 (1994)", {"frequency": (10e3, 100e3, "Hz")})
FLUID_BED: Final = Range("Rayleigh's bottom without shear waves", {"speed_ratio": (0.0, 1.5, "")})
"""Shear waves matter little in loose sediments (the fastest, moraine, has a speed ratio of 1.3 and shear waves of 600
m/s) and much in chalk (1.6, 1000 m/s) and rock: Jensen et al. (2011), Computational Ocean Acoustics, table 1.3."""
PIERSON_MOSKOWITZ: Final = Range("waves of Pierson and Moskowitz (1964)", {"wind_speed": (10.0, 21.0, "m/s")})
BUBBLE_LOSS: Final = Range("bubble loss of APL-UW TR 9407 (1994)", {"frequency": (10e3, 100e3, "Hz")})
WENZ: Final = Range(
    "Wenz's noise as of Coates (1989)", {"frequency": (1.0, 100e3, "Hz"), "wind_speed": (0.0, 15.0, "m/s")}
)
KNUDSEN: Final = Range("Knudsen's noise", {"frequency": (500.0, 50e3, "Hz"), "sea_state": (0.5, 6.0, "")})
RAIN: Final = Range("noise of rain of Ma et al. (2005)", {"frequency": (1e3, 50e3, "Hz"), "rate": (2.0, 200.0, "mm/h")})
