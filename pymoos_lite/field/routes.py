"""What a share sends where: the grammar of routes, the table that decides (native_wire.md 3).

Text in, decisions out; no socket. Times are mission seconds.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from mypy_extensions import mypyc_attr

from pymoos_lite.core.message import Message
from pymoos_lite.core.subscriptions import is_pattern, matches

DEFAULT_GROUP = "224.1.1.11"
DEFAULT_BASE_PORT = 24460
_HOST = re.compile(r"[A-Za-z0-9._-]{1,253}\Z")
_MULTICAST = re.compile(r"multicast_(\d{1,3})\Z", re.IGNORECASE)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)\Z")


class RouteError(ValueError):
    """A text that is no route or share; says what would be right."""


class Endpoint(NamedTuple):
    """A place to send to or listen at: `host` as configured, or the multicast channel `channel`."""

    host: str
    port: int
    channel: int = -1

    def __str__(self) -> str:
        """As the summaries write it: ``host:port``, with ``:multicast_N`` for a channel."""
        suffix = f":multicast_{self.channel}" if self.channel >= 0 else ""
        return f"{self.host}:{self.port}{suffix}"


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Channels:
    """Where multicast channels are: channel N is `group` at port `base_port` + N."""

    group: str = DEFAULT_GROUP
    base_port: int = DEFAULT_BASE_PORT

    def endpoint(self, channel: int) -> Endpoint:
        return Endpoint(self.group, self.base_port + channel, channel)


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Share:
    """A wish to share: what, under which name (None: unchanged), where, and within which limits.

    `frequency` in Hz (0: no limit), `duration` in mission seconds (None: for ever, 0: the current
    value once), `max_shares` None for any number.
    """

    source: str
    alias: str | None
    to: Endpoint
    frequency: float = 0.0
    duration: float | None = None
    max_shares: int | None = None

    @property
    def variable(self) -> str:
        return self.source.partition(":")[0]

    @property
    def app(self) -> str:
        return self.source.partition(":")[2] or "*"

    @property
    def is_wild(self) -> bool:
        return ":" in self.source or is_pattern(self.source)

    @property
    def identity(self) -> tuple[str, str | None, Endpoint]:
        """Two shares with the same identity are one route; the later replaces the earlier."""
        return self.source, self.alias, self.to


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Listening:
    """A wish to listen at some places, and the patterns of names let in (none: all)."""

    at: tuple[Endpoint, ...]
    white_list: tuple[str, ...] = ()


def parse_endpoint(text: str, channels: Channels) -> Endpoint:
    """``host:port`` or ``multicast_N``.

    Raises:
        RouteError: neither.
    """
    found = _MULTICAST.match(text)
    if found:
        return channels.endpoint(int(found.group(1)))
    host, colon, port = text.rpartition(":")
    if not colon or not _HOST.match(host) or not (port.isascii() and port.isdigit() and len(port) < 6):
        raise RouteError(f"'{text}' is no route: give host:port or multicast_N")
    if not 0 < int(port) <= 65535:
        raise RouteError(f"'{text}': a port lies in 1..65535")
    return Endpoint(host, int(port))


def parse_output(text: str, channels: Channels) -> list[Share]:
    """The shares of an `output` line, long or short form (native_wire.md 3.3).

    Raises:
        RouteError: it has neither form.
    """
    compact = "".join(text.split())
    if "route" in compact.lower():
        return parse_output_fields(_fields(compact), channels)
    source, arrow, targets = compact.partition("->")
    if not arrow or not source or not targets:
        raise RouteError("expected src_name=VAR,[dest_name=VAR,]route=HOST:PORT, or VAR->[NAME:]HOST:PORT")
    shares = []
    for target in targets.split("&"):
        place, at, rate = target.partition("@")
        frequency = _number("@", rate) if at else 0.0
        words = place.split(":")
        if _MULTICAST.match(words[-1]) and len(words) <= 2:
            alias, place = (words[0] if len(words) == 2 else None), words[-1]
        elif len(words) in (2, 3):
            alias, place = (words[0] if len(words) == 3 else None), ":".join(words[-2:])
        else:
            raise RouteError(f"'{target}': expected [NAME:]HOST:PORT[@HZ] or [NAME:]multicast_N[@HZ]")
        shares.append(Share(source, alias or None, parse_endpoint(place, channels), frequency))
    return shares


def parse_output_fields(values: dict[str, str], channels: Channels) -> list[Share]:
    """The shares that the fields of an `output` line or command ask for, one per route.

    Raises:
        RouteError: a field is missing or no number.
    """
    for needed in ("src_name", "route"):
        if not values.get(needed):
            raise RouteError(f"{needed} is missing: expected src_name=VAR,[dest_name=VAR,]route=HOST:PORT")
    duration = values.get("duration")
    shares = values.get("max_shares")
    most = int(_number("max_shares", shares)) if shares else None
    return [
        Share(
            source=values["src_name"],
            alias=values.get("dest_name") or None,
            to=parse_endpoint(place, channels),
            frequency=max(0.0, _number("frequency", values.get("frequency") or "0")),
            # The reference has no limit for a negative duration or count either.
            duration=seconds if duration and (seconds := _number("duration", duration)) >= 0.0 else None,
            max_shares=most if most is not None and most >= 0 else None,
        )
        for place in values["route"].split("&")
    ]


def parse_input(text: str, channels: Channels) -> Listening:
    """An `input` line: ``route=R[&R...][,white_list=P&P...]``.

    Raises:
        RouteError: it has another form.
    """
    return parse_input_fields(_fields("".join(text.split())), channels)


def parse_input_fields(values: dict[str, str], channels: Channels) -> Listening:
    """What the fields of an `input` line or command ask for.

    Raises:
        RouteError: there is no usable route.
    """
    if not values.get("route"):
        raise RouteError("route is missing: expected route=HOST:PORT[,white_list=NAME&NAME]")
    allowed = tuple(p for p in values.get("white_list", "").split("&") if p)
    return Listening(tuple(parse_endpoint(r, channels) for r in values["route"].split("&")), allowed)


def parse_command(text: str) -> tuple[str, dict[str, str]]:
    """Verb and fields of a PSHARE_CMD (native_wire.md 3.6).

    Raises:
        RouteError: there is no `cmd`, or a piece has no ``=``.
    """
    values = _fields("".join(text.split()))
    verb = values.pop("cmd", "").lower()
    if verb not in ("output", "input", "remove"):
        raise RouteError(f"cmd={verb or '(nothing)'}: expected cmd=output, cmd=input or cmd=remove")
    return verb, values


def _fields(compact: str) -> dict[str, str]:
    values: dict[str, str] = {}
    for piece in compact.split(","):
        if not piece:
            continue
        name, equals, value = piece.partition("=")
        if not equals:
            raise RouteError(f"'{piece[:40]}': expected name=value")
        values[name.lower()] = value
    return values


def _number(name: str, text: str) -> float:
    if not _NUMBER.match(text) or len(text) > 20:
        raise RouteError(f"{name}={text[:20]}: expected a number")
    return float(text)


@dataclass(slots=True, eq=False)
class Output:
    """One variable on its way to one place, and how often it went."""

    source: str
    name: str
    share: Share
    created: float
    wild: bool = False
    shares: int = 0
    skipped: int = 0
    bytes: int = 0
    last: float = field(default=float("-inf"))
    limited: bool = field(init=False)

    def __post_init__(self) -> None:
        share = self.share
        self.limited = share.frequency > 0.0 or share.duration is not None or share.max_shares is not None

    def wants(self, now: float) -> bool:
        """Whether a message may go out now, by frequency, duration and count (native_wire.md 3.5)."""
        if not self.limited:
            return True
        share = self.share
        if share.max_shares is not None and self.shares >= share.max_shares:
            return False
        if share.duration is not None:
            if share.duration == 0.0:
                return self.shares == 0
            if now - self.created > share.duration:
                return False
        # Compared with a little slack: a source at exactly the allowed rate must not lose every
        # second value to rounding.
        return share.frequency <= 0.0 or (now - self.last) * share.frequency >= 1.0 - 1e-6

    def sent(self, now: float, size: int = 0) -> None:
        self.shares += 1
        self.bytes += size
        self.last = now


class OutputTable:
    """All outputs of a share, by variable."""

    def __init__(self) -> None:
        self.by_variable: dict[str, list[Output]] = {}
        self.plain: set[str] = set()
        """Variables shared by a route of their own: they are not taken in (the loop guard)."""
        self._wild: dict[tuple[str, str | None, Endpoint], tuple[Share, float]] = {}

    def add(self, share: Share, now: float) -> Output | None:
        """Add or replace a route; the new `Output`, None for a wildcard (those make outputs later)."""
        if share.is_wild:
            self._wild.pop(share.identity, None)
            self._wild[share.identity] = (share, now)
            for outputs in self.by_variable.values():
                outputs[:] = [o for o in outputs if not (o.wild and o.share.identity == share.identity)]
            return None
        name = share.alias or share.source
        output = Output(share.source, name, share, now)
        outputs = self.by_variable.setdefault(share.source, [])
        outputs[:] = [o for o in outputs if o.wild or o.share.identity != share.identity]
        outputs.append(output)
        self.plain.add(share.source)
        return output

    def remove(self, share: Share) -> int:
        """Withdraw a route; the number of outputs that end."""
        self._wild.pop(share.identity, None)
        ended = 0
        for name, outputs in list(self.by_variable.items()):
            kept = [o for o in outputs if not self._same(o.share, share)]
            ended += len(outputs) - len(kept)
            outputs[:] = kept
            if not any(not o.wild for o in kept):
                self.plain.discard(name)
            if not kept:
                del self.by_variable[name]
        return ended

    @staticmethod
    def _same(one: Share, other: Share) -> bool:
        return (one.source, one.alias or one.source, one.to) == (
            other.source,
            other.alias or other.source,
            other.to,
        )

    def is_plain(self, name: str) -> bool:
        """Whether `name` is in `plain`."""
        return name in self.plain

    @property
    def has_wildcards(self) -> bool:
        return bool(self._wild)

    def find(self, message: Message, now: float) -> list[Output]:
        """The outputs of a message; a wildcard that covers it for the first time makes one."""
        name = message.name
        outputs = self.by_variable.get(name)
        if name in self.plain or not self._wild:
            return outputs or []
        found = []
        for share, _ in self._wild.values():
            if not matches(share.variable, name) or not matches(share.app, message.source):
                continue
            if outputs is None:
                outputs = self.by_variable[name] = []
            output = next((o for o in outputs if o.share is share), None)
            if output is None:
                output = Output(name, renamed(share, name), share, now, wild=True)
                outputs.append(output)
            found.append(output)
        return found

    def plain_shares(self) -> Iterator[Share]:
        for outputs in self.by_variable.values():
            for output in outputs:
                if not output.wild:
                    yield output.share

    def wild_shares(self) -> Iterator[Share]:
        for share, _ in self._wild.values():
            yield share

    def outputs(self) -> Iterator[Output]:
        """All outputs, by variable."""
        for name in sorted(self.by_variable):
            yield from self.by_variable[name]

    def summary(self) -> str:
        """``PSHARE_OUTPUT_SUMMARY`` (native_wire.md 3.7)."""
        rows = []
        for name in sorted(self.by_variable):
            routes = [f"{o.name}:{o.share.to}" for o in self.by_variable[name]]
            if routes:
                rows.append(f"{name}->{' & '.join(routes)}")
        return ", ".join(rows)


def renamed(share: Share, name: str) -> str:
    """The name under which a wildcard share sends variable `name` (native_wire.md 3.4).

    >>> to = Endpoint("localhost", 9200)
    >>> renamed(Share("CAR_*", "^", to), "CAR_SPEED"), renamed(Share("NAV_*", "OLD_", to), "NAV_X")
    ('SPEED', 'OLD_NAV_X')
    """
    alias, pattern = share.alias, share.variable
    if alias is None or is_pattern(alias):
        return name
    if alias == "^":
        if (
            pattern.count("*") == 1
            and "?" not in pattern
            and pattern[-1] == "*"
            and len(name) > len(pattern) - 1
        ):
            return name[len(pattern) - 1 :]
        if (
            pattern.count("*") == 1
            and "?" not in pattern
            and pattern[0] == "*"
            and len(name) > len(pattern) - 1
        ):
            return name[: len(name) - len(pattern) + 1]
        return name
    return alias + name


def parse_output_summary(text: str) -> set[tuple[str, str, str]]:
    """The (source, name, endpoint) triples of a PSHARE_OUTPUT_SUMMARY; what is malformed is left out."""
    found = set()
    for row in text.split(", "):
        source, arrow, routes = row.partition("->")
        if not arrow:
            continue
        for route in routes.split(" & "):
            name, colon, place = route.strip().partition(":")
            if colon:
                found.add((source.strip(), name, place))
    return found


def parse_input_summary(text: str) -> list[str]:
    """The routes of a PSHARE_INPUT_SUMMARY as brokers write them: ``host:port`` or ``multicast_N``."""
    routes = []
    for entry in re.split(r"[,&]", text):
        words = entry.strip().split(":")
        if len(words) == 3 and _MULTICAST.match(words[2]):
            routes.append(words[2])
        elif len(words) == 2 and words[1].isascii() and words[1].isdigit() and _HOST.match(words[0]):
            routes.append(":".join(words))
    return routes
