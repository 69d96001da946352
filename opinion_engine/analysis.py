"""What theory says a set of couplings will do: critical attention, branches, equilibria, cascade thresholds.

Numerical analysis of any `OpinionNetwork`: dense linear algebra over small networks. The closed formulas of
the homogeneous model live in `theory` and are offered here too. Nothing in either knows missions or files.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from opinion_engine.model import Attention, Floats, OpinionError, OpinionNetwork, finite_array
from opinion_engine.theory import (
    Branch,
    Threshold,
    UniformCascade,
    agreement_gains,
    critical_attention,
    neutral_eigenvalues,
    regular_degree,
    three_option_amplitude,
    two_option_amplitude,
    two_option_leading_order,
    uniform_cascade,
)

__all__ = [
    "Branch",
    "Cascade",
    "Equilibrium",
    "NetworkThreshold",
    "Threshold",
    "UniformCascade",
    "agreement_gains",
    "cascade_threshold",
    "critical_attention",
    "equilibria",
    "find_equilibrium",
    "full_jacobian",
    "network_threshold",
    "neutral_eigenvalues",
    "reduced_basis",
    "regular_degree",
    "three_option_amplitude",
    "two_option_amplitude",
    "two_option_leading_order",
    "uniform_cascade",
    "zero_sum_basis",
]

_NEWTON_STEPS = 60
_NEWTON_TOLERANCE = 1e-13


def zero_sum_basis(n_options: int) -> Floats:
    """(N_O, N_O - 1) with orthonormal columns that each sum to 0."""
    helmert = np.zeros((n_options, n_options - 1))
    for k in range(1, n_options):
        helmert[:k, k - 1] = 1.0
        helmert[k, k - 1] = -k
        helmert[:, k - 1] /= np.sqrt(k * (k + 1.0))
    return helmert


def reduced_basis(network: OpinionNetwork) -> Floats:
    """(N_a N_O, R) orthonormal basis of the states of the network: zero row sums, inactive options 0."""
    columns = []
    n_o = network.n_options
    for i in range(network.n_agents):
        on = np.nonzero(network.active[i])[0]
        if on.size < 2:
            continue
        block = np.zeros((network.n_agents * n_o, on.size - 1))
        block[i * n_o + on] = zero_sum_basis(on.size)
        columns.append(block)
    if not columns:
        raise OpinionError("no agent has two active options, so there is nothing to decide")
    return np.hstack(columns)


def full_jacobian(
    network: OpinionNetwork, z: ArrayLike, u: ArrayLike, attention: Attention | None = None
) -> Floats:
    """Jacobian of (z', u') in the reduced coordinates of `reduced_basis`, then u if there is attention.

    (R, R), or (R + N_a, R + N_a). z (N_a, N_O), u (N_a,) or scalar.
    """
    n_a, n_o = network.n_agents, network.n_options
    z = finite_array("z", z, (n_a, n_o))
    u = finite_array("u", u, (n_a,))
    tensor = np.where(network.links[:, :, None, None] != 0.0, network.tensor, 0.0)
    arguments = np.einsum("ikjl,kl->ijl", tensor, z)
    on = network.active.astype(np.float64)
    slope = (1.0 - np.tanh(arguments) ** 2) * on[:, None, :]
    # d F_ij / d z_km = u_i sech^2(arg_ijm) A_ik^jm - d_ij [i = k, j = m]
    dz = np.einsum("i,ijm,ikjm->ijkm", u, slope, tensor).reshape(n_a * n_o, n_a * n_o)
    dz -= np.diag(network.resistance.reshape(-1))
    basis = reduced_basis(network)
    top = basis.T @ dz @ basis  # the basis projects: P0 F lies in its span
    if attention is None:
        return np.asarray(top)
    force = (np.tanh(arguments) * on[:, None, :]).sum(axis=2)
    du = np.zeros((n_a * n_o, n_a))
    for i in range(n_a):
        du[i * n_o : (i + 1) * n_o, i] = force[i]
    options = np.maximum(1.0, on.sum(axis=1))
    squares = (network.links**2) @ ((z * z * on).sum(axis=1) / options)
    gradient = 2.0 * (network.links**2)[:, :, None] * (z * on / options[:, None])[None]
    chain = attention.saturation_slope(squares)[:, None] * gradient.reshape(n_a, n_a * n_o)
    return np.block([[top, basis.T @ du], [chain @ basis / attention.tau_u, -np.eye(n_a) / attention.tau_u]])


@dataclass(frozen=True, eq=False)
class NetworkThreshold:
    """Loss of stability of the neutral state of any network; see `network_threshold`.

    mode (N_a, N_O) is the pattern that grows first; oscillating if it does so with a frequency.
    """

    u_star: float | None
    mode: Floats
    oscillating: bool


def network_threshold(network: OpinionNetwork, u_most: float = 1e6) -> NetworkThreshold:
    """The smallest attention, equal for all agents, at which z = 0 (b = 0) stops being stable.

    For any tensor, directed graphs and unequal resistances: the first u in (0, u_most] at which an eigenvalue
    of -D + u M on the zero-sum space reaches the imaginary axis. u_star is None if none does.
    """
    basis = reduced_basis(network)
    zero = np.zeros((network.n_agents, network.n_options))
    at_zero, at_one = full_jacobian(network, zero, 0.0), full_jacobian(network, zero, 1.0)
    slope = at_one - at_zero

    def growth(u: float) -> float:
        return float(np.linalg.eigvals(at_zero + u * slope).real.max())

    # Real crossings are eigenvalues of a pencil, exactly; a pair may cross before them, so look between.
    values = np.linalg.eigvals(np.linalg.solve(-at_zero, slope))
    real = sorted(1.0 / v.real for v in values if v.real > 1e-300 and abs(v.imag) <= 1e-9 * abs(v))
    candidates = [u for u in real if u <= u_most]
    limit = candidates[0] if candidates else u_most
    scale = float(np.abs(np.linalg.eigvals(at_zero)).max()) / max(float(np.linalg.norm(slope, 2)), 1e-300)
    grid = np.unique(np.concatenate([np.geomspace(min(0.1 * scale, limit), limit, 400), [limit]]))
    u_star, exact = (limit, True) if candidates else (None, False)
    previous = 0.0
    for u in grid:
        if growth(float(u)) > 1e-9 * (1.0 + float(np.abs(at_zero).max())) and not (exact and u == limit):
            low, high = previous, float(u)
            for _ in range(100):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if growth(middle) > 0.0 else (middle, high)
            if u_star is None or high < u_star * (1.0 - 1e-9):
                u_star = high
            break
        previous = float(u)
    if u_star is None:
        return NetworkThreshold(None, zero, False)
    values, vectors = np.linalg.eig(at_zero + u_star * slope)
    first = int(np.argmax(values.real))
    mode = (basis @ vectors[:, first].real).reshape(zero.shape)
    mode = mode / max(float(np.abs(mode).max()), 1e-300)
    return NetworkThreshold(u_star, mode, bool(abs(values[first].imag) > 1e-7 * np.abs(values).max()))


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """A state that stays: z (N_a, N_O), u (N_a,), the Jacobian's eigenvalues, and whether it attracts."""

    z: Floats
    u: Floats
    eigenvalues: NDArray[np.complex128]
    stable: bool


