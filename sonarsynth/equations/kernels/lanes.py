"""Lanes, for compiled kernels: as many float32 numbers at once as a register holds.

The compiler's own vectoriser cannot keep a sum over array elements in registers while it runs over frequencies; with
lanes as a type, a kernel is written as its equation is, and a sum is one fused multiply-add a term. Operators: + - *.
Nothing is reassociated, so results are the same bits however a kernel is called. Indices are not checked.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable
from typing import Any, Final

import llvmlite.binding as llvm
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic, models, overload, register_model

WIDE: Final = bool(llvm.get_host_cpu_features().get("avx512f"))
"""Whether there are 32 registers of sixteen numbers (AVX-512). Elsewhere: sixteen of eight (AVX2), or the like."""

LANES: Final = 16 if WIDE else 8
"""Numbers in one group of lanes."""

_VECTOR = ir.VectorType(ir.FloatType(), LANES)
_ALIGNMENT = 4  # bytes: of a float32; aligned addresses are as fast whatever the instruction promises


def instruction(build: Callable[..., Any]) -> Any:
    """Make a function of numba's types a function for kernels, which is written where it is called."""
    return intrinsic(build)


class LanesType(types.Type):
    """Numba's name for a group of lanes."""

    def __init__(self) -> None:
        super().__init__(name=f"float32x{LANES}")


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)  # type: ignore[no-untyped-call]


_lanes = LanesType()


def _address(context: Any, builder: Any, kind: Any, array: Any, index: Any) -> Any:
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [index]), _VECTOR.as_pointer())


def _order(lanes: Iterable[int]) -> Any:
    indices = list(lanes)
    return ir.Constant(ir.VectorType(ir.IntType(32), len(indices)), indices)


@instruction
def load(typing: Any, array: Any, index: Any) -> Any:
    """Lanes array[index : index + LANES] of a flat contiguous float32 array."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        value = builder.load(_address(context, builder, signature.args[0], *arguments))
        value.align = _ALIGNMENT
        return value

    return _lanes(array, types.intp), build


@instruction
def store(typing: Any, array: Any, index: Any, value: Any) -> Any:
    """Write lanes to array[index : index + LANES]."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        address = _address(context, builder, signature.args[0], arguments[0], arguments[1])
        builder.store(arguments[2], address).align = _ALIGNMENT
        return context.get_dummy_value()

    return types.void(array, types.intp, _lanes), build


@instruction
def load_complex(typing: Any, array: Any, index: Any) -> Any:
    """Real and imaginary parts (lanes) of complex numbers, pairs of float32 from array[index] on."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        halves = []
        for shift in (0, LANES):
            start = builder.add(arguments[1], ir.Constant(arguments[1].type, shift))
            halves.append(builder.load(_address(context, builder, signature.args[0], arguments[0], start)))
            halves[-1].align = _ALIGNMENT
        components = [builder.shuffle_vector(*halves, _order(range(first, 2 * LANES, 2))) for first in (0, 1)]
        return context.make_tuple(builder, signature.return_type, components)

    return types.UniTuple(_lanes, 2)(array, types.intp), build


@instruction
def store_complex(typing: Any, array: Any, index: Any, real: Any, imaginary: Any) -> Any:
    """Write complex numbers (lanes) as pairs of float32 from array[index] on."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, index, real, imaginary = arguments
        for shift in (0, LANES):
            pairs = _order([(shift + i) // 2 + LANES * (i % 2) for i in range(LANES)])
            start = builder.add(index, ir.Constant(index.type, shift))
            address = _address(context, builder, signature.args[0], array, start)
            builder.store(builder.shuffle_vector(real, imaginary, pairs), address).align = _ALIGNMENT
        return context.get_dummy_value()

    return types.void(array, types.intp, _lanes, _lanes), build


@instruction
def splat(typing: Any, scalar: Any) -> Any:
    """The same number in every lane."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        nothing = ir.Constant(_VECTOR, ir.Undefined)
        vector = builder.insert_element(nothing, arguments[0], ir.Constant(ir.IntType(32), 0))
        return builder.shuffle_vector(vector, nothing, _order([0] * LANES))

    return _lanes(types.float32), build


@instruction
def ramp(typing: Any) -> Any:
    """0, 1, 2, ... LANES - 1."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return ir.Constant(_VECTOR, [float(i) for i in range(LANES)])

    return _lanes(), build


def _elementwise(name: str, arity: int) -> Any:
    """The LLVM intrinsic `name` on each lane."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind, symbol = ir.FunctionType(_VECTOR, [_VECTOR] * arity), f"llvm.{name}.v{LANES}f32"
        function = cgutils.get_or_insert_function(builder.module, kind, symbol)
        return builder.call(function, arguments)

    return build


@instruction
def nearest(typing: Any, value: Any) -> Any:
    """The nearest whole numbers, halves to even."""
    return _lanes(_lanes), _elementwise("rint", 1)


@instruction
def least(typing: Any, a: Any, b: Any) -> Any:
    """The smaller of two numbers; the second where they do not compare."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.select(builder.fcmp_ordered("<", *arguments), *arguments)

    return _lanes(_lanes, _lanes), build


@instruction
def with_sign(typing: Any, size: Any, sign: Any) -> Any:
    """Numbers of the size of the first and the sign of the second."""
    return _lanes(_lanes, _lanes), _elementwise("copysign", 2)


@instruction
def total(typing: Any, value: Any) -> Any:
    """Sum over the lanes, in halves: always the same order."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        (value,) = arguments
        width = LANES
        while width > 1:
            width //= 2
            nothing = ir.Constant(value.type, ir.Undefined)
            low = builder.shuffle_vector(value, nothing, _order(range(width)))
            high = builder.shuffle_vector(value, nothing, _order(range(width, 2 * width)))
            value = builder.fadd(low, high)
        return builder.extract_element(value, ir.Constant(ir.IntType(32), 0))

    return types.float32(_lanes), build


def _binary(name: str) -> Any:
    @instruction
    def operation(typing: Any, a: Any, b: Any) -> Any:
        def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            # `contract` lets a product and a sum become one fused instruction, nothing else.
            return getattr(builder, name)(*arguments, flags=("contract",))

        return _lanes(_lanes, _lanes), build

    return operation


_add, _subtract, _multiply = _binary("fadd"), _binary("fsub"), _binary("fmul")


def _operator(function: Any, operation: Any) -> None:
    @overload(function, strict=False)
    def choose(a: Any, b: Any) -> Any:
        if isinstance(a, LanesType) and isinstance(b, LanesType):
            return lambda a, b: operation(a, b)
        return None


_operator(operator.add, _add)
_operator(operator.sub, _subtract)
_operator(operator.mul, _multiply)
