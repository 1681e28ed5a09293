"""Temperature, salinity and place as people write them, and the sound speed that follows."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal, get_args

import numpy as np
import numpy.typing as npt
from annotated_types import Ge, Le
from pydantic import BeforeValidator

from sonarsynth.conventions import DegreesCelsius, Floats, PracticalSalinity, Radians
from sonarsynth.equations.water import seawater
from sonarsynth.equations.water.formula_ranges import noted

COLDEST: Final = -5.0
HOTTEST: Final = 60.0
"""Temperatures (degC) outside are not those of water that sound goes through."""


def another_unit(temperature: float) -> str:
    """What a temperature (degC) that is too high may be instead, for messages; empty where there is no guess."""
    kelvin, fahrenheit = temperature - 273.15, (temperature - 32.0) / 1.8
    guesses = {"kelvin": kelvin, "degrees Fahrenheit": fahrenheit} if temperature > 50.0 else {}
    likely = [f"{value:.4g} degC if it is in {unit}" for unit, value in guesses.items() if COLDEST <= value <= 45.0]
    return f" ({' or '.join(likely)})" if likely else ""


def _in_celsius(value: Any) -> Any:
    """Refuses a temperature that is too high for water, and says what it may be."""
    if isinstance(value, (int, float)) and not isinstance(value, bool) and value > HOTTEST and another_unit(value):
        raise ValueError(f"must be at most {HOTTEST:g} degC, not {value:g}{another_unit(value)}")
    return value


WaterTemperature = Annotated[DegreesCelsius, Ge(COLDEST), Le(HOTTEST), BeforeValidator(_in_celsius)]
WaterSalinity = Annotated[PracticalSalinity, Ge(0), Le(100)]
Longitude = Annotated[Radians, Ge(-np.pi), Le(2.0 * np.pi)]

SpeedFormula = Literal["mackenzie", "medwin", "chen_millero", "del_grosso", "teos10"]
"""Sound speed of sea water: Mackenzie (1981), Medwin (1975), Chen and Millero (1977: that of UNESCO), Del Grosso
(1974), or the equation of state of 2010, which needs gsw (`pip install 'sonarsynth[teos10]'`)."""


def sea_water_speed(
    formula: SpeedFormula,
    temperature: npt.ArrayLike,
    salinity: npt.ArrayLike,
    depth: npt.ArrayLike,
    latitude: float,
    longitude: float | None,
) -> tuple[Floats, tuple[str, ...]]:
    """Sound speed (m/s), and where the formula is out of its range: one line each, with formulas that hold instead.

    Temperature (degC, scale of 1990), practical salinity and depth (m) broadcast; the place is in degrees. Raises
    ImportError where the formula needs what is not installed.
    """
    water = (temperature, salinity, depth, latitude, longitude)
    with noted() as notes:
        speed = _speed(formula, *water)
    if not notes:
        return speed, ()
    better = [candidate for candidate in get_args(SpeedFormula) if candidate != formula and _holds(candidate, *water)]
    hint = f"; {', '.join(better)} {'hold' if len(better) > 1 else 'holds'} there" if better else ""
    return speed, tuple(note + hint for note in notes)


def _speed(
    formula: SpeedFormula,
    temperature: npt.ArrayLike,
    salinity: npt.ArrayLike,
    depth: npt.ArrayLike,
    latitude: float,
    longitude: float | None,
) -> Floats:
    match formula:
        case "mackenzie":
            return seawater.mackenzie(temperature, salinity, depth)
        case "medwin":
            return seawater.medwin(temperature, salinity, depth)
        case "chen_millero":
            scale_of_1968 = 1.00024 * np.asarray(temperature, float)
            return seawater.chen_millero(scale_of_1968, salinity, seawater.pressure_of_depth(depth, latitude))
        case "del_grosso":
            return seawater.del_grosso(temperature, salinity, seawater.pressure_of_depth(depth, latitude))
        case "teos10":
            return seawater.teos10(temperature, salinity, depth, latitude, longitude)


def _holds(formula: SpeedFormula, *water: Any) -> bool:
    """Whether a formula is in its range, and installed."""
    with noted() as notes:
        try:
            _speed(formula, *water)
        except ImportError:
            return False
    return not notes
