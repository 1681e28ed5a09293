"""Energy images of several stores side by side, with what differs between them over each and its numbers under it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.pictures.figures.frame_figure import (
    Hull,
    blank,
    clipped,
    edges,
    image_axes,
    outline_artist,
    set_outlines,
)
from sonarsynth.pictures.figures.ghost_rings import Ghost, GhostMarks
from sonarsynth.pictures.figures.style import INK, PALE, figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

WIDTHS = {1: 5.2, 2: 4.4, 3: 3.6, 4: 3.0}
"""Width (inches) of a panel by the number of stores, in one row; of more rows `SMALLER` times that."""
SMALLER = 0.8

LEFT, RIGHT, GAP = 2.5, 0.85, 0.14
"""Inches: left of the panels for names, right of them for the colours, between them."""

HEADING, AXIS, LINE, BOTTOM = 0.5, 0.6, 0.215, 0.18
"""Inches: for the heading, under the panels, of a line of text, and under all."""

LETTERS = 10.5
"""Letters of a title in an inch."""


@dataclass(frozen=True, eq=False)
class Column:
    """A store: what differs about it, and its numbers by name, the same names for all."""

    name: str
    numbers: Mapping[str, str]


@dataclass(frozen=True, eq=False)
class Panel:
    """A frame of a store."""

    level: Floats | None  # (elevation, azimuth) dB re the brightest beam of the store; None without an image
    hulls: tuple[Hull, ...]
    ghosts: tuple[Ghost, ...] = ()
    lobes: tuple[Floats, ...] = ()  # (point, azimuth and elevation) deg: grating lobes


@dataclass(frozen=True, eq=False)
class Moment:
    """A frame of all stores."""

    name: str  # lines, such as "frame 3" and "0.30 s"
    panels: tuple[Panel, ...]


class BesidePicture:
    """A figure laid out once, a column a store and a row a moment; `show` draws moments in place of the last."""

    def __init__(
        self,
        azimuth: Floats,
        elevation: Floats,
        columns: Sequence[Column],
        heading: str,
        note: str = "",
        rows: int = 1,
        of: str = "each film",
    ) -> None:
        """Lay out for a beam grid (deg, ascending). `note` stands beneath the numbers; levels are re the brightest beam
        of what `of` says.
        """
        across, up = (np.ptp(edges(angle)) for angle in (azimuth, elevation))
        self._width = WIDTHS[len(columns)] * (SMALLER if rows > 1 else 1.0)
        self._height = float(np.clip(self._width * up / across, 0.25 * self._width, 1.6 * self._width))
        letters = int(LETTERS * self._width)
        titles = ["\n".join(wrap(column.name, letters, max_lines=2, placeholder=" ...")) for column in columns]
        table = LINE * (len(columns[0].numbers) + 1.3 * bool(note)) + BOTTOM
        below = table + AXIS
        top = below + rows * (self._height + GAP) - GAP
        self._size = (
            LEFT + len(columns) * (self._width + GAP) + RIGHT,
            top + 0.1 + LINE * max(title.count("\n") + 1 for title in titles) + HEADING,
        )
        self.figure: Figure = figure(*self._size, dpi=100)
        self.figure.set_layout_engine("none")
        self._text(0.15, self._size[1] - 0.3, heading, fontsize=12)
        places = [[self._axes(r, c, below, rows) for c in range(len(columns))] for r in range(rows)]
        self._images = [[image_axes(axes, azimuth, elevation) for axes in row] for row in places]
        self._ghosts = [[GhostMarks(axes) for axes in row] for row in places]
        self._outlines = [[outline_artist(axes) for axes in row] for row in places]
        for row in places:
            for axes in row:
                _tidy(axes, left=axes is row[0], bottom=row is places[-1])
        self._names = [self._text(0.15, top - r * (self._height + GAP), "", va="top") for r in range(rows)]
        for c, title in enumerate(titles):
            self._text(self._left(c), top + 0.1, title, fontsize=10.5, fontweight="bold", linespacing=1.15)
        self._table(columns, table, note)
        self._bar(top, below, of)

    def show(self, *moments: Moment) -> None:
        """Draw moments, a row each, in place of the last."""
        for row, moment in enumerate(moments):
            self._names[row].set_text(moment.name)
            for image, panel in zip(self._images[row], moment.panels, strict=True):
                shape = image.get_array()
                assert shape is not None
                absent = panel.level is None
                image.set_data(blank(shape.shape) if absent else _drawn(panel.level))
            for marks, artist, panel in zip(self._ghosts[row], self._outlines[row], moment.panels, strict=True):
                marks.show(panel.ghosts, panel.lobes, set_outlines(artist, panel.hulls))

    def _text(self, x: float, y: float, text: str, **style: object) -> Text:
        """A text at inches from the lower left corner."""
        look = {"fontsize": 9, "color": INK, "ha": "left", "va": "baseline"} | style
        return self.figure.text(x / self._size[0], y / self._size[1], text, **look)  # type: ignore[arg-type]

    def _left(self, column: int) -> float:
        """Inches from the left to a column."""
        return LEFT + column * (self._width + GAP)

    def _axes(self, row: int, column: int, below: float, rows: int) -> Axes:
        y = below + (rows - 1 - row) * (self._height + GAP)
        (w, h), size = self._size, (self._width, self._height)
        return self.figure.add_axes((self._left(column) / w, y / h, size[0] / w, size[1] / h))

    def _table(self, columns: Sequence[Column], top: float, note: str) -> None:
        """The numbers under each column, their names at the left, faint lines between."""
        from matplotlib.lines import Line2D

        w, h = self._size
        for row, name in enumerate(columns[0].numbers):
            y = top - (row + 1) * LINE + 0.06
            self._text(0.15, y, name, color="#555555")
            for c, column in enumerate(columns):
                self._text(self._left(c), y, column.numbers[name])
            ends = [0.15 / w, (self._left(len(columns)) - GAP) / w]
            self.figure.add_artist(Line2D(ends, [(y - 0.06) / h] * 2, color="#e4e4e4", linewidth=0.6))
        self._text(0.15, BOTTOM, note, fontsize=8, color=PALE)

    def _bar(self, top: float, below: float, of: str) -> None:
        """One scale of colours for all panels."""
        w, h = self._size
        bar_axes = self.figure.add_axes(((w - RIGHT) / w, below / h, 0.14 / w, (top - below) / h))
        bar = self.figure.colorbar(self._images[0][0], cax=bar_axes, extend="min")
        long = f"energy re the brightest beam of {of} (dB)"
        bar.set_label(long if top - below > 3.2 else "energy (dB)", fontsize=8.5, color=INK)
        bar.ax.tick_params(labelsize=8)


def _drawn(level: Floats | None) -> np.ma.MaskedArray:
    """Levels as an image with port on the left."""
    return np.ma.masked_invalid(clipped(np.asarray(level)))[:, ::-1]


def _tidy(axes: Axes, left: bool, bottom: bool) -> None:
    """Names and numbers of axes at the left and at the bottom only."""
    axes.set_title("", loc="left")
    axes.tick_params(left=left, bottom=bottom, labelleft=left, labelbottom=bottom)
    axes.set_xlabel("azimuth (deg), port on the left" if bottom else "", fontsize=8.5)
    axes.set_ylabel("elevation (deg)" if left else "", fontsize=8.5)
