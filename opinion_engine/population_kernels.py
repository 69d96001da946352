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

from opinion_engine.intrinsics import sum_rows4, sum_rows8
from opinion_engine.kernels import hill, tanh

TILE = 256
"""Agents per tile: its arrays fit the first-level cache."""

GROUP = 8
"""Tiles that one thread takes at a time, with the same work space."""

EULER, REFERENCE, HELD = 0, 1, 2
"""Methods: explicit Euler; the authors' order (attention first, then opinions with the new attention); neighbours
held during the step while every agent integrates itself by Runge-Kutta, which is what boats with engines do."""


def row_width(n_options: int) -> int:
    """Doubles per agent in a state: the opinions, their mean square, and filling up to whole vectors."""
    return (n_options + 4) // 4 * 4


# ------------------------------------------------------------------------- between rows and planes


@njit(cache=True, error_model="numpy")
def _planes(count: int, width: int, rows: np.ndarray, start: int, planes: np.ndarray) -> None:
    """Rows of `width` from rows[start:], into planes; the widths that occur most have constant strides."""
    if width == 4:
        for i in range(count):
            p = start + 4 * i
            planes[i] = rows[p]
            planes[TILE + i] = rows[p + 1]
            planes[2 * TILE + i] = rows[p + 2]
            planes[3 * TILE + i] = rows[p + 3]
    else:
        for i in range(count):
            for lane in range(width):
                planes[lane * TILE + i] = rows[start + width * i + lane]


@njit(cache=True, error_model="numpy")
def _rows(count: int, width: int, planes: np.ndarray, rows: np.ndarray, start: int) -> None:
    """`_planes` backwards."""
    if width == 4:
        for i in range(count):
            p = start + 4 * i
            rows[p] = planes[i]
            rows[p + 1] = planes[TILE + i]
            rows[p + 2] = planes[2 * TILE + i]
            rows[p + 3] = planes[3 * TILE + i]
    else:
        for i in range(count):
            for lane in range(width):
                rows[start + width * i + lane] = planes[lane * TILE + i]


