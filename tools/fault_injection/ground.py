"""Where hostile things are tried: a small whole store, a copy of it, and files outside that nobody may touch."""

from __future__ import annotations

import shutil
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from sonarsynth import store
from sonarsynth.description import FieldError
from sonarsynth.planning import Plan, plan
from sonarsynth.recipe import reading
from sonarsynth.schedule import build

from .corrupt import RECIPE, contents
from .watching import watched

FRAMES = range(12)
"""What is built: a whole shard and half of another."""

SAID = (store.Mismatch, store.Damage, store.StoreLocked, FieldError, reading.RecipeError, OSError)
"""What the command line says in one line."""


@dataclass
class Ground:
    """A folder with the store `s.zarr`, and another folder `outside`."""

    folder: Path
    plan: Plan
    random: np.random.Generator
    whole: dict[str, bytes] = field(default_factory=dict)
    wrong: list[str] = field(default_factory=list)
    tried: Counter[str] = field(default_factory=Counter)

    @property
    def path(self) -> Path:
        """The store that things are done to."""
        return self.folder / "here/s.zarr"

    @property
    def outside(self) -> Path:
        """What is nobody's business."""
        return self.folder / "outside"

    def reset(self) -> None:
        """A fresh copy of everything."""
        for folder in (self.path.parent, self.outside):
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
        shutil.copytree(self.folder / "whole.zarr", self.path)
        (self.outside / "secret.stl").write_text("root:x:0:0:secret\n")

    @contextmanager
    def untouched(self, what: str) -> Iterator[None]:
        """Count it as wrong where anything outside is opened, changed, made or removed meanwhile."""
        self.tried[what.partition(":")[0]] += 1
        with watched(self.outside) as seen:
            yield
        if seen:
            self.wrong.append(f"{what}: outside: {seen[:5]}")

    def attempt(self, what: str, command: Callable[[], object]) -> str:
        """Do something that may be refused: in one line, without what is secret. Returns the line."""
        try:
            command()
        except SAID as error:
            line = str(error)
            if "\n" in line or "root:x" in line:
                self.wrong.append(f"{what}: {line[:300]}")
            return line or type(error).__name__
        except Exception as error:
            self.wrong.append(f"{what}: {type(error).__name__}: {str(error)[:300]}")
            return str(error)
        return ""

    def compare(self, what: str, path: Path) -> None:
        """Count it as wrong where a store is not the one that was built."""
        now = contents(path)
        odd = sorted(name for name in now.keys() | self.whole.keys() if now.get(name) != self.whole.get(name))
        if odd:
            self.wrong.append(f"{what}: differs in {odd[:5]}")


def on_ground(
    trial: Callable[[Ground, int], None], count: int, seed: int, folder: Path | None = None
) -> dict[str, Any]:
    """Run trials, each on a fresh copy. Returns what came of them."""
    with tempfile.TemporaryDirectory(dir=folder, prefix="faults-") as there:
        made = plan(reading.loads(RECIPE), frozenset({"image"}))
        ground = Ground(Path(there).resolve(), made, np.random.default_rng(seed))
        build(made, ground.folder / "whole.zarr", frames=FRAMES, workers=0)
        ground.whole = contents(ground.folder / "whole.zarr")
        for number in range(count):
            ground.reset()
            trial(ground, number)
    return {
        "ok": not ground.wrong,
        "trials": count,
        "seed": seed,
        "wrong": ground.wrong[:20],
        "tried": dict(sorted(ground.tried.items())),
    }
