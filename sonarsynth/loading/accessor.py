"""`.sonar` of the tree of a store: its points and groups as tables, frames stacked, a frame as a picture."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import xarray as xr

from sonarsynth.loading.stacking import stack
from sonarsynth.loading.tables import as_table, points_table
from sonarsynth.pictures.single_frames.frame_pictures import cloud_picture, image_picture
from sonarsynth.pictures.summary import built_of
from sonarsynth.store import built_frames, folder_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


@xr.register_datatree_accessor("sonar")  # type: ignore[no-untyped-call]
class SonarAccessor:
    """Tables and pictures of a store. The tree stays what it is: all else is plain xarray."""

    def __init__(self, tree: xr.DataTree) -> None:
        self._tree = tree

    def __repr__(self) -> str:
        """Title, frames that were built and that failed; which files are whole is known when they are read."""
        place = self._tree.encoding.get("source")
        frames = built_of(self._tree, None if place is None else folder_of(place))
        title = str(self._tree.attrs.get("title") or "untitled")
        return f"<{title}: frames {frames}; files are checked as they are read, all of them by sonarsynth.verify>"

    @property
    def frames(self) -> list[int]:
        """Numbers of the frames that were built: the others read as NaN and -1."""
        return [int(frame) for frame in built_frames(self._tree)]

    def points(self, frames: int | Iterable[int] | None = None) -> pd.DataFrame:
        """The points of some frames as a table, a row each, without padding; index: frame and point.

        frames: a number, several, or a mask (frame,) of bool; left out: all that were built. Columns are the variables
        of /cloud, with units in `.attrs["units"]` by column; labels with names (target, family, origin, lit_by) are
        categories, missing where there is none. Raises ValueError where the store has no cloud, IndexError for a
        frame that it has not, TypeError for what is no number of a frame.
        """
        return points_table(self._tree, frames)

    def table(
        self, group: str, rows: str | Iterable[str] | None = None, frames: int | Iterable[int] | None = None
    ) -> pd.DataFrame:
        """A group as a table, with a row for each combination of `rows`.

        group: such as "truth/targets" or "link_budget". rows: axes, such as ["frame", "target", "family"]; left out,
        those that most of the variables have. frames: as of `points`; one that was not built has rows of NaN. Axes of
        components (xyz, wxyz, bound, side, corner) become columns: `position_x`. Variables that have further axes are
        left out and named in `.attrs["left_out"]`; those with fewer are repeated. Flags are categories by name; other
        numbers that are -1 mean none. Units are in `.attrs["units"]`.

        Raises KeyError for a group that is not there, ValueError for an axis that it has not, or more than 20 million
        rows.
        """
        return as_table(self._tree, group, rows, frames)

    def stack(self, frames: int | Iterable[int] | None = None) -> xr.DataArray:
        """Median energy (elevation, azimuth) in Pa2 s over frames (left out: all) of a scene at rest, for faint echoes
        among loud strangers: see `loading.stacking`. Raises ValueError where there is no image or a target moves.
        """
        return stack(self._tree, frames)

    def image(self, frame: int) -> Figure:
        """The energy image of a frame with the outlines of targets and the rings of ghosts, in dB re its brightest
        beam. Raises NothingToDraw, a ValueError, where there is none.
        """
        return image_picture(self._tree, frame)

    def cloud(self, frame: int) -> Figure:
        """The point cloud of a frame in the true hulls, in 3-D, coloured by range error. Raises NothingToDraw, a
        ValueError, where the frame was not built.
        """
        return cloud_picture(self._tree, frame)
