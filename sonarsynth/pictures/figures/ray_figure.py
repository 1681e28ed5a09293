"""Rays in the water: a section with the sound speed beside it, and rays in space (figures 14 and 15 of the thesis)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.pictures.figures.frame_figure import Hull
from sonarsynth.pictures.figures.outlines import union_outline
from sonarsynth.pictures.figures.style import ERROR_MAP, INK, MARKS, PALE, figure, grid, label
from sonarsynth.products import FAMILIES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.ticker import Locator

RAYS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Okabe and Ito (2008)."""

FAN = "fan"
COLOURS = dict(zip(FAMILIES, RAYS, strict=False)) | {FAN: "#9a9a9a"}

MARKERS = {"surface": "^", "bottom": "v", "turning point": "o", "target": "X", "facet": "X"}
"""Marks of vertices."""


@dataclass(frozen=True, eq=False)
class Look:
    """How a ray is drawn where rays of several families are."""

    family: str  # of FAMILIES, or FAN
    hidden: bool  # behind a target: dashed
    event: tuple[str, ...]  # (point,): those in MARKERS are marked


def section_figure(
    rays: Sequence[Floats],
    hulls: Sequence[Hull],
    profile_depth: Floats,
    profile_speed: Floats,
    bottom_depth: float,
    bearing: float = 0.0,
    looks: Sequence[Look] = (),
    places: Mapping[str, Floats] | None = None,
) -> Figure:
    """Rays (each (point, xyz) in m, world) seen on the vertical plane towards `bearing` (rad, from x to y).

    Left the sound speed (m/s) over depth (m), right the water down to `bottom_depth` (m), with outlines of targets.
    looks: of each ray; left out, rays are coloured in turn. places: points (xyz) to name.
    """
    made = figure(11.0, 4.6 if looks else 4.2, dpi=110)
    parts = made.add_gridspec(1, 2, width_ratios=[1.0, 4.0])
    section = made.add_subplot(parts[1])
    along = np.array([np.cos(bearing), np.sin(bearing), 0.0])
    _water(section, bottom_depth)
    for hull in hulls:
        flat = np.stack([hull.vertices @ along, hull.vertices[:, 2]], axis=1)
        for line in union_outline(flat, hull.faces):
            section.fill(*line.T, facecolor="#d9d9d9", edgecolor=INK, linewidth=0.8)
        _name_over(section, hull.name, flat)
    flat_rays = [np.stack([ray @ along, ray[:, 2]], axis=1) for ray in rays]
    for i in _drawing_order(looks):
        _draw(section, flat_rays[i], looks[i])
    for i, ray in enumerate(flat_rays if not looks else ()):
        section.plot(*ray.T, color=RAYS[i % len(RAYS)], linewidth=1.0)
        section.plot(*ray[0], "o", color=INK, markersize=4)
    named = [(name, (place @ along, place[2])) for name, place in (places or {}).items()]
    _name(section, named)
    label(section, _distance(bearing), "height over the mean surface, z (m)", f"{len(rays)} rays")
    _profile(made.add_subplot(parts[0], sharey=section), profile_depth, profile_speed, bottom_depth)
    _legend(made, looks)
    return made


def _distance(bearing: float) -> str:
    """Name of the axis along a bearing (rad, from x to y), which people say clockwise from north."""
    return f"distance towards {np.rad2deg(0.5 * np.pi - bearing) % 360.0:.0f} deg (m)"


def _drawing_order(looks: Sequence[Look]) -> list[int]:
    """Rays with fewer vertices come last, on top."""
    return sorted(range(len(looks)), key=lambda i: (looks[i].family != FAN, -sum(e in MARKERS for e in looks[i].event)))


def _draw(axes: Axes, points: Floats, look: Look) -> None:
    """A ray (point, 2 or 3) as it looks, its vertices marked."""
    colour = COLOURS[look.family]
    style = {"color": colour, "linewidth": 0.6 if look.family == FAN else 1.1, "linestyle": ":" if look.hidden else "-"}
    axes.plot(*points.T, **style)  # type: ignore[arg-type]
    for event, marker in MARKERS.items():
        at = points[[e == event for e in look.event]]
        if len(at) and look.family != FAN:
            axes.plot(*at.T, marker, color=colour, markersize=3.5)


def _name(axes: Axes, named: Sequence[tuple[str, tuple[float, ...]]]) -> None:
    """Points with their names."""
    from matplotlib.patheffects import withStroke

    for (name, place), colour in zip(named, cycle(MARKS)):
        axes.plot(*([v] for v in place), "o", color=colour, markersize=5, zorder=5)
        text = axes.text(*place, f"  {name}", fontsize=9, color=INK, zorder=6)  # type: ignore[call-arg,arg-type]
        text.set_path_effects([withStroke(linewidth=2.5, foreground="white")])


def _name_over(axes: Axes, name: str, points: Floats) -> None:
    """The name of a body over its points (point, 2)."""
    from matplotlib.patheffects import withStroke

    if len(points):
        low, high = points.min(axis=0), points.max(axis=0)
        over = (0.5 * (low[0] + high[0]), high[1])
        text = axes.annotate(
            name, over, (0, 5), textcoords="offset points", fontsize=9, color=INK, ha="center", zorder=6
        )
        text.set_path_effects([withStroke(linewidth=2.5, foreground="white")])


