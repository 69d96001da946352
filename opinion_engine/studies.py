"""The computations behind the figures: sweeps of simulations next to what the theory predicts.

Each function gives the finished matplotlib figure; `plots` draws, `theory` and `analysis` predict, `model`
and `population` simulate.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from opinion_engine import analysis, graphs, plots, theory
from opinion_engine.graphs import Graph
from opinion_engine.model import Attention, Couplings, Floats, OpinionNetwork
from opinion_engine.population import Population
from opinion_engine.scenario import FleetHistory, fleet_story
from opinion_engine.simulation import simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# The couplings of the worked example in gcid.md 3, four agents that all hear each other.
EXAMPLE = {"alpha": 0.5, "beta": -0.2, "gamma": 0.3, "delta": -0.1}
EXAMPLE_AGENTS = 4
EXAMPLE_ATTENTION = Attention(tau_u=2.0, u_min=0.45, u_max=1.0, y_th=0.4, n=3.0)
# Disagreement on a ring of six.
RIVALS = {"alpha": 0.2, "beta": -0.2, "gamma": -0.2, "delta": 0.2}
# A coupling strong enough to carry a cascade through a line.
SPREADING = {"alpha": 0.2, "beta": -0.2, "gamma": 0.4, "delta": -0.4}


def simplex_study(story: FleetHistory | None = None, seed: int = 1) -> Figure:
    """Trajectories of a fleet's three opinions on the simplex, at the paper's zoom."""
    story = story or fleet_story(seed)
    return plots.simplex_figure(story.z, story.names, story.options)


def attention_study(story: FleetHistory | None = None, seed: int = 1) -> Figure:
    """Attention and number of vessels heard of the same fleet."""
    story = story or fleet_story(seed)
    return plots.attention_figure(story.t, story.u, story.degree, story.names)


def _ends(
    network: OpinionNetwork, u_star: float, levels: Floats, starts: int, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Where simulations from random small states end: (u, first opinions of all agents) as flat lists."""
    us, xs = [], []
    for u in levels:
        patience = float(np.clip(150.0 / abs(u / u_star - 1.0), 200.0, 3000.0))  # all is slow near u*
        for _ in range(starts):
            z0 = 0.3 * rng.normal(size=(network.n_agents, network.n_options))
            end = simulate(network, z0, [0.0, patience], u0=u, max_step=0.25).z[-1]
            us += [u] * network.n_agents
            xs += end[:, 0].tolist()
    return np.array(us), np.array(xs)


def pitchfork_study(seed: int = 1, points: int = 15, starts: int = 3) -> Figure:
    """Agreement, disagreement, three options, and the fold under attention feedback: predicted and simulated.

    Simulated at `points` attentions, `starts` times each (twice as often for three options).
    """
    rng = np.random.default_rng(seed)
    made, axes = plots.figure(9.2, 7.6, 2, 2)
    n = EXAMPLE_AGENTS
    complete = 1.0 - np.eye(n)
    a, c = theory.agreement_gains(n - 1, **EXAMPLE)
    u_star = theory.critical_attention(complete, **EXAMPLE).u_star
    assert u_star is not None
    fine, coarse = np.linspace(u_star, 2.0 * u_star, 200), np.linspace(0.55, 1.95, points) * u_star
    x = np.array([theory.two_option_amplitude(a, c, u) for u in fine])
    leading = np.array([theory.two_option_leading_order(a, c, u, u_star) for u in fine])
    below, above = np.linspace(0.5 * u_star, u_star, 2), np.linspace(u_star, 2.0 * u_star, 2)
    neutral = [(below, np.zeros(2), True), (above, np.zeros(2), False)]
    two = OpinionNetwork.homogeneous(complete, 2, **EXAMPLE)
    plots.pitchfork_panel(
        axes[0, 0], "agreement, two options, 4 agents", [*neutral, (fine, x, True), (fine, -x, True)],
        _ends(two, u_star, coarse, starts, rng), u_star, (fine, leading),
    )  # fmt: skip
    axes[0, 0].set_ylabel("opinion about option 1")
    made.legend(loc="outside lower center", ncols=4, fontsize=9, frameon=False)

    ring = graphs.ring(6).adjacency()
    six = OpinionNetwork.homogeneous(ring, 2, **RIVALS)
    ring_star = theory.critical_attention(ring, **RIVALS).u_star
    assert ring_star is not None
    fine_ring = np.linspace(ring_star, 2.0 * ring_star, 120)
    gains = theory.agreement_gains(-2, **RIVALS)  # both neighbours think the opposite
    x = np.array([theory.two_option_amplitude(*gains, u) for u in fine_ring])
    below, above = np.linspace(0.5 * ring_star, ring_star, 2), np.linspace(ring_star, 2.0 * ring_star, 2)
    plots.pitchfork_panel(
        axes[0, 1], "disagreement, two options, ring of 6",
        [(below, np.zeros(2), True), (above, np.zeros(2), False), (fine_ring, x, True), (fine_ring, -x, True)],
        _ends(six, ring_star, np.linspace(0.55, 1.95, points) * ring_star, starts, rng), ring_star,
    )  # fmt: skip

    three = OpinionNetwork.homogeneous(complete, 3, **EXAMPLE)
    s = np.array([theory.three_option_amplitude(a, c, u) for u in fine])
    q = np.array([theory.two_option_amplitude(a, c, u) for u in fine])
    branches = [*neutral, (fine, s, True), (fine, -s / 2, True), (fine, -s, True), (fine, s / 2, True)]
    plots.pitchfork_panel(
        axes[1, 0], "agreement, three options: winner, rejected, split (saddle)",
        [*branches, (fine, q, False), (fine, -q, False)], _ends(three, u_star, coarse, 2 * starts, rng), u_star,
    )  # fmt: skip
    axes[1, 0].set_ylabel("opinion about option 1")
    _fold(axes[1, 1], two)
    return made


