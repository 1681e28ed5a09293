"""One way to compile kernels: cached on disk, and compiled anew when anything that they are made of has changed.

Numba keeps what it compiled beside the file of a function, and forgets it when that file changes; not when another
changes, from which the function calls something or takes a constant. Old and new code would be mixed after an update.
And it compiles products of complex numbers and the like once a process: as fast mathematics in all kernels, where one
with fast mathematics was compiled first.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable, Iterator
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any, TypeVar, overload

import llvmlite.binding as llvm
import numpy as np
from numba import njit
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.dispatcher import Dispatcher
from numba.core.registry import cpu_target
from numba.core.runtime.nrt import rtsys
from numba.core.targetconfig import ConfigStack

F = TypeVar("F", bound=Callable[..., Any])

anew: list[str] = []
"""Names of the kernels that this process compiled, of which nothing was kept."""
loaded: list[tuple[str, str, tuple[Any, ...]]] = []
"""Module, name and types of arguments of the kernels that were kept, as this process first called them."""
when_first_missed: list[Callable[[], None]] = []
"""What is called, once, when this process meets a kernel of which nothing is kept."""


@overload
def compiled(function: F, /) -> F: ...
@overload
def compiled(function: None = None, /, **options: Any) -> Callable[[F], F]: ...
def compiled(function: Any = None, /, *, borrows: bool = False, **options: Any) -> Any:
    """The decorator of kernels: numba's `njit` without the interpreter lock, with NumPy's division by zero, cached.

    Parameters: function, of what numba can compile; borrows, it makes no arrays and returns none, so that references to
    those that it is given need not be counted: where small functions hand many arrays on, that takes most of the time;
    options, of `numba.njit`, besides.
    Returns: the compiled function.
    """
    if function is None:
        return partial(compiled, borrows=borrows, **options)
    options["_nrt"] = not borrows  # the runtime that counts references
    options["no_cfunc_wrapper"] = True  # for C, which nobody asks for: it is compiled as long as that for Python
    kernel = njit(nogil=True, error_model="numpy", **options)(function)
    if isinstance(kernel, Dispatcher):  # it is the function itself where NUMBA_DISABLE_JIT is set
        kernel._cache = _Cache(function)  # type: ignore[attr-defined, no-untyped-call]
        list(_made_of(function, {function}))  # files as they are now, which may change before it is compiled
    return kernel


class _Kept(CompileResultCacheImpl):
    """What is kept of compiled code: without the modules of numba's own functions that it calls. Only handling Python
    objects would need them, which no kernel does, and they take longer to import than the code to load."""

    def reduce(self, result: Any) -> tuple[Any, ...]:
        *code, modules = super().reduce(result)  # type: ignore[no-untyped-call]
        return *code, tuple(module for module in modules if not module.globals["__name__"].startswith("numba."))


class _Cache(FunctionCache):
    """Compiled code by the types of its arguments, the processor, and the code that it was made of."""

    _impl_class = _Kept

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What was compiled, or None. Numba first reads all that it can compile (0.2 s), as compiling does by itself;
        what is loaded needs only the runtime."""
        rtsys.initialize(target_context)
        found = None
        with self._guard_against_spurious_io_errors():
            found = self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        if found is not None:
            loaded.append((self._py_func.__module__, self._py_func.__name__, tuple(sig)))
            return found
        while when_first_missed:
            when_first_missed.pop()()
        _say_no_shapes()
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled."""
        anew.append(self._py_func.__name__)
        super().save_overload(sig, data)  # type: ignore[no-untyped-call]

    def _index_key(self, *types_and_processor: Any) -> tuple[Any, ...]:
        made_of = [_digest(__file__), *sorted(set(_made_of(self._py_func, {self._py_func})))]
        key = super()._index_key(*types_and_processor)  # type: ignore[no-untyped-call]
        return (*key, hashlib.sha256("\n".join(made_of).encode()).hexdigest())


@cache
def _say_no_shapes() -> None:
    """Of a slice that does not fit where it is put, numba writes the shapes into a text: that took a second to compile
    for each kernel that puts one somewhere."""
    from numba.extending import overload
    from numba.np import arrayobj  # with all that numba can compile, which is loaded by compiling alone

    def differ(values: Any, place: Any) -> None:
        """Raise ValueError."""

    @overload(differ)
    def raising(values: Any, place: Any) -> Any:
        def raised(values: Any, place: Any) -> None:
            raise ValueError("cannot assign slice from input of different size")

        return raised

    arrayobj.raise_with_shape_context = differ


def _made_of(function: Any, seen: set[Any]) -> Iterator[str]:
    """Constants that a function names, as text, and digests of the files of what it calls, and of what that calls."""
    for name in function.__code__.co_names:
        value = function.__globals__.get(name)
        if isinstance(value, (bool, int, float, complex, str, tuple, np.generic, np.ndarray)):
            yield f"{name} {value.tobytes().hex() if isinstance(value, np.ndarray) else repr(value)}"
        elif file := getattr(sys.modules.get(getattr(value, "__module__", "")), "__file__", None):
            yield _digest(file)
        if isinstance(value, Dispatcher) and value.py_func not in seen:
            seen.add(value.py_func)
            yield from _made_of(value.py_func, seen)


@lru_cache(maxsize=4096)  # files of a package
def _digest(file: str) -> str:
    """Digest of a file of this package, as it was when first asked for: when what it holds was imported."""
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()


class _ByFlags(dict[Any, Any]):
    """What numba compiles for its own use within kernels, apart for those with fast mathematics and those without, and
    for those that count references and those that do not."""

    def __getitem__(self, key: Any) -> Any:
        return super().__getitem__(self._full(key))

    def __setitem__(self, key: Any, value: Any) -> None:
        super().__setitem__(self._full(key), value)

    def get(self, key: Any, default: Any = None) -> Any:
        return super().get(self._full(key), default)

    def _full(self, key: Any) -> tuple[Any, frozenset[str], bool]:
        flags = ConfigStack().top()
        return key, frozenset(flags.fastmath.flags), bool(flags.nrt)


class _Library(JITCodeLibrary):
    """A kernel read from the cache as machine code. Its bitcode, which other kernels are compiled from, is parsed when
    one is: that takes more than half of the time of loading, and numba does it for each."""

    _bitcode: bytes | None = None

    @classmethod
    def _unserialize(cls, codegen: Any, state: Any) -> Any:
        name, _, (machine_code, bitcode) = state
        library = codegen.create_library(name)
        library._bitcode = bitcode
        library.enable_object_caching()
        library._set_compiled_object(machine_code)
        library._finalize_final_module()
        return library

    def get_pointer_to_function(self, name: str) -> Any:
        """Where a function of this library is, 0 if it has none of that name."""
        if self._bitcode is not None:
            return self._codegen._engine.get_function_address(name)
        return super().get_pointer_to_function(name)  # type: ignore[no-untyped-call]

    def _get_module_for_linking(self) -> Any:
        if self._bitcode is not None and self._shared_module is None:
            self._shared_module = llvm.parse_bitcode(self._bitcode)
        return super()._get_module_for_linking()  # type: ignore[no-untyped-call]


cpu_target.target_context.cached_internal_func = _ByFlags()
cpu_target.target_context.codegen()._library_class = _Library