def _legend(made: Figure, looks: Sequence[Look]) -> None:
    """One legend for the whole figure: the families that are there with their marks, and the other marks."""
    from matplotlib.lines import Line2D

    if not looks:
        return
    there = {look.family for look in looks}
    met = {event for look in looks if look.family != FAN for event in look.event}
    named = {f: MARKERS.get(f, "") for f in COLOURS if f in there}
    handles = [Line2D([], [], color=COLOURS[f], marker=m, markersize=4, label=f) for f, m in named.items()]
    if any(look.hidden for look in looks):
        handles.append(Line2D([], [], color=INK, linestyle=":", label="hidden by a target"))
    for event, marker in MARKERS.items():
        if event in met and event not in named and marker not in named.values():
            named[event] = marker
            handles.append(Line2D([], [], color=INK, marker=marker, linestyle="", markersize=4, label=event))
    made.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=8, frameon=False)


def _water(axes: Axes, bottom_depth: float) -> None:
    axes.axhline(0.0, color="#4a90c2", linewidth=1.5)
    axes.axhline(-bottom_depth, color="#8c6d46", linewidth=1.5)
    axes.set_ylim(-1.06 * bottom_depth, 0.06 * bottom_depth)


def _profile(axes: Axes, depth: Floats, speed: Floats, bottom_depth: float) -> None:
    inside = (depth > 0.0) & (depth < bottom_depth)
    ends = np.interp([0.0, bottom_depth], depth, speed)
    grid(axes)
    axes.plot([ends[0], *speed[inside], ends[1]], [0.0, *-depth[inside], -bottom_depth], color=INK, linewidth=1.2)
    axes.ticklabel_format(axis="x", useOffset=False)
    label(axes, "sound speed (m/s)", "z (m)", "profile")
    axes.locator_params(axis="x", nbins=4)


def space_figure(
    rays: Sequence[Floats],
    strength: Floats,
    hulls: Sequence[Hull],
    places: Mapping[str, Floats],
    looks: Sequence[Look] = (),
    bearing: float = 0.0,
) -> Figure:
    """Rays (each (point, xyz) in m, world) in space, coloured by `strength` (ray,), the size of their coefficient.

    places: points (xyz) to name, such as the array and the shrimp. looks: of each ray; they take the place of strength.
    bearing (rad, from x to y) leads to the right.
    """
    from mpl_toolkits.mplot3d import Axes3D
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    made = figure(7.6, 6.0, dpi=110)
    axes = made.add_subplot(projection="3d")
    assert isinstance(axes, Axes3D)
    for hull in hulls:
        body = Poly3DCollection(
            hull.vertices[hull.faces], facecolors="#c8c8c8", edgecolors=PALE, alpha=0.5, linewidths=0.2
        )
        axes.add_collection3d(body, autolim=False)
    for i in _drawing_order(looks):
        _draw(axes, rays[i], looks[i])
    if not looks:
        _by_strength(made, axes, rays, strength)
    _name(axes, [(name, tuple(map(float, place))) for name, place in places.items()])
    _legend(made, looks)
    every = np.concatenate([*rays, *(hull.vertices for hull in hulls), *(np.asarray(p)[None] for p in places.values())])
    span = np.maximum(np.ptp(every, axis=0), 0.05 * np.ptp(every, axis=0).max())
    middle = 0.5 * (every.max(axis=0) + every.min(axis=0))
    axes.set(**{f"{axis}lim": (m - 0.5 * s, m + 0.5 * s) for axis, m, s in zip("xyz", middle, span, strict=True)})
    axes.set_box_aspect(tuple(span), zoom=0.98)
    axes.view_init(elev=30.0, azim=-60.0 + float(np.rad2deg(bearing)))
    for axis, name, size in zip((axes.xaxis, axes.yaxis, axes.zaxis), AXES, span, strict=True):
        axis.set_label_text(name, fontsize=8)
        axis.labelpad = 10.0
        axis.set_major_locator(_ticks(float(size / span.max())))
    axes.tick_params(labelsize=7)
    return made


AXES = ("east, x (m)", "north, y (m)", "up, z (m)")


def _ticks(share: float) -> Locator:
    """Ticks of an axis with a share of the length of the longest one: few where there is little room."""
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(nbins=max(2, round(7 * share)))


def _by_strength(made: Figure, axes: Axes, rays: Sequence[Floats], strength: Floats) -> None:
    """Rays in the colours of their strength (ray,), the strongest last, with a scale where strengths differ."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    scale = Normalize(0.0, float(np.max(strength, initial=0.0)) or 1.0)
    alike = bool(np.all(strength == 1.0))
    for n, (ray, size) in sorted(enumerate(zip(rays, strength, strict=True)), key=lambda pair: float(pair[1][1])):
        colour = RAYS[n % len(RAYS)] if alike else colormaps[ERROR_MAP](scale(size))
        axes.plot(*ray.T, color=colour, linewidth=0.9)
    if not alike:
        bar = made.colorbar(ScalarMappable(scale, ERROR_MAP), ax=axes, shrink=0.6, pad=0.12)
        bar.set_label("coefficient", fontsize=9, color=INK)
