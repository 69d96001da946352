"""Frames: what one datagram holds, and the seal that proves who made it.

A datagram is ``version byte | 8-byte connection | msgpack array | 16-byte seal``; the seal (truncated
HMAC-SHA256) is there only when the community has a key, and then the version byte says so. The
connection stands outside the array so that a receiver can find the right key and verify the seal
before it parses anything. Frames know neither sequence rules nor what a payload means.
"""

from __future__ import annotations

import hashlib
import hmac
from enum import IntEnum
from typing import Any, NamedTuple

import msgpack

VERSION = 1
SEALED = 0x80
"""Bit of the version byte that announces a seal."""

CONNECTION_BYTES = 8
IDENTITY_BYTES = 16
COOKIE_BYTES = 24
SEAL_BYTES = 16
HELLO_PADDING = 64
MAX_NAME = 128
MAX_REASON = 512
MAX_NUMBER = 1 << 62
MAX_HOLD = 10_000
MAX_SEGMENTS_AHEAD = 4096
"""Segments a sender may have outstanding; bounds the bitmap of an `Ack`."""

OVERHEAD = 80
"""Bytes of a datagram that are not payload, at most."""

# One packer for all: making one costs more than packing a frame. It is not entered twice, since it
# calls nothing back and the interpreter lets no other thread in meanwhile.
_pack = msgpack.Packer(use_bin_type=True).pack
_HEADER_BYTES = 1 + CONNECTION_BYTES


class Fault(IntEnum):
    """Why a datagram was thrown away. Receivers count by these names."""

    MALFORMED = 1
    BAD_VERSION = 2
    UNSEALED = 3
    BAD_SEAL = 4
    REPLAYED = 5
    UNKNOWN_CONNECTION = 6
    BAD_COOKIE = 7
    UNEXPECTED = 8
    OUT_OF_WINDOW = 9


class FrameError(Exception):
    """A datagram that is not acceptable; `fault` says why. Never the receiver's mistake."""

    def __init__(self, fault: Fault) -> None:
        super().__init__(fault.name.lower())
        self.fault = fault


class RefusalCode(IntEnum):
    """Why a server does not admit a client."""

    NAME_CLASH = 1
    SERVER_FULL = 2
    BAD_NAME = 3
    KEY_NEEDED = 4
    NO_KEY_HERE = 5


class Hello(NamedTuple):
    """Client: I would like to talk. Padded, so that no answer is larger than the question."""

    padding: bytes


class Challenge(NamedTuple):
    """Server: show me that you receive at this address. The server remembers nothing yet."""

    cookie: bytes


class Connect(NamedTuple):
    """Client: here is your cookie, my name, and what I remember of an earlier connection.

    `identity` is random and stays with the client as long as it lives; `server` is the server's
    identity of the session to be resumed (empty for none) and `received` the number of the last
    parcel of that session.
    """

    cookie: bytes
    name: str
    identity: bytes
    server: bytes
    received: int
    budget: int
    window: int


class Welcome(NamedTuple):
    """Server: you are in.

    `received` is the number of the last parcel taken from this identity. Posts should wait for `hold`
    milliseconds: the database is new, and those who want to hear them may not be back yet.
    """

    server: bytes
    community: str
    resumed: bool
    received: int
    budget: int
    window: int
    now: float
    hold: int


class Refuse(NamedTuple):
    """Server: you are not admitted."""

    code: int
    reason: str


class Data(NamedTuple):
    """A segment of the stream. `seen` is 0 when the sender has holes: then only an `Ack` tells all."""

    number: int
    ack: int
    seen: int
    held: int
    seq: int
    payload: bytes


class Ack(NamedTuple):
    """What has arrived: all below `ack`, and of those above it the ones set in the bitmap `sack`.

    `seen` is the highest frame number received and `held` how many microseconds ago that was.
    `echo` asks for an answer.
    """

    number: int
    ack: int
    seen: int
    held: int
    sack: bytes
    echo: bool


class Close(NamedTuple):
    """The connection is over; `reason` is for people."""

    number: int
    reason: str


class Reset(NamedTuple):
    """Server: I know of no such connection."""


Frame = Hello | Challenge | Connect | Welcome | Refuse | Data | Ack | Close | Reset

_CLASSES: tuple[Any, ...] = (Hello, Challenge, Connect, Welcome, Refuse, Data, Ack, Close, Reset)
_KIND: dict[type, int] = {cls: kind for kind, cls in enumerate(_CLASSES, start=1)}
_DATA = _KIND[Data]
_SHAPE: dict[int, tuple[type, ...]] = {
    _KIND[Hello]: (int, bytes),
    _KIND[Challenge]: (int, bytes),
    _KIND[Connect]: (int, bytes, str, bytes, bytes, int, int, int),
    _KIND[Welcome]: (int, bytes, str, bool, int, int, int, float, int),
    _KIND[Refuse]: (int, int, str),
    _DATA: (int, int, int, int, int, int, bytes),
    _KIND[Ack]: (int, int, int, int, int, bytes, bool),
    _KIND[Close]: (int, int, str),
    _KIND[Reset]: (int,),
}


def encode(frame: Frame, connection: bytes, key: bytes | None = None) -> bytes:
    """The datagram for `frame`; sealed if there is a `key`."""
    body: bytes = _pack((_KIND[type(frame)], *frame))
    if key is None:
        return b"%c%b%b" % (VERSION, connection, body)
    datagram = b"%c%b%b" % (VERSION | SEALED, connection, body)
    return datagram + hmac.digest(key, datagram, "sha256")[:SEAL_BYTES]


