"""Compiled arithmetic on the pieces of one function.

A function lives in one block of 64-bit words, so that a solver needs no more than its address:

    word 0          number of pieces n
    word 1          number of variables d
    words 2, 3, 4   addresses of the lower bounds, upper bounds and coefficients in this same block
    word 5          flags: COVERS, OVERLAPS
    words 6, 7      lowest and highest value (floats)
    words 8 .. 7+d  mean edge length of the pieces, in points, per variable (floats)
    then            lower bounds (d, n) and upper bounds (d, n), 32-bit integers, each padded to a word
    then            coefficients (d+1, n), floats: d slopes per index, and the intercept

Bounds are inclusive indexes. One variable's bounds of all pieces lie side by side, which is what lets
a compiler work on several pieces at once.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ivp_helm.ivp.pointers import floats_at, int32s_at

Array: TypeAlias = NDArray[Any]  # of 64-bit integers or floats, whichever the docstring says

COVERS = 1  # every point of the function's own variables is covered by exactly one piece
OVERLAPS = 2  # some point is covered by more than one piece

# Outcomes of seal()
SOUND = 0
BAD_BOUNDS = 1
BAD_COEFFICIENT = 2


@njit(cache=True)
def new_block(pieces: int, dims: int) -> Array:
    """An unfilled block for so many pieces over so many variables."""
    head = 8 + dims
    half = (pieces * dims + 1) // 2
    block = np.empty(head + 2 * half + (dims + 1) * pieces, np.int64)
    base = block.ctypes.data
    block[0] = pieces
    block[1] = dims
    block[2] = base + 8 * head
    block[3] = base + 8 * (head + half)
    block[4] = base + 8 * (head + 2 * half)
    block[5] = 0
    return block


@njit(cache=True)
def seal(block: Array, points: Array, disjoint: bool) -> tuple[int, int]:
    """Check bounds and coefficients, and fill in flags, range and mean edges.

    `points` is the number of points per variable; `disjoint` says that the pieces are known not to
    overlap. Returns (outcome, piece), the piece being the first offender.
    """
    n = block[0]
    dims = block[1]
    low = int32s_at(block[2], n * dims)
    high = int32s_at(block[3], n * dims)
    coef = floats_at(block[4], n * (dims + 1))
    floats = block.view(np.float64)
    least = np.inf
    most = -np.inf
    total = 1.0
    for d in range(dims):
        total *= points[d]
        floats[8 + d] = 0.0
    covered = 0.0
    for p in range(n):
        top = coef[dims * n + p]
        bottom = top
        volume = 1.0
        for d in range(dims):
            a = low[d * n + p]
            b = high[d * n + p]
            if a < 0 or b < a or b >= points[d]:
                return BAD_BOUNDS, p
            edge = b - a + 1
            volume *= edge
            floats[8 + d] += edge
            slope = coef[d * n + p]
            if slope >= 0:
                top += slope * b
                bottom += slope * a
            else:
                top += slope * a
                bottom += slope * b
        covered += volume
        # inf - inf and NaN both fail this, so one test serves every kind of bad number
        if not (top - bottom >= 0.0) or not math.isfinite(top) or not math.isfinite(bottom):
            return BAD_COEFFICIENT, p
        if top > most:
            most = top
        if bottom < least:
            least = bottom
    floats[6] = least
    floats[7] = most
    for d in range(dims):
        floats[8 + d] /= n
    block[5] = 0
    if covered > total:
        block[5] = OVERLAPS
    elif disjoint and covered == total:
        block[5] = COVERS
    return SOUND, 0


@njit(cache=True)
def block_from_arrays(low: Array, high: Array, low_open: Array, high_open: Array, coef: Array) -> Array:
    """A block from arrays shaped (n, d), (n, d), (n, d), (n, d) and (n, 1) or (n, d+1).

    Open (exclusive) bounds move one index inwards, and pieces that become empty are dropped; a single
    coefficient is a constant and gets zero slopes.
    """
    dims = low.shape[1]
    kept = 0
    for p in range(low.shape[0]):
        alive = True
        for d in range(dims):
            if (low_open[p, d] or high_open[p, d]) and (
                high[p, d] - low[p, d] < int(low_open[p, d]) + int(high_open[p, d])
            ):
                alive = False
        if alive:
            kept += 1
    block = new_block(kept, dims)
    lows = int32s_at(block[2], kept * dims)
    highs = int32s_at(block[3], kept * dims)
    coefs = floats_at(block[4], kept * (dims + 1))
    last = coef.shape[1] - 1
    q = 0
    for p in range(low.shape[0]):
        alive = True
        for d in range(dims):
            if (low_open[p, d] or high_open[p, d]) and (
                high[p, d] - low[p, d] < int(low_open[p, d]) + int(high_open[p, d])
            ):
                alive = False
        if not alive:
            continue
        for d in range(dims):
            lows[d * kept + q] = low[p, d] + int(low_open[p, d])
            highs[d * kept + q] = high[p, d] - int(high_open[p, d])
            coefs[d * kept + q] = coef[p, d] if last == dims else 0.0
        coefs[dims * kept + q] = coef[p, last]
        q += 1
    return block


@njit(cache=True)
def find_cover(block: Array, points: Array) -> tuple[int, int]:
    """Count, over all points, those covered by no piece and those covered by more than one."""
    n = block[0]
    dims = block[1]
    low = int32s_at(block[2], n * dims)
    high = int32s_at(block[3], n * dims)
    total = 1
    for d in range(dims):
        total *= points[d]
    count = np.zeros(total, np.uint8)
    at = np.empty(dims, np.int64)
    for p in range(n):
        for d in range(dims):
            at[d] = low[d * n + p]
        while True:
            start = 0
            for d in range(dims - 1):
                start = (start + at[d]) * points[d + 1]
            for j in range(start + low[(dims - 1) * n + p], start + high[(dims - 1) * n + p] + 1):
                count[j] = min(count[j] + 1, 2)
            d = dims - 2
            while d >= 0:
                at[d] += 1
                if at[d] <= high[d * n + p]:
                    break
                at[d] = low[d * n + p]
                d -= 1
            if d < 0:
                break
    gaps = 0
    overlaps = 0
    for j in range(total):
        if count[j] == 0:
            gaps += 1
        elif count[j] == 2:
            overlaps += 1
    return gaps, overlaps


@njit(cache=True)
def any_overlap(block: Array) -> bool:
    """Whether two pieces intersect, pair by pair (for domains too large to count point by point)."""
    n = block[0]
    dims = block[1]
    low = int32s_at(block[2], n * dims)
    high = int32s_at(block[3], n * dims)
    order = np.argsort(low[:n])
    for a in range(n):
        p = order[a]
        for b in range(a + 1, n):
            q = order[b]
            if low[q] > high[p]:
                break
            meet = True
            for d in range(1, dims):
                if low[d * n + q] > high[d * n + p] or high[d * n + q] < low[d * n + p]:
                    meet = False
                    break
            if meet:
                return True
    return False


@njit(cache=True)
def evaluate(block: Array, indexes: Array) -> Array:
    """The value at each index point, shape (m, d) -> (m,); the first covering piece counts, NaN if none."""
    n = block[0]
    dims = block[1]
    low = int32s_at(block[2], n * dims)
    high = int32s_at(block[3], n * dims)
    coef = floats_at(block[4], n * (dims + 1))
    values = np.empty(indexes.shape[0])
    for i in range(indexes.shape[0]):
        values[i] = np.nan
        for p in range(n):
            inside = True
            for d in range(dims):
                x = indexes[i, d]
                if x < low[d * n + p] or x > high[d * n + p]:
                    inside = False
                    break
            if inside:
                value = coef[dims * n + p]
                for d in range(dims):
                    value += coef[d * n + p] * indexes[i, d]
                values[i] = value
                break
    return values


@njit(cache=True)
def table(block: Array, points: Array) -> Array:
    """The value at every point, flat, last variable fastest; the first covering piece counts, NaN if none."""
    n = block[0]
    dims = block[1]
    low = int32s_at(block[2], n * dims)
    high = int32s_at(block[3], n * dims)
    coef = floats_at(block[4], n * (dims + 1))
    total = 1
    for d in range(dims):
        total *= points[d]
    values = np.full(total, np.nan)
    at = np.empty(dims, np.int64)
    last = dims - 1
    for p in range(n - 1, -1, -1):  # backwards, so that the first piece is painted last and stays
        for d in range(dims):
            at[d] = low[d * n + p]
        slope = coef[last * n + p]
        while True:
            start = 0
            value = coef[dims * n + p]
            for d in range(last):
                start = (start + at[d]) * points[d + 1]
                value += coef[d * n + p] * at[d]
            for j in range(low[last * n + p], high[last * n + p] + 1):
                values[start + j] = value + slope * j
            d = last - 1
            while d >= 0:
                at[d] += 1
                if at[d] <= high[d * n + p]:
                    break
                at[d] = low[d * n + p]
                d -= 1
            if d < 0:
                break
    return values


@njit(cache=True)
def transformed(block: Array, scale: float, shift: float) -> Array:
    """A block with every value v replaced by scale * v + shift, scale > 0; flags and bounds stay."""
    dims = block[1]
    n = block[0]
    out = new_block(n, dims)
    head = 8 + dims
    for i in range(5, out.size):
        out[i] = block[i]
    floats = out.view(np.float64)
    floats[6] = floats[6] * scale + shift
    floats[7] = floats[7] * scale + shift
    start = head + 2 * ((n * dims + 1) // 2)
    for i in range(start, start + n * dims):
        floats[i] *= scale
    for i in range(start + n * dims, start + n * (dims + 1)):
        floats[i] = floats[i] * scale + shift
    return out


@njit(cache=True)
def expanded(block: Array, scope: Array, points: Array) -> Array:
    """A block over more variables: scope[d] is the place of its variable d; new ones span their range."""
    n = block[0]
    dims = block[1]
    wide = points.size
    low = int32s_at(block[2], n * dims)
    high = int32s_at(block[3], n * dims)
    coef = floats_at(block[4], n * (dims + 1))
    out = new_block(n, wide)
    lows = int32s_at(out[2], n * wide)
    highs = int32s_at(out[3], n * wide)
    coefs = floats_at(out[4], n * (wide + 1))
    floats = out.view(np.float64)
    source = block.view(np.float64)
    out[5] = block[5]
    floats[6] = source[6]
    floats[7] = source[7]
    for v in range(wide):
        floats[8 + v] = points[v]
        for p in range(n):
            lows[v * n + p] = 0
            highs[v * n + p] = points[v] - 1
            coefs[v * n + p] = 0.0
    for d in range(dims):
        v = scope[d]
        floats[8 + v] = source[8 + d]
        for p in range(n):
            lows[v * n + p] = low[d * n + p]
            highs[v * n + p] = high[d * n + p]
            coefs[v * n + p] = coef[d * n + p]
    for p in range(n):
        coefs[wide * n + p] = coef[dims * n + p]
    return out


@njit(cache=True)
def coupled(
    first: Array, second: Array, first_weight: float, second_weight: float, low_to: float, high_to: float
) -> Array:
    """The block of f + g over the variables of both: pieces of `first` outermost.

    Each part is first stretched to 0..its weight (a flat one stays as it is), the sum then to
    low_to..high_to, unless low_to equals high_to or the sum is flat.
    """
    n1 = first[0]
    n2 = second[0]
    d1 = first[1]
    d2 = second[1]
    f = first.view(np.float64)
    g = second.view(np.float64)
    scale1 = 1.0
    shift1 = 0.0
    if f[7] - f[6] > 0.0:
        scale1 = first_weight / (f[7] - f[6])
        shift1 = -f[6] * scale1
    scale2 = 1.0
    shift2 = 0.0
    if g[7] - g[6] > 0.0:
        scale2 = second_weight / (g[7] - g[6])
        shift2 = -g[6] * scale2
    # the two parts share no variable, so the extremes of the sum are the sums of the extremes
    least = f[6] * scale1 + shift1 + g[6] * scale2 + shift2
    most = f[7] * scale1 + shift1 + g[7] * scale2 + shift2
    if high_to > low_to and most - least > 0.0:
        scale = (high_to - low_to) / (most - least)
        scale1 *= scale
        scale2 *= scale
        shift1 = shift1 * scale + low_to - least * scale
        shift2 *= scale
        most = high_to
        least = low_to
    n = n1 * n2
    dims = d1 + d2
    out = new_block(n, dims)
    low1 = int32s_at(first[2], n1 * d1)
    high1 = int32s_at(first[3], n1 * d1)
    coef1 = floats_at(first[4], n1 * (d1 + 1))
    low2 = int32s_at(second[2], n2 * d2)
    high2 = int32s_at(second[3], n2 * d2)
    coef2 = floats_at(second[4], n2 * (d2 + 1))
    low = int32s_at(out[2], n * dims)
    high = int32s_at(out[3], n * dims)
    coef = floats_at(out[4], n * (dims + 1))
    q = 0
    for i in range(n1):
        for j in range(n2):
            for d in range(d1):
                low[d * n + q] = low1[d * n1 + i]
                high[d * n + q] = high1[d * n1 + i]
                coef[d * n + q] = coef1[d * n1 + i] * scale1
            for d in range(d2):
                low[(d1 + d) * n + q] = low2[d * n2 + j]
                high[(d1 + d) * n + q] = high2[d * n2 + j]
                coef[(d1 + d) * n + q] = coef2[d * n2 + j] * scale2
            constant1 = coef1[d1 * n1 + i] * scale1 + shift1
            constant2 = coef2[d2 * n2 + j] * scale2 + shift2
            coef[dims * n + q] = constant1 + constant2
            q += 1
    floats = out.view(np.float64)
    out[5] = COVERS if (first[5] & COVERS) != 0 and (second[5] & COVERS) != 0 else 0
    out[5] |= (first[5] | second[5]) & OVERLAPS
    floats[6] = least
    floats[7] = most
    for d in range(d1):
        floats[8 + d] = f[8 + d]
    for d in range(d2):
        floats[8 + d1 + d] = g[8 + d]
    return out


@njit(cache=True)
def _doubled(rows: Array) -> Array:
    out = np.empty((2 * rows.shape[0], *rows.shape[1:]), rows.dtype)
    out[: rows.shape[0]] = rows
    return out


@njit(cache=True)
def without_overlaps(block: Array) -> tuple[Array, Array, Array]:
    """The same function as disjoint pieces: from each piece the pieces stored before it are cut away.

    Used for foreign functions only, so clarity goes before speed. Returns (low, high, coef) shaped
    (m, d), (m, d) and (m, d+1).
    """
    n = block[0]
    dims = block[1]
    low = int32s_at(block[2], n * dims).reshape(dims, n)
    high = int32s_at(block[3], n * dims).reshape(dims, n)
    coef = floats_at(block[4], n * (dims + 1)).reshape(dims + 1, n)
    capacity = 4 * (n + dims) + 16
    lows = np.empty((capacity, dims), np.int64)
    highs = np.empty((capacity, dims), np.int64)
    owner = np.empty((capacity, 1), np.int64)
    m = 0
    for p in range(n):
        first = m  # boxes first..m-1 are what is left of piece p so far
        if m + 2 * dims + 2 >= capacity:
            lows, highs, owner = _doubled(lows), _doubled(highs), _doubled(owner)
            capacity *= 2
        lows[m] = low[:, p]
        highs[m] = high[:, p]
        owner[m, 0] = p
        m += 1
        for q in range(p):
            i = first
            while i < m:
                meet = True
                for d in range(dims):
                    if lows[i, d] > high[d, q] or highs[i, d] < low[d, q]:
                        meet = False
                        break
                if not meet:
                    i += 1
                    continue
                if m + 2 * dims + 2 >= capacity:
                    lows, highs, owner = _doubled(lows), _doubled(highs), _doubled(owner)
                    capacity *= 2
                for d in range(dims):  # split off what lies above and below q, variable by variable
                    if highs[i, d] > high[d, q]:
                        lows[m] = lows[i]
                        highs[m] = highs[i]
                        lows[m, d] = high[d, q] + 1
                        owner[m, 0] = p
                        highs[i, d] = high[d, q]
                        m += 1
                    if lows[i, d] < low[d, q]:
                        lows[m] = lows[i]
                        highs[m] = highs[i]
                        highs[m, d] = low[d, q] - 1
                        owner[m, 0] = p
                        lows[i, d] = low[d, q]
                        m += 1
                # what remains of box i lies inside q: put the last box in its place
                m -= 1
                lows[i] = lows[m]
                highs[i] = highs[m]
                owner[i] = owner[m]
    out = np.empty((m, dims + 1))
    for i in range(m):
        out[i] = coef[:, owner[i, 0]]
    return lows[:m].copy(), highs[:m].copy(), out
