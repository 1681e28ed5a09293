"""One frame as the sonar looks: the energy image with the targets' true outlines, and the cloud from two sides."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats, Ints, counted
from sonarsynth.pictures.figures.ghost_rings import Ghost, GhostMarks, legend
from sonarsynth.pictures.figures.outlines import FILM_CELLS, union_outline, view_outline
from sonarsynth.pictures.figures.style import (
    BACKDROP,
    DYNAMIC_RANGE,
    ENERGY_MAP,
    INK,
    OUTLINES,
    figure,
    label,
    placed,
    settle,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import PathCollection, PolyCollection
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage
    from matplotlib.text import Text


ABSENT = "#9b9b9b"
"""Beams without a number."""

EARLIER = "#8f8f96"
"""Points of earlier frames."""

PLAN = (1, 0)
SIDE = (0, 2)
"""Coordinates (across, up) of a cloud drawn from above and from starboard."""


@dataclass(frozen=True, eq=False)
class Hull:
    """A target where it truly is, in the sonar frame."""

    name: str
    vertices: Floats  # (vertex, xyz) m
    faces: Ints  # (facet, 3)


@dataclass(frozen=True, eq=False)
class View:
    """What is drawn of one frame. An image or cloud that is not there is None or empty."""

    title: str  # of the store
    level: Floats | None  # (elevation, azimuth) dB re the reference of the film
    points: Floats  # (point, xyz) m, sonar frame
    point_level: Floats  # (point,) dB re the same
    hulls: tuple[Hull, ...]
    ghosts: tuple[Ghost, ...] = ()
    lobes: tuple[Floats, ...] = ()  # (point, azimuth and elevation) deg: grating lobes
    moment: str = ""  # which frame it is, and when
    earlier: Floats = field(default_factory=lambda: np.zeros((0, 3)))  # (point, xyz) m: points of frames before


@dataclass(frozen=True, eq=False)
class Window:
    """The part of space that a cloud is drawn in: half its size is the same in every frame, its centre follows."""

    half: Floats  # (xyz) m

    def centre(self, view: View) -> Floats:
        """Centre (xyz) in m: of the targets; without any, of the points."""
        bodies = [hull.vertices for hull in view.hulls] or ([view.points] if len(view.points) else [])
        if not bodies:
            return np.zeros(3)
        corners = np.concatenate([[b.min(axis=0), b.max(axis=0)] for b in bodies])
        return np.asarray(0.5 * (corners.min(axis=0) + corners.max(axis=0)))


def window(views: list[View], margin: float = 0.35) -> Window:
    """A window that holds the targets of every frame (without any: the middle 96 % of all points), and `margin` (m)."""
    half = np.zeros(3)
    for view in views:
        if view.hulls:
            every = np.concatenate([hull.vertices for hull in view.hulls])
            half = np.maximum(half, 0.5 * np.ptp(every, axis=0))
    points = np.concatenate([view.points for view in views])
    if not half.any() and len(points):
        half = 0.5 * np.ptp(np.percentile(points, [2, 98], axis=0), axis=0)
    return Window(half=half + margin)


def darkest(levels: list[Floats | None]) -> float:
    """Where the scale of some levels (dB) begins: a multiple of 5 under nearly all of each, so that noise is dark, but
    no less than `DYNAMIC_RANGE` below the reference."""
    heard = [level[np.isfinite(level)] for level in levels if level is not None]
    faint = min((float(np.percentile(level, 1)) for level in heard if level.size), default=-DYNAMIC_RANGE)
    return float(max(5.0 * np.floor(min(faint, -5.0) / 5.0), -DYNAMIC_RANGE))


class FramePicture:
    """A figure laid out once, in which `show` draws one frame after another."""

    def __init__(self, azimuth: Floats, elevation: Floats, views: list[View], unit: str) -> None:
        """Lay out for a beam grid (deg, ascending) and all that will be shown; `unit`: what levels are relative to."""
        self.figure: Figure = figure(11.0, 5.6, "none", dpi=100)
        self.window = window(views)
        self._title: Text = self.figure.suptitle(" ", x=0.01, y=0.99, ha="left", fontsize=11, color=INK)
        self._moment: Text = self.figure.text(0.0, 0.0, "", fontsize=11, color=INK, va="top")
        sky = placed(self.figure, 0.77, 0.45, 4.6, 4.6)
        self._image: AxesImage = image_axes(sky, azimuth, elevation, darkest([view.level for view in views]))
        self._outlines: PolyCollection = outline_artist(sky)
        self._ghosts = GhostMarks(sky)
        legend(sky, *(any(getattr(view, of) for view in views) for of in ("hulls", "ghosts", "lobes")))
        colour_bar(sky, self._image, unit)
        least = darkest([np.concatenate([view.point_level for view in views]) - 10.0])  # no point is black
        self._clouds = [
            CloudPanel(placed(self.figure, 7.17, 3.1, 3.13, 1.95), PLAN, "from above", least),
            CloudPanel(placed(self.figure, 7.17, 0.45, 3.13, 1.95), SIDE, "from starboard", least),
        ]
        self._arranged = False

    def show(self, view: View) -> None:
        """Draw a frame in place of the last."""
        self._moment.set_text(view.moment)
        shape = self._image.get_array()
        if view.level is not None:
            self._image.set_data(np.ma.masked_invalid(clipped(view.level))[:, ::-1])
        elif shape is not None:
            self._image.set_data(blank(shape.shape))
        outlines = set_outlines(self._outlines, view.hulls)
        for panel in self._clouds:
            panel.show(view, self.window)
        if not self._arranged:  # arranged once, for axes that move from frame to frame are hard to watch
            self._title.set_text(view.title)
            settle(self.figure)
            self._moment.set_position(end_of(self._title))
            self._arranged = True
        self._ghosts.show(view.ghosts, view.lobes, outlines)


class CloudPanel:
    """A cloud and the targets' true hulls, projected along one axis of the sonar frame."""

    def __init__(self, axes: Axes, plane: tuple[int, int], name: str, least: float) -> None:
        """Set up the axes; `plane` is `PLAN` or `SIDE`, least (dB) the beginning of the scale of levels."""
        from matplotlib.collections import PolyCollection

        names = ("beyond the target (m)", "port of the target (m)", "above the target (m)")
        self.axes, self.plane = axes, plane
        axes.set_facecolor(BACKDROP)
        axes.set_aspect("equal", adjustable="box")
        label(axes, names[plane[0]], names[plane[1]], f"points {name}, energy of {least:.0f} to 0 dB")
        self._hulls: PolyCollection = PolyCollection([], linewidths=1.0)
        axes.add_collection(self._hulls, autolim=False)
        self._earlier: PathCollection = axes.scatter([], [], s=4, linewidths=0, color=EARLIER)
        self._points: PathCollection = axes.scatter(
            [], [], c=[], s=9, linewidths=0, cmap=ENERGY_MAP, vmin=least, vmax=0
        )
        self._note: Text = axes.text(0.02, 0.04, "", transform=axes.transAxes, fontsize=8, color="#e8e8e8")

    def show(self, view: View, space: Window) -> None:
        """Draw a frame in place of the last."""
        across, up = self.plane
        centre, half = space.centre(view), space.half
        reach = max(half[across], 1.6 * half[up])
        sign = -1.0 if across == 1 else 1.0  # port on the left
        self.axes.set_xlim(-sign * reach, sign * reach)
        self.axes.set_ylim(-reach / 1.6, reach / 1.6)
        bodies = [(hull.vertices - centre)[:, self.plane] for hull in view.hulls]
        fill_hulls(self._hulls, bodies, [hull.faces for hull in view.hulls])
        self._earlier.set_offsets((view.earlier - centre)[:, self.plane])
        at = (view.points - centre)[:, self.plane]
        self._points.set_offsets(at)
        self._points.set_array(clipped(view.point_level))
        outside = int((np.abs(at) > [reach, reach / 1.6]).any(axis=1).sum())
        before = f", grey: {len(view.earlier)} of earlier frames" if len(view.earlier) else ""
        hidden = f"{outside} outside" if outside else ""
        every = counted(len(at), "point") + (f" ({hidden})" if hidden else "") + before
        self._note.set_text(every if self.plane == PLAN else hidden)


