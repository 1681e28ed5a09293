"""Frames for training: of a store, in random order, or rendered from a recipe as they are wanted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import SupportsIndex

import numpy as np

from sonarsynth.description import FieldError
from sonarsynth.loading.training_samples import Sample, SampleForm, collate
from sonarsynth.pipeline import render
from sonarsynth.planning import plan
from sonarsynth.products import SPLITS
from sonarsynth.randomness import stream
from sonarsynth.recipe import Recipe
from sonarsynth.store.frame_reading import FrameReader
from sonarsynth.store.marks import must_hold_files, warn_unmarked


class Frames:
    """The built frames of a store as a map-style dataset: `len`, `[]`, and batches by `__getitems__`.

    Parameters
    ----------
    store: path of a folder of this machine.
    split: train, validation or test; left out: all frames that were built.
    image: "db" (level re the brightest beam, -60 at least), "energy" (Pa2 s), "range_db" (the range image: level re
        its brightest cell, -60 at least) or "none".
    targets: one or several of
        "boxes": `boxes` (box, 4) as `pixel_box`, `categories` (box,), `targets` (box,), their slots;
        "mask": `mask` (elevation, azimuth), the category that each beam points at, -1 for none;
        "points": `points` (point, xyz), m, sonar frame, and `point_targets` (point,), -1 for none;
        "range": `range` (elevation, azimuth), m, NaN where a beam meets nothing;
        "range_boxes": `range_boxes` (box, 4) about the cells (range, azimuth) that beams meet each target in, as
            `pixel_box` is in beams, `range_categories` and `range_targets` (box,);
        "range_mask": `range_mask` (range, azimuth), the category that beams meet in each cell, -1 for none.
    signals: whether `pressure` (sensor, sample), Pa, is with them.

    A sample is a dict of NumPy arrays, numbers float32 and labels int64, which torch, JAX and Keras take. It can be
    pickled and read from several processes. `collate` makes a batch of samples.

    Raises FieldError for a word that is not among these or a split without frames, KeyError for what the store has not,
    Mismatch where there is no store of this format, Damage for a file that is missing, and, when a frame is read, for
    one that is damaged.
    """

    collate = staticmethod(collate)

    def __init__(
        self,
        store: str | Path,
        *,
        split: str | None = None,
        image: str = "db",
        targets: str | Sequence[str] = "boxes",
        signals: bool = False,
    ) -> None:
        self._reader = FrameReader(store)
        self._form = SampleForm(image, targets, signals)
        if missing := [name for name in self._form.needs if name not in self._reader]:
            raise KeyError(f"{missing[0]}: the store was built without it")
        warn_unmarked(self._reader.root)
        must_hold_files(self._reader.root, ("truth/sonar_position", *self._form.needs))
        chosen = np.isfinite(self._reader.array("truth/sonar_position").every()[:, 0])
        if split is not None:
            chosen &= self._reader.array("split").every() == _number(split)
        self.frames = _not_empty(np.flatnonzero(chosen), split)
        """(row,) the number in the store of each."""
        flags = str(self._reader.attributes_of("truth/targets/category").get("flag_meanings", "target"))
        self.categories = tuple(flags.split())
        """What the numbers of categories stand for."""

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, row: int) -> Sample:
        """A sample. Raises IndexError for a row that is not there, TypeError for what is no whole number."""
        if not isinstance(row, SupportsIndex):
            raise TypeError(f"a sample is chosen by a whole number, not by {row!r}")
        frame = int(self.frames[row])
        return self._form.sample(frame, lambda name: self._reader.array(name)[frame])

    def __getitems__(self, rows: Sequence[int]) -> list[Sample]:
        """Several, as torch asks for them: each file is read in its order."""
        samples = {row: self[row] for row in sorted(rows, key=lambda row: int(self.frames[row]))}
        return [samples[row] for row in rows]


class RenderedFrames:
    """The frames of a recipe as an iterable dataset without a store: each is rendered when it is its turn.

    Samples are as those of `Frames`. They come in an order that `seed` draws; `part` = (k, n) takes each n-th from the
    k-th on, k from 0, for n processes. Raises FieldError as `Frames` and `plan` do, ValueError for another part.
    """

    collate = staticmethod(collate)

    def __init__(
        self,
        recipe: Recipe,
        *,
        split: str | None = None,
        image: str = "db",
        targets: str | Sequence[str] = "boxes",
        signals: bool = False,
        seed: int = 0,
        part: tuple[int, int] = (0, 1),
    ) -> None:
        if not 0 <= part[0] < part[1]:
            raise ValueError(f"part must be (k, n) with k from 0 to n - 1, not {part}")
        self._form = SampleForm(image, targets, signals)
        self._plan = plan(recipe, products=self._form.products)
        candidates = np.arange(recipe.frames)
        if split is not None:
            number = _number(split)
            candidates = np.array([frame for frame in candidates.tolist() if recipe.split(frame) == number], int)
        self.frames = stream(seed, "training order").permutation(_not_empty(candidates, split))[part[0] :: part[1]]
        """(row,) the number in the recipe of each, in the order that they come."""
        self.categories = recipe.categories

    def __len__(self) -> int:
        return len(self.frames)

    def __iter__(self) -> Iterator[Sample]:
        for frame in self.frames.tolist():
            tree = render(self._plan, frame)
            yield self._form.sample(frame, lambda name, of=tree: np.asarray(of[name].values))  # type: ignore[misc]


def _not_empty(frames: np.ndarray, split: str | None) -> np.ndarray:
    """The same frames. Raises FieldError for a split that has none."""
    if split is not None and not len(frames):
        raise FieldError(("split",), f"{split} has no frames")
    return frames


def _number(split: str) -> int:
    if split not in SPLITS:
        raise FieldError(("split",), f"must be one of {', '.join(SPLITS)}, not {split!r}")
    return SPLITS.index(split)
