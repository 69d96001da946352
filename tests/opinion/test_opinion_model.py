"""The equation against its slow twin, the order of the integrators, the invariants of theory."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opinion_engine import kernels, network_kernels
from opinion_engine.model import (
    Attention,
    Couplings,
    OpinionError,
    OpinionNetwork,
    input_value,
    strongest,
    weighted_decision,
)
from opinion_engine.simulation import simulate

ATTENTION = Attention(tau_u=2.0, u_min=0.4, u_max=1.3, y_th=0.6, n=2.0)


def random_network(rng, n, n_options, some_inactive=False):
    tensor = rng.normal(0, 0.5, (n, n, n_options, n_options))
    links = (rng.random((n, n)) < 0.7) * rng.choice([1.0, 0.5], (n, n))
    np.fill_diagonal(links, 1.0)
    active = rng.random((n, n_options)) < (0.7 if some_inactive else 2.0)
    return OpinionNetwork(tensor, links, rng.uniform(0.3, 2.0, (n, n_options)), active)


def plain_rate(network, z, u, b):
    """Paper equation (2) and y of (5), one index at a time."""
    n, n_options = z.shape
    rate, y = np.zeros_like(z), np.zeros(n)
    for i in range(n):
        on = [j for j in range(n_options) if network.active[i, j]]
        force = {}
        for j in on:
            total = 0.0
            for option in on:
                inner = sum(
                    network.tensor[i, k, j, option] * z[k, option]
                    for k in range(n)
                    if network.links[i, k] != 0.0
                )
                total += np.tanh(inner)
            force[j] = -network.resistance[i, j] * z[i, j] + u[i] * total + b[i, j]
        for j in on:
            rate[i, j] = force[j] - sum(force.values()) / len(on)
        for k in range(n):
            known = [option for option in range(n_options) if network.active[k, option]]
            if known:
                y[i] += sum((network.links[i, k] * z[k, option]) ** 2 for option in known) / len(known)
    return rate, y


def state(rng, network, size=1.0):
    z = rng.normal(0, size, (network.n_agents, network.n_options))
    for i in range(network.n_agents):
        kernels.project_active(z[i], network.active[i])
    return z


shapes = (st.integers(1, 5), st.integers(1, 5), st.integers(0, 2**32 - 1))


@settings(max_examples=40, deadline=None)
@given(*shapes, st.booleans())
def test_the_kernel_is_the_equation(n, n_options, seed, some_inactive):
    rng = np.random.default_rng(seed)
    network = random_network(rng, n, n_options, some_inactive)
    z, u, b = state(rng, network), rng.uniform(0, 2, n), rng.normal(size=(n, n_options))
    rate, y = network.derivative(z, u, b)
    expected, expected_y = plain_rate(network, z, u, b)
    assert np.allclose(rate, expected, rtol=0, atol=1e-13)
    assert np.allclose(y, expected_y, rtol=1e-13, atol=1e-13)


@settings(deadline=None)
@given(st.lists(st.floats(allow_nan=False), min_size=1, max_size=40))
def test_our_tanh_is_odd_and_accurate(values):
    x = np.array(values)
    out, mirrored = np.empty_like(x), np.empty_like(x)
    kernels.tanh_array(x, out)
    kernels.tanh_array(-x, mirrored)
    assert np.array_equal(out, -mirrored)
    assert np.all(np.abs(out - np.tanh(x)) <= 4.5e-16 * np.abs(np.tanh(x)))
    assert np.all(np.abs(out) <= 1.0)


def test_our_tanh_passes_nan_and_zero_and_agrees_uncompiled():
    x = np.concatenate([[np.nan, 0.0, -0.0, np.inf, -np.inf], np.linspace(-25, 25, 1001)])
    out = np.empty_like(x)
    kernels.tanh_array(x, out)
    assert np.isnan(out[0])
    assert out[1:5].tolist() == [0.0, 0.0, 1.0, -1.0]
    assert np.signbit(out[2])
    assert np.allclose(out[5:], np.tanh(x[5:]), rtol=4.5e-16, atol=0)


@settings(deadline=None)
@given(st.floats(-30, 30), st.floats(-30, 30))
def test_the_difference_of_two_hyperbolic_tangents_is_theirs_and_exactly_odd(x, y):
    for a, b in ((x, y), (1e-3 * x, 1e-3 * y), (x, x + 1e-9 * y)):
        found = kernels.tanh_difference(a, b)
        assert abs(found - (np.tanh(a) - np.tanh(b))) <= 4.5e-16
        assert kernels.tanh_difference(b, a) == -found == kernels.tanh_difference(-a, -b)


def test_the_difference_of_hyperbolic_tangents_of_anything_is_bounded_or_not_a_number():
    wild = [0.0, -0.0, 5e-324, -1e-300, 19.9, -20.1, 710.0, 1e308, np.inf, -np.inf]
    for a in wild:
        for b in wild:
            assert abs(kernels.tanh_difference(a, b) - (np.tanh(a) - np.tanh(b))) <= 4.5e-16
        assert np.isnan(kernels.tanh_difference(a, np.nan))
        assert np.isnan(kernels.tanh_difference(np.nan, a))


@settings(deadline=None)
@given(st.floats(0, 1e300), st.floats(0.01, 10), st.floats(0, 10), st.floats(1e-6, 1e6), st.floats(0.1, 8))
def test_attention_saturates_between_its_limits_without_overflow(y, u_min, extra, y_th, n):
    attention = Attention(u_min=u_min, u_max=u_min + extra, y_th=y_th, n=n)
    level = float(attention.saturation(y))
    assert u_min <= level <= (u_min + extra) * (1 + 1e-15)
    assert kernels.hill(y, u_min, u_min + extra, y_th, n) == pytest.approx(level, rel=1e-13)
    assert float(attention.saturation(0.0)) == u_min
    assert float(attention.saturation(np.inf)) == pytest.approx(u_min + extra)


@settings(deadline=None)
@given(st.floats(1e-3, 1e3), st.floats(0.5, 4))
def test_the_slope_of_the_saturation_is_its_derivative(y, n):
    attention = Attention(u_min=0.5, u_max=2.0, y_th=3.0, n=n)
    h = 1e-5 * y
    numeric = (attention.saturation(y + h) - attention.saturation(y - h)) / (2 * h)
    assert attention.saturation_slope(y) == pytest.approx(numeric, rel=1e-4, abs=1e-9)


def test_the_network_integrator_has_order_four():
    rng = np.random.default_rng(7)
    network = random_network(rng, 4, 3)
    z0, b = state(rng, network), rng.normal(size=(4, 3))
    times = [0.0, 2.0]
    exact = simulate(network, z0, times, attention=ATTENTION, b=b, max_step=1e-3)

    def run(h):
        z, u = z0.copy(), np.full(4, ATTENTION.u_min)
        rows = np.tile(ATTENTION.row, (4, 1))
        network_kernels.network_rk4(
            z, u, 2.0, round(2.0 / h), network._kernel_tensor, network.links, network.resistance, b,
            network.active, rows, True,
        )  # fmt: skip
        return max(np.abs(z - exact.z[-1]).max(), np.abs(u - exact.u[-1]).max())

    errors = [run(h) for h in (0.1, 0.05, 0.025)]
    for coarse, fine in itertools.pairwise(errors):
        assert 3.7 < np.log2(coarse / fine) < 4.4


def test_the_agent_integrator_has_order_four():
    rng = np.random.default_rng(3)
    couplings = Couplings(rng.uniform(0.2, 0.4, 3), rng.normal(0, 0.2, (3, 3)), rng.normal(0, 0.3, (3, 3)))
    heard, b, on = rng.normal(size=3), 0.1 * rng.normal(size=3), np.ones(3, bool)
    start = rng.normal(size=3) * 0.2

    def run(dt):
        z, u = start.copy(), 0.5
        kernels.project_active(z, on)
        for _ in range(round(4.0 / dt)):
            u = kernels.agent_step(
                z, u, dt, couplings.resistance, couplings.own, couplings.heard, heard, 0.3, b, on,
                50.0, 0.4, 1.3, 0.6, 2.0,
            )  # fmt: skip
        return np.append(z, u)

    exact = run(1e-3)
    errors = [np.abs(run(dt) - exact).max() for dt in (0.08, 0.04)]  # one sub-step each
    assert 3.6 < np.log2(errors[0] / errors[1]) < 4.5


def end_of(network, z0, b, *, attention=ATTENTION, u0=None, t=3.0, max_step=0.05):
    motion = simulate(network, z0, [0.0, t], attention=attention, u0=u0, b=b, max_step=max_step)
    return motion.z[-1], motion.u[-1]


@settings(max_examples=20, deadline=None)
@given(*shapes, st.booleans())
def test_rows_sum_to_zero_inactive_options_stay_zero_and_attention_stays_inside(
    n, n_options, seed, some_inactive
):
    rng = np.random.default_rng(seed)
    network = random_network(rng, n, n_options, some_inactive)
    z, u = end_of(network, 5 * rng.normal(size=(n, n_options)), 3 * rng.normal(size=(n, n_options)))
    assert np.all(np.abs(z.sum(axis=1)) < 1e-12 * n_options)
    assert np.all(z[~network.active] == 0.0)
    assert np.all((u >= ATTENTION.u_min) & (u <= ATTENTION.u_max))


@settings(max_examples=20, deadline=None)
@given(*shapes)
def test_renaming_options_or_agents_renames_the_result(n, n_options, seed):
    rng = np.random.default_rng(seed)
    network = random_network(rng, n, n_options)
    z0, b = state(rng, network), rng.normal(size=(n, n_options))
    who, what = rng.permutation(n), rng.permutation(n_options)
    renamed = OpinionNetwork(
        network.tensor[np.ix_(who, who, what, what)], network.links[np.ix_(who, who)],
        network.resistance[np.ix_(who, what)],
    )  # fmt: skip
    z, u = end_of(network, z0, b)
    other, other_u = end_of(renamed, z0[np.ix_(who, what)], b[np.ix_(who, what)])
    assert np.allclose(z[np.ix_(who, what)], other, rtol=0, atol=1e-11)
    assert np.allclose(u[who], other_u, rtol=0, atol=1e-11)


@settings(max_examples=20, deadline=None)
@given(*shapes, st.floats(0.3, 3.0))
def test_scaling_resistance_attention_and_input_scales_time(n, n_options, seed, s):
    rng = np.random.default_rng(seed)
    network = random_network(rng, n, n_options)
    z0, b, u = state(rng, network), rng.normal(size=(n, n_options)), rng.uniform(0.2, 1.0, n)
    faster = OpinionNetwork(network.tensor, network.links, s * network.resistance)
    z, _ = end_of(network, z0, b, attention=None, u0=u, t=2.0 * s, max_step=0.01 * s)
    other, _ = end_of(faster, z0, s * b, attention=None, u0=s * u, t=2.0, max_step=0.01)
    assert np.allclose(z, other, rtol=0, atol=1e-7)


@settings(max_examples=20, deadline=None)
@given(*shapes)
def test_negating_opinions_and_inputs_negates_the_motion_and_nothing_stays_nothing(n, n_options, seed):
    rng = np.random.default_rng(seed)
    network = random_network(rng, n, n_options)
    z0, b = state(rng, network), rng.normal(size=(n, n_options))
    z, u = end_of(network, z0, b)
    mirrored, mirrored_u = end_of(network, -z0, -b)
    assert np.array_equal(z, -mirrored)
    assert np.array_equal(u, mirrored_u)
    nothing, rest = end_of(network, 0.0, 0.0)
    assert np.all(nothing == 0.0)
    assert np.all(rest == ATTENTION.u_min)


agents = st.tuples(st.integers(1, 5), st.integers(0, 2**32 - 1))


def random_agent(rng, n):
    return (
        rng.normal(size=n), rng.uniform(0.4, 1.3), rng.uniform(0.2, 1.0, n), rng.normal(0, 0.5, (n, n)),
        rng.normal(0, 0.5, (n, n)), rng.normal(size=n), rng.uniform(0, 2), rng.normal(size=n),
    )  # fmt: skip


@pytest.mark.parametrize(
    "step", [kernels.agent_step, kernels.agent_step_reference], ids=["paper", "reference"]
)
@settings(max_examples=60, deadline=None)
@given(agents)
def test_one_agent_keeps_the_invariants_in_both_variants(step, drawn):
    n, seed = drawn
    rng = np.random.default_rng(seed)
    z, u, d, own, heard, total, square, b = random_agent(rng, n)
    on = np.ones(n, bool)
    kernels.project_active(z, on)
    tail = (2.0, 0.4, 1.3, 0.6, 2.0)

    def advance(z, total, b, rename=None):
        pick = np.arange(n) if rename is None else rename
        out = z[pick].copy()
        level = step(
            out, u, 0.3, d[pick], np.ascontiguousarray(own[np.ix_(pick, pick)]),
            np.ascontiguousarray(heard[np.ix_(pick, pick)]), total[pick], square, b[pick], on, *tail,
        )  # fmt: skip
        return out, level

    after, level = advance(z, total, b)
    assert abs(after.sum()) < 1e-12 * n
    assert 0.4 <= level <= 1.3
    mirrored, mirrored_level = advance(-z, -total, -b)
    assert np.array_equal(after, -mirrored)
    assert level == mirrored_level
    order = rng.permutation(n)
    renamed, _ = advance(z, total, b, order)
    assert np.allclose(after[order], renamed, rtol=0, atol=1e-12)
    zero = np.zeros(n)
    quiet, _ = advance(zero, zero, zero)
    assert np.all(quiet == 0.0)


@pytest.mark.slow
def test_the_zero_sum_does_not_drift_in_a_million_steps():
    rng = np.random.default_rng(0)
    network = random_network(rng, 3, 4)
    z, u = state(rng, network, 3.0), np.full(3, ATTENTION.u_min)
    rows = np.tile(ATTENTION.row, (3, 1))
    b = rng.normal(size=(3, 4))
    for _ in range(10):  # 10 times 100 000 steps
        network_kernels.network_rk4(
            z, u, 1000.0, 100_000, network._kernel_tensor, network.links, network.resistance, b,
            network.active, rows, True,
        )  # fmt: skip
        assert np.abs(z.sum(axis=1)).max() < 4e-12


def test_a_graph_and_inputs_may_change_with_time():
    pair = 1.0 - np.eye(2)
    network = OpinionNetwork.homogeneous(pair, 2, alpha=0.2, beta=-0.2, gamma=0.5, delta=-0.5)
    cut = network.with_links(np.zeros((2, 2)))
    z0 = [[1.0, -1.0], [0.0, 0.0]]
    motion = simulate([(0.0, cut), (5.0, network)], z0, [0, 5, 6], u0=1.0)
    assert np.all(motion.z[1, 1] == 0.0)
    assert motion.z[2, 1, 0] > 0.0
    pushed = simulate(cut, 0.0, [0, 5, 10], u0=0.1, b=[(5.0, [[1.0, -1.0], [0.0, 0.0]])])
    assert np.all(pushed.z[1] == 0.0)
    assert pushed.z[2, 0, 0] > 0.5
    assert np.all(pushed.z[2, 1] == 0.0)


def test_heterogeneous_agents_follow_their_own_couplings():
    stubborn = Couplings.homogeneous(2, alpha=0, beta=0, gamma=0, delta=0)
    eager = Couplings.homogeneous(2, alpha=0, beta=0, gamma=1.0, delta=-1.0)
    network = OpinionNetwork.from_couplings(1.0 - np.eye(2), [stubborn, eager])
    motion = simulate(network, 0.0, [0, 40], u0=1.0, b=[[0.5, -0.5], [0, 0]])
    assert motion.z[-1, 0, 0] == pytest.approx(0.5, abs=1e-9)
    assert motion.z[-1, 1, 0] == pytest.approx(2 * np.tanh(0.5), abs=1e-9)


EYE2 = np.eye(2)


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda: OpinionNetwork(np.zeros((2, 3, 2, 2)), EYE2), r"shape \(2, 3, 2, 2\)"),
        (lambda: OpinionNetwork(np.zeros((2, 2, 2)), EYE2), r"expected \(N_a, N_a, N_O, N_O\)"),
        (lambda: OpinionNetwork(np.full((2, 2, 2, 2), np.nan), EYE2), r"tensor\[0, 0, 0, 0\] is nan"),
        (lambda: OpinionNetwork(np.zeros((2, 2, 2, 2)), np.ones((3, 3))), "links has shape"),
        (lambda: OpinionNetwork(np.zeros((2, 2, 2, 2)), -EYE2), "negative"),
        (lambda: OpinionNetwork(np.zeros((2, 2, 2, 2)), np.zeros((2, 2))), "diagonal of abar"),
        (
            lambda: OpinionNetwork(np.zeros((2, 2, 2, 2)), EYE2, np.array([1.0, -0.5])),
            r"resistance\[1, 0\] is -0.5",
        ),
        (
            lambda: OpinionNetwork(np.zeros((2, 2, 2, 2)), EYE2, np.ones(2), np.ones((2, 3), bool)),
            "active has",
        ),
        (lambda: OpinionNetwork.homogeneous(EYE2, 2, alpha=0, beta=0, gamma=0, delta=0), "self-loops"),
        (lambda: Couplings(np.ones(2), np.zeros((2, 2)), np.zeros((3, 3))), "heard couplings has shape"),
        (
            lambda: Couplings(np.array([1.0, 0.0]), np.zeros((2, 2)), np.zeros((2, 2))),
            r"resistance\[1\] is 0",
        ),
        (lambda: Attention(tau_u=0.0), "tau_u is 0"),
        (lambda: Attention(u_min=2.0, u_max=1.0), "u_max is 1, expected at least u_min, 2"),
        (lambda: Attention(n=float("nan")), "n is nan"),
        (lambda: strongest([0.0, float("nan")]), "NaN"),
        (lambda: strongest([1.0], [False]), "no option is active"),
        (lambda: strongest([]), "expected"),
        (lambda: weighted_decision([1], [[1, 1]], [1, 1], np.zeros((3, 4))), r"A_c has shape \(1, 2\)"),
    ],
)
def test_what_cannot_be_a_model_is_refused_with_one_line(make, reason):
    with pytest.raises(OpinionError, match=reason) as caught:
        make()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"z0": np.zeros((3, 2))}, "z0 has shape"),
        ({"z0": [[np.nan, 0], [0, 0]]}, r"z0\[0, 0\] is nan"),
        ({"t": [0, 2, 1]}, "ascending"),
        ({"t": []}, "ascending"),
        ({"u0": None}, "needs u0"),
        ({"b": [[np.inf, 0], [0, 0]]}, r"b\[0, 0\] is inf"),
        ({"max_step": 0.0}, "max_step"),
        ({"attention": [ATTENTION]}, "1 attention parameters for 2"),
    ],
)
def test_a_simulation_that_makes_no_sense_is_refused(change, reason):
    network = OpinionNetwork.homogeneous(1.0 - np.eye(2), 2, alpha=0, beta=0, gamma=0, delta=0)
    values = {"z0": 0.0, "t": [0, 1], "u0": 1.0, **change}
    with pytest.raises(OpinionError, match=reason):
        simulate(network, values.pop("z0"), values.pop("t"), **values)


@settings(deadline=None)
@given(st.floats(-1e3, 1e3), st.floats(-100, 99), st.floats(0.1, 50), st.sampled_from(["none", "quadratic"]))
def test_inputs_stay_within_their_gain(raw, low, gain, shape):
    b = input_value(raw, low, 100.0, gain, shape)
    assert -gain * (1 + 1e-15) <= b <= gain * (1 + 1e-15)
    assert shape == "none" or b >= 0.0


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda: OpinionNetwork([[1, 2], [3]], np.eye(3)), "coupling tensor must be numbers of shape"),
        (lambda: Couplings([1.0], [["x"]], [[0.0]]), "own couplings must be numbers"),
        (lambda: Couplings.homogeneous(-1, alpha=1, beta=0, gamma=0, delta=0), "at least one option"),
        (lambda: Couplings.homogeneous(3, alpha="x", beta=0, gamma=0, delta=0), "alpha is 'x'"),
        (lambda: Couplings.homogeneous(3, alpha=1, beta=0, gamma=np.nan, delta=0), "gamma is nan"),
        (lambda: Attention(n="x"), "attention n is 'x'"),
        (lambda: Attention(tau_u=None), "attention tau_u is None"),
        (lambda: input_value(float("nan"), 0.0, 1.0), "raw input is nan"),
    ],
)
def test_values_that_are_no_numbers_are_refused_with_one_line(make, reason):
    with pytest.raises(OpinionError, match=reason) as refused:
        make()
    assert "\n" not in str(refused.value)
