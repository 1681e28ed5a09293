"""Frames, signs, units and reference levels: stated once, here.

World frame      right-handed, x east, y north, z up; z = 0 is the mean sea surface, water has z < 0; depth = -z.
Body and sonar   x forward (the acoustic axis), y port, z up. A `Pose` maps body to world; orientations are unit
                 quaternions, scalar first (w, x, y, z).
Directions       azimuth = atan2(y, x), port positive; elevation = asin(z), up positive. Pictures are drawn as the
                 sonar looks: port on the left. Heading is the compass heading: clockwise from north.
Units            SI and radians inside. Descriptions accept a text with a unit where people write ("50 deg", "25 kHz").
                 A bare number in a recipe is in the unit that the schema names (`x-unit`), which is SI; but of an
                 angle it is refused, unless it is 0: 90 may be 90 deg or 90 rad. In Python numbers are SI, radians too.
                 Pressure in Pa; levels in dB re 1 uPa; source level in dB re 1 uPa at 1 m.
Time dependence  exp(+i 2 pi f t): a delay tau multiplies a spectrum by exp(-i 2 pi f tau). Spectra are `rfft` spectra.
Instrument       the sample grid, the beam grid and the assumed sound speed belong to the sonar, never to the water.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final

import numpy as np
import numpy.typing as npt
from annotated_types import Ge, Gt, Le
from pydantic import BeforeValidator, GetJsonSchemaHandler, PlainSerializer, ValidationInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import core_schema

Floats = npt.NDArray[np.float64]
"""Float64 array; shapes are given in docstrings and comments as (axis, axis)."""

Complexes = npt.NDArray[np.complex128]
Ints = npt.NDArray[np.int64]
Int32s = npt.NDArray[np.int32]
Bools = npt.NDArray[np.bool_]
Bytes = npt.NDArray[np.uint8]

Progress = Callable[[int, int, int], None]
"""Is told how many frames are done, of how many, and how many failed."""


class Pace:
    """How fast frames are finished, from when the first ones were: these waited for workers, and compiled kernels."""

    def __init__(self) -> None:
        self.first: tuple[float, int] | None = None  # when (s), and how many

    def rate(self, finished: int) -> float | None:
        """Frames per second, None until others than the first are finished, of so many that are by now."""
        now = time.monotonic()
        if self.first is None and finished:
            self.first = now, finished
        began, before = self.first or (now, 0)
        return (finished - before) / max(now - began, 1e-9) if finished > before else None


REFERENCE_PRESSURE: Final = 1e-6  # Pa: levels are dB re 1 uPa
SLOWEST, FASTEST = 100.0, 10e3
"""Sound speeds (m/s) outside are not those of water: another unit, or a mark for "missing"."""

FORMAT_VERSION: Final = "3"
"""Version of the layout of a store."""

ASSUMED_SPEED: Final = "scene.sonar.assumed_sound_speed"
"""Where a recipe has the sound speed that the sonar assumes: the name of its coordinate where it varies."""

PINGS: Final = "its own pings"
"""What targets are seen by where the sonar sends: the `lit_by` of a store."""
NO_TARGET: Final = -1
"""Index of "no target", "no facet": never 0, which is a target."""

LARGEST: Final = 1e15
"""Size of a number in a recipe, in SI units: powers of larger ones overflow."""

UNITS: Final[dict[str, dict[str, float]]] = {
    "m": {"m": 1.0, "km": 1e3, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "ft": 0.3048, "in": 0.0254},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    "Hz": {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6},
    "rad": {"rad": 1.0, "mrad": 1e-3, "deg": np.pi / 180.0},
    "m/s": {"m/s": 1.0, "km/h": 1 / 3.6, "kn": 1852.0 / 3600.0},
    "rad/s": {"rad/s": 1.0, "deg/s": np.pi / 180.0},
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "uPa": 1e-6},
    "dB": {"dB": 1.0},
    "kg/m3": {"kg/m3": 1.0},
    "degC": {"degC": 1.0},
    "psu": {"psu": 1.0},
}
"""Unit texts that each SI unit accepts, and their size in it."""


@dataclass(frozen=True)
class Unit:
    """The SI unit of a number; parses texts such as "25 kHz" into it (BeforeValidator of the types below)."""

    symbol: str

    @property
    def ambiguous(self) -> bool:
        """True where people write another unit than the one inside: a bare number could be either."""
        return self.symbol in ("rad", "rad/s")

    @property
    def _written(self) -> str:
        """The unit that people write."""
        return self.symbol.replace("rad", "deg")

    def validate(self, value: Any, info: ValidationInfo) -> Any:
        """`parse`, where bare numbers are refused in recipes (JSON) that could be of two units.

        The context `resolved` takes them for SI, as recipes in stores were once written. Raises ValueError.
        """
        bare = self.ambiguous and type(value) in (int, float) and value != 0  # a default comes as NumPy's float64
        if bare and info.mode == "json" and not (info.context or {}).get("resolved"):
            raise ValueError(f"{value} could be {value} {self._written} or {value} {self.symbol}: write the unit")
        number = self.parse(value)
        number = bounded(number, f" {self.symbol}") if info.mode == "json" else number
        if self.symbol == "rad" and isinstance(number, int | float) and 4.0 * np.pi < abs(number) < np.inf:
            raise ValueError(f"must be within two turns, not {number:.6g} rad: in Python angles are in radians")
        return number

    def write(self, value: float) -> str | float:
        """The value as a recipe (JSON) holds it: with its unit where a bare number would be refused."""
        return f"{value!r} {self.symbol}" if self.ambiguous and value != 0 else value

    def parse(self, value: Any) -> Any:
        """A number in SI units from a number or from a text with a unit; raises ValueError in one clear line."""
        if isinstance(value, bool):
            raise ValueError(f"must be a number in {self.symbol}, not {str(value).lower()}")
        if isinstance(value, np.generic):
            return value.item()
        if not isinstance(value, str):
            return value
        accepted = UNITS[self.symbol]
        text, _, symbol = value.strip().partition(" ")
        symbol = symbol.strip()
        try:
            number = float(text)
        except ValueError:
            plain = "" if self.ambiguous else f"a number in {self.symbol}, or "
            spaced = f"must be {plain}a text such as '1 {self._written}', with a space"
            raise ValueError(f"{spaced}, not {value[:40]!r}") from None
        if not symbol and not np.isfinite(number):
            raise ValueError(f"must be a finite number, not {text[:40]}")
        if symbol not in accepted:
            raise ValueError(
                (f"has unit '{symbol}'" if symbol else "has no unit") + f"; use one of {', '.join(accepted)}"
            )
        return number * accepted[symbol]

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        number = _bounded(handler(schema)) | {"description": f"in {self.symbol}"}
        if self.ambiguous:
            number = {"const": 0, "description": "0 needs no unit; any other angle does"}
        units = "|".join(UNITS[self.symbol])
        text = {"type": "string", "pattern": rf"^[-+0-9.eE]+ ({units})$", "description": "with a unit"}
        return {"anyOf": [number, text], "x-unit": self.symbol}


_BOUNDS: Final = {"ge": "minimum", "gt": "exclusiveMinimum", "le": "maximum", "lt": "exclusiveMaximum"}


def _bounded(number: JsonSchemaValue) -> JsonSchemaValue:
    """The JSON schema of a number with its bounds in JSON's words: pydantic leaves its own behind a validator."""
    return {_BOUNDS.get(key, key): value for key, value in number.items()}


