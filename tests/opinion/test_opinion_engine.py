"""One agent's engine: against the golden steps, and against a hostile network."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opinion_engine import messages, neighbours
from opinion_engine.engine import EngineSettings, OpinionEngine
from opinion_engine.model import Attention, OpinionError
from opinion_engine.option_file import Condition, Option, OptionSet

DATA = Path(__file__).parents[1] / "data/opinion"
STEPS = [json.loads((DATA / name).read_text()) for name in ("case_042.json", "case_044.json")]


def option(name, conditions=(), **values):
    return Option(
        name=name,
        outputs=(("OPTION", name.upper()),),
        input_variable=f"{name.upper()}_INPUT",
        function_type="none",
        social_mode="custom",
        conditions=tuple(Condition(v, w) for v, w in conditions),
        **{"input_min": -100.0, "resistance": 0.25, "alpha": 0.05, **values},
    )


def fleet(conditions=(), gain=40.0):
    def others(name, value):
        return tuple((o, value) for o in ("exploit", "explore", "migrate") if o != name)

    return OptionSet(
        (
            option(
                "exploit",
                conditions,
                beta=others("exploit", -0.01),
                gamma=-0.05,
                delta=others("exploit", 0.01),
            ),
            option(
                "explore",
                conditions,
                beta=others("explore", -0.01),
                gamma=-0.05,
                delta=others("explore", 0.01),
            ),
            option("migrate", conditions, alpha=1.0, gamma=8.0, input_gain=gain),
        )
    )


MISSION_ATTENTION = Attention(tau_u=4.0, u_min=0.5, u_max=2.0, y_th=2000.0, n=2.0)


def engine(options=None, **values):
    return OpinionEngine(
        "abe", options or fleet(), EngineSettings(attention=MISSION_ATTENTION, **values), 0.0
    )


@pytest.mark.parametrize("case", STEPS, ids=lambda c: c["id"])
def test_the_reference_variant_takes_the_reference_steps(case):
    options = OptionSet(
        tuple(
            option(
                name,
                resistance=o["d"],
                alpha=o["alpha"],
                beta=tuple(o["beta"].items()),
                gamma=o["gamma"],
                delta=tuple(o["delta"].items()),
                input_min=o["lo"],
                input_max=o["hi"],
                input_gain=o["gain"],
            )
            for name, o in ((n, case["options"][n]) for n in case["order"])
        )
    )
    attention = Attention(**case["attention"])
    agent = OpinionEngine(
        case["vname"],
        options,
        EngineSettings(
            group=case["group"],
            attention=attention,
            stale=case["stale_thresh"],
            model="reference",
            alpha_as_configured=not case["alpha_forced_to_1"],
        ),
        case["t0"],
    )
    for step, expected in zip(case["script"], case["expected"], strict=True):
        for name, raw in step["raw"].items():
            agent.take(f"{name.upper()}_INPUT", raw)
        for sent in step.get("messages", ()):
            text = messages.format_text(
                sent["from"], "leader", list(sent["opinions"]), list(sent["opinions"].values())
            )
            assert agent.receive(text, sent["t"])
        update = agent.update(step["t"])
        assert update.z == pytest.approx(expected["z"], abs=case["tolerance"])
        assert update.u == pytest.approx(expected["u"], abs=case["tolerance"])
        assert update.text == expected["message"]


def paper_oracle(options, attention, z, u, heard, square, b, dt, steps=1500):
    """The same update by many tiny Euler-corrected (midpoint) steps in plain numpy."""
    couplings = options.couplings()
    h = dt / steps

    def rate(z, u):
        pairs = np.tanh(couplings.own * z + couplings.heard * heard)
        force = -couplings.resistance * z + u * pairs.sum(axis=1) + b
        y = np.mean(z**2) + square
        return force - force.mean(), (attention.saturation(y) - u) / attention.tau_u

    for _ in range(steps):
        dz, du = rate(z, u)
        dz, du = rate(z + h / 2 * dz, u + h / 2 * du)
        z, u = z + h * dz, u + h * du
    return z, u


@settings(max_examples=8, deadline=None)
@given(
    st.lists(st.floats(-20, 20), min_size=3, max_size=3),
    st.lists(st.floats(-100, 100), min_size=3, max_size=3),
    st.floats(0.3, 3.0),
)
def test_the_paper_variant_integrates_accurately(said, raw, dt):
    options = fleet()
    agent = OpinionEngine(
        "abe", options, EngineSettings(attention=MISSION_ATTENTION, social_tick=4.0, max_dt=5.0), 0.0
    )
    names = options.names
    for name, value in zip(names, raw, strict=True):
        agent.take(f"{name.upper()}_INPUT", value)
    agent.receive(messages.format_text("ben", "leader", names, said), dt)
    heard = np.round(said, 4)
    update = agent.update(dt)
    z, u = paper_oracle(
        options, MISSION_ATTENTION, np.zeros(3), 0.5, heard, np.mean(heard**2), np.array(agent.inputs), dt
    )
    assert np.allclose(update.z, z, rtol=0, atol=2e-5)
    assert update.u == pytest.approx(u, abs=2e-5)


def test_the_result_does_not_depend_on_how_often_it_is_updated():
    coarse, fine = (
        OpinionEngine(
            "abe", fleet(), EngineSettings(attention=MISSION_ATTENTION, social_tick=s, stale=100.0), 0.0
        )
        for s in (0.5, 50.0)
    )
    for agent in (coarse, fine):
        agent.take("EXPLORE_INPUT", 60.0)
        agent.take("MIGRATE_INPUT", 5.0)
        agent.receive("ben:leader:exploit=1:explore=-3:migrate=2", 0.0)
    for k in range(1, 11):
        a = coarse.update(2.0 * k)
        for i in range(1, 101):
            b = fine.update(2.0 * (k - 1) + i / 50)
    assert a.z == pytest.approx(b.z, abs=1e-5)
    assert a.u == pytest.approx(b.u, abs=1e-5)


def test_nothing_happens_before_the_social_tick():
    agent = engine()
    assert agent.update(0.5) is None
    assert agent.update(1.0) is not None
    assert agent.update(1.5) is None
    assert agent.update(0.2) is None
    assert agent.update(2.0) is not None


def test_a_long_pause_is_integrated_only_up_to_the_cap_by_the_paper_variant():
    agent = engine()
    assert agent.update(60.0).dt == 3.0
    assert agent.counters.capped == 1
    reference = engine(model="reference")
    assert reference.update(60.0).dt == 60.0


def test_unknown_inputs_mean_no_bias_whatever_the_range():
    options = OptionSet((option("a", input_min=0.0), option("b", input_min=0.0)))
    agent = engine(options)
    assert agent.inputs == (0.0, 0.0)
    agent.take("A_INPUT", 0.0)
    assert agent.inputs == (-1.0, 0.0)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), "west", None])
def test_an_input_that_is_no_number_is_refused_and_the_last_one_stays(value):
    agent = engine()
    agent.take("EXPLORE_INPUT", 50.0)
    with pytest.raises(OpinionError, match="EXPLORE_INPUT"):
        agent.take("EXPLORE_INPUT", value)
    assert agent.inputs == (0.0, 0.5, 0.0)
    assert agent.counters.bad_inputs == 1


def test_outputs_are_posted_on_change_and_stay_latched_while_undecided():
    agent = engine(OptionSet(tuple(option(n, alpha=0.0) for n in ("exploit", "explore", "migrate"))))
    assert agent.update(1.0).choice is None
    agent.take("EXPLORE_INPUT", 100.0)
    posted = [agent.update(float(t)).postings for t in range(2, 8)]
    assert [p for p in posted if p] == [(("OPTION", "EXPLORE"),)]
    agent.take("EXPLORE_INPUT", 0.0)
    updates = [agent.update(float(t)) for t in range(8, 60)]
    assert updates[-1].choice is None
    assert all(u.postings == () for u in updates)
    agent.take("EXPLORE_INPUT", 100.0)
    assert all(agent.update(float(t)).postings == () for t in range(60, 64))
    agent.take("EXPLORE_INPUT", 0.0)
    agent.take("MIGRATE_INPUT", 100.0)
    assert (("OPTION", "MIGRATE"),) in [agent.update(float(t)).postings for t in range(64, 70)]


def test_ties_go_to_the_first_option():
    agent = engine(OptionSet((option("b"), option("a"))))
    agent.take("B_INPUT", 0.0)
    three = engine(OptionSet((option("c"), option("a"), option("b"))))
    three.take("C_INPUT", 50.0)
    three.take("B_INPUT", 50.0)
    assert three.update(1.0).choice == 0


def test_an_option_that_becomes_inactive_is_neutral_at_once_and_the_rest_stay_centred():
    agent = engine(fleet([("DEPLOY", "true")]))
    assert agent.update(1.0) is None
    agent.take("DEPLOY", "TRUE")
    agent.take("MIGRATE_INPUT", 50.0)
    assert agent.update(2.0) is not None
    agent.take("DEPLOY", "false")
    assert agent.z == (0.0, 0.0, 0.0)
    assert agent.update(3.0) is None
    agent.take("DEPLOY", 1.0)  # a number is not the string
    assert agent.active == (False, False, False)
    part = OpinionEngine(
        "abe", OptionSet((option("a"), option("b", [("B", "yes")]), option("c"))), EngineSettings(), 0.0
    )
    part.take("A_INPUT", 100.0)
    part.take("B", "yes")
    part.take("B_INPUT", 50.0)
    part.update(1.0)
    part.take("B", "no")
    assert part.z[1] == 0.0
    assert part.z[0] == -part.z[2] != 0.0
    assert part.update(2.0).text.count("=") == 2


def test_a_period_without_active_options_does_not_become_one_long_step():
    agent = engine(fleet([("DEPLOY", "true")]))
    for t in range(1, 60):
        assert agent.update(float(t)) is None
    agent.take("DEPLOY", "true")
    assert agent.update(60.0).dt == 1.0


def test_a_reset_forgets_everything_and_is_deaf_for_five_seconds():
    agent = engine()
    agent.take("MIGRATE_INPUT", 100.0)
    agent.receive("ben:leader:exploit=-1:explore=-1:migrate=2", 0.9)
    assert agent.update(1.0).postings
    assert agent.list_changes(1.0) == (("MIGRATE_LIST", "ben"),)
    agent.reset(1.5)
    assert agent.z == (0.0, 0.0, 0.0)
    assert agent.u == 0.5
    assert agent.list_changes(1.6) == (("MIGRATE_LIST", ""),)
    assert not agent.receive("ben:leader:migrate=2", 6.4)
    assert agent.update(6.4) is None
    assert agent.receive("ben:leader:migrate=2", 6.5)
    again = agent.update(6.5)
    assert again.dt == 1.0
    assert again.postings == (("OPTION", "MIGRATE"),)


def test_one_s_own_and_outdated_messages_are_ignored():
    agent = engine()
    assert not agent.receive("ABE:leader:migrate=5", 1.0)
    assert agent.receive("ben:leader:migrate=5", 1.0)
    assert not agent.receive("ben:leader:migrate=-5", 1.5, time=0.5)
    assert agent.counters.own == agent.counters.outdated == 1
    assert agent.population(1.0)["migrate"] == ("ben",)


def test_lists_hold_fresh_neighbours_by_dominant_option():
    agent = engine()
    for text in (
        "ben:g:explore=1",
        "cal:g:exploit=3:explore=-3",
        "deb:g:migrate=0.05",
        "eve:g",
        "fin:g:other=9",
    ):
        assert agent.receive(text, 0.0)
    agent.receive("gil:g:explore=2", 0.5)
    assert agent.list_changes(1.0) == (
        ("EXPLOIT_LIST", "cal"),
        ("EXPLORE_LIST", "ben,gil"),
        ("UNDECIDED_LIST", "deb"),
    )
    assert agent.list_changes(1.0) == ()
    agent.receive("ben:g", 1.9)  # an empty record changes nothing about the list but is a sign of life
    assert agent.list_changes(2.0) == (("EXPLOIT_LIST", ""), ("UNDECIDED_LIST", ""))
    assert agent.population(2.6)["explore"] == ("ben",)


def test_a_vanished_neighbour_is_forgotten_within_the_stale_time():
    lone, left = engine(), engine()
    left.receive("ben:leader:exploit=0:explore=0:migrate=100", 3.0)
    for t in (1.0, 2.0, 3.0, 4.0, 5.0):
        left.update(t)
        lone.update(t)
    assert left._heard_square > 0.0  # 5.0 - 3.0 is still fresh
    assert left.update(6.0) is not None
    assert left._heard_square == 0.0
    assert left._heard_sum.tolist() == [0.0, 0.0, 0.0]


def test_a_neighbour_contributes_nothing_to_options_it_does_not_know():
    agent = engine()
    agent.receive("ben:leader:migrate=6:other=-6", 1.0)
    agent.update(1.0)
    assert agent._heard_sum.tolist() == [0.0, 0.0, 6.0]
    assert agent._heard_square == 36.0


@pytest.mark.parametrize(("encoding", "size"), [("i8", 3), ("i16", 6), ("f32", 12)])
def test_binary_opinions_cost_3_6_and_12_bytes_a_second_and_are_understood(encoding, size):
    speaker, hearer = engine(encoding=encoding), engine()
    speaker.take("MIGRATE_INPUT", 30.0)
    for t in range(1, 31):
        update = speaker.update(float(t))
        assert len(update.payload) == size
        assert hearer.receive(update.payload, float(t), sender="ben")
        hearer.update(float(t))
    assert speaker.bytes_per_second(30.0) == pytest.approx(size)
    assert hearer._heard_of.z[0] == pytest.approx(update.z, rel=0.035, abs=0.4)
    assert not hearer.receive(update.payload, 31.0)
    assert "names no community" in hearer.counters.last_rejection


def test_memory_for_neighbours_is_bounded(monkeypatch):
    monkeypatch.setattr(neighbours, "MAX_NEIGHBOURS", 20)
    agent = engine()
    for k in range(40):
        agent.receive(f"v{k}:g:migrate=1", 1.0)
    assert len(agent.neighbours) == 20
    assert agent.counters.overflow == 20
    assert agent.receive("late:g:migrate=1", 10.0)
    assert len(agent.neighbours) == 20
    assert agent.population(10.0)["migrate"] == ("late",)


message_texts = st.one_of(
    st.builds(
        lambda v, values: f"{v}:g:" + ":".join(f"{n}={x}" for n, x in values),
        st.sampled_from(["ben", "cal", "ABE", "abe", ""]),
        st.lists(
            st.tuples(
                st.sampled_from(["exploit", "explore", "migrate", "other", ""]),
                st.one_of(st.floats(-1e9, 1e9), st.sampled_from([float("nan"), 1e300, "x"])),
            ),
            max_size=5,
        ),
    ),
    st.text(max_size=30),
    st.binary(max_size=14),
)
events = st.lists(
    st.one_of(
        st.tuples(st.just("message"), message_texts, st.floats(-5, 5)),
        st.tuples(
            st.just("input"), st.sampled_from(["EXPLORE_INPUT", "MIGRATE_INPUT"]), st.floats(-200, 200)
        ),
        st.tuples(st.just("condition"), st.sampled_from(["true", "false"]), st.none()),
        st.tuples(st.just("reset"), st.none(), st.none()),
        st.tuples(st.just("step"), st.floats(0.0, 10.0), st.none()),
    ),
    max_size=40,
)


@pytest.mark.parametrize("model", ["paper", "reference"])
@settings(max_examples=120, deadline=None)
@given(script=events)
def test_no_stream_of_messages_breaks_the_engine(model, script):
    options = fleet()
    options = OptionSet((*options.options[:2], option("migrate", [("GO", "true")], alpha=1.0, gamma=8.0)))
    agent = engine(options, model=model)
    now = 0.0
    for kind, value, extra in script:
        if kind == "message":
            agent.receive(value, now, sender="dan", time=now + extra)
        elif kind == "input":
            agent.take(value, extra)
        elif kind == "condition":
            agent.take("GO", value)
        elif kind == "reset":
            agent.reset(now)
        else:
            now += value
        agent.update(now)
        agent.list_changes(now)
        z = np.array(agent.z)
        assert np.all(np.isfinite(z))
        assert 0.5 <= agent.u <= 2.0
        if model == "paper":
            assert abs(z.sum()) <= 1e-12 * 3 * max(1.0, np.abs(z).max())
            assert agent.active[2] or z[2] == 0.0
            assert (
                np.abs(z).max() <= (40.0 + 2.0 * 3) / 0.25
            )  # inputs and saturated couplings bound the opinions


@settings(deadline=None)
@given(st.permutations(range(6)))
def test_the_order_of_arrival_of_timed_messages_does_not_matter(order):
    stream = [(f"ben:g:migrate={k}:explore={-k}", 0.1 * k) for k in range(6)]
    agent = engine()
    for k in order:
        agent.receive(stream[k][0], 1.0, time=stream[k][1])
        agent.receive(stream[k][0], 1.0, time=stream[k][1])
    agent.update(1.0)
    assert agent._heard_sum.tolist() == [0.0, -5.0, 5.0]


@pytest.mark.parametrize(
    "values",
    [
        {"stale": 0.0},
        {"opinion_thresh": -1.0},
        {"max_dt": float("nan")},
        {"model": "other"},
        {"encoding": "i32"},
        {"group": "a:b"},
        {"social_tick": 0.0},
    ],
)
def test_settings_out_of_range_are_refused(values):
    with pytest.raises(OpinionError):
        EngineSettings(**values)


def test_an_opinion_is_fresh_from_its_arrival_on_and_ordered_by_its_sending():
    agent = engine()
    late = "ben:leader:explore=1.0000:exploit=-0.5000:migrate=-0.5000"
    assert agent.receive(late, 10.0, time=7.0), "three seconds on its way"
    assert [n.name for n in agent.neighbours if 10.0 - n.time <= agent.settings.stale] == ["ben"]
    assert not agent.receive(late, 10.5, time=6.5), "overtaken by the one before"
    assert agent.receive(late, 11.0, time=8.0)
    assert agent.counters.outdated == 1