def find_equilibrium(
    network: OpinionNetwork,
    z_guess: ArrayLike,
    *,
    u: ArrayLike | None = None,
    attention: Attention | None = None,
    b: ArrayLike = 0.0,
) -> Equilibrium | None:
    """The equilibrium Newton's method finds from z_guess, None if it finds none.

    Give either u (constant attention) or attention (u slaved to the opinions). Stability is of the full
    system.
    """
    if (u is None) == (attention is None):
        raise OpinionError("find_equilibrium needs either u or attention")
    shape = (network.n_agents, network.n_options)
    b = finite_array("b", b, shape)
    basis = reduced_basis(network)
    w = basis.T @ finite_array("z_guess", z_guess, shape).reshape(-1)
    bound = _opinion_bound(network, b, attention.u_max if attention else float(np.max(u)))  # type: ignore[arg-type]
    for _ in range(_NEWTON_STEPS):
        residual, jacobian, _ = _residual(network, basis, w, u, attention, b)
        try:
            step = np.linalg.solve(jacobian, -residual)
        except np.linalg.LinAlgError:
            return None
        size = float(np.abs(step).max())
        if size > 0.5 * bound:
            step *= 0.5 * bound / size
        w = w + step
        if size <= _NEWTON_TOLERANCE * (1.0 + float(np.abs(w).max())):
            break
    else:
        return None
    residual, _, level = _residual(network, basis, w, u, attention, b)
    if not float(np.abs(residual).max()) <= 1e-9 * (1.0 + bound):
        return None
    z = (basis @ w).reshape(shape)
    values = np.linalg.eigvals(full_jacobian(network, z, level, attention))
    order = np.argsort(-values.real)
    return Equilibrium(z, level, values[order].astype(np.complex128), bool(values.real.max() < 0.0))


