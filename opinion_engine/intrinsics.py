"""Three machine instructions that compiled Python cannot spell: the bits of a double, and a cache hint.

For use inside compiled kernels only.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.core import typing as numba_typing
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

signature: Any = vars(numba_typing)["signature"]


def _bits_of(typing_context: Any, x: Any) -> Any:
    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.bitcast(args[0], ir.IntType(64))

    return signature(types.int64, types.float64), emit


def _double_of(typing_context: Any, x: Any) -> Any:
    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.bitcast(args[0], ir.DoubleType())

    return signature(types.float64, types.int64), emit


def _prefetch(typing_context: Any, array: Any, row: Any) -> Any:
    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        build: Any = make_array
        data = build(sig.args[0])(context, builder, args[0])
        width = builder.extract_value(data.shape, 1)
        byte = ir.IntType(8).as_pointer()
        address = builder.bitcast(builder.gep(data.data, [builder.mul(args[1], width)]), byte)
        word = ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [byte, word, word, word])
        hint = builder.module.declare_intrinsic("llvm.prefetch", [byte], kind)
        builder.call(hint, [address, word(0), word(3), word(1)])  # to read, keep, data
        return context.get_dummy_value()

    return signature(types.void, array, types.int64), emit


bits_of: Any = intrinsic(_bits_of)
"""bits_of(x): the 64 bits of a double as an integer."""

double_of: Any = intrinsic(_double_of)
"""double_of(bits): the double with these 64 bits."""

prefetch: Any = intrinsic(_prefetch)
"""prefetch(array, row): ask for array[row] (two-dimensional, C order); changes no result, does not read it.
"""
