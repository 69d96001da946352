"""Arrays made from memory addresses, inside and outside compiled code.

One problem holds any number of functions, each with its own array. Handing compiled code a list of
arrays costs a microsecond per array; handing it one array of addresses costs nothing. The caller
keeps the arrays alive while a kernel reads them; no address outlives the call it was made for.
"""

# mypy: disable-error-code="no-untyped-call,no-untyped-def,unused-ignore"
from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from numba import carray, types  # type: ignore[attr-defined,unused-ignore]
from numba.extending import intrinsic, overload
from numpy.typing import NDArray


def int64s_at(address: int, count: int) -> NDArray[np.int64]:
    """The `count` 64-bit integers at `address`."""
    return np.ctypeslib.as_array((ctypes.c_int64 * int(count)).from_address(int(address)))


def int32s_at(address: int, count: int) -> NDArray[np.int32]:
    """The `count` 32-bit integers at `address`."""
    return np.ctypeslib.as_array((ctypes.c_int32 * int(count)).from_address(int(address)))


def floats_at(address: int, count: int) -> NDArray[np.float64]:
    """The `count` 64-bit floats at `address`."""
    return np.ctypeslib.as_array((ctypes.c_double * int(count)).from_address(int(address)))


def _pointer_intrinsic(element: types.Type) -> Any:
    @intrinsic
    def as_pointer(typingctx, address):  # type: ignore[misc]
        pointer = types.CPointer(element)

        def codegen(context, builder, signature, args):
            return builder.inttoptr(args[0], context.get_value_type(pointer))

        return pointer(types.uintp), codegen

    return as_pointer


_int64_pointer = _pointer_intrinsic(types.int64)
_int32_pointer = _pointer_intrinsic(types.int32)
_float_pointer = _pointer_intrinsic(types.float64)


@overload(int64s_at, inline="always")
def _int64s_at(address, count):
    return lambda address, count: carray(_int64_pointer(address), count)


@overload(int32s_at, inline="always")
def _int32s_at(address, count):
    return lambda address, count: carray(_int32_pointer(address), count)


@overload(floats_at, inline="always")
def _floats_at(address, count):
    return lambda address, count: carray(_float_pointer(address), count)
