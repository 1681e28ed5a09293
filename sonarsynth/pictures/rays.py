"""Rays in the water: a section with the sound speed beside it, and rays in space (figures 14 and 15 of the thesis)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.pictures.frames import Hull
from sonarsynth.pictures.outlines import union_outline
from sonarsynth.pictures.style import ERROR_MAP, INK, MARKS, PALE, figure, grid, label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RAYS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Okabe and Ito (2008)."""


def section_figure(
    rays: Sequence[Floats],
    hulls: Sequence[Hull],
    profile_depth: Floats,
    profile_speed: Floats,
    bed: float,
    bearing: float = 0.0,
) -> Figure:
    """Rays (each (point, xyz) in m, world) seen on the vertical plane towards `bearing` (rad, from x to y).

    Left the sound speed (m/s) over depth (m), right the water down to `bed` (m), with the outlines of the targets.
    """
    made = figure(11.0, 4.2, dpi=110)
    parts = made.add_gridspec(1, 2, width_ratios=[1.0, 4.0])
    section = made.add_subplot(parts[1])
    along = np.array([np.cos(bearing), np.sin(bearing), 0.0])
    _water(section, bed)
    for hull in hulls:
        flat = np.stack([hull.vertices @ along, hull.vertices[:, 2]], axis=1)
        for line in union_outline(flat, hull.faces):
            section.fill(*line.T, facecolor="#d9d9d9", edgecolor=INK, linewidth=0.8)
    for i, ray in enumerate(rays):
        section.plot(ray @ along, ray[:, 2], color=RAYS[i % len(RAYS)], linewidth=1.0)
        section.plot(ray[0] @ along, ray[0, 2], "o", color=INK, markersize=4)
    label(section, "distance (m)", "height over the mean surface, z (m)", f"{len(rays)} rays")
    _profile(made.add_subplot(parts[0], sharey=section), profile_depth, profile_speed, bed)
    return made


def _water(axes: Axes, bed: float) -> None:
    axes.axhline(0.0, color="#4a90c2", linewidth=1.5)
    axes.axhline(-bed, color="#8c6d46", linewidth=1.5)
    axes.set_ylim(-1.06 * bed, 0.06 * bed)


def _profile(axes: Axes, depth: Floats, speed: Floats, bed: float) -> None:
    every = np.concatenate([[0.0], depth, [bed]])
    grid(axes)
    axes.plot(np.interp(every, depth, speed), -every, color=INK, linewidth=1.2)
    label(axes, "sound speed (m/s)", "z (m)", "profile")
    axes.locator_params(axis="x", nbins=4)


def space_figure(rays: Sequence[Floats], strength: Floats, hulls: Sequence[Hull], places: dict[str, Floats]) -> Figure:
    """Rays (each (point, xyz) in m, world) in space, coloured by `strength` (ray,), the size of their coefficient.

    places: points (xyz) to name, such as the array and the shrimp.
    """
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from mpl_toolkits.mplot3d import Axes3D
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    made = figure(7.6, 6.0, dpi=110)
    axes = made.add_subplot(projection="3d")
    assert isinstance(axes, Axes3D)
    scale = Normalize(0.0, float(np.max(strength, initial=0.0)) or 1.0)
    for hull in hulls:
        body = Poly3DCollection(
            hull.vertices[hull.faces], facecolors="#c8c8c8", edgecolors=PALE, alpha=0.5, linewidths=0.2
        )
        axes.add_collection3d(body, autolim=False)
    for ray, size in sorted(zip(rays, strength, strict=True), key=lambda pair: float(pair[1])):
        axes.plot(*ray.T, color=colormaps[ERROR_MAP](scale(size)), linewidth=0.9)
    for (name, place), colour in zip(places.items(), MARKS, strict=False):
        axes.scatter(*np.asarray(place)[:, None], s=30, color=colour, depthshade=False)
        axes.text(*place, f"  {name}", fontsize=9, color=INK)
    bar = made.colorbar(ScalarMappable(scale, ERROR_MAP), ax=axes, shrink=0.6, pad=0.12)
    bar.set_label("coefficient", fontsize=9, color=INK)
    every = np.concatenate([*rays, *(hull.vertices for hull in hulls), *(np.asarray(p)[None] for p in places.values())])
    span = np.maximum(np.ptp(every, axis=0), 0.05 * np.ptp(every, axis=0).max())
    middle = 0.5 * (every.max(axis=0) + every.min(axis=0))
    axes.set(**{f"{axis}lim": (m - 0.5 * s, m + 0.5 * s) for axis, m, s in zip("xyz", middle, span, strict=True)})
    axes.set_box_aspect(tuple(span), zoom=0.88)
    axes.set_xlabel("east, x (m)", fontsize=8)
    axes.set_ylabel("north, y (m)", fontsize=8)
    axes.set_zlabel("up, z (m)", fontsize=8)
    axes.tick_params(labelsize=7)
    return made
