"""Eight numbers at a time for compiled loops: the compiler does not find short vectors by itself, so they are spelled
out."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

WIDTH = 8
FAST = ("fast",)


def _pointer(context: Any, builder: Any, array_type: Any, array: Any, index: Any) -> tuple[Any, Any, int]:
    """Pointer to eight numbers of a contiguous array from an index on, their type, and the size of one."""
    element = context.get_data_type(array_type.dtype)
    data = context.make_array(array_type)(context, builder, array).data
    vector = ir.VectorType(element, WIDTH)
    return builder.bitcast(builder.gep(data, [index]), vector.as_pointer()), vector, context.get_abi_sizeof(element)


def _load(context: Any, builder: Any, array_type: Any, array: Any, index: Any) -> Any:
    pointer, _, size = _pointer(context, builder, array_type, array, index)
    value = builder.load(pointer)
    value.align = size
    return value


def _lane(k: int) -> Any:
    return ir.Constant(ir.IntType(32), k)


def _spread(builder: Any, vector: Any, number: Any) -> Any:
    out = ir.Constant(vector, ir.Undefined)
    for k in range(WIDTH):
        out = builder.insert_element(out, number, _lane(k))
    return out


@intrinsic
def cubics(typingctx: Any, table: Any, index: Any, step: Any, x: Any) -> Any:
    """Eight cubics at x, as a tuple: their coefficients of degree n are table[index + n*step] and the seven numbers
    after it."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, i, stride, at = arguments
        rows = []
        for _ in range(4):
            rows.append(_load(context, builder, signature.args[0], array, i))
            i = builder.add(i, stride)
        xs = _spread(builder, rows[0].type, at)
        y = rows[3]
        for row in rows[2::-1]:
            y = builder.fadd(row, builder.fmul(y, xs, flags=FAST), flags=FAST)
        out = ir.Constant(ir.ArrayType(rows[0].type.element, WIDTH), ir.Undefined)
        for k in range(WIDTH):
            out = builder.insert_value(out, builder.extract_element(y, _lane(k)), k)
        return out

    return types.UniTuple(table.dtype, WIDTH)(table, types.intp, types.intp, table.dtype), code


@intrinsic
def add_scaled(typingctx: Any, array: Any, index: Any, factor: Any, numbers: Any) -> Any:
    """array[index : index + 8] += factor * numbers, a tuple of eight."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target, i, v, w = arguments
        pointer, vector, size = _pointer(context, builder, signature.args[0], target, i)
        old = builder.load(pointer)
        old.align = size
        ws = ir.Constant(vector, ir.Undefined)
        for k in range(WIDTH):
            ws = builder.insert_element(ws, builder.extract_value(w, k), _lane(k))
        new = builder.fadd(old, builder.fmul(_spread(builder, vector, v), ws, flags=FAST), flags=FAST)
        builder.store(new, pointer).align = size
        return context.get_dummy_value()

    return types.void(array, types.intp, array.dtype, numbers), code


@intrinsic
def add_two(typingctx: Any, array: Any, index: Any, table: Any, row: Any, v: Any, other_row: Any, w: Any) -> Any:
    """array[index : index + 8] += v * table[row : row + 8] + w * table[other_row : other_row + 8]."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target, i, rows, j, first, k, second = arguments
        pointer, vector, size = _pointer(context, builder, signature.args[0], target, i)
        new = builder.load(pointer)
        new.align = size
        for begin, factor in ((j, first), (k, second)):
            values = _load(context, builder, signature.args[2], rows, begin)
            new = builder.fadd(new, builder.fmul(_spread(builder, vector, factor), values, flags=FAST), flags=FAST)
        builder.store(new, pointer).align = size
        return context.get_dummy_value()

    number = array.dtype
    return types.void(array, types.intp, table, types.intp, number, types.intp, number), code
