"""What compiled code needs beyond numba's own language: calls and arrays by address, blocks of memory, local scratch.

This file alone knows numba's internals. Arrays that are made here have no reference count: counting costs 5 ns a time,
and a cycle would do it a hundred times. So they must not outlive what they lie in, and stay inside compiled code.

Under NUMBA_DISABLE_JIT each function is its Python equivalent.
"""

import ctypes
from collections.abc import Callable
from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

from primitives.compiled import JIT_DISABLED

_VECTOR = types.Array(types.float64, 1, "C")
_PAIR_ARGUMENTS = (_VECTOR, _VECTOR, _VECTOR)
_PAIR_RESULT = types.Tuple((types.float64, types.int64))

PAIR_SIGNATURE = "Tuple((float64, int64))(float64[::1], float64[::1], float64[::1])"
"""Signature shared by the kernels of all pairs: (a, b, gradient) -> (distance, status)."""

_by_address: dict[int, Callable[..., Any]] = {}


def address_of(kernel: Callable[..., Any]) -> int:
    """Address by which compiled loops call a pair's kernel; the dispatcher is kept alive for good.

    Under NUMBA_DISABLE_JIT it is a number that `call_pair` looks the Python function up by.
    """
    if JIT_DISABLED:
        address = id(kernel)
    else:
        result = cast(Any, kernel).overloads[_PAIR_ARGUMENTS]
        address = int(result.library.get_pointer_to_function(result.fndesc.llvm_func_name))
    _by_address[address] = kernel
    return address


if JIT_DISABLED:

    def call_pair(address: int, a: Any, b: Any, gradient: Any) -> Any:
        """Call the kernel that stands at an address."""
        return _by_address[int(address)](a, b, gradient)

    def block(memory: Any, start: int, shape: tuple[int, ...]) -> Any:
        """Array of that shape over the numbers of memory (1-dimensional) from start on."""
        return memory[start : start + int(np.prod(shape))].reshape(shape)

    def _array_at(kind: Any, address: int, shape: tuple[int, ...]) -> Any:
        return np.ctypeslib.as_array((kind * int(np.prod(shape))).from_address(int(address))).reshape(shape)

    def floats_at(address: int, shape: tuple[int, ...]) -> Any:
        """Array of float64 of that shape over the memory at an address."""
        return _array_at(ctypes.c_double, address, shape)

    def integers_at(address: int, shape: tuple[int, ...]) -> Any:
        """Array of int64 of that shape over the memory at an address."""
        return _array_at(ctypes.c_int64, address, shape)

    def scratch(size: int) -> Any:
        """Uninitialised floats (size,) that last until the function returns; size is a literal."""
        return np.empty(size)

else:

    @intrinsic
    def call_pair(typing_context: Any, address: Any, a: Any, b: Any, gradient: Any) -> Any:
        """Call the kernel that stands at an address, in numba's own calling convention."""

        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            function_type = context.call_conv.get_function_type(_PAIR_RESULT, _PAIR_ARGUMENTS)
            function = builder.inttoptr(arguments[0], function_type.as_pointer())
            status, result = context.call_conv.call_function(
                builder, function, _PAIR_RESULT, _PAIR_ARGUMENTS, arguments[1:]
            )
            with cgutils.if_unlikely(builder, status.is_error):
                context.call_conv.return_status_propagate(builder, status)
            return result

        return _PAIR_RESULT(types.int64, *_PAIR_ARGUMENTS), codegen

    def _uncounted(context: Any, builder: Any, kind: Any, data: Any, shape: list[Any]) -> Any:
        """Value of a contiguous array of that type over data."""
        array = make_array(kind)(context, builder)
        size = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(kind.dtype)))
        strides: list[Any] = []
        step = size
        for extent in reversed(shape):
            strides.insert(0, step)
            step = builder.mul(step, extent)
        populate_array(array, data=data, shape=shape, strides=strides, itemsize=size, meminfo=None)
        return array._getvalue()

    @intrinsic
    def block(typing_context: Any, memory: Any, start: Any, shape: Any) -> Any:
        """Array of that shape over the numbers of memory (1-dimensional) from start on."""
        kind = types.Array(memory.dtype, len(shape), "C")

        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            source = make_array(signature.args[0])(context, builder, arguments[0])
            extents = [builder.extract_value(arguments[2], i) for i in range(len(shape))]
            return _uncounted(context, builder, kind, builder.gep(source.data, [arguments[1]]), extents)

        return kind(memory, types.int64, types.UniTuple(types.int64, len(shape))), codegen

    def _at(item: Any, address: Any, shape: Any) -> Any:
        kind = types.Array(item, len(shape), "C")

        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            extents = [builder.extract_value(arguments[1], i) for i in range(len(shape))]
            data = builder.inttoptr(arguments[0], context.get_data_type(item).as_pointer())
            return _uncounted(context, builder, kind, data, extents)

        return kind(types.int64, types.UniTuple(types.int64, len(shape))), codegen

    @intrinsic
    def floats_at(typing_context: Any, address: Any, shape: Any) -> Any:
        """Array of float64 of that shape over the memory at an address."""
        return _at(types.float64, address, shape)

    @intrinsic
    def integers_at(typing_context: Any, address: Any, shape: Any) -> Any:
        """Array of int64 of that shape over the memory at an address."""
        return _at(types.int64, address, shape)

    @intrinsic(prefer_literal=True)
    def scratch(typing_context: Any, size: Any) -> Any:
        """Uninitialised floats (size,) that last until the function returns; size is a literal."""
        if not isinstance(size, types.IntegerLiteral):
            return None

        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            number = context.get_data_type(types.float64)
            local = cgutils.alloca_once(builder, ir.ArrayType(number, size.literal_value))
            data = builder.bitcast(local, number.as_pointer())
            return _uncounted(context, builder, _VECTOR, data, [context.get_constant(types.intp, size.literal_value)])

        return _VECTOR(size), codegen
