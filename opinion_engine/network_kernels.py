"""A small dense network of agents, compiled: the full coupling tensor, what theory is checked on (gcid.md 1, 4).

Free functions over plain arrays; `model` and `simulation` hold the objects. See `kernels` for the rules.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from opinion_engine.kernels import hill, project_active, tanh


@njit(cache=True, error_model="numpy")
def network_rate(
    z: np.ndarray,
    u: np.ndarray,
    tensor: np.ndarray,
    links: np.ndarray,
    resistance: np.ndarray,
    b: np.ndarray,
    active: np.ndarray,
    rate: np.ndarray,
    y: np.ndarray,
) -> None:
    """Right-hand side of paper equation (2) and the y_i of (5), for all agents of a dense network.

    z, resistance, b, active, rate (N_a, N_O); u, y (N_a); tensor[i, j, k, l] = A_ik^jl, zero where there is
    no link; links[i, k] = abar_ik with self-loops. The neighbours' opinions are summed inside one tanh per
    pair of options.
    """
    n_a, n_o = z.shape
    argument = np.empty(n_o)
    for i in range(n_a):
        n_active = 0
        mean = 0.0
        for j in range(n_o):
            rate[i, j] = 0.0
            if not active[i, j]:
                continue
            n_active += 1
            for option in range(n_o):
                argument[option] = 0.0
            for k in range(n_a):
                for option in range(n_o):
                    argument[option] += tensor[i, j, k, option] * z[k, option]
            total = 0.0
            for option in range(n_o):
                if active[i, option]:
                    total += tanh(argument[option])
            rate[i, j] = -resistance[i, j] * z[i, j] + u[i] * total + b[i, j]
            mean += rate[i, j]
        if n_active > 0:
            mean /= n_active
        for j in range(n_o):
            if active[i, j]:
                rate[i, j] -= mean
        y[i] = 0.0
        for k in range(n_a):
            if links[i, k] != 0.0:
                square = 0.0
                options = 0
                for option in range(n_o):
                    if active[k, option]:
                        heard = links[i, k] * z[k, option]
                        square += heard * heard
                        options += 1
                if options > 0:
                    y[i] += square / options


@njit(cache=True, error_model="numpy")
def network_rk4(
    z: np.ndarray,
    u: np.ndarray,
    dt: float,
    steps: int,
    tensor: np.ndarray,
    links: np.ndarray,
    resistance: np.ndarray,
    b: np.ndarray,
    active: np.ndarray,
    attention: np.ndarray,
    dynamic: bool,
) -> None:
    """Advance z and u in place by `steps` classical RK4 steps of dt / steps, all agents coupled at every
    stage.

    attention is (N_a, 5): tau_u, u_min, u_max, y_th, n; with dynamic False the attention stays as given.
    """
    n_a, n_o = z.shape
    h = dt / steps
    stage_z = np.empty((n_a, n_o))
    stage_u = np.empty(n_a)
    rate = np.empty((n_a, n_o))
    y = np.empty(n_a)
    sum_z = np.empty((n_a, n_o))
    sum_u = np.empty(n_a)
    for _ in range(steps):
        stage_z[:] = z
        stage_u[:] = u
        sum_z[:] = 0.0
        sum_u[:] = 0.0
        for stage in range(4):
            network_rate(stage_z, stage_u, tensor, links, resistance, b, active, rate, y)
            weight = 1.0 if stage == 0 or stage == 3 else 2.0
            ahead = h if stage == 2 else 0.5 * h
            for i in range(n_a):
                for j in range(n_o):
                    sum_z[i, j] += weight * rate[i, j]
                    stage_z[i, j] = z[i, j] + ahead * rate[i, j]
                if dynamic:
                    target = hill(y[i], attention[i, 1], attention[i, 2], attention[i, 3], attention[i, 4])
                    rate_u = (target - stage_u[i]) / attention[i, 0]
                    sum_u[i] += weight * rate_u
                    stage_u[i] = u[i] + ahead * rate_u
        for i in range(n_a):
            for j in range(n_o):
                z[i, j] += (h / 6.0) * sum_z[i, j]
            if dynamic:
                u[i] = min(max(u[i] + (h / 6.0) * sum_u[i], attention[i, 1]), attention[i, 2])
            project_active(z[i], active[i])