@njit(cache=True, error_model="numpy")
def _gather(
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
def _gather_late(
    low: int, count: int, width: int, n: int, indptr: np.ndarray, indices: np.ndarray, lag: np.ndarray,
    history: np.ndarray, head: int, sums: np.ndarray,
) -> None:  # fmt: skip
    """`_gather` of messages that are lag (E,) steps old; a negative lag means nothing is heard."""
    depth = history.size // (n * width)
    for i in range(count):
        for lane in range(width):
            sums[i * width + lane] = 0.0
        for e in range(np.int64(indptr[low + i]), np.int64(indptr[low + i + 1])):
            age = np.int64(lag[e])
            if age >= 0:
                row = ((head - age) % depth * n + np.int64(indices[e])) * width
                for lane in range(width):
                    sums[i * width + lane] += history[row + lane]


# ----------------------------------------------------------------------------- the equation on planes


@njit(cache=True, error_model="numpy")
def _rate(
    count: int, n_o: int, z: np.ndarray, u: np.ndarray, heard: np.ndarray, b: np.ndarray, on: np.ndarray,
    share: np.ndarray, kind: np.ndarray, own: np.ndarray, neighbour: np.ndarray, resistance: np.ndarray,
    uniform: bool, f: np.ndarray, mean: np.ndarray,
) -> None:  # fmt: skip
    """Projected z' of a tile into f; z, heard, b, on, f are planes."""
    several = own.shape[0] > 1
    masked = on.size > 0
    for j in range(n_o):
        row = j * TILE
        if uniform and not masked:
            # Equal couplings: the cross terms of row j are (all of them) - (the one of j), and what is common
            # to all rows vanishes in the projection. 2 N_O hyperbolic tangents instead of N_O squared.
            alpha, gamma = own[0, 0, 0], neighbour[0, 0, 0]
            beta, delta, d = own[0, 0, n_o - 1], neighbour[0, 0, n_o - 1], resistance[0, 0]
            if beta == 0.0 and delta == 0.0:
                for i in range(count):
                    cooperation = tanh(alpha * z[row + i] + gamma * heard[row + i])
                    f[row + i] = u[i] * cooperation - d * z[row + i] + b[row + i]
            else:
                for i in range(count):
                    cooperation = tanh(alpha * z[row + i] + gamma * heard[row + i])
                    competition = tanh(beta * z[row + i] + delta * heard[row + i])
                    f[row + i] = u[i] * (cooperation - competition) - d * z[row + i] + b[row + i]
        else:
            for i in range(count):
                f[row + i] = 0.0
            for option in range(n_o):
                col = option * TILE
                if several:
                    for i in range(count):
                        c = np.uint64(kind[i])
                        a, g = own[c, j, option], neighbour[c, j, option]
                        f[row + i] += tanh(a * z[col + i] + g * heard[col + i])
                    continue
                a, g = own[0, j, option], neighbour[0, j, option]
                if a == 0.0 and g == 0.0:
                    continue
                if masked:
                    for i in range(count):
                        f[row + i] += on[col + i] * tanh(a * z[col + i] + g * heard[col + i])
                else:
                    for i in range(count):
                        f[row + i] += tanh(a * z[col + i] + g * heard[col + i])
            if several:
                for i in range(count):
                    d = resistance[np.uint64(kind[i]), j]
                    f[row + i] = u[i] * f[row + i] - d * z[row + i] + b[row + i]
            else:
                d = resistance[0, j]
                for i in range(count):
                    f[row + i] = u[i] * f[row + i] - d * z[row + i] + b[row + i]
            if masked:
                for i in range(count):
                    f[row + i] *= on[row + i]
    _mean(count, n_o, f, share, mean)
    _subtract(count, n_o, mean, on, f)


@njit(cache=True, error_model="numpy")
def _mean(count: int, n_o: int, planes: np.ndarray, share: np.ndarray, mean: np.ndarray) -> None:
    """Sum over the options times share (1 / active options), agent by agent."""
    for i in range(count):
        mean[i] = planes[i]
    for j in range(1, n_o):
        row = j * TILE
        for i in range(count):
            mean[i] += planes[row + i]
    for i in range(count):
        mean[i] *= share[i]


@njit(cache=True, error_model="numpy")
def _subtract(count: int, n_o: int, mean: np.ndarray, on: np.ndarray, planes: np.ndarray) -> None:
    """Take the mean from every active option (`on` planes; empty: all are active)."""
    for j in range(n_o):
        row = j * TILE
        if on.size > 0:
            for i in range(count):
                planes[row + i] -= on[row + i] * mean[i]
        else:
            for i in range(count):
                planes[row + i] -= mean[i]


@njit(cache=True, error_model="numpy")
def _mean_squares(count: int, n_o: int, z: np.ndarray, share: np.ndarray, square: np.ndarray) -> None:
    """Mean of z^2 over the active options, agent by agent."""
    for i in range(count):
        square[i] = z[i] * z[i]
    for j in range(1, n_o):
        row = j * TILE
        for i in range(count):
            square[i] += z[row + i] * z[row + i]
    for i in range(count):
        square[i] *= share[i]


@njit(cache=True, error_model="numpy")
def _attention_rate(
    count: int, u: np.ndarray, y: np.ndarray, kind: np.ndarray, attention: np.ndarray, rate: np.ndarray
) -> None:
    """u' of a tile, driven by y, into `rate`."""
    if attention.shape[0] > 1:
        for i in range(count):
            tau_u, u_min, u_max, y_th, n = attention[np.uint64(kind[i])]
            rate[i] = (hill(y[i], u_min, u_max, y_th, n) - u[i]) / tau_u
        return
    tau_u, u_min, u_max, y_th, n = attention[0]
    if n == 2.0:  # the usual order, kept apart because it vectorises
        for i in range(count):
            ratio = y[i] / y_th
            high = ratio > 1.0
            p = 1.0 / ratio if high else ratio
            p = p * p
            rate[i] = (u_min + (u_max - u_min) * ((1.0 if high else p) / (1.0 + p)) - u[i]) / tau_u
    else:
        for i in range(count):
            rate[i] = (hill(y[i], u_min, u_max, y_th, n) - u[i]) / tau_u


@njit(cache=True, error_model="numpy")
def _clip(count: int, u: np.ndarray, kind: np.ndarray, attention: np.ndarray) -> None:
    """Keep attention within its limits."""
    if attention.shape[0] > 1:
        for i in range(count):
            c = np.uint64(kind[i])
            u[i] = min(max(u[i], attention[c, 1]), attention[c, 2])
    else:
        low, high = attention[0, 1], attention[0, 2]
        for i in range(count):
            value = low if u[i] < low else u[i]
            u[i] = high if value > high else value


# ---------------------------------------------------------------------------------------- the step


@njit(cache=True, error_model="numpy")
def _tile(
    tile: int, width: int, work: np.ndarray, method: int, dt: float, substeps: int, rates_only: bool,
    indptr: np.ndarray, indices: np.ndarray, lag: np.ndarray, history: np.ndarray, head: int,
    u_now: np.ndarray, inputs: np.ndarray, active: np.ndarray, options: np.ndarray, kinds: np.ndarray,
    own: np.ndarray, neighbour: np.ndarray, resistance: np.ndarray, attention: np.ndarray, dynamic: bool,
    uniform: bool, z_next: np.ndarray, u_next: np.ndarray,
) -> None:  # fmt: skip
    """One tile of `sweep`; width doubles per row, work (7 width + 8) * TILE doubles of scratch."""
    n, n_o = u_now.size, own.shape[1]
    state = history[head * n * width : (head + 1) * n * width]
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
        _gather_late(low, count, width, n, indptr, indices, lag, history, head, sums)
    else:
        _gather(low, count, width, indptr, indices, state, sums)
    last = (width - 1) * TILE
    _planes(count, width, sums, 0, heard)
    _planes(count, width, state, low * width, z)
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
                    _mean_squares(count, n_o, z, share, own_square)
                for i in range(count):
                    y[i] = own_square[i] + square[i]
                _attention_rate(count, u, y, kind, attention, u_rate)
                if method == REFERENCE:
                    for i in range(count):
                        u[i] += dt * u_rate[i]
                    _clip(count, u, kind, attention)
            _rate(
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
            _rows(count, width, f, z_next, low * width)
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
    _mean(count, n_o, z, share, y)
    _subtract(count, n_o, y, on, z)
    _mean_squares(count, n_o, z, share, own_square)
    for j in range(n_o, width - 1):
        for i in range(count):
            z[j * TILE + i] = 0.0
    for i in range(count):
        z[last + i] = own_square[i]
    _rows(count, width, z, z_next, low * width)
    if dynamic:
        _clip(count, u, kind, attention)
    for i in range(count):
        u_next[low + i] = u[i]


@njit(cache=True, error_model="numpy")
def sweep_serial(
    method: int, dt: float, substeps: int, rates_only: bool, indptr: np.ndarray, indices: np.ndarray,
    lag: np.ndarray, history: np.ndarray, head: int, u_now: np.ndarray, inputs: np.ndarray,
    active: np.ndarray, options: np.ndarray, kinds: np.ndarray, own: np.ndarray, neighbour: np.ndarray,
    resistance: np.ndarray, attention: np.ndarray, dynamic: bool, uniform: bool, z_next: np.ndarray,
    u_next: np.ndarray,
) -> None:  # fmt: skip
    """`sweep` on one thread, for populations too small to share out."""
    tiles = (u_now.size + TILE - 1) // TILE
    for group in range((tiles + GROUP - 1) // GROUP):
        width = (own.shape[1] + 4) // 4 * 4
        work = np.empty((7 * width + 8) * TILE)
        for tile in range(group * GROUP, min(tiles, (group + 1) * GROUP)):
            _tile(
                tile, width, work, method, dt, substeps, rates_only, indptr, indices, lag, history, head, u_now, inputs,
                active, options, kinds, own, neighbour, resistance, attention, dynamic, uniform, z_next, u_next,
            )  # fmt: skip


@njit(cache=True, parallel=True, error_model="numpy")
def sweep(
    method: int, dt: float, substeps: int, rates_only: bool, indptr: np.ndarray, indices: np.ndarray,
    lag: np.ndarray, history: np.ndarray, head: int, u_now: np.ndarray, inputs: np.ndarray,
    active: np.ndarray, options: np.ndarray, kinds: np.ndarray, own: np.ndarray, neighbour: np.ndarray,
    resistance: np.ndarray, attention: np.ndarray, dynamic: bool, uniform: bool, z_next: np.ndarray,
    u_next: np.ndarray,
) -> None:  # fmt: skip
    """All agents once: the new state, or with `rates_only` the derivative, into z_next, flat (N, W), and u_next (N,).

    method      EULER, REFERENCE or HELD (with `substeps` Runge-Kutta steps)
    indptr, indices   whom each agent hears, row by row, uint32
    lag         (E,) int16 steps into the past, -1 = nothing heard; empty: everything is heard at once
    history     flat ring of H states (N, W), `head` the present one. A row holds the N_O opinions, zeros, and in
                its last place their mean square, which neighbours need for attention (W: `row_width`)
    inputs      (tiles, N_O * TILE) planes, or (1, N_O * TILE) for all tiles; see `input_planes`
    active, options  (N, N_O) bool and (N,) count of them; both empty: all active
    kinds       (N,) uint8 index into own, neighbour (K, N_O, N_O), resistance (K, N_O), attention (K, 5: tau_u,
                u_min, u_max, y_th, n); empty with K = 1
    dynamic     False keeps the attention; uniform: one kind whose couplings are equal for all options
    """
    tiles = (u_now.size + TILE - 1) // TILE
    for group in prange((tiles + GROUP - 1) // GROUP):
        width = (own.shape[1] + 4) // 4 * 4
        work = np.empty((7 * width + 8) * TILE)
        for tile in range(group * GROUP, min(tiles, (group + 1) * GROUP)):
            _tile(
                tile, width, work, method, dt, substeps, rates_only, indptr, indices, lag, history, head, u_now, inputs,
                active, options, kinds, own, neighbour, resistance, attention, dynamic, uniform, z_next, u_next,
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
