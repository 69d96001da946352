"""What each agent of a population hears: sums of its neighbours' rows, in three ways that give the same bits.

`gather` walks the graph row by row. `gather_sides` takes SIDE agents at once, from a copy of the links that
`side_by_side` lays out for it: agents of a tile sorted by degree, the links of SIDE of them interleaved. One
branch then serves all of them, and memory is asked for long before it is needed; on a large graph that is twice
as fast. `gather_late` reads the past.

Free functions over plain arrays. A state is flat rows of `width` doubles, and after the last agent a row of zeros.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from opinion_engine.intrinsics import AHEAD, SIDE, sum_rows4, sum_rows8, sum_sides4, sum_sides8
from opinion_engine.tile_kernels import TILE


@njit(cache=True, error_model="numpy")
def gather(
    low: int, count: int, width: int, indptr: np.ndarray, indices: np.ndarray, state: np.ndarray,
    sums: np.ndarray,
) -> None:  # fmt: skip
    """Sums of the neighbours' rows in state, last lane included, into sums, row by row."""
    for i in range(count):
        first, last = np.int64(indptr[low + i]), np.int64(indptr[low + i + 1])
        if width == 4:
            sum_rows4(state, indices, first, last, sums, i)
        elif width == 8:
            sum_rows8(state, indices, first, last, sums, i)
        else:
            for lane in range(width):
                sums[i * width + lane] = 0.0
            for e in range(first, last):
                k = np.int64(indices[e])
                for lane in range(width):
                    sums[i * width + lane] += state[k * width + lane]


@njit(cache=True, error_model="numpy")
def gather_sides(
    low: int, count: int, width: int, starts: np.ndarray, slots: np.ndarray, places: np.ndarray,
    state: np.ndarray, sums: np.ndarray,
) -> None:  # fmt: skip
    """`gather` for rows of 4 or 8 from the links laid out by `side_by_side`."""
    for chunk in range((count + SIDE - 1) // SIDE):
        c = low // SIDE + chunk
        first, last = np.int64(starts[c]), np.int64(starts[c + 1])
        if width == 4:
            sum_sides4(state, slots, first, last, sums, places, low + chunk * SIDE)
        else:
            sum_sides8(state, slots, first, last, sums, places, low + chunk * SIDE)


@njit(cache=True, error_model="numpy")
def gather_late(
    low: int, count: int, width: int, n: int, indptr: np.ndarray, indices: np.ndarray, lag: np.ndarray,
    history: np.ndarray, head: int, sums: np.ndarray,
) -> None:  # fmt: skip
    """`gather` of messages that are lag (E,) steps old; a negative lag means nothing is heard."""
    rows = n + 1
    depth = history.size // (rows * width)
    for i in range(count):
        for lane in range(width):
            sums[i * width + lane] = 0.0
        for e in range(np.int64(indptr[low + i]), np.int64(indptr[low + i + 1])):
            age = np.int64(lag[e])
            if age >= 0:
                row = ((head - age) % depth * rows + np.int64(indices[e])) * width
                for lane in range(width):
                    sums[i * width + lane] += history[row + lane]


@njit(cache=True, error_model="numpy")
def degree_order(indptr: np.ndarray, places: np.ndarray, starts: np.ndarray) -> int:
    """Fill `places` (tiles * TILE) uint8: the agents of each tile by degree; and `starts` (chunks + 1) int64: where
    the links of each SIDE of them begin. Return how many slots are needed."""
    n = indptr.size - 1
    seat = np.empty(TILE, np.int64)
    degree = np.empty(TILE, np.int64)
    size = 0
    for tile in range(places.size // TILE):
        low = tile * TILE
        count = min(TILE, n - low)
        for i in range(count):
            degree[i] = np.int64(indptr[low + i + 1]) - np.int64(indptr[low + i])
        seat[:count] = np.argsort(degree[:count], kind="mergesort")
        for i in range(TILE):
            places[low + i] = seat[i] if i < count else i
        for chunk in range(TILE // SIDE):
            starts[low // SIDE + chunk] = size
            if chunk * SIDE < count:
                size += SIDE * degree[seat[min(chunk * SIDE + SIDE, count) - 1]]
    starts[-1] = size
    return size


@njit(cache=True, error_model="numpy")
def interleave(
    indptr: np.ndarray, indices: np.ndarray, places: np.ndarray, starts: np.ndarray, slots: np.ndarray
) -> None:
    """Put the links of every agent into its slots, every SIDE-th one from its own first."""
    n = indptr.size - 1
    for p in range(places.size):
        i = p // TILE * TILE + np.int64(places[p])
        if i < n:
            slot = starts[p // SIDE] + p % SIDE
            for e in range(np.int64(indptr[i]), np.int64(indptr[i + 1])):
                slots[slot] = indices[e]
                slot += SIDE


def side_by_side(indptr: np.ndarray, indices: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(starts, slots, places) of a graph for `gather_sides`.

    places   (tiles * TILE,) uint8, the agents of each tile in order of degree
    starts   (chunks + 1,) int64, where the slots of each chunk of SIDE agents begin
    slots    uint32, link e of agent s of a chunk at its start + e * SIDE + s; those that are over name the row
             of zeros, n

    All three are empty if a few agents hear so many that filling up would cost more than a quarter.
    """
    n = indptr.size - 1
    tiles = (n + TILE - 1) // TILE
    places = np.empty(tiles * TILE, np.uint8)
    starts = np.empty(places.size // SIDE + 1, np.int64)
    size = degree_order(indptr, places, starts)
    if size > 1.25 * indices.size + 64 * SIDE:
        return np.empty(0, np.int64), np.empty(0, np.uint32), np.empty(0, np.uint8)
    slots = np.full(size + AHEAD, n, np.uint32)
    interleave(indptr, indices, places, starts, slots)
    return starts, slots, places
