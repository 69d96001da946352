"""What compiled Python cannot spell: the bits of a double, and sums of rows in a vector register.

For use inside compiled kernels only.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
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


def _row_summer(lanes: int) -> Any:
    """The intrinsic that sums rows of `lanes` doubles in one vector register, in the order listed."""

    def sum_rows(typing_context: Any, z: Any, rows: Any, first: Any, last: Any, out: Any, place: Any) -> Any:
        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            build: Any = make_array
            source, listed, target = (build(sig.args[n])(context, builder, args[n]).data for n in (0, 1, 4))
            word, double = ir.IntType(64), ir.DoubleType()
            vector = ir.VectorType(double, lanes)
            width = ir.Constant(word, lanes)

            def row_of(data: Any, row: Any) -> Any:
                return builder.bitcast(builder.gep(data, [builder.mul(row, width)]), vector.as_pointer())

            zero = ir.Constant(vector, [ir.Constant(double, 0.0)] * lanes)
            allocate: Any = cgutils.alloca_once_value
            total = allocate(builder, zero)
            with cgutils.for_range_slice(builder, args[2], args[3], ir.Constant(word, 1)) as (e, _):
                row = builder.zext(builder.load(builder.gep(listed, [e])), word)
                value = builder.load(row_of(source, row), align=8)
                builder.store(builder.fadd(builder.load(total), value), total)
            builder.store(builder.load(total), row_of(target, args[5]), align=8)
            return context.get_dummy_value()

        return signature(types.void, z, rows, types.int64, types.int64, out, types.int64), emit

    return sum_rows


bits_of: Any = intrinsic(_bits_of)
"""bits_of(x): the 64 bits of a double as an integer."""

double_of: Any = intrinsic(_double_of)
"""double_of(bits): the double with these 64 bits."""

sum_rows4: Any = intrinsic(_row_summer(4))
"""sum_rows4(z, rows, first, last, out, place): row `place` of out = sum of the rows rows[e] of z, first <= e < last.

z and out are rows of 4 doubles, one after the other, rows uint32. Nothing is checked."""

sum_rows8: Any = intrinsic(_row_summer(8))
"""As `sum_rows4`, for rows of 8."""