def _in(symbol: str) -> tuple[Unit, BeforeValidator, PlainSerializer]:
    unit = Unit(symbol)
    return unit, BeforeValidator(unit.validate), PlainSerializer(unit.write, when_used="json")


class _PlainSchema:
    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return _bounded(handler(schema))


def _plain(value: Any, info: ValidationInfo) -> Any:
    if isinstance(value, (bool, str)):
        raise ValueError("must be a plain number")
    value = value.item() if isinstance(value, np.generic) else value
    return bounded(value) if info.mode == "json" else value


def bounded(value: Any, unit: str = "") -> Any:
    """A number of a recipe as it is, and anything else. Raises ValueError for a size that nothing has."""
    if isinstance(value, (int, float)) and LARGEST < abs(value) < np.inf:
        raise ValueError(f"must be at most {LARGEST:g}{unit} in size, not {str(value)[:30]}")
    return value


Metres = Annotated[float, *_in("m")]
Seconds = Annotated[float, *_in("s")]
Hertz = Annotated[float, *_in("Hz")]
Radians = Annotated[float, *_in("rad")]
MetresPerSecond = Annotated[float, *_in("m/s")]
Pascals = Annotated[float, *_in("Pa")]
Decibels = Annotated[float, *_in("dB")]
KilogramsPerCubicMetre = Annotated[float, *_in("kg/m3")]
DegreesCelsius = Annotated[float, *_in("degC")]
PracticalSalinity = Annotated[float, *_in("psu")]
Number = Annotated[float, BeforeValidator(_plain), _PlainSchema()]
"""A dimensionless number."""

