"""What a share sends: encoding, fragments, seals, loss accounting, and hostile input."""

import math

import msgpack
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pymoos_lite.app.network import Bundle
from pymoos_lite.core.message import Message
from pymoos_lite.field.datagrams import (
    DATAGRAM_BYTES,
    MAGIC,
    Fault,
    Letter,
    as_key,
    encode_fragments,
    encode_letter,
    message_size,
    messages_of,
)
from pymoos_lite.field.letterbox import (
    FRAGMENT_PATIENCE,
    MAX_PARTIAL,
    MAX_STREAMS,
    WINDOW,
    Inbox,
    Outbox,
    Stream,
)

SENDER = ("127.0.0.1", 9201)
names = st.text(
    st.characters(min_codepoint=33, max_codepoint=0x2FF, exclude_categories=["Z", "C"]),
    min_size=1,
    max_size=40,
)
values = st.floats() | st.text(max_size=3000) | st.binary(max_size=3000)
times = st.floats(0, 1e10)
messages = st.builds(
    Message, names, values, times, st.text(max_size=20), st.text(max_size=40), st.text(max_size=20)
)


def same(one, other):
    if isinstance(one.value, float) and math.isnan(one.value):
        return isinstance(other.value, float) and math.isnan(other.value) and one[2:] == other[2:]
    return one == other


def send_all(outbox, mail, now=100.0):
    out = []
    for message in mail:
        out += outbox.add(message, message_size(message), now)
    return out + outbox.flush(now)


@settings(max_examples=60, deadline=None)
@given(st.lists(messages, max_size=12), st.sampled_from([256, 1400, 9000]), st.sampled_from(["", "phrase"]))
def test_what_is_sent_arrives_unchanged_and_in_order(mail, budget, phrase):
    key = as_key(phrase)
    inbox = Inbox(key)
    payloads = send_all(Outbox(7, budget, False, key), mail)
    assert all(len(p) <= budget for p in payloads)
    arrived = [m for p in payloads for m in inbox.take(p, SENDER, 100.0, 0.0)]
    assert len(arrived) == len(mail)
    assert all(same(a, b) for a, b in zip(arrived, mail, strict=True))
    assert inbox.faults == {}


@settings(max_examples=30, deadline=None)
@given(st.lists(messages, max_size=12))
def test_by_reference_the_same_messages_arrive_in_as_many_letters(mail):
    direct, encoded = (Outbox(7, 1400, by, None) for by in (True, False))
    bundles = send_all(direct, mail)
    send_all(encoded, mail)
    inbox = Inbox()
    arrived = [m for p in bundles for m in inbox.take(p, SENDER, 100.0, 0.0)]
    assert [id(a) for a in arrived] == [id(m) for m in mail]
    assert direct._number == encoded._number


@pytest.mark.parametrize("length", [0, 10, 1000, 1300, 1400, 5000, 100_000])
def test_the_size_counted_by_reference_is_that_of_the_bytes_within_a_tenth(length):
    message = Message("VIEW_POLYGON", "x" * length, 1.0, "pHelmIvP", "12:waypoint", "abe")
    mail = [message] * 5
    bundles = send_all(Outbox(7, 1400, True, None), mail)
    datagrams = send_all(Outbox(7, 1400, False, None), mail)
    counted, real = sum(b.size for b in bundles), sum(map(len, datagrams))
    assert sum(b.parts for b in bundles) == len(datagrams)
    assert counted == pytest.approx(real, rel=0.1, abs=100)


def test_many_small_messages_travel_in_one_datagram():
    mail = [Message(f"V{i}", 1.0 * i, 5.0, "app", "", "abe") for i in range(20)]
    assert len(send_all(Outbox(1, DATAGRAM_BYTES, False, None), mail)) == 1


def test_fragments_may_come_in_any_order_and_twice():
    message = Message("GRID", "0123456789" * 1000, 5.0, "app", "", "abe")
    parts = send_all(Outbox(1, 1400, False, None), [message])
    assert len(parts) > 7
    inbox = Inbox()
    arrived = []
    for part in [*parts[::-1], *parts]:
        arrived += inbox.take(part, SENDER, 0.0, 0.0)
    assert arrived == [message]
    assert inbox.faults == {Fault.DOUBLED: len(parts)}


def test_a_message_that_lacks_a_fragment_is_given_up_and_counted():
    parts = send_all(Outbox(1, 1400, False, None), [Message("G", "x" * 5000, 0.0, "a", "", "b")])
    inbox = Inbox()
    for part in parts[1:]:
        assert inbox.take(part, SENDER, 0.0, 10.0) == []
    inbox.expire(10.0 + FRAGMENT_PATIENCE - 0.1)
    assert inbox.faults == {}
    inbox.expire(10.0 + FRAGMENT_PATIENCE)
    assert inbox.faults == {Fault.INCOMPLETE: 1}
    assert inbox._partial_bytes == 0


def test_a_flood_of_first_fragments_stays_within_bounds():
    inbox = Inbox()
    for number in range(5000):
        letter = Letter(3, number + 1, 0.0, (Message("G", "x" * 5000, 0.0, "a", "", "b"),))
        inbox.take(encode_fragments(letter, 1400)[0], SENDER, 0.0, 0.0)
    assert len(inbox._partial) <= MAX_PARTIAL + 1
    assert inbox._partial_bytes == sum(p.bytes for p in inbox._partial.values())
    assert inbox.faults[Fault.INCOMPLETE] >= 5000 - MAX_PARTIAL - 1