def _fold(axis: object, network: OpinionNetwork) -> None:
    """Equilibria against a common input under attention feedback, with the implicit threshold b*."""
    a, c = theory.agreement_gains(EXAMPLE_AGENTS - 1, **EXAMPLE)
    attention, n = EXAMPLE_ATTENTION, EXAMPLE_AGENTS
    found = theory.uniform_cascade(n - 1, 2, attention, **EXAMPLE)
    assert found is not None
    x = np.concatenate([np.linspace(0.0, 0.6, 600), np.linspace(0.6, 1.9, 400)[1:]])
    h = x - attention.saturation(n * x * x) * (np.tanh(a * x) - np.tanh(c * x))
    stable = np.append(np.diff(h) > 0.0, True)
    shown = (h >= 0.0) & (h <= 2.0 * found.b_star)
    everyone = np.tile([1.0, -1.0], (n, 1))
    levels = np.concatenate([np.linspace(0.0, 0.98, 9), np.linspace(1.02, 1.9, 8)]) * found.b_star
    ends = [
        simulate(network, 0.0, [0.0, 400.0], attention=attention, b=b * everyone, max_step=0.2).z[-1, 0, 0]
        for b in levels
    ]
    line = (np.where(shown, h, np.nan), np.where(shown, x, np.nan), stable.astype(float))
    plots.fold_panel(axis, line, (levels, np.array(ends)), (found.b_star, found.opinion))
    axis.set_title("cascade: attention feedback makes a threshold for the input", fontsize=10)  # type: ignore[attr-defined]


def basin_study(seed: int = 1, resolution: int = 100) -> Figure:
    """Which end a start leads to: two agents and two options, cooperating and competing; three options
    agreed.
    """
    made, axes = plots.figure(11.4, 4.0, 1, 3)
    pair = 1.0 - np.eye(2)
    rivals = {**EXAMPLE, "gamma": -0.3, "delta": 0.1}
    for axis, couplings, title in (
        (axes[0], EXAMPLE, "cooperation"),
        (axes[1], rivals, "competition"),
    ):
        network = OpinionNetwork.homogeneous(pair, 2, **couplings)
        u_star = theory.critical_attention(pair, **couplings).u_star
        assert u_star is not None
        u, extent = 1.5 * u_star, 2.2
        grid = np.linspace(-extent, extent, resolution)
        off = grid + 0.37 * (grid[1] - grid[0])  # the diagonals belong to no basin
        start = np.array([[[[x, -x], [y, -y]] for x in grid] for y in off]).reshape(-1, 2, 2)
        ends = _many(network, u, start)[:, :, 0]
        label = np.where(ends[:, 0] > 0, 0, 1) + np.where(ends[:, 0] * ends[:, 1] < 0, 2, 0)
        label = np.where(np.abs(ends).max(axis=1) < 0.2, -1, label)
        found = analysis.equilibria(network, u=u, starts=150, seed=seed)
        marks = [(float(e.z[0, 0]), float(e.z[1, 0]), e.stable) for e in found]
        plots.basin_panel(axis, extent, label.reshape(resolution, resolution).astype(float), marks)
        axis.set_title(f"two agents, two options: {title}", fontsize=10)
        axis.set_xlabel("opinion of agent 1")
        axis.set_ylabel("opinion of agent 2")
    complete = 1.0 - np.eye(EXAMPLE_AGENTS)
    threshold = theory.critical_attention(complete, **EXAMPLE).u_star
    assert threshold is not None
    a, c = theory.agreement_gains(EXAMPLE_AGENTS - 1, **EXAMPLE)
    one = OpinionNetwork.from_couplings(
        np.zeros((1, 1)), Couplings.homogeneous(3, alpha=a, beta=c, gamma=0.0, delta=0.0)
    )
    low = -1.6
    triples, inside, box = plots.simplex_pixels(low, resolution)
    ends = _many(one, 1.5 * threshold, triples[inside][:, None, :])[:, 0]
    winner, rejected = np.argmax(ends, axis=1), np.argmin(ends, axis=1)
    label = np.where(ends.max(axis=1) > -ends.min(axis=1), winner, 3 + rejected)
    picture = np.full(inside.shape, -1.0)
    picture[inside] = label
    plots.simplex_basin_panel(axes[2], low, box, picture, ("option 1", "option 2", "option 3"))
    for e in analysis.equilibria(one, u=1.5 * threshold, starts=150, seed=seed):
        place = plots.on_simplex(e.z[0])
        axes[2].plot(
            *place,
            "o",
            color="black" if e.stable else "white",
            markeredgecolor="black",
            markersize=6.0,
            zorder=3,
        )
    axes[2].set_title("one of three options wins\nor is rejected (4 agents agreed)", fontsize=10)
    return made


