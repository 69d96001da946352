"""Cutting a table of utilities into as few linear pieces as a tolerance allows.

The table is halved until every part is a plane to within the tolerance: a glance at a flat part, a few
cuts along edges and ridges, single points at steps. A plane takes its slopes from the part's corners and
lies midway between corners and centre, which is where the error of a curved surface is least; it is found
at once, and one that does not fit is mostly found out after a few points.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ivp_helm.ivp.kernels import COVERS, new_block
from ivp_helm.ivp.pointers import floats_at, int32s_at

Array: TypeAlias = NDArray[Any]

_DEPTH = 128  # parts waiting to be looked at; halving a side of 2**31 points needs far fewer


@njit(cache=True, error_model="numpy")
def _is_flat(u: Array, i0: int, i1: int, j0: int, j1: int) -> bool:
    first = u[i0, j0]
    if u[i1, j1] != first or u[i0, j1] != first or u[i1, j0] != first:
        return False
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            if u[i, j] != first:
                return False
    return True


@njit(cache=True, error_model="numpy")
def _plane(u: Array, i0: int, i1: int, j0: int, j1: int) -> tuple[float, float, float]:
    """Slopes per index and value at index (0, 0) of a part's plane.

    It nowhere leaves the range of the corners and the centre, so that no part is higher than its values.
    """
    w = i1 - i0
    h = j1 - j0
    c00 = u[i0, j0]
    c01 = u[i0, j1]
    c10 = u[i1, j0]
    c11 = u[i1, j1]
    a = 0.5 * ((c10 - c00) + (c11 - c01)) / w if w > 0 else 0.0
    b = 0.5 * ((c01 - c00) + (c11 - c10)) / h if h > 0 else 0.0
    middle = 0.25 * (c00 + c01 + c10 + c11)
    mid_i = (i0 + i1) // 2
    mid_j = (j0 + j1) // 2
    centre = u[mid_i, mid_j]
    if w > 1 or h > 1:
        level = centre - a * (mid_i - 0.5 * (i0 + i1)) - b * (mid_j - 0.5 * (j0 + j1))
        middle = 0.5 * (middle + level)
    most = max(max(max(c00, c01), max(c10, c11)), centre)
    least = min(min(min(c00, c01), min(c10, c11)), centre)
    reach = 0.5 * (abs(a) * w + abs(b) * h)
    middle = max(min(middle, most - reach), least + reach)
    return a, b, middle - a * 0.5 * (i0 + i1) - b * 0.5 * (j0 + j1)


@njit(cache=True, error_model="numpy")
def _fits(
    u: Array, i0: int, i1: int, j0: int, j1: int, a: float, b: float, c: float, tolerance: float
) -> bool:
    mid = (i0 + i1) // 2
    for k in range(3):  # where a misfit shows first: at the ends and in the middle of both middle lines
        i = i0 if k == 0 else (mid if k == 1 else i1)
        j = (j0 + j1) // 2
        if abs(u[i, j] - (c + a * i + b * j)) > tolerance:
            return False
        j = j0 if k == 0 else ((j0 + j1) // 2 if k == 1 else j1)
        if abs(u[mid, j] - (c + a * mid + b * j)) > tolerance:
            return False
    for i in range(i0, i1 + 1):
        base = c + a * i
        for j in range(j0, j1 + 1):
            if abs(u[i, j] - (base + b * j)) > tolerance:
                return False
    return True


@njit(cache=True, error_model="numpy")
def _changes_by_row(u: Array, i0: int, i1: int, j0: int, j1: int) -> bool:
    """Whether a part changes more from row to row than along them, judged by its rim and middle lines."""
    if j1 == j0:
        return True
    if i1 == i0:
        return False
    down = 0.0
    for j in (j0, (j0 + j1) // 2, j1):
        for i in range(i0, i1):
            down += abs(u[i + 1, j] - u[i, j])
    along = 0.0
    for i in (i0, (i0 + i1) // 2, i1):
        for j in range(j0, j1):
            along += abs(u[i, j + 1] - u[i, j])
    return down >= along


@njit(cache=True, error_model="numpy")
def _last_of(u: Array, value: float) -> tuple[int, int]:
    """The last point that has a value, as a solver prefers it among equals."""
    for i in range(u.shape[0] - 1, -1, -1):
        for j in range(u.shape[1] - 1, -1, -1):
            if u[i, j] == value:
                return i, j
    return 0, 0


@njit(cache=True, error_model="numpy")
def cut(u: Array, most: float, tolerance: float, first_rows: int, bounds: Array, planes: Array) -> int:
    """Pieces of a table shaped (m, n) whose highest value is `most`; returns how many.

    bounds       (m * n, 4) integers to fill in: low and high index of the first variable, then of the second
    planes       (m * n, 3) floats to fill in: two slopes per index, value at index (0, 0)
    first_rows   rows of the parts to begin with

    The part with the table's highest value is cut until it holds that value exactly, so that the
    pieces and the table are highest at the same point.
    """
    m, n = u.shape
    top_i, top_j = _last_of(u, most)
    stack = np.empty((_DEPTH, 4), np.int64)
    count = 0
    flat_until = -1  # last row of the newest piece if it is a flat strip across the table, else -1
    for start in range(0, m, first_rows):
        stack[0, 0] = start
        stack[0, 1] = min(start + first_rows, m) - 1
        stack[0, 2] = 0
        stack[0, 3] = n - 1
        waiting = 1
        while waiting > 0:
            waiting -= 1
            i0 = stack[waiting, 0]
            i1 = stack[waiting, 1]
            j0 = stack[waiting, 2]
            j1 = stack[waiting, 3]
            a = 0.0
            b = 0.0
            c = u[i0, j0]
            if _is_flat(u, i0, i1, j0, j1):
                strip = j0 == 0 and j1 == n - 1
                if strip and count > 0 and flat_until == i0 - 1 and planes[count - 1, 2] == c:
                    bounds[count - 1, 1] = i1
                    flat_until = i1
                    continue
                flat_until = i1 if strip else -1
            else:
                a, b, c = _plane(u, i0, i1, j0, j1)
                on_top = not (i0 <= top_i <= i1 and j0 <= top_j <= j1) or c + a * top_i + b * top_j == most
                if not on_top or not _fits(u, i0, i1, j0, j1, a, b, c, tolerance):
                    rows = _changes_by_row(u, i0, i1, j0, j1)
                    middle = (i0 + i1) // 2 if rows else (j0 + j1) // 2
                    for k in range(4):
                        stack[waiting + 1, k] = stack[waiting, k]
                    if rows:
                        stack[waiting + 1, 1] = middle
                        stack[waiting, 0] = middle + 1
                    else:
                        stack[waiting + 1, 3] = middle
                        stack[waiting, 2] = middle + 1
                    waiting += 2
                    continue
                flat_until = -1
            bounds[count, 0] = i0
            bounds[count, 1] = i1
            bounds[count, 2] = j0
            bounds[count, 3] = j1
            planes[count, 0] = a
            planes[count, 1] = b
            planes[count, 2] = c
            count += 1
    return count


@njit(cache=True, error_model="numpy")
def block_of_cuts(bounds: Array, planes: Array, count: int, dims: int, base: float, extent: float) -> Array:
    """The block (kernels.py) of `count` pieces over 1 or 2 variables, stretched to base..base + extent.

    An extent of 0 leaves the values as they are.
    """
    least = np.inf
    most = -np.inf
    for p in range(count):
        for i in range(2):
            for j in range(2):
                value = planes[p, 2] + planes[p, 0] * bounds[p, i] + planes[p, 1] * bounds[p, 2 + j]
                least = min(least, value)
                most = max(most, value)
    scale = 1.0
    shift = 0.0
    if extent > 0.0 and most > least:
        scale = extent / (most - least)
        shift = base - least * scale
        most = base + extent
        least = base
    block = new_block(count, dims)
    floats = block.view(np.float64)
    low = int32s_at(block[2], count * dims)
    high = int32s_at(block[3], count * dims)
    coef = floats_at(block[4], count * (dims + 1))
    for d in range(dims):
        edges = 0.0
        for p in range(count):
            low[d * count + p] = bounds[p, 2 * d]
            high[d * count + p] = bounds[p, 2 * d + 1]
            coef[d * count + p] = planes[p, d] * scale
            edges += bounds[p, 2 * d + 1] - bounds[p, 2 * d] + 1
        floats[8 + d] = edges / count
    for p in range(count):
        coef[dims * count + p] = planes[p, 2] * scale + shift
    block[5] = COVERS
    floats[6] = least
    floats[7] = most
    return block
