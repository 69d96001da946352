"""The equation on one tile of a population, in planes: option j of agent i at j * TILE + i (gcid.md 1).

Loops over agents are contiguous, so that the compiler turns them into vector instructions; every function works on
arrays of its own, without which it would fear overlaps and give up. `population_kernels` puts them together.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from opinion_engine.kernels import hill, tanh, tanh_difference

TILE = 256
"""Agents per tile: its arrays fit the caches nearest to the core, and a byte counts its agents."""

_FULL = (
    1e9  # a drive so far above its threshold saturates attention to the last bit, and its square stays finite
)


@njit(cache=True, error_model="numpy")
def to_planes(count: int, width: int, rows: np.ndarray, planes: np.ndarray) -> None:
    """Rows of `width` into planes; the width that occurs most has constant strides."""
    if width == 4:
        for i in range(count):
            planes[i] = rows[4 * i]
            planes[TILE + i] = rows[4 * i + 1]
            planes[2 * TILE + i] = rows[4 * i + 2]
            planes[3 * TILE + i] = rows[4 * i + 3]
    else:
        for i in range(count):
            for lane in range(width):
                planes[lane * TILE + i] = rows[width * i + lane]


@njit(cache=True, error_model="numpy")
def to_rows(count: int, width: int, planes: np.ndarray, rows: np.ndarray) -> None:
    """`_planes` backwards."""
    if width == 4:
        for i in range(count):
            rows[4 * i] = planes[i]
            rows[4 * i + 1] = planes[TILE + i]
            rows[4 * i + 2] = planes[2 * TILE + i]
            rows[4 * i + 3] = planes[3 * TILE + i]
    else:
        for i in range(count):
            for lane in range(width):
                rows[width * i + lane] = planes[lane * TILE + i]


@njit(cache=True, error_model="numpy")
def opinion_rate(
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
                    cooperation, competition = (
                        alpha * z[row + i] + gamma * heard[row + i],
                        beta * z[row + i] + delta * heard[row + i],
                    )
                    difference = tanh_difference(cooperation, competition)
                    f[row + i] = u[i] * difference - d * z[row + i] + b[row + i]
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
    option_mean(count, n_o, f, share, mean)
    subtract(count, n_o, mean, on, f)


@njit(cache=True, error_model="numpy")
def euler3(
    count: int, dt: float, sums: np.ndarray, mine: np.ndarray, u_now: np.ndarray, b: np.ndarray, own: np.ndarray,
    neighbour: np.ndarray, d: float, attention: np.ndarray, u: np.ndarray, written: np.ndarray,
) -> None:  # fmt: skip
    """The whole Euler step of a tile, for three options with equal couplings and attention of order 2.

    The commonest case, in one loop from rows to rows, with the same operations in the same order as the general
    path, so to the same bits. sums, mine, written are rows of 4; b planes; u gets the new attention.
    """
    alpha, gamma, beta, delta = own[0, 0], neighbour[0, 0], own[0, 2], neighbour[0, 2]
    tau_u, u_min, u_max, y_th, _ = attention
    third, quick = 1.0 / 3.0, 1.0 / tau_u
    for i in range(count):
        z0, z1, z2 = mine[4 * i], mine[4 * i + 1], mine[4 * i + 2]
        h0, h1, h2 = sums[4 * i], sums[4 * i + 1], sums[4 * i + 2]
        level = u_now[i]
        f0 = level * tanh_difference(alpha * z0 + gamma * h0, beta * z0 + delta * h0) - d * z0 + b[i]
        f1 = level * tanh_difference(alpha * z1 + gamma * h1, beta * z1 + delta * h1) - d * z1 + b[TILE + i]
        f2 = (
            level * tanh_difference(alpha * z2 + gamma * h2, beta * z2 + delta * h2)
            - d * z2
            + b[2 * TILE + i]
        )
        mean = (f0 + f1 + f2) * third
        z0 += dt * (f0 - mean)
        z1 += dt * (f1 - mean)
        z2 += dt * (f2 - mean)
        mean = (z0 + z1 + z2) * third
        z0 -= mean
        z1 -= mean
        z2 -= mean
        ratio = (mine[4 * i + 3] + sums[4 * i + 3]) / y_th
        ratio = _FULL if ratio > _FULL else ratio
        p = ratio * ratio
        level += dt * ((u_min + (u_max - u_min) * (p / (1.0 + p)) - level) * quick)
        level = u_min if level < u_min else level
        u[i] = u_max if level > u_max else level
        written[4 * i] = z0
        written[4 * i + 1] = z1
        written[4 * i + 2] = z2
        written[4 * i + 3] = (z0 * z0 + z1 * z1 + z2 * z2) * third


@njit(cache=True, error_model="numpy")
def option_mean(count: int, n_o: int, planes: np.ndarray, share: np.ndarray, mean: np.ndarray) -> None:
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
def subtract(count: int, n_o: int, mean: np.ndarray, on: np.ndarray, planes: np.ndarray) -> None:
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
def mean_squares(count: int, n_o: int, z: np.ndarray, share: np.ndarray, square: np.ndarray) -> None:
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
def attention_rate(
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
        quick = 1.0 / tau_u
        for i in range(count):
            ratio = y[i] / y_th
            ratio = _FULL if ratio > _FULL else ratio
            p = ratio * ratio
            rate[i] = (u_min + (u_max - u_min) * (p / (1.0 + p)) - u[i]) * quick
    else:
        for i in range(count):
            rate[i] = (hill(y[i], u_min, u_max, y_th, n) - u[i]) / tau_u


@njit(cache=True, error_model="numpy")
def clip_attention(count: int, u: np.ndarray, kind: np.ndarray, attention: np.ndarray) -> None:
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
