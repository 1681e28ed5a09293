"""A dataset small enough to be built many times: 20 frames of a box, 20 hydrophones, 9 x 11 beams."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sonarsynth.pipeline import Values
from sonarsynth.planning import Plan, plan
from sonarsynth.recipe import Recipe, reading
from sonarsynth.schedule import build
from sonarsynth.store import layout_of
from tools.fault_injection.corrupt import RECIPE

SMALL = (
    RECIPE.replace("edge: 0.5", "edge: 0.25")
    .replace("columns: 4, rows: 3", "columns: 5, rows: 4")
    .replace("azimuths: 5, elevations: 3", "azimuths: 11, elevations: 9")
)

ROCK = """- name: rock
        clutter: true
        shape: {kind: sphere, radius: 0.4, edge: 0.1}
        motion: {kind: still, position: [10, -2, -6]}
    sources:"""
BUILT = range(2, 18)


@pytest.fixture(scope="session")
def small_text() -> str:
    return SMALL


@pytest.fixture(scope="session")
def small() -> Recipe:
    return reading.loads(SMALL)


@pytest.fixture(scope="session")
def small_plan(small: Recipe) -> Plan:
    return plan(small)


@pytest.fixture
def small_file(tmp_path: Path) -> Path:
    file = tmp_path / "small.yaml"
    file.write_text(SMALL)
    return file


@pytest.fixture
def copy(whole: Path, tmp_path: Path) -> Path:
    """A copy of the store that a test module calls `whole`, to be damaged."""
    return Path(shutil.copytree(whole, tmp_path / "s.zarr"))


@pytest.fixture(scope="session")
def reference(tmp_path_factory: pytest.TempPathFactory, small_plan: Plan) -> Path:
    """All frames, built in this process without a break."""
    path = tmp_path_factory.mktemp("reference") / "s.zarr"
    assert build(small_plan, path, workers=0).ok
    return path


@pytest.fixture(scope="session")
def varied(small_text: str) -> Recipe:
    """Ten sequences of two frames, of a box and of clutter, with splits."""
    text = small_text.replace("    sources:", f"      {ROCK}", 1).replace("frames: 20", "frames: 2")
    text = text.replace(
        "  trajectory:",
        "    converter: {bits: 16, full_scale: 20 Pa}\n    ranges: {near: 6 m, far: 14 m, step: 10 cm}\n  trajectory:",
    )
    noise = "{name: noise, path: environment.noise.level, kind: uniform, low: 30 dB, high: 50 dB}"
    splits = "repeats: 10\nsplits: {train: 0.6, validation: 0.2, test: 0.2}\n"
    return reading.loads(f"{text}variations: [{noise}]\n{splits}")


@pytest.fixture(scope="session")
def partly_built(varied: Recipe, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Sixteen of its twenty frames, in shards of which one is there in part."""
    path = tmp_path_factory.mktemp("partly") / "s.zarr"
    products = {"signals", "image", "range_image", "cloud", "beams"}
    assert build(plan(varied, products), path, frames=BUILT, workers=0).ok
    return path


@pytest.fixture(scope="session")
def made_up() -> Callable[[Plan, int], Values]:
    """Values of a frame that fit a plan's layout, and mean nothing."""

    def values(plan: Plan, frame: int) -> Values:
        random = np.random.default_rng(frame)
        made: Values = {}
        for array in layout_of(plan).arrays:
            numbers = random.normal(size=array.shape[1:]) * 100
            made[array.key] = numbers.astype(array.dtype)
        return made

    return values
