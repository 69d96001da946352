"""What a share sends: many messages to a datagram, one long message over many datagrams.

A datagram is ``p L version kind | msgpack body | 16-byte seal``; the seal (truncated HMAC-SHA256) is there
only when the community has a key. The fourth byte is always above 127: no message of the reference's
own format begins like that, so the two can be told apart. The body starts with a stream (a random
number per sender and destination), a number that counts that stream's datagrams, and the mission
time of sending; from these the receiver knows what was lost, doubled or held up on the way. Nothing
is ever sent again: a share is as unreliable as UDP, and says so in figures.
"""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Iterable
from enum import Enum
from math import isfinite
from typing import Any, NamedTuple

import msgpack

from pymoos_lite.core.message import Message

MAGIC = b"pL\x01"
"""Two letters and the version of the format."""

BODY = 0x80
FRAGMENT = 0x81
SEALED = 0x40
HEADER_BYTES = 4
SEAL_BYTES = 16
OVERHEAD = HEADER_BYTES + SEAL_BYTES + 40
"""Bytes of a datagram that are not messages, at most."""

DATAGRAM_BYTES = 1400
MAX_NAME = 256
MAX_AUX = 4096
MAX_FRAGMENTS = 8192
MAX_NUMBER = 1 << 53
_ROW_BYTES = 24
"""What a row takes besides its texts and value, generously."""

_pack = msgpack.Packer(use_bin_type=True, unicode_errors="surrogateescape", autoreset=True).pack


class Fault(Enum):
    """Why something that came in was thrown away; the text is what a person reads."""

    FOREIGN = "not a datagram of ours"
    VERSION = "of another version"
    MALFORMED = "malformed"
    UNSEALED = "without the seal that our key demands"
    BAD_SEAL = "with a seal of another key"
    STALE = "sealed too long ago"
    DOUBLED = "seen before"
    BAD_MESSAGE = "messages that no app would post"
    INCOMPLETE = "long messages of which a part never came"
    FULL = "fragments beyond what we keep"


class DatagramError(Exception):
    """A datagram that cannot be used; never the receiver's mistake."""

    def __init__(self, fault: Fault) -> None:
        super().__init__(fault.value)
        self.fault = fault


class Letter(NamedTuple):
    """A datagram's messages; in one process it travels as it is."""

    stream: int
    number: int
    sent: float
    messages: tuple[Message, ...]


class Fragment(NamedTuple):
    """Part `part` (from 0) of `parts` of a message too long for one datagram."""

    stream: int
    number: int
    sent: float
    part: int
    parts: int
    chunk: bytes


def message_size(message: Message) -> int:
    """Bytes that a message takes in a datagram, near enough and cheap to know."""
    name, value, _, source, aux, community = message
    body = 8 if type(value) is float else len(value)  # type: ignore[arg-type]
    return _ROW_BYTES + body + len(name) + len(source) + len(aux) + len(community)


