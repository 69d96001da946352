"""Compiled writing of numbers: a helm writes tens of thousands of them each second."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ivp_helm.ivp.pointers import floats_at, int32s_at

Array: TypeAlias = NDArray[Any]

COMMA = 44
MINUS = 45
POINT = 46
ZERO = 48


@njit(cache=True)
def _write_integer(out: Array, at: int, number: int, digits: int) -> int:
    """Write a number >= 0 with at least so many digits; returns where to go on."""
    count = 1
    rest = number
    while rest >= 10:
        rest //= 10
        count += 1
    count = max(count, digits)
    for i in range(at + count - 1, at - 1, -1):
        out[i] = ZERO + number % 10
        number //= 10
    return at + count


@njit(cache=True)
def _write_weight(out: Array, at: int, weight: float) -> int:
    """Write a piece weight: at most four decimals, half up on the magnitude. Source: ivp_math.md 9.1."""
    if weight == 0.0:
        out[at] = ZERO
        return at + 1
    if weight < 0.0:
        out[at] = MINUS
        at += 1
    n = int(np.floor(abs(weight) * 10000.0 + 0.5))
    at = _write_integer(out, at, n // 10000, 1)
    out[at] = POINT
    at += 1
    rest = n % 10000
    if n == 0:
        return _write_integer(out, at, 0, 4)
    digits = 4
    while digits > 0 and rest % 10 == 0:
        rest //= 10
        digits -= 1
    return _write_integer(out, at, rest, digits) if digits else at


@njit(cache=True)
def write_pieces(block: Array, degree: int) -> Array:
    """All pieces as text bytes: bounds and weights of each, separated by commas."""
    n = block[0]
    dims = block[1]
    low = int32s_at(block[2], n * dims)
    high = int32s_at(block[3], n * dims)
    coef = floats_at(block[4], n * (dims + 1))
    # 10 digits and a comma per bound; sign, 16 digits, point and comma per weight
    out = np.empty(n * (22 * dims + 24 * (dims + 1)), np.uint8)
    at = 0
    for p in range(n):
        for d in range(dims):
            at = _write_integer(out, at, low[d * n + p], 1)
            out[at] = COMMA
            at = _write_integer(out, at + 1, high[d * n + p], 1)
            out[at] = COMMA
            at += 1
        for d in range(0 if degree else dims, dims + 1):
            at = _write_weight(out, at, coef[d * n + p])
            out[at] = COMMA
            at += 1
    return out[: at - 1]
