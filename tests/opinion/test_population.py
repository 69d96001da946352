"""Populations against the dense network, boats with engines, and themselves on other threads."""

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opinion_engine import gather_kernels, graphs, kernels, population_kernels
from opinion_engine.graphs import Graph
from opinion_engine.model import Attention, Couplings, OpinionError, OpinionNetwork
from opinion_engine.population import Links, Population
from opinion_engine.simulation import simulate

ATTENTION = Attention(tau_u=2.0, u_min=0.45, u_max=1.0, y_th=0.4, n=2.0)
UNIFORM = {"alpha": 0.5, "beta": -0.2, "gamma": 0.3, "delta": -0.1}


def uniform(n_options=3, **changes):
    return Couplings.homogeneous(n_options, **{**UNIFORM, **changes})


def random_couplings(rng, n_options):
    return Couplings(
        rng.uniform(0.3, 2.0, n_options), rng.normal(0, 0.4, (n_options, n_options)),
        rng.normal(0, 0.3, (n_options, n_options)),
    )  # fmt: skip


def plain_rate(graph, couplings, z, u, b, attention):
    """The equation agent by agent and option by option."""
    n, n_o = z.shape
    rate, rate_u = np.zeros_like(z), np.zeros(n)
    for i in range(n):
        row = graph.indices[graph.indptr[i] : graph.indptr[i + 1]]
        heard = z[row].sum(axis=0)
        c = couplings[i]
        force = np.empty(n_o)
        for j in range(n_o):
            total = sum(np.tanh(c.own[j, m] * z[i, m] + c.heard[j, m] * heard[m]) for m in range(n_o))
            force[j] = -c.resistance[j] * z[i, j] + u[i] * total + b[i, j]
        rate[i] = force - force.mean()
        y = np.mean(z[i] ** 2) + sum(np.mean(z[k] ** 2) for k in row)
        rate_u[i] = (attention.saturation(y) - u[i]) / attention.tau_u
    return rate, rate_u


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 40), st.integers(1, 9), st.integers(0, 2**32 - 1), st.booleans(), st.booleans())
def test_an_euler_step_is_the_plain_equation(n, n_options, seed, same, equal):
    rng = np.random.default_rng(seed)
    graph = graphs.random_pairs(n, rng.uniform(0, 6), rng)
    z0 = rng.normal(size=(n, n_options))
    z0 -= z0.mean(axis=1, keepdims=True)
    b = rng.normal(size=(n, n_options))
    u0 = rng.uniform(0.45, 1.0, n)
    kinds = rng.integers(0, 3, n)
    if same:
        couplings = uniform(n_options) if equal else random_couplings(rng, n_options)
        each = [couplings] * n
        population = Population(graph, couplings, attention=ATTENTION, inputs=b, z0=z0, u0=u0)
    else:
        three = [random_couplings(rng, n_options) for _ in range(3)]
        each = [three[k] for k in kinds]
        population = Population(graph, three, attention=ATTENTION, inputs=b, z0=z0, u0=u0, kinds=kinds)
    rate, rate_u = plain_rate(graph, each, z0, u0, b, ATTENTION)
    population.step(0.01, "euler")
    assert np.allclose(population.z, z0 + 0.01 * rate, rtol=0, atol=1e-14)
    assert np.allclose(population.u, np.clip(u0 + 0.01 * rate_u, 0.45, 1.0), rtol=0, atol=1e-14)


@settings(max_examples=10, deadline=None)
@given(st.integers(1, 12), st.integers(2, 4), st.integers(0, 2**32 - 1), st.booleans())
def test_coupled_runge_kutta_follows_the_dense_network(n, n_options, seed, some_inactive):
    rng = np.random.default_rng(seed)
    graph = graphs.random_pairs(n, 3, rng)
    couplings = random_couplings(rng, n_options)
    active = rng.random((n, n_options)) < 0.7 if some_inactive else None
    z0, b = rng.normal(size=(n, n_options)), rng.normal(size=(n, n_options))
    population = Population(graph, couplings, attention=ATTENTION, inputs=b, z0=z0, active=active)
    network = OpinionNetwork.from_couplings(graph.adjacency(), couplings, active=active)
    result = population.run(20, 0.1, "rk4", record_every=10)
    motion = simulate(network, z0, [0.0, 1.0, 2.0], attention=ATTENTION, b=b)
    assert np.allclose(result.z, motion.z, rtol=0, atol=1e-5)
    assert np.allclose(result.u, motion.u, rtol=0, atol=1e-5)


