"""Large populations: N agents on a sparse graph, all stepped at once by the kernels of `population_kernels`.

The same equations as `model`, for up to millions of agents: agents of a few kinds, inputs of their own, a
graph that may change between steps, messages that are lost or late. Deterministic: the same arguments and
seed give the same bits for any number of threads.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from opinion_engine import population_kernels as kernels
from opinion_engine.gather_kernels import side_by_side
from opinion_engine.graphs import Graph
from opinion_engine.model import (
    RATE_PER_STEP,
    TIE,
    Attention,
    Bools,
    Couplings,
    Floats,
    OpinionError,
    finite_array,
)
from opinion_engine.recording import PopulationResult, Progress, ProgressBar

Method = Literal["rk4", "held", "euler", "reference"]
METHODS: tuple[Method, ...] = ("rk4", "held", "euler", "reference")
"""rk4: the coupled system, classical Runge-Kutta. held: neighbours held during each step, as boats with engines
do (every agent integrates itself accurately). euler: explicit Euler. reference: the authors' order of one Euler
step."""

_PARALLEL_FROM = 16384  # agents; below this sharing the work out costs more than it saves


@dataclass(frozen=True)
class Links:
    """How messages travel: each is lost with probability `loss`, and late by a fixed number of steps per
    link.

    delay    (lowest, highest) whole steps, drawn once per link
    stale    steps after which a neighbour not heard again contributes nothing
    """

    loss: float = 0.0
    delay: tuple[int, int] = (0, 0)
    stale: int = 2

    def __post_init__(self) -> None:
        low, high = self.delay
        if not 0.0 <= self.loss <= 1.0:
            raise OpinionError(f"loss is {self.loss:g}, expected a probability")
        if not 0 <= low <= high <= 1000 or not 0 <= self.stale <= 1000:
            raise OpinionError(
                f"delay {self.delay} and stale {self.stale} must be steps from 0 to 1000, in order"
            )


class Population:
    """N agents with opinions z (N, N_O) and attention u (N,).

    graph      who hears whom
    couplings  one for all, or a list of kinds with `kinds` (N,) saying which each agent is
    attention  one for all, or one per kind; None keeps u
    inputs     b, (N, N_O) or what broadcasts to it
    z0, u0     start; zero row sums are enforced; u0 defaults to u_min
    active     (N, N_O) booleans, or None for all
    links      lost and late messages (see `Links`); needs method held, euler or reference
    seed       of the losses and delays

    Raises OpinionError for shapes that do not fit and values that are not finite.
    """

    def __init__(
        self,
        graph: Graph,
        couplings: Couplings | Sequence[Couplings],
        *,
        attention: Attention | Sequence[Attention] | None = None,
        inputs: ArrayLike = 0.0,
        z0: ArrayLike = 0.0,
        u0: ArrayLike | None = None,
        kinds: ArrayLike | None = None,
        active: ArrayLike | None = None,
        links: Links | None = None,
        seed: int = 0,
    ) -> None:
        each = [couplings] if isinstance(couplings, Couplings) else list(couplings)
        if not each or len({c.n_options for c in each}) != 1:
            raise OpinionError("a population needs couplings, all of the same number of options")
        n, n_o, k = graph.n_agents, each[0].n_options, len(each)
        self.n_agents, self.n_options = n, n_o
        self._own = np.array([c.own for c in each])
        self._neighbour = np.array([c.heard for c in each])
        self._resistance = np.array([c.resistance for c in each])
        self._uniform = k == 1 and n_o > 1 and each[0].uniform is not None
        self._kinds = np.empty(0, np.uint8)
        if k > 1:
            self._kinds = _kind_array(kinds, n, k)
        elif kinds is not None:
            raise OpinionError("kinds need a list of couplings")
        self._dynamic = attention is not None
        rows = (
            [Attention()]
            if attention is None
            else [attention]
            if isinstance(attention, Attention)
            else attention
        )
        if len(rows) not in (1, k):
            raise OpinionError(f"{len(rows)} attention parameters for {k} kinds of agents")
        self._attention = np.array([a.row for a in rows])
        self._active, self._options = _active_arrays(active, n, n_o)
        self.set_inputs(inputs)
        self._links = links
        depth = 1 if links is None else links.stale + links.delay[1] + 1
        self._ring = self._states(depth + 1)  # one more than is read: the state being written
        self._head = 0
        self._fill(self._ring[0], self._project(finite_array("z0", z0, (n, n_o))))
        if u0 is None:
            if attention is None:
                raise OpinionError("a population without attention dynamics needs u0")
            u_min = self._attention[:, 1]
            u0 = u_min[self._kinds] if len(rows) > 1 else u_min[0]
        self._u = finite_array("u0", u0, (n,))
        if self._u.min() < 0.0:
            raise OpinionError(f"u0 is {self._u.min():g} somewhere, expected attention of at least 0")
        self._u_next = np.empty(n)
        self._rng = np.random.default_rng(seed)
        self._silent: Bools | None = None
        self._lag = np.empty(0, np.int16)
        self._base_lag = np.empty(0, np.int16)
        self.time = 0.0
        self.steps = 0
        self.set_graph(graph)

    # --- state -----------------------------------------------------------------------------

    @property
    def z(self) -> Floats:
        """The opinions now, (N, N_O); a view that the next step leaves behind."""
        return np.asarray(self._ring[self._head][:-1, : self.n_options])

    @property
    def u(self) -> Floats:
        """The attention now, (N,); a view that the next step leaves behind."""
        return self._u

    def choices(self) -> NDArray[np.int64]:
        """The strongest option of every agent, (N,): lowest index among ties, as `model.strongest`."""
        z = self.z
        if self._active.size:
            z = np.where(self._active, z, -np.inf)
        return np.asarray(np.argmax(z >= z.max(axis=1, keepdims=True) - TIE, axis=1), dtype=np.int64)

    def set_inputs(self, inputs: ArrayLike) -> None:
        """New inputs from now on, (N, N_O) or what broadcasts to it."""
        rows = 1 if np.ndim(inputs) < 2 else self.n_agents
        b = self._project(finite_array("inputs", inputs, (rows, self.n_options)))
        self._inputs = kernels.input_planes(b)

    def set_graph(self, graph: Graph) -> None:
        """Another graph from now on, of the same agents; delays are drawn anew for its links."""
        if graph.n_agents != self.n_agents:
            raise OpinionError(f"the new graph has {graph.n_agents} agents, the population {self.n_agents}")
        self.graph = graph
        if self._links is None and kernels.row_width(self.n_options) <= 8:
            self._layout = side_by_side(graph.indptr, graph.indices)
        else:
            self._layout = (np.empty(0, np.int64), np.empty(0, np.uint32), np.empty(0, np.uint8))
        if self._links is not None:
            low, high = self._links.delay
            self._base_lag = self._rng.integers(low, high + 1, graph.n_links).astype(np.int16)
            self._lag = self._base_lag.copy()

    def set_silent(self, silent: ArrayLike | None) -> None:
        """The agents (N,) whose messages all get lost from now on; None for nobody. Needs `links`."""
        if self._links is None:
            raise OpinionError("silent agents need links: Links() says when what they said is stale")
        self._silent = None
        if silent is None:
            self._lag = self._base_lag.copy()
        else:
            mask = np.asarray(silent, dtype=np.bool_)
            if mask.shape != (self.n_agents,):
                raise OpinionError(f"silent has shape {mask.shape}, expected ({self.n_agents},)")
            self._silent = mask.copy()

    def _states(self, count: int) -> Floats:
        """Room for states (count, N + 1, W), zero, aligned so that no agent's row straddles a cache line."""
        rows, width = self.n_agents + 1, kernels.row_width(self.n_options)
        size = count * rows * width
        room = np.zeros(size + 8)
        skip = (-room.ctypes.data % 64) // 8
        return room[skip : skip + size].reshape(count, rows, width)

    def _fill(self, state: Floats, z: Floats) -> None:
        """Write z (N, N_O) and the mean squares into a state (N + 1, W)."""
        state[:-1, : self.n_options] = z
        options = self._options if self._active.size else np.full(1, self.n_options)
        state[:-1, -1] = (z * z).sum(axis=1) / np.maximum(1, options)

    def _project(self, z: Floats) -> Floats:
        """Without the row means over the active options; inactive ones 0."""
        if self._active.size == 0:
            return np.asarray(z - z.mean(axis=1, keepdims=True))
        on = self._active
        z = np.where(on, np.broadcast_to(z, on.shape), 0.0)
        return np.where(on, z - z.sum(axis=1, keepdims=True) / np.maximum(1, self._options)[:, None], 0.0)

    # --- stepping --------------------------------------------------------------------------

    def step(self, dt: float, method: Method = "held") -> None:
        """Advance all agents by dt seconds. Raises OpinionError for dt <= 0 or an unknown method."""
        if not (np.isfinite(dt) and dt > 0.0):
            raise OpinionError(f"dt is {dt:g}, expected a finite time more than 0")
        if method not in METHODS:
            raise OpinionError(f"method '{method}' is none of {', '.join(METHODS)}")
        if method == "rk4":
            if self._links is not None:
                raise OpinionError("lost and late messages need method held, euler or reference")
            self._step_coupled(dt)
        else:
            if self._links is not None:
                self._deliver(self._links)
            code = {"euler": kernels.EULER, "reference": kernels.REFERENCE, "held": kernels.HELD}[method]
            substeps = self._substeps(dt, neighbours=False) if method == "held" else 1
            self._write(code, dt, substeps)
        self.time += dt
        self.steps += 1

    def _substeps(self, dt: float, neighbours: bool) -> int:
        """Runge-Kutta steps for dt (gcid.md 4), counting the neighbours' couplings when they move too."""
        top = self._attention[:, 2].max() if self._dynamic else self._u.max()
        row = np.abs(self._own).sum(axis=2)
        if neighbours:
            row = row + np.abs(self._neighbour).sum(axis=2) * max(1, int(self.graph.degrees.max(initial=0)))
        rate = float((self._resistance + top * row).max())
        if self._dynamic:
            rate = max(rate, 1.0 / float(self._attention[:, 0].min()))
        return max(1, int(np.ceil(dt * rate / RATE_PER_STEP)))

    def _deliver(self, links: Links) -> None:
        """Draw which messages arrive; the others leave the last one heard a step older, until it is stale."""
        if links.loss > 0.0 or self._silent is not None:
            arrived = self._rng.random(self._lag.size) >= links.loss
            if self._silent is not None:
                arrived &= ~self._silent[self.graph.indices]
            older = np.where(self._lag < 0, self._lag, self._lag + 1)
            too_old = older - self._base_lag > links.stale
            self._lag = np.where(arrived, self._base_lag, np.where(too_old, -1, older)).astype(np.int16)
        # Nothing was said before the first step: what would be older is not heard yet.
        self._lag_now = self._lag
        if self.steps < self._ring.shape[0]:
            self._lag_now = np.where(self._lag > self.steps, -1, self._lag).astype(np.int16)

    def _write(self, method: int, dt: float, substeps: int) -> None:
        """One sweep into the next place of the ring."""
        following = (self._head + 1) % self._ring.shape[0]
        lag = self._lag_now if self._links is not None else self._lag
        self._sweep(
            method,
            dt,
            substeps,
            False,
            lag,
            self._ring,
            self._head,
            self._u,
            self._ring[following],
            self._u_next,
        )
        self._head = following
        self._u, self._u_next = self._u_next, self._u

    def _sweep(
        self, method: int, dt: float, substeps: int, rates_only: bool, lag: NDArray[np.int16], history:
        Floats, head: int, u: Floats, z_next: Floats, u_next: Floats,
    ) -> None:  # fmt: skip
        run = kernels.sweep if self.n_agents >= _PARALLEL_FROM else kernels.sweep_serial
        graph = self.graph
        run(
            method, dt, substeps, rates_only, graph.indptr, graph.indices, *self._layout, lag,
            history.reshape(-1), head, u, self._inputs, self._active, self._options, self._kinds, self._own,
            self._neighbour, self._resistance, self._attention, self._dynamic, self._uniform,
            z_next.reshape(-1), u_next,
        )  # fmt: skip

    def _step_coupled(self, dt: float) -> None:
        """Classical RK4 of the whole coupled system, in equal sub-steps."""
        steps = self._substeps(dt, neighbours=True)
        h = dt / steps
        z, u = self.z.copy(), self._u.copy()
        stage, rates = self._states(1), self._states(1)[0]
        rate_z, rate_u = rates[:-1, : self.n_options], np.empty_like(u)
        stage_u = np.empty_like(u)
        for _ in range(steps):
            sum_z, sum_u = np.zeros_like(z), np.zeros_like(u)
            self._fill(stage[0], z)
            stage_u[:] = u
            for weight, ahead in ((1.0, 0.5 * h), (2.0, 0.5 * h), (2.0, h), (1.0, 0.0)):
                self._sweep(kernels.EULER, h, 1, True, self._lag, stage, 0, stage_u, rates, rate_u)
                sum_z += weight * rate_z
                sum_u += weight * rate_u
                self._fill(stage[0], z + ahead * rate_z)
                stage_u[:] = u + ahead * rate_u
            z += (h / 6.0) * sum_z
            u += (h / 6.0) * sum_u
            z = self._project(z)
        following = (self._head + 1) % self._ring.shape[0]
        self._fill(self._ring[following], z)
        self._head = following
        if self._dynamic:
            row = self._attention[self._kinds] if self._attention.shape[0] > 1 else self._attention[[0]]
            u = np.clip(u, row[:, 1], row[:, 2])
        self._u = u

    def run(
        self,
        steps: int,
        dt: float,
        method: Method = "held",
        *,
        record_every: int = 1,
        observe: ArrayLike | None = None,
        before_step: Callable[[Population], None] | None = None,
        progress: bool | Progress = False,
    ) -> PopulationResult:
        """Take `steps` steps, recording the start and every `record_every`-th one.

        observe      indices of the agents whose z and u are kept (default: all if they fit into 1 GB, else none)
        before_step  called with the population before each step: change inputs or the graph there
        progress     True for a bar on the terminal, or a function of (steps done, steps)
        """
        if steps < 0 or record_every < 1:
            raise OpinionError(f"steps {steps} and record_every {record_every} must be at least 0 and 1")
        records = 1 + steps // record_every
        if observe is None:
            fits = records * self.n_agents * (self.n_options + 1) * 8 <= 1_000_000_000
            chosen = np.arange(self.n_agents if fits else 0)
        else:
            chosen = np.asarray(observe, dtype=np.int64).reshape(-1)
            if chosen.size and (chosen.min() < 0 or chosen.max() >= self.n_agents):
                raise OpinionError(f"observe names agents outside 0..{self.n_agents - 1}")
        out = PopulationResult.empty(records, chosen.size, self.n_options)
        self._record(out, 0, chosen)
        with ProgressBar(progress, steps) as tell:
            for done in range(1, steps + 1):
                if before_step is not None:
                    before_step(self)
                self.step(dt, method)
                if done % record_every == 0:
                    self._record(out, done // record_every, chosen)
                tell(done)
        return out

    def _record(self, out: PopulationResult, row: int, chosen: NDArray[np.int64]) -> None:
        out.t[row] = self.time
        out.z[row] = self.z[chosen]
        out.u[row] = self._u[chosen]
        out.shares[row] = np.bincount(self.choices(), minlength=self.n_options) / self.n_agents
        out.mean_attention[row] = self._u.mean()
        heard = self._lag.size if self._links is None else int(np.count_nonzero(self._lag >= 0))
        out.mean_heard[row] = (self.graph.n_links if self._links is None else heard) / self.n_agents


def _kind_array(kinds: ArrayLike | None, n: int, k: int) -> NDArray[np.uint8]:
    if kinds is None:
        raise OpinionError("several couplings need kinds: which one each agent has")
    array = np.asarray(kinds)
    if array.shape != (n,) or not np.issubdtype(array.dtype, np.integer):
        raise OpinionError(f"kinds has shape {array.shape}, expected whole numbers of shape ({n},)")
    if array.min() < 0 or array.max() >= k or k > 255:
        raise OpinionError(f"kinds must be from 0 to {k - 1}, of at most 255")
    return array.astype(np.uint8)


def _active_arrays(active: ArrayLike | None, n: int, n_o: int) -> tuple[Bools, NDArray[np.uint8]]:
    if active is None:
        return np.empty((0, 0), np.bool_), np.empty(0, np.uint8)
    array = np.asarray(active, dtype=np.bool_)
    if array.shape != (n, n_o):
        raise OpinionError(f"active has shape {array.shape}, expected {(n, n_o)}")
    return array.copy(), array.sum(axis=1).astype(np.uint8)
