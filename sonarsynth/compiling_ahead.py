"""Kernels that other cores compile ahead, while the process that needs them compiles those that it needs first.

`kernels.json` lists what the first build of the README calls, in that order (tools/listed_kernels.py records it). What
calls for the first of which nothing is kept goes through the list from the front; others meet it from the back. It says
only what is compiled early: a kernel that is not in it is compiled where it is called, as ever.
"""

from __future__ import annotations

import atexit
import json
import os
import subprocess
import sys
import threading
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import numpy as np

from sonarsynth import compiling

LISTED: Final = Path(__file__).with_name("kernels.json")
OTHERS: Final = 3
"""Processes that compile ahead, at most: the longest kernel takes a tenth of the time of all."""


def use_other_cores() -> None:
    """Have other processes compile ahead from when this one first meets a kernel of which nothing is kept, until it
    ends."""
    compiling.when_first_missed[:] = [_start]


def _start() -> None:
    others = min(len(os.sched_getaffinity(0)) - 1, OTHERS)
    for part in range(others):
        command = [sys.executable, "-P", "-m", __name__, str(part), str(others)]
        with suppress(OSError):
            quiet = subprocess.DEVNULL
            other = subprocess.Popen(command, stdin=quiet, stdout=quiet, stderr=quiet)
            atexit.register(other.kill)
            threading.Thread(target=other.wait, daemon=True).start()  # ended, it would stay among the processes


def spelled(kernel: tuple[str, str, tuple[Any, ...]]) -> str:
    """A line of the list: module, name and types of arguments of a call, as `compiling.loaded` has them."""
    module, name, arguments = kernel
    return json.dumps([module, name, *map(_spelled, arguments)])


def _spelled(kind: Any) -> Any:
    if hasattr(kind, "types"):  # of a tuple
        return [getattr(kind, "instance_class", tuple).__name__, *map(_spelled, kind.types)]
    if hasattr(kind, "layout"):  # of an array
        return f"{kind.dtype} {kind.ndim}{kind.layout}{'' if kind.mutable else ' fixed'}"
    return str(kind)


def _type(text: Any, module: ModuleType) -> Any:
    """The type that `_spelled` has spelled."""
    from numba import types
    from numba.np.numpy_support import from_dtype

    if isinstance(text, list):
        named = None if text[0] == "tuple" else getattr(module, text[0])
        return types.BaseTuple.from_types([_type(part, module) for part in text[1:]], named)
    dtype, _, shape = text.partition(" ")
    scalar = from_dtype(np.dtype(dtype))
    return types.Array(scalar, int(shape[0]), shape[1], readonly=shape.endswith("fixed")) if shape else scalar


def compile_part(part: int, parts: int) -> None:
    """Compile one part of the list, of so many, where nothing is kept: last ones first, until who asked has ended."""
    asked = os.getppid()
    for line in reversed(LISTED.read_text().splitlines()[part::parts]):
        if os.getppid() != asked:
            return
        module, name, *arguments = json.loads(line)
        with suppress(Exception):  # what is gone, or takes other arguments, is compiled where it is called
            of = import_module(module)
            getattr(of, name).compile(tuple(_type(text, of) for text in arguments))


if __name__ == "__main__":
    compile_part(*map(int, sys.argv[1:]))
