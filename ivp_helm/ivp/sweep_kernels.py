"""The dense half of the solver: add all functions up over every point and take the best.

Quickest for small components, where cells and lists would cost more than the points themselves.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ivp_helm.ivp.pointers import floats_at, int32s_at, int64s_at

Array: TypeAlias = NDArray[Any]  # of 64-bit integers or floats, whichever the docstring says

COVERS = 1  # as in kernels.py; repeated, since a compile cache does not see changes in another module


@njit(cache=True, error_model="numpy")
def sweep(
    table: Array, members: Array, count: int, place: Array, n: int, points: Array,
    scales: Array, shifts: Array, tolerance: float, floats: Array, best: Array,
    own_stride: Array, ints: Array,
) -> float:  # fmt: skip
    """Add all member functions up over every point of the component; returns the best value, -inf if none.

    `place[k * n + d]` is the component variable of function k's variable d; `floats` holds two tables.
    """
    total = 1
    for v in range(n):
        total *= points[v]
    totals = floats[:total]
    scratch = floats[total : 2 * total]
    stride = ints[:n]
    at = ints[n : 2 * n]
    step = 1
    for v in range(n - 1, -1, -1):
        stride[v] = step
        step *= points[v]
    totals[:] = 0.0
    for m in range(count):
        k = members[m]
        block = int64s_at(table[3 * k], 8)
        pieces = block[0]
        dims = block[1]
        low = int32s_at(block[2], pieces * dims)
        high = int32s_at(block[3], pieces * dims)
        coef = floats_at(block[4], pieces * (dims + 1))
        scale = scales[k]
        last = dims - 1
        # straight into the total if it spans the component without a gap, else into a table of its own
        whole = dims == n and (block[5] & COVERS) != 0
        target = totals
        if not whole:
            target = scratch
            step = 1
            for d in range(dims - 1, -1, -1):
                own_stride[d] = step
                step *= points[place[k * n + d]]
            scratch[:step] = -np.inf
        for p in range(pieces):
            constant = coef[dims * pieces + p] * scale + shifts[k]
            slope = coef[last * pieces + p] * scale
            first = low[last * pieces + p]
            end = high[last * pieces + p] + 1
            if dims == 1:
                if whole:
                    for j in range(first, end):
                        totals[j] += constant + slope * j
                else:
                    for j in range(first, end):
                        scratch[j] = constant + slope * j
                continue
            hop = stride[place[k * n + last]] if whole else 1
            for d in range(last):
                at[d] = low[d * pieces + p]
            while True:
                start = 0
                value = constant
                for d in range(last):
                    start += at[d] * (stride[place[k * n + d]] if whole else own_stride[d])
                    value += coef[d * pieces + p] * scale * at[d]
                if not whole:
                    for j in range(first, end):
                        target[start + j] = value + slope * j
                elif hop == 1:
                    for j in range(first, end):
                        target[start + j] += value + slope * j
                else:
                    for j in range(first, end):
                        target[start + j * hop] += value + slope * j
                d = last - 1
                while d >= 0:
                    at[d] += 1
                    if at[d] <= high[d * pieces + p]:
                        break
                    at[d] = low[d * pieces + p]
                    d -= 1
                if d < 0:
                    break
        if not whole:
            _spread(totals, scratch, n, points, place[k * n : k * n + dims], own_stride, dims, ints)
    # four maxima at a time, since each comparison has to wait for the one before it
    top = t1 = t2 = t3 = -np.inf
    even = total - total % 4
    for j in range(0, even, 4):
        top = max(top, totals[j])
        t1 = max(t1, totals[j + 1])
        t2 = max(t2, totals[j + 2])
        t3 = max(t3, totals[j + 3])
    for j in range(even, total):
        top = max(top, totals[j])
    top = max(top, t1, t2, t3)
    if top == -np.inf:
        return top
    j = total - 1
    while totals[j] < top - tolerance:
        j -= 1
    top = float(totals[j])
    for v in range(n):
        best[v] = j // stride[v]
        j -= best[v] * stride[v]
    return top


@njit(cache=True, error_model="numpy")
def _spread(
    totals: Array, part: Array, n: int, points: Array, place: Array, stride: Array, dims: int, ints: Array
) -> None:
    """totals[point] += part[point restricted to the part's variables], for every point."""
    hops = ints[2 * n : 3 * n]
    at = ints[3 * n : 4 * n]
    for v in range(n):
        hops[v] = 0
        at[v] = 0
    for d in range(dims):
        hops[place[d]] = stride[d]
    inner = points[n - 1]
    hop = hops[n - 1]
    start = 0
    source = 0
    while True:
        if hop == 0:
            value = part[source]
            for j in range(inner):
                totals[start + j] += value
        elif hop == 1:
            for j in range(inner):
                totals[start + j] += part[source + j]
        else:
            for j in range(inner):
                totals[start + j] += part[source + j * hop]
        start += inner
        v = n - 2
        while v >= 0:
            at[v] += 1
            source += hops[v]
            if at[v] < points[v]:
                break
            source -= at[v] * hops[v]
            at[v] = 0
            v -= 1
        if v < 0:
            return
