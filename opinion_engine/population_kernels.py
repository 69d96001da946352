"""One step of a large population on a sparse graph, compiled and parallel (gcid.md 1, 4).

Agents are worked on in tiles that fit the first-level cache: gather the neighbours' opinions, evaluate the
equation in loops the compiler turns into vector instructions, write the new state. Every agent's sum runs over
its neighbours in the order of the graph and no result depends on another tile, so any number of threads gives
the same bits.

In memory a state is one row per agent, so that hearing a neighbour costs one cache line. Inside a tile it is
one row per option ("planes": option j of agent i at j * TILE + i), so that loops over agents are contiguous.

Free functions over plain arrays; random numbers (lost messages, delays) arrive as arrays.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from opinion_engine.gather_kernels import gather, gather_late, gather_sides
from opinion_engine.tile_kernels import (
    TILE,
    attention_rate,
    clip_attention,
    euler3,
    mean_squares,
    opinion_rate,
    option_mean,
    subtract,
    to_planes,
    to_rows,
)

GROUP = 8
"""Tiles that one thread takes at a time, with the same work space."""

EULER, REFERENCE, HELD = 0, 1, 2
"""Methods: explicit Euler; the authors' order (attention first, then opinions with the new attention); neighbours
held during the step while every agent integrates itself by Runge-Kutta, which is what boats with engines do."""


def row_width(n_options: int) -> int:
    """Doubles per agent in a state: the opinions, their mean square, and filling up to whole vectors."""
    return (n_options + 4) // 4 * 4


@njit(cache=True, error_model="numpy")
def _tile(
    tile: int, width: int, work: np.ndarray, method: int, dt: float, substeps: int, rates_only: bool,
    indptr: np.ndarray, indices: np.ndarray, starts: np.ndarray, slots: np.ndarray, places: np.ndarray,
    lag: np.ndarray, history: np.ndarray, head: int, u_now: np.ndarray, inputs: np.ndarray,
    active: np.ndarray, options: np.ndarray, kinds: np.ndarray, own: np.ndarray, neighbour: np.ndarray,
    resistance: np.ndarray, attention: np.ndarray, dynamic: bool,
    uniform: bool, z_next: np.ndarray, u_next: np.ndarray,
) -> None:  # fmt: skip
    """One tile of `sweep`; width doubles per row, work (7 width + 8) * TILE doubles of scratch."""
    n, n_o = u_now.size, own.shape[1]
    state = history[head * (n + 1) * width : (head + 1) * (n + 1) * width]  # last row zero
    low = tile * TILE
    count = min(TILE, n - low)
    size = width * TILE
    z, heard, f, sums = (
        work[:size],
        work[size : 2 * size],
        work[2 * size : 3 * size],
        work[3 * size : 4 * size],
    )
    on = work[4 * size : 5 * size] if active.size > 0 else work[:0]
    base, total = work[5 * size : 6 * size], work[6 * size : 7 * size]
    lane = work[7 * size :]
    u, y, u_rate, share = (
        lane[:TILE],
        lane[TILE : 2 * TILE],
        lane[2 * TILE : 3 * TILE],
        lane[3 * TILE : 4 * TILE],
    )
    own_square, square = lane[4 * TILE : 5 * TILE], lane[5 * TILE : 6 * TILE]
    u_base, u_total = lane[6 * TILE : 7 * TILE], lane[7 * TILE : 8 * TILE]
    kind = kinds[low : low + count] if kinds.size > 0 else kinds
    b = inputs[tile if inputs.shape[0] > 1 else 0]

    if lag.size > 0:
        gather_late(low, count, width, n, indptr, indices, lag, history, head, sums)
    elif starts.size > 0:
        gather_sides(low, count, width, starts, slots, places, state, sums)
    else:
        gather(low, count, width, indptr, indices, state, sums)
    mine, written = state[low * width : (low + count) * width], z_next[low * width : (low + count) * width]
    plain = uniform and n_o == 3 and dynamic and active.size == 0
    if plain and method == EULER and attention[0, 4] == 2.0 and not rates_only:
        now = u_now[low : low + count]
        euler3(
            count,
            dt,
            sums,
            mine,
            now,
            b,
            own[0],
            neighbour[0],
            resistance[0, 0],
            attention[0],
            u,
            written,
        )
        for i in range(count):
            u_next[low + i] = u[i]
        return
    last = (width - 1) * TILE
    to_planes(count, width, sums, heard)
    to_planes(count, width, mine, z)
    for i in range(count):
        square[i] = heard[last + i]
        own_square[i] = z[last + i]
        u[i] = u_now[low + i]
        share[i] = 1.0 / n_o
    if active.size > 0:
        for i in range(count):
            for j in range(n_o):
                on[j * TILE + i] = active[low + i, j]
            share[i] = 1.0 / options[low + i] if options[low + i] > 0 else 0.0

    h = dt / substeps
    stages = 4 if method == HELD else 1
    for substep in range(substeps):
        if stages > 1:
            for p in range(n_o * TILE):
                base[p] = z[p]
                total[p] = 0.0
            for i in range(count):
                u_base[i] = u[i]
                u_total[i] = 0.0
        for stage in range(stages):
            if dynamic:
                if stage > 0 or substep > 0:
                    mean_squares(count, n_o, z, share, own_square)
                for i in range(count):
                    y[i] = own_square[i] + square[i]
                attention_rate(count, u, y, kind, attention, u_rate)
                if method == REFERENCE:
                    for i in range(count):
                        u[i] += dt * u_rate[i]
                    clip_attention(count, u, kind, attention)
            opinion_rate(
                count, n_o, z, u, heard, b, on, share, kind, own, neighbour, resistance, uniform, f, y
            )  # fmt: skip
            if stages == 1:
                break
            weight = 1.0 if stage == 0 or stage == 3 else 2.0
            ahead = h if stage == 2 else 0.5 * h
            for j in range(n_o):
                row = j * TILE
                for i in range(count):
                    total[row + i] += weight * f[row + i]
                for i in range(count):
                    z[row + i] = base[row + i] + ahead * f[row + i]
            if dynamic:
                for i in range(count):
                    u_total[i] += weight * u_rate[i]
                    u[i] = u_base[i] + ahead * u_rate[i]
        if rates_only:
            to_rows(count, width, f, written)
            for i in range(count):
                u_next[low + i] = u_rate[i] if dynamic else 0.0
            return
        if stages == 1:
            for j in range(n_o):
                row = j * TILE
                for i in range(count):
                    z[row + i] += dt * f[row + i]
            if dynamic and method == EULER:
                for i in range(count):
                    u[i] += dt * u_rate[i]
            break
        for j in range(n_o):
            row = j * TILE
            for i in range(count):
                z[row + i] = base[row + i] + (h / 6.0) * total[row + i]
        if dynamic:
            for i in range(count):
                u[i] = u_base[i] + (h / 6.0) * u_total[i]

    # Take out what round-off has put into the row sums, then hand over.
    option_mean(count, n_o, z, share, y)
    subtract(count, n_o, y, on, z)
    mean_squares(count, n_o, z, share, own_square)
    for j in range(n_o, width - 1):
        for i in range(count):
            z[j * TILE + i] = 0.0
    for i in range(count):
        z[last + i] = own_square[i]
    to_rows(count, width, z, written)
    if dynamic:
        clip_attention(count, u, kind, attention)
    for i in range(count):
        u_next[low + i] = u[i]


@njit(cache=True, error_model="numpy")
def _group(
    group: int, tiles: int, method: int, dt: float, substeps: int, rates_only: bool, indptr: np.ndarray,
    indices: np.ndarray, starts: np.ndarray, slots: np.ndarray, places: np.ndarray, lag: np.ndarray,
    history: np.ndarray, head: int, u_now: np.ndarray, inputs: np.ndarray, active: np.ndarray,
    options: np.ndarray, kinds: np.ndarray, own: np.ndarray, neighbour: np.ndarray, resistance: np.ndarray,
    attention: np.ndarray, dynamic: bool, uniform: bool, z_next: np.ndarray, u_next: np.ndarray,
) -> None:  # fmt: skip
    """The tiles that share one piece of working memory."""
    width = (own.shape[1] + 4) // 4 * 4
    work = np.empty((7 * width + 8) * TILE)
    for tile in range(group * GROUP, min(tiles, (group + 1) * GROUP)):
        _tile(
            tile, width, work, method, dt, substeps, rates_only, indptr, indices, starts, slots, places,
            lag, history, head, u_now, inputs, active, options, kinds, own, neighbour, resistance, attention,
            dynamic, uniform, z_next, u_next,
        )  # fmt: skip


@njit(cache=True, error_model="numpy")
def sweep_serial(
    method: int, dt: float, substeps: int, rates_only: bool, indptr: np.ndarray, indices: np.ndarray,
    starts: np.ndarray, slots: np.ndarray, places: np.ndarray, lag: np.ndarray, history: np.ndarray, head: int,
    u_now: np.ndarray, inputs: np.ndarray, active: np.ndarray, options: np.ndarray, kinds: np.ndarray,
    own: np.ndarray, neighbour: np.ndarray,
    resistance: np.ndarray, attention: np.ndarray, dynamic: bool, uniform: bool, z_next: np.ndarray,
    u_next: np.ndarray,
) -> None:  # fmt: skip
    """`sweep` on one thread, for populations too small to share out."""
    tiles = (u_now.size + TILE - 1) // TILE
    for group in range((tiles + GROUP - 1) // GROUP):
        _group(
            group, tiles, method, dt, substeps, rates_only, indptr, indices, starts, slots, places,
            lag, history, head, u_now, inputs, active, options, kinds, own, neighbour, resistance, attention,
            dynamic, uniform, z_next, u_next,
        )  # fmt: skip


@njit(cache=True, parallel=True, error_model="numpy")
def sweep(
    method: int, dt: float, substeps: int, rates_only: bool, indptr: np.ndarray, indices: np.ndarray,
    starts: np.ndarray, slots: np.ndarray, places: np.ndarray, lag: np.ndarray, history: np.ndarray, head: int,
    u_now: np.ndarray, inputs: np.ndarray, active: np.ndarray, options: np.ndarray, kinds: np.ndarray,
    own: np.ndarray, neighbour: np.ndarray,
    resistance: np.ndarray, attention: np.ndarray, dynamic: bool, uniform: bool, z_next: np.ndarray,
    u_next: np.ndarray,
) -> None:  # fmt: skip
    """All agents once: the new state, or with `rates_only` the derivative, into z_next,
    flat (N + 1, W), and u_next (N,).

    method      EULER, REFERENCE or HELD (with `substeps` Runge-Kutta steps)
    indptr, indices   whom each agent hears, row by row, uint32
    starts, slots, places   the same links as `gather_kernels.side_by_side` lays them out, or empty
    lag         (E,) int16 steps into the past, -1 = nothing heard; empty: everything is heard at once
    history     flat ring of H states (N + 1, W), `head` the present one; row N is zero. A row holds the N_O opinions,
                zeros, and in its last place their mean square, which neighbours need for attention (W: `row_width`)
    inputs      (tiles, N_O * TILE) planes, or (1, N_O * TILE) for all tiles; see `input_planes`
    active, options  (N, N_O) bool and (N,) count of them; both empty: all active
    kinds       (N,) uint8 index into own, neighbour (K, N_O, N_O), resistance (K, N_O), attention (K, 5: tau_u,
                u_min, u_max, y_th, n); empty with K = 1
    dynamic     False keeps the attention; uniform: one kind whose couplings are equal for all options
    """
    tiles = (u_now.size + TILE - 1) // TILE
    for group in prange((tiles + GROUP - 1) // GROUP):
        _group(
            group, tiles, method, dt, substeps, rates_only, indptr, indices, starts, slots, places,
            lag, history, head, u_now, inputs, active, options, kinds, own, neighbour, resistance, attention,
            dynamic, uniform, z_next, u_next,
        )  # fmt: skip


def input_planes(inputs: np.ndarray) -> np.ndarray:
    """Inputs (N, N_O), or (1, N_O) for all agents alike, in the layout of `sweep`."""
    n, n_o = inputs.shape
    if n == 1:
        return np.repeat(inputs[0], TILE).reshape(1, n_o * TILE)
    tiles = (n + TILE - 1) // TILE
    padded = np.zeros((tiles * TILE, n_o))
    padded[:n] = inputs
    return np.ascontiguousarray(padded.reshape(tiles, TILE, n_o).transpose(0, 2, 1)).reshape(
        tiles, n_o * TILE
    )