def _opinion_bound(network: OpinionNetwork, b: Floats, u_top: float) -> float:
    """No equilibrium has an opinion beyond this: saturated couplings and the inputs over the resistance."""
    return float((np.abs(b).max() + u_top * network.n_options) / network.resistance.min()) + 1e-9


def _residual(
    network: OpinionNetwork,
    basis: Floats,
    w: Floats,
    u: ArrayLike | None,
    attention: Attention | None,
    b: Floats,
) -> tuple[Floats, Floats, Floats]:
    """(projected z', its derivative by w, the attention) with u constant or slaved to the opinions."""
    n_a = network.n_agents
    z = (basis @ w).reshape(n_a, network.n_options)
    if attention is None:
        level = finite_array("u", u, (n_a,))  # type: ignore[arg-type]
        rate, _ = network.derivative(z, level, b)
        return basis.T @ rate.reshape(-1), full_jacobian(network, z, level), level
    _, y = network.derivative(z, 0.0, b)
    level = attention.saturation(y)
    rate, _ = network.derivative(z, level, b)
    full = full_jacobian(network, z, level, attention)
    r = w.size
    slaved = full[:r, :r] + full[:r, r:] @ (full[r:, :r] * attention.tau_u)
    return basis.T @ rate.reshape(-1), slaved, level


def equilibria(
    network: OpinionNetwork,
    *,
    u: ArrayLike | None = None,
    attention: Attention | None = None,
    b: ArrayLike = 0.0,
    starts: int = 200,
    seed: int = 0,
) -> list[Equilibrium]:
    """The distinct equilibria Newton's method finds from `starts` random states, the neutral one and its
    modes.

    Sorted: stable ones first, then by size. A search, not a proof that there are no more.
    """
    rng = np.random.default_rng(seed)
    shape = (network.n_agents, network.n_options)
    b = finite_array("b", b, shape)
    bound = _opinion_bound(network, b, attention.u_max if attention else float(np.max(u)))  # type: ignore[arg-type]
    mode = network_threshold(network).mode
    guesses = [np.zeros(shape)] + [s * bound * mode for s in (-0.9, -0.3, -0.05, 0.05, 0.3, 0.9)]
    guesses += [rng.normal(size=shape) * bound * 10.0 ** rng.uniform(-2, 0) for _ in range(starts)]
    found: list[Equilibrium] = []
    for guess in guesses:
        one = find_equilibrium(network, guess, u=u, attention=attention, b=b)
        if one is not None and all(np.abs(one.z - other.z).max() > 1e-6 * (1.0 + bound) for other in found):
            found.append(one)
    return sorted(found, key=lambda e: (not e.stable, float(np.abs(e.z).max())))


@dataclass(frozen=True, eq=False)
class Cascade:
    """A fold of the low state: b_star * pattern is the largest input it survives; z and u there."""

    b_star: float
    z: Floats
    u: Floats


