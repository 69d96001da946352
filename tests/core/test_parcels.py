"""Parcels: round trips, bounds on batches, and what no honest peer sends."""

from __future__ import annotations

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.core.message import Message
from pymoos_lite.core.parcels import (
    BATCH,
    BATCH_BYTES,
    Kind,
    Mail,
    Notice,
    Outbox,
    ParcelError,
    Parser,
    Posts,
    Register,
    Unregister,
    is_text,
    split,
)

wire_text = st.text(max_size=50).map(lambda t: t.encode("utf-8", "replace").decode())
byte_text = st.binary(max_size=30).map(lambda b: b.decode("utf-8", "surrogateescape"))
names = st.text(min_size=1, max_size=40).filter(is_text)
values = st.one_of(st.floats(allow_nan=False), wire_text, byte_text, st.binary(max_size=100))
times = st.floats(allow_nan=False, allow_infinity=False)
posts = st.tuples(names, values, times, wire_text)


def record_of(framed: bytes) -> bytes:
    assert int.from_bytes(framed[:4], "big") == len(framed) - 4
    return framed[4:]


@given(st.lists(posts, min_size=1, max_size=30))
def test_posts_arrive_as_messages_of_their_source(rows: list[tuple[str, object, float, str]]) -> None:
    record = record_of(Outbox().add(Kind.POSTS, rows))
    expected = [Message(n, v, t, "pApp", aux, "alpha") for n, v, t, aux in rows]  # type: ignore[arg-type]
    parcel = Parser("pApp", "alpha").parse(record)
    assert parcel == Posts(1, expected)
    assert all(type(m) is Message for m in parcel.messages)  # type: ignore[union-attr]


@given(st.lists(st.builds(Message, names, values, times, names, wire_text, wire_text), min_size=1))
def test_mail_and_relayed_messages_arrive_as_they_were(messages: list[Message]) -> None:
    outbox = Outbox()
    assert Parser().parse(record_of(outbox.add(Kind.MAIL, messages))) == Mail(1, messages)
    assert Parser("x").parse(record_of(outbox.add(Kind.RELAYED, messages))) == Posts(2, messages)


def test_registrations_and_notices_arrive_as_they_were() -> None:
    outbox = Outbox()
    register = outbox.add(Kind.REGISTER, "NAV_*", "uSim*", 0.5, ("NAV_Z",))
    assert Parser().parse(record_of(register)) == Register(1, "NAV_*", "uSim*", 0.5, ("NAV_Z",))
    unregister = outbox.add(Kind.UNREGISTER, "NAV_*", "")
    assert Parser().parse(record_of(unregister)) == Unregister(2, "NAV_*", "")
    notice = outbox.add(Kind.NOTICE, (("X", "why", 3),))
    assert Parser().parse(record_of(notice)) == Notice(3, (("X", "why", 3),))


GOOD_ROW = ("X", 1.0, 2.0, "")


