"""Both ends of a stream of letters: grouping messages into datagrams, and taking datagrams apart again.

No socket and no clock: payloads come in and go out as values, wall time (seconds) as an argument.
All memory is bounded, whatever a stranger sends.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field

from pymoos_lite.app.network import Address, Bundle, Payload
from pymoos_lite.core.message import Message
from pymoos_lite.field.datagrams import (
    OVERHEAD,
    DatagramError,
    Fault,
    Fragment,
    Letter,
    decode,
    encode_fragments,
    encode_letter,
    messages_of,
    parts_for,
    rows_of,
)

WINDOW = 1024
MAX_STREAMS = 256
MAX_PARTIAL = 64
MAX_PARTIAL_BYTES = 8 << 20
FRAGMENT_PATIENCE = 5.0
"""Wall seconds after which a message with missing fragments is given up."""


class Outbox:
    """Messages on their way to one address, grouped into as few datagrams as possible."""

    def __init__(self, stream: int, budget: int, by_reference: bool, key: bytes | None) -> None:
        self._stream = stream
        self._number = 0
        self._budget = budget
        self._room = budget - OVERHEAD
        self._by_reference = by_reference
        self._key = key
        self.messages: list[Message] = []
        """Taken and not yet returned."""
        self._bytes = 0

    def add(self, message: Message, size: int, now: float) -> list[Payload]:
        """Take a message; returns what is full by that."""
        out: list[Payload] = []
        if self._bytes + size > self._room:
            out = self.flush(now)
        if size > self._room:
            return out + self._long(message, size, now)
        self.messages.append(message)
        self._bytes += size
        return out

    def flush(self, now: float) -> list[Payload]:
        """What has been taken and not yet returned."""
        if not self.messages:
            return []
        letter = self._letter(tuple(self.messages), now)
        size = self._bytes + OVERHEAD
        self.messages.clear()
        self._bytes = 0
        if self._by_reference:
            return [Bundle(letter, size)]
        datagram = encode_letter(letter, self._key)
        if len(datagram) <= self._budget:
            return [datagram]
        # Sizes count characters; text outside ASCII takes more bytes than that.
        return list(encode_fragments(letter, self._budget, self._key))

    def _long(self, message: Message, size: int, now: float) -> list[Payload]:
        letter = self._letter((message,), now)
        if self._by_reference:
            parts = parts_for(size, self._budget)
            return [Bundle(letter, size + OVERHEAD * parts, parts)]
        return list(encode_fragments(letter, self._budget, self._key))

    def _letter(self, messages: tuple[Message, ...], now: float) -> Letter:
        self._number += 1
        return Letter(self._stream, self._number, now, messages)


@dataclass(slots=True)
class _Partial:
    """A long message of which some fragments have come."""

    count: int
    since: float
    sent: float
    chunks: dict[int, bytes] = field(default_factory=dict)
    bytes: int = 0


@dataclass(slots=True)
class Stream:
    """One sender as a receiver knows it."""

    sender: Address
    community: str = ""
    highest: int = 0
    first: int = 0
    received: int = 0
    messages: int = 0
    delay: float = 0.0
    last: float = 0.0
    _seen: int = 0

    @property
    def lost(self) -> int:
        """Letters that were sent since the first we had, and never came (so far)."""
        return max(0, self.highest - self.first + 1 - self.received) if self.received else 0

    def knows(self, number: int) -> bool:
        """Whether letter `number` came before, or is too old to know."""
        behind = self.highest - number
        return self.received > 0 and behind >= 0 and (behind >= WINDOW or bool(self._seen >> behind & 1))

    def admit(self, number: int) -> bool:
        """Note that letter `number` came; False if it came before or is too old to know."""
        if not self.received:
            self.first = self.highest = number
            self._seen = 1
        elif number > self.highest:
            ahead = number - self.highest
            self._seen = 1 if ahead >= WINDOW else (self._seen << ahead | 1) & ((1 << WINDOW) - 1)
            self.highest = number
        elif self.knows(number):
            return False
        else:
            self._seen |= 1 << self.highest - number
            self.first = min(self.first, number)
        self.received += 1
        return True


class Inbox:
    """Takes in whatever arrives and returns sound messages; counts everything else by its fault.

    With a key, letters sealed longer than `freshness` mission seconds ago are refused: a recording
    played back must not steer a vessel.
    """

    def __init__(self, key: bytes | None = None, max_message: int = 1 << 20, freshness: float = 60.0) -> None:
        self.faults: dict[Fault, int] = {}
        self.own_streams: set[int] = set()
        """Streams of ours: a multicast channel brings them back, and they are not news."""
        self.streams: OrderedDict[tuple[Address, int], Stream] = OrderedDict()
        self._key = key
        self._max_message = max_message
        self._freshness = freshness
        self._partial: OrderedDict[tuple[Address, int, int], _Partial] = OrderedDict()
        self._partial_bytes = 0

    def take(self, payload: Payload, sender: Address, now: float, wall: float) -> list[Message]:
        """The messages of one datagram, none if it is a fragment, doubled or unusable."""
        try:
            if type(payload) is Bundle:
                return self._by_reference(payload, sender, now)
            return self._from_bytes(payload, sender, now, wall)  # type: ignore[arg-type]
        except DatagramError as error:
            self.count(error.fault)
            return []

    def count(self, fault: Fault, amount: int = 1) -> None:
        self.faults[fault] = self.faults.get(fault, 0) + amount

    def expire(self, wall: float) -> None:
        """Give up messages whose missing fragments will not come any more."""
        while self._partial:
            key, partial = next(iter(self._partial.items()))
            if wall - partial.since < FRAGMENT_PATIENCE and self._within_bounds():
                return
            self._forget(key, partial)
            self.count(Fault.INCOMPLETE)

    def _within_bounds(self) -> bool:
        return len(self._partial) <= MAX_PARTIAL and self._partial_bytes <= MAX_PARTIAL_BYTES

    def _by_reference(self, bundle: Bundle, sender: Address, now: float) -> list[Message]:
        letter = bundle.content
        if type(letter) is not Letter:
            raise DatagramError(Fault.FOREIGN)
        if self._key is not None:
            raise DatagramError(Fault.UNSEALED)
        messages = list(letter.messages)
        self._admit(sender, letter.stream, letter.number, letter.sent, now, messages)
        return messages

    def _from_bytes(self, data: bytes, sender: Address, now: float, wall: float) -> list[Message]:
        stream, number, sent, body = decode(data, self._key)
        if self._key is not None and now - sent > self._freshness:
            raise DatagramError(Fault.STALE)
        if type(body) is Fragment:
            whole = self._join(body, sender, wall)
            if whole is None:
                return []
            rows = rows_of(whole)
        else:
            rows = body
        messages, bad = messages_of(rows)
        if bad:
            self.count(Fault.BAD_MESSAGE, bad)
        self._admit(sender, stream, number, sent, now, messages)
        return messages

    def _admit(
        self,
        sender: Address,
        number_of_stream: int,
        number: int,
        sent: float,
        now: float,
        messages: list[Message],
    ) -> None:
        key = (sender, number_of_stream)
        if number_of_stream in self.own_streams:
            messages.clear()
            return
        stream = self.streams.get(key)
        if stream is None:
            stream = self.streams[key] = Stream(sender)
            if len(self.streams) > MAX_STREAMS:
                self.streams.popitem(last=False)
        if not stream.admit(number):
            raise DatagramError(Fault.DOUBLED)
        self.streams.move_to_end(key)
        stream.messages += len(messages)
        stream.last = now
        stream.delay = now - sent
        if messages and messages[0].community:
            stream.community = messages[0].community

    def _join(self, fragment: Fragment, sender: Address, wall: float) -> bytes | None:
        key = (sender, fragment.stream, fragment.number)
        partial = self._partial.get(key)
        if partial is None:
            known = self.streams.get((sender, fragment.stream))
            if known is not None and known.knows(fragment.number):
                raise DatagramError(Fault.DOUBLED)
            partial = self._partial[key] = _Partial(fragment.parts, wall, fragment.sent)
        if partial.count != fragment.parts or fragment.part in partial.chunks:
            raise DatagramError(Fault.DOUBLED)
        partial.chunks[fragment.part] = fragment.chunk
        partial.bytes += len(fragment.chunk)
        self._partial_bytes += len(fragment.chunk)
        if partial.bytes > self._max_message + OVERHEAD:
            self._forget(key, partial)
            raise DatagramError(Fault.FULL)
        if len(partial.chunks) == partial.count:
            self._forget(key, partial)
            return b"".join([partial.chunks[i] for i in range(partial.count)])
        self.expire(wall)
        return None

    def _forget(self, key: tuple[Address, int, int], partial: _Partial) -> None:
        del self._partial[key]
        self._partial_bytes -= partial.bytes
