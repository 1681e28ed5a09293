"""Arrays of a store of format 2 by the names, and in the shape, of format 3: its points were a grid of beams."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

TARGETS = (
    "box",
    "image_box",
    "view",
    "visible_fraction",
    "position_at_echo",
    "meeting_time",
    "mesh",
    "family",
    "bound",
)
NAMES = (
    {f"truth/{name}": f"truth/targets/{name}" for name in TARGETS}
    | {f"truth/echo_{name}": f"truth/targets/echo_{name}" for name in ("azimuth", "elevation", "level")}
    | {f"truth/target_{name}": f"truth/targets/{name}" for name in ("position", "orientation", "velocity")}
    | {f"truth/{name}": f"truth/beams/{name}" for name in ("target", "facet", "range", "azimuth", "elevation")}
    | {
        f"truth/snap_{name}": f"truth/emissions/{name}"
        for name in ("position", "time", "level", "arrival", "azimuth", "elevation")
    }
    | {f"truth/{name}": f"link_budget/{name}" for name in ("wavefront_error", "amplitude_error")}
    | {
        "truth/bound": "truth/targets/bound",
        "truth/target_name": "truth/targets/target",
        "ledger/echo": "link_budget/target",
    }
)
GROUPS = {"bearings/": "source_estimates/", "ledger/": "link_budget/"}


def as_format_3(old: Mapping[str, np.ndarray], room: int) -> dict[str, np.ndarray]:
    """Arrays of format 2, {path: values}, as format 3 has them, with room for so many points of a frame."""
    arrays = {_renamed(path): _reworded(values) for path, values in old.items() if not path.startswith("cloud/")}
    grids = {path: values for path, values in old.items() if path.startswith("cloud/") and values.ndim == 3}
    if not grids:
        return arrays
    there = np.isfinite(grids["cloud/range"])
    axes = np.broadcast_arrays(old["cloud/azimuth"], old["cloud/elevation"][:, None])
    for name, axis in zip(("azimuth", "elevation"), axes, strict=True):
        grids[f"cloud/{name}"] = np.broadcast_to(axis, there.shape).astype(np.float32)
    for path, grid in grids.items():
        rows = np.full((len(grid), room), -1 if grid.dtype.kind == "i" else np.nan, grid.dtype)
        for frame, (values, found) in enumerate(zip(grid, there, strict=True)):
            rows[frame, : found.sum()] = values[found]
        arrays[path] = rows
    return arrays


def _renamed(path: str) -> str:
    for old, new in GROUPS.items():
        if path.startswith(old):
            return NAMES.get(path, new + path.removeprefix(old))
    return NAMES.get(path, path)


def _reworded(values: np.ndarray) -> np.ndarray:
    """Names of families, which said bed."""
    if values.dtype.kind in "fiu":
        return values
    return np.array([str(text).replace("bed", "bottom") for text in values.ravel()]).reshape(values.shape)
