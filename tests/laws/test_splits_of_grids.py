"""Splits of whole recipes: whatever is spanned, nothing that varies is in two splits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sonarsynth.recipe import Choice, Integers, Recipe, Splits, Uniform, reading
from sonarsynth.recipe.variation.random_variations import Condition
from tests.laws.test_sequences import MOTION, recipe
from tests.laws.test_splits import HULLS, VARIED

CONFIGS = Path(__file__).resolve().parents[2] / "configs"


def parts(made: Recipe, index: int) -> Iterator[tuple[str, object]]:
    """What a frame is made from, by kind."""
    scene, frame = made.frame(index)
    yield "scene", replace(scene, trajectory=replace(scene.trajectory, frames=1))
    for body in frame.moment.bodies:
        yield "mesh pose", (body.mesh.digest, tuple(body.pose.position), tuple(body.pose.orientation))
    for snap in frame.moment.snaps:
        yield "snap", (tuple(snap.position), snap.time)


def shared(made: Recipe) -> dict[str, int]:
    """Of each kind, how many parts are in several splits."""
    held: dict[str, dict[object, set[int]]] = {}
    for index in range(made.frames):
        for kind, part in parts(made, index):
            held.setdefault(kind, {}).setdefault(part, set()).add(made.split(index))
    return {kind: sum(len(splits) > 1 for splits in found.values()) for kind, found in held.items()}


@pytest.mark.parametrize("name", ["grid.yaml"])
def test_no_scene_mesh_pose_or_snap_of_a_config_is_in_several_splits(name: str) -> None:
    made = reading.load(CONFIGS / name)
    assert {made.split(index) for index in range(made.frames)} == {0, 1, 2}
    assert shared(made) == {"scene": 0, "mesh pose": 0, "snap": 0}


FEW = (
    Integers(path=f"{MOTION}.speed", low=0, high=2),
    Integers(path="trajectory.frames", low=2, high=4),
    Choice(path=f"{MOTION}.climb", values=(0, 0.1)),
)
"""Of values that several sequences have."""
IN_SPHERES = Uniform(path=f"{MOTION}.pitch", low="-9 deg", high="9 deg", when=Condition(entry="hull", value="sphere"))


@st.composite
def recipes(draw: st.DrawFn) -> Recipe:
    varied: tuple[Any, ...] = tuple(draw(st.lists(st.sampled_from((*VARIED, *FEW)), unique=True, max_size=4)))
    weights = draw(st.tuples(*[st.integers(0, 4)] * 3).filter(lambda some: sum(w > 0 for w in some) > 1))
    train, validation, test = (w / sum(weights) for w in weights)
    grid = draw(st.sampled_from([(), (HULLS,)]))
    stratify = draw(st.sampled_from([None, "hull"])) if grid else None
    varied += (IN_SPHERES,) if grid and draw(st.booleans()) else ()
    asked = Splits(train=train, validation=validation, test=test, stratify=stratify)
    return recipe(
        seed=draw(st.integers(0, 2**31)), grid=grid, variations=varied, repeats=draw(st.integers(2, 6)), splits=asked
    )


@settings(max_examples=60, deadline=None)
@given(recipes())
def test_no_scene_is_in_several_splits_nor_any_pose_or_snap_that_varies(made: Recipe) -> None:
    found = shared(made)
    assert found["scene"] == 0
    assert found["mesh pose"] == 0 or not set(VARIED[:2]) & set(made.variations)
    assert found["snap"] == 0 or not set(VARIED[2:]) & set(made.variations)
