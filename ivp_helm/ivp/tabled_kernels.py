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


@njit(cache=True, error_model="numpy")
def sample(u: Array, width: int, height: int, samples: Array) -> None:
    """The values of a table shaped (m, n) that `fit` wants, in its order."""
    m, n = u.shape
    rows = (m + width - 1) // width
    tiles = rows * ((n + height - 1) // height)
    q = 0
    for j0 in range(0, n, height):
        j1 = min(j0 + height, n) - 1
        for i0 in range(0, m, width):
            i1 = min(i0 + width, m) - 1
            samples[q] = u[i0, j0]
            samples[q + tiles] = u[i0, j1]
            samples[q + 2 * tiles] = u[i1, j0]
            samples[q + 3 * tiles] = u[i1, j1]
            samples[q + 4 * tiles] = u[i0 + (i1 - i0) // 2, j0 + (j1 - j0) // 2]
            q += 1


@njit(cache=True, error_model="numpy")
def fit(samples: Array, m: int, n: int, width: int, height: int, planes: Array) -> bool:
    """The plane of every tile of m by n points, from its corners and centre; False if a value is not finite.

    The tiles have width rows by height columns and are counted down the first column, then the next.

    samples   the low low, low high, high low and high high corners of all tiles, then all centres
    planes    (3, tiles) to fill in: two slopes per index, value at index (0, 0)
    """
    rows = (m + width - 1) // width
    tiles = planes.shape[1]
    c00s = samples[:tiles]
    c01s = samples[tiles : 2 * tiles]
    c10s = samples[2 * tiles : 3 * tiles]
    c11s = samples[3 * tiles : 4 * tiles]
    centres = samples[4 * tiles : 5 * tiles]
    slopes_i = planes[0]
    slopes_j = planes[1]
    levels = planes[2]
    odd = 0
    for k in range(tiles // rows):
        # Whole numbers as floats, and choices instead of branches, so that several tiles are done at once.
        j0 = float(k * height)
        j1 = min(j0 + height, float(n)) - 1.0
        h = j1 - j0
        mid_j = j0 + np.floor(0.5 * h)
        begin = k * rows
        for r in range(rows):
            q = begin + r
            c00 = c00s[q]
            c01 = c01s[q]
            c10 = c10s[q]
            c11 = c11s[q]
            centre = centres[q]
            i0 = float(r) * width
            i1 = min(i0 + width, float(m)) - 1.0
            w = i1 - i0
            mid_i = i0 + np.floor(0.5 * w)
            small = w < 2.0 and h < 2.0
            a = 0.5 * ((c10 - c00) + (c11 - c01)) / (w if w > 0.0 else 1.0)
            b = 0.5 * ((c01 - c00) + (c11 - c10)) / (h if h > 0.0 else 1.0)
            a = a if w > 0.0 else 0.0
            b = b if h > 0.0 else 0.0
            most = max(c00, c01, c10, c11)
            least = min(c00, c01, c10, c11)
            c = (c00 + c01 + c10 + c11) - 2.0 * a * (i0 + i1) - 2.0 * b * (j0 + j1)
            c = 0.25 * c if small else 0.2 * (c + centre - a * mid_i - b * mid_j)
            most = most if small else max(most, centre)
            least = least if small else min(least, centre)
            # No higher than the highest and no lower than the lowest value at the corners, where a plane ends.
            low_end = a * (i0 if a > 0.0 else i1) + b * (j0 if b > 0.0 else j1)
            high_end = a * (i1 if a > 0.0 else i0) + b * (j1 if b > 0.0 else j0)
            c = min(c, most - high_end)
            c = max(c, least - low_end)
            flat = c00 == c01 and c00 == c10 and c00 == c11 and (small or c00 == centre)
            slopes_i[q] = 0.0 if flat else a
            slopes_j[q] = 0.0 if flat else b
            levels[q] = c00 if flat else c
            total = c00 + c01 + c10 + c11 + centre
            odd += 0 if total - total == 0.0 else 1
    return odd == 0


@njit(cache=True, error_model="numpy")
def join(
    fits: Array, m: int, n: int, width: int, height: int, bounds: Array, planes: Array, owner: Array
) -> int:
    """Pieces over m by n points: the tiles of `fit`, where flat ones of one level that lie side by side become
    one; returns how many.

    fits      what `fit` found
    bounds    (tiles, 4) integers to fill in: low and high index of the first variable, then of the second
    planes    (tiles, 3) floats to fill in: two slopes per index, value at index (0, 0)
    owner     integers, one per tile along the second variable: scratch
    """
    across = owner.size
    rows = fits.shape[1] // across
    count = 0
    for k in range(across):
        owner[k] = -1
    for r in range(rows):
        i0 = r * width
        i1 = min(i0 + width, m) - 1
        open_from = -1  # tile at which the newest piece of this row began if it is flat, else -1
        newest = -1
        for k in range(across):
            j0 = k * height
            j1 = min(j0 + height, n) - 1
            a = fits[0, k * rows + r]
            b = fits[1, k * rows + r]
            c = fits[2, k * rows + r]
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
    """The block (kernels.py) of the pieces that `fit` and `join` make; none when a value is not finite."""
    across = (n + height - 1) // height
    tiles = (m + width - 1) // width * across
    fits = np.empty((3, tiles))
    if not fit(samples, m, n, width, height, fits):
        return new_block(0, dims)
    bounds = np.empty((tiles, 4), np.int64)
    planes = np.empty((tiles, 3))
    owner = np.empty(across, np.int64)
    count = join(fits, m, n, width, height, bounds, planes, owner)
    return block_of_tiles(bounds, planes, count, dims, base, extent)
