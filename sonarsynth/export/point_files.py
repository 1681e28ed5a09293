"""Files of points: PLY (Turk 1994) and PCD (the Point Cloud Library, version 0.7), binary, colours by energy."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.store.files.place import write_atomically

if TYPE_CHECKING:
    import xarray as xr

FORMATS = ("ply", "pcd")
DECIBELS = 25.0
"""Range of the colours, below the point of most energy."""
PLY_TYPES = {"f4": "float", "i4": "int", "u1": "uchar"}
LABELS = ("frame", "i4"), ("target", "i4"), ("family", "i4"), ("energy", "f4"), ("snr", "f4"), ("range_error", "f4")
"""Columns beside place, normal and colour, and their types."""


def write_points(points: xr.Dataset, path: str | Path) -> Path:
    """Write the points of `sonarsynth.points` to a file whose name ends as one of `FORMATS`: all of it, or nothing.

    Positions in m, normals (0 where there is none), colours by energy over 25 dB, and `frame`, `target`, `family`,
    `energy`, `snr` and `range_error` of each point by those names. Raises ValueError for another ending, or where there
    is no point; OSError where the file cannot be written.
    """
    file = Path(path)
    ending = file.suffix.lower().lstrip(".")
    if ending not in FORMATS:
        raise ValueError(f"{file}: the name must end in .{' or .'.join(FORMATS)}")
    if not points.sizes.get("point"):
        raise ValueError(f"{file}: there is no point to write")
    file.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(file, (_ply if ending == "ply" else _pcd)(points))
    return file


def _ply(points: xr.Dataset) -> bytes:
    colours = [(name, "u1", values) for name, values in zip(("red", "green", "blue"), _shades(points).T, strict=True)]
    rows = _rows(points, ("nx", "ny", "nz"), colours)
    properties = "".join(f"property {PLY_TYPES[kind]} {name}\n" for name, kind in _types(rows).items())
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n{properties}end_header\n"
    return head.encode("ascii") + rows.tobytes()


def _pcd(points: xr.Dataset) -> bytes:
    packed = _shades(points).astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], np.uint32)
    rows = _rows(points, ("normal_x", "normal_y", "normal_z"), [("rgb", "u4", packed)])
    types = _types(rows)
    lines = {
        "VERSION": "0.7",
        "FIELDS": " ".join(types),
        "SIZE": " ".join(kind[1] for kind in types.values()),
        "TYPE": " ".join(kind[0].upper() for kind in types.values()),
        "COUNT": " ".join("1" for _ in types),
        "WIDTH": f"{len(rows)}",
        "HEIGHT": "1",
        "VIEWPOINT": "0 0 0 1 0 0 0",
        "POINTS": f"{len(rows)}",
        "DATA": "binary",
    }
    return "".join(f"{word} {said}\n" for word, said in lines.items()).encode("ascii") + rows.tobytes()


def _shades(points: xr.Dataset) -> np.ndarray:
    """Colours (point, rgb) of a byte each."""
    from matplotlib import colormaps

    energy = np.maximum(points["energy"].values.astype(float), np.finfo(float).tiny)
    level = 10.0 * np.log10(energy / energy.max())
    return np.asarray(np.rint(255.0 * colormaps["viridis"](np.clip(1.0 + level / DECIBELS, 0.0, 1.0))[:, :3]), np.uint8)


def _types(rows: np.ndarray) -> dict[str, str]:
    """Type of each column by its name, such as "f4"."""
    return {name: rows.dtype[name].str[1:] for name in rows.dtype.names or ()}


def _rows(points: xr.Dataset, normal: tuple[str, ...], colour: list[tuple[str, str, np.ndarray]]) -> np.ndarray:
    """A record of each point, packed, little-endian."""
    position, normals = points["position"].values, np.nan_to_num(points["normal"].values)
    columns = [
        *((name, "f4", position[:, n]) for n, name in enumerate("xyz")),
        *((name, "f4", normals[:, n]) for n, name in enumerate(normal)),
        *colour,
        *((name, kind, points[name].values) for name, kind in LABELS),
    ]
    rows = np.empty(len(position), [(name, f"<{kind}") for name, kind, _ in columns])
    for name, _, values in columns:
        rows[name] = values
    return rows
