"""The opinion model of the paper as values: couplings, attention, a dense network, and the choice made.

Nonlinear opinion dynamics with attention (Paine & Benjamin, equations 2 and 5; gcid.md 1). This module checks
shapes and ranges, gives the equation its names and hands plain arrays to `kernels`; it knows no messages,
files or clocks.

Symbols: N_a agents, N_O options; z (N_a, N_O) opinions, every row sums to 0; u (N_a,) attention; d
resistance; b (N_a, N_O) inputs; A[i, k, j, l] the influence of agent k's opinion about option l on agent i's
opinion about option j.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from opinion_engine import network_kernels

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

TIE = 1e-9
"""Opinions within this of the largest count as tied with it (gcid.md 9)."""

RATE_PER_STEP = 0.2
"""Largest (rate x step) of the Runge-Kutta integrator (gcid.md 4)."""


class OpinionError(ValueError):
    """A model, input or message that cannot be used; the message says what and what would be right."""


def array_of(name: str, value: ArrayLike, shape: object) -> Floats:
    """`value` as float64 of any shape; OpinionError, naming the shape expected, for what is no array of numbers."""
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise OpinionError(f"{name} must be numbers of shape {shape}") from None


def finite_number(name: str, value: object) -> float:
    """`value` as a float; OpinionError for what is no number, NaN or infinity."""
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise OpinionError(f"{name} is {value!r:.40}, expected a number") from None
    if not math.isfinite(number):
        raise OpinionError(f"{name} is {number:g}, expected a finite number")
    return number


def finite_array(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Floats:
    """`value` as float64, broadcast to `shape`, copied; OpinionError for a wrong shape, NaN or infinity."""
    array = array_of(name, value, shape)
    try:
        array = np.array(np.broadcast_to(array, shape), order="C")
    except ValueError:
        raise OpinionError(f"{name} has shape {array.shape}, expected {shape}") from None
    bad = np.argwhere(~np.isfinite(array))
    if bad.size:
        where = tuple(int(i) for i in bad[0])
        raise OpinionError(
            f"{name}[{', '.join(map(str, where))}] is {array[where]}, expected a finite number"
        )
    return array


def _require_positive(name: str, array: Floats) -> Floats:
    bad = np.argwhere(array <= 0.0)
    if bad.size:
        where = tuple(int(i) for i in bad[0])
        raise OpinionError(f"{name}[{', '.join(map(str, where))}] is {array[where]:g}, expected more than 0")
    return array


@dataclass(frozen=True)
class Attention:
    """How attention follows opinions: tau_u u' = -u + S_u(y), S_u a Hill function from u_min to u_max.

    tau_u in seconds; y_th in squared opinion units; n the order. Defaults are those of `pOpinionManager`.
    Raises OpinionError unless tau_u, u_min, y_th, n > 0 and u_max >= u_min.
    """

    tau_u: float = 10.0
    u_min: float = 0.5
    u_max: float = 1.5
    y_th: float = 0.1
    n: float = 2.0

    def __post_init__(self) -> None:
        for name in ("tau_u", "u_min", "u_max", "y_th", "n"):
            value = finite_number(f"attention {name}", getattr(self, name))
            if value <= 0.0:
                raise OpinionError(f"attention {name} is {value:g}, expected more than 0")
            object.__setattr__(self, name, value)
        if self.u_max < self.u_min:
            raise OpinionError(f"attention u_max is {self.u_max:g}, expected at least u_min, {self.u_min:g}")

    def saturation(self, y: ArrayLike) -> Floats:
        """S_u(y) for y >= 0, element by element; S_u(0) = u_min and S_u(infinity) = u_max."""
        y = np.asarray(y, dtype=np.float64)
        ratio = y / self.y_th
        with np.errstate(divide="ignore", over="ignore"):
            rising = np.minimum(ratio, 1.0) ** self.n
            falling = np.minimum(1.0 / ratio, 1.0) ** self.n
        share = np.where(ratio <= 1.0, rising / (1.0 + rising), 1.0 / (1.0 + falling))
        return np.asarray(self.u_min + (self.u_max - self.u_min) * share)

    def saturation_slope(self, y: ArrayLike) -> Floats:
        """dS_u/dy for y > 0; 0 is returned at y = 0, where orders below 1 have no slope."""
        y = np.asarray(y, dtype=np.float64)
        share = (self.saturation(y) - self.u_min) / max(self.u_max - self.u_min, np.finfo(float).tiny)
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = (self.u_max - self.u_min) * self.n * share * (1.0 - share) / y
        if self.n == 1.0:
            slope = np.where(y == 0.0, (self.u_max - self.u_min) / self.y_th, slope)
        return np.asarray(np.where((y == 0.0) & (self.n != 1.0), 0.0, slope))

    @property
    def row(self) -> Floats:
        """(tau_u, u_min, u_max, y_th, n), the order the kernels use."""
        return np.array([self.tau_u, self.u_min, self.u_max, self.y_th, self.n])


@dataclass(frozen=True, eq=False)
class Couplings:
    """What one agent does with its own opinions and with those it hears (gcid.md 1).

    own[j, l] = A_ii^jl: alpha_j on the diagonal, beta_jl off it. heard[j, l] = A_ik^jl for every neighbour k
    alike: gamma_j on the diagonal, delta_jl off it. resistance[j] = d_j > 0. Raises OpinionError for wrong
    shapes, values that are not finite, and resistances that are not positive.
    """

    resistance: Floats
    own: Floats
    heard: Floats

    def __post_init__(self) -> None:
        own = array_of("own couplings", self.own, "(N_O, N_O)")
        n_o = own.shape[0] if own.ndim == 2 else np.size(self.resistance)
        if n_o < 1:
            raise OpinionError("couplings need at least one option")
        object.__setattr__(self, "own", finite_array("own couplings", self.own, (n_o, n_o)))
        object.__setattr__(self, "heard", finite_array("heard couplings", self.heard, (n_o, n_o)))
        resistance = finite_array("resistance", self.resistance, (n_o,))
        object.__setattr__(self, "resistance", _require_positive("resistance", resistance))

    @classmethod
    def homogeneous(
        cls, n_options: int, *, alpha: float, beta: float, gamma: float, delta: float, resistance: float = 1.0
    ) -> Couplings:
        """The same alpha, beta, gamma, delta and resistance for every option."""
        if n_options < 1:
            raise OpinionError("couplings need at least one option")
        eye = np.eye(n_options)
        a, b = finite_number("alpha", alpha), finite_number("beta", beta)
        g, d = finite_number("gamma", gamma), finite_number("delta", delta)
        spread = np.full(n_options, finite_number("resistance", resistance))
        return cls(spread, np.where(eye == 1.0, a, b), np.where(eye == 1.0, g, d))

    @property
    def n_options(self) -> int:
        """N_O."""
        return int(self.resistance.size)

    @property
    def uniform(self) -> tuple[float, float, float, float, float] | None:
        """(alpha, beta, gamma, delta, d) if they are the same for every option, else None."""
        off = ~np.eye(self.n_options, dtype=bool)
        parts = []
        for matrix in (self.own, self.heard):
            diagonal, others = np.diag(matrix), matrix[off]
            if np.any(diagonal != diagonal[0]) or (others.size and np.any(others != others[0])):
                return None
            parts += [float(diagonal[0]), float(others[0]) if others.size else 0.0]
        if np.any(self.resistance != self.resistance[0]):
            return None
        return (*parts, float(self.resistance[0]))  # type: ignore[return-value]


@dataclass(frozen=True, eq=False)
class OpinionNetwork:
    """N_a agents with the full coupling tensor: heterogeneous agents, options, links, and inactive options.

    tensor  (N_a, N_a, N_O, N_O), indexed [i, k, j, l]
    links   (N_a, N_a), abar_ik >= 0 with self-loops; an influence without a link is ignored, so the same
    tensor
            serves a graph that changes with time (`with_links`)
    resistance  scalar, one per agent (N_a,), or (N_a, N_O), all > 0
    active  (N_a, N_O) booleans, by default all; an inactive option has no row, no term, opinion 0

    Raises OpinionError for wrong shapes, values that are not finite, and resistances that are not positive.
    """

    tensor: Floats
    links: Floats
    resistance: Floats = field(default_factory=lambda: np.ones(1))
    active: Bools = field(default_factory=lambda: np.ones((0, 0), np.bool_))
    _kernel_tensor: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        shape = array_of("coupling tensor", self.tensor, "(N_a, N_a, N_O, N_O)").shape
        if len(shape) != 4 or shape[0] != shape[1] or shape[2] != shape[3] or 0 in shape:
            raise OpinionError(f"coupling tensor has shape {shape}, expected (N_a, N_a, N_O, N_O)")
        n_a, _, n_o, _ = shape
        tensor = finite_array("coupling tensor", self.tensor, shape)
        links = finite_array("links", self.links, (n_a, n_a))
        if np.any(links < 0.0):
            raise OpinionError("links must not be negative; put the sign into the couplings")
        if np.any(np.diag(links) == 0.0):
            raise OpinionError("links must include every agent itself: the diagonal of abar is 1")
        resistance = array_of("resistance", self.resistance, (n_a, n_o))
        if resistance.ndim == 1 and resistance.size == n_a:
            resistance = resistance[:, None]  # one per agent
        object.__setattr__(self, "tensor", tensor)
        object.__setattr__(self, "links", links)
        resistance = finite_array("resistance", resistance, (n_a, n_o))
        object.__setattr__(self, "resistance", _require_positive("resistance", resistance))
        active = np.ones((n_a, n_o), np.bool_)
        if np.size(self.active):
            active = np.asarray(self.active, dtype=np.bool_).copy()
            if active.shape != (n_a, n_o):
                raise OpinionError(f"active has shape {active.shape}, expected {(n_a, n_o)}")
        object.__setattr__(self, "active", active)
        linked = np.where(links[:, :, None, None] != 0.0, tensor, 0.0)
        # The kernel walks k and l for a fixed row (i, j), so it wants them innermost.
        object.__setattr__(self, "_kernel_tensor", np.ascontiguousarray(linked.transpose(0, 2, 1, 3)))

    @classmethod
    def from_couplings(
        cls,
        adjacency: ArrayLike,
        couplings: Couplings | Sequence[Couplings],
        *,
        resistance: ArrayLike | None = None,
        active: Bools | None = None,
    ) -> OpinionNetwork:
        """A network in which agent i treats all its neighbours alike; `couplings` one for all or one per
        agent.

        adjacency (N_a, N_a) without self-loops; row i lists whom agent i hears; entries other than 0 weigh
        the influence. resistance overrides that of the couplings.
        """
        shape = np.shape(adjacency)
        if len(shape) != 2 or shape[0] != shape[1] or shape[0] == 0:
            raise OpinionError(f"adjacency has shape {shape}, expected (N_a, N_a)")
        n_a = shape[0]
        weights = finite_array("adjacency", adjacency, (n_a, n_a))
        if np.any(np.diag(weights) != 0.0):
            raise OpinionError(
                "adjacency must not contain self-loops: an agent's own opinions are always included"
            )
        each = [couplings] * n_a if isinstance(couplings, Couplings) else list(couplings)
        if len(each) != n_a:
            raise OpinionError(f"{len(each)} couplings for {n_a} agents")
        n_o = each[0].n_options
        if any(c.n_options != n_o for c in each):
            raise OpinionError("all agents need the same number of options")
        tensor = np.zeros((n_a, n_a, n_o, n_o))
        for i, c in enumerate(each):
            tensor[i] = weights[i][:, None, None] * c.heard
            tensor[i, i] = c.own
        links = (weights != 0.0).astype(np.float64) + np.eye(n_a)
        if resistance is None:
            resistance = np.array([c.resistance for c in each])
        on = np.ones((n_a, n_o), np.bool_) if active is None else active
        return cls(tensor, links, np.asarray(resistance, dtype=np.float64), on)

    @classmethod
    def homogeneous(
        cls,
        adjacency: ArrayLike,
        n_options: int,
        *,
        alpha: float,
        beta: float,
        gamma: float,
        delta: float,
        resistance: ArrayLike = 1.0,
    ) -> OpinionNetwork:
        """The homogeneous model of the theory: four couplings for all agents and options (gcid.md 3)."""
        c = Couplings.homogeneous(n_options, alpha=alpha, beta=beta, gamma=gamma, delta=delta)
        return cls.from_couplings(adjacency, c, resistance=resistance)

    @property
    def n_agents(self) -> int:
        """N_a."""
        return int(self.tensor.shape[0])

    @property
    def n_options(self) -> int:
        """N_O."""
        return int(self.tensor.shape[2])

    def with_links(self, links: ArrayLike) -> OpinionNetwork:
        """The same agents on another communication graph abar (N_a, N_a); the diagonal is taken as 1."""
        links = finite_array("links", links, (self.n_agents, self.n_agents))
        np.fill_diagonal(links, 1.0)
        return OpinionNetwork(self.tensor, links, self.resistance, self.active)

    def with_active(self, active: Bools) -> OpinionNetwork:
        """The same network with another set of active options (N_a, N_O)."""
        return OpinionNetwork(self.tensor, self.links, self.resistance, active)

    def derivative(self, z: ArrayLike, u: ArrayLike, b: ArrayLike = 0.0) -> tuple[Floats, Floats]:
        """(z', y) at opinions z (N_a, N_O), attention u (N_a,) and inputs b: paper equation (2), and y of
        (5).
        """
        shape = (self.n_agents, self.n_options)
        rate = np.empty(shape)
        y = np.empty(self.n_agents)
        network_kernels.network_rate(
            finite_array("z", z, shape),
            finite_array("u", u, shape[:1]),
            self._kernel_tensor,
            self.links,
            self.resistance,
            finite_array("b", b, shape),
            self.active,
            rate,
            y,
        )
        return rate, y

    def fastest_rate(self, u_max: float) -> float:
        """d_max + u_max * kappa, kappa the largest row sum of |A| (gcid.md 4), in 1/s."""
        kappa = float(np.abs(self._kernel_tensor).sum(axis=(2, 3)).max())
        return float(self.resistance.max()) + u_max * kappa


def strongest(z: ArrayLike, active: ArrayLike | None = None) -> int:
    """e_zmax as an index: the largest opinion, the lowest index among those within TIE of it (paper equation
    7).

    Only active options count. Raises OpinionError if there is none or an opinion is not a number.
    """
    values = np.asarray(z, dtype=np.float64)
    if values.ndim != 1 or values.size == 0:
        raise OpinionError(f"opinions have shape {values.shape}, expected (N_O,)")
    if np.any(np.isnan(values)):
        raise OpinionError("opinions contain NaN")
    if active is not None:
        values = np.where(np.asarray(active, dtype=bool), values, -np.inf)
    best = values.max()
    if best == -np.inf:
        raise OpinionError("no option is active")
    return int(np.argmax(values >= best - TIE))


def input_value(raw: float, low: float, high: float, gain: float = 1.0, shape: str = "none") -> float:
    """The input b of a raw value: clip to [low, high], map to s in [-1, 1], gain * s or (quadratic)
    gain * s^2.

    Raises OpinionError for a raw value that is not a number.
    """
    if math.isnan(raw):
        raise OpinionError("a raw input is nan, expected a number")
    s = 2.0 * (min(max(raw, low), high) - low) / (high - low) - 1.0
    return gain * s * s if shape == "quadratic" else gain * s


def weighted_decision(
    e_zmax: ArrayLike, activation: ArrayLike, weights: ArrayLike, utilities: ArrayLike
) -> tuple[tuple[int, ...], Floats]:
    """(index of the best decision, total utility): argmax_r e_zmax^T A_c W f(r) on a grid (gcid.md 9).

    e_zmax (N_O,), activation A_c (N_O, q), weights (q,), utilities (q, ...grid). The lowest flat index wins
    ties.
    """
    f = np.asarray(utilities, dtype=np.float64)
    if f.ndim < 2:
        raise OpinionError(f"utilities have shape {f.shape}, expected (q, grid...)")
    e = finite_array("e_zmax", e_zmax, (np.size(e_zmax),))
    a_c = finite_array("A_c", activation, (e.size, f.shape[0]))
    w = finite_array("W", weights, (f.shape[0],))
    total = np.tensordot((e @ a_c) * w, finite_array("utilities", f, f.shape), axes=1)
    best = np.unravel_index(int(np.argmax(total)), total.shape)
    return tuple(int(i) for i in best), total
