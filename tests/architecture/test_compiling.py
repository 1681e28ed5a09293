"""A kernel is compiled anew when a file changes from which it calls something or takes a constant."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from numba.core.dispatcher import Dispatcher

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


def test_kernels_that_count_no_references_return_no_arrays() -> None:
    """What they returned would be freed while it is in use."""
    borrowing = {name: kernel for name, kernel in kernels().items() if not kernel.targetoptions["_nrt"]}
    returned = {name: kernel.py_func.__annotations__["return"] for name, kernel in borrowing.items()}
    numbers = re.compile(r"(None|bool|int|float|tuple\[|\]|, )+")
    assert len(borrowing) > 50
    assert [f"{name} -> {what}" for name, what in returned.items() if not numbers.fullmatch(what)] == []


def test_kernels_that_count_no_references_call_none_that_do() -> None:
    """Arrays that those make would never be freed."""
    calls = [
        f"{name} calls {called}"
        for name, kernel in kernels().items()
        if not kernel.targetoptions["_nrt"]
        for called in kernel.py_func.__code__.co_names
        if isinstance(used := kernel.py_func.__globals__.get(called), Dispatcher) and used.targetoptions["_nrt"]
    ]
    assert calls == []


ROUNDED_FREELY = {"sonarsynth.equations.kernels.lanes", "sonarsynth.equations.kernels.vectors"}
"""Their instructions may be fused or put in another order, as the compiler finds best where they stand."""


def kernels() -> dict[str, Dispatcher]:
    """All kernels of the package, by module and name."""
    files = [file for file in PACKAGE.rglob("*.py") if "@compiled" in file.read_text()]
    modules = [import_module(".".join(("sonarsynth", *f.relative_to(PACKAGE).with_suffix("").parts))) for f in files]
    values = [value for module in modules for value in vars(module).values() if isinstance(value, Dispatcher)]
    return {f"{kernel.py_func.__module__}.{kernel.py_func.__name__}": kernel for kernel in values}


def called(kernel: Dispatcher) -> list[Any]:
    """What a kernel names."""
    function = kernel.py_func
    return [function.__globals__.get(name) for name in function.__code__.co_names]


def rounded_freely(kernel: Dispatcher) -> bool:
    """Whether the bits of a kernel depend on what stands about it."""
    return bool(kernel.targetoptions.get("fastmath")) or any(
        rounded_freely(value) if isinstance(value, Dispatcher) else getattr(value, "__module__", "") in ROUNDED_FREELY
        for value in called(kernel)
    )


def test_bits_do_not_depend_on_which_kernel_a_process_loads_first() -> None:
    """Two kernels that call a third have a copy of it each, and a process runs the copy that it loads first: one in
    which the compiler may choose how numbers are rounded must be part of those that call it."""
    every = kernels()
    callers = {
        name: [value for value in called(kernel) if isinstance(value, Dispatcher)] for name, kernel in every.items()
    }
    apart = {
        f"{value.py_func.__name__}, which {name} calls"
        for name, values in callers.items()
        for value in values
        if rounded_freely(value) and not value.targetoptions.get("forceinline")
    }
    assert len(every) > 100 and not apart