@pytest.mark.parametrize(
    "body",
    [
        None,
        [],
        [1],
        [-1, 1, [GOOD_ROW]],
        [1.0, 1, [GOOD_ROW]],
        [1, 99, [GOOD_ROW]],
        [1, 1],
        [1, 1, []],
        [1, 1, GOOD_ROW],
        [1, 1, [GOOD_ROW], 0],
        [1, 1, [GOOD_ROW[:3]]],
        [1, 1, [GOOD_ROW, GOOD_ROW[:3]]],
        [1, 1, [("", 1.0, 2.0, "")]],
        [1, 1, [("X" * 257, 1.0, 2.0, "")]],
        [1, 1, [(b"X", 1.0, 2.0, "")]],
        [1, 1, [({}, 1.0, 2.0, "")]],
        [1, 1, [("X", 1, 2.0, "")]],
        [1, 1, [("X", None, 2.0, "")]],
        [1, 1, [("X", [1.0], 2.0, "")]],
        [1, 1, [("X", 1.0, 2, "")]],
        [1, 1, [("X", 1.0, float("nan"), "")]],
        [1, 1, [("X", 1.0, float("inf"), "")]],
        [1, 1, [("X", 1.0, 2.0, None)]],
        [1, 1, [("X", 1.0, 2.0, "a" * 4097)]],
        [1, 2, [("X", 1.0, 2.0, "src", "")]],
        [1, 2, [("X", 1.0, 2.0, 7, "", "")]],
        [1, 2, [("X", 1.0, 2.0, "src", "", 7)]],
        [1, 3, "X", "*", 0.0],
        [1, 3, "", "*", 0.0, []],
        [1, 3, "X", "*", -1.0, []],
        [1, 3, "X", "*", float("nan"), []],
        [1, 3, "X", "*", float("inf"), []],
        [1, 3, "X", "*", 1, []],
        [1, 3, "X", 5, 0.0, []],
        [1, 3, "X", "*", 0.0, [5]],
        [1, 3, "X", "*", 0.0, "ab"],
        [1, 3, "X", "*", 0.0, ["Y"] * 257],
        [1, 4, "X"],
        [1, 4, 5, ""],
        [1, 6, [("X", "why", "3")]],
        [1, 6, [("X", 5, 3)]],
    ],
)
def test_what_no_honest_peer_sends_is_refused(body: object) -> None:
    with pytest.raises(ParcelError):
        Parser("pApp").parse(msgpack.packb(body))


@given(st.binary(max_size=300))
def test_random_bytes_are_no_parcel_and_raise_nothing_else(noise: bytes) -> None:
    with pytest.raises(ParcelError):
        Parser("pApp").parse(noise)


@given(
    st.lists(
        st.one_of(
            st.floats(), st.integers(0, 300_000).map(bytes), st.integers(0, 300).map(lambda n: "x" * n)
        ),
        max_size=1200,
    )
)
def test_batches_keep_the_order_and_their_bounds(content: list[object]) -> None:
    rows = [("X", value) for value in content]
    batches = list(split(rows))
    assert [row for batch in batches for row in batch] == rows
    for batch in batches:
        assert 0 < len(batch) <= BATCH
        texts = [len(v) for _, v in batch if not isinstance(v, float)]  # type: ignore[arg-type]
        assert sum(texts) <= BATCH_BYTES or len(batch) == 1


def test_an_outbox_forgets_what_was_acknowledged_and_resends_the_rest() -> None:
    outbox = Outbox()
    records = [outbox.add(Kind.POSTS, [GOOD_ROW] * n, rows=n) for n in (1, 2, 3)]
    assert outbox.rows == 6
    outbox.settle(1)
    assert (outbox.rows, outbox.bytes) == (5, len(records[1]) + len(records[2]))
    assert outbox.resume(2) == [records[2]]  # the peer had the second one after all
    outbox.settle(1)  # counted anew on the new link
    assert (outbox.rows, outbox.bytes) == (0, 0)


def test_an_outbox_replaces_old_registrations_when_the_peer_has_forgotten_them() -> None:
    outbox = Outbox()
    outbox.add(Kind.REGISTER, "OLD", "*", 0.0, ())
    post = outbox.add(Kind.POSTS, [GOOD_ROW])
    first, second = outbox.resume(0, [(Kind.REGISTER, "NEW", "*", 0.0, ())])
    assert Parser().parse(record_of(first)) == Register(0, "NEW", "*", 0.0, ())
    assert second == post
    assert outbox.resume(0) == [first, second]  # and keeps them if the next link dies as well


def test_text_that_has_no_utf8_form_becomes_a_question_mark_not_an_exception() -> None:
    record = record_of(Outbox().add(Kind.MAIL, [Message("X", "half \ud800", 1.0, "a")]))
    (message,) = Parser().parse(record).messages  # type: ignore[union-attr]
    assert message.value == "half ?"