def clipped(level: Floats) -> Floats:
    """Levels (dB) with silence at the end of the scale; NaN stays NaN."""
    return np.where(np.isneginf(level), -10.0 * DYNAMIC_RANGE, level)


def blank(shape: tuple[int, ...]) -> np.ma.MaskedArray:
    """Levels that are all absent; zeros, for memory as it comes may hold numbers that warn."""
    return np.ma.array(np.zeros(shape), mask=True)


def image_axes(axes: Axes, azimuth: Floats, elevation: Floats, least: float = -DYNAMIC_RANGE) -> AxesImage:
    """Axes of an energy image over a beam grid (deg, ascending), port on the left, of levels from least (dB) to 0;
    returns the empty image."""
    from matplotlib import colormaps

    colours = colormaps[ENERGY_MAP].with_extremes(bad=ABSENT)
    (left, right), (low, high) = edges(azimuth), edges(elevation)
    image = axes.imshow(
        blank((len(elevation), len(azimuth))),
        extent=(right, left, low, high),
        origin="lower",
        cmap=colours,
        vmin=least,
        vmax=0.0,
        interpolation="nearest",
    )
    label(axes, "azimuth (deg), port on the left", "elevation (deg), up positive")
    axes.set_autoscale_on(False)  # marks outside are not drawn
    return image


