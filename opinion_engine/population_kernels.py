"""One step of a large population on a sparse graph, compiled and parallel (gcid.md 1, 4).

Agents are worked on in tiles that fit the first-level cache: gather the neighbours' opinions, evaluate the
equation in loops the compiler turns into vector instructions, write the new state. Every agent's sum runs
over its neighbours in the order of the graph and no result depends on another tile, so any number of threads
gives the same bits.

Free functions over plain arrays; random numbers (lost messages, delays) arrive as arrays.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from opinion_engine.intrinsics import sum_rows4, sum_rows8
from opinion_engine.kernels import hill, tanh

TILE = 256
"""Agents per tile: its arrays fit the first-level cache."""

EULER, REFERENCE, HELD = 0, 1, 2
"""Methods: explicit Euler; the authors' order (attention first, then opinions with the new attention);
neighbours held
during the step while every agent integrates itself by Runge-Kutta, which is what boats with engines do."""


def row_width(n_options: int) -> int:
    """Doubles per agent in a state: the opinions, their mean square, and filling up to whole vectors."""
    return (n_options + 4) // 4 * 4


@njit(cache=True, error_model="numpy")
def _gather(
    low: int, count: int, indptr: np.ndarray, indices: np.ndarray, state: np.ndarray, sums: np.ndarray
) -> None:  # fmt: skip
    """Sums of the neighbours' rows, last lane included, into sums (TILE, W)."""
    width = state.shape[1]
    for i in range(count):
        first, last = np.int64(indptr[low + i]), np.int64(indptr[low + i + 1])
        if width == 4:
            sum_rows4(state, indices, first, last, sums, i)
        elif width == 8:
            sum_rows8(state, indices, first, last, sums, i)
        else:
            for lane in range(width):
                sums[i, lane] = 0.0
            for e in range(first, last):
                k = np.int64(indices[e])
                for lane in range(width):
                    sums[i, lane] += state[k, lane]


@njit(cache=True, error_model="numpy")
def _gather_late(
    low: int, count: int, indptr: np.ndarray, indices: np.ndarray, lag: np.ndarray, history: np.ndarray,
    head: int, sums: np.ndarray,
) -> None:  # fmt: skip
    """`_gather` of messages that are lag (E,) steps old; a negative lag means nothing is heard."""
    depth, _, width = history.shape
    for i in range(count):
        for lane in range(width):
            sums[i, lane] = 0.0
        for e in range(np.int64(indptr[low + i]), np.int64(indptr[low + i + 1])):
            age = np.int64(lag[e])
            if age >= 0:
                k, then = np.int64(indices[e]), (head - age) % depth
                for lane in range(width):
                    sums[i, lane] += history[then, k, lane]


