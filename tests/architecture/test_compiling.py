"""A kernel is compiled anew when a file changes from which it calls something or takes a constant."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "sonarsynth"
CALLED = """
from sonarsynth.compiling import compiled
FACTOR = {factor}
@compiled
def term(x):
    return x + {term}
"""
CALLER = """
from sonarsynth.compiling import compiled
from called import FACTOR, term
@compiled
def product(x):
    return FACTOR * middle(x)
@compiled
def middle(x):
    return term(x)
if __name__ == "__main__":
    from caller import product
    print(product(1.0), sum(product.stats.cache_hits.values()))
"""


@pytest.fixture
def product(tmp_path: Path):  # type: ignore[no-untyped-def]
    def value(factor: float, term: float, caller: str = CALLER) -> list[float]:
        for name, text in (("called.py", CALLED.format(factor=factor, term=term)), ("caller.py", caller)):
            file = tmp_path / name
            if not file.exists() or file.read_text() != text:
                file.write_text(text)
        # -B: Python itself does not see a file change within a second
        run = subprocess.run(
            [sys.executable, "-B", "caller.py"], cwd=tmp_path, check=True, capture_output=True, text=True
        )
        return [float(word) for word in run.stdout.split()]

    return value


def test_what_a_kernel_calls_and_the_constants_it_takes_are_those_of_today(product) -> None:  # type: ignore[no-untyped-def]
    assert product(2.0, 1.0) == [4.0, 0]
    assert product(2.0, 1.0) == [4.0, 1], "it is cached"
    assert product(2.0, 9.0) == [20.0, 0], "what is called two calls down has changed"
    assert product(3.0, 9.0) == [30.0, 0], "a constant has changed"
    halved = CALLER.replace("FACTOR *", "0.5 * FACTOR *")
    assert product(3.0, 9.0, halved) == [15.0, 0], "it is compiled from what is read from the cache"


def test_kernels_are_compiled_in_this_one_way() -> None:
    apart = {PACKAGE / "compiling.py", *(PACKAGE / "validation" / "references").rglob("*.py")}
    assert [file.name for file in PACKAGE.rglob("*.py") if "njit" in file.read_text() and file not in apart] == []
