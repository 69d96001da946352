"""How fast opinions are: one agent's update, and a step of a million agents against memory and scipy.

    python benchmarks/bench_opinion.py [--agents 1000000] [--repeat 15] [--quick] [--only PARTS]

Everything a number is compared with is measured in the same run, in turns with it: the numpy version of
one agent's update, the numpy/scipy version of a population step, and the machine's memory bandwidth (a
parallel triad over arrays far larger than the caches). Times are the best of the repetitions, which is what
an otherwise busy machine disturbs least. The bytes of a step are counted in three ways, none of which counts
what our layout adds (filled-up rows, sorted tiles), so that a wasteful layout cannot look good:

  once   every array is read or written once: links (4 B each), row starts, z, u, b, and the new z and u.
         The least traffic there can be: what a machine with an unlimited cache would move.
  links  as `once`, and the neighbour's z read at every link (8 N_O B each): what the sums ask for when the
         opinions of all agents (32 MB for a million) do not stay in a cache. The goal of 40 % is of this.
  lines  as `once`, and a cache line of 64 B at every link: what memory must deliver when neighbours lie
         anywhere, as in the random graph, where no order of the agents brings neighbours together. On the
         geometric graph neighbours share lines, so there it counts more than is moved.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from functools import partial
from typing import Any

# Threads that wait must not take the core of one that works: matters on machines with other things to do.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

import numba
import numpy as np

from opinion_engine import graphs
from opinion_engine.engine import EngineSettings, OpinionEngine
from opinion_engine.graphs import Graph
from opinion_engine.model import Attention, Couplings
from opinion_engine.option_file import Option, OptionSet
from opinion_engine.population import Population

MISSION = Attention(tau_u=4.0, u_min=0.5, u_max=2.0, y_th=2000.0, n=2.0)
GROUP = Attention(tau_u=2.0, u_min=0.45, u_max=1.0, y_th=0.4, n=2.0)
UNIFORM = Couplings.homogeneous(3, alpha=0.5, beta=-0.2, gamma=0.3, delta=-0.1)
DT = 0.1


def best(repeat: int, *runs: Callable[[], Any]) -> list[float]:
    """Seconds of each run, best of `repeat`, taken in turns so that a disturbance meets all alike."""
    for run in runs:
        run()
    least = [np.inf] * len(runs)
    for _ in range(repeat):
        for index, run in enumerate(runs):
            began = time.perf_counter()
            run()
            least[index] = min(least[index], time.perf_counter() - began)
    return least


# ------------------------------------------------------------------------------------- one agent


def mission_options() -> OptionSet:
    def option(name: str, alpha: float, beta: float, gamma: float, delta: float, gain: float) -> Option:
        others = [o for o in ("exploit", "explore", "migrate") if o != name]
        return Option(
            name=name,
            outputs=(("OPTION", name.upper()),),
            input_variable=f"{name.upper()}_INPUT",
            function_type="none",
            social_mode="custom",
            resistance=0.25,
            alpha=alpha,
            gamma=gamma,
            beta=tuple((o, beta) for o in others),
            delta=tuple((o, delta) for o in others),
            input_min=-100.0,
            input_gain=gain,
        )

    return OptionSet(
        (
            option("exploit", 0.05, -0.01, -0.05, 0.01, 1.0),
            option("explore", 0.05, -0.01, -0.05, 0.01, 1.0),
            option("migrate", 1.0, 0.0, 8.0, 0.0, 40.0),
        )
    )


class NumpyAgent:
    """The same update in numpy: fresh neighbours summed, Runge-Kutta in as many steps, projection."""

    def __init__(
        self, options: OptionSet, attention: Attention, records: np.ndarray, times: np.ndarray
    ) -> None:
        c = options.couplings()
        self.own, self.neighbour, self.d = c.own, c.heard, c.resistance
        self.attention, self.records, self.times = attention, records, times
        self.z, self.u, self.b = np.zeros(3), attention.u_min, np.array([0.0, 0.5, 0.0])

    def update(self, now: float, dt: float) -> None:
        fresh = self.records[now - self.times <= 1e9]
        heard, square = fresh.sum(axis=0), float((fresh * fresh).mean(axis=1).sum())
        shift, a = self.neighbour * heard, self.attention

        def rate(z: np.ndarray, u: float) -> tuple[np.ndarray, float]:
            f = u * np.tanh(self.own * z + shift).sum(axis=1) - self.d * z + self.b
            ratio = ((z @ z) / 3 + square) / a.y_th
            p = ratio * ratio
            return f - f.mean(), (a.u_min + (a.u_max - a.u_min) * p / (1 + p) - u) / a.tau_u

        f, _ = rate(self.z, self.u)
        fastest = (self.d + a.u_max * np.abs(self.own).sum(axis=1)).max() + np.abs(self.own * f).max()
        m = int(min(200, max(1, np.ceil(dt * fastest / 0.2))))
        h = dt / m
        z, u = self.z, self.u
        for _ in range(m):
            k1, l1 = rate(z, u)
            k2, l2 = rate(z + h / 2 * k1, u + h / 2 * l1)
            k3, l3 = rate(z + h / 2 * k2, u + h / 2 * l2)
            k4, l4 = rate(z + h * k3, u + h * l3)
            z, u = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), u + h / 6 * (l1 + 2 * l2 + 2 * l3 + l4)
        self.z, self.u = z - z.mean(), min(max(u, a.u_min), a.u_max)


def bench_agent(repeat: int) -> None:
    options = mission_options()
    agent = OpinionEngine("abe", options, EngineSettings(attention=MISSION, stale=1e9), 0.0)
    records = np.array([[-0.3 * k, 0.5 + 0.1 * k, 0.2 * k - 0.5] for k in range(8)])
    for k, row in enumerate(records):
        pairs = ":".join(f"{n}={v:.4f}" for n, v in zip(options.names, row, strict=True))
        assert agent.receive(f"v{k}:leader:{pairs}", 0.0)
    agent.take("EXPLORE_INPUT", 50.0)
    plain = NumpyAgent(options, MISSION, records, np.zeros(8))
    clock = [0.0, 0.0]
    rounds = 500

    def ours() -> None:
        for _ in range(rounds):
            clock[0] += 1.0
            agent.update(clock[0])

    def numpys() -> None:
        for _ in range(rounds // 10):
            clock[1] += 1.0
            plain.update(clock[1], 1.0)

    fast, slow = best(repeat, ours, numpys)
    gap = np.abs(np.array(agent.z) - plain.z).max()  # both have settled by now
    fast, slow = fast / rounds * 1e6, slow / (rounds // 10) * 1e6
    print("\nOne agent: 3 options, 8 fresh neighbours, dt 1 s, Runge-Kutta, message and decision included")
    print(f"{'':28}{'us/update':>12}{'ratio':>9}   goal")
    print(f"{'numpy, equation only':28}{slow:12.1f}{slow / fast:8.0f}x")
    print(f"{'OpinionEngine.update':28}{fast:12.1f}{'':9}   at most 20: {'met' if fast <= 20 else 'MISSED'}")
    print(f"largest difference of the two in the end: {gap:.1e}")


# ------------------------------------------------------------------------------------ population


@numba.njit(parallel=True)
def triad(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> None:
    for i in numba.prange(a.size):
        a[i] = b[i] + 0.5 * c[i]


class ScipyPopulation:
    """The same Euler step in numpy and scipy.sparse, with the same algebra (2 N_O tanh per agent)."""

    def __init__(self, graph: Graph, z0: np.ndarray, b: np.ndarray, attention: Attention) -> None:
        from scipy.sparse import csr_array

        links = (np.ones(graph.n_links), graph.indices.astype(np.int32), graph.indptr.astype(np.int32))
        self.matrix = csr_array(links, shape=(graph.n_agents, graph.n_agents))
        self.z, self.b, self.attention = z0.copy(), b - b.mean(axis=1, keepdims=True), attention
        self.u = np.full(graph.n_agents, attention.u_min)

    def step(self, dt: float) -> None:
        z, u, a = self.z, self.u, self.attention
        alpha, beta, gamma, delta, d = UNIFORM.uniform  # type: ignore[misc]
        square = (z * z).mean(axis=1)
        heard = self.matrix @ z
        ratio = (square + self.matrix @ square) / a.y_th
        p = ratio * ratio
        f = np.tanh(alpha * z + gamma * heard)
        f -= np.tanh(beta * z + delta * heard)
        f *= u[:, None]
        f -= d * z
        f += self.b
        f -= f.mean(axis=1, keepdims=True)
        z += dt * f
        z -= z.mean(axis=1, keepdims=True)
        u += dt / a.tau_u * (a.u_min + (a.u_max - a.u_min) * p / (1.0 + p) - u)
        np.clip(u, a.u_min, a.u_max, out=u)


def make_population(graph: Graph, seed: int = 0) -> tuple[Population, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    n = graph.n_agents
    z0 = rng.normal(size=(n, 3))
    z0 -= z0.mean(axis=1, keepdims=True)
    b = 0.1 * rng.normal(size=(n, 3))
    return Population(graph, UNIFORM, attention=GROUP, inputs=b, z0=z0), z0, b


COUNTS = ("once", "links", "lines")


def verdict(met: bool) -> str:
    return "met" if met else "MISSED"


def step_bytes(graph: Graph) -> tuple[float, float, float]:
    """(once, links, lines) of one Euler step with 3 options, in bytes."""
    n, e, row = graph.n_agents, graph.n_links, 3 * 8
    once = 4 * e + 4 * n + row * n + row * n + 8 * n + (row + 8) * n  # links, rows, z, b, u, new z and u
    return once, once + row * e, once + 64 * e


def bench_population(agents: int, repeat: int) -> None:
    size = 4_000_000 if agents < 500_000 else 20_000_000
    a, b, c = np.ones(size), np.ones(size), np.ones(size)
    rng = np.random.default_rng(1)
    print(
        f"\nPopulation: {agents:,} agents, mean degree 8, 3 options, one Euler step of opinions and attention,"
    )
    print(f"{numba.get_num_threads()} threads; bandwidth by triad, in turns with the steps")
    print(
        f"{'graph':12}{'ours ms':>9}{'scipy ms':>10}{'ratio':>8}{'triad GB/s':>12}"
        f"{'once':>7}{'links':>7}{'lines':>7}  of the bandwidth; goals"
    )
    for name, make in (("geometric", graphs.random_geometric), ("random", graphs.random_pairs)):
        graph = make(agents, 8.0, rng)
        ours, z0, inputs = make_population(graph)
        theirs = ScipyPopulation(graph, z0, inputs, GROUP)
        ours.step(DT, "euler")
        theirs.step(DT)
        gap = max(np.abs(ours.z - theirs.z).max(), np.abs(ours.u - theirs.u).max())
        assert gap < 1e-12, f"the two steps differ by {gap}"
        fast, plain, copy = best(
            repeat, partial(ours.step, DT, "euler"), partial(theirs.step, DT), partial(triad, a, b, c)
        )
        bandwidth = 24.0 * size / copy
        sizes = step_bytes(graph)
        shares = [count / fast / bandwidth for count in sizes]
        print(
            f"{name:12}{fast * 1e3:9.1f}{plain * 1e3:10.1f}{plain / fast:7.1f}x{bandwidth / 1e9:12.1f}"
            + "".join(f"{share:7.0%}" for share in shares)
            + f"  5x {verdict(plain / fast >= 5)}, links 40 % {verdict(shares[1] >= 0.4)}"
        )
    print(
        "bytes counted, MB:  " + ", ".join(f"{k} {v / 1e6:.0f}" for k, v in zip(COUNTS, sizes, strict=True))
    )


def bench_edges(repeat: int, most: int) -> None:
    print("\nLinear in the links: geometric graphs of mean degree 8")
    print(f"{'links':>12}{'agents':>12}{'ms/step':>12}{'ns/link':>10}{'held ms':>12}")
    rng = np.random.default_rng(2)
    points = []
    for links in (10_000, 100_000, 1_000_000, 10_000_000):
        if links > most:
            break
        graph = graphs.random_geometric(links // 8, 8.0, rng)
        population, _, _ = make_population(graph)
        count = max(1, 200_000 // links)

        def steps(method: str, population: Population = population, count: int = count) -> None:
            for _ in range(count):
                population.step(DT, method)  # type: ignore[arg-type]

        euler, held = (t / count for t in best(repeat, lambda: steps("euler"), lambda: steps("held")))
        points.append((graph.n_links, euler))
        print(
            f"{graph.n_links:12,}{graph.n_agents:12,}{euler * 1e3:12.3f}{euler / graph.n_links * 1e9:10.2f}"
            f"{held * 1e3:12.3f}"
        )
    x, y = np.log10(np.array(points)).T
    slope = float(np.polyfit(x, y, 1)[0])
    print(f"time grows as links to the power {slope:.2f} (1 is linear)")


def check_threads(agents: int) -> None:
    """The same bits from one thread as from all."""
    graph = graphs.random_pairs(min(agents, 200_000), 8.0, np.random.default_rng(3))
    ends = []
    for threads in sorted({1, numba.config.NUMBA_NUM_THREADS}):
        numba.set_num_threads(threads)
        population, _, _ = make_population(graph)
        for method in ("euler", "held"):
            population.step(DT, method)  # type: ignore[arg-type]
        ends.append((threads, population.z.copy()))
    same = all(np.array_equal(ends[0][1], end) for _, end in ends)
    print(
        f"\nthreads {', '.join(str(t) for t, _ in ends)}: {'the same bits' if same else 'DIFFERENT RESULTS'}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description="Benchmarks of the opinion engine.")
    parser.add_argument("--agents", type=int, default=1_000_000)
    parser.add_argument("--repeat", type=int, default=15)
    parser.add_argument("--quick", action="store_true", help="small sizes, to see that it runs")
    parser.add_argument("--only", default="agent,population,edges,threads", help="parts to run, by name")
    given = parser.parse_args()
    agents, repeat = (20_000, 2) if given.quick else (given.agents, given.repeat)
    parts: dict[str, Callable[[], None]] = {
        "agent": partial(bench_agent, repeat),
        "population": partial(bench_population, agents, repeat),
        "edges": partial(bench_edges, repeat, 100_000 if given.quick else 10_000_000),
        "threads": partial(check_threads, agents),
    }
    for name in given.only.split(","):
        if name not in parts:
            parser.error(f"--only {name}: the parts are {', '.join(parts)}")
    for name, part in parts.items():
        if name in given.only.split(","):
            part()


if __name__ == "__main__":
    main()
