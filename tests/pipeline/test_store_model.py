"""A store under any order of building, damage, verifying and repair, beside a model of it in memory."""

from __future__ import annotations

import shutil
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from sonarsynth import store
from sonarsynth.planning import Plan, plan
from sonarsynth.recipe import reading
from sonarsynth.schedule import build
from sonarsynth.schedule.repairing import repair
from sonarsynth.store.layout import layout_of
from tools.fault_injection.corrupt import KINDS, RECIPE, contents, damage

FRAMES = 20
SOME = st.sets(st.integers(0, FRAMES - 1), min_size=1, max_size=6)


@cache
def made() -> Plan:
    return plan(reading.loads(RECIPE))


@cache
def undisturbed() -> dict[str, np.ndarray]:
    """Every array of the whole dataset, built at once."""
    with tempfile.TemporaryDirectory() as folder:
        build(made(), Path(folder) / "s.zarr", workers=0)
        return arrays(Path(folder) / "s.zarr")


def arrays(path: Path) -> dict[str, np.ndarray]:
    with xr.open_datatree(path, engine="zarr", chunks=None, mask_and_scale=False) as tree:
        return {a.path: np.asarray(tree[a.path].values) for a in layout_of(made()).arrays}


class Store(RuleBasedStateMachine):
    """The store on disk; the model is which frames are there, and every file as it was when last it was whole."""

    def __init__(self) -> None:
        super().__init__()
        self.folder = Path(tempfile.mkdtemp())
        self.path = self.folder / "s.zarr"
        self.there: set[int] = set()
        self.whole: dict[str, bytes] = {}
        self.damages = 0

    def teardown(self) -> None:
        shutil.rmtree(self.folder)

    @property
    def damaged(self) -> bool:
        return contents(self.path) != self.whole

    @initialize(frames=SOME)
    def first(self, frames: set[int]) -> None:
        self.goes_on(frames)

    @precondition(lambda self: not self.damages)
    @rule(frames=SOME)
    def goes_on(self, frames: set[int]) -> None:
        lacking = frames - self.there
        again = {f for f in self.there if any(f // 8 == g // 8 for g in lacking)}
        report = build(made(), self.path, frames=frames, workers=0)
        assert report.ok
        assert report.written == len(lacking | again)
        self.there |= frames
        self.whole = contents(self.path)

    @precondition(lambda self: self.damages < 2)
    @rule(data=st.data(), how=st.sampled_from(KINDS), seed=st.integers(0, 2**32 - 1))
    def corrupt(self, data: Any, how: str, seed: int) -> None:
        names = sorted(name for name, content in contents(self.path).items() if content)
        damage(self.path, data.draw(st.sampled_from(names)), how, np.random.default_rng(seed))
        self.damages += 1

    @rule()
    def verify(self) -> None:
        assert store.verify(self.path, quick=True).ok is not self.damaged

    @rule(quick=st.booleans())
    def mend(self, quick: bool) -> None:
        report = repair(self.path, workers=0, quick=quick)
        assert report.ok, report
        now = contents(self.path)
        assert {name for name in now.keys() | self.whole.keys() if now.get(name) != self.whole.get(name)} == set()
        self.damages = 0

    @precondition(lambda self: self.damages)
    @rule()
    def goes_on_damaged(self) -> None:
        """A build refuses a damaged layout, and else makes what has no mark; a repair has the rest."""
        try:
            build(made(), self.path, workers=0)
        except store.Damage:
            return
        assert repair(self.path, workers=0).ok
        self.there, self.damages = set(range(FRAMES)), 0
        self.whole = contents(self.path)

    @invariant()
    def holds_what_was_built(self) -> None:
        if self.damages or not self.there:
            return
        assert set(store.frames_there(self.path)) == self.there
        rows = sorted(self.there)
        lacking = sorted(set(range(FRAMES)) - self.there)
        fill = {a.path: a for a in layout_of(made()).arrays}
        for name, values in arrays(self.path).items():
            assert values[rows].tobytes() == undisturbed()[name][rows].tobytes(), name
            assert fill[name].is_fill(values[lacking]), name


TestStore = Store.TestCase
TestStore.pytestmark = [pytest.mark.long]
TestStore.settings = settings(max_examples=4, stateful_step_count=10, deadline=None)