@njit(cache=True, error_model="numpy")
def _rate(
    count: int, z: np.ndarray, u: np.ndarray, heard: np.ndarray, b: np.ndarray, on: np.ndarray, share:
    np.ndarray, kind: np.ndarray, own: np.ndarray, neighbour: np.ndarray, resistance: np.ndarray, uniform:
    bool, f: np.ndarray, mean: np.ndarray,
) -> None:  # fmt: skip
    """Projected z' of a tile into f (N_O, TILE). Rows are options: the inner loops run over agents."""
    n_o = z.shape[0]
    several = own.shape[0] > 1
    masked = on.size > 0
    for j in range(n_o):
        if uniform and not masked:
            # Equal couplings: the cross terms of row j are (all of them) - (the one of j), and what is common
            # to all rows vanishes in the projection. 2 N_O hyperbolic tangents instead of N_O squared.
            alpha, gamma = own[0, 0, 0], neighbour[0, 0, 0]
            beta, delta, d = own[0, 0, n_o - 1], neighbour[0, 0, n_o - 1], resistance[0, 0]
            if beta == 0.0 and delta == 0.0:
                for i in range(count):
                    cooperation = tanh(alpha * z[j, i] + gamma * heard[j, i])
                    f[j, i] = u[i] * cooperation - d * z[j, i] + b[j, i]
            else:
                for i in range(count):
                    cooperation = tanh(alpha * z[j, i] + gamma * heard[j, i])
                    competition = tanh(beta * z[j, i] + delta * heard[j, i])
                    f[j, i] = u[i] * (cooperation - competition) - d * z[j, i] + b[j, i]
        else:
            for i in range(count):
                f[j, i] = 0.0
            for option in range(n_o):
                if several:
                    for i in range(count):
                        c = np.uint64(kind[i])
                        f[j, i] += tanh(
                            own[c, j, option] * z[option, i] + neighbour[c, j, option] * heard[option, i]
                        )
                else:
                    a, g = own[0, j, option], neighbour[0, j, option]
                    if a == 0.0 and g == 0.0:
                        continue
                    if masked:
                        for i in range(count):
                            f[j, i] += on[option, i] * tanh(a * z[option, i] + g * heard[option, i])
                    else:
                        for i in range(count):
                            f[j, i] += tanh(a * z[option, i] + g * heard[option, i])
            if several:
                for i in range(count):
                    f[j, i] = u[i] * f[j, i] - resistance[np.uint64(kind[i]), j] * z[j, i] + b[j, i]
            else:
                d = resistance[0, j]
                for i in range(count):
                    f[j, i] = u[i] * f[j, i] - d * z[j, i] + b[j, i]
            if masked:
                for i in range(count):
                    f[j, i] *= on[j, i]
        if j == 0:
            for i in range(count):
                mean[i] = f[0, i]
        else:
            for i in range(count):
                mean[i] += f[j, i]
    for i in range(count):
        mean[i] *= share[i]
    for j in range(n_o):
        if masked:
            for i in range(count):
                f[j, i] -= on[j, i] * mean[i]
        else:
            for i in range(count):
                f[j, i] -= mean[i]


@njit(cache=True, error_model="numpy")
def _attention_rate(
    count: int, u: np.ndarray, y: np.ndarray, kind: np.ndarray, attention: np.ndarray, rate: np.ndarray
) -> None:  # fmt: skip
    """u' of a tile, driven by y, into `rate`."""
    if attention.shape[0] > 1:
        for i in range(count):
            c = np.uint64(kind[i])
            target = hill(
                y[i],
                attention[c, 1],
                attention[c, 2],
                attention[c, 3],
                attention[c, 4],
            )
            rate[i] = (target - u[i]) / attention[c, 0]
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
def _mean_squares(count: int, z: np.ndarray, share: np.ndarray, square: np.ndarray) -> None:
    """Mean over the active options of z^2, agent by agent."""
    for i in range(count):
        square[i] = z[0, i] * z[0, i]
    for j in range(1, z.shape[0]):
        for i in range(count):
            square[i] += z[j, i] * z[j, i]
    for i in range(count):
        square[i] *= share[i]


