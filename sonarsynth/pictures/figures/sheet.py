"""A sheet of one frame: the image, the cloud against the true hull, and the beams of a hit, a far hit and a miss."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sonarsynth.conventions import Floats, counted
from sonarsynth.pictures.figures.frame_figure import (
    View,
    Window,
    clipped,
    colour_bar,
    darkest,
    image_axes,
    outline_artist,
    set_outlines,
)
from sonarsynth.pictures.figures.ghost_rings import GhostMarks, box_of, legend, place
from sonarsynth.pictures.figures.style import (
    ERROR_MAP,
    INK,
    MARKS,
    OUTLINES,
    PALE,
    figure,
    grid,
    label,
    placed,
    pressure_unit,
    settle,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WORST_SHOWN = 10.0
"""Range errors (cm) are coloured up to this."""

BADGE = 18.0
"""Size (points) of the number of a beam."""

BADGES = 22.0
"""Points around a target that the numbers of its beams take: labels of ghosts stay off."""

LEAD = 1.0e-3
"""Signals are drawn from this long (s) before the first echo to this long after the last."""


@dataclass(frozen=True, eq=False)
class Beam:
    """What the array hears when it is steered in one direction."""

    name: str
    azimuth: float  # deg
    elevation: float  # deg
    time: Floats  # (sample,) s after the direct arrival of the snap
    pressure: Floats  # (sample,) Pa
    expected: float  # s: delay of the echo by the truth; NaN off the target
    measured: float  # s: delay of the cloud's point; NaN where there is none


@dataclass(frozen=True, eq=False)
class Errors:
    """The points of a cloud against the truth."""

    points: Floats  # (point, xyz) m, sonar frame
    error: Floats  # (point,) m: range less true range; NaN off the targets


def sheet(
    azimuth: Floats, elevation: Floats, view: View, errors: Errors, beams: list[Beam], space: Window, unit: str
) -> Figure:
    """The sheet as a figure. azimuth, elevation: the beam grid (deg). Without beams the last row is left out."""
    top = 8.6 if beams else 5.4
    fig = figure(12.0, top, "none", dpi=110)
    fig.suptitle(f"{view.title}   {view.moment}", x=0.01, y=0.99, ha="left", fontsize=12, color=INK)
    sky = placed(fig, 0.65, top - 4.85, 4.25, 4.25)
    outlines = draw_image(sky, azimuth, elevation, view, unit)
    bar = placed(fig, 11.3, top - 3.9, 0.14, 2.4)
    draw_cloud(placed(fig, 6.2, top - 4.85, 4.8, 4.2, projection="3d"), fig, view, errors, space, bar)
    if beams:
        width = 11.1 / len(beams)
        draw_beams([placed(fig, 0.75 + i * width, 0.85, width - 0.55, 2.1) for i in range(len(beams))], beams)
    settle(fig)
    GhostMarks(sky).show(view.ghosts, view.lobes, outlines, BADGES if beams else 0.0)
    mark_beams(sky, beams, outlines)
    return fig


def draw_image(axes: Axes, azimuth: Floats, elevation: Floats, view: View, unit: str) -> list[Floats]:
    """The energy image over the beam grid (deg), with its scale and the outlines of targets, which are returned."""
    image = image_axes(axes, azimuth, elevation, darkest([view.level]))
    if view.level is not None:
        image.set_data(np.ma.masked_invalid(clipped(view.level))[:, ::-1])
    outlines = set_outlines(outline_artist(axes), view.hulls)
    legend(axes, bool(view.hulls), bool(view.ghosts), bool(view.lobes))
    colour_bar(axes, image, unit)
    return outlines


def mark_beams(axes: Axes, beams: list[Beam], outlines: list[Floats]) -> None:
    """Rings at the beams, with their numbers beside them: inside the axes, off the targets and off each other."""
    point = axes.figure.dpi / 72.0  # in pixels
    to_pixels = axes.transData.transform
    taken = [box_of(to_pixels(line), 0.0) for line in outlines]
    taken += [box_of(to_pixels([(beam.azimuth, beam.elevation)]), 5.0 * point) for beam in beams]
    for beam, number, colour in zip(beams, "123", MARKS, strict=False):
        at = (beam.azimuth, beam.elevation)
        axes.plot(*at, "o", ms=8, mfc="none", mec="white", mew=2.4, clip_on=False)
        axes.plot(*at, "o", ms=8, mfc="none", mec=colour, mew=1.2, clip_on=False)
        size, pixel = np.full(2, BADGE * point), to_pixels(at)
        middle = place(pixel, size, 6.0 * point, np.asarray(axes.get_window_extent().extents), taken)
        taken.append(box_of(middle[None], 0.5 * BADGE * point))
        shape = {"boxstyle": "circle,pad=0.25", "facecolor": colour, "edgecolor": "white", "linewidth": 0.8}
        middling: dict[str, Any] = {"ha": "center", "va": "center", "color": "white", "fontsize": 8, "bbox": shape}
        axes.annotate(number, at, (middle - pixel) / point, textcoords="offset points", **middling)


def draw_cloud(axes: Axes, onto: Figure, view: View, errors: Errors, space: Window, scale: Axes | None = None) -> None:
    """The cloud in three dimensions, coloured by its range error, in the true hulls (figure 19 of the thesis).

    scale: axes of the scale of colours; left out: beside the cloud."""
    from mpl_toolkits.mplot3d import Axes3D
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    assert isinstance(axes, Axes3D)
    centre, half = space.centre(view), np.maximum(space.half, 0.4 * space.half.max())  # one scale on all axes
    inside = (np.abs(errors.points - centre) <= half).all(axis=1)
    for i, hull in enumerate(view.hulls):
        body = Poly3DCollection(
            hull.vertices[hull.faces], facecolors=OUTLINES[i % len(OUTLINES)], alpha=0.13, linewidths=0
        )
        axes.add_collection3d(body, autolim=False)
    on = inside & np.isfinite(errors.error)
    off = inside & ~np.isfinite(errors.error)
    axes.scatter(*errors.points[off].T, s=12, c=PALE, marker="x", linewidths=0.8, depthshade=False)
    colour = 100.0 * np.abs(errors.error[on])
    drawn = axes.scatter(
        *errors.points[on].T, s=10, c=colour, cmap=ERROR_MAP, vmin=0, vmax=WORST_SHOWN, depthshade=False
    )
    room: dict[str, Any] = {"ax": axes, "shrink": 0.62, "pad": 0.12} if scale is None else {"cax": scale}
    bar = onto.colorbar(drawn, extend="max", **room)
    bar.set_label("range error against the truth (cm)", fontsize=9, color=INK)
    bar.ax.tick_params(labelsize=8)
    low, high = centre - half, centre + half
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(tuple(half), zoom=1.05)
    axes.view_init(elev=24, azim=-160)  # from behind the sonar, a little to starboard: port is on the left
    axes.set_xlabel("forward, x (m)", fontsize=8)
    axes.set_ylabel("port, y (m)", fontsize=8)
    axes.zaxis.set_rotate_label(False)  # matplotlib would turn it upside down
    axes.set_zlabel("up, z (m)", fontsize=8, labelpad=-3, rotation=90)
    axes.tick_params(labelsize=7)
    axes.locator_params(nbins=5)
    counts = f"{counted(int(on.sum()), 'point')} on a target, {int(off.sum())} off target"
    more = f", {outside} outside" if (outside := int((~inside).sum())) else ""
    axes.set_title(f"point cloud in the true hull, one scale: {counts}{more}", fontsize=10, color=INK, y=1.05)


def draw_beams(panels: list[Axes], beams: list[Beam]) -> None:
    """Pressure in the beams on one scale (figure 18 of the thesis)."""
    peak = max(float(np.abs(beam.pressure).max()) for beam in beams)
    factor, unit = pressure_unit(peak)
    first, last = _span(beams)
    for axes, beam, number, colour in zip(panels, beams, "123", MARKS, strict=False):
        grid(axes)
        axes.plot(1e3 * beam.time, factor * beam.pressure, color=colour, linewidth=0.9)
        if np.isfinite(beam.expected):
            axes.axvline(
                1e3 * beam.expected, color=INK, linewidth=0.9, linestyle="--", label="surface on the beam's axis"
            )
        if np.isfinite(beam.measured):
            axes.axvline(1e3 * beam.measured, color=PALE, linewidth=0.9, linestyle=":", label="point of the cloud")
        axes.set_xlim(1e3 * first, 1e3 * last)
        axes.set_ylim(-1.08 * factor * peak, 1.08 * factor * peak)
        steering = f"azimuth {beam.azimuth:+.1f}, elevation {beam.elevation:+.1f} deg"
        label(
            axes,
            "time after the direct snap (ms)",
            f"beam pressure ({unit})" if number == "1" else "",
            f"{number}  {beam.name}: {steering}",
        )
    _beam_legend(panels)


def _beam_legend(panels: list[Axes]) -> None:
    """One legend of the lines at delays, under the figure."""
    named = {name: line for axes in panels for line, name in zip(*axes.get_legend_handles_labels(), strict=True)}
    if named:
        panels[0].figure.legend(named.values(), named, loc="lower center", ncols=2, fontsize=8, frameon=False)


def _span(beams: list[Beam]) -> tuple[float, float]:
    """Times (s) to draw: about the echoes, or everything where there are none."""
    first, last = min(beam.time[0] for beam in beams), max(beam.time[-1] for beam in beams)
    echoes = [t for beam in beams for t in (beam.expected, beam.measured) if np.isfinite(t)]
    if not echoes:
        return float(first), float(last)
    return float(max(first, min(echoes) - LEAD)), float(min(last, max(echoes) + LEAD))
