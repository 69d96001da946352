"""Text and binary opinion messages."""

import json
import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opinion_engine import messages
from opinion_engine.messages import MessageError, OpinionMessage

DATA = Path(__file__).parents[1] / "data/opinion"
PARSE = json.loads((DATA / "case_048.json").read_text())
BINARY = json.loads((DATA / "case_050.json").read_text())

opinions = st.lists(st.floats(-128, 128), min_size=1, max_size=8)


@pytest.mark.parametrize("row", PARSE["accept"], ids=lambda r: r["text"])
def test_messages_of_the_reference_parse_to_their_records(row):
    message = messages.parse_text(row["text"])
    record = row["record"]
    assert message == OpinionMessage(record["vname"], record["group"], record["opinions"])
    assert (message.dominant(0.1) or "") == record["strongest"]


@pytest.mark.parametrize(
    "text",
    [
        *PARSE["reject"],
        "a:b::x=1",
        ":b:x=1",
        "a::x=1",
        "a:b:=1",
        "a:b:x=",
        "a:b:x=nan",
        "a:b:x=inf",
        "a:b:x=1e300",
        "a:b:x=1_0",
        "a:b:x=1 2",
        "a:b:x=٣",
        "a:b:" + "x=1:" * 100,
        "a:b:" + "x" * 20000 + "=1",
    ],
)
def test_anything_else_is_refused_whole(text):
    with pytest.raises(MessageError):
        messages.parse_text(text)


def test_a_repeated_option_takes_its_last_value_and_a_trailing_colon_is_no_field():
    assert messages.parse_text("a:b:x=1:X=2:").opinions == {"x": 2.0}


def test_neighbour_ties_go_to_the_last_in_the_alphabet_and_need_more_than_the_threshold():
    assert OpinionMessage("a", "g", {"b": 1.0, "c": 1.0, "a": 1.0}).dominant(0.1) == "c"
    assert OpinionMessage("a", "g", {"b": 0.1, "c": -0.1}).dominant(0.1) == ""
    assert OpinionMessage("a", "g", {"b": -1.0}).dominant(0.1) == ""
    assert OpinionMessage("a", "g", {}).dominant(0.1) is None


def test_text_lists_active_options_in_order_with_four_decimals():
    names, z = ("exploit", "explore", "migrate"), (-12.34564, 3.45674, 8.8889)
    text = messages.format_text("Abe", "Leader", names, z)
    assert text == "abe:leader:exploit=-12.3456:explore=3.4567:migrate=8.8889"
    text = messages.format_text("abe", "leader", names, z, (True, True, False))
    assert text == "abe:leader:exploit=-12.3456:explore=3.4567:"


@settings(deadline=None)
@given(opinions, st.data())
def test_text_survives_the_round_trip_to_four_decimals(z, data):
    names = [f"option{j}" for j in range(len(z))]
    active = data.draw(st.lists(st.booleans(), min_size=len(z), max_size=len(z)))
    back = messages.parse_text(messages.format_text("abe", "g", names, z, active)).opinions
    assert set(back) == {n for n, a in zip(names, active, strict=True) if a}
    assert all(abs(back[n] - v) <= 0.50001e-4 for n, v in zip(names, z, strict=True) if n in back)


@pytest.mark.parametrize("row", BINARY["rows"], ids=lambda r: r["i8"]["hex"])
@pytest.mark.parametrize("encoding", ["i8", "i16", "f32"])
def test_binary_payloads_match_their_vectors(row, encoding):
    expected = row[encoding]
    payload = messages.encode_binary(row["z"], encoding)
    assert payload.hex() == expected["hex"]
    if "q" in expected:
        width = len(payload) // 3
        q = [int.from_bytes(payload[i * width : (i + 1) * width], "big", signed=True) for i in range(3)]
        assert q == expected["q"]
        raw, active = messages.decode_binary(payload, 3, project=False)
        assert raw == pytest.approx(expected["decoded"], abs=BINARY["tolerance"])
        assert active == [True] * 3
        projected, _ = messages.decode_binary(payload, 3)
        assert projected == pytest.approx(expected["decoded_projected"], abs=BINARY["tolerance"])


def test_three_options_cost_3_6_or_12_bytes():
    assert [len(messages.encode_binary([1.0, 0.0, -1.0], e)) for e in ("i8", "i16", "f32")] == [3, 6, 12]


def test_inactive_options_survive_every_encoding():
    for encoding, last in (("i8", "80"), ("i16", "8000"), ("f32", "7fc00000")):
        payload = messages.encode_binary([1.0, -1.0, 0.0], encoding, [True, True, False])
        assert payload.hex().endswith(last)
        z, active = messages.decode_binary(payload, 3)
        assert active == [True, True, False]
        assert z[2] == 0.0
        assert sum(z) == pytest.approx(0.0, abs=1e-12)


@settings(deadline=None)
@given(opinions, st.sampled_from(["i8", "i16", "f32"]))
def test_binary_keeps_order_and_precision(z, encoding):
    back, _ = messages.decode_binary(messages.encode_binary(z, encoding), len(z), project=False)
    tolerance = {"i8": 0.032, "i16": 1.3e-4, "f32": 6e-8}[encoding]
    near_zero = {"i8": 0.0062, "i16": 2.5e-5, "f32": 1e-45}[encoding]
    for value, decoded in zip(z, back, strict=True):
        assert abs(decoded - value) <= tolerance * abs(value) + near_zero
    for i in range(len(z)):
        for j in range(len(z)):
            assert not (z[i] < z[j] and back[i] > back[j])


@settings(deadline=None)
@given(st.binary(max_size=70), st.integers(0, 16))
def test_no_payload_crashes_and_what_decodes_sums_to_zero(payload, n):
    try:
        z, active = messages.decode_binary(payload, n)
    except MessageError:
        return
    assert len(z) == n
    assert all(math.isfinite(v) for v in z)
    assert abs(sum(z)) <= 1e-9 * (1 + max(abs(v) for v in z))
    assert all(v == 0.0 for v, a in zip(z, active, strict=True) if not a)


@settings(max_examples=200, deadline=None)
@given(st.one_of(st.text(max_size=60), st.text("ab:=.-+e019 ", max_size=40)))
def test_no_text_crashes_the_parser(text):
    try:
        message = messages.parse_text(text)
    except MessageError:
        return
    assert all(math.isfinite(v) for v in message.opinions.values())


def test_the_header_tells_two_option_sets_apart():
    payload = messages.encode_binary([1.0, 0.0, -1.0], "i16")
    data = messages.add_header(payload, 3, agent=7)
    assert len(data) == 8
    assert data[:2] == bytes((0b01_01_0011, 7))
    assert messages.split_header(data, 3) == (7, payload)
    for bad in (b"", data[:1], data[:-1], b"\x00" + data[1:], b"\x73" + data[1:]):
        with pytest.raises(MessageError):
            messages.split_header(bad, 3)
    with pytest.raises(MessageError, match="3 options, this agent has 2"):
        messages.split_header(data, 2)
    with pytest.raises(MessageError):
        messages.add_header(payload, 3, agent=256)


def test_values_that_cannot_be_sent_are_refused():
    for encoding in ("i8", "i16", "f32"):
        with pytest.raises(MessageError):
            messages.encode_binary([math.nan, 0.0], encoding)
    with pytest.raises(MessageError, match="no binary encoding"):
        messages.encode_binary([0.0], "text")
    assert messages.encode_binary([1e6, -1e6], "i8") == bytes((127, 129))