@njit(cache=True, error_model="numpy")
def _tile(
    tile: int, method: int, dt: float, substeps: int, rates_only: bool, indptr: np.ndarray, indices:
    np.ndarray, lag: np.ndarray, history: np.ndarray, head: int, u_now: np.ndarray, inputs:
    np.ndarray, active: np.ndarray, options: np.ndarray, kinds: np.ndarray, own: np.ndarray, neighbour:
    np.ndarray, resistance: np.ndarray, attention: np.ndarray, dynamic: bool, uniform: bool, z_next:
    np.ndarray, u_next: np.ndarray,
) -> None:  # fmt: skip
    state = history[head]
    n, width = state.shape
    n_o = own.shape[1]
    low = tile * TILE
    count = min(TILE, n - low)
    # One allocation each: in slices of a common block the compiler fears overlaps and gives up on vectors.
    z, heard, b, f = (
        np.empty((n_o, TILE)),
        np.empty((n_o, TILE)),
        np.empty((n_o, TILE)),
        np.empty((n_o, TILE)),
    )
    base, total = np.empty((n_o, TILE)), np.empty((n_o, TILE))
    on = np.empty((n_o if active.size > 0 else 0, TILE))
    u, square, own_square, y = np.empty(TILE), np.empty(TILE), np.empty(TILE), np.empty(TILE)
    u_rate, u_base, u_total, share = np.empty(TILE), np.empty(TILE), np.empty(TILE), np.empty(TILE)
    kind = kinds[low : low + count] if kinds.size > 0 else kinds

    sums = np.empty((TILE, width))
    if lag.size > 0:
        _gather_late(low, count, indptr, indices, lag, history, head, sums)
    else:
        _gather(low, count, indptr, indices, state, sums)
    mine = state[low : low + count]
    one = inputs.shape[0] == 1
    given = inputs if one else inputs[low : low + count]
    for j in range(n_o):
        for i in range(count):
            heard[j, i] = sums[i, j]
        for i in range(count):
            z[j, i] = mine[i, j]
        if one:
            for i in range(count):
                b[j, i] = given[0, j]
        else:
            for i in range(count):
                b[j, i] = given[i, j]
    for i in range(count):
        square[i] = sums[i, width - 1]
        own_square[i] = mine[i, width - 1]
        u[i] = u_now[low + i]
        share[i] = 1.0 / n_o
    if active.size > 0:
        for i in range(count):
            for j in range(n_o):
                on[j, i] = active[low + i, j]
            share[i] = 1.0 / options[low + i] if options[low + i] > 0 else 0.0

    h = dt / substeps
    stages = 4 if method == HELD else 1
    for substep in range(substeps):
        if stages > 1:
            for j in range(n_o):
                for i in range(count):
                    base[j, i] = z[j, i]
                    total[j, i] = 0.0
            for i in range(count):
                u_base[i] = u[i]
                u_total[i] = 0.0
        for stage in range(stages):
            if dynamic:
                if stage > 0 or substep > 0:
                    _mean_squares(count, z, share, own_square)
                for i in range(count):
                    y[i] = own_square[i] + square[i]
                _attention_rate(count, u, y, kind, attention, u_rate)
                if method == REFERENCE:
                    for i in range(count):
                        u[i] += dt * u_rate[i]
                    _clip(count, u, kind, attention)
            _rate(count, z, u, heard, b, on, share, kind, own, neighbour, resistance, uniform, f, y)
            if stages == 1:
                break
            weight = 1.0 if stage == 0 or stage == 3 else 2.0
            ahead = h if stage == 2 else 0.5 * h
            for j in range(n_o):
                for i in range(count):
                    total[j, i] += weight * f[j, i]
                    z[j, i] = base[j, i] + ahead * f[j, i]
            if dynamic:
                for i in range(count):
                    u_total[i] += weight * u_rate[i]
                    u[i] = u_base[i] + ahead * u_rate[i]
        if rates_only:
            for i in range(count):
                for j in range(n_o):
                    z_next[low + i, j] = f[j, i]
                u_next[low + i] = u_rate[i] if dynamic else 0.0
            return
        if stages == 1:
            for j in range(n_o):
                for i in range(count):
                    z[j, i] += dt * f[j, i]
            if dynamic and method == EULER:
                for i in range(count):
                    u[i] += dt * u_rate[i]
            break
        for j in range(n_o):
            for i in range(count):
                z[j, i] = base[j, i] + (h / 6.0) * total[j, i]
        if dynamic:
            for i in range(count):
                u[i] = u_base[i] + (h / 6.0) * u_total[i]

    # Take out what round-off has put into the row sums, then hand over.
    for i in range(count):
        y[i] = z[0, i]
    for j in range(1, n_o):
        for i in range(count):
            y[i] += z[j, i]
    for i in range(count):
        y[i] *= share[i]
    for j in range(n_o):
        if active.size > 0:
            for i in range(count):
                z[j, i] -= on[j, i] * y[i]
        else:
            for i in range(count):
                z[j, i] -= y[i]
    _mean_squares(count, z, share, own_square)
    if dynamic:
        _clip(count, u, kind, attention)
    written = z_next[low : low + count]
    for j in range(width - 1):
        if j < n_o:
            for i in range(count):
                written[i, j] = z[j, i]
        else:
            for i in range(count):
                written[i, j] = 0.0
    for i in range(count):
        written[i, width - 1] = own_square[i]
        u_next[low + i] = u[i]