@pytest.mark.parametrize("method", ["held", "reference"])
def test_a_population_is_a_fleet_of_engines(method):
    rng = np.random.default_rng(3)
    n = 9
    graph = graphs.random_pairs(n, 3, rng)
    couplings = random_couplings(rng, 3)
    b = rng.normal(size=(n, 3))
    population = Population(graph, couplings, attention=ATTENTION, inputs=b, z0=0.1 * rng.normal(size=(n, 3)))
    z, u = population.z.copy(), population.u.copy()
    on = np.ones(3, bool)
    tail = (b, on, *ATTENTION.row)
    step = kernels.agent_step if method == "held" else kernels.agent_step_reference
    for _ in range(30):
        before = z.copy()
        for i in range(n):
            row = graph.indices[graph.indptr[i] : graph.indptr[i + 1]]
            heard, square = before[row].sum(axis=0), np.mean(before[row] ** 2, axis=1).sum()
            own = z[i].copy()
            u[i] = step(
                own, u[i], 0.5, couplings.resistance, couplings.own, couplings.heard, heard, square,
                tail[0][i], *tail[1:],
            )  # fmt: skip
            z[i] = own
        population.step(0.5, method)
    assert np.allclose(population.z, z, rtol=0, atol=1e-6 if method == "held" else 1e-12)
    assert np.allclose(population.u, u, rtol=0, atol=1e-6 if method == "held" else 1e-12)


@pytest.mark.parametrize("n_options", [2, 3, 4, 9])
def test_the_result_does_not_depend_on_the_number_of_threads(n_options):
    def end_state(threads):
        rng = np.random.default_rng(1)
        numba.set_num_threads(threads)
        try:
            graph = graphs.random_pairs(17000, 8, rng)
            population = Population(
                graph, uniform(n_options), attention=ATTENTION, inputs=rng.normal(size=(17000, n_options)),
                z0=rng.normal(size=(17000, n_options)),
            )  # fmt: skip
            for method in ("held", "euler", "rk4"):
                population.step(0.3, method)
            return population.z.copy(), population.u.copy()
        finally:
            numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)

    many = min(4, numba.config.NUMBA_NUM_THREADS)
    for one, other in zip(end_state(1), end_state(many), strict=True):
        assert np.array_equal(one, other)


def test_the_one_loop_for_three_options_gives_the_bits_of_the_general_path():
    rng = np.random.default_rng(8)
    graph = graphs.random_pairs(700, 6, rng)
    b, z0 = rng.normal(size=(700, 3)), 2 * rng.normal(size=(700, 3))
    population = Population(
        graph, uniform(), attention=ATTENTION, inputs=b, z0=z0, u0=rng.uniform(0.45, 1.0, 700)
    )
    z, u = population.z.copy(), population.u.copy()
    rates, rate_u = population._states(1)[0], np.empty(700)
    population._sweep(
        population_kernels.EULER,
        0.3,
        1,
        True,
        population._lag,
        population._ring,
        population._head,
        u,
        rates,
        rate_u,
    )
    population.step(0.3, "euler")
    ahead = z + 0.3 * rates[:-1, :3]
    third = 1.0 / 3.0
    ahead -= ((ahead[:, 0] + ahead[:, 1] + ahead[:, 2]) * third)[:, None]
    assert np.array_equal(population.z, ahead)
    assert np.array_equal(population.u, np.clip(u + 0.3 * rate_u, 0.45, 1.0))
    squares = ahead[:, 0] ** 2 + ahead[:, 1] ** 2 + ahead[:, 2] ** 2
    assert np.array_equal(population._ring[population._head][:-1, 3], squares * third)


