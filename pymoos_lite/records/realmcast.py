"""Realm casts: tables of a community's variables on request (community.md 11).

REALMCAST_REQ asks; REALMCAST answers with a table, WATCHCAST with one variable, REALMCAST_CHANNELS lists what
can be asked for.
"""

from __future__ import annotations

from dataclasses import dataclass

from pymoos_lite.records.csp import RecordError, clip, num, parse_number, split_protected

MAX_DURATION = 3600.0
MAX_VARIABLES = 200
_WORDS = ("nosrc", "nocom", "nosubs", "mask", "wrap", "trunc", "utc", "force")
_KEYS = ("client", "channel", "duration", "vars")


@dataclass(frozen=True, slots=True)
class RealmCastRequest:
    """`client` wants `channel` (an app, a history) or single `variables` for `duration` wall seconds.

    `words` are from nosrc, nocom, nosubs, mask, wrap, trunc, utc, force.
    """

    client: str
    channel: str = ""
    duration: float = 0.0
    variables: tuple[str, ...] = ()
    words: frozenset[str] = frozenset()

    @classmethod
    def parse(cls, text: str) -> RealmCastRequest:
        """Record from text; raises RecordError for an unknown word or a missing field."""
        found: dict[str, str] = {}
        words = set()
        for piece in split_protected(text):
            key, equals, value = (part.strip() for part in piece.partition("="))
            if not equals and key.lower() in _WORDS:
                words.add(key.lower())
            elif equals and key.lower() in _KEYS:
                found[key.lower()] = value
            elif piece:
                raise RecordError("REALMCAST_REQ", f"unknown word '{clip(piece)}'")
        duration = parse_number(found.get("duration", ""))
        if not found.get("client"):
            raise RecordError("REALMCAST_REQ", "there is no client")
        if duration is None or duration <= 0.0:
            raise RecordError("REALMCAST_REQ", "there is no duration above 0")
        variables = tuple(name.strip() for name in found.get("vars", "").split(":") if name.strip())
        if not found.get("channel") and not variables:
            raise RecordError("REALMCAST_REQ", "there is neither channel nor vars")
        return cls(
            found["client"],
            found.get("channel", ""),
            min(duration, MAX_DURATION),
            variables[:MAX_VARIABLES],
            frozenset(words),
        )

    def to_text(self) -> str:
        parts = [f"client={self.client}"]
        parts.append(f"vars={':'.join(self.variables)}" if self.variables else f"channel={self.channel}")
        parts.append(f"duration={num(self.duration)}")
        return ",".join([*parts, *(word for word in _WORDS if word in self.words)])


@dataclass(frozen=True, slots=True)
class RealmCast:
    """The table of one channel: `lines` of text, `count` the running number of casts of that channel."""

    node: str
    proc: str
    lines: tuple[str, ...] = ()
    count: int | None = None

    def to_text(self) -> str:
        count = "" if self.count is None else f"count={self.count}!Q!"
        body = "".join(f"{line}!Z!" for line in self.lines)
        return f"node={self.node}!Q!proc={self.proc}!Q!{count}messages={body}"

    @classmethod
    def parse(cls, text: str) -> RealmCast:
        """Record from text; raises RecordError without node or proc."""
        found = _fields(text, "!Q!")
        if not found.get("node") or not found.get("proc"):
            raise RecordError("REALMCAST", f"expected node=...!Q!proc=..., found '{clip(text)}'")
        lines = found.get("messages", "").split("!Z!")
        if lines[-1] == "":
            lines.pop()
        count = parse_number(found.get("count", ""))
        return cls(found["node"], found["proc"], tuple(lines), None if count is None else int(count))


@dataclass(frozen=True, slots=True)
class WatchCast:
    """One variable of one community; `value` is a number, text, or None for a variable without value."""

    node: str
    variable: str
    source: str
    community: str
    local_time: float
    utc_time: float
    value: float | str | None

    def to_text(self) -> str:
        number = isinstance(self.value, float)
        shown = (
            num(self.value, 3)
            if isinstance(self.value, float)
            else "n/a"
            if self.value is None
            else self.value
        )
        return "!X!".join(
            (
                f"node={self.node}",
                f"var={self.variable}",
                f"src={self.source or 'n/a'}",
                f"comm={self.community or 'n/a'}",
                f"loc_time={num(self.local_time, 2)}",
                f"utc_time={num(self.utc_time, 2)}",
                f"{'dval' if number else 'sval'}={shown}",
            )
        )

    @classmethod
    def parse(cls, text: str) -> WatchCast:
        """Record from text; raises RecordError without variable, source or community."""
        found = _fields(text, "!X!")
        if not all(found.get(key) for key in ("var", "src", "comm")):
            raise RecordError("WATCHCAST", f"expected var, src and comm, found '{clip(text)}'")
        number = parse_number(found.get("dval", ""))
        times = [parse_number(found.get(key, "")) for key in ("loc_time", "utc_time")]
        return cls(
            found.get("node", ""),
            found["var"],
            found["src"],
            found["comm"],
            -1.0 if times[0] is None else times[0],
            0.0 if times[1] is None else times[1],
            number if number is not None else found.get("sval"),
        )


def channels_text(node: str, apps: list[str], histories: list[str]) -> str:
    """REALMCAST_CHANNELS: a comma precedes the list of histories even when it is empty."""
    return f"node={node}#channels={','.join(sorted(apps))},{','.join(histories)}"


def parse_channels(text: str) -> tuple[str, list[str]]:
    """Node and channels of a REALMCAST_CHANNELS; raises RecordError without a node."""
    found = _fields(text, "#")
    if not found.get("node"):
        raise RecordError("REALMCAST_CHANNELS", f"expected node=...#channels=..., found '{clip(text)}'")
    return found["node"], [name for name in found.get("channels", "").split(",") if name]


def _fields(text: str, separator: str) -> dict[str, str]:
    pairs = (piece.partition("=") for piece in text.split(separator))
    return {key.strip(): value for key, equals, value in pairs if equals}
