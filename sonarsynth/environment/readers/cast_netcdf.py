"""Casts in netCDF: Argo profiles, World Ocean Atlas and other grids, Turo and ERDDAP, by names and standard names.

Classic netCDF (3) needs nothing more; netCDF 4 needs h5netcdf (`pip install 'sonarsynth[netcdf]'`).
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.description import named_files
from sonarsynth.description.file_formats import netcdf_files
from sonarsynth.environment.readers.cast_columns import Meaning, UnitError, meaning
from sonarsynth.environment.readers.cast_table import MAX_ROWS, CastError, CastTable, Column, without_flags

if TYPE_CHECKING:
    import xarray as xr

GOOD_FLAGS: Final = b"1258"
"""Quality flags of Argo that mean good, probably good, changed and estimated (Argo user's manual, table 2)."""
LEVELS: Final = ("n_levels", "depth", "z", "level", "row", "obs", "pres", "pressure", "lev")
PLACES: Final = ("latitude", "longitude", "lat", "lon")


def read_netcdf(
    path: Path, data: bytes, profile: int | None, latitude: float | None, longitude: float | None
) -> CastTable:
    """A cast; of several the `profile`-th (from 0; left out: the first), of a grid the nearest to a place (degrees).

    Raises CastError.
    """
    with named_files.errors_as(CastError, path), netcdf_files.netcdf(data, CastError) as dataset:
        return _table(path, dataset, _columns(path, dataset), profile, (latitude, longitude))


def _columns(path: Path, dataset: xr.Dataset) -> dict[str, list[tuple[str, Meaning]]]:
    """Variables and meanings of each quantity; adjusted values before those in real time. Raises CastError."""
    variables: dict[str, list[tuple[str, Meaning]]] = {}
    names = sorted((str(name) for name in dataset.variables), key=lambda n: "adjusted" not in n.lower())
    for name in names:
        variable = dataset[name]
        if not np.issubdtype(variable.dtype, np.number) or variable.size == 0 or not variable.dims:
            continue
        unit = str(variable.attrs.get("units", "")) or None
        for called in (name, str(variable.attrs.get("standard_name", ""))):
            try:
                definition = meaning(called, unit) if called else None
            except UnitError:
                continue
            if definition is not None:
                variables.setdefault(definition.quantity, []).append((name, definition))
                break
    if not {"depth", "pressure"} & set(variables) or not {"temperature", "sound speed"} & set(variables):
        shown = ", ".join(f"'{n}'" for n in list(dataset.variables)[:12])
        raise CastError(f"{path}: no profile of depth or pressure, and temperature or sound speed, among {shown}")
    return variables


def _table(
    path: Path,
    dataset: xr.Dataset,
    variables: dict[str, list[tuple[str, Meaning]]],
    profile: int | None,
    position: tuple[float | None, float | None],
) -> CastTable:
    notes: list[str] = []
    lead = dataset[variables["temperature" if "temperature" in variables else "sound speed"][0][0]]
    levels = next((d for d in reversed(lead.dims) if str(d).lower() in LEVELS), lead.dims[-1])
    if dataset.sizes[levels] > MAX_ROWS:
        raise CastError(f"{path}: has more than {MAX_ROWS} rows")
    pick: dict[Any, int] = {}
    others = [dim for dim in lead.dims if dim != levels]
    for dim in others:
        if str(dim).lower() in PLACES:
            pick[dim] = _nearest(path, dataset, dim, position[0 if str(dim).lower().startswith("lat") else 1])
    rows = slice(None) if others else _same_cast(dataset, levels, profile, path, notes)
    columns: dict[str, Column] = {}
    for dim in others:
        if dim not in pick:
            pick[dim] = _chosen(path, dataset, dim, profile)
            while (
                profile is None and pick[dim] + 1 < dataset.sizes[dim] and not _usable(dataset, variables, levels, pick)
            ):
                pick[dim] += 1
            if dataset.sizes[dim] > 1:
                notes.append(f"profile {pick[dim]} of {dataset.sizes[dim]} along {dim}")
    columns = _values(dataset, variables, levels, pick, rows)
    size = len(next(iter(columns.values())).values)
    latitude, longitude = (_coordinate(dataset, name, pick, rows) for name in ("lat", "lon"))
    names = tuple(str(n) for n in dataset.variables)
    make = "Argo" if "argo" in str(dataset.attrs.get("title", "")).lower() else "netCDF"
    return CastTable(path, make, columns, np.arange(1, size + 1), names, 0, latitude, longitude, tuple(notes))


def _values(
    dataset: xr.Dataset, variables: dict[str, list[tuple[str, Meaning]]], levels: Any, pick: dict[Any, int], rows: Any
) -> dict[str, Column]:
    """Columns of the profile picked: of each quantity the first variable that has a good value in it."""
    columns: dict[str, Column] = {}
    for quantity, several in variables.items():
        for name, definition in several:
            variable = dataset[name]
            if levels not in variable.dims:
                continue
            at = {dim: pick.get(dim, 0) for dim in variable.dims if dim != levels}
            values = without_flags(_good(dataset, name, variable.isel(at).values.astype(float), at)[rows])
            if quantity not in columns or not np.isfinite(columns[quantity].values).any():
                columns[quantity] = Column(name, definition.ours(values), definition.stated)
    return columns


def _usable(
    dataset: xr.Dataset, variables: dict[str, list[tuple[str, Meaning]]], levels: Any, pick: dict[Any, int]
) -> bool:
    """Whether a profile has rows with all that the file has of pressure or depth, temperature and salinity."""
    columns = _values(dataset, variables, levels, pick, slice(None))
    wanted = [columns[name].values for name in ("pressure", "temperature", "salinity") if name in columns]
    return bool(np.any(np.all(np.isfinite(wanted), axis=0)))


def _chosen(path: Path, dataset: xr.Dataset, dim: Any, profile: int | None) -> int:
    """Which of several profiles: the one asked for, else the first."""
    count = dataset.sizes[dim]
    if profile is not None and profile >= count:
        raise CastError(f"{path}: has no profile {profile}, only {count} (from 0)")
    return profile or 0


def _nearest(path: Path, dataset: xr.Dataset, dim: Any, wanted: float | None) -> int:
    if dataset.sizes[dim] == 1:
        return 0
    if wanted is None:
        raise CastError(f"{path}: is a grid of places: give the `latitude` and the `longitude` of the scene")
    off = dataset[dim].values.astype(float) - wanted
    return int(np.argmin(np.abs((off + 180.0) % 360.0 - 180.0)))


def _same_cast(dataset: xr.Dataset, levels: Any, profile: int | None, path: Path, notes: list[str]) -> Any:
    """Rows of one cast of a long table (ERDDAP): those of one float and cycle."""
    keys = [n for n in ("platform_number", "cycle_number", "direction", "CYCLE_NUMBER") if n in dataset.variables]
    keys = [n for n in keys if dataset[n].dims == (levels,)]
    if not keys:
        return slice(None)
    code = np.array(["|".join(map(str, row)) for row in zip(*(dataset[n].values for n in keys), strict=True)])
    first = np.sort(np.unique(code, return_index=True)[1])
    if profile is not None and profile >= len(first):
        raise CastError(f"{path}: has no profile {profile}, only {len(first)} (from 0)")
    if len(first) > 1:
        notes.append(f"profile {profile or 0} of {len(first)}")
    return code == code[first[profile or 0]]


def _good(dataset: xr.Dataset, name: str, values: Floats, at: dict[Any, int]) -> Floats:
    """Values whose quality flag, where they have one, says that they can be used."""
    flag = next((f for f in (f"{name}_QC", f"{name}_qc") if f in dataset.variables), None)
    if flag is None:
        return values
    flags = dataset[flag].isel({d: i for d, i in at.items() if d in dataset[flag].dims}).values
    if flags.shape != values.shape:
        return values
    text = np.array([str(f.decode() if isinstance(f, bytes) else f).strip()[:1] for f in flags])
    return np.where(np.isin(text, list(GOOD_FLAGS.decode())), values, np.nan)


def _coordinate(dataset: xr.Dataset, start: str, pick: dict[Any, int], rows: Any) -> float | None:
    """Latitude or longitude (degrees) of the profile."""
    limit = 90.0 if start == "lat" else 360.0
    for name in dataset.variables:
        if str(name).lower() in (start, "latitude" if start == "lat" else "longitude"):
            variable = dataset[name].isel({d: i for d, i in pick.items() if d in dataset[name].dims})
            values = np.ravel(variable.values[rows] if variable.ndim and not pick else variable.values)
            if values.size and np.issubdtype(values.dtype, np.number) and abs(float(values[0])) <= limit:
                return float(values[0])
    return None
