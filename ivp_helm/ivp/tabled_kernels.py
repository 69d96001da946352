"""Turning a table of utilities into pieces: the reflector's tiles and fits, with like ones joined.

The fit of each tile is that of fit_kernels.py for two variables, taken from the table instead of from a
function. Flat tiles of one value that lie side by side become one piece, which changes no value and
leaves a solver a quarter of the pieces.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ivp_helm.ivp.kernels import COVERS, new_block
from ivp_helm.ivp.pointers import floats_at, int32s_at

Array: TypeAlias = NDArray[Any]


@njit(cache=True, error_model="numpy", inline="always")
def _plane(
    c00: float, c01: float, c10: float, c11: float, centre: float, i0: int, i1: int, j0: int, j1: int
) -> tuple[float, float, float]:
    """Slopes per index and value at index (0, 0) of a tile's plane, from its corners and centre."""
    w = i1 - i0
    h = j1 - j0
    if c00 == c01 and c00 == c10 and c00 == c11 and (c00 == centre or (w < 2 and h < 2)):
        return 0.0, 0.0, c00
    mid_i = i0 + w // 2
    mid_j = j0 + h // 2
    a = 0.5 * ((c10 - c00) + (c11 - c01)) / w if w > 0 else 0.0
    b = 0.5 * ((c01 - c00) + (c11 - c10)) / h if h > 0 else 0.0
    most = max(c00, c01, c10, c11)
    least = min(c00, c01, c10, c11)
    c = (c00 + c01 + c10 + c11) - 2.0 * a * (i0 + i1) - 2.0 * b * (j0 + j1)
    if w >= 2 or h >= 2:
        c = 0.2 * (c + centre - a * mid_i - b * mid_j)
        most = max(most, centre)
        least = min(least, centre)
    else:
        c *= 0.25
    # No higher than the highest and no lower than the lowest value at the corners, where a plane ends.
    low_end = a * (i0 if a > 0.0 else i1) + b * (j0 if b > 0.0 else j1)
    high_end = a * (i1 if a > 0.0 else i0) + b * (j1 if b > 0.0 else j0)
    c = min(c, most - high_end)
    return a, b, max(c, least - low_end)


@njit(cache=True, error_model="numpy")
def sample(u: Array, width: int, height: int, samples: Array) -> None:
    """The values of a table shaped (m, n) that `tile` wants, in its order."""
    m, n = u.shape
    q = 0
    for i0 in range(0, m, width):
        i1 = min(i0 + width, m) - 1
        for i in (i0, i1):
            for j0 in range(0, n, height):
                samples[q] = u[i, j0]
                samples[q + 1] = u[i, min(j0 + height, n) - 1]
                q += 2
        for j0 in range(0, n, height):
            samples[q] = u[i0 + (i1 - i0) // 2, j0 + (min(j0 + height, n) - 1 - j0) // 2]
            q += 1


@njit(cache=True, error_model="numpy")
def tile(
    samples: Array, m: int, n: int, width: int, height: int, bounds: Array, planes: Array, owner: Array
) -> int:
    """Pieces over m by n points, cut into tiles of width rows by height columns; returns how many, -1 when
    a value is not finite.

    samples   for each row of tiles: the two corners of each tile along its first row, those along its last
              row, then the centre of each tile; 5 values a tile
    bounds    (tiles, 4) integers to fill in: low and high index of the first variable, then of the second
    planes    (tiles, 3) floats to fill in: two slopes per index, value at index (0, 0)
    owner     integers, one per tile along the second variable: scratch
    """
    across = owner.size
    count = 0
    for k in range(across):
        owner[k] = -1
    row = 0
    for i0 in range(0, m, width):
        i1 = min(i0 + width, m) - 1
        open_from = -1  # tile at which the newest piece of this row began if it is flat, else -1
        newest = -1
        for k in range(across):
            j0 = k * height
            j1 = min(j0 + height, n) - 1
            c00 = samples[row + 2 * k]
            c01 = samples[row + 2 * k + 1]
            c10 = samples[row + 2 * (across + k)]
            c11 = samples[row + 2 * (across + k) + 1]
            centre = samples[row + 4 * across + k]
            if not np.isfinite(c00 + c01 + c10 + c11 + centre):
                return -1
            a, b, c = _plane(c00, c01, c10, c11, centre, i0, i1, j0, j1)
            flat = a == 0.0 and b == 0.0
            if flat and open_from >= 0 and planes[newest, 2] == c:
                bounds[newest, 3] = j1
            else:
                if open_from >= 0:
                    count = _joined(bounds, planes, owner, open_from, k, newest, count)
                newest = count
                bounds[newest, 0] = i0
                bounds[newest, 1] = i1
                bounds[newest, 2] = j0
                bounds[newest, 3] = j1
                planes[newest, 0] = a
                planes[newest, 1] = b
                planes[newest, 2] = c
                count += 1
                open_from = k if flat else -1
                if not flat:
                    owner[k] = -1
        if open_from >= 0:
            count = _joined(bounds, planes, owner, open_from, across, newest, count)
        row += 5 * across
    return count


@njit(cache=True, error_model="numpy", inline="always")
def _joined(bounds: Array, planes: Array, owner: Array, begin: int, end: int, newest: int, count: int) -> int:
    """Let the flat newest piece, over tiles begin to end - 1, be part of its like in the row before.

    Returns the number of pieces then. A piece is always the last one when this is asked about it.
    """
    like = owner[begin]
    if (
        like >= 0
        and bounds[like, 1] == bounds[newest, 0] - 1
        and bounds[like, 2] == bounds[newest, 2]
        and bounds[like, 3] == bounds[newest, 3]
        and planes[like, 2] == planes[newest, 2]
    ):
        bounds[like, 1] = bounds[newest, 1]
        newest = like
        count -= 1
    for k in range(begin, end):
        owner[k] = newest
    return count


@njit(cache=True, error_model="numpy")
def block_of_tiles(bounds: Array, planes: Array, count: int, dims: int, base: float, extent: float) -> Array:
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


@njit(cache=True, error_model="numpy")
def block_of_samples(
    samples: Array, m: int, n: int, dims: int, width: int, height: int, base: float, extent: float
) -> Array:
    """The block (kernels.py) of the pieces that `tile` makes; without a piece when a value is not finite."""
    across = (n + height - 1) // height
    tiles = (m + width - 1) // width * across
    bounds = np.empty((tiles, 4), np.int64)
    planes = np.empty((tiles, 3))
    owner = np.empty(across, np.int64)
    count = tile(samples, m, n, width, height, bounds, planes, owner)
    if count < 0:
        return new_block(0, dims)
    return block_of_tiles(bounds, planes, count, dims, base, extent)
