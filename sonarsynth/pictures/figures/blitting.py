"""Figures of which only what changes is drawn anew: films."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Bytes

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage


class Blitting:
    """A figure that is laid out, with images and other artists that change from frame to frame."""

    def __init__(self, figure: Figure, images: Sequence[AxesImage], changing: Iterable[Artist]) -> None:
        """Draw what stays. images: `imshow` of even cells, in their final places; changing: other artists."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        assert isinstance(figure.canvas, FigureCanvasAgg)
        self._figure, self._canvas = figure, figure.canvas
        edges = [spine for axes in figure.axes for spine in axes.spines.values()]
        hidden = [artist for artist in (*images, *changing, *edges) if artist.get_visible()]
        for artist in hidden:
            artist.set_visible(False)
        self._canvas.draw()
        self._images = [(image, _cells(image)) for image in images]  # drawing has put axes of equal scales into place
        self._behind = self._canvas.copy_from_bbox(figure.bbox)
        bare = self._shot()
        for spine in edges:  # images lie on the edges of axes, which are put back as they were drawn
            if spine in hidden:
                spine.set_visible(True)
                figure.draw_artist(spine)
        framed = self._shot()
        self._edges = np.nonzero((framed != bare).any(axis=2))
        self._edge_colours = framed[self._edges]
        for artist in hidden:
            artist.set_visible(True)

    def _shot(self) -> Bytes:
        return np.array(self._canvas.buffer_rgba())

    def pixels(self, changing: Iterable[Artist]) -> Bytes:
        """The figure (row, column, rgba) with its images as they are now, and artists on them, the rearmost first."""
        self._canvas.restore_region(self._behind)
        buffer = np.asarray(self._canvas.buffer_rgba()).view(np.uint32)[..., 0]  # four bytes at once
        for image, (area, rows, columns) in self._images:
            shown = image.get_array()
            assert shown is not None
            colours = image.to_rgba(shown, bytes=True).view(np.uint32)[..., 0]
            buffer[area] = colours[rows[:, None], columns]
        for artist in changing:
            self._figure.draw_artist(artist)
        drawn = self._shot()
        drawn[self._edges] = self._edge_colours
        return drawn


def _cells(image: AxesImage) -> tuple[tuple[slice, slice], np.ndarray, np.ndarray]:
    """The pixels (rows, columns) that an image fills, and its cell in each row and column: the nearest, as `imshow`
    draws it, but without its resampling."""
    array, axes = image.get_array(), image.axes
    assert array is not None and axes is not None
    left, right, bottom, top = image.get_extent()
    (x0, y0), (x1, y1) = axes.transData.transform([(left, bottom), (right, top)])
    height = round(axes.figure.bbox.height)
    columns = round(x0) + np.arange(int(np.ceil(x1 - x0)))
    rows = height - round(y0) - np.arange(int(np.ceil(y1 - y0)), 0, -1)
    across = np.clip((columns + 0.5 - x0) / (x1 - x0) * array.shape[1], 0, array.shape[1] - 1).astype(int)
    up = np.clip((height - rows - 0.5 - y0) / (y1 - y0) * array.shape[0], 0, array.shape[0] - 1).astype(int)
    return (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)), up, across
