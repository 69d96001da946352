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

from opinion_engine.intrinsics import prefetch
from opinion_engine.kernels import hill, tanh

TILE = 128
"""Agents per tile: its arrays fit the first-level cache."""

PREFETCH_LINKS = 64
"""How many links ahead a row that is anywhere in memory is asked for."""

EULER, REFERENCE, HELD = 0, 1, 2
"""Methods: explicit Euler; the authors' order (attention first, then opinions with the new attention);
neighbours held
during the step while every agent integrates itself by Runge-Kutta, which is what boats with engines do."""


@njit(cache=True, error_model="numpy")
def _gather2(
    low: int, count: int, indptr: np.ndarray, indices: np.ndarray, z: np.ndarray, heard: np.ndarray, square:
    np.ndarray,
) -> None:  # fmt: skip
    for i in range(count):
        a = 0.0
        b = 0.0
        y = 0.0
        for e in range(np.int64(indptr[low + i]), np.int64(indptr[low + i + 1])):
            k = np.uint64(indices[e])  # unsigned: no test for negative indices
            p, q = z[k, 0], z[k, 1]
            a += p
            b += q
            y += p * p + q * q
        heard[0, i], heard[1, i] = a, b
        square[i] = y * 0.5


@njit(cache=True, error_model="numpy")
def _gather3(
    low: int, count: int, indptr: np.ndarray, indices: np.ndarray, z: np.ndarray, heard: np.ndarray, square:
    np.ndarray,
) -> None:  # fmt: skip
    for i in range(count):
        a = 0.0
        b = 0.0
        c = 0.0
        y = 0.0
        for e in range(np.int64(indptr[low + i]), np.int64(indptr[low + i + 1])):
            k = np.uint64(indices[e])
            p, q, r = z[k, 0], z[k, 1], z[k, 2]
            a += p
            b += q
            c += r
            y += p * p + q * q + r * r
        heard[0, i], heard[1, i], heard[2, i] = a, b, c
        square[i] = y / 3.0


@njit(cache=True, error_model="numpy")
def _gather3_scattered(
    low: int, count: int, indptr: np.ndarray, indices: np.ndarray, z: np.ndarray, heard: np.ndarray, square:
    np.ndarray,
) -> None:  # fmt: skip
    """`_gather3` for neighbours anywhere in memory: asks for each row some links before it is needed."""
    last = indices.size - 1
    for i in range(count):
        a = 0.0
        b = 0.0
        c = 0.0
        y = 0.0
        for e in range(np.int64(indptr[low + i]), np.int64(indptr[low + i + 1])):
            prefetch(z, np.int64(indices[min(e + PREFETCH_LINKS, last)]))
            k = np.uint64(indices[e])
            p, q, r = z[k, 0], z[k, 1], z[k, 2]
            a += p
            b += q
            c += r
            y += p * p + q * q + r * r
        heard[0, i], heard[1, i], heard[2, i] = a, b, c
        square[i] = y / 3.0


