"""Frames and seals: what is accepted, what is thrown away and under which name."""

from __future__ import annotations

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.core import frames
from pymoos_lite.core.frames import (
    COOKIE_BYTES,
    HELLO_PADDING,
    IDENTITY_BYTES,
    OVERHEAD,
    Ack,
    Challenge,
    Close,
    Connect,
    Data,
    Fault,
    FrameError,
    Hello,
    Refuse,
    Reset,
    Welcome,
    connection_keys,
    connection_of,
    decode,
    encode,
    handshake_keys,
)

CONNECTION = b"12345678"
COOKIE = bytes(COOKIE_BYTES)
IDENTITY = bytes(IDENTITY_BYTES)

counts = st.integers(0, frames.MAX_NUMBER - 1)
numbers = st.integers(1, frames.MAX_NUMBER - 1)
any_frame = st.one_of(
    st.builds(Hello, st.binary(min_size=HELLO_PADDING, max_size=HELLO_PADDING)),
    st.builds(Challenge, st.binary(min_size=COOKIE_BYTES, max_size=COOKIE_BYTES)),
    st.builds(
        Connect,
        st.binary(min_size=COOKIE_BYTES, max_size=COOKIE_BYTES),
        st.text(max_size=200),
        st.binary(min_size=IDENTITY_BYTES, max_size=IDENTITY_BYTES),
        st.sampled_from([b"", IDENTITY]),
        counts,
        st.integers(OVERHEAD + 1, 65535),
        numbers,
    ),
    st.builds(
        Welcome,
        st.just(IDENTITY),
        st.text(max_size=50),
        st.booleans(),
        counts,
        st.integers(OVERHEAD + 1, 65535),
        numbers,
        st.floats(allow_nan=False),
        st.integers(0, frames.MAX_HOLD),
    ),
    st.builds(Refuse, st.sampled_from([int(c) for c in frames.RefusalCode]), st.text(max_size=100)),
    st.builds(Data, numbers, counts, counts, counts, counts, st.binary(min_size=1, max_size=500)),
    st.builds(Ack, numbers, counts, counts, counts, st.binary(max_size=512), st.booleans()),
    st.builds(Close, numbers, st.text(max_size=100)),
    st.just(Reset()),
)
keys = st.sampled_from([None, b"secret"])


@given(any_frame, keys)
def test_every_frame_survives_the_wire(frame: frames.Frame, key: bytes | None) -> None:
    datagram = encode(frame, CONNECTION, key)
    assert connection_of(datagram) == (CONNECTION, key is not None)
    assert decode(datagram, key) == frame


@given(any_frame, st.data())
def test_a_sealed_frame_with_any_bit_changed_is_refused(frame: frames.Frame, data: st.DataObject) -> None:
    datagram = bytearray(encode(frame, CONNECTION, b"secret"))
    bit = data.draw(st.integers(0, 8 * len(datagram) - 1))
    datagram[bit // 8] ^= 1 << bit % 8
    with pytest.raises(FrameError):
        decode(bytes(datagram), b"secret")


@given(st.binary(max_size=200), keys)
def test_random_bytes_raise_a_frame_error_and_nothing_else(noise: bytes, key: bytes | None) -> None:
    for datagram in (noise, b"\x01" + CONNECTION + noise, b"\x81" + CONNECTION + noise):
        try:
            frame = decode(datagram, key)
        except FrameError:
            continue
        assert key is None
        assert encode(frame, datagram[1:9])  # what is accepted is a whole frame


fields = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(2**63), 2**64 - 1),
    st.floats(),
    st.binary(max_size=70),
    st.text(max_size=10),
    st.lists(st.integers(0, 3), max_size=3),
    st.dictionaries(st.integers(0, 3), st.integers(0, 3), max_size=2),
)


@given(st.integers(-1, 12), st.lists(fields, max_size=8))
def test_arrays_of_any_content_are_frames_only_if_every_field_fits(kind: int, content: list[object]) -> None:
    datagram = b"\x01" + CONNECTION + msgpack.packb([kind, *content])
    try:
        frame = decode(datagram)
    except FrameError as error:
        fault = error.fault
    else:
        assert list(frame) == content
        return
    assert fault is Fault.MALFORMED


@pytest.mark.parametrize(
    ("datagram", "fault"),
    [
        (b"", Fault.MALFORMED),
        (b"\x01" + CONNECTION, Fault.MALFORMED),
        (b"\x02" + CONNECTION + b"\x91\x09", Fault.BAD_VERSION),
        (b"\x01" + CONNECTION + b"\x91\x0a", Fault.MALFORMED),
        (b"\x01" + CONNECTION + b"\x91\x09\x00", Fault.MALFORMED),
        (b"\x01" + CONNECTION + b"\x91" * 5000, Fault.MALFORMED),
        (b"\x01" + CONNECTION + b"\xdd\xff\xff\xff\xff", Fault.MALFORMED),
        (b"\x01" + CONNECTION + b"\xc6\xff\xff\xff\xff", Fault.MALFORMED),
        (encode(Reset(), CONNECTION, b"key"), Fault.BAD_SEAL),
    ],
)
def test_bad_datagrams_are_named(datagram: bytes, fault: Fault) -> None:
    with pytest.raises(FrameError) as caught:
        decode(datagram)
    assert caught.value.fault is fault


@pytest.mark.parametrize(
    ("datagram", "fault"),
    [
        (encode(Reset(), CONNECTION), Fault.UNSEALED),
        (encode(Reset(), CONNECTION, b"other"), Fault.BAD_SEAL),
        (b"\x81" + CONNECTION + bytes(16), Fault.MALFORMED),
        (b"\x82" + CONNECTION + bytes(20), Fault.BAD_VERSION),
    ],
)
def test_bad_datagrams_are_named_where_a_key_is_needed(datagram: bytes, fault: Fault) -> None:
    with pytest.raises(FrameError) as caught:
        decode(datagram, b"key")
    assert caught.value.fault is fault


def test_keys_differ_by_direction_connection_and_cookie() -> None:
    key = b"community key"
    derived = [
        *handshake_keys(key),
        *connection_keys(key, CONNECTION, COOKIE),
        *connection_keys(key, b"87654321", COOKIE),
        *connection_keys(key, CONNECTION, b"\x01" * COOKIE_BYTES),
        *handshake_keys(b"another"),
    ]
    assert len(set(derived)) == len(derived)


def test_without_a_community_key_nothing_is_sealed() -> None:
    assert handshake_keys(None) == connection_keys(None, CONNECTION, COOKIE) == (None, None)


def test_no_answer_to_a_stranger_is_larger_than_its_question() -> None:
    for key in (None, b"key"):
        question = encode(Hello(bytes(HELLO_PADDING)), CONNECTION, key)
        assert len(encode(Challenge(COOKIE), CONNECTION, key)) <= len(question)
        assert len(encode(Reset(), CONNECTION, key)) <= len(encode(Close(1, ""), CONNECTION, key))


def test_overhead_covers_all_of_a_data_frame_but_its_payload() -> None:
    top = frames.MAX_NUMBER - 1
    payload = bytes(30_000)
    datagram = encode(Data(top, top, top, top, top, payload), CONNECTION, b"key")
    assert len(datagram) - len(payload) <= OVERHEAD


def test_keys_may_be_phrases_or_bytes_but_not_empty() -> None:
    assert frames.as_key("a phrase") != frames.as_key("another")
    assert frames.as_key(b"raw") == b"raw"
    assert frames.as_key(None) is None
    with pytest.raises(ValueError, match="must not be empty"):
        frames.as_key("")
