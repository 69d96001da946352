"""Trajectories of a dense network: accurate, with graphs and inputs that may change with time.

Classical Runge-Kutta for all agents together (gcid.md 4). Populations too large for a tensor are in `population`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from opinion_engine import kernels, network_kernels
from opinion_engine.model import (
    RATE_PER_STEP,
    Attention,
    Floats,
    OpinionError,
    OpinionNetwork,
    finite_array,
)

_T = TypeVar("_T")


class Trajectory(NamedTuple):
    """A computed motion: t (T,), z (T, N_a, N_O), u (T, N_a)."""

    t: Floats
    z: Floats
    u: Floats


def simulate(
    network: OpinionNetwork | Sequence[tuple[float, OpinionNetwork]],
    z0: ArrayLike,
    t: ArrayLike,
    *,
    attention: Attention | Sequence[Attention] | None = None,
    u0: ArrayLike | None = None,
    b: ArrayLike | Sequence[tuple[float, ArrayLike]] = 0.0,
    max_step: float = 0.01,
) -> Trajectory:
    """The motion from z0 at t[0], given at the times t (ascending, seconds), by RK4 in steps of at most
    max_step.

    network   one network, or (start time, network) pairs in order of time for a graph that changes; each
    holds from
              its start until the next one
    z0        (N_a, N_O), or what broadcasts to it; projected to zero row sums
    attention one for all agents, or one per agent; None keeps the attention at u0
    u0        (N_a,) or scalar; by default u_min
    b         (N_a, N_O), or (start time, inputs) pairs

    The step is also kept below RATE_PER_STEP / rate, so the result does not depend on max_step beyond
    round-off-like errors (order 4). Raises OpinionError for shapes that do not fit, times that do not ascend,
    or u0 missing.
    """
    networks = [(-np.inf, network)] if isinstance(network, OpinionNetwork) else list(network)
    if not networks:
        raise OpinionError("simulate needs at least one network")
    n_a, n_o = networks[0][1].n_agents, networks[0][1].n_options
    if any((w.n_agents, w.n_options) != (n_a, n_o) for _, w in networks):
        raise OpinionError("all networks of a simulation need the same agents and options")
    times = np.asarray(t, dtype=np.float64)
    if times.ndim != 1 or times.size == 0 or not np.all(np.isfinite(times)) or np.any(np.diff(times) < 0.0):
        raise OpinionError("t must be a list of ascending times")
    if not max_step > 0.0:
        raise OpinionError(f"max_step is {max_step:g}, expected more than 0")
    z = finite_array("z0", z0, (n_a, n_o))
    rows = np.zeros((n_a, 5))
    if attention is not None:
        each = [attention] * n_a if isinstance(attention, Attention) else list(attention)
        if len(each) != n_a:
            raise OpinionError(f"{len(each)} attention parameters for {n_a} agents")
        rows = np.array([a.row for a in each])
    elif u0 is None:
        raise OpinionError("simulate needs u0 when no attention dynamics are given")
    u = finite_array("u0", rows[:, 1] if u0 is None else u0, (n_a,))
    inputs = _input_schedule(b, (n_a, n_o))

    changes = sorted({s for s, _ in networks} | {s for s, _ in inputs})
    out = Trajectory(times.copy(), np.empty((times.size, n_a, n_o)), np.empty((times.size, n_a)))
    now = float(times[0])
    for i in range(n_a):
        kernels.project_active(z[i], _at(networks, now).active[i])
    for index, target in enumerate(times):
        while now < target:
            stop = min([float(target)] + [s for s in changes if now < s < target])
            current, current_b = _at(networks, now), _at(inputs, now)
            u_top = float(max(u.max(), rows[:, 2].max()))
            rate = current.fastest_rate(u_top)
            if attention is not None:
                rate = max(rate, 1.0 / rows[:, 0].min())
            steps = max(1, int(np.ceil((stop - now) / min(max_step, RATE_PER_STEP / rate))))
            network_kernels.network_rk4(
                z,
                u,
                stop - now,
                steps,
                current._kernel_tensor,
                current.links,
                current.resistance,
                current_b,
                current.active,
                rows,
                attention is not None,
            )
            now = stop
        out.z[index] = z
        out.u[index] = u
    return out


def _input_schedule(b: object, shape: tuple[int, int]) -> list[tuple[float, Floats]]:
    """Inputs as (start, b) pairs; a plain array holds for ever."""
    pairs = (
        isinstance(b, list | tuple) and len(b) > 0 and all(isinstance(p, tuple) and len(p) == 2 for p in b)
    )
    if not pairs:
        return [(-np.inf, finite_array("b", b, shape))]  # type: ignore[arg-type]
    schedule = [(float(start), finite_array("b", value, shape)) for start, value in b]  # type: ignore[attr-defined]
    if schedule[0][0] > -np.inf:
        schedule.insert(0, (-np.inf, np.zeros(shape)))
    return schedule


def _at(schedule: Sequence[tuple[float, _T]], now: float) -> _T:
    """The entry in force at `now`: the last that has started, or the first."""
    current = schedule[0][1]
    for start, value in schedule:
        if start <= now:
            current = value
    return current
