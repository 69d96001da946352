"""What the community database keeps of each client and of each variable."""

from __future__ import annotations

from dataclasses import dataclass, field

from pymoos_lite.core.message import Message
from pymoos_lite.core.subscriptions import Route, Subscription, is_pattern


@dataclass(slots=True)
class Client:
    """A connected client: its mailbox, what it asked for and what it has written."""

    name: str
    mailbox: list[Message]
    connected_at: float
    subscriptions: dict[tuple[str, str], Subscription] = field(default_factory=dict)
    patterns: list[Subscription] = field(default_factory=list)
    exact: dict[str, list[Subscription]] = field(default_factory=dict)
    published: dict[str, None] = field(default_factory=dict)
    latencies: list[float] = field(default_factory=list)
    _published_names: tuple[str, ...] = ()
    _registered_names: tuple[str, ...] = ()

    def published_names(self) -> tuple[str, ...]:
        """Variables it has posted, in order of its first posts: the same object until there is one more."""
        if len(self._published_names) != len(self.published):
            self._published_names = tuple(self.published)
        return self._published_names

    def registered_names(self) -> tuple[str, ...]:
        """Names and patterns it is registered for: the same object until they change."""
        if len(self._registered_names) != len(self.subscriptions):
            self._registered_names = tuple([pattern for pattern, _ in self.subscriptions])
        return self._registered_names

    def wishes(self, variable: str) -> list[Subscription]:
        """The subscriptions that cover a variable."""
        found = [s for s in self.patterns if s.wants_variable(variable)]
        return found + [s for s in self.exact.get(variable, ()) if s.wants_variable(variable)]

    def add(self, subscription: Subscription) -> None:
        """Take a subscription; one of the same pattern and source is replaced."""
        self.remove(subscription.pattern, subscription.source)
        self.subscriptions[(subscription.pattern, subscription.source)] = subscription
        self._registered_names = ()
        self._shelf(subscription.pattern).append(subscription)

    def remove(self, pattern: str, source: str | None) -> bool:
        """Drop the subscriptions made with `pattern` (and `source`, if given); whether there were any."""
        keys = (
            [k for k in ((pattern, source),) if k in self.subscriptions]
            if source is not None
            else [k for k in self.subscriptions if k[0] == pattern]
        )
        for key in keys:
            self._shelf(pattern).remove(self.subscriptions.pop(key))
        self._registered_names = ()
        return bool(keys)

    def _shelf(self, pattern: str) -> list[Subscription]:
        # Names are looked up, patterns are tried one by one: most registrations are plain names.
        return self.patterns if is_pattern(pattern) else self.exact.setdefault(pattern, [])


class Record:
    """One variable: its last message, type, writers and the ways to its subscribers."""

    __slots__ = (
        "direct",
        "express",
        "filtered",
        "kind",
        "last_writes",
        "message",
        "name",
        "rate",
        "writes",
    )

    def __init__(self, name: str) -> None:
        self.name = name
        self.kind: type | None = None
        self.message: Message | None = None
        self.writes = 0
        self.last_writes = 0
        self.rate = 0.0
        # The connected client that wrote last, while nobody throttles the variable: it is nearly always the
        # next one, it is known as a writer, and its posts just go to `direct` (see `Database.door`).
        self.express = ""
        # The mailboxes of those who want every post. All others go through a Route.
        self.direct: list[list[Message]] = []
        self.filtered: dict[str, Route] = {}


@dataclass(slots=True)
class Statistics:
    """Counters a person can ask for."""

    accepted: int = 0
    refused: int = 0
    connects: int = 0
    disconnects: int = 0
    clashes: int = 0
