"""How far an input reaches in a fleet with given options: what grows by itself, what makes one agent or all choose.

Theory where it is exact (the critical attention of every pattern), simulation of the fleet's engines where it is
not (which input makes one agent, or all, choose an option, and how soon).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from opinion_engine import analysis, graphs
from opinion_engine.graphs import Graph
from opinion_engine.model import Attention, Couplings, Floats, OpinionError
from opinion_engine.option_file import OptionSet
from opinion_engine.population import Population

Topology = Literal["all", "line", "ring", "star"]
TOPOLOGIES: tuple[Topology, ...] = ("all", "line", "ring", "star")

_HORIZON = 300.0  # s of simulation after which an agent that has not chosen never will
_BISECTIONS = 24


@dataclass(frozen=True)
class Setting:
    """The fleet a set of options is meant for; attention and threshold as in `pOpinionManager`'s block.

    biases: raw inputs that every agent has at all times, by option name.
    """

    agents: int = 8
    topology: Topology = "all"
    attention: Attention = field(default_factory=Attention)
    opinion_thresh: float = 0.1
    social_tick: float = 1.0
    biases: tuple[tuple[str, float], ...] = ()

    def graph(self, topology: Topology | None = None) -> Graph:
        """Who hears whom. Raises OpinionError for fewer agents than the graph needs."""
        make = {
            "all": graphs.all_to_all,
            "line": graphs.line,
            "ring": graphs.ring,
            "star": graphs.star,
        }[topology or self.topology]
        if self.agents < 2:
            raise OpinionError(f"a fleet has at least 2 agents, not {self.agents}")
        return make(self.agents)


@dataclass(frozen=True, eq=False)
class Pattern:
    """A way in which the neutral fleet can break up: at attention u_star, along `options` (N_O,) and `agents`
    (N,).

    u_star None: never. alike is True when all agents lean the same way, False when neighbours differ.
    """

    u_star: float
    options: Floats
    agents: Floats

    @property
    def alike(self) -> bool:
        """Whether all agents lean the same way."""
        return bool(np.all(self.agents > -1e-9) or np.all(self.agents < 1e-9))


def patterns(couplings: Couplings, graph: Graph) -> list[Pattern]:
    """Every pattern that grows from neutral at some attention, by rising critical attention.

    For each eigenvalue of the (symmetric) graph, the real u > 0 at which -D + u (own + lambda heard) is
    singular on the zero-sum space.
    """
    values, vectors = np.linalg.eigh(graph.adjacency())
    basis = analysis.zero_sum_basis(couplings.n_options)
    damping = basis.T @ np.diag(couplings.resistance) @ basis
    found = []
    for position, value in enumerate(values):
        if position and abs(value - values[position - 1]) < 1e-9:
            continue  # the same patterns on another agent pattern of equal eigenvalue
        gain = basis.T @ (couplings.own + value * couplings.heard) @ basis
        rates, shapes = np.linalg.eig(np.linalg.solve(damping, gain))
        for rate, shape in zip(rates, shapes.T, strict=True):
            if abs(rate.imag) <= 1e-9 * abs(rate) and rate.real > 1e-12:
                direction = basis @ shape.real
                direction = direction / direction[np.argmax(np.abs(direction))]
                found.append(Pattern(1.0 / float(rate.real), direction, vectors[:, position]))
    return sorted(found, key=lambda p: p.u_star)


@dataclass(frozen=True)
class Reach:
    """What an input to one agent achieves: the least raw input that does it (None: not even the largest), and
    the seconds it takes at the largest input."""

    raw: float | None
    seconds: float | None


def reaches(
    options: OptionSet, setting: Setting, option: int, graph: Graph | None = None
) -> tuple[Reach, Reach]:
    """(one, all): what it takes for the agent with an input on `option` to choose it, and for all to do so.

    The agents start neutral and settle with the setting's biases for a while; then agent 0 (the end of a
    line, the hub of a star) gets the input on top.
    """
    graph = graph or setting.graph()
    chosen = options.options[option]
    highest = chosen.input_max
    bias = dict(setting.biases).get(chosen.name)
    lowest = chosen.input_min if bias is None else bias
    rest = _settled(options, setting, graph)
    full = _choose_times(options, setting, graph, rest, option, highest)
    results = []
    for who, reached in enumerate(full):
        if reached is None:
            results.append(Reach(None, None))
            continue
        low, high = lowest, highest
        if _choose_times(options, setting, graph, rest, option, low)[who] is not None:
            results.append(Reach(low, reached))
            continue
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            if _choose_times(options, setting, graph, rest, option, middle)[who] is None:
                low = middle
            else:
                high = middle
        results.append(Reach(high, reached))
    return results[0], results[1]


def _bias_inputs(options: OptionSet, setting: Setting) -> Floats:
    """b (N, N_O) of the biases; an option without bias has had no input, which is b = 0."""
    biases = dict(setting.biases)
    row = [
        option.utility(biases[option.name]) if option.name in biases else 0.0 for option in options.options
    ]
    return np.tile(np.array(row), (setting.agents, 1))


def _settled(options: OptionSet, setting: Setting, graph: Graph) -> tuple[Floats, Floats]:
    population = Population(
        graph, options.couplings(), attention=setting.attention, inputs=_bias_inputs(options, setting)
    )
    if setting.biases:
        for _ in range(round(60.0 * setting.social_tick)):
            population.step(1.0 / setting.social_tick, "held")
    return population.z.copy(), population.u.copy()


def _choose_times(
    options: OptionSet, setting: Setting, graph: Graph, rest: tuple[Floats, Floats], option: int, raw: float
) -> tuple[float | None, float | None]:
    """Seconds until agent 0, and until all agents, have chosen `option` for good (None: never)."""
    b = _bias_inputs(options, setting)
    b[0, option] = options.options[option].utility(raw)
    population = Population(
        graph, options.couplings(), attention=setting.attention, inputs=b, z0=rest[0], u0=rest[1]
    )
    dt = 1.0 / setting.social_tick
    one: float | None = None
    every: float | None = None
    for _ in range(round(_HORIZON / dt)):
        population.step(dt, "held")
        z = population.z
        chose = (population.choices() == option) & (z[:, option] >= setting.opinion_thresh)
        one = (population.time if one is None else one) if chose[0] else None
        every = (population.time if every is None else every) if chose.all() else None
    return one, every


def reaches_at_full(options: OptionSet, setting: Setting, option: int) -> bool:
    """Whether the largest input at one agent makes all agents choose the option."""
    graph = setting.graph()
    rest = _settled(options, setting, graph)
    times = _choose_times(options, setting, graph, rest, option, options.options[option].input_max)
    return times[1] is not None


def relation(couplings: Couplings, j: int, other: int) -> str:
    """How two neighbours' opinions about option j and `other` bear on each other, from j's side (gcid.md 1)."""
    difference = couplings.heard[j, j] - couplings.heard[j, other]
    return "cooperative" if difference > 0.0 else "competitive" if difference < 0.0 else "indifferent"