@njit(cache=True, error_model="numpy")
def _clip(count: int, u: np.ndarray, kind: np.ndarray, attention: np.ndarray) -> None:
    several = attention.shape[0] > 1
    for i in range(count):
        c = np.int64(kind[i]) if several else 0
        u[i] = min(max(u[i], attention[c, 1]), attention[c, 2])


@njit(cache=True, error_model="numpy")
def sweep_serial(
    method: int, dt: float, substeps: int, rates_only: bool, indptr: np.ndarray, indices: np.ndarray,
    lag: np.ndarray, history: np.ndarray, head: int, u_now: np.ndarray, inputs: np.ndarray,
    active: np.ndarray, options: np.ndarray, kinds: np.ndarray, own: np.ndarray, neighbour: np.ndarray,
    resistance: np.ndarray, attention: np.ndarray, dynamic: bool, uniform: bool, z_next: np.ndarray, u_next:
    np.ndarray,
) -> None:  # fmt: skip
    """`sweep` on one thread, for populations too small to share out."""
    for tile in range((u_now.size + TILE - 1) // TILE):
        _tile(
            tile, method, dt, substeps, rates_only, indptr, indices, lag, history, head, u_now,
            inputs, active, options, kinds, own, neighbour, resistance, attention, dynamic, uniform, z_next,
            u_next,
        )  # fmt: skip


@njit(cache=True, parallel=True, error_model="numpy")
def sweep(
    method: int, dt: float, substeps: int, rates_only: bool, indptr: np.ndarray, indices: np.ndarray,
    lag: np.ndarray, history: np.ndarray, head: int, u_now: np.ndarray, inputs: np.ndarray,
    active: np.ndarray, options: np.ndarray, kinds: np.ndarray, own: np.ndarray, neighbour: np.ndarray,
    resistance: np.ndarray, attention: np.ndarray, dynamic: bool, uniform: bool, z_next: np.ndarray, u_next:
    np.ndarray,
) -> None:  # fmt: skip
    """All agents once: the new state, or with `rates_only` the derivative, into z_next (N, N_O) and u_next
    (N,).

    method      EULER, REFERENCE or HELD (with `substeps` Runge-Kutta steps)
    indptr, indices   whom each agent hears, row by row, uint32
    lag         (E,) int16 steps into the past, -1 = nothing heard; empty: everything is heard at once
    history     (H, N, W) ring of past states, `head` the present one. A row holds the N_O opinions, zeros,
    and
                in its last place their mean square, which neighbours need for attention (`row_width`)
    inputs      (N, N_O) or (1, N_O)
    active, options  (N, N_O) bool and (N,) count of them; both empty: all active
    kinds       (N,) uint8 index into own, neighbour (K, N_O, N_O), resistance (K, N_O), attention (K, 5:
    tau_u, u_min,
                u_max, y_th, n); empty with K = 1
    dynamic     False keeps the attention; uniform: one kind whose couplings are equal for all options
    """
    for tile in prange((u_now.size + TILE - 1) // TILE):
        _tile(
            tile, method, dt, substeps, rates_only, indptr, indices, lag, history, head, u_now,
            inputs, active, options, kinds, own, neighbour, resistance, attention, dynamic, uniform, z_next,
            u_next,
        )  # fmt: skip
