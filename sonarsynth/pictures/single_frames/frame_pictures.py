"""The energy image of a frame, or its point cloud, as a figure: the panels of the sheet, each by itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sonarsynth.pictures import frame_view
from sonarsynth.pictures.figures.frame_figure import View, window
from sonarsynth.pictures.figures.ghost_rings import GhostMarks
from sonarsynth.pictures.figures.sheet import Errors, draw_cloud, draw_image
from sonarsynth.pictures.figures.style import INK, figure, settle
from sonarsynth.pictures.store_reading import NothingToDraw, StoredFrame, beam_grid, built, stored

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


def image_picture(tree: xr.DataTree, frame: int) -> Figure:
    """The energy image with outlines and ghosts, in dB re its brightest beam. Raises NothingToDraw."""
    _, view = _read(tree, frame)
    if view.level is None:
        raise NothingToDraw(f"frame {frame} has no image")
    fig = figure(7.6, 6.0, dpi=110)
    fig.suptitle(f"{view.title}   {view.moment}", x=0.01, ha="left", fontsize=11, color=INK)
    axes = fig.add_subplot()
    outlines = draw_image(axes, *beam_grid(tree), view, "energy re the brightest beam (dB)")
    settle(fig)
    GhostMarks(axes).show(view.ghosts, view.lobes, outlines)
    return fig


def cloud_picture(tree: xr.DataTree, frame: int) -> Figure:
    """The points in the true hulls, in 3-D, coloured by range error. Raises NothingToDraw."""
    stored_frame, view = _read(tree, frame)
    fig = figure(7.6, 6.0, dpi=110)
    fig.suptitle(f"{view.title}   {view.moment}", x=0.01, ha="left", fontsize=11, color=INK)
    axes = fig.add_subplot(projection="3d")
    draw_cloud(axes, fig, view, Errors(stored_frame.points, stored_frame.range_error), window([view]))
    return fig


def _read(tree: xr.DataTree, frame: int) -> tuple[StoredFrame, View]:
    if frame not in range(total := tree["truth"].sizes["frame"]):
        raise NothingToDraw(f"frame {frame!r} is outside 0..{total - 1}")
    if frame not in built(tree):
        raise NothingToDraw(f"frame {frame} has not been built")
    stored_frame = stored(tree, frame)
    return stored_frame, frame_view(tree, stored_frame)
