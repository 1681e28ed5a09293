"""A cast and a hull for configs/harbour.yaml, which names files that its users have."""

from __future__ import annotations

from pathlib import Path

import numpy as np

CAST = """\
% Device,CC1449004
% Start latitude,-36.2199169
% Start longitude,150.2301061
%
Pressure (Decibar),Depth (Meter),Temperature (Celsius),Salinity (PSS),Sound velocity (Meters per Second)
0.15,0.149,16.446,35.608,1511.860
5.00,4.97,16.2,35.64,1511.30
12.0,11.9,16.05,35.65,1511.05
25.0,24.8,15.9,35.66,1510.60
"""
"""As the instrument of `configs/harbour.yaml` exports it."""


def written(folder: Path) -> tuple[str, ...]:
    """Write both files to a folder. Returns the `--set` values that name them."""
    cast = folder / "cast.csv"
    cast.write_text(CAST)
    return settings(cast, hull(folder / "hull.stl"))


def settings(cast: Path, hull: Path) -> tuple[str, ...]:
    """The `--set` values for a cast and a hull."""
    return (
        f"scene.world.environment.sound_speed.path={cast}",
        f"scene.world.targets.0.shape.path={hull}",
        "scene.world.targets.0.shape.edge=0.2",
    )


def hull(path: Path, size: tuple[float, float, float] = (2.6, 1.5, 1.6)) -> Path:
    """Write a box of the size (m) of the vehicle of the recipe, in the format that it names."""
    corners = (np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)]) - 0.5) * size
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    lines = ["solid hull"]
    for a, b, c, d in quads:
        for triangle in ((a, b, c), (a, c, d)):
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += ["vertex " + " ".join(f"{x:g}" for x in corners[v]) for v in triangle]
            lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid hull"]))
    return path
