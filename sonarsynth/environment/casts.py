"""Sound-speed profiles from their descriptions, a CTD cast in a file among them."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats
from sonarsynth.description import named_files
from sonarsynth.environment.down_cast import PLAUSIBLE, Selection, averaged, left_out, select
from sonarsynth.environment.hydrography import SpeedFormula, sea_water_speed
from sonarsynth.environment.profiles import nearest
from sonarsynth.environment.readers import READ, CastError, CastTable, called, files_of, read_cast
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
from sonarsynth.equations.water.seawater import depth_of_pressure, practical_salinity, pressure_of_depth

__all__ = ["CastError", "profile_of", "smoothed"]

AMBIGUOUS = 10.0
"""mS/cm: below, a conductivity may be one in S/m; no water has 10 S/m."""
LATITUDE = 45.0
"""Degrees, where nothing says."""

ALIKE: Final = 0.3
"""m/s: formulas of sound speed differ by no more."""
OWN_FORMULAS: Final[tuple[SpeedFormula, ...]] = ("chen_millero", "del_grosso", "mackenzie", "medwin")
"""With which a file's own sound speed is compared."""

MOST_LAYERS = 100_000


def profile_of(sound_speed: SoundSpeed) -> Profile:
    """The profile that rays are traced through: every node as it is, nothing thinned, nothing smoothed but on request.

    A cast is read from its path (relative to the working directory) and kept until the file changes; what is left out
    of it is in the notes (`down_cast`). Formulas out of their range are in the profile's notes: nothing warns. Raises
    `CastError` in one line that names file, line and column, ImportError where a formula needs what is not installed.
    """
    if isinstance(sound_speed, Cast):
        with named_files.errors_as(CastError, sound_speed.path):
            return _profile_of(sound_speed, tuple(map(named_files.stamp, files_of(Path(sound_speed.path)))))
    return _profile_of(sound_speed, None)


def profile_above(sound_speed: SoundSpeed, bottom: float) -> Profile:
    """As `profile_of`, of water that a bottom (m) ends: no sound goes to nodes below, and formulas go on to depths and
    speeds that no water has."""
    return _above(profile_of(sound_speed), bottom)


@lru_cache(maxsize=64)
def _above(profile: Profile, bottom: float) -> Profile:
    if profile.depth[-1] <= bottom:
        return profile
    count = int(np.searchsorted(profile.depth, bottom, side="left"))
    last = profile.speed[count] if profile.depth[count] == bottom else profile.at(bottom)
    return _profile(np.append(profile.depth[:count], bottom), np.append(profile.speed[:count], last), profile.notes)


@lru_cache(maxsize=64)
def _profile_of(sound_speed: SoundSpeed, stamps: tuple[tuple[int, int], ...] | None) -> Profile:
    match sound_speed:
        case Isovelocity():
            return _profile([0.0], [sound_speed.speed])
        case Tabulated():
            return _profile(sound_speed.depth, sound_speed.speed)
        case TemperatureSalinity():
            water = (sound_speed.temperature, sound_speed.salinity, sound_speed.depth)
            return _profile(sound_speed.depth, *sea_water_speed(sound_speed.formula, *water, *_site(sound_speed)))
        case Linear() | Thermocline() | Munk() | Catenary():
            return _profile(*sound_speed.nodes)
        case Cast():
            return _cast_profile(sound_speed)


def _profile(depth: npt.ArrayLike, speed: npt.ArrayLike, notes: tuple[str, ...] = ()) -> Profile:
    nodes = (np.array(depth, float), np.array(speed, float))
    for node in nodes:
        node.flags.writeable = False
    return Profile(*nodes, notes)


def _site(source: TemperatureSalinity | Cast, table: CastTable | None = None) -> tuple[float, float | None]:
    """Latitude and longitude in degrees, as they are written, else as the file says, else 45 degrees and None."""
    latitude, longitude = (None, None) if table is None else (table.latitude, table.longitude)
    latitude = latitude if source.latitude is None else float(np.degrees(source.latitude))
    longitude = longitude if source.longitude is None else float(np.degrees(source.longitude))
    return LATITUDE if latitude is None else latitude, longitude


def _cast_profile(cast: Cast) -> Profile:
    """The profile of a file: read, its rows selected, with notes of what was done."""
    own_place = [None if angle is None else float(np.degrees(angle)) for angle in (cast.latitude, cast.longitude)]
    table = read_cast(Path(cast.path), cast.profile, *own_place)
    salt = table.columns.get("salinity")
    if cast.salinity is not None and salt is not None and not np.isfinite(salt.values).any():  # its sensor failed
        table = replace(table, columns={name: column for name, column in table.columns.items() if name != "salinity"})
    site = _site(cast, table)
    water = {name: column.values for name, column in table.columns.items()}
    if "sound speed" in water:
        water["sound speed"] = np.where(water["sound speed"] == 0.0, np.nan, water["sound speed"])  # out of the water
    needed = _needed(cast, table)
    with noted() as notes, np.errstate(invalid="ignore"):
        depth = water["depth"] if "depth" in needed else depth_of_pressure(np.maximum(water["pressure"], 0.0), site[0])
    if "pressure" in needed:
        depth = np.where(water["pressure"] < 0.0, water["pressure"], depth)  # in the air
    selection = select(table, {name: water[name] for name in needed if name in water}, depth)
    water = {name: values[selection.rows] for name, values in water.items()}
    z = depth[selection.rows]
    if "sound speed" not in needed and "salinity" not in water:
        water["salinity"] = _salinity(cast, water, z, site[0])
    if "sound speed" in needed:
        speed = water["sound speed"]
        lines = _unused(cast, table)
    else:
        speed, lines = sea_water_speed(cast.formula, water["temperature"], water["salinity"], z, *site)
    lines = (*notes, *lines, *table.notes, *_selection(table, selection, z), *_comparison(water, z, site))
    profile = _profile(*averaged(z, speed), lines)
    return profile if cast.smoothing is None else smoothed(profile, cast.smoothing)


