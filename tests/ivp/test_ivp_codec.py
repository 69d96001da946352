"""The text form and its packets: the reference's texts, round trips, and damaged input."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ivp_helm.ivp import Domain, IvPError, IvPFunction, Joiner, decode, encode, join_packets, split_packets
from ivp_helm.ivp import testing as ivp

DATA = Path(__file__).parents[1] / "data" / "ivp"
CASES = json.loads((DATA / "encoding.json").read_text())["cases"]
GOOD = "H,3,1:a,1,2,0,100,D,speed;0;4;21,G,20,F,0,12,10.,13,20,30."


@pytest.mark.parametrize("case", CASES, ids=lambda c: c["id"])
def test_measured_texts_decode_to_the_measured_values_and_encode_back(case: dict[str, Any]) -> None:
    f = decode(case["encoded"])
    expected = case["decoded"]
    assert f.context == expected["context"]
    assert f.weight == expected["pwt"]
    assert [edge - 1 for edge in f.grid] == expected["gel"]
    assert f.domain is Domain.parse(expected["domain"])
    assert (f.pieces, f.degree) == (expected["pieces"], expected["degree"])
    np.testing.assert_allclose([f.minimum, f.maximum], expected["minmax"], rtol=1e-9, atol=1e-9)
    values = [np.nan if v is None else v for v in case["values"]]
    np.testing.assert_allclose(f.evaluate(case["points"]), values, rtol=1e-9, atol=1e-9)
    assert encode(f) == case.get("reencoded", case["encoded"])


@pytest.mark.parametrize("case", [c for c in CASES if c.get("packets")], ids=lambda c: c["id"])
def test_measured_packets_are_reproduced_and_joined_in_any_order(case: dict[str, Any]) -> None:
    text = case.get("reencoded", case["encoded"])
    packets = split_packets(text, case["packet_id"], case["packet_size"])
    assert packets == case["packets"]
    assert all(len(p) <= case["packet_size"] for p in packets)
    assert join_packets(packets) == text
    assert join_packets(packets[::-1]) == text


def slow_weight(w: float) -> str:
    """The weight format, by the rules of ivp_math.md 9.1 one after the other."""
    if w == 0:
        return "0"
    n = int(abs(w) * 10000 + 0.5)
    whole, rest = divmod(n, 10000)
    if n == 0:
        text = "0.0000"
    elif rest == 0:
        text = f"{whole}."
    else:
        text = f"{whole}.{rest:04d}".rstrip("0")
    return "-" + text if w < 0 else text


@given(st.lists(st.floats(-1e9, 1e9) | st.floats(-1e-3, 1e-3), min_size=1, max_size=20))
@settings(max_examples=200, deadline=None)
def test_weights_are_written_by_the_rules(weights: list[float]) -> None:
    domain = Domain.parse(f"x,0,{len(weights)},{len(weights) + 1}")
    at = np.arange(len(weights))[:, None]
    f = IvPFunction(domain, at, at, np.array(weights)[:, None])
    body = encode(f).split(",F,")[1].split(",")
    assert body[2::3] == [slow_weight(w) for w in weights]


@given(ivp.problems(max_functions=1, weights=(0.0, 0.5, 33.33333, 100.0)), st.text("abc :^_|", max_size=9))
@settings(max_examples=150, deadline=None)
def test_what_is_decoded_is_what_was_encoded_to_four_decimals(
    problem: tuple[Domain, list[IvPFunction]], context: str
) -> None:
    f = problem[1][0].labelled(context)
    g = decode(encode(f))
    assert (g.domain, g.degree, g.grid, g.weight, g.context) == (
        f.domain,
        f.degree,
        f.grid,
        f.weight,
        context,
    )
    np.testing.assert_array_equal(g.low, f.low)
    np.testing.assert_array_equal(g.high, f.high)
    np.testing.assert_allclose(g.coefficients, f.coefficients, rtol=0, atol=5.0000001e-5)
    assert decode(encode(g)).coefficients.tolist() == g.coefficients.tolist()


@given(ivp.problems(max_functions=1, weights=(10.0,)), st.integers(55, 300), st.randoms())
@settings(max_examples=50, deadline=None)
def test_packets_of_any_size_in_any_order_make_up_the_text(
    problem: tuple[Domain, list[IvPFunction]], size: int, random: Any
) -> None:
    text = encode(problem[1][0])
    packets = split_packets(text, "b^1", size)
    random.shuffle(packets)
    assert join_packets(packets) == text


def test_numbers_in_any_usual_form_are_read() -> None:
    f = decode(GOOD.replace("10.", "1e1").replace("30.", ".5"))
    assert f.coefficients[:, -1].tolist() == [10.0, 0.5]
    assert decode(GOOD.replace("10.", "+10")).value(0.0) == 10.0


def test_a_wrong_context_length_falls_back_to_the_next_comma() -> None:
    assert decode(GOOD.replace("H,3,", "H,77,")).context == "1:a"


def test_exclusive_bounds_become_inclusive_ones() -> None:
    f = decode(GOOD.replace("0,12", "0,X13"))
    assert f.high[0, 0] == 12
    assert decode(GOOD.replace("0,12", "X0,12")).low[0, 0] == 1


DAMAGED = {
    "a fifth decimal": GOOD.replace("10.", "10.12345"),
    "a truncated body": GOOD[:-4],
    "a missing piece": GOOD.replace("1,2,0,100", "1,3,0,100"),
    "a header alone": "H,3,1:a,1,2",
    "another letter": GOOD.replace("H,", "Q,", 1),
    "nothing": "",
    "an empty domain": GOOD.replace("speed;0;4;21", ""),
    "a reversed domain": GOOD.replace("speed;0;4;21", "speed;4;0;21"),
    "reversed bounds": GOOD.replace("0,12", "12,0"),
    "a piece outside the domain": GOOD.replace("13,20", "13,21"),
    "a weight that is no number": GOOD.replace("10.", "nan"),
    "an infinite weight": GOOD.replace("10.", "inf"),
    "an overflowing weight": GOOD.replace("10.", "1e999"),
    "an infinite priority": GOOD.replace(",100,", ",1e999,"),
    "a negative priority": GOOD.replace(",100,", ",-1,"),
    "a wrong number of variables": GOOD.replace("1:a,1,", "1:a,2,"),
    "degree two": GOOD.replace("2,0,100", "2,2,100"),
    "no pieces": "H,0,,1,0,0,100,D,speed;0;4;21,G,20,F,",
    "a grid cell too large": GOOD.replace("G,20", "G,21"),
    "only empty pieces": "H,0,,1,1,0,100,D,speed;0;4;21,G,20,F,X3,3,10.",
    "a trailing comma": GOOD + ",",
}


@pytest.mark.parametrize("damage", DAMAGED)
def test_damaged_text_is_refused(damage: str) -> None:
    with pytest.raises(IvPError):
        decode(DAMAGED[damage])


def test_a_fifth_decimal_is_read_when_asked_for() -> None:
    assert decode(DAMAGED["a fifth decimal"], any_decimals=True).value(0) == 10.12345


@given(st.data())
@settings(max_examples=300, deadline=None)
def test_no_change_of_a_text_makes_the_decoder_do_anything_but_read_or_refuse(data: Any) -> None:
    text = data.draw(st.sampled_from([GOOD, CASES[8]["encoded"], CASES[1]["encoded"]]))
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(text)))
        cut = data.draw(st.integers(0, 4))
        text = text[:at] + data.draw(st.text("0123456789,.;:-eXHDGFna\n", max_size=4)) + text[at + cut :]
    try:
        f = decode(text)
    except IvPError:
        return
    assert np.isfinite(f.coefficients).all()
    assert ((f.low >= 0) & (f.low <= f.high) & (f.high < f.domain.points)).all()


def test_what_the_form_cannot_hold_is_not_written() -> None:
    f = decode(GOOD)
    for bad in (f.labelled("a,b"), f.labelled("a\nb"), f.weighted(-1.0), f.scaled(1e15)):
        with pytest.raises(IvPError, match="cannot be encoded"):
            encode(bad)


class TestPackets:
    def test_a_text_that_fills_its_packets_ends_with_an_empty_one(self) -> None:
        packets = split_packets("x" * 20, "b^1", 63)
        assert packets == [f"P,b^1,3,1,{'x' * 10}", f"P,b^1,3,2,{'x' * 10}", "P,b^1,3,3,"]
        assert join_packets(packets) == "x" * 20

    @pytest.mark.parametrize(
        "packet",
        ["", "P", "P,b^1,2", "Q,b,2,1,x", "P,,2,1,x", "P,b,two,1,x", "P,b,2,0,x", "P,b,2,3,x", "P,b,0,0,x"],
    )
    def test_a_malformed_packet_is_refused(self, packet: str) -> None:
        with pytest.raises(IvPError, match="packet"):
            Joiner().add(packet, now=0.0)

    def test_missing_doubled_and_mixed_packets_are_refused(self) -> None:
        packets = split_packets(GOOD, "b^1", 70)
        with pytest.raises(IvPError, match="1 of 4 missing"):
            join_packets(packets[:-1])
        with pytest.raises(IvPError, match="came before"):
            join_packets([packets[0], packets[0]])
        with pytest.raises(IvPError, match="all 4 are there already"):
            join_packets([*packets, packets[0]])
        with pytest.raises(IvPError, match="two functions"):
            join_packets([packets[0], *split_packets(GOOD, "c^1", 70)])
        with pytest.raises(IvPError, match="no packets"):
            join_packets([])

    def test_an_id_or_size_that_cannot_work_is_refused(self) -> None:
        with pytest.raises(IvPError, match="comma"):
            split_packets(GOOD, "a,b")
        with pytest.raises(IvPError, match="no room"):
            split_packets(GOOD, "b^1", 53)

    def test_two_vehicles_may_use_the_same_id(self) -> None:
        joiner = Joiner()
        one, two = split_packets("AB" * 9, "b^1", 65), split_packets("CD" * 9, "b^1", 65)
        for a, b in zip(one[:-1], two[:-1], strict=True):
            assert joiner.add(a, 1.0, "waypt", "abe") is None
            assert joiner.add(b, 2.0, "waypt", "ben") is None
        done = joiner.add(two[-1], 3.0, "other", "ben")
        assert done is not None
        assert (done.text, done.time, done.source) == ("CD" * 9, 2.0, "waypt")
        assert len(joiner) == 1

    def test_late_and_crowding_functions_are_dropped_and_counted(self) -> None:
        joiner = Joiner(patience=5.0)
        joiner.add("P,old^1,2,1,x", now=0.0)
        joiner.add("P,new^1,2,1,x", now=6.0)
        assert (len(joiner), joiner.dropped) == (1, 1)
        for i in range(600):
            joiner.add(f"P,many^{i},2,1,x", now=6.0)
        assert len(joiner) == 512
        assert joiner.dropped == 1 + 601 - 512