PositiveMetres = Annotated[Metres, Gt(0)]
NonNegativeMetres = Annotated[Metres, Ge(0)]
PositiveSeconds = Annotated[Seconds, Gt(0)]
PositiveHertz = Annotated[Hertz, Gt(0)]
PositiveSpeed = Annotated[MetresPerSecond, Gt(0)]
PositiveRadians = Annotated[Radians, Gt(0)]
Latitude = Annotated[Radians, Ge(-0.5 * np.pi), Le(0.5 * np.pi)]
WaterSoundSpeed = Annotated[PositiveSpeed, Ge(SLOWEST), Le(FASTEST)]

Position = tuple[Metres, Metres, Metres]
"""A point (x, y, z) in metres."""


def direction(azimuth: npt.ArrayLike, elevation: npt.ArrayLike) -> Floats:
    """Unit vector(s) (..., xyz) of azimuth and elevation (rad), broadcast together."""
    az, el = np.broadcast_arrays(np.asarray(azimuth, float), np.asarray(elevation, float))
    return np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)], axis=-1)


def azimuth_elevation(vector: npt.ArrayLike) -> tuple[Floats, Floats]:
    """Azimuth and elevation (rad) of vector(s) (..., xyz) of any length, exact near the poles as well."""
    v = np.asarray(vector, float)
    return np.arctan2(v[..., 1], v[..., 0]), np.arctan2(v[..., 2], np.hypot(v[..., 0], v[..., 1]))


def depth(position: npt.ArrayLike) -> Floats:
    """Depth below the mean sea surface (m, positive down) of point(s) (..., xyz) in the world."""
    return -np.asarray(position, float)[..., 2]


def evenly(count: int, limit: int) -> list[int]:
    """At most `limit` of the numbers 0 to count - 1, evenly spread, both ends among them."""
    return sorted({int(n) for n in np.linspace(0, count - 1, min(limit, count)).round()})


def scattered(count: int, among: int, first: float = 0.0) -> Ints:
    """At most `count` of the numbers 0 to among - 1, ascending, spread over all of them without a fixed step: multiples
    of the golden ratio modulo 1, of which the first is `first`."""
    return np.unique((np.mod(np.arange(count) * 0.6180339887498949 + first, 1.0) * among).astype(int))


def counted(number: int, noun: str) -> str:
    """A number of things: "1 frame", "2 frames"."""
    return f"{number} {noun}" + ("" if number == 1 else "s")


def aligned(rows: Sequence[Sequence[str]], words: Iterable[int] = (0,)) -> list[str]:
    """Lines of a table of cells (row, column): columns of `words` are flush left, the others, numbers, flush right."""
    left, columns = frozenset(words), []
    for n, column in enumerate(zip(*rows, strict=True)):
        width = max(map(len, column))
        columns.append([cell.ljust(width) if n in left else cell.rjust(width) for cell in column])
    return ["  ".join(row).rstrip() for row in zip(*columns, strict=True)]


def finite_json(value: Any) -> Any:
    """Plain JSON values, of arrays too: a number that is not finite, which JSON does not have, becomes null."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(name): finite_json(inner) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [finite_json(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def format_bytes(count: float) -> str:
    """A number of bytes as people say it."""
    for unit in ("bytes", "kB", "MB", "GB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} TB"


CONFIDENCE: Final = 1.959964
"""Standard deviations of a band of 95 %."""


def binomial_band(hits: int, trials: int) -> tuple[float, float]:
    """Bounds of the probability, with 95 % confidence. Source: Wilson (1927), JASA 22, 209."""
    if trials == 0:
        return float("nan"), float("nan")
    p, z2 = hits / trials, CONFIDENCE**2
    middle = (p + 0.5 * z2 / trials) / (1.0 + z2 / trials)
    half = CONFIDENCE * np.sqrt(p * (1.0 - p) / trials + 0.25 * z2 / trials**2) / (1.0 + z2 / trials)
    low, high = min(middle - half, p), max(middle + half, p)  # whatever rounds, p is inside
    return float(max(low, 0.0)), float(min(high, 1.0))