def test_a_message_longer_than_allowed_is_not_collected():
    letter = Letter(3, 1, 0.0, (Message("G", "x" * 100_000, 0.0, "a", "", "b"),))
    inbox = Inbox(max_message=20_000)
    for part in encode_fragments(letter, 1400):
        assert inbox.take(part, SENDER, 0.0, 0.0) == []
    assert inbox.faults[Fault.FULL] >= 1
    assert inbox._partial_bytes <= 100_000


def test_many_senders_stay_within_bounds():
    inbox = Inbox()
    for stream in range(3 * MAX_STREAMS):
        letter = Letter(stream, 1, 0.0, (Message("A", 1.0, 0.0, "a", "", "b"),))
        inbox.take(encode_letter(letter), SENDER, 0.0, 0.0)
    assert len(inbox.streams) == MAX_STREAMS


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=200) | st.binary(max_size=200).map(lambda b: MAGIC + b"\x80" + b))
def test_random_bytes_are_counted_and_raise_nothing_else(data):
    inbox = Inbox()
    assert inbox.take(data, SENDER, 0.0, 0.0) == []


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_a_flipped_bit_never_gets_through_a_seal(data):
    key = as_key("phrase")
    letter = Letter(3, 9, 100.0, (Message("DEPLOY", "true", 100.0, "a", "", "b"),))
    datagram = bytearray(encode_letter(letter, key))
    bit = data.draw(st.integers(0, 8 * len(datagram) - 1))
    datagram[bit // 8] ^= 1 << bit % 8
    inbox = Inbox(key)
    assert inbox.take(bytes(datagram), SENDER, 100.0, 0.0) == []
    assert sum(inbox.faults.values()) == 1


@pytest.mark.parametrize(
    ("ours", "theirs", "fault"),
    [("phrase", "", Fault.UNSEALED), ("", "phrase", Fault.BAD_SEAL), ("phrase", "other", Fault.BAD_SEAL)],
)
def test_another_key_or_none_is_refused(ours, theirs, fault):
    letter = Letter(3, 9, 100.0, (Message("DEPLOY", "true", 100.0, "a", "", "b"),))
    inbox = Inbox(as_key(ours))
    assert inbox.take(encode_letter(letter, as_key(theirs)), SENDER, 100.0, 0.0) == []
    assert inbox.faults == {fault: 1}


def test_a_recording_played_back_later_is_refused_with_a_key():
    key = as_key("phrase")
    datagram = encode_letter(Letter(3, 9, 100.0, (Message("DEPLOY", "true", 100.0, "a", "", "b"),)), key)
    inbox = Inbox(key, freshness=60.0)
    assert len(inbox.take(datagram, SENDER, 130.0, 0.0)) == 1
    assert inbox.take(datagram, SENDER, 130.0, 0.0) == []
    assert inbox.take(datagram, ("10.0.0.9", 7), 170.0, 0.0) == []
    assert inbox.faults == {Fault.DOUBLED: 1, Fault.STALE: 1}


@pytest.mark.parametrize(
    "row",
    [
        ("", 1.0, 0.0, "a", "", "b"),
        ("two words", 1.0, 0.0, "a", "", "b"),
        ("N" * 300, 1.0, 0.0, "a", "", "b"),
        ("N", 1, 0.0, "a", "", "b"),
        ("N", None, 0.0, "a", "", "b"),
        ("N", 1.0, math.nan, "a", "", "b"),
        ("N", 1.0, "0", "a", "", "b"),
        ("N", 1.0, 0.0, b"a", "", "b"),
        ("N", 1.0, 0.0, "a", "x" * 5000, "b"),
        ("N", 1.0, 0.0, "a", ""),
        "N",
    ],
)
def test_rows_that_are_no_message_are_left_out_and_the_others_kept(row):
    good = ("N", 1.0, 0.0, "a", "", "b")
    found, bad = messages_of([good, row, good])
    assert (found, bad) == ([Message(*good)] * 2, 1)
    body = msgpack.packb([3, 1, 0.0, [good, row]])
    inbox = Inbox()
    assert inbox.take(MAGIC + b"\x80" + body, SENDER, 0.0, 0.0) == [Message(*good)]
    assert inbox.faults == {Fault.BAD_MESSAGE: 1}


def test_text_that_is_not_utf8_survives():
    message = Message("RAW", b"\xff\xfe".decode("utf-8", "surrogateescape"), 0.0, "a", "", "b")
    assert Inbox().take(send_all(Outbox(1, 1400, False, None), [message])[0], SENDER, 0.0, 0.0) == [message]


@settings(max_examples=200, deadline=None)
@given(st.lists(st.integers(0, 3 * WINDOW), max_size=100))
def test_a_number_is_admitted_once_within_the_window(numbers):
    stream = Stream(SENDER)
    admitted: list[int] = []
    for number in numbers:
        fresh = stream.admit(number)
        if fresh:
            assert number not in admitted
            admitted.append(number)
        else:
            assert number in admitted or stream.highest - number >= WINDOW
    assert stream.received == len(admitted)
    if admitted:
        assert stream.lost == max(admitted) - min(admitted) + 1 - len(admitted)


def test_a_huge_number_costs_no_memory():
    stream = Stream(SENDER)
    assert stream.admit(1)
    assert stream.admit((1 << 53) - 1)
    assert stream._seen == 1


def test_a_bundle_of_something_else_is_refused():
    inbox = Inbox()
    assert inbox.take(Bundle("nonsense", 3), SENDER, 0.0, 0.0) == []
    assert inbox.faults == {Fault.FOREIGN: 1}
