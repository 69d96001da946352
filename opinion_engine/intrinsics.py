"""What compiled Python cannot spell: the bits of a double, a product and sum rounded once, and sums of rows in
vector registers.

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


def _multiply_add(typing_context: Any, x: Any, y: Any, z: Any) -> Any:
    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.fma(*args)

    return signature(types.float64, types.float64, types.float64, types.float64), emit


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


def _side_by_side_summer(lanes: int) -> Any:
    """The intrinsic that sums the rows of `SIDE` agents at once, each in a register of its own."""

    def sum_sides(
        typing_context: Any, z: Any, slots: Any, first: Any, last: Any, out: Any, places: Any, place: Any
    ) -> Any:
        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            build: Any = make_array
            source, listed, target, put = (
                build(sig.args[n])(context, builder, args[n]).data for n in (0, 1, 4, 5)
            )
            word, half, double = ir.IntType(64), ir.IntType(32), ir.DoubleType()
            vector = ir.VectorType(double, lanes)
            width = ir.Constant(word, lanes)
            address = ir.IntType(8).as_pointer()
            wanted = ir.FunctionType(ir.VoidType(), [address, half, half, half])
            insert: Any = cgutils.get_or_insert_function
            fetch = insert(builder.module, wanted, "llvm.prefetch.p0i8")
            how = [ir.Constant(half, value) for value in (0, 2, 1)]  # to read, into the second cache, data

            def row_of(data: Any, row: Any) -> Any:
                return builder.bitcast(builder.gep(data, [builder.mul(row, width)]), vector.as_pointer())

            zero = ir.Constant(vector, [ir.Constant(double, 0.0)] * lanes)
            allocate: Any = cgutils.alloca_once_value
            totals = [allocate(builder, zero) for _ in range(SIDE)]
            for total in totals:  # the place is the same each time round an outer loop
                builder.store(zero, total)
            with cgutils.for_range_slice(builder, args[2], args[3], ir.Constant(word, SIDE)) as (e, _):
                for side, total in enumerate(totals):
                    later = builder.gep(listed, [builder.add(e, ir.Constant(word, AHEAD + side))])
                    soon = builder.zext(builder.load(later), word)
                    builder.call(fetch, [builder.bitcast(row_of(source, soon), address), *how])
                    slot = builder.gep(listed, [builder.add(e, ir.Constant(word, side))])
                    row = builder.zext(builder.load(slot), word)
                    value = builder.load(row_of(source, row), align=8)
                    builder.store(builder.fadd(builder.load(total), value), total)
            for side, total in enumerate(totals):
                seat = builder.gep(put, [builder.add(args[6], ir.Constant(word, side))])
                row = builder.zext(builder.load(seat), word)
                builder.store(builder.load(total), row_of(target, row), align=8)
            return context.get_dummy_value()

        seven = (z, slots, types.int64, types.int64, out, places, types.int64)
        return signature(types.void, *seven), emit

    return sum_sides


SIDE = 8
"""Agents that `sum_sides4` and `sum_sides8` sum at once."""

AHEAD = 256
"""Slots ahead of the one being summed whose rows they ask memory for; as many must follow the last one in use.

They ask for them in the second-level cache, which can wait for more lines at once than the first: a fifth faster
than the first where neighbours lie anywhere, an eighth slower where they lie close."""

bits_of: Any = intrinsic(_bits_of)
"""bits_of(x): the 64 bits of a double as an integer."""

double_of: Any = intrinsic(_double_of)
"""double_of(bits): the double with these 64 bits."""

multiply_add: Any = intrinsic(_multiply_add)
"""multiply_add(x, y, z): x * y + z with one rounding, one instruction on any processor since about 2013."""

sum_rows4: Any = intrinsic(_row_summer(4))
"""sum_rows4(z, rows, first, last, out, place): row `place` of out = sum of the rows rows[e] of z, first <= e < last.

z and out are rows of 4 doubles, one after the other, rows uint32. Nothing is checked."""

sum_rows8: Any = intrinsic(_row_summer(8))
"""As `sum_rows4`, for rows of 8."""

sum_sides4: Any = intrinsic(_side_by_side_summer(4))
"""sum_sides4(z, slots, first, last, out, places, place): for each of SIDE agents s, row places[place + s] of out =
sum of the rows slots[e + s] of z for e = first, first + SIDE, ... < last.

Rows are as in `sum_rows4`, slots uint32, places uint8. Agents side by side wait for memory together, and need one
branch for all. Nothing is checked."""

sum_sides8: Any = intrinsic(_side_by_side_summer(8))
"""As `sum_sides4`, for rows of 8."""
