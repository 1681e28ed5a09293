"""Ghosts and grating lobes in an energy image: rings at mirrored targets, lines where the lattice repeats an echo."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.pictures.figures.style import BACKDROP, OUTLINES

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D
    from matplotlib.text import Annotation

RING = 9.0
"""Diameter of a ring (points)."""

GAP = 4.0
"""Free space (points) between a ring and its label."""

LOBE: dict[str, Any] = {"color": "#c9f7ff", "linewidth": 1.0, "linestyle": (0, (1, 2))}
"""How a grating lobe is drawn."""

ARROWS = {(0, 1): "^", (0, -1): "v", (1, 0): ">", (-1, 0): "<"}
"""Markers for ghosts outside the picture, by (right, up)."""


@dataclass(frozen=True)
class Ghost:
    """Where a target's echoes come from that touched a boundary on their way to the array."""

    name: str  # "surface ghost"
    target: int
    azimuth: float  # deg
    elevation: float  # deg
    level: float  # dB re the direct echo of the target


class GhostMarks:
    """Marks on the axes of an energy image; `show` draws those of one frame in place of the last."""

    def __init__(self, axes: Axes) -> None:
        self._axes = axes
        self.drawn: list[Artist] = []
        """What is drawn of this frame."""

    def show(
        self, ghosts: tuple[Ghost, ...], lobes: tuple[Floats, ...], outlines: list[Floats], clear: float = GAP
    ) -> None:
        """Draw ghosts, labels `clear` points off the outlines of targets, and grating lobes.

        lobes, outlines: lines (point, azimuth and elevation) in deg. The axes must have their final place: labels are
        laid out on it. A ghost outside is an arrow at the edge.
        """
        from matplotlib.collections import LineCollection

        for artist in self.drawn:
            artist.remove()
        axes = self._axes
        self.drawn = []
        if lobes:
            self.drawn.append(axes.add_collection(LineCollection(lobes, **LOBE), autolim=False))
        point = axes.figure.dpi / 72.0  # in pixels
        frame = np.asarray(axes.get_window_extent().extents)
        inside = frame + GAP * point * np.array([1.0, 1.0, -1.0, -1.0])
        taken = [box_of(axes.transData.transform(line), clear * point) for line in outlines]
        marks = []
        for ghost in ghosts:
            true = axes.transData.transform((ghost.azimuth, ghost.elevation))
            at = np.clip(true, frame[:2] + RING * point, frame[2:] - RING * point)
            taken.append(box_of(at[None], 0.6 * RING * point))
            marks.append((ghost, at, _marker(true, frame)))
        for ghost, at, marker in marks:
            ring, text = self._mark(ghost, at, marker)
            size = np.asarray(text.get_window_extent().size)
            middle = place(at, size, (0.5 * RING + GAP) * point, inside, taken)
            text.xyann = (middle - at) / point
            taken.append(np.concatenate([middle - 0.5 * size, middle + 0.5 * size]))
            self.drawn += [ring, text]

    def _mark(self, ghost: Ghost, at: Floats, marker: str) -> tuple[Line2D, Annotation]:
        """Its ring or arrow at a pixel (x, y), and its label, still in the middle of it."""
        from matplotlib.lines import Line2D
        from matplotlib.patheffects import withStroke

        colour = OUTLINES[ghost.target % len(OUTLINES)]
        x, y = map(float, self._axes.transData.inverted().transform(at))
        ring = Line2D([x], [y], marker=marker, markersize=RING, markerfacecolor="none", markeredgecolor=colour)
        ring.set(markeredgewidth=1.3, path_effects=[withStroke(linewidth=3.0, foreground=BACKDROP)])
        self._axes.add_line(ring)
        text = self._axes.annotate(
            ghost.name,
            (x, y),
            (0, 0),
            textcoords="offset points",
            ha="center",
            va="center",
            color="white",
            fontsize=8.5,
        )
        text.set_path_effects([withStroke(linewidth=2.0, foreground=BACKDROP)])
        for artist in (ring, text):
            artist.set_in_layout(False)
        return ring, text


def legend(axes: Axes, outlines: bool, ghosts: bool, lobes: bool) -> None:
    """What outlines, rings (of ghosts) and lines (of lobes) mean, where they are drawn, over the axes of an image."""
    from matplotlib.lines import Line2D

    ring: dict[str, Any] = {
        "linestyle": "",
        "marker": "o",
        "markersize": 6,
        "markerfacecolor": "none",
        "color": OUTLINES[0],
    }
    handles = [Line2D([], [], color=OUTLINES[0], label="true outline")] if outlines else []
    handles += [Line2D([], [], label="ghost by surface or bottom", **ring)] if ghosts else []
    handles += [Line2D([], [], label="grating lobe", **LOBE)] if lobes else []
    location: dict[str, Any] = {
        "loc": "lower left",
        "bbox_to_anchor": (0.0, 1.0),
        "ncols": 3,
        "borderaxespad": 0.9,
        "columnspacing": 1.2,
    }
    if handles:
        axes.legend(handles=handles, fontsize=7.5, labelcolor="white", facecolor=BACKDROP, framealpha=1.0, **location)


def box_of(points: Floats, margin: float) -> Floats:
    """(left, bottom, right, top) of points (point, 2), with a margin."""
    return np.concatenate([points.min(axis=0) - margin, points.max(axis=0) + margin])


def _marker(at: Floats, frame: Floats) -> str:
    """A ring inside the frame; else an arrow to the side on which the point is farthest outside."""
    over = np.maximum(frame[:2] - at, at - frame[2:])
    axis = int(np.argmax(over))
    if over[axis] <= 0.0:
        return "o"
    sign = 1 if at[axis] > frame[axis] else -1
    return ARROWS[(sign, 0) if axis == 0 else (0, sign)]


def place(at: Floats, size: Floats, gap: float, frame: Floats, taken: list[Floats]) -> Floats:
    """Middle (x, y) of a label beside a mark: inside the frame and on nothing that is taken, if there is such a place.

    at (x, y) of the mark; size (width, height) of the label; gap from the mark to the label; frame and taken: boxes
    (left, bottom, right, top), all in pixels. Away from the middle of the frame first, then towards it, then beside.
    Where all four places are taken, the one that covers least.
    """
    outward = 1.0 if 2.0 * at[1] >= frame[1] + frame[3] else -1.0
    inward = 1.0 if 2.0 * at[0] < frame[0] + frame[2] else -1.0
    steps = gap + 0.5 * np.asarray(size)
    sides = np.array([[0.0, outward], [0.0, -outward], [inward, 0.0], [-inward, 0.0]])
    half = 0.5 * np.asarray(size)
    low, high = frame[:2] + half, np.maximum(frame[2:] - half, frame[:2] + half)
    places = np.clip(at + sides * steps, low, high)
    covered = [sum(_overlap(np.concatenate([p - half, p + half]), box) for box in taken) for p in places]
    return np.asarray(places[int(np.argmin(covered))])


def _overlap(a: Floats, b: Floats) -> float:
    """Common area of two boxes."""
    return float(np.prod(np.maximum(np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2]), 0.0)))
