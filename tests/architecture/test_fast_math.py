"""Fast mathematics gives other bits where the compiler inlines otherwise, so nothing may depend on what it inlines.

A compiled function that others call lies in the code of each of them, optimised apart. Which copy is called depends on
the order in which they were compiled in this process or loaded: without fast mathematics all copies give the same
bits, with it only where there are none, because they are inlined always.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pytest
from numba.core.dispatcher import Dispatcher

PACKAGE = Path(__file__).resolve().parents[2] / "sonarsynth"
FAST = sorted(file for file in PACKAGE.rglob("*.py") if "fastmath=" in file.read_text())


def test_there_is_something_to_test() -> None:
    assert FAST


@pytest.mark.parametrize("file", FAST, ids=lambda file: file.stem)
def test_compiled_functions_with_fast_mathematics_that_others_call_are_inlined(file: Path) -> None:
    module = import_module(".".join(file.relative_to(PACKAGE.parent).with_suffix("").parts))
    compiled = {name: value for name, value in vars(module).items() if isinstance(value, Dispatcher)}
    called = {name for value in compiled.values() for name in value.py_func.__code__.co_names if name in compiled}
    loose = [n for n in called if compiled[n].targetoptions.get("fastmath")]
    assert [name for name in loose if not compiled[name].targetoptions.get("forceinline")] == []
