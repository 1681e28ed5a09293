"""Fast mathematics gives other bits where the compiler inlines otherwise, so nothing may depend on what it inlines.

A compiled function that others call lies in the code of each of them, optimised apart. Which copy is called depends on
the order in which they were compiled in this process or loaded: without fast mathematics all copies give the same
bits, with it only where there are none, because they are inlined always.
"""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path

import numpy as np
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


def test_products_of_complex_numbers_are_fast_in_no_kernel_but_those_that_ask(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Numba compiles them apart from the kernels, whose order would tell which bits all get."""
    lines = "def {0}(z):\n    return z * z\n"
    header = "from sonarsynth.compiling import compiled\n"
    kernels = lines.format("plain") + "@compiled(fastmath=True)\n" + lines.format("fast")
    (tmp_path / "products_of_two.py").write_text(header + "@compiled\n" + kernels)
    monkeypatch.syspath_prepend(tmp_path)
    module = import_module("products_of_two")
    for name in ("fast", "plain"):
        kernel = getattr(module, name)
        assert kernel(np.complex128(1.0 + 2.0j)) == -3.0 + 4.0j
        steps = re.findall(r"= f(?:mul|add|sub) (fast )?", next(iter(kernel.inspect_llvm().values())))
        assert steps
        assert {bool(step) for step in steps} == {name == "fast"}
