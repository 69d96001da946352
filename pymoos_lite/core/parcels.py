"""Parcels: what sessions put into the records of a link: posts, mail, registrations, notices.

A parcel is a msgpack array ``[number, kind, ...]`` and holds many messages, packed and unpacked in
one call each. Numbers rise by one per parcel, so that whatever has to be sent again after a lost
connection is recognised: that is how posts arrive exactly once as long as the server lives.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from enum import IntEnum
from functools import partial
from itertools import repeat
from math import isfinite
from typing import Any, NamedTuple

import msgpack

from pymoos_lite.core.assembly import frame_record
from pymoos_lite.core.message import Message, Value

BATCH = 512
"""Messages in one parcel, at most."""

BATCH_BYTES = 31_000
"""Bytes of messages in one parcel, about, unless a single one is larger: a loopback datagram's worth, so
that parcels need not be cut and put together again."""

ROW_BYTES = 64
"""What a message occupies besides its value, for the bounds on queues."""

MAX_VARIABLE = 256
MAX_AUX = 4096
MAX_TEXT = 4096
MAX_OMIT = 256


class ParcelError(Exception):
    """A parcel that no honest peer sends."""


class Kind(IntEnum):
    """What a parcel holds."""

    POSTS = 1
    RELAYED = 2
    REGISTER = 3
    UNREGISTER = 4
    MAIL = 5
    NOTICE = 6


CONTROL = frozenset({Kind.REGISTER, Kind.UNREGISTER})

PostRow = tuple[str, Value, float, str]
"""Name, value, mission time, aux: what a client says of a post. Its source is known by the connection."""

_FEW = 4
"""Up to so many rows are checked one by one; more of them column by column, at the speed of C."""

_VALUE_TYPES = frozenset({float, str, bytes})
_STRING = frozenset({str})
_FLOAT = frozenset({float})
_make_message = partial(tuple.__new__, Message)


class Posts(NamedTuple):
    number: int
    messages: list[Message]


class Mail(NamedTuple):
    number: int
    messages: list[Message]


class Register(NamedTuple):
    number: int
    pattern: str
    source: str
    interval: float
    omit: tuple[str, ...]


class Unregister(NamedTuple):
    """Withdraw `pattern`; an empty `source` means whatever source it was registered with."""

    number: int
    pattern: str
    source: str


class Notice(NamedTuple):
    """Refused writes: rows of variable, explanation and how often."""

    number: int
    rows: tuple[tuple[str, str, int], ...]


Parcel = Posts | Mail | Register | Unregister | Notice


def check_variable(name: str) -> None:
    """Accept a variable name that the other side will accept.

    Raises:
        ValueError: empty, too long or no text.
    """
    if type(name) is not str or not name or len(name) > MAX_VARIABLE or not is_text(name):
        raise ValueError(f"a variable name is text of 1 to {MAX_VARIABLE} characters, not {name!r:.60}")


def is_text(text: str) -> bool:
    """Whether `text` has a UTF-8 form (bytes smuggled in as surrogates allowed, others not)."""
    if not text.isascii():
        try:
            text.encode("utf-8", "surrogateescape")
        except UnicodeEncodeError:
            return False
    return True


class Parser:
    """Turns the records of one peer into parcels; `source` and `community` are put on its posts."""

    def __init__(self, source: str = "", community: str = "") -> None:
        self._source = source
        self._community = community

    def parse(self, record: bytes) -> Parcel:
        """The parcel in `record`, every field checked.

        Raises:
            ParcelError: anything else.
        """
        try:
            body = msgpack.unpackb(record, use_list=False, unicode_errors="surrogateescape")
            number, kind = body[0], body[1]
            if type(number) is not int or number < 0 or type(kind) is not int:
                raise ParcelError("header")
            return self._parse_body(number, kind, body)
        except ParcelError:
            raise
        except Exception as error:
            # Whatever shape a stranger's bytes decode to, the answer is the same.
            raise ParcelError(type(error).__name__) from None

    def _parse_body(self, number: int, kind: int, body: tuple[Any, ...]) -> Parcel:
        if kind == Kind.POSTS:
            _, _, rows = body
            if len(rows) <= _FEW:
                return Posts(number, self._few_posts(rows))
            names, values, times, auxes = _columns(rows, 4)
            _check_columns(names, values, times, auxes)
            messages: Iterator[Message] = map(
                _make_message, zip(names, values, times, repeat(self._source), auxes, repeat(self._community))
            )
            return Posts(number, list(messages))
        if kind == Kind.MAIL or kind == Kind.RELAYED:
            _, _, rows = body
            if len(rows) <= _FEW:
                full = _few_messages(rows)
            else:
                names, values, times, sources, auxes, communities = _columns(rows, 6)
                _check_columns(names, values, times, auxes)
                _check_strings(sources, MAX_VARIABLE)
                _check_strings(communities, MAX_VARIABLE)
                full = list(map(_make_message, rows))
            return Mail(number, full) if kind == Kind.MAIL else Posts(number, full)
        if kind == Kind.REGISTER:
            _, _, pattern, source, interval, omit = body
            _check_strings((pattern, source, *omit), MAX_VARIABLE)
            if not pattern or type(omit) is not tuple or len(omit) > MAX_OMIT:
                raise ParcelError("registration")
            if type(interval) is not float or not 0.0 <= interval < float("inf"):
                raise ParcelError("interval")
            return Register(number, pattern, source, interval, omit)
        if kind == Kind.UNREGISTER:
            _, _, pattern, source = body
            _check_strings((pattern, source), MAX_VARIABLE)
            return Unregister(number, pattern, source)
        if kind == Kind.NOTICE:
            _, _, rows = body
            names, texts, counts = _columns(rows, 3)
            _check_strings(names, MAX_VARIABLE)
            _check_strings(texts, MAX_TEXT)
            if set(map(type, counts)) != {int}:
                raise ParcelError("notice")
            return Notice(number, rows)
        raise ParcelError(f"kind {kind}")

    def _few_posts(self, rows: Any) -> list[Message]:
        messages: list[Message] = []
        for name, value, time, aux in _rows(rows):
            _check_row(name, value, time, aux)
            messages.append(Message(name, value, time, self._source, aux, self._community))
        return messages


def _few_messages(rows: Any) -> list[Message]:
    messages: list[Message] = []
    for name, value, time, source, aux, community in _rows(rows):
        _check_row(name, value, time, aux)
        if type(source) is not str or type(community) is not str:
            raise ParcelError("text")
        if len(source) > MAX_VARIABLE or len(community) > MAX_VARIABLE:
            raise ParcelError("text")
        messages.append(Message(name, value, time, source, aux, community))
    return messages


def _rows(rows: Any) -> Any:
    if type(rows) is not tuple or not rows or not all(type(row) is tuple for row in rows):
        raise ParcelError("rows")
    return rows


def _check_row(name: Any, value: Any, time: Any, aux: Any) -> None:
    if type(name) is not str or not 0 < len(name) <= MAX_VARIABLE:
        raise ParcelError("name")
    if type(value) not in _VALUE_TYPES:
        raise ParcelError("value")
    if type(time) is not float or not isfinite(time):
        raise ParcelError("time")
    if type(aux) is not str or len(aux) > MAX_AUX:
        raise ParcelError("aux")


def _columns(rows: Any, width: int) -> tuple[tuple[Any, ...], ...]:
    if type(rows) is not tuple or not rows or set(map(type, rows)) != {tuple}:
        raise ParcelError("rows")
    columns = tuple(zip(*rows, strict=True))
    if len(columns) != width:
        raise ParcelError("row width")
    return columns


def _check_strings(column: Iterable[Any], longest: int) -> None:
    column = set(column)
    if not _STRING.issuperset(map(type, column)) or max(map(len, column)) > longest:
        raise ParcelError("text")


def _check_columns(names: Any, values: Any, times: Any, auxes: Any) -> None:
    distinct = set(names)
    _check_strings(distinct, MAX_VARIABLE)
    if "" in distinct:
        raise ParcelError("empty name")
    if not _VALUE_TYPES.issuperset(map(type, values)):
        raise ParcelError("value")
    if not _FLOAT.issuperset(map(type, times)) or not all(map(isfinite, times)):
        raise ParcelError("time")
    _check_strings(auxes, MAX_AUX)


def split(rows: Sequence[tuple[Any, ...]]) -> Iterator[Sequence[tuple[Any, ...]]]:
    """Cut rows (value at index 1) into batches bounded in number and bytes, in order."""
    if len(rows) == 1:
        yield rows
        return
    for start in range(0, len(rows), BATCH):
        chunk = rows[start : start + BATCH]
        values = [row[1] for row in chunk]
        if _FLOAT.issuperset(map(type, values)):
            yield chunk
            continue
        first = total = 0
        for index, value in enumerate(values):
            size = ROW_BYTES if type(value) is float else ROW_BYTES + len(value)
            if total and total + size > BATCH_BYTES:
                yield chunk[first:index]
                first, total = index, 0
            total += size
        yield chunk[first:]


class _Entry(NamedTuple):
    number: int
    kind: Kind
    rows: int
    record: bytes


class Outbox:
    """Parcels made for one peer and kept until it has acknowledged them."""

    def __init__(self) -> None:
        self.rows = 0
        self.bytes = 0
        self._number = 0
        self._entries: deque[_Entry] = deque()
        self._settled = 0
        self._packer = msgpack.Packer(use_bin_type=True, unicode_errors="surrogateescape")

    def add(self, kind: Kind, *content: Any, rows: int = 1) -> bytes:
        """Number, pack and keep a parcel; returns the framed record to submit to the link."""
        self._number += 1
        record = self._pack((self._number, kind, *content))
        self._entries.append(_Entry(self._number, kind, rows, record))
        self.rows += rows
        self.bytes += len(record)
        return record

    def settle(self, acknowledged: int) -> None:
        """Forget parcels that the peer has; `acknowledged` counts all since the last `resume`."""
        while self._settled < acknowledged:
            self._settled += 1
            self._forget(self._entries.popleft())

    def discard_last(self) -> None:
        """Take back the parcel added last (it turned out too large for the link)."""
        self._forget(self._entries.pop())

    def resume(self, received: int, first: Iterable[tuple[Any, ...]] | None = None) -> list[bytes]:
        """Framed records to submit to a new link, given the number of the last parcel that the peer has.

        With `first` (kind and content of parcels) the peer has forgotten the session: these go
        first, unnumbered, and kept control parcels, which they replace, are dropped.
        """
        keep = [
            entry
            for entry in self._entries
            if (entry.number > received or not entry.number) and (first is None or entry.kind not in CONTROL)
        ]
        if first is not None:
            ahead = [_Entry(0, Kind(content[0]), 1, self._pack((0, *content))) for content in first]
            keep = ahead + keep
        self._entries = deque(keep)
        self.rows = sum(entry.rows for entry in keep)
        self.bytes = sum(len(entry.record) for entry in keep)
        self._settled = 0
        return [entry.record for entry in keep]

    def _pack(self, content: tuple[Any, ...]) -> bytes:
        try:
            return frame_record(self._packer.pack(content))
        except UnicodeEncodeError:
            # Half a surrogate pair, which no client session accepts but an app in the database's
            # own process may post: it becomes a question mark rather than the end of the server.
            return frame_record(msgpack.packb(content, unicode_errors="replace"))

    def _forget(self, entry: _Entry) -> None:
        self.rows -= entry.rows
        self.bytes -= len(entry.record)
