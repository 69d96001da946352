"""Theory against golden values, the numerical Jacobian, and simulation from both sides."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from opinion_engine import analysis, graphs
from opinion_engine.model import Attention, OpinionError, OpinionNetwork
from opinion_engine.simulation import simulate

CASES = [
    json.loads(p.read_text()) for p in sorted((Path(__file__).parents[1] / "data/opinion").glob("*.json"))
]
ROW_1 = {"alpha": 0.5, "beta": -0.2, "gamma": 0.3, "delta": -0.1}


def cases(kind):
    chosen = [c for c in CASES if c["kind"] == kind]
    assert chosen
    return pytest.mark.parametrize("case", chosen, ids=[c["id"] for c in chosen])


def complete(n):
    return 1.0 - np.eye(n)


def random_graph(rng, n):
    upper = np.triu(rng.random((n, n)) < 0.6, 1).astype(float)
    return upper + upper.T


# --- golden -----------------------------------------------------------------------------------


@cases("threshold")
def test_thresholds_match_the_reference_values(case):
    found = analysis.critical_attention(case["adjacency"], resistance=case["d"], **case["homogeneous"])
    expected = case["expected"]
    assert found.branch == expected["branch"]
    assert found.lambda_star == pytest.approx(expected["lambda_star"], abs=case["tolerance"])
    assert np.allclose(found.eigenvalues, sorted(expected["adjacency_eigenvalues"]), rtol=0, atol=1e-9)
    if expected["u_star"] is None:
        assert found.u_star is None
    else:
        assert found.u_star == pytest.approx(expected["u_star"], abs=case["tolerance"])
    network = OpinionNetwork.homogeneous(
        case["adjacency"], case["N_o"], resistance=case["d"], **case["homogeneous"]
    )
    values = np.sort(np.linalg.eigvals(analysis.full_jacobian(network, 0.0, 1.0)).real)
    repeated = np.sort(
        np.repeat(expected["jacobian_eigenvalues_at_u_1"], expected["eigenvalue_multiplicity"])
    )
    assert np.allclose(values, repeated, rtol=0, atol=case["tolerance"])
    general = analysis.network_threshold(network)
    assert general.u_star == (None if found.u_star is None else pytest.approx(found.u_star, abs=1e-9))


@cases("equilibrium_2opt_agreement")
def test_two_option_agreement_amplitudes_match(case):
    a, c = analysis.agreement_gains(case["N_a"] - 1, **case["homogeneous"])
    u_star = case["expected"]["u_star"]
    for row in case["expected"]["rows"]:
        x = analysis.two_option_amplitude(a, c, row["u"], case["d"])
        assert x == pytest.approx(row["x"], abs=case["tolerance"])
        assert analysis.two_option_leading_order(a, c, row["u"], u_star) == pytest.approx(
            row["x_leading_order"], abs=1e-8
        )


@cases("equilibrium_3opt_agreement")
def test_three_option_winner_and_rejected_are_stable_and_the_split_is_a_saddle(case):
    expected = case["expected"]
    u, tolerance = expected["u"], case["tolerance"]
    a, c = analysis.agreement_gains(case["N_a"] - 1, **case["homogeneous"])
    network = OpinionNetwork.homogeneous(complete(4), 3, resistance=case["d"], **case["homogeneous"])
    s = analysis.three_option_amplitude(a, c, u, case["d"])
    assert s == pytest.approx(expected["winner_s"], abs=tolerance)
    q = analysis.two_option_amplitude(a, c, u, case["d"])
    assert q == pytest.approx(expected["split_q"], abs=tolerance)
    for pattern, name, stable in (
        ([s, -s / 2, -s / 2], "winner", True),
        ([-s, s / 2, s / 2], "rejected", True),
        ([q, 0.0, -q], "split", False),
    ):
        found = analysis.find_equilibrium(network, np.tile(pattern, (4, 1)), u=u)
        assert np.allclose(found.z, pattern, rtol=0, atol=tolerance)
        assert found.eigenvalues[0].real == pytest.approx(expected[f"{name}_max_real_eig"], abs=tolerance)
        assert found.stable == stable


@cases("cascade_threshold")
def test_cascade_thresholds_match_the_formula_the_continuation_and_the_simulation(case):
    expected, tolerance = case["expected"], case["tolerance"]
    attention = Attention(**{k: v for k, v in case["attention"].items() if k != "mode"})
    n = case["N_a"]
    closed = analysis.uniform_cascade(
        n - 1, case["N_o"], attention, resistance=case["d"], **case["homogeneous"]
    )
    assert closed.b_star == pytest.approx(expected["b_star_all_agents"], abs=tolerance)
    assert closed.opinion == pytest.approx(expected["x_at_fold"], abs=tolerance)
    network = OpinionNetwork.homogeneous(complete(n), 2, resistance=case["d"], **case["homogeneous"])
    everyone = np.tile([1.0, -1.0], (n, 1))
    general = analysis.cascade_threshold(network, attention, everyone)
    assert general.b_star == pytest.approx(expected["b_star_all_agents"], abs=tolerance)
    assert general.z[0, 0] == pytest.approx(expected["x_at_fold"], abs=1e-4)
    one = np.zeros((n, 2))
    one[0] = 1.0, -1.0
    not_fired, fired = expected["b_star_single_agent_bracket"]
    single = analysis.cascade_threshold(network, attention, one)
    # The bracket was simulated for a finite time, in which inputs barely above the fold have not fired yet.
    assert not_fired * (1 - 3e-4) <= single.b_star <= fired
    for factor, name in ((0.98, "0_98"), (1.02, "1_02")):
        end = simulate(
            network, 0.0, [0.0, expected["settle_time"]], attention=attention,
            b=factor * closed.b_star * everyone, max_step=0.2,
        )  # fmt: skip
        assert end.z[-1, :, 0] == pytest.approx(expected[f"settled_first_opinion_at_{name}_b"], abs=tolerance)
        assert end.u[-1] == pytest.approx(expected[f"settled_u_at_{name}_b"], abs=tolerance)


def test_three_options_have_the_published_cascade_threshold():
    attention = Attention(tau_u=2, u_min=0.45, u_max=1, y_th=0.4, n=3)
    found = analysis.uniform_cascade(3, 3, attention, **ROW_1)
    assert found.b_star == pytest.approx(0.050287792, abs=1e-8)
    network = OpinionNetwork.homogeneous(complete(4), 3, **ROW_1)
    general = analysis.cascade_threshold(network, attention, np.tile([1.0, 0.0, 0.0], (4, 1)))
    assert general.b_star == pytest.approx(0.050287792, abs=1e-6)


@pytest.mark.parametrize(
    ("graph", "n_options", "d", "couplings", "branch", "u_star"),
    [
        (graphs.ring(6), 2, 1.0, (0.2, -0.2, 0.2, -0.2), "agreement", 0.833333333333),
        (graphs.star(7), 3, 0.8, (0.1, -0.1, 0.25, 0.0), "agreement", 0.984769995691),
        (graphs.all_to_all(8), 3, 0.25, (0.05, -0.01, 0.4, 0.0), "agreement", 0.0874125874126),
        (graphs.all_to_all(3), 2, 1.0, (-0.9, 0.3, -0.5, 0.5), "disagreement", None),
    ],
)
def test_the_published_table_of_thresholds(graph, n_options, d, couplings, branch, u_star):
    values = dict(zip(("alpha", "beta", "gamma", "delta"), couplings, strict=True))
    found = analysis.critical_attention(graph.adjacency(), resistance=d, **values)
    assert found.branch == branch
    assert found.u_star == (None if u_star is None else pytest.approx(u_star, abs=1e-12))


def test_disagreement_alternates_on_a_ring_and_a_line_agrees_unevenly():
    ring = OpinionNetwork.homogeneous(
        graphs.ring(6).adjacency(), 2, alpha=0.2, beta=-0.2, gamma=-0.2, delta=0.2
    )
    start = 0.1 * np.array([[(-1) ** i, -((-1) ** i)] for i in range(6)])
    found = analysis.find_equilibrium(ring, 10 * start, u=1.1)
    assert found.z[:, 0] == pytest.approx([1.68628666 * (-1) ** i for i in range(6)], abs=1e-7)
    line = OpinionNetwork.homogeneous(
        graphs.line(5).adjacency(), 2, alpha=0.2, beta=-0.2, gamma=0.4, delta=-0.1
    )
    found = analysis.find_equilibrium(line, np.tile([1.0, -1.0], (5, 1)), u=1.0)
    assert found.stable
    assert found.z[:, 0] == pytest.approx([0.88260, 1.25182, 1.32747, 1.25182, 0.88260], abs=1e-5)
    group = OpinionNetwork.homogeneous(complete(4), 2, alpha=0.5, beta=-0.2, gamma=-0.3, delta=0.1)
    found = analysis.find_equilibrium(group, [[1.5, -1.5], [1.5, -1.5], [-1.5, 1.5], [-1.5, 1.5]], u=1.2)
    assert found.stable
    assert np.abs(found.z[:, 0]) == pytest.approx([1.51605935] * 4, abs=1e-7)


# --- theory as properties ------------------------------------------------------------------------

couplings = st.fixed_dictionaries({name: st.floats(-1, 1) for name in ("alpha", "beta", "gamma", "delta")})


@settings(max_examples=40, deadline=None)
@given(
    couplings,
    st.integers(2, 7),
    st.integers(2, 4),
    st.floats(0.1, 3),
    st.floats(0, 3),
    st.integers(0, 2**32 - 1),
)
def test_the_formula_gives_the_eigenvalues_of_the_jacobian(values, n, n_options, d, u, seed):
    adjacency = random_graph(np.random.default_rng(seed), n)
    network = OpinionNetwork.homogeneous(adjacency, n_options, resistance=d, **values)
    numeric = np.sort(np.linalg.eigvals(analysis.full_jacobian(network, 0.0, u)).real)
    formula = analysis.neutral_eigenvalues(adjacency, u, resistance=d, **values)
    assert np.allclose(numeric, np.sort(np.repeat(formula, n_options - 1)), rtol=0, atol=1e-9)


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 5), st.integers(2, 4), st.integers(0, 2**32 - 1), st.booleans())
def test_the_jacobian_is_the_derivative_of_the_motion(n, n_options, seed, with_attention):
    rng = np.random.default_rng(seed)
    tensor = rng.normal(0, 0.5, (n, n, n_options, n_options))
    links = (rng.random((n, n)) < 0.7) + 0.0
    np.fill_diagonal(links, 1.0)
    network = OpinionNetwork(tensor, links, rng.uniform(0.3, 2, (n, n_options)))
    attention = Attention(tau_u=1.7, u_min=0.3, u_max=1.2, y_th=0.8, n=2.5) if with_attention else None
    basis = analysis.reduced_basis(network)
    r = basis.shape[1]
    w = rng.normal(size=r)
    u = rng.uniform(0.3, 1.2, n)

    def motion(state):
        z = (basis @ state[:r]).reshape(n, n_options)
        rate, y = network.derivative(z, state[r:], 0.3)
        rate_u = (attention.saturation(y) - state[r:]) / attention.tau_u if attention else np.zeros(0)
        return np.concatenate([basis.T @ rate.reshape(-1), rate_u])

    state = np.concatenate([w, u])
    size = r + n if with_attention else r
    numeric = np.empty((size, size))
    for k in range(size):
        ahead, behind = state.copy(), state.copy()
        ahead[k] += 1e-6
        behind[k] -= 1e-6
        numeric[:, k] = (motion(ahead) - motion(behind))[:size] / 2e-6
    jacobian = analysis.full_jacobian(network, (basis @ w).reshape(n, n_options), u, attention)
    assert np.allclose(jacobian, numeric, rtol=0, atol=1e-7)


@settings(max_examples=12, deadline=None)
@given(couplings, st.integers(2, 5), st.integers(2, 3), st.integers(0, 2**32 - 1))
def test_opinions_die_below_the_threshold_and_live_above_it(values, n, n_options, seed):
    rng = np.random.default_rng(seed)
    adjacency = random_graph(rng, n)
    found = analysis.critical_attention(adjacency, resistance=1.0, **values)
    assume(found.u_star is not None and found.u_star < 20.0)
    network = OpinionNetwork.homogeneous(adjacency, n_options, **values)
    shape = np.zeros(n_options)
    shape[:2] = 1.0, -1.0
    z0 = 1e-6 * np.outer(found.mode, shape) + 1e-9 * rng.normal(size=(n, n_options))
    start = np.abs(z0).max()
    below = simulate(network, z0, [0.0, 60.0], u0=0.9 * found.u_star, max_step=0.2)
    above = simulate(network, z0, [0.0, 60.0], u0=1.1 * found.u_star, max_step=0.2)
    assert np.abs(below.z[-1]).max() < 0.1 * start
    assert np.abs(above.z[-1]).max() > 10 * start


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 4), st.integers(2, 3))
def test_the_general_threshold_is_where_the_growth_rate_is_zero(seed, n, n_options):
    rng = np.random.default_rng(seed)
    tensor = rng.normal(0, 0.5, (n, n, n_options, n_options))
    network = OpinionNetwork(tensor, np.ones((n, n)), rng.uniform(0.5, 2.0, (n, n_options)))
    found = analysis.network_threshold(network)

    def growth(u):
        return np.linalg.eigvals(analysis.full_jacobian(network, 0.0, u)).real.max()

    if found.u_star is None:
        assert growth(100.0) <= 0.0
        return
    assert growth(found.u_star) == pytest.approx(0.0, abs=1e-6)
    assert all(growth(share * found.u_star) < 0.0 for share in (0.1, 0.5, 0.9, 0.99))
    assert growth(1.001 * found.u_star) > 0.0
    values = np.linalg.eigvals(analysis.full_jacobian(network, 0.0, found.u_star))
    assert found.oscillating == bool(abs(values[np.argmax(values.real)].imag) > 1e-6)


def test_a_rotating_pair_is_found_as_an_oscillation():
    # Two agents, one chasing and one fleeing: a Hopf bifurcation, where no real eigenvalue crosses.
    tensor = np.zeros((2, 2, 2, 2))
    for i, k, strength in ((0, 0, 0.5), (1, 1, 0.5), (0, 1, 2.0), (1, 0, -2.0)):
        tensor[i, k] = strength * np.eye(2)
    found = analysis.network_threshold(OpinionNetwork(tensor, np.ones((2, 2)), np.ones(2)))
    assert found.u_star == pytest.approx(2.0)
    assert found.oscillating


@settings(max_examples=8, deadline=None)
@given(st.floats(0.5, 0.95), st.floats(1.3, 3.0), st.floats(0.2, 1.0), st.integers(3, 6), st.booleans())
def test_the_cascade_threshold_is_bracketed_by_simulation(low, high, y_th, n, at_one):
    u_star = analysis.critical_attention(complete(n), **ROW_1).u_star
    attention = Attention(tau_u=1.0, u_min=low * u_star, u_max=high * u_star, y_th=y_th, n=3)
    network = OpinionNetwork.homogeneous(complete(n), 2, **ROW_1)
    pattern = np.zeros((n, 2))
    pattern[: 1 if at_one else n] = 1.0, -1.0
    found = analysis.cascade_threshold(network, attention, pattern)
    assume(found is not None)
    ends = [
        simulate(network, 0.0, [0.0, 300.0], attention=attention, b=f * found.b_star * pattern, max_step=0.2)
        for f in (0.95, 1.05)
    ]
    assert np.abs(ends[0].z[-1]).max() < np.abs(found.z).max()
    assert np.abs(ends[1].z[-1]).max() > 1.1 * np.abs(found.z).max()


def test_nothing_cascades_without_attention_above_the_threshold():
    weak = Attention(tau_u=1.0, u_min=0.1, u_max=0.2, y_th=0.4, n=3)
    network = OpinionNetwork.homogeneous(complete(4), 2, **ROW_1)
    assert analysis.cascade_threshold(network, weak, np.tile([1.0, -1.0], (4, 1))) is None
    assert analysis.uniform_cascade(3, 2, weak, **ROW_1) is None
    awake = Attention(tau_u=1.0, u_min=0.9, u_max=1.2, y_th=0.4, n=3)  # already unstable at rest
    assert analysis.cascade_threshold(network, awake, np.tile([1.0, -1.0], (4, 1))) is None


def test_the_search_finds_the_three_families_of_three_options():
    network = OpinionNetwork.homogeneous(complete(2), 3, **ROW_1)
    u_star = analysis.critical_attention(complete(2), **ROW_1).u_star
    found = analysis.equilibria(network, u=1.2 * u_star, starts=60)
    agreed = [e for e in found if np.allclose(e.z[0], e.z[1], atol=1e-6)]
    shapes = {tuple(np.sign(np.round(e.z[0], 6)).astype(int)): e.stable for e in agreed}
    for winner in ((1, -1, -1), (-1, 1, -1), (-1, -1, 1), (-1, 1, 1), (1, -1, 1), (1, 1, -1)):
        assert shapes[winner] is True
    splits = [stable for shape, stable in shapes.items() if 0 in shape and any(shape)]
    assert splits
    assert not any(splits)
    assert shapes[(0, 0, 0)] is False
    for e in found:
        rate, _ = network.derivative(e.z, e.u)
        assert np.abs(rate).max() < 1e-9


@pytest.mark.parametrize(
    ("call", "reason"),
    [
        (lambda: analysis.critical_attention(np.ones((2, 3)), **ROW_1), r"shape \(2, 3\)"),
        (lambda: analysis.critical_attention([[0, 1], [0, 0]], **ROW_1), "not symmetric"),
        (lambda: analysis.critical_attention(complete(3), resistance=-1.0, **ROW_1), "more than 0"),
        (lambda: analysis.uniform_cascade(3, 4, Attention(), **ROW_1), "2 or 3 options"),
    ],
)
def test_questions_that_make_no_sense_are_refused(call, reason):
    with pytest.raises(OpinionError, match=reason):
        call()