@njit(cache=True, error_model="numpy")
def _gather_any(
    low: int, count: int, indptr: np.ndarray, indices: np.ndarray, lag: np.ndarray, history: np.ndarray, head:
    int, options: np.ndarray, heard: np.ndarray, square: np.ndarray,
) -> None:  # fmt: skip
    """Any number of options; lag (E,) in steps into the ring `history` (H, N, N_O), negative = nothing heard.

    options (N,) says how many options each agent has active; an empty lag means all are heard at once.
    """
    n_o = heard.shape[0]
    depth = history.shape[0]
    for i in range(count):
        for j in range(n_o):
            heard[j, i] = 0.0
        y = 0.0
        for e in range(np.int64(indptr[low + i]), np.int64(indptr[low + i + 1])):
            age = np.int64(lag[e]) if lag.size > 0 else 0
            if age < 0:
                continue
            k = np.int64(indices[e])
            then = (head - age) % depth
            own_square = 0.0
            for j in range(n_o):
                value = history[then, k, j]
                heard[j, i] += value
                own_square += value * value
            n_k = np.int64(options[k]) if options.size > 0 else n_o
            if n_k > 0:
                y += own_square / n_k
        square[i] = y


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
    for i in range(count):
        mean[i] = 0.0
    for j in range(n_o):
        if uniform:
            # Equal couplings: the cross terms of row j are (all of them) - (the one of j), and what is common
            # to all rows vanishes in the projection. 2 N_O hyperbolic tangents instead of N_O squared.
            alpha, gamma = own[0, 0, 0], neighbour[0, 0, 0]
            beta, delta = own[0, 0, n_o - 1], neighbour[0, 0, n_o - 1]
            if beta == 0.0 and delta == 0.0:
                for i in range(count):
                    f[j, i] = tanh(alpha * z[j, i] + gamma * heard[j, i])
            else:
                for i in range(count):
                    f[j, i] = tanh(alpha * z[j, i] + gamma * heard[j, i]) - tanh(
                        beta * z[j, i] + delta * heard[j, i]
                    )
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
    count: int, z: np.ndarray, u: np.ndarray, square: np.ndarray, share: np.ndarray, kind: np.ndarray,
    attention: np.ndarray, y: np.ndarray, rate: np.ndarray,
) -> None:  # fmt: skip
    """u' of a tile into `rate`; y is scratch."""
    n_o = z.shape[0]
    for i in range(count):
        y[i] = 0.0
    for j in range(n_o):
        for i in range(count):
            y[i] += z[j, i] * z[j, i]
    if attention.shape[0] > 1:
        for i in range(count):
            c = np.uint64(kind[i])
            target = hill(
                y[i] * share[i] + square[i],
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
            ratio = (y[i] * share[i] + square[i]) / y_th
            high = ratio > 1.0
            p = 1.0 / ratio if high else ratio
            p = p * p
            rate[i] = (u_min + (u_max - u_min) * ((1.0 if high else p) / (1.0 + p)) - u[i]) / tau_u
    else:
        for i in range(count):
            rate[i] = (hill(y[i] * share[i] + square[i], u_min, u_max, y_th, n) - u[i]) / tau_u


@njit(cache=True, error_model="numpy")
def _tile(
    tile: int, method: int, dt: float, substeps: int, rates_only: bool, indptr: np.ndarray, indices:
    np.ndarray, scattered: bool, lag: np.ndarray, history: np.ndarray, head: int, u_now: np.ndarray, inputs:
    np.ndarray, active: np.ndarray, options: np.ndarray, kinds: np.ndarray, own: np.ndarray, neighbour:
    np.ndarray, resistance: np.ndarray, attention: np.ndarray, dynamic: bool, uniform: bool, z_next:
    np.ndarray, u_next: np.ndarray,
) -> None:  # fmt: skip
    z_now = history[head]
    n, n_o = z_now.shape
    low = tile * TILE
    count = min(TILE, n - low)
    block = np.empty((7 * n_o + 7, TILE))
    z, heard, b, f = block[:n_o], block[n_o : 2 * n_o], block[2 * n_o : 3 * n_o], block[3 * n_o : 4 * n_o]
    base, total = block[4 * n_o : 5 * n_o], block[5 * n_o : 6 * n_o]
    on = block[6 * n_o : 7 * n_o] if active.size > 0 else block[:0]
    u, square, scratch, u_rate, u_base, u_total, share = block[7 * n_o :]
    kind = kinds[low : low + count] if kinds.size > 0 else kinds

    if active.size > 0 or lag.size > 0 or n_o < 2 or n_o > 3:
        _gather_any(low, count, indptr, indices, lag, history, head, options, heard, square)
    elif n_o == 2:
        _gather2(low, count, indptr, indices, z_now, heard, square)
    elif scattered:
        _gather3_scattered(low, count, indptr, indices, z_now, heard, square)
    else:
        _gather3(low, count, indptr, indices, z_now, heard, square)
    one = inputs.shape[0] == 1
    for i in range(count):
        for j in range(n_o):
            z[j, i] = z_now[low + i, j]
            b[j, i] = inputs[0 if one else low + i, j]
        u[i] = u_now[low + i]
        share[i] = 1.0 / n_o
    if active.size > 0:
        for i in range(count):
            for j in range(n_o):
                on[j, i] = active[low + i, j]
            share[i] = 1.0 / options[low + i] if options[low + i] > 0 else 0.0

    h = dt / substeps
    stages = 4 if method == HELD else 1
    for _ in range(substeps):
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
                _attention_rate(count, z, u, square, share, kind, attention, scratch, u_rate)
                if method == REFERENCE:
                    for i in range(count):
                        u[i] += dt * u_rate[i]
                    _clip(count, u, kind, attention)
            _rate(count, z, u, heard, b, on, share, kind, own, neighbour, resistance, uniform, f, scratch)
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
        scratch[i] = 0.0
    for j in range(n_o):
        for i in range(count):
            scratch[i] += z[j, i]
    for i in range(count):
        scratch[i] *= share[i]
    if dynamic:
        _clip(count, u, kind, attention)
    masked = active.size > 0
    for i in range(count):
        for j in range(n_o):
            z_next[low + i, j] = z[j, i] - (on[j, i] * scratch[i] if masked else scratch[i])
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
    scattered: bool, lag: np.ndarray, history: np.ndarray, head: int, u_now: np.ndarray, inputs: np.ndarray,
    active: np.ndarray, options: np.ndarray, kinds: np.ndarray, own: np.ndarray, neighbour: np.ndarray,
    resistance: np.ndarray, attention: np.ndarray, dynamic: bool, uniform: bool, z_next: np.ndarray, u_next:
    np.ndarray,
) -> None:  # fmt: skip
    """`sweep` on one thread, for populations too small to share out."""
    for tile in range((u_now.size + TILE - 1) // TILE):
        _tile(
            tile, method, dt, substeps, rates_only, indptr, indices, scattered, lag, history, head, u_now,
            inputs, active, options, kinds, own, neighbour, resistance, attention, dynamic, uniform, z_next,
            u_next,
        )  # fmt: skip


@njit(cache=True, parallel=True, error_model="numpy")
def sweep(
    method: int, dt: float, substeps: int, rates_only: bool, indptr: np.ndarray, indices: np.ndarray,
    scattered: bool, lag: np.ndarray, history: np.ndarray, head: int, u_now: np.ndarray, inputs: np.ndarray,
    active: np.ndarray, options: np.ndarray, kinds: np.ndarray, own: np.ndarray, neighbour: np.ndarray,
    resistance: np.ndarray, attention: np.ndarray, dynamic: bool, uniform: bool, z_next: np.ndarray, u_next:
    np.ndarray,
) -> None:  # fmt: skip
    """All agents once: the new state, or with `rates_only` the derivative, into z_next (N, N_O) and u_next
    (N,).

    method      EULER, REFERENCE or HELD (with `substeps` Runge-Kutta steps)
    indptr, indices   whom each agent hears, row by row, uint32; scattered: neighbours lie far apart in memory
    lag         (E,) int16 steps into the past, -1 = nothing heard; empty: everything is heard at once
    history     (H, N, N_O) ring of past opinions, `head` the present one
    inputs      (N, N_O) or (1, N_O)
    active, options  (N, N_O) bool and (N,) count of them; both empty: all active
    kinds       (N,) uint8 index into own, neighbour (K, N_O, N_O), resistance (K, N_O), attention (K, 5:
    tau_u, u_min,
                u_max, y_th, n); empty with K = 1
    dynamic     False keeps the attention; uniform: one kind whose couplings are equal for all options
    """
    for tile in prange((u_now.size + TILE - 1) // TILE):
        _tile(
            tile, method, dt, substeps, rates_only, indptr, indices, scattered, lag, history, head, u_now,
            inputs, active, options, kinds, own, neighbour, resistance, attention, dynamic, uniform, z_next,
            u_next,
        )  # fmt: skip