@pytest.mark.parametrize("n_options", [3, 6])
@pytest.mark.parametrize("n", [1, 7, 8, 250, 256, 257, 600])
def test_agents_summed_side_by_side_get_the_bits_of_the_walk_along_the_rows(n, n_options):
    rng = np.random.default_rng(n)
    graph = graphs.random_pairs(n, min(8, n - 1), rng)
    z0 = rng.normal(size=(n, n_options))
    ends = []
    for rows_only in (False, True):
        population = Population(graph, uniform(n_options), attention=ATTENTION, z0=z0)
        assert population._layout[0].size == (n + 255) // 256 * 32 + 1
        if rows_only:
            population._layout = (np.empty(0, np.int64), np.empty(0, np.uint32), np.empty(0, np.uint8))
        for method in ("held", "euler", "rk4"):
            population.step(0.3, method)
        ends.append((population.z.copy(), population.u.copy()))
    assert np.array_equal(ends[0][0], ends[1][0])
    assert np.array_equal(ends[0][1], ends[1][1])


def test_links_side_by_side_are_the_links_of_the_graph():
    graph = graphs.random_pairs(1000, 8, np.random.default_rng(4))
    starts, slots, places = gather_kernels.side_by_side(graph.indptr, graph.indices)
    assert sorted(places[:256]) == list(range(256))
    for p in range(1024):
        agent = p // 256 * 256 + int(places[p])
        column = slots[starts[p // 8] : starts[p // 8 + 1]].reshape(-1, 8)[:, p % 8]
        own = graph.indices[graph.indptr[agent] : graph.indptr[agent + 1]] if agent < 1000 else column[:0]
        assert np.array_equal(column[: own.size], own)
        assert np.all(column[own.size :] == 1000)  # the row of zeros


def test_a_hub_that_all_hear_does_not_make_the_layout_grow():
    assert gather_kernels.side_by_side(*_parts(graphs.star(100_000)))[1].size == 0
    assert gather_kernels.side_by_side(*_parts(graphs.ring(100_000)))[1].size < 210_000


def _parts(graph):
    return graph.indptr, graph.indices


def test_serial_and_parallel_sweeps_give_the_same_bits(monkeypatch):
    rng = np.random.default_rng(5)
    graph = graphs.random_pairs(5000, 8, rng)
    z0, b = rng.normal(size=(5000, 3)), rng.normal(size=(5000, 3))
    ends = []
    for limit in (10**9, 0):
        monkeypatch.setattr("opinion_engine.population._PARALLEL_FROM", limit)
        population = Population(graph, uniform(), attention=ATTENTION, inputs=b, z0=z0)
        population.step(0.3)
        ends.append(population.z.copy())
    assert np.array_equal(ends[0], ends[1])


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_renaming_the_agents_renames_the_result(seed):
    rng = np.random.default_rng(seed)
    graph = graphs.random_pairs(30, 4, rng)
    order = rng.permutation(30)
    z0 = rng.normal(size=(30, 3))
    one = Population(graph, uniform(), attention=ATTENTION, z0=z0)
    other = Population(graph.relabelled(order), uniform(), attention=ATTENTION, z0=z0[order])
    for _ in range(5):
        one.step(0.2)
        other.step(0.2)
    assert np.allclose(one.z[order], other.z, rtol=0, atol=1e-12)


def test_the_zero_sum_does_not_drift():
    rng = np.random.default_rng(2)
    population = Population(graphs.ring(3), uniform(), attention=ATTENTION, z0=rng.normal(size=(3, 3)))
    for _ in range(20000):
        population.step(0.1, "euler")
    assert np.abs(population.z.sum(axis=1)).max() < 3e-12


def test_lost_messages_leave_the_last_one_in_force_until_it_is_stale():
    graph = graphs.from_links(2, [0], [1])  # agent 0 hears agent 1
    couplings = Couplings.homogeneous(2, alpha=0, beta=0, gamma=1.0, delta=-1.0)
    make = lambda **how: Population(  # noqa: E731
        graph, couplings, u0=1.0, z0=[[0, 0], [5, -5]], inputs=[[0, 0], [5, -5]], links=Links(**how), seed=1
    )
    heard, cut, never, late = make(), make(stale=3), make(loss=1.0), make(delay=(2, 2))
    first = [(p.step(0.1, "euler"), p.z[0, 0])[1] for p in (heard, cut, never, late)]
    assert first[0] == first[1] > 0.0
    assert first[2] == first[3] == 0.0  # nothing has arrived, or been said two steps ago
    for _ in range(2):
        late.step(0.1, "euler")
    assert late.z[0, 0] > 0.0
    cut.set_silent([False, True])
    values = [(cut.step(0.1, "euler"), cut.z[0, 0])[1] for _ in range(6)]
    assert first[1] < values[0] < values[1] < values[2]  # three steps on what was heard last
    assert values[2] > values[3] > values[4]
    assert cut.run(0, 0.1).mean_heard[0] == 0.0
    cut.set_silent(None)
    cut.step(0.1, "euler")
    assert cut.z[0, 0] > values[5]


def test_losses_repeat_from_their_seed_and_differ_between_seeds():
    rng = np.random.default_rng(0)
    graph = graphs.random_pairs(50, 5, rng)
    z0 = rng.normal(size=(50, 3))

    def end(seed):
        p = Population(
            graph, uniform(), attention=ATTENTION, z0=z0, links=Links(loss=0.5, delay=(0, 3)), seed=seed
        )
        p.run(20, 0.5)
        return p.z.copy()

    assert np.array_equal(end(1), end(1))
    assert not np.array_equal(end(1), end(2))


def test_a_graph_may_change_between_steps():
    connected, alone = graphs.line(4), graphs.from_links(4, [], [])
    z0 = np.array([[1.0, -1.0], [0, 0], [0, 0], [0, 0]])
    population = Population(alone, uniform(2), u0=0.9, z0=z0)
    heard = []

    def before(p):
        p.set_graph(connected if p.steps >= 5 else alone)
        heard.append(p.graph.n_links)

    result = population.run(10, 0.5, before_step=before)
    assert heard == [0] * 5 + [6] * 5
    assert np.all(result.z[5, 1:] == 0.0)
    assert np.all(result.z[10, 1:3, 0] > 0.0)
    assert result.mean_heard[-1] == 1.5


def test_run_records_shares_attention_and_the_agents_observed():
    rng = np.random.default_rng(0)
    graph = graphs.ring(100)
    b = np.zeros((100, 3))
    b[:, 1] = 1.0
    told = []
    population = Population(
        graph, uniform(), attention=ATTENTION, inputs=b, z0=1e-3 * rng.normal(size=(100, 3))
    )
    result = population.run(
        40, 0.5, record_every=10, observe=[0, 7], progress=lambda done, total: told.append((done, total))
    )
    assert result.t.tolist() == pytest.approx([0, 5, 10, 15, 20])
    assert result.z.shape == (5, 2, 3)
    assert result.shares[-1].tolist() == [0.0, 1.0, 0.0]
    assert result.mean_attention[0] == pytest.approx(0.45)
    assert result.mean_attention[-1] > 0.9
    assert told[0] == (1, 40)
    assert told[-1] == (40, 40)
    assert population.run(1, 0.5, progress=True).t.size == 2


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"z0": np.zeros((3, 3))}, r"z0 has shape \(3, 3\)"),
        ({"inputs": np.full((4, 3), np.nan)}, r"inputs\[0, 0\] is nan"),
        ({"kinds": np.zeros(4, int)}, "kinds need a list"),
        ({"attention": None}, "needs u0"),
        ({"u0": -0.1}, "expected attention of at least 0"),
        ({"attention": [ATTENTION, ATTENTION]}, "2 attention parameters for 1"),
        ({"active": np.ones((4, 2))}, "active has shape"),
        ({"couplings": [uniform(), uniform(2)]}, "same number of options"),
        ({"couplings": [uniform(), uniform()]}, "several couplings need kinds"),
        ({"couplings": [uniform(), uniform()], "kinds": [0, 1, 2, 0]}, "from 0 to 1"),
    ],
)
def test_a_population_that_does_not_fit_together_is_refused(change, reason):
    values = {"couplings": uniform(), "attention": ATTENTION, **change}
    with pytest.raises(OpinionError, match=reason):
        Population(graphs.ring(4), values.pop("couplings"), **values)