def connection_of(datagram: bytes) -> tuple[bytes, bool]:
    """The connection a datagram claims to belong to, and whether it carries a seal.

    Raises:
        FrameError: too short or of another version.
    """
    if len(datagram) <= _HEADER_BYTES:
        raise FrameError(Fault.MALFORMED)
    version = datagram[0]
    if version & ~SEALED != VERSION:
        raise FrameError(Fault.BAD_VERSION)
    return datagram[1:_HEADER_BYTES], bool(version & SEALED)


def decode(datagram: bytes, key: bytes | None = None) -> Frame:
    """The frame in `datagram`, after verifying its seal if there is a `key`.

    Every field has the right type and lies in its range.

    Raises:
        FrameError: anything else.
    """
    if len(datagram) <= _HEADER_BYTES:
        raise FrameError(Fault.MALFORMED)
    end = len(datagram)
    if key is None:
        if datagram[0] != VERSION:
            raise FrameError(Fault.BAD_SEAL if datagram[0] == VERSION | SEALED else Fault.BAD_VERSION)
    else:
        if datagram[0] != VERSION | SEALED:
            raise FrameError(Fault.UNSEALED if datagram[0] == VERSION else Fault.BAD_VERSION)
        end -= SEAL_BYTES
        if end <= _HEADER_BYTES:
            raise FrameError(Fault.MALFORMED)
        seal = hmac.digest(key, datagram[:end], "sha256")[:SEAL_BYTES]
        if not hmac.compare_digest(seal, datagram[end:]):
            raise FrameError(Fault.BAD_SEAL)
    try:
        body = msgpack.unpackb(memoryview(datagram)[_HEADER_BYTES:end], use_list=False)
    except Exception:
        # msgpack raises a family of ValueErrors, and for some inputs TypeError or others: whatever
        # it is, a stranger's bytes must not end the receiver.
        raise FrameError(Fault.MALFORMED) from None
    if type(body) is not tuple or not body:
        raise FrameError(Fault.MALFORMED)
    kind = body[0]
    if type(kind) is not int:
        raise FrameError(Fault.MALFORMED)
    if tuple(map(type, body)) != _SHAPE.get(kind):
        raise FrameError(Fault.MALFORMED)
    if kind == _DATA:  # nearly all of them
        counts = body[:6]
        if min(counts) < 0 or max(counts) >= MAX_NUMBER or not body[1] or not body[6]:
            raise FrameError(Fault.MALFORMED)
        return Data._make(body[1:])
    frame: Frame = _CLASSES[kind - 1]._make(body[1:])
    if not _in_range(frame):
        raise FrameError(Fault.MALFORMED)
    return frame


def _in_range(frame: Frame) -> bool:
    match frame:
        case Ack(number, ack, seen, held, sack, _):
            return (
                0 < number < MAX_NUMBER
                and 0 <= ack < MAX_NUMBER
                and 0 <= seen < MAX_NUMBER
                and 0 <= held < MAX_NUMBER
                and len(sack) <= MAX_SEGMENTS_AHEAD // 8
            )
        case Close(number, reason):
            return 0 < number < MAX_NUMBER and len(reason) <= MAX_REASON
        case Hello(padding):
            return len(padding) == HELLO_PADDING
        case Challenge(cookie):
            return len(cookie) == COOKIE_BYTES
        case Connect(cookie, _, identity, server, received, budget, window):
            # The name is judged by the server, which can then say what is wrong with it.
            return (
                len(cookie) == COOKIE_BYTES
                and len(identity) == IDENTITY_BYTES
                and len(server) in (0, IDENTITY_BYTES)
                and 0 <= received < MAX_NUMBER
                and OVERHEAD < budget < MAX_NUMBER
                and 0 < window < MAX_NUMBER
            )
        case Welcome(server, community, _, received, budget, window, _, hold):
            return (
                len(server) == IDENTITY_BYTES
                and len(community) <= MAX_REASON
                and 0 <= received < MAX_NUMBER
                and OVERHEAD < budget < MAX_NUMBER
                and 0 < window < MAX_NUMBER
                and 0 <= hold <= MAX_HOLD
            )
        case Refuse(code, reason):
            return code in RefusalCode._value2member_map_ and len(reason) <= MAX_REASON
        case _:
            return True


class Keys(NamedTuple):
    """One key for each direction, so that a frame sent back to its maker does not verify."""

    to_server: bytes | None
    to_client: bytes | None


NO_KEYS = Keys(None, None)


def handshake_keys(community_key: bytes | None) -> Keys:
    """The keys that seal frames before a connection stands."""
    return _derive(community_key, b"handshake")


def connection_keys(community_key: bytes | None, connection: bytes, cookie: bytes) -> Keys:
    """The keys of one connection.

    They depend on what both sides contributed freshly (`connection` by the client, `cookie` by the
    server), so a frame recorded on another connection does not verify.
    """
    return _derive(community_key, b"connection" + connection + cookie)


def _derive(community_key: bytes | None, label: bytes) -> Keys:
    if community_key is None:
        return NO_KEYS
    return Keys(
        *(hmac.digest(community_key, b"pymoos-lite %b " % way + label, "sha256") for way in (b"up", b"down"))
    )


def as_key(key: str | bytes | None) -> bytes | None:
    """A community key as bytes; text is hashed so that any phrase will do.

    Raises:
        ValueError: the key is empty.
    """
    if key is None:
        return None
    if not key:
        raise ValueError("a community key must not be empty")
    return hashlib.sha256(key.encode()).digest() if isinstance(key, str) else key