def parts_for(size: int, budget: int) -> int:
    """Datagrams of `budget` bytes that a message of `size` bytes takes."""
    room = budget - OVERHEAD
    return 1 if size <= room else -(-size // room)


def as_key(text: str) -> bytes | None:
    """A community's phrase as a key for seals; None for no phrase."""
    return hashlib.sha256(b"pymoos-lite share " + text.encode()).digest() if text else None


def encode_letter(letter: Letter, key: bytes | None = None) -> bytes:
    """The datagram for messages that fit into one."""
    rows = b"".join([_pack(_row(m)) for m in letter.messages])
    return _finish(BODY, _start(letter, 1) + _array_header(len(letter.messages)) + rows, key)


def encode_fragments(letter: Letter, budget: int, key: bytes | None = None) -> list[bytes]:
    """The datagrams for one long message."""
    rows = _array_header(len(letter.messages)) + b"".join([_pack(_row(m)) for m in letter.messages])
    room = budget - OVERHEAD
    count = -(-len(rows) // room)
    start = _start(letter, 3)
    return [
        _finish(
            FRAGMENT,
            start + _pack(index) + _pack(count) + _pack(rows[index * room : (index + 1) * room]),
            key,
        )
        for index in range(count)
    ]


def _start(letter: Letter, more: int) -> bytes:
    parts = (bytes((0x93 + more,)), _pack(letter.stream), _pack(letter.number), _pack(letter.sent))
    return b"".join(parts)


def _array_header(length: int) -> bytes:
    return b"\xdd" + length.to_bytes(4, "big")


def _row(message: Message) -> tuple[Any, ...]:
    return tuple(message)


def _finish(kind: int, body: bytes, key: bytes | None) -> bytes:
    if key is None:
        return MAGIC + bytes((kind,)) + body
    datagram = MAGIC + bytes((kind | SEALED,)) + body
    return datagram + hmac.digest(key, datagram, "sha256")[:SEAL_BYTES]


def decode(datagram: bytes, key: bytes | None = None) -> tuple[int, int, float, Any]:
    """Stream, number, time of sending, and either a list of rows or a `Fragment`.

    Raises:
        DatagramError: anything else came.
    """
    end = len(datagram)
    if end <= HEADER_BYTES or datagram[:2] != MAGIC[:2] or datagram[3] < 0x80:
        raise DatagramError(Fault.FOREIGN)
    if datagram[2] != MAGIC[2]:
        raise DatagramError(Fault.VERSION)
    kind = datagram[3]
    if key is not None:
        if not kind & SEALED:
            raise DatagramError(Fault.UNSEALED)
        end -= SEAL_BYTES
        if end <= HEADER_BYTES:
            raise DatagramError(Fault.MALFORMED)
        seal = hmac.digest(key, datagram[:end], "sha256")[:SEAL_BYTES]
        if not hmac.compare_digest(seal, datagram[end:]):
            raise DatagramError(Fault.BAD_SEAL)
    elif kind & SEALED:
        raise DatagramError(Fault.BAD_SEAL)
    kind &= ~SEALED
    body = _unpack(memoryview(datagram)[HEADER_BYTES:end])
    shape = tuple(map(type, body)) if type(body) is tuple else ()
    if shape[:3] != (int, int, float):
        raise DatagramError(Fault.MALFORMED)
    stream, number, sent = body[:3]
    if not (0 <= stream < MAX_NUMBER and 0 <= number < MAX_NUMBER and isfinite(sent)):
        raise DatagramError(Fault.MALFORMED)
    if kind == BODY and shape[3:] == (tuple,):
        return stream, number, sent, body[3]
    if kind == FRAGMENT and shape[3:] == (int, int, bytes):
        fragment = Fragment(*body)
        if 0 <= fragment.part < fragment.parts <= MAX_FRAGMENTS:
            return stream, number, sent, fragment
    raise DatagramError(Fault.MALFORMED)


def rows_of(data: bytes) -> tuple[Any, ...]:
    """The rows of a message put together from its fragments.

    Raises:
        DatagramError: they are none.
    """
    rows = _unpack(memoryview(data))
    if type(rows) is not tuple:
        raise DatagramError(Fault.MALFORMED)
    return rows


def _unpack(data: memoryview) -> Any:
    try:
        return msgpack.unpackb(data, use_list=False, unicode_errors="surrogateescape")
    except Exception:
        # msgpack raises a family of errors; a stranger's bytes must not end the receiver.
        raise DatagramError(Fault.MALFORMED) from None


def messages_of(rows: Iterable[Any]) -> tuple[list[Message], int]:
    """The messages in `rows`, and the number of rows that were none."""
    messages = []
    bad = 0
    for row in rows:
        if type(row) is tuple and tuple(map(type, row)) in _SHAPES and _is_sound(row):
            messages.append(Message._make(row))
        else:
            bad += 1
    return messages, bad


_SHAPES = frozenset((str, kind, float, str, str, str) for kind in (float, str, bytes))


def _is_sound(row: tuple[Any, ...]) -> bool:
    name, _, time, source, aux, community = row
    return (
        0 < len(name) <= MAX_NAME
        and len(name.split()) == 1
        and isfinite(time)
        and len(source) <= MAX_NAME
        and len(aux) <= MAX_AUX
        and len(community) <= MAX_NAME
    )