def test_steps_that_make_no_sense_are_refused():
    population = Population(graphs.ring(4), uniform(), u0=1.0, links=Links())
    for dt in (0.0, -1.0, float("nan")):
        with pytest.raises(OpinionError, match="dt is"):
            population.step(dt)
    with pytest.raises(OpinionError, match="none of rk4"):
        population.step(0.1, "midpoint")
    with pytest.raises(OpinionError, match="need method held"):
        population.step(0.1, "rk4")
    with pytest.raises(OpinionError, match="probability"):
        Links(loss=1.5)


# --- graphs -----------------------------------------------------------------------------------


def test_named_graphs_have_the_eigenvalues_of_the_theory():
    for graph, largest, smallest in (
        (graphs.all_to_all(6), 5.0, -1.0),
        (graphs.ring(6), 2.0, -2.0),
        (graphs.star(7), 6**0.5, -(6**0.5)),
        (graphs.line(5), 2 * np.cos(np.pi / 6), 2 * np.cos(5 * np.pi / 6)),
    ):
        values = np.linalg.eigvalsh(graph.adjacency())
        assert values[-1] == pytest.approx(largest)
        assert values[0] == pytest.approx(smallest)


def test_random_graphs_have_about_the_mean_degree_and_repeat_from_their_seed():
    for make in (graphs.random_pairs, graphs.random_geometric):
        graph = make(4000, 8, np.random.default_rng(1))
        again = make(4000, 8, np.random.default_rng(1))
        assert np.array_equal(graph.indices, again.indices)
        assert 7.0 < graph.n_links / 4000 < 8.5
        dense = graph.adjacency()
        assert np.array_equal(dense, dense.T)