def _needed(cast: Cast, table: CastTable) -> tuple[str, ...]:
    """The quantities that a row must have: depth or pressure, and sound speed or what makes it. Raises CastError."""
    has = table.columns
    level = next((name for name in ("depth", "pressure") if name in has), None)
    if level is None:
        line = f"{table.where()}: no column of depth or pressure among {table.shown_names}"
        raise CastError(f"{line}; read are {READ}{called('depth', 'pressure')}")
    usable = "sound speed" in has and np.isfinite(has["sound speed"].values).any()
    if usable and cast.quantity != "temperature_salinity":
        return level, "sound speed"
    if cast.quantity == "sound_speed":
        raise CastError(f"{table.where()}: no column of sound speed among {table.shown_names}{called('sound speed')}")
    if "temperature" in has and ("salinity" in has or cast.salinity is not None):
        return level, "temperature", *(("salinity",) if "salinity" in has else ())
    if "temperature" in has and "conductivity" in has:
        _check_unit(table)
        return level, "temperature", "conductivity"
    missing = "" if cast.quantity == "temperature_salinity" else "sound speed, or of "
    comma = "," if missing else ""
    wanted = called("sound speed" if missing else "temperature")
    hint = "; give the `salinity`" if "temperature" in has else wanted
    raise CastError(
        f"{table.where()}: no columns of {missing}temperature and salinity{comma} among {table.shown_names}{hint}"
    )


def _check_unit(table: CastTable) -> None:
    """Refuses a conductivity without a unit that may be in S/m: no sea water has so little in mS/cm, none so much."""
    column = table.columns["conductivity"]
    if not column.unit_stated and np.nanmax(column.values, initial=0.0) < AMBIGUOUS:
        line = f"{table.where()}, column '{column.name}': has no unit, and could be in S/m"
        raise CastError(f"{line}; write it as in 'conductivity (mS/cm)'")


def _salinity(cast: Cast, water: dict[str, Floats], depth: Floats, latitude: float) -> Floats:
    """Practical salinity (row,) where the file has no column of it: as given, or by the conductivity."""
    if cast.salinity is not None:
        return np.full(len(depth), cast.salinity)
    standard = pressure_of_depth(depth, latitude)
    pressure = water.get("pressure", standard)
    salinity = practical_salinity(
        water["conductivity"], water["temperature"], np.where(np.isfinite(pressure), pressure, standard)
    )
    return np.where(water["conductivity"] > 0.0, salinity, 0.0)


def _unused(cast: Cast, table: CastTable) -> tuple[str, ...]:
    """A note where a formula was asked for that the file does not need."""
    own = table.columns["sound speed"].name
    unused = f"formula {cast.formula} is not used: the file has a sound speed, '{own}', of its own"
    return (unused,) if cast.formula != "mackenzie" else ()


def _selection(table: CastTable, selection: Selection, depth: Floats) -> tuple[str, ...]:
    """One note of what was left out of a cast, and of rows at one depth (m); none where all is used as it is."""
    alike = len(depth) - len(np.unique(depth))
    if not selection.left_out and not alike:
        return ()
    direction = ", taken on the way up" if selection.upward else ""
    less = f"; left out: {left_out(selection)}" if selection.left_out else ""
    mean = f"; {alike} at the depth of another are averaged with it" if alike else ""
    return (f"cast ({table.layout}): {len(selection.rows)} of {len(table.lines)} rows used{direction}{less}{mean}",)


def _comparison(water: dict[str, Floats], depth: Floats, site: tuple[float, float | None]) -> tuple[str, ...]:
    """A note of how far the file's own sound speed is from that of its temperature and salinity."""
    if not {"sound speed", "temperature", "salinity"} <= set(water):
        return ()
    good = np.all([np.isfinite(water[name]) for name in ("sound speed", "temperature", "salinity")], axis=0)
    with np.errstate(invalid="ignore"):
        good &= (water["temperature"] > -3.0) & (water["temperature"] < 45.0)
        good &= (water["salinity"] >= 0.0) & (water["salinity"] <= PLAUSIBLE["salinity"][1])
    if not good.any() or not water["salinity"][good].any():
        return ()
    off = {}
    for formula in OWN_FORMULAS:
        ours = sea_water_speed(formula, water["temperature"][good], water["salinity"][good], depth[good], *site)[0]
        off[formula] = float(np.abs(water["sound speed"][good] - ours).max())
    best = min(off, key=lambda formula: off[formula])
    verdict = "is within" if off[best] < ALIKE else "differs by up to"
    by = "of" if off[best] < ALIKE else "from"
    return (
        f"the file's own sound speed {verdict} {off[best]:.2g} m/s {by} that of {best} by its temperature and salinity",
    )


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