def cascade_threshold(
    network: OpinionNetwork, attention: Attention, pattern: ArrayLike, b_most: float | None = None
) -> Cascade | None:
    """The implicit threshold b* for inputs b = b* pattern (N_a, N_O), for any graph, couplings and pattern.

    Follows the equilibrium that starts at z = 0, b = 0 by arc length until it folds back. None if it never
    does up to b_most (by default far beyond where every coupling is saturated), or if the neutral state is
    unstable at u_min already. (gcid.md 3.5; Franci et al. 2021.)
    """
    shape = (network.n_agents, network.n_options)
    pattern = finite_array("pattern", pattern, shape)
    basis = reduced_basis(network)
    drive = basis.T @ pattern.reshape(-1)
    if not np.abs(drive).max() > 0.0:
        raise OpinionError("the input pattern favours no option of any agent")
    if np.linalg.eigvals(full_jacobian(network, np.zeros(shape), attention.u_min)).real.max() >= 0.0:
        return None
    strength = float(np.abs(drive).max())
    if b_most is None:
        gain = float(np.abs(network.tensor).sum(axis=(1, 3)).max())
        b_most = (
            20.0 * (attention.u_max * network.n_options * (1.0 + gain) + network.resistance.max()) / strength
        )

    def evaluate(point: Floats) -> tuple[Floats, Floats]:
        """Residual and (R, R + 1) derivative at (w, b)."""
        r, jacobian, _ = _residual(network, basis, point[:-1], None, attention, point[-1] * pattern)
        return r, np.hstack([jacobian, drive[:, None]])

    def tangent(wide: Floats, before: Floats) -> Floats:
        _, _, rows = np.linalg.svd(wide)
        t = rows[-1]
        return np.asarray(t if t @ before > 0.0 else -t)

    def correct(guess: Floats, along: Floats) -> Floats | None:
        """The curve's point in the plane through `guess` across `along`."""
        point = guess.copy()
        for _ in range(12):
            r, wide = evaluate(point)
            system = np.vstack([wide, along])
            right = np.append(-r, along @ (guess - point))
            try:
                step = np.linalg.solve(system, right)
            except np.linalg.LinAlgError:
                return None
            point = point + step
            if float(np.abs(step).max()) <= 1e-13 * (1.0 + float(np.abs(point).max())):
                return point
        return None

    point = np.zeros(drive.size + 1)
    along = np.zeros_like(point)
    along[-1] = 1.0
    _, wide = evaluate(point)
    along = tangent(wide, along)
    step = 1e-3 * float(network.resistance.min()) / strength
    longest = 0.02 * b_most + 0.05 * attention.u_max * network.n_options / float(network.resistance.min())
    for _ in range(5000):
        following = correct(point + step * along, along)
        if following is None or (following - point) @ along < 0.2 * step:
            step *= 0.5
            if step < 1e-12:
                return None
            continue
        _, wide = evaluate(following)
        turned = tangent(wide, along)
        if turned @ along < 0.97 and step > 1e-9:  # the curve bends: go slower
            step *= 0.5
            continue
        if turned[-1] <= 0.0:
            return _refine_fold(
                network, attention, basis, pattern, point, along, step, correct, evaluate, tangent
            )
        point, along = following, turned
        if point[-1] > b_most:
            return None
        step = min(1.3 * step, longest)
    return None


def _refine_fold(
    network: OpinionNetwork,
    attention: Attention,
    basis: Floats,
    pattern: Floats,
    point: Floats,
    along: Floats,
    step: float,
    correct: Callable[[Floats, Floats], Floats | None],
    evaluate: Callable[[Floats], tuple[Floats, Floats]],
    tangent: Callable[[Floats, Floats], Floats],
) -> Cascade | None:
    """Bisect the arc from `point` to where b has begun to fall; the fold is where the tangent's b component
    is 0.
    """
    low, high, best = 0.0, step, point
    for _ in range(60):
        middle = 0.5 * (low + high)
        candidate = correct(point + middle * along, along)
        if candidate is None:
            return None
        _, wide = evaluate(candidate)
        if tangent(wide, along)[-1] > 0.0:
            low, best = middle, candidate
        else:
            high = middle
        if high - low <= 1e-14 * max(1.0, step):
            break
    z = (basis @ best[:-1]).reshape(pattern.shape)
    _, y = network.derivative(z, 0.0, best[-1] * pattern)
    return Cascade(float(best[-1]), z, attention.saturation(y))
