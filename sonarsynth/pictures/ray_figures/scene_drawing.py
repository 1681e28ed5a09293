"""What scenes are drawn of, in sections and in space: surface and bottom, sound speed, bodies, names, scales."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.pictures.figures.frame_figure import Hull
from sonarsynth.pictures.figures.style import INK, PALE, grid, label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from mpl_toolkits.mplot3d import Axes3D

SURFACE, BOTTOM, VIEW, TRACK = "#4a90c2", "#8c6d46", "#7b5ea7", "#444444"
AXES = ("east, x (m)", "north, y (m)", "up, z (m)")


def surface_and_bottom(axes: Axes, bottom: float) -> None:
    """Lines at the surface and at the depth of the bottom (m), with their names at the right."""
    for name, z, colour, side in (("surface", 0.0, SURFACE, "bottom"), ("bottom", -bottom, BOTTOM, "top")):
        axes.axhline(z, color=colour, linewidth=1.5)
        style: dict[str, Any] = {"color": colour, "fontsize": 8, "ha": "right", "va": side, "clip_on": True}
        axes.text(0.995, z, name, transform=axes.get_yaxis_transform(), **style)


TALLEST = 1.0
"""Heights over widths of what is drawn in space on one scale."""


def vertical_scale(axes: Axes) -> float:
    """How many times larger heights are drawn than distances, in axes that have found their place."""
    box, (left, right), (low, high) = axes.get_window_extent(), axes.get_xlim(), axes.get_ylim()
    return float(box.height / (high - low) / (box.width / (right - left)))


def scale_words(factor: float) -> str:
    """What a vertical scale is, in words."""
    return "one scale" if 0.97 < factor < 1.03 else f"heights drawn {factor:.2g} times as large"


def name_beside(axes: Axes, name: str, point: Floats, over: bool = False) -> None:
    """A name beside a point (2), or over it."""
    from matplotlib.patheffects import withStroke

    offset = {"xytext": (0, 5), "ha": "center"} if over else {"xytext": (6, -11)}
    text = axes.annotate(name, point, textcoords="offset points", fontsize=9, color=INK, zorder=6, **offset)  # type: ignore[arg-type]
    text.set_path_effects([withStroke(linewidth=2.5, foreground="white")])


def lift_names(axes: Axes) -> None:
    """Lift names that lie on others, in a figure that has its layout; from the lowest on."""
    names: list[Any] = [text for text in axes.texts if text.get_text()]
    taken: list[Any] = []
    for name in sorted(names, key=lambda name: float(name.get_window_extent().y0)):
        while any(name.get_window_extent().overlaps(box) for box in taken):
            name.xyann = (name.xyann[0], name.xyann[1] + 2.0)
        taken.append(name.get_window_extent())


def profile_axes(axes: Axes, depth: Floats, speed: Floats, bottom_depth: float) -> None:
    """The sound speed (m/s) at depths (m), beside a section of the water down to the bottom."""
    inside = (depth > 0.0) & (depth < bottom_depth)
    ends = np.interp([0.0, bottom_depth], depth, speed)
    grid(axes)
    axes.plot([ends[0], *speed[inside], ends[1]], [0.0, *-depth[inside], -bottom_depth], color=INK, linewidth=1.2)
    axes.ticklabel_format(axis="x", useOffset=False)
    label(axes, "sound speed (m/s)", "up, z (m)", "profile")
    middle = 0.5 * (speed.min() + speed.max())
    half = max(0.6 * np.ptp(speed), 2.0)
    axes.set_xlim(middle - half, middle + half)
    axes.locator_params(axis="x", nbins=3)


def bodies_in_space(axes: Axes3D, hulls: Iterable[Hull]) -> None:
    """Bodies in the world, in axes in space."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    for hull in hulls:
        body = Poly3DCollection(
            hull.vertices[hull.faces], facecolors="#c8c8c8", edgecolors=PALE, alpha=0.5, linewidths=0.2
        )
        axes.add_collection3d(body, autolim=False)


def frame_space(axes: Axes3D, points: Floats, bearing: float) -> float:
    """Limits that hold points (point, xyz), seen with `bearing` (rad) to the right; how much larger heights are drawn.

    All axes have one scale, but for heights of more than TALLEST times the width.
    """
    span = np.maximum(np.ptp(points, axis=0), 0.05 * np.ptp(points, axis=0).max())
    middle = 0.5 * (points.max(axis=0) + points.min(axis=0))
    axes.set(**{f"{axis}lim": (m - 0.5 * s, m + 0.5 * s) for axis, m, s in zip("xyz", middle, span, strict=True)})
    factor = min(TALLEST * float(span[:2].max()) / float(span[2]), 1.0)
    span[2] *= factor
    axes.set_box_aspect(tuple(span), zoom=1.05)
    axes.view_init(elev=30.0, azim=-60.0 + float(np.rad2deg(bearing)))
    for axis, name, size in zip((axes.xaxis, axes.yaxis, axes.zaxis), AXES, span, strict=True):
        axis.set_label_text(name, fontsize=8)
        axis.labelpad = 10.0
        axis.get_major_locator().set_params(nbins=max(2, round(7 * float(size / span.max()))))
    axes.tick_params(labelsize=7)
    return factor
