"""Cells: the coarse grid over which the search bounds a sum of functions from above.

One pass over all pieces gives, per function and cell, the pieces that reach into the cell and the highest
value any of them takes there.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ivp_helm.ivp.pointers import floats_at, int32s_at

Array: TypeAlias = NDArray[Any]  # of 64-bit integers or floats, whichever the docstring says

AXES = 4  # at most so many variables of a component are cut into cells
# A cell longer than so many mean piece edges is halved once more: with few pieces small cells pay (good
# bounds, short lists), with many pieces large ones (a piece is entered into every cell it reaches).
CELL_RATIO_FEW = 1.2
CELL_RATIO_MANY = 2.7
MANY_PIECES = 1500
FEWEST_CELLS = 128
MOST_CELLS = 4096


@njit(cache=True, error_model="numpy")
def _highest(slope: float, low: int, high: int, cell: int, edge: int) -> float:
    """The most that slope * index reaches inside both [low, high] and one cell."""
    if slope >= 0.0:
        return slope * min(high, (cell + 1) * edge - 1)
    return slope * max(low, cell * edge)


@njit(cache=True, error_model="numpy")
def cut(
    n: int,
    points: Array,
    edges: Array,
    tiles: Array,
    pieces: int,
    edge: Array,
    magic: Array,
    axis: Array,
    span: Array,
) -> int:
    """Choose the cells of a component: edge[v], axis[v] (or -1), span[axis], and magic[v] to divide by.

    Cells are tiles[v] (the piece edge of the function with most pieces, so that its pieces mostly fall
    into one cell each) times a power of two. The variable whose cells are longest, measured in mean
    piece edges, is halved again and again until a cell is not much longer than a piece or there are as
    many cells as pieces. Returns the number of cells.
    """
    target = min(max(pieces, FEWEST_CELLS), MOST_CELLS)
    least = CELL_RATIO_FEW + (CELL_RATIO_MANY - CELL_RATIO_FEW) * min(1.0, pieces / MANY_PIECES)
    axes = 0
    size = 1
    for v in range(n):
        axis[v] = -1
        if points[v] > 65536:  # so that the division below stays exact
            step = 1
            while step < tiles[v]:
                step *= 2
            tiles[v] = step
        edge[v] = tiles[v]
        while edge[v] < points[v]:
            edge[v] *= 2
    while True:
        pick = -1
        ratio = least
        for v in range(n):
            r = edge[v] / edges[v]
            if edge[v] > tiles[v] and r > ratio and (axis[v] >= 0 or axes < AXES):
                ratio = r
                pick = v
        if pick < 0:
            break
        before = (points[pick] - 1) // edge[pick] + 1
        after = (points[pick] - 1) // (edge[pick] // 2) + 1
        if size // before * after > target:
            break
        edge[pick] //= 2
        size = size // before * after
        if axis[pick] < 0 and after > 1:
            axis[pick] = 0  # provisional: has an axis
            axes += 1
    # axes are right-aligned and in the order of the variables, so that cells sort as their points do
    a = AXES - axes
    for i in range(AXES):
        span[i] = 1
    for v in range(n):
        magic[v] = (1 << 32) // edge[v] + (1 if (1 << 32) % edge[v] else 0)
        if axis[v] >= 0:
            axis[v] = a
            span[a] = (points[v] - 1) // edge[v] + 1
            a += 1
    return size


@njit(cache=True, error_model="numpy")
def scatter_flat(
    block: Array,
    e0: int,
    e1: int,
    g0: int,
    g1: int,
    h0: int,
    highs: Array,
    heads: Array,
    links: Array,
    used: int,
) -> int:
    """_scatter for a function over two gridded variables; the common case, so it is written out."""
    pieces = block[0]
    low = int32s_at(block[2], pieces * 2)
    high = int32s_at(block[3], pieces * 2)
    coef = floats_at(block[4], pieces * 3)
    capacity = links.size // 2
    for p in range(pieces):
        l0 = low[p]
        u0 = high[p]
        l1 = low[pieces + p]
        u1 = high[pieces + p]
        w0 = coef[p]
        w1 = coef[pieces + p]
        c = coef[2 * pieces + p]
        a0 = (l0 * g0) >> 32  # l0 // e0, by way of a multiplication
        b0 = (u0 * g0) >> 32
        a1 = (l1 * g1) >> 32
        b1 = (u1 * g1) >> 32
        if used + (b0 - a0 + 1) * (b1 - a1 + 1) > capacity:
            return -1
        if a0 == b0 and a1 == b1:
            top = c + max(w0 * l0, w0 * u0) + max(w1 * l1, w1 * u1)
            j = a0 * h0 + a1
            if top > highs[j]:
                highs[j] = top
            links[2 * used] = p
            links[2 * used + 1] = heads[j]
            heads[j] = used
            used += 1
            continue
        for i0 in range(a0, b0 + 1):
            x = max(l0, i0 * e0)
            y = min(u0, (i0 + 1) * e0 - 1)
            row = c + max(w0 * x, w0 * y)
            for i1 in range(a1, b1 + 1):
                x = max(l1, i1 * e1)
                y = min(u1, (i1 + 1) * e1 - 1)
                top = row + max(w1 * x, w1 * y)
                j = i0 * h0 + i1
                if top > highs[j]:
                    highs[j] = top
                links[2 * used] = p
                links[2 * used + 1] = heads[j]
                heads[j] = used
                used += 1
    return used


@njit(cache=True, error_model="numpy")
def scatter(
    block: Array, place: Array, axis: Array, edge: Array, magic: Array, hop: Array,
    highs: Array, heads: Array, links: Array, used: int,
) -> int:  # fmt: skip
    """Enter every piece of a function into the cells it reaches: the cell's high and its list.

    `highs` and `heads` are the function's own cells, `hop` the step along each axis (0: it lacks that
    variable). A list is a chain of (piece, next) pairs in `links`. Returns the pairs used, -1 if too few.
    """
    pieces = block[0]
    dims = block[1]
    low = int32s_at(block[2], pieces * dims)
    high = int32s_at(block[3], pieces * dims)
    coef = floats_at(block[4], pieces * (dims + 1))
    capacity = links.size // 2
    d0 = d1 = d2 = d3 = -1  # which of its variables lies along each axis
    far: Any = np.int64(1 << 40)  # no plain number: numba would compile _highest twice
    e0 = e1 = e2 = e3 = far
    g0 = g1 = g2 = g3 = 0 * far
    for d in range(dims):
        v = place[d]
        if axis[v] == 0:
            d0 = d
            e0 = edge[v]
            g0 = magic[v]
        elif axis[v] == 1:
            d1 = d
            e1 = edge[v]
            g1 = magic[v]
        elif axis[v] == 2:
            d2 = d
            e2 = edge[v]
            g2 = magic[v]
        elif axis[v] == 3:
            d3 = d
            e3 = edge[v]
            g3 = magic[v]
    for p in range(pieces):
        base = coef[dims * pieces + p]
        for d in range(dims):
            if axis[place[d]] < 0:
                w = coef[d * pieces + p]
                base += max(w * high[d * pieces + p], w * low[d * pieces + p])
        l0 = l1 = l2 = l3 = 0
        u0 = u1 = u2 = u3 = 0
        w0 = w1 = w2 = w3 = 0.0
        if d0 >= 0:
            l0, u0, w0 = low[d0 * pieces + p], high[d0 * pieces + p], coef[d0 * pieces + p]
        if d1 >= 0:
            l1, u1, w1 = low[d1 * pieces + p], high[d1 * pieces + p], coef[d1 * pieces + p]
        if d2 >= 0:
            l2, u2, w2 = low[d2 * pieces + p], high[d2 * pieces + p], coef[d2 * pieces + p]
        if d3 >= 0:
            l3, u3, w3 = low[d3 * pieces + p], high[d3 * pieces + p], coef[d3 * pieces + p]
        for c0 in range((l0 * g0) >> 32, ((u0 * g0) >> 32) + 1):
            v0 = base + _highest(w0, l0, u0, c0, e0)
            for c1 in range((l1 * g1) >> 32, ((u1 * g1) >> 32) + 1):
                v1 = v0 + _highest(w1, l1, u1, c1, e1)
                for c2 in range((l2 * g2) >> 32, ((u2 * g2) >> 32) + 1):
                    v2 = v1 + _highest(w2, l2, u2, c2, e2)
                    cell = c0 * hop[0] + c1 * hop[1] + c2 * hop[2]
                    first = (l3 * g3) >> 32
                    last = (u3 * g3) >> 32
                    if used + last - first >= capacity:
                        return -1
                    for c3 in range(first, last + 1):
                        v3 = v2 + _highest(w3, l3, u3, c3, e3)
                        j = cell + c3 * hop[3]
                        if v3 > highs[j]:
                            highs[j] = v3
                        links[2 * used] = p
                        links[2 * used + 1] = heads[j]
                        heads[j] = used
                        used += 1
    return used