def colour_bar(axes: Axes, image: AxesImage, unit: str) -> None:
    """The scale of an image beside it, as high as the image."""
    bar_axes = axes.inset_axes((1.02, 0.0, 0.035, 1.0))
    bar = axes.figure.colorbar(image, cax=bar_axes, extend="min")
    bar.set_label(unit, fontsize=9, color=INK)
    bar.ax.tick_params(labelsize=8)


def edges(centres: Floats) -> tuple[float, float]:
    """Outer edges of the first and the last cell of an even grid."""
    half = 0.5 * float(centres[1] - centres[0]) if len(centres) > 1 else 0.5
    return float(centres[0]) - half, float(centres[-1]) + half


def outline_artist(axes: Axes) -> PolyCollection:
    """An empty collection of outlines on an energy image."""
    from matplotlib.collections import PolyCollection

    artist = PolyCollection([], facecolors="none", linewidths=1.2)
    axes.add_collection(artist, autolim=False)
    return artist


def set_outlines(artist: PolyCollection, hulls: tuple[Hull, ...]) -> list[Floats]:
    """Draw the outlines of targets as the sonar sees them; returns them: lines (point, azimuth and elevation), deg."""
    lines: list[Floats] = []
    colours: list[str] = []
    for i, hull in enumerate(hulls):
        outline = view_outline(hull.vertices, hull.faces, FILM_CELLS)
        lines += [np.asarray(np.rad2deg(line)) for line in outline]
        colours += [OUTLINES[i % len(OUTLINES)]] * len(outline)
    artist.set_verts(lines)
    artist.set_edgecolor(colours)
    return lines


def fill_hulls(artist: PolyCollection, bodies: list[Floats], faces: list[Ints]) -> None:
    """Draw hulls: points (vertex, 2) in a plane and facets (facet, 3) of each."""
    from matplotlib.colors import to_rgba

    lines, colours = [], []
    for i, (points, facets) in enumerate(zip(bodies, faces, strict=True)):
        outline = union_outline(points, facets, FILM_CELLS)
        lines += outline
        colours += [OUTLINES[i % len(OUTLINES)]] * len(outline)
    artist.set_verts(lines)
    artist.set_edgecolor(colours)
    artist.set_facecolor([to_rgba(colour, 0.18) for colour in colours])


def end_of(text: Text) -> tuple[float, float]:
    """Where a line of text goes on after its end and three spaces (shares of the figure)."""
    assert text.figure is not None
    spaces = 0.95 * float(text.get_fontsize()) * text.figure.dpi / 72.0
    return float((text.get_window_extent().x1 + spaces) / text.figure.bbox.width), float(text.get_position()[1])
