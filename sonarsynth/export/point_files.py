"""Files of points, as Open3D writes them: colours by energy, normals and labels with them."""

from __future__ import annotations

import errno
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sonarsynth.store.files.place import write_atomically

if TYPE_CHECKING:
    import xarray as xr

FORMATS = {"ply": (b"end_header\n", 3), "pcd": (b"DATA binary\n", 4)}
"""Endings of names, how the header of such a file ends, and bytes that the colour of a point has in it."""
DECIBELS = 25.0
"""Range of the colours, below the point of most energy."""
LABELS = {
    "frame": np.int32,
    "target": np.int32,
    "family": np.int32,
    "energy": np.float32,
    "snr": np.float32,
    "range_error": np.float32,
}
"""Columns beside place, normal and colour, and their types."""
POINT_BYTES = 4 * (3 + len(LABELS))
"""Of each point, beside its place and its colour."""
ROUNDED = 1e-4
"""m: places that single precision rounds to more, as kilometres from the origin of the world, have double in a PLY."""


def write_points(points: xr.Dataset, path: str | Path) -> Path:
    """Write the points of `sonarsynth.points` to a file whose name ends as one of `FORMATS`: all of it, or nothing.

    Positions in m, to a tenth of a millimetre (in double precision where they are far off), normals (0 where there is
    none), colours by energy over 25 dB, and `frame`, `target`, `family`, `energy`, `snr` and `range_error` of each by
    those names. Raises ValueError for another ending, for a PCD of points that are too far off for single precision,
    or where there is no point; ImportError where Open3D is not installed; OSError where the file cannot be written.
    """
    import open3d as o3d

    file = Path(path)
    ending = file.suffix.lower().lstrip(".")
    if ending not in FORMATS:
        raise ValueError(f"{file}: the name must end in .{' or .'.join(FORMATS)}")
    if not points.sizes.get("point"):
        raise ValueError(f"{file}: there is no point to write")
    rounded = float(np.spacing(np.float32(np.abs(points["position"].values).max())))
    place = np.float64 if rounded > ROUNDED else np.float32
    if rounded > ROUNDED and ending != "ply":  # Open3D does not read it again
        raise ValueError(f"{file}: would round places to {rounded:.1g} m, so far off are they: a .ply does not")
    with tempfile.TemporaryDirectory() as scratch:
        written = Path(scratch, f"points.{ending}")
        done = o3d.t.io.write_point_cloud(written, _cloud(points, place), write_ascii=False)
        content = written.read_bytes() if done else b""
    header, colour = FORMATS[ending]
    each, (_, _, rows) = 3 * np.dtype(place).itemsize + POINT_BYTES + colour, content.partition(header)
    if len(rows) != points.sizes["point"] * each:  # Open3D does not say that a PLY is cut
        raise OSError(errno.ENOSPC, f"Open3D did not write all points in {tempfile.gettempdir()}", str(file))
    file.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(file, content)
    return file


def _cloud(points: xr.Dataset, place: type) -> Any:
    """The cloud of Open3D, with places of a type."""
    import open3d as o3d
    from matplotlib import colormaps

    cloud = o3d.t.geometry.PointCloud()
    energy = np.maximum(points["energy"].values.astype(float), np.finfo(float).tiny)
    level = 10.0 * np.log10(energy / energy.max())
    shade = colormaps["viridis"](np.clip(1.0 + level / DECIBELS, 0.0, 1.0))[:, :3]

    def put(name: str, values: np.ndarray, kind: type) -> None:
        rows = values if values.ndim == 2 else values[:, None]
        cloud.point[name] = o3d.core.Tensor.from_numpy(np.ascontiguousarray(rows, kind))

    put("positions", points["position"].values, place)
    put("normals", np.nan_to_num(points["normal"].values), np.float32)
    put("colors", np.rint(255.0 * shade), np.uint8)
    for name, kind in LABELS.items():
        put(name, points[name].values, kind)
    return cloud
