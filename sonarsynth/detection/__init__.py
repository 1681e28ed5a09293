"""Detection: baseline detectors on the images of a store, as a family of methods, and the form of what any finds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pydantic import TypeAdapter

from sonarsynth.conventions import Progress
from sonarsynth.description import BY_KIND, FieldError
from sonarsynth.detection.cell_averaging import CellAveraging
from sonarsynth.detection.detection_method import DetectionMethod, Region, detections_of
from sonarsynth.detection.detections import Detections, from_rows, read
from sonarsynth.detection.image_peaks import ImagePeaks
from sonarsynth.detection.sonar_view import SonarView, beam_width, beam_widths, views
from sonarsynth.store import chosen_frames, tree_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "CellAveraging",
    "DetectionMethod",
    "Detections",
    "Detector",
    "ImagePeaks",
    "Region",
    "SonarView",
    "beam_width",
    "beam_widths",
    "by_kind",
    "detect",
    "detections_of",
    "from_rows",
    "read",
    "views",
]

Detector = Annotated[ImagePeaks | CellAveraging, BY_KIND]


def detect(
    store: str | Path | xr.DataTree,
    method: DetectionMethod | str = "peaks",
    *,
    split: str | None = None,
    progress: Progress | None = None,
) -> Detections:
    """Detections in the images of a store, without a look at its truth.

    Parameters
    ----------
    store: path, URL or opened tree.
    method: a description of the family, such as `ImagePeaks(threshold=6.0)`, or its kind: "peaks", "cfar".
    split: of a store with splits, only these frames: train, validation or test.
    progress: called with the frames done, those wanted, and 0.

    Returns
    -------
    A row for each object: box, score, direction, and range where the cloud has a point in the box. `write` makes a file
    of them, `evaluate` judges them.

    Raises
    ------
    FieldError for a store without images, an unknown method or a split that the store has not.
    """
    tree = tree_of(store)
    if "image" not in tree.children:
        raise FieldError(("image",), "the store has no images: it was built without that product")
    chosen = by_kind(method) if isinstance(method, str) else method
    if isinstance(chosen, type) or not hasattr(chosen, "regions"):
        raise TypeError(f"method must be a kind such as 'peaks', or a method such as ImagePeaks(), not {chosen!r:.60}")
    frames = chosen_frames(tree, split)
    rows = []
    for done, (frame, view) in enumerate(views(tree, frames), 1):
        rows += [{"frame": frame, **detection} for detection in detections_of(view, chosen)]
        if progress is not None:
            progress(done, len(frames), 0)
    return from_rows(rows)


def by_kind(kind: str) -> DetectionMethod:
    """The method of a kind with its defaults. Raises FieldError."""
    adapter: TypeAdapter[ImagePeaks | CellAveraging] = TypeAdapter(Detector)
    try:
        return adapter.validate_python({"kind": kind})
    except ValueError:
        kinds = ", ".join(adapter.json_schema()["discriminator"]["mapping"])
        raise FieldError(("method",), f"must be one of {kinds}, not {kind!r}") from None