def test_a_local_order_brings_neighbours_together_and_keeps_the_graph():
    rng = np.random.default_rng(0)
    graph = graphs.random_geometric(2000, 6, rng)
    order = rng.permutation(2000)
    shuffled = graph.relabelled(order)
    for candidate in (shuffled, Graph(shuffled.indptr, shuffled.indices)):
        local = candidate.relabelled(candidate.local_order())
        distance = lambda g: np.abs(g.hearers().astype(int) - g.indices.astype(int)).mean()  # noqa: E731
        assert distance(local) < 0.2 * distance(candidate)
        assert sorted(local.degrees) == sorted(graph.degrees)


@pytest.mark.parametrize(
    ("indptr", "indices", "reason"),
    [
        ([0, 1], [0], "self-loops"),
        ([0, 1, 1], [2], "leads to agent 2"),
        ([0, 2, 1], [1], "must rise"),
        ([0, 1, 2], [1], "must rise"),
        ([0], [], r"N > 0"),
        ([0, 1, 1], [-1], "at least 0"),
    ],
)
def test_graphs_that_are_none_are_refused(indptr, indices, reason):
    with pytest.raises(OpinionError, match=reason):
        Graph(np.array(indptr), np.array(indices, dtype=int))


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda rng: graphs.from_dense([[0, np.nan], [1, 0]]), r"adjacency\[0, 1\] is nan"),
        (lambda rng: graphs.from_dense("x"), "adjacency must be numbers"),
        (lambda rng: graphs.star(0), "at least 1 agent, not 0"),
        (lambda rng: graphs.line(-1), "at least 1 agent, not -1"),
        (lambda rng: graphs.random_pairs(10, -1.0, rng), "mean_degree is -1"),
        (lambda rng: graphs.random_geometric(10, np.nan, rng), "mean_degree is nan"),
    ],
)
def test_graphs_that_cannot_be_made_are_refused(make, reason):
    with pytest.raises(OpinionError, match=reason):
        make(np.random.default_rng(0))