def _many(network: OpinionNetwork, u: float, starts: Floats) -> Floats:
    """Where each of many starts (K, N, N_O) ends, as disjoint copies of the network in one population."""
    k, n, n_o = starts.shape
    links = np.argwhere((network.links > 0) & ~np.eye(n, dtype=bool))
    shift = np.arange(k)[:, None] * n
    graph = graphs.from_links(k * n, (links[:, 0] + shift).ravel(), (links[:, 1] + shift).ravel())
    heard = network.tensor[0, 1] if n > 1 else np.zeros((n_o, n_o))
    couplings = Couplings(network.resistance[0], network.tensor[0, 0], heard)
    population = Population(graph, couplings, u0=u, z0=starts.reshape(k * n, n_o))
    for _ in range(240):
        population.step(0.25, "euler")
    return population.z.reshape(k, n, n_o)


def cascade_runs(seed: int = 1) -> list[tuple[str, Graph, Floats, Floats]]:
    """One agent is told something on a line, a ring and a random geometric graph: (title, graph, t, x)."""
    rng = np.random.default_rng(seed)
    scattered = _largest_part(graphs.random_geometric(240, 7.0, rng))
    runs = []
    for title, graph in (
        ("line", graphs.line(40)),
        ("ring", graphs.ring(40)),
        ("random geometric", scattered),
    ):
        threshold = theory.critical_attention(graph.adjacency(), **SPREADING).u_star
        assert threshold is not None
        attention = Attention(tau_u=4.0, u_min=0.7 * threshold, u_max=1.6, y_th=0.3, n=3.0)
        assert graph.positions is not None
        middle = graph.positions.mean(axis=0)
        source = 0 if title == "line" else int(np.argmin(np.linalg.norm(graph.positions - middle, axis=1)))
        b = np.zeros((graph.n_agents, 2))
        b[source] = 1.0, -1.0
        couplings = Couplings.homogeneous(2, **SPREADING)
        population = Population(graph, couplings, attention=attention, inputs=b)
        result = population.run(800, 0.25, "held")
        runs.append((title, graph, result.t, result.z[:, :, 0]))
    return runs


def cascade_study(seed: int = 1) -> Figure:
    """Contact sheet of a cascade on a line, a ring and a random geometric graph."""
    return plots.cascade_sheet(cascade_runs(seed))


def _largest_part(graph: Graph) -> Graph:
    """The largest connected part of an undirected graph, with its positions."""
    label = np.arange(graph.n_agents)
    hearer, heard = graph.hearers().astype(int), graph.indices.astype(int)
    while True:
        lower = label.copy()
        np.minimum.at(lower, hearer, label[heard])
        if np.array_equal(lower, label):
            break
        label = lower
    keep = np.nonzero(label == np.bincount(label).argmax())[0]
    rank = np.full(graph.n_agents, -1)
    rank[keep] = np.arange(keep.size)
    inside = (rank[hearer] >= 0) & (rank[heard] >= 0)
    assert graph.positions is not None
    return graphs.from_links(keep.size, rank[hearer[inside]], rank[heard[inside]], graph.positions[keep])
