"""The homogeneous model's theory in closed form (gcid.md 3, after Bizyaeva, Franci & Leonard 2023).

Four couplings for all agents and options: critical attention, amplitudes of the branches, and the threshold
of a cascade when every agent gets the same input. `analysis` does the same numerically for any network.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from opinion_engine.model import Attention, Floats, OpinionError, finite_array

Branch = Literal["agreement", "disagreement", "neither"]


@dataclass(frozen=True, eq=False)
class Threshold:
    """Where the neutral state loses stability (gcid.md 3.2).

    u_star   the critical attention, None if the neutral state is stable for every u >= 0
    branch   agreement (gamma > delta), disagreement (gamma < delta) or neither
    lambda_star, mode   the eigenvalue of the graph that decides, and its eigenvector (N_a,), unit length
    eigenvalues  of the adjacency, ascending
    """

    u_star: float | None
    branch: Branch
    lambda_star: float
    mode: Floats
    eigenvalues: Floats


def critical_attention(
    adjacency: ArrayLike, *, alpha: float, beta: float, gamma: float, delta: float, resistance: float = 1.0
) -> Threshold:
    """u* = d / (alpha - beta + lambda* (gamma - delta)) of the homogeneous model on a symmetric graph.

    lambda* is the largest eigenvalue for agreement, the smallest for disagreement. The number of options does
    not matter. Raises OpinionError for a graph that is not symmetric (use `network_threshold`) or d <= 0.
    """
    a = square_matrix("adjacency", adjacency)
    if not np.allclose(a, a.T, rtol=0.0, atol=1e-12):
        raise OpinionError("adjacency is not symmetric; use network_threshold for directed graphs")
    if not resistance > 0.0:
        raise OpinionError(f"resistance is {resistance:g}, expected more than 0")
    values, vectors = np.linalg.eigh(a)
    branch: Branch = "agreement" if gamma > delta else "disagreement" if gamma < delta else "neither"
    at = 0 if branch == "disagreement" else -1
    gain = alpha - beta + values[at] * (gamma - delta)
    mode = vectors[:, at] * (1.0 if vectors[:, at].sum() >= 0.0 else -1.0)
    return Threshold(
        float(resistance / gain) if gain > 0.0 else None, branch, float(values[at]), mode, values
    )


def neutral_eigenvalues(
    adjacency: ArrayLike,
    u: float,
    *,
    alpha: float,
    beta: float,
    gamma: float,
    delta: float,
    resistance: float,
) -> Floats:
    """-d + u [(alpha - beta) + lambda_m (gamma - delta)], ascending: of the Jacobian at z = 0 on the zero-sum
    space.

    (N_a,); each has multiplicity N_O - 1 (gcid.md 3.1). Symmetric graphs.
    """
    values = np.linalg.eigvalsh(square_matrix("adjacency", adjacency))
    return np.sort(-resistance + u * (alpha - beta + values * (gamma - delta)))


def regular_degree(adjacency: ArrayLike) -> int | None:
    """The number of neighbours if all agents have the same, else None."""
    degrees = (square_matrix("adjacency", adjacency) != 0.0).sum(axis=1)
    return int(degrees[0]) if np.all(degrees == degrees[0]) else None


def agreement_gains(
    degree: int, *, alpha: float, beta: float, gamma: float, delta: float
) -> tuple[float, float]:
    """(a, c): the couplings of an agent whose `degree` neighbours all think as it does (gcid.md 3.3)."""
    return alpha + degree * gamma, beta + degree * delta


def two_option_amplitude(a: float, c: float, u: float, resistance: float = 1.0) -> float:
    """x > 0 with d x = u (tanh(a x) - tanh(c x)), 0 below threshold: two options agree on (x, -x)."""
    return _amplitude(lambda x: u * (np.tanh(a * x) - np.tanh(c * x)) - resistance * x, 2.0 * u / resistance)


def two_option_leading_order(a: float, c: float, u: float, u_star: float) -> float:
    """The pitchfork near u*: x^2 = 3 (u - u*) (a - c) / (u* (a^3 - c^3)), 0 below threshold (gcid.md 3.3)."""
    square = 3.0 * (u - u_star) * (a - c) / (u_star * (a**3 - c**3))
    return float(np.sqrt(max(0.0, square)))


def three_option_amplitude(a: float, c: float, u: float, resistance: float = 1.0) -> float:
    """s > 0 of the winner (s, -s/2, -s/2), whose mirror image is the rejected state; 0 below threshold."""

    def excess(s: float) -> float:
        pull = np.tanh(a * s) + np.tanh(a * s / 2) - np.tanh(c * s) - np.tanh(c * s / 2)
        return float(u * pull - 1.5 * resistance * s)

    return _amplitude(excess, 4.0 * u / (1.5 * resistance))


def _amplitude(excess: Callable[[float], float], top: float) -> float:
    """The largest root of `excess` in (0, top], 0 if there is none."""
    grid = np.linspace(0.0, top * 1.001 + 1e-12, 4001)[1:]
    values = np.array([excess(float(x)) for x in grid])
    positive = np.nonzero(values > 0.0)[0]
    if positive.size:
        low, high = float(grid[positive[-1]]), float(grid[min(positive[-1] + 1, grid.size - 1)])
    else:  # a small amplitude just above threshold may lie below the first point of the grid
        low, high = 0.0, float(grid[0])
        probe = high
        while probe > 1e-12 and excess(probe) <= 0.0:
            probe *= 0.5
        if probe <= 1e-12:
            return 0.0
        low, high = probe, 2.0 * probe
    return _bisect(excess, low, high)


def _bisect(excess: Callable[[float], float], low: float, high: float) -> float:
    """The sign change of `excess` from positive at low to not positive at high."""
    for _ in range(200):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        if excess(middle) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@dataclass(frozen=True)
class UniformCascade:
    """Threshold of equal inputs at all agents: b_star, and the first opinion at the fold (gcid.md 3.5)."""

    b_star: float
    opinion: float


def uniform_cascade(
    degree: int,
    n_options: int,
    attention: Attention,
    *,
    alpha: float,
    beta: float,
    gamma: float,
    delta: float,
    resistance: float = 1.0,
) -> UniformCascade | None:
    """b*, the input at every agent above which the whole group leaves the low state; None if nothing jumps.

    On a graph where everybody has `degree` neighbours. Input (b, -b) for two options, (b, 0, 0) for three:
    the first local maximum of h(x) with attention slaved to x. Raises OpinionError for other numbers of
    options.
    """
    a, c = agreement_gains(degree, alpha=alpha, beta=beta, gamma=gamma, delta=delta)
    n, d = degree + 1, resistance
    if n_options == 2:
        top = 2.0 * attention.u_max / d

        def h(x: Floats) -> Floats:
            return np.asarray(d * x - attention.saturation(n * x * x) * (np.tanh(a * x) - np.tanh(c * x)))

    elif n_options == 3:
        top = 4.0 * attention.u_max / (1.5 * d)

        def h(x: Floats) -> Floats:
            pull = np.tanh(a * x) + np.tanh(a * x / 2) - np.tanh(c * x) - np.tanh(c * x / 2)
            return np.asarray(1.5 * d * x - attention.saturation(n * x * x / 2) * pull)

    else:
        raise OpinionError(f"uniform_cascade knows 2 or 3 options, not {n_options}; use cascade_threshold")
    # Logarithmic below, linear above: the fold may sit at any scale.
    x = np.unique(np.concatenate([np.geomspace(1e-6 * top, top, 20000), np.linspace(0.0, top, 20001)[1:]]))
    values = h(x)
    falls = np.nonzero(values[1:] < values[:-1])[0]
    if falls.size == 0 or values[falls[0]] <= 0.0:
        return None
    peak = int(falls[0])
    low, high = float(x[max(peak - 1, 0)]), float(x[min(peak + 1, x.size - 1)])
    golden = (np.sqrt(5.0) - 1.0) / 2.0
    while high - low > 1e-12 * high:
        left, right = high - golden * (high - low), low + golden * (high - low)
        if left in (low, high) or right in (low, high):
            break
        if h(np.array(left)) < h(np.array(right)):
            low = left
        else:
            high = right
    best = 0.5 * (low + high)
    return UniformCascade(float(h(np.array(best))), best)


def square_matrix(name: str, value: ArrayLike) -> Floats:
    shape = np.shape(value)
    if len(shape) != 2 or shape[0] != shape[1] or shape[0] == 0:
        raise OpinionError(f"{name} has shape {shape}, expected (N_a, N_a)")
    return finite_array(name, value, shape)
