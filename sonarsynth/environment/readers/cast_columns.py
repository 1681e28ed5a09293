"""The names of columns and the units of a cast: one table for all makes of instruments."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

import numpy as np

from sonarsynth.conventions import Floats

NAMES: Final = {
    "depth": ("depth", "dep", "depsm", "depfm", "depth below surface", "depth below sea surface"),
    "pressure": (
        "pressure", "pres", "press", "p", "sea pressure", "sea water pressure", "pr", "prm", "prdm", "prde", "prsm",
        "presure", "pres adjusted",
    ),
    "temperature": (
        "temperature", "temp", "tempe", "t", "water temperature", "sea water temperature", "in situ temperature",
        "tempct", "temperaturect", "t an", "temp adjusted",
    ),
    "salinity": (
        "salinity", "sal", "salin", "s", "psal", "practical salinity", "sea water practical salinity",
        "sea water salinity", "calc salinity", "s an", "psal adjusted",
    ),
    "conductivity": ("conductivity", "cond", "conduct", "c", "sea water electrical conductivity"),
    "sound speed": (
        "sound speed", "sound velocity", "speed of sound", "soundspeed", "soundvelocity", "ssp", "sv", "svel", "s vel",
        "c", "sound", "velocity", "veloc", "vel", "sos", "calc sos", "calc sv", "calc sound velocity",
        "speed of sound in sea water",
    ),
}  # fmt: skip
"""Names of columns, in lower case, with spaces for underscores, points and what follows a comma."""

SEA_BIRD: Final = (
    (r"dep[sf]m", "depth", "m"),
    (r"dep[sf]f", "depth", "ft"),
    (r"pr(d?m|sm|50m\d?)", "pressure", "dbar"),
    (r"prd?e", "pressure", "psi"),
    (r"t(v\d|n[ct]?\d?)?\d{0,2}90c", "temperature", "its-90"),
    (r"t(v\d|n[ct]?\d?)?\d{0,2}68c", "temperature", "its-68"),
    (r"sal\d\d", "salinity", "psu"),
    (r"c_?\d?s/m", "conductivity", "s/m"),
    (r"c_?\d?ms/cm", "conductivity", "ms/cm"),
    (r"c_?\d?us/cm", "conductivity", "us/cm"),
    (r"sv[cdw]m\d?", "sound speed", "m/s"),
    (r"sv[cdw]f\d?", "sound speed", "ft/s"),
)
"""Short names of Sea-Bird (manual of SBE Data Processing, appendix VI) that stand without a unit in bottle files."""

SCALE_OF_1968: Final = 1.0 / 1.00024
"""What brings a temperature on the scale of 1968 to that of 1990 (Saunders 1990, WOCE Newsletter 10)."""

UNITS: Final[dict[str, dict[tuple[str, ...], tuple[float, float]]]] = {
    "depth": {
        ("m", "meter", "meters", "metre", "metres", "salt water", "fresh water"): (1.0, 0.0),
        ("ft", "feet", "foot"): (0.3048, 0.0),
    },
    "pressure": {
        ("dbar", "db", "decibar", "decibars", "dbars"): (1.0, 0.0),
        ("bar",): (10.0, 0.0),
        ("kpa",): (0.1, 0.0),
        ("mpa",): (100.0, 0.0),
        ("psi",): (0.6894757, 0.0),
        ("psia",): (0.6894757, -10.1325),  # that of the air with it
    },
    "temperature": {
        ("c", "degc", "deg c", "degrees c", "°c", "º c", "ºc", "?c", "celsius", "degree celsius", "degrees celsius",
         "its-90", "degree celcius", "\ufffdc", "deg", "degree c"): (1.0, 0.0),
        ("its-68", "ipts-68", "its68", "ipts68"): (SCALE_OF_1968, 0.0),
        ("k", "kelvin"): (1.0, -273.15),
        ("f", "degf", "deg f", "°f", "fahrenheit"): (5 / 9, -160 / 9),
    },
    "salinity": {
        ("psu", "pss", "pss-78", "practical salinity scale", "practical salinity", "1", "ppt", "o/oo", "psal", "‰",
         "1e-3", "g/kg"): (1.0, 0.0),
    },
    "conductivity": {
        ("ms/cm", "mmho/cm", "mmhos/cm", "millisiemens/cm"): (1.0, 0.0),
        ("s/m", "siemens/m", "mho/m"): (10.0, 0.0),
        ("ms/m",): (1e-2, 0.0),
        ("us/cm", "microsiemens per centimeter", "µs/cm", "microsiemens/cm"): (1e-3, 0.0),
    },
    "sound speed": {
        ("m/s", "ms-1", "m s-1", "m/sec", "m.s-1", "meters per second", "metres per second", "meter per second",
         "chen-millero", "delgrosso", "wilson"): (1.0, 0.0),
        ("ft/s", "ft/sec", "feet per second"): (0.3048, 0.0),
        ("km/s",): (1000.0, 0.0),
    },
}  # fmt: skip
"""Units in lower case, with the factor and the offset that bring them to m, dbar, degC, psu, mS/cm and m/s."""

SCALES: Final = ("its-90", "its-68", "ipts-68", "its68", "ipts68", "salt water", "fresh water")
"""What a unit is of, where it stands beside it."""
NO_UNITS: Final = ("", "calculated", "calc", "float", "measured")


class UnitError(ValueError):
    """A column of a known quantity in an unknown unit; str() says so."""


@dataclass(frozen=True)
class Meaning:
    """What a column holds: its quantity, and what brings its numbers to our unit."""

    quantity: str
    factor: float
    offset: float
    stated: bool = True  # its unit, rather than taken for ours

    def ours(self, values: Floats) -> Floats:
        """Values in m, dbar, degC (scale of 1990), psu, mS/cm or m/s."""
        return np.asarray(values * self.factor + self.offset)


def meaning(column: str, unit: str | None = None) -> Meaning | None:
    """What a column holds by its name, which may bear its unit; None where it is none of a cast.

    unit: written elsewhere (a line of units); left out: as the name says, else ours. Raises UnitError.
    """
    name, own = split(column)
    stated = own if unit is None or not unit.strip() else _clean_unit(unit)
    for pattern, quantity, short_unit in SEA_BIRD:
        if re.fullmatch(pattern, column.strip().lower()):
            return Meaning(quantity, *_conversion(quantity, short_unit, column))
    candidates = [quantity for quantity, names in NAMES.items() if name in names]
    if not candidates:
        return None
    fitting = [q for q in candidates if stated is not None and knows_unit(q, stated)]
    if fitting:
        return Meaning(fitting[0], *_conversion(fitting[0], str(stated), column))
    quantity = candidates[-1]  # 'c' without a unit is the sound speed
    return Meaning(quantity, *_conversion(quantity, stated, column), stated=stated is not None)


def called(*quantities: str) -> str:
    """What columns of some quantities are called, for messages."""
    return "".join(f"; a {quantity} may be called {', '.join(NAMES[quantity][:7])}" for quantity in quantities)


def is_unit(text: str) -> bool:
    """Whether a text is one of the units, of any quantity."""
    return any(knows_unit(quantity, _clean_unit(text)) for quantity in UNITS)


def split(column: str) -> tuple[str, str | None]:
    """Name and unit of a column: the unit in brackets, after a semicolon, or after the last underscore or space."""
    text = re.sub(r"\s+", " ", column.strip().strip('"').lower())
    text = re.sub(r"[ _]m[ _](?:per[ _])?s$", "_m/s", text)
    text, _, after = text.partition(";")
    bracketed = re.fullmatch(r"([^(\[]*?)\s*[(\[](.*?)[)\]].*", text)
    if bracketed:
        text = bracketed[1]
    unit = after if after.strip() else bracketed[2] if bracketed else None
    name, _, remark = text.partition(",")  # 'Temperature, ITS-90', 'Pressure, Digiquartz'
    if unit is not None:
        also = f", {remark}" if "68" in remark else ""
        return _plain(name), _clean_unit(unit + also)
    stem, _, last = name.strip().replace(" ", "_").rpartition("_")
    if stem and any(last in texts for units in UNITS.values() for texts in units):
        return _plain(stem), last
    return _plain(name), None


def _plain(name: str) -> str:
    return re.sub(r"[\s_.]+", " ", name).strip()


def _clean_unit(text: str) -> str | None:
    """A unit as it is in the table; of several words between commas that which is no scale ('ITS-90, deg F')."""
    plain = re.sub(r"\s+", " ", text.replace("_", " ").strip(" ()[]").lower())
    if plain in NO_UNITS:
        return None
    words = [word.strip() for word in re.split(r"[,;]", plain)]
    scale = next((word for word in words if "68" in word), None)
    units = [word for word in words if any(knows_unit(quantity, word) for quantity in UNITS)]
    unit = next((word for word in reversed(units) if word not in SCALES), units[-1] if units else plain)
    celsius = next(iter(UNITS["temperature"]))
    return scale if scale and knows_unit("temperature", scale) and unit in (scale, *celsius) else unit


def knows_unit(quantity: str, unit: str | None) -> bool:
    """Whether a unit is one of a quantity's."""
    return any(unit in texts for texts in UNITS[quantity])


def _conversion(quantity: str, unit: str | None, column: str) -> tuple[float, float]:
    for texts, numbers in UNITS[quantity].items():
        if unit is None or unit in texts:  # no unit: ours, which comes first
            return numbers
    allowed = ", ".join(texts[0] for texts in UNITS[quantity])
    raise UnitError(f"column '{column}': unit '{unit}' is not one of {allowed}")
