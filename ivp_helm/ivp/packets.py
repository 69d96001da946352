"""Packets: one encoded function as several bounded messages, and back.

    P,<id>,<count>,<number>,<body>

The id is `<behaviour name>^<helm iteration>`, numbers run from 1, and the bodies in order make up the
text. `Joiner` takes packets in any order from any number of senders and stays bounded whatever it is
sent. Source: ivp_math.md 9.3.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from ivp_helm.ivp.errors import IvPError

PACKET_SIZE: Final = 2000
MAX_PACKETS: Final = 20_000  # of one function
MAX_OPEN: Final = 512  # functions of which some packets are still missing


class Packet(NamedTuple):
    """One packet, taken apart."""

    id: str
    total: int
    number: int
    body: str


class Joined(NamedTuple):
    """A function whose packets are all there; time and source are those of the first packet seen."""

    text: str
    id: str
    time: float
    source: str


def split_packets(text: str, id: str, size: int = PACKET_SIZE) -> list[str]:
    """Cut an encoded function into packets of at most `size` characters (a helm uses 2000).

    As in MOOS-IvP a packet's body holds size - (len(id) + 50) characters, and a text that fills its
    packets exactly ends with an empty one. Raises `IvPError` when an id holds a comma or leaves no room.
    """
    if not id or "," in id:
        raise IvPError(f"packet id {id!r}: must not be empty or hold a comma")
    room = size - (len(id) + 50)
    if room < 1:
        raise IvPError(
            f"packet size {size} leaves no room beside the id {id!r}; at least {len(id) + 51} is needed"
        )
    count = len(text) // room + 1
    if count > MAX_PACKETS:
        raise IvPError(f"packet id {id!r}: {len(text)} characters need more than {MAX_PACKETS} packets")
    return [f"P,{id},{count},{i + 1},{text[i * room : (i + 1) * room]}" for i in range(count)]


def parse_packet(text: str) -> Packet:
    """Take one packet apart; raises `IvPError` when it is none."""
    parts = text.split(",", 4)
    if len(parts) != 5 or parts[0] != "P":
        raise IvPError(f"packet {text[:40]!r}: expected 'P,<id>,<count>,<number>,<body>'")
    _, id, count_text, number_text, body = parts
    numbers_ok = all(t.isascii() and t.isdigit() and len(t) <= 6 for t in (count_text, number_text))
    if not id or not numbers_ok:
        raise IvPError(f"packet {text[:40]!r}: the id, count or number is missing or no whole number")
    count, number = int(count_text), int(number_text)
    if not 1 <= count <= MAX_PACKETS:
        raise IvPError(f"packet {text[:40]!r}: count {count} is not 1 to {MAX_PACKETS}")
    if not 1 <= number <= count:
        raise IvPError(f"packet {text[:40]!r}: number {number} is not 1 to {count}")
    return Packet(id, count, number, body)


def join_packets(packets: Iterable[str]) -> str:
    """Put the packets of one function, in any order, together again.

    Raises `IvPError` when they are of different functions, one comes twice, or some are missing.
    """
    joiner = Joiner()
    text: str | None = None
    last: Packet | None = None
    for packet in packets:
        parsed = parse_packet(packet)
        if last is not None and parsed.id != last.id:
            raise IvPError(f"packets of two functions: {last.id!r} and {parsed.id!r}")
        if text is not None:
            raise IvPError(f"packet {parsed.number} of {parsed.id!r}: all {parsed.total} are there already")
        last = parsed
        joined = joiner.add(packet, now=0.0)
        text = joined.text if joined else None
    if last is None:
        raise IvPError("no packets to join")
    if text is None:
        raise IvPError(f"packets of {last.id!r}: {joiner.missing(last.id)} of {last.total} missing")
    return text


@dataclass
class _Group:
    count: int
    time: float
    source: str
    bodies: dict[int, str] = field(default_factory=dict)


class Joiner:
    """Collects packets until functions are complete.

    Packets are grouped by sender and id, since two vehicles may use the same ids. Groups older than
    `patience` seconds, and the oldest when more than 512 are open, are dropped and counted in `dropped`.
    """

    def __init__(self, patience: float = 10.0) -> None:
        self.patience = patience
        self.dropped = 0
        self._groups: dict[tuple[str, str], _Group] = {}

    def __len__(self) -> int:
        """How many functions are incomplete."""
        return len(self._groups)

    def add(self, packet: str, now: float, source: str = "", community: str = "") -> Joined | None:
        """Take one packet; gives back the function when this packet completes it.

        Raises `IvPError` for a malformed packet, a second copy of a number, or a count that differs from
        that of the first packet seen; what was collected so far stays.
        """
        id, count, number, body = parse_packet(packet)
        key = (community, id)
        group = self._groups.get(key)
        if group is None:
            self.expire(now)
            if len(self._groups) >= MAX_OPEN:
                del self._groups[next(iter(self._groups))]
                self.dropped += 1
            group = self._groups[key] = _Group(count, now, source)
        if count != group.count:
            raise IvPError(f"packet {number} of {id!r}: count {count}, but {group.count} in the first packet")
        if number in group.bodies:
            raise IvPError(f"packet {number} of {id!r}: came before")
        group.bodies[number] = body
        if len(group.bodies) < count:
            return None
        del self._groups[key]
        text = "".join(group.bodies[i] for i in range(1, count + 1))
        return Joined(text, id, group.time, group.source)

    def missing(self, id: str, community: str = "") -> int:
        """How many packets of an incomplete function are still to come (0 if it is unknown)."""
        group = self._groups.get((community, id))
        return group.count - len(group.bodies) if group else 0

    def expire(self, now: float) -> None:
        """Drop what has waited longer than `patience` seconds."""
        late = [key for key, group in self._groups.items() if now - group.time > self.patience]
        for key in late:
            del self._groups[key]
        self.dropped += len(late)
