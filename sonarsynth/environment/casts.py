"""Sound-speed profiles from their descriptions, a CTD cast in a file among them."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import FASTEST, SLOWEST, Floats
from sonarsynth.description import named_files
from sonarsynth.environment.cast_files import CastError, Column, Table, read_table
from sonarsynth.environment.hydrography import another_unit, sea_water_speed
from sonarsynth.environment.profiles import nearest
from sonarsynth.environment.sound_speed import (
    Cast,
    Catenary,
    Isovelocity,
    Linear,
    Munk,
    Profile,
    SoundSpeed,
    Tabulated,
    TemperatureSalinity,
    Thermocline,
)
from sonarsynth.equations.water.formula_ranges import noted
from sonarsynth.equations.water.seawater import depth_of_pressure

__all__ = ["CastError", "profile_of", "smoothed"]

LATITUDE = 45.0
"""Degrees, where nothing says."""

PLAUSIBLE = {
    "depth": (0.0, 12e3, "m"),
    "pressure": (0.0, 12e3, "dbar"),
    "temperature": (-5.0, 50.0, "degC"),
    "salinity": (0.0, 50.0, "psu"),
    "sound speed": (SLOWEST, FASTEST, "m/s"),
}
"""A value outside is a mark for "missing" (-9999), a wrong unit or a wrong sign; it is refused."""

MOST_LAYERS = 100_000


def profile_of(sound_speed: SoundSpeed) -> Profile:
    """The profile that rays are traced through: every node as it is, nothing thinned, nothing smoothed but on request.

    A cast is read from its path (relative to the working directory) and kept until the file changes; a cast that was
    taken on the way up is turned over. Formulas out of their range are in the profile's notes: nothing warns. Raises
    `CastError` in one line that names file, line and column, ImportError where a formula needs what is not installed.
    """
    if isinstance(sound_speed, Cast):
        try:
            return _profile_of(sound_speed, named_files.stamp(sound_speed.path))
        except named_files.FileError as error:
            raise CastError(f"{sound_speed.path}: {error}") from None
    return _profile_of(sound_speed, None)


@lru_cache(maxsize=64)
def _profile_of(sound_speed: SoundSpeed, stamp: tuple[int, int] | None) -> Profile:
    match sound_speed:
        case Isovelocity():
            return _profile([0.0], [sound_speed.speed])
        case Tabulated():
            return _profile(sound_speed.depth, sound_speed.speed)
        case TemperatureSalinity():
            water = (sound_speed.temperature, sound_speed.salinity, sound_speed.depth)
            return _profile(sound_speed.depth, *sea_water_speed(sound_speed.formula, *water, *_place(sound_speed)))
        case Linear() | Thermocline() | Munk() | Catenary():
            return _profile(*sound_speed.nodes)
        case Cast():
            return _cast_profile(sound_speed, read_table(Path(sound_speed.path)))


def _profile(depth: npt.ArrayLike, speed: npt.ArrayLike, notes: tuple[str, ...] = ()) -> Profile:
    nodes = (np.array(depth, float), np.array(speed, float))
    for node in nodes:
        node.flags.writeable = False
    return Profile(*nodes, notes)


def _place(where: TemperatureSalinity | Cast, table: Table | None = None) -> tuple[float, float | None]:
    """Latitude and longitude in degrees, as they are written, else as the file says, else 45 degrees and None."""
    latitude, longitude = (None, None) if table is None else (table.latitude, table.longitude)
    latitude = latitude if where.latitude is None else float(np.degrees(where.latitude))
    longitude = longitude if where.longitude is None else float(np.degrees(where.longitude))
    return LATITUDE if latitude is None else latitude, longitude


def _cast_profile(cast: Cast, table: Table) -> Profile:
    place = _place(cast, table)
    with noted() as notes:
        depth = _depth(table, place[0])
    order = slice(None, None, -1) if depth[0] > depth[-1] else slice(None)
    step = np.diff(depth[order])
    if np.any(step < 0):
        rows = range(len(depth))[order]
        turn = rows[int(np.argmax(step < 0)) + 1]
        raise CastError(
            f"{table.path}, line {table.lines[turn]}: the depth {depth[turn]:g} m turns back; "
            "a cast goes one way, down or up"
        )
    speed, more = _speed(cast, table, depth, place)
    profile = _profile(depth[order], speed[order], (*notes, *more))
    return profile if cast.smoothing is None else smoothed(profile, cast.smoothing)


def smoothed(profile: Profile, thickness: float) -> Profile:
    """The profile in even layers of at most a thickness (m), nearest to it in the mean square over its depths.

    A linear profile stays as it is; the mean of any other stays. Noise between the nodes of the profile that is white
    and much finer than the layers goes down by about the square root of how many nodes there are in a layer. Raises
    ValueError for more than 100 000 layers.
    """
    extent = profile.depth[-1] - profile.depth[0]
    if extent == 0.0:
        return profile
    if extent > MOST_LAYERS * thickness:
        raise ValueError(f"smoothing: layers of {thickness:g} m over {extent:g} m are more than {MOST_LAYERS}")
    node = np.linspace(profile.depth[0], profile.depth[-1], int(np.ceil(extent / thickness * (1 - 1e-12))) + 1)
    return _profile(node, nearest(node, np.union1d(node, profile.depth), profile.at), profile.notes)


def _depth(table: Table, latitude: float) -> Floats:
    if (column := table.find("depth")) is not None:
        return _values(table, column)
    if (column := table.find("pressure")) is not None:
        return depth_of_pressure(_values(table, column), latitude)
    raise CastError(f"{table.path}, line {table.header}: no column of depth or pressure among {table.names}")


def _speed(
    cast: Cast, table: Table, depth: Floats, place: tuple[float, float | None]
) -> tuple[Floats, tuple[str, ...]]:
    own = table.find("sound speed")
    temperature, salinity = table.find("temperature"), table.find("salinity")
    if own is not None and cast.quantity != "temperature_salinity":
        unused = f"formula {cast.formula} is not used: the file has a sound speed, '{own.name}', of its own"
        return _values(table, own), (unused,) if cast.formula != "mackenzie" else ()
    if cast.quantity == "sound_speed":
        raise CastError(f"{table.path}, line {table.header}: no column of sound speed among {table.names}")
    if temperature is None or salinity is None:
        what = (
            "temperature and salinity"
            if cast.quantity == "temperature_salinity"
            else "sound speed, or of temperature and salinity,"
        )
        raise CastError(f"{table.path}, line {table.header}: no columns of {what} among {table.names}")
    return sea_water_speed(cast.formula, _values(table, temperature), _values(table, salinity), depth, *place)


def _values(table: Table, column: Column) -> Floats:
    """The values of a column in our units, each within what is plausible."""
    values = table.values(column)
    low, high, unit = PLAUSIBLE[column.quantity]
    wrong = ~((values >= low) & (values <= high))
    if np.any(wrong):
        row = int(np.argmax(wrong))
        raise CastError(
            f"{table.path}, line {table.lines[row]}, column '{column.name}': "
            f"{values[row]:g} {unit} is not a {column.quantity} between {low:g} and {high:g} {unit}"
            + (another_unit(float(values[row])) if column.quantity == "temperature" else "")
        )
    return values
