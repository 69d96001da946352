"""Compiled arithmetic of the reflector: tiling, cutting, sampling, fitting and splitting boxes.

Boxes are rows of lower and upper indexes, shaped (n, d). The samples of a box are its 2**d corners, corner
c having the high end of variable d where bit d of c is set, and then its centre. Source: ivp_math.md 6.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ivp_helm.ivp.kernels import COVERS, new_block
from ivp_helm.ivp.pointers import floats_at, int32s_at

Array: TypeAlias = NDArray[Any]


@njit(cache=True)
def tile(first: Array, last: Array, edges: Array) -> tuple[Array, Array]:
    """Cut the box first..last into tiles from its low corner, the last of a row cut short.

    The first variable runs fastest and the order is reversed, as in MOOS-IvP: the first tile is highest.
    """
    dims = first.size
    count = 1
    for d in range(dims):
        count *= (last[d] - first[d]) // edges[d] + 1
    low = np.empty((count, dims), np.int64)
    high = np.empty((count, dims), np.int64)
    at = first.copy()
    for i in range(count - 1, -1, -1):
        for d in range(dims):
            low[i, d] = at[d]
            high[i, d] = min(at[d] + edges[d] - 1, last[d])
        for d in range(dims):
            at[d] += edges[d]
            if at[d] <= last[d]:
                break
            at[d] = first[d]
    return low, high


@njit(cache=True)
def cut_out(low: Array, high: Array, marks: Array, first: Array, last: Array) -> tuple[Array, Array, Array]:
    """Remove the box first..last from all boxes: untouched boxes first, then what is left of the others."""
    n, dims = low.shape
    untouched = 0
    touched = 0
    for p in range(n):
        meet = True
        for d in range(dims):
            if low[p, d] > last[d] or high[p, d] < first[d]:
                meet = False
        if meet:
            touched += 1
        else:
            untouched += 1
    new_low = np.empty((untouched + touched * 2 * dims, dims), np.int64)
    new_high = np.empty((untouched + touched * 2 * dims, dims), np.int64)
    new_marks = np.empty(untouched + touched * 2 * dims, np.int64)
    i = 0
    j = untouched
    for p in range(n):
        meet = True
        for d in range(dims):
            if low[p, d] > last[d] or high[p, d] < first[d]:
                meet = False
        if not meet:
            new_low[i] = low[p]
            new_high[i] = high[p]
            new_marks[i] = marks[p]
            i += 1
            continue
        a = low[p].copy()
        b = high[p].copy()
        for d in range(dims):
            if last[d] < b[d]:
                new_low[j] = a
                new_high[j] = b
                new_low[j, d] = last[d] + 1
                new_marks[j] = marks[p]
                b[d] = last[d]
                j += 1
            if first[d] > a[d]:
                new_low[j] = a
                new_high[j] = b
                new_high[j, d] = first[d] - 1
                new_marks[j] = marks[p]
                a[d] = first[d]
                j += 1
    return new_low[:j].copy(), new_high[:j].copy(), new_marks[:j].copy()


@njit(cache=True)
def sample_points(low: Array, high: Array, lows: Array, deltas: Array) -> Array:
    """Native coordinates of all samples of all boxes, shape (d, n * (2**d + 1)), box by box."""
    n, dims = low.shape
    corners = 1 << dims
    out = np.empty((dims, n * (corners + 1)))
    for d in range(dims):
        j = 0
        for p in range(n):
            a = lows[d] + deltas[d] * low[p, d]
            b = lows[d] + deltas[d] * high[p, d]
            for c in range(corners):
                out[d, j] = b if (c >> d) & 1 else a
                j += 1
            out[d, j] = lows[d] + deltas[d] * (low[p, d] + (high[p, d] - low[p, d]) // 2)
            j += 1
    return out


@njit(cache=True)
def fit(a: Array, b: Array, values: Array, degree: int, strict: bool, coef: Array) -> float:
    """Fit one box a..b to its sample values; leaves slopes and intercept in `coef`, returns the error."""
    dims = a.size
    corners = 1 << dims
    wide = False  # whether the centre counts
    for d in range(dims):
        if b[d] - a[d] >= 2:
            wide = True
    count = corners + 1 if wide else corners
    if degree == 0:
        mean = 0.0
        for c in range(count):
            mean += values[c]
        mean /= count
        error = 0.0
        for c in range(corners):
            error += (values[c] - mean) ** 2
        for d in range(dims):
            coef[d] = 0.0
        coef[dims] = mean
        return float(np.sqrt(error))
    for d in range(dims):
        coef[d] = 0.0
        if b[d] > a[d]:
            rise = 0.0
            for c in range(corners):
                rise += values[c] if (c >> d) & 1 else -values[c]
            coef[d] = rise / (corners // 2) / (b[d] - a[d])
    least = values[0]
    most = values[0]
    mean = 0.0
    low_plane = np.inf
    high_plane = -np.inf
    for c in range(count):
        plane = 0.0
        for d in range(dims):
            if c == corners:
                plane += coef[d] * (a[d] + (b[d] - a[d]) // 2)
            else:
                plane += coef[d] * (b[d] if (c >> d) & 1 else a[d])
        least = min(least, values[c])
        most = max(most, values[c])
        low_plane = min(low_plane, plane)
        high_plane = max(high_plane, plane)
        mean += values[c] - plane
    intercept = mean / count
    if strict:
        intercept = min(intercept, most - high_plane)
        intercept = max(intercept, least - low_plane)
    coef[dims] = intercept
    error = 0.0
    for c in range(count):
        plane = intercept
        for d in range(dims):
            if c == corners:
                plane += coef[d] * (a[d] + (b[d] - a[d]) // 2)
            else:
                plane += coef[d] * (b[d] if (c >> d) & 1 else a[d])
        error += (values[c] - plane) ** 2
    return float(np.sqrt(error) / count)


@njit(cache=True)
def fit_all(
    low: Array,
    high: Array,
    marks: Array,
    values: Array,
    degree: int,
    strict: bool,
    basin: float,
    plateau: float,
) -> tuple[Array, Array]:
    """Fit all boxes; returns coefficients (n, d+1) and errors (n,).

    A box marked 1 gets the constant `plateau`, one marked -1 `basin`, if that is not NaN.
    """
    n, dims = low.shape
    samples = (1 << dims) + 1
    coef = np.empty((n, dims + 1))
    errors = np.empty(n)
    for p in range(n):
        known = np.nan
        if marks[p] > 0:
            known = plateau
        elif marks[p] < 0:
            known = basin
        if not np.isnan(known):
            coef[p] = 0.0
            coef[p, dims] = known
            errors[p] = 0.0
        else:
            errors[p] = fit(low[p], high[p], values[p * samples : (p + 1) * samples], degree, strict, coef[p])
    return coef, errors


@njit(cache=True)
def halves(a: Array, b: Array, left: Array, right: Array) -> int:
    """Split a box along its longest edge (the first of equals): `left` is a..., `right` ...b.

    Leaves the high corner of the low half in `left` and the low corner of the high half in `right`;
    returns the variable. The low half gets the odd point.
    """
    dims = a.size
    d = 0
    for v in range(1, dims):
        if b[v] - a[v] > b[d] - a[d]:
            d = v
    for v in range(dims):
        left[v] = b[v]
        right[v] = a[v]
    left[d] = a[d] + (b[d] - a[d] + 2) // 2 - 1
    right[d] = left[d] + 1
    return d


@njit(cache=True)
def _sift(heap: Array, keys: Array, size: int, i: int) -> None:
    """Move heap entry i down or up to its place; larger keys first, of equals the lower number."""
    item = heap[i]
    while i > 0:
        parent = (i - 1) // 2
        other = heap[parent]
        if keys[item] > keys[other] or (keys[item] == keys[other] and item < other):
            heap[i] = other
            i = parent
        else:
            break
    while True:
        child = 2 * i + 1
        if child >= size:
            break
        if child + 1 < size:
            x, y = heap[child], heap[child + 1]
            if keys[y] > keys[x] or (keys[y] == keys[x] and y < x):
                child += 1
        other = heap[child]
        if keys[other] > keys[item] or (keys[other] == keys[item] and other < item):
            heap[i] = other
            i = child
        else:
            break
    heap[i] = item


@njit(cache=True)
def refine_by_table(
    low: Array, high: Array, coef: Array, errors: Array, extra: int, thresh: float,
    table: Array, points: Array, degree: int, strict: bool,
) -> tuple[Array, Array, Array, Array]:  # fmt: skip
    """Split the box with the largest error in half, `extra` times, sampling from a table of all values.

    Stops early when no error exceeds `thresh` or every box is a single point. The high half takes a new
    row, the low half keeps the old one.
    """
    n, dims = low.shape
    corners = 1 << dims
    total = n + extra
    new_low = np.empty((total, dims), np.int64)
    new_high = np.empty((total, dims), np.int64)
    new_coef = np.empty((total, dims + 1))
    keys = np.empty(total)
    new_low[:n] = low
    new_high[:n] = high
    new_coef[:n] = coef
    keys[:n] = errors
    heap = np.empty(total, np.int64)
    size = 0
    for p in range(n):
        single = True
        for d in range(dims):
            if high[p, d] > low[p, d]:
                single = False
        if not single:
            heap[size] = p
            size += 1
            _sift(heap, keys, size, size - 1)
    values = np.empty(corners + 1)
    left = np.empty(dims, np.int64)
    right = np.empty(dims, np.int64)
    while n < total and size > 0 and keys[heap[0]] > thresh:
        p = heap[0]
        size -= 1
        heap[0] = heap[size]
        if size > 0:
            _sift(heap, keys, size, 0)
        halves(new_low[p], new_high[p], left, right)
        new_low[n] = right
        new_high[n] = new_high[p]
        new_high[p] = left
        for half in range(2):
            q = p if half == 0 else n
            single = True
            for c in range(corners + 1):
                at = 0
                for d in range(dims):
                    x = new_low[q, d]
                    y = new_high[q, d]
                    if c == corners:
                        j = x + (y - x) // 2
                    else:
                        j = y if (c >> d) & 1 else x
                    if y > x:
                        single = False
                    at = at * points[d] + j
                values[c] = table[at]
            keys[q] = fit(new_low[q], new_high[q], values, degree, strict, new_coef[q])
            if not single:
                heap[size] = q
                size += 1
                _sift(heap, keys, size, size - 1)
        n += 1
    return new_low[:n], new_high[:n], new_coef[:n], keys[:n]


@njit(cache=True)
def improve_by_table(
    low: Array, high: Array, coef: Array, table: Array, points: Array, strict: bool, limit: float
) -> None:
    """Replace each box's plane by the least-squares plane through all its points, where that is better.

    Better means: the mean error falls, the largest does not rise, and no value exceeds `limit`. On a full
    grid the coordinates are uncorrelated, so every slope is a quotient of two sums.
    """
    n, dims = low.shape
    plane = np.empty(dims + 1)
    at = np.empty(dims, np.int64)
    for p in range(n):
        count = 1
        for d in range(dims):
            count *= high[p, d] - low[p, d] + 1
        # pass 0: mean; pass 1: slopes; pass 2: range of the plane; pass 3: errors of both planes
        plane[:] = 0.0
        least = np.inf
        most = -np.inf
        low_plane: Any = np.inf
        high_plane: Any = -np.inf
        mean = 0.0
        old_sum = new_sum = old_worst = new_worst = 0.0
        for step in range(4):
            for d in range(dims):
                at[d] = low[p, d]
            for _ in range(count):
                j = 0
                for d in range(dims):
                    j = j * points[d] + at[d]
                value = table[j]
                if step == 0:
                    mean += value
                    least = min(least, value)
                    most = max(most, value)
                elif step == 1:
                    for d in range(dims):
                        plane[d] += (at[d] - 0.5 * (low[p, d] + high[p, d])) * (value - mean)
                else:
                    new = plane[dims]
                    old = coef[p, dims]
                    for d in range(dims):
                        new += plane[d] * at[d]
                        old += coef[p, d] * at[d]
                    if step == 2:
                        low_plane = min(low_plane, new)
                        high_plane = max(high_plane, new)
                    else:
                        new_sum += abs(new - value)
                        old_sum += abs(old - value)
                        new_worst = max(new_worst, abs(new - value))
                        old_worst = max(old_worst, abs(old - value))
                for d in range(dims - 1, -1, -1):
                    at[d] += 1
                    if at[d] <= high[p, d]:
                        break
                    at[d] = low[p, d]
            if step == 0:
                mean /= count
            elif step == 1:
                plane[dims] = mean
                for d in range(dims):
                    edge = high[p, d] - low[p, d] + 1
                    if edge > 1:
                        plane[d] /= count * (edge * edge - 1.0) / 12.0
                    else:
                        plane[d] = 0.0
                    plane[dims] -= plane[d] * 0.5 * (low[p, d] + high[p, d])
            elif step == 2:
                shift = 0.0
                if strict:
                    shift = max(min(shift, most - high_plane), least - low_plane)
                plane[dims] += shift
                high_plane += shift
        if new_sum < old_sum and new_worst <= old_worst and high_plane <= limit:
            coef[p] = plane


@njit(cache=True)
def block_of_boxes(low: Array, high: Array, coef: Array, base: float, extent: float) -> tuple[Array, int]:
    """The block of fitted boxes that cover a domain, stretched to base..base+extent if extent > 0.

    Returns the block and the first piece whose value is not finite, -1 if there is none.
    """
    n, dims = low.shape
    block = new_block(n, dims)
    lows = int32s_at(block[2], n * dims)
    highs = int32s_at(block[3], n * dims)
    coefs = floats_at(block[4], n * (dims + 1))
    floats = block.view(np.float64)
    least = np.inf
    most = -np.inf
    for d in range(dims):
        floats[8 + d] = 0.0
    for p in range(n):
        top = coef[p, dims]
        bottom = top
        for d in range(dims):
            a = low[p, d]
            b = high[p, d]
            s = coef[p, d]
            lows[d * n + p] = a
            highs[d * n + p] = b
            coefs[d * n + p] = s
            floats[8 + d] += b - a + 1
            top += s * (b if s >= 0.0 else a)
            bottom += s * (a if s >= 0.0 else b)
        coefs[dims * n + p] = coef[p, dims]
        if not np.isfinite(top) or not np.isfinite(bottom):
            return block, p
        least = min(least, bottom)
        most = max(most, top)
    for d in range(dims):
        floats[8 + d] /= n
    if extent > 0.0 and most > least:
        scale = extent / (most - least)
        shift = base - least * scale
        for i in range(n * dims):
            coefs[i] *= scale
        for i in range(n * dims, n * (dims + 1)):
            coefs[i] = coefs[i] * scale + shift
        most = base + extent
        least = base
    floats[6] = least
    floats[7] = most
    block[5] = COVERS
    return block, -1
