"""What a network is trained on: the image of a frame and its labels, as NumPy arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, Literal, get_args

import numpy as np

from sonarsynth.description import FieldError
from sonarsynth.labels.views.range_cells_met import box_of
from sonarsynth.products import View

Sample = dict[str, Any]
"""Arrays by name, and `frame`, the number of the frame."""
Image = Literal["db", "energy", "range_db", "none"]
Target = Literal["boxes", "mask", "points", "range", "range_boxes", "range_mask"]
FLOOR: Final = -60.0
"""dB re the brightest beam: what is fainter, and beams that hold nothing, are so much."""
_NEEDS: Final[dict[str, tuple[str, ...]]] = {
    "boxes": tuple(f"truth/targets/{name}" for name in ("present", "clutter", "view", "pixel_box", "category")),
    "mask": ("truth/beams/target", "truth/targets/category"),
    "range": ("truth/beams/range",),
    "points": tuple(f"cloud/{name}" for name in ("count", "x", "y", "z", "target")),
    "range_boxes": ("range_image/target", "truth/targets/clutter", "truth/targets/category"),
    "range_mask": ("range_image/target", "truth/targets/category"),
}


class SampleForm:
    """Which arrays a sample has.

    image: "db" (level re the brightest beam, at least `FLOOR`), "energy" (Pa2 s, NaN where a beam holds nothing),
    "range_db" (level re the brightest cell of the range image) or "none". targets: one or several of "boxes", "mask",
    "points", "range", "range_boxes", "range_mask". signals: whether the pressure of all hydrophones is with them.
    Raises FieldError for another word.
    """

    def __init__(self, image: str = "db", targets: str | Sequence[str] = "boxes", signals: bool = False) -> None:
        wanted = (targets,) if isinstance(targets, str) else tuple(targets)
        if image not in get_args(Image):
            raise FieldError(("image",), f"must be one of {', '.join(get_args(Image))}, not {image!r}")
        if wrong := [word for word in wanted if word not in _NEEDS]:
            raise FieldError(("targets",), f"must be of {', '.join(_NEEDS)}, not {wrong[0]!r}")
        self.image, self.targets, self.signals = image, wanted, signals

    @property
    def needs(self) -> tuple[str, ...]:
        """Paths of the arrays that samples are made of."""
        own = (self._image,) * (self.image != "none") + ("signals/pressure",) * self.signals
        return own + tuple(name for word in self.targets for name in _NEEDS[word])

    @property
    def products(self) -> tuple[str, ...]:
        """Of a build that has these arrays."""
        return tuple({name.partition("/")[0]: None for name in self.needs if not name.startswith("truth")})

    @property
    def _image(self) -> str:
        return "range_image/energy" if self.image == "range_db" else "image/energy"

    def sample(self, frame: int, of: Callable[[str], np.ndarray]) -> Sample:
        """The sample of a frame; `of` gives its arrays by path."""
        sample: Sample = {"frame": frame}
        if self.image != "none":
            energy = of(self._image)
            sample["image"] = energy if self.image == "energy" else decibels(energy)
        if self.signals:
            sample["pressure"] = of("signals/pressure")
        for word in self.targets:
            sample |= _MAKERS[word](of)
        return sample


def decibels(energy: np.ndarray) -> np.ndarray:
    """Levels (float32) re the brightest beam, at least `FLOOR`."""
    brightest = np.nanmax(energy, initial=0.0)
    if not brightest > 0.0:
        return np.full(energy.shape, FLOOR, np.float32)
    ratio = np.fmax(energy / brightest, np.float32(10.0 ** (FLOOR / 10.0)))  # of NaN and a number, the number
    return np.asarray(np.float32(10.0) * np.log10(ratio), np.float32)


def _boxes(of: Callable[[str], np.ndarray]) -> Sample:
    box, view = of("truth/targets/pixel_box"), of("truth/targets/view")
    wanted = (of("truth/targets/present") == 1) & (of("truth/targets/clutter") == 0)
    wanted &= np.isin(view, (View.IN_VIEW, View.PARTLY_IN_VIEW)) & np.isfinite(box).all(axis=-1)
    return {
        "boxes": box[wanted].astype(np.float32),
        "categories": of("truth/targets/category")[wanted].astype(np.int64),
        "targets": np.flatnonzero(wanted),
    }


def _mask(of: Callable[[str], np.ndarray], whose: str = "truth/beams/target") -> Sample:
    category = np.append(of("truth/targets/category"), np.int16(-1))  # of none, which is -1
    return {"mask": category[of(whose)].astype(np.int64)}


def _range_mask(of: Callable[[str], np.ndarray]) -> Sample:
    return {"range_mask": _mask(of, "range_image/target")["mask"]}


def _range_boxes(of: Callable[[str], np.ndarray]) -> Sample:
    whose, clutter = of("range_image/target"), of("truth/targets/clutter")
    boxes = {n: box_of(whose == n) for n in np.unique(whose[whose >= 0]).tolist() if not clutter[n]}
    return {
        "range_boxes": np.array(list(boxes.values()), np.float32).reshape(-1, 4),
        "range_categories": of("truth/targets/category")[list(boxes)].astype(np.int64),
        "range_targets": np.array(list(boxes), np.int64),
    }


def _range(of: Callable[[str], np.ndarray]) -> Sample:
    return {"range": of("truth/beams/range")}


def _points(of: Callable[[str], np.ndarray]) -> Sample:
    count = max(int(of("cloud/count")), 0)
    position = np.stack([of(f"cloud/{axis}")[:count] for axis in "xyz"], axis=-1)
    return {"points": position, "point_targets": of("cloud/target")[:count].astype(np.int64)}


_MAKERS: Final[dict[str, Callable[[Callable[[str], np.ndarray]], Sample]]] = {
    "boxes": _boxes,
    "mask": _mask,
    "range": _range,
    "points": _points,
    "range_boxes": _range_boxes,
    "range_mask": _range_mask,
}


def collate(samples: Sequence[Sample]) -> Sample:
    """A batch: arrays of one shape stacked, those that differ in length (boxes, points) as a list."""
    batch: Sample = {}
    for name in samples[0]:
        values = [np.asarray(sample[name]) for sample in samples]
        alike = len({value.shape for value in values}) == 1 and name not in _LISTS
        batch[name] = np.stack(values) if alike else values
    return batch


_LISTS: Final = frozenset(
    {"boxes", "categories", "targets", "points", "point_targets", "range_boxes", "range_categories", "range_targets"}
)
"""A list in every batch: that two frames have as many boxes is chance."""
