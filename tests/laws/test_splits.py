"""Splits: by sequence, in the shares asked for, and nothing of one in another."""

from __future__ import annotations

from collections import Counter
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sonarsynth.planning import plan
from sonarsynth.products import SPLITS
from sonarsynth.recipe import Axis, Choice, Recipe, Splits, Uniform
from sonarsynth.recipe.splits import assign
from tests.laws.test_sequences import MOTION, SHRIMP, recipe

HULLS = Axis(
    name="hull",
    path="scene.world.targets.0.shape",
    values=({"kind": "sphere", "radius": "0.5 m"}, {"kind": "box", "size": [1, 1, 1]}),
)
VARIED = (
    Uniform(path=f"{MOTION}.start.0", low="8 m", high="15 m"),
    Uniform(path=f"{MOTION}.heading", low="0 deg", high="360 deg"),
    Uniform(path=f"{SHRIMP}.0", low="18 m", high="25 m"),
    Uniform(path=f"{SHRIMP}.1", low="-5 m", high="5 m"),
)


def splits(of: Recipe) -> np.ndarray:
    return np.array([of.split(of.first_frame(n)) for n in range(of.sequences)])


@settings(max_examples=60)
@given(
    st.integers(1, 300),
    st.tuples(*[st.integers(0, 20)] * 3).filter(any),
    st.integers(1, 7),
    st.integers(0, 2**32),
)
def test_shares_are_exact_to_rounding_and_nearly_so_in_each_stratum(
    count: int, weights: tuple[int, int, int], strata: int, seed: int
) -> None:
    shares = [w / sum(weights) for w in weights]
    random = np.random.default_rng(seed)
    stratum, priority = random.integers(strata, size=count).tolist(), random.integers(2**40, size=count).tolist()
    split = assign(shares, range(count), stratum, priority)
    for i, share in enumerate(shares):
        assert abs(np.sum(split == i) - share * count) < 1.0
        for s in set(stratum):
            inside = np.array(stratum) == s
            assert abs(np.sum(split[inside] == i) - share * inside.sum()) < 2.0


@pytest.mark.parametrize("count", [10, 37, 1000])
def test_a_recipe_is_split_in_its_shares(count: int) -> None:
    made = recipe(variations=VARIED, repeats=count, splits=Splits(train=0.8, validation=0.1, test=0.1))
    found = np.bincount(splits(made), minlength=3)
    assert np.all(np.abs(found - np.array([0.8, 0.1, 0.1]) * count) < 1.0)
    assert [made.split(f) for f in range(12)] == [int(s) for s in np.repeat(splits(made)[:4], made.steps(0))]


def test_each_value_of_the_stratifying_name_is_split_in_the_shares() -> None:
    made = recipe(
        grid=(HULLS,),
        variations=VARIED,
        repeats=40,
        splits=Splits(train=0.5, validation=0.25, test=0.25, stratify="hull"),
    )
    kinds = [made.scene_of(n).world.targets[0].shape.kind for n in range(80)]
    found = Counter(zip(kinds, splits(made), strict=True))
    assert all(abs(found[kind, s] - (20, 10, 10)[s]) <= 1 for kind, s in product(("sphere", "box"), range(3)))


def test_what_splits_share_is_noted() -> None:
    made = recipe(variations=VARIED[2:], repeats=6, splits=Splits(train=0.5, test=0.5))
    (note,) = [note for note in plan(made).warnings if "more than one split" in note]
    assert note.startswith("1 sets of target poses occur in more than one split")


def test_sequences_of_one_scene_stay_together() -> None:
    """Drawn by a choice, or repeated without a variation."""
    chosen = Choice(name="speed", path=f"{MOTION}.speed", values=tuple(range(1, 6)))
    made = recipe(variations=(chosen,), repeats=40, splits=Splits(train=0.5, test=0.5))
    found: dict[object, set[int]] = {}
    for n, split in enumerate(splits(made)):
        found.setdefault(made.scene_of(n), set()).add(int(split))
    assert len(found) == 5 and all(len(some) == 1 for some in found.values())
    assert set(splits(recipe(repeats=10, splits=Splits(train=0.5, test=0.5)))) < {0, 2}


def test_values_asked_to_stay_undivided_do() -> None:
    ranges = Axis(name="away", path=f"{MOTION}.start.0", first=8.0, last=17.0, step=1.0)
    asked = Splits(train=0.6, test=0.4, undivided=("away",))
    made = recipe(grid=(ranges,), variations=VARIED[2:], repeats=3, splits=asked)
    grouped = splits(made).reshape(10, 3)
    assert np.all(grouped == grouped[:, :1])
    assert np.bincount(grouped[:, 0], minlength=3).tolist() == [6, 0, 4]


def test_without_splits_all_is_for_training() -> None:
    made = recipe(variations=VARIED, repeats=3)
    assert set(splits(made)) == {0} and SPLITS[0] == "train"


def test_membership_is_drawn_not_laid_out() -> None:
    """In two seeds others are chosen, and not the first or last ones."""
    asked = Splits(train=0.5, test=0.5)
    one, other = (splits(recipe(variations=VARIED, repeats=60, splits=asked, seed=s)) for s in (1, 2))
    assert 10 < np.sum(one != other) < 50
    assert 5 < np.sum(one[:30] == 0) < 25


@pytest.mark.parametrize(("repeats", "empty"), [(1, ["validation", "test"]), (5, ["test"]), (10, [])])
def test_a_split_that_no_sequence_is_in_is_said(repeats: int, empty: list[str]) -> None:
    made = recipe(variations=VARIED, repeats=repeats, splits=Splits(train=0.7, validation=0.2, test=0.1))
    assert [name for name, n in zip(SPLITS, np.bincount(splits(made), minlength=3), strict=True) if not n] == empty
    notes = [note for note in plan(made, ()).warnings if note.startswith("splits: ")]
    assert len(notes) == bool(empty)
    assert all(f"splits: {' and '.join(empty)} will not have " in note for note in notes)
