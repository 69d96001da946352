"""Cutting a table of utilities into as few linear pieces as a tolerance allows.

The table is halved until every part is a plane to within the tolerance: one pass over a flat or planar
part, a few more along edges and ridges, single points at steps. Planes are least-squares fits, moved so
that none leaves the range of the values it stands for. The slow twin of these kernels is in their tests.
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
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            if u[i, j] != first:
                return False
    return True


@njit(cache=True, error_model="numpy")
def _fit(u: Array, i0: int, i1: int, j0: int, j1: int, tolerance: float) -> tuple[float, float, float, float]:
    """Slopes per index, value at index (0, 0), and the largest error of the plane for a part.

    An error above the tolerance is the first one found, not the largest.
    """
    w = i1 - i0 + 1
    h = j1 - j0 + 1
    mid_i = 0.5 * (i0 + i1)
    mid_j = 0.5 * (j0 + j1)
    total = 0.0
    tilt_i = 0.0
    tilt_j = 0.0
    least = u[i0, j0]
    most = least
    for i in range(i0, i1 + 1):
        row = 0.0
        for j in range(j0, j1 + 1):
            value = u[i, j]
            row += value
            tilt_j += value * (j - mid_j)
            least = min(least, value)
            most = max(most, value)
        total += row
        tilt_i += row * (i - mid_i)
    # On a full grid the normal equations of the plane fall apart into one per slope.
    a = tilt_i * 12.0 / (h * w * (w * w - 1.0)) if w > 1 else 0.0
    b = tilt_j * 12.0 / (w * h * (h * h - 1.0)) if h > 1 else 0.0
    span = abs(a) * (w - 1) + abs(b) * (h - 1)
    if span > most - least:
        shrink = (most - least) / span
        a *= shrink
        b *= shrink
        span = most - least
    middle = total / (w * h)
    middle = max(min(middle, most - 0.5 * span), least + 0.5 * span)
    c = middle - a * mid_i - b * mid_j
    error = 0.0
    for i in range(i0, i1 + 1):
        base = c + a * i
        for j in range(j0, j1 + 1):
            error = max(error, abs(u[i, j] - (base + b * j)))
        if error > tolerance:
            break
    return a, b, c, error


@njit(cache=True, error_model="numpy")
def cut(u: Array, tolerance: float, first_i: int, bounds: Array, planes: Array) -> int:
    """Pieces of a table shaped (m, n); returns how many.

    bounds    (m * n, 4) integers to fill in: low and high index of the first variable, then of the second
    planes    (m * n, 3) floats to fill in: two slopes per index, value at index (0, 0)
    first_i   rows of the parts to begin with

    The part with the table's highest value is cut until it holds that value exactly, so that the
    approximation and the table are highest at the same point.
    """
    m, n = u.shape
    top_i = 0
    top_j = 0
    most = -np.inf
    for i in range(m):
        for j in range(n):
            # Of equal values the last, as a solver would choose.
            if u[i, j] >= most:
                most = u[i, j]
                top_i = i
                top_j = j
    stack = np.empty((_DEPTH, 4), np.int64)
    count = 0
    for start in range(0, m, first_i):
        stack[0, 0] = start
        stack[0, 1] = min(start + first_i, m) - 1
        stack[0, 2] = 0
        stack[0, 3] = n - 1
        waiting = 1
        while waiting > 0:
            waiting -= 1
            i0 = stack[waiting, 0]
            i1 = stack[waiting, 1]
            j0 = stack[waiting, 2]
            j1 = stack[waiting, 3]
            if _is_flat(u, i0, i1, j0, j1):
                a = 0.0
                b = 0.0
                c = u[i0, j0]
            else:
                a, b, c, error = _fit(u, i0, i1, j0, j1, tolerance)
                if error > tolerance or (
                    i0 <= top_i <= i1 and j0 <= top_j <= j1 and c + a * top_i + b * top_j != most
                ):
                    rows = i1 - i0 >= j1 - j0
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
        block.view(np.float64)[8 + d] = edges / count
    for p in range(count):
        coef[dims * count + p] = planes[p, 2] * scale + shift
    block[5] = COVERS
    floats = block.view(np.float64)
    floats[6] = least
    floats[7] = most
    return block
