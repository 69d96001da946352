"""The community database: the latest value of every variable, and who asked to hear of it.

No socket and no clock: clients hand in messages and the time, the database appends to the mailbox
(a plain list) that each client was given on connecting. A host moves mail from there. It does
not know whether a client lives in the same process or at the far end of a link (community.md 6).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

from mypy_extensions import mypyc_attr

from pymoos_lite.core.entries import Client, Record, Statistics
from pymoos_lite.core.message import KIND_NAME, Message, Value
from pymoos_lite.core.refusals import NameClashError, Refusal, one_too_many, wrong_type
from pymoos_lite.core.subscriptions import Route, Subscription, is_pattern, matches
from pymoos_lite.core.summaries import SYSTEM_VARIABLES, build_system_variables

SYSTEM_PERIOD = 2.0
"""Mission seconds between two updates of the `DB_*` variables."""

MAX_REFUSALS_KEPT = 20

MAX_VARIABLES = 100_000
"""Variables that a community may have: far above any mission, and a bound on what a hostile client can cost."""
MAX_REMEMBERED = 1000


@mypyc_attr(allow_interpreted_subclasses=True)
class Database:
    """Stores last values and fans posts out to subscribers.

    Rules: the first write fixes a variable's type and later writes of another type are refused,
    visibly; a registration delivers the current value at once; a throttled subscription always
    gets the last value, late; a second client of one name is refused.
    """

    def __init__(self, community: str, now: float, max_variables: int = MAX_VARIABLES) -> None:
        self.max_variables = max_variables
        self.community = community
        self.name = f"MOOSDB_{community}"
        self.started = now
        self._statistics = Statistics()
        self._writes_before = 0
        self.refusals: list[Refusal] = []
        self._records: dict[str, Record] = {}
        self._clients: dict[str, Client] = {}
        self._throttled: dict[Route, None] = {}
        self._next_system = now
        self._system_wanted: frozenset[str] = frozenset()
        self._unwritten: dict[str, bool] = {}

    @property
    def statistics(self) -> Statistics:
        """The counters as they stand; accepted posts are summed up here, because they are so many."""
        writes = sum(record.writes for record in self._records.values())
        self._statistics.accepted = self._writes_before + writes
        return self._statistics

    # --- clients -----------------------------------------------------------------------------

    def connect(self, client: str, now: float, mailbox: list[Message] | None = None) -> list[Message]:
        """Admit `client` and return the mailbox that its mail will be appended to.

        Raises:
            NameClashError: a client of that name is connected.
            ValueError: the name is empty.
        """
        if not client:
            raise ValueError("a client needs a name")
        if client in self._clients or client == self.name:
            self._statistics.clashes += 1
            raise NameClashError(client)
        record = Client(client, [] if mailbox is None else mailbox, now)
        self._clients[client] = record
        self._statistics.connects += 1
        self._post(Message("DB_EVENT", f"connected={client}", now, self.name, "", self.community), now)
        self._next_system = min(self._next_system, now)
        return record.mailbox

    def disconnect(self, client: str, now: float, reason: str = "") -> None:
        """Forget the client, its subscriptions and pending mail; values it wrote remain."""
        if self._clients.pop(client, None) is None:
            return
        self._statistics.disconnects += 1
        self._unwritten.clear()
        self._rebuild_all_routes()
        text = f"disconnected={client}" + (f",reason={reason}" if reason else "")
        self._post(Message("DB_EVENT", text, now, self.name, "", self.community), now)
        self._next_system = min(self._next_system, now)

    def clients(self) -> list[str]:
        """Names of connected clients, newest connection first."""
        return list(reversed(self._clients))

    def note_latency(self, client: str, seconds: float) -> None:
        """Record how old a client's heartbeat was on arrival (wall seconds), for `DB_QOS`."""
        record = self._clients.get(client)
        if record is not None:
            record.latencies.append(seconds)
            del record.latencies[:-50]

    # --- subscriptions -----------------------------------------------------------------------

    def register(
        self,
        client: str,
        pattern: str,
        now: float,
        source_pattern: str = "*",
        interval: float = 0.0,
        omit: tuple[str, ...] = (),
    ) -> None:
        """Subscribe `client`; the current value of every variable it now covers is mailed at once.

        Registering the same name again replaces the interval and replays the current value.

        Raises:
            ValueError: empty pattern, negative interval, or one variable too many.
            KeyError: the client is not connected.
        """
        if not pattern:
            raise ValueError("a registration needs a variable name or pattern")
        if not interval >= 0.0:
            raise ValueError(f"the interval of a registration must not be negative: {interval}")
        record = self._clients[client]
        subscription = Subscription(pattern, source_pattern or "*", float(interval), omit)
        if is_pattern(pattern):
            covered = [r for r in self._records.values() if subscription.wants_variable(r.name)]
        else:
            if pattern not in self._records and len(self._records) >= self.max_variables:
                raise ValueError(
                    f"the community has {self.max_variables} variables already: no registration for more"
                )
            covered = [self._record(pattern)]
        record.add(subscription)
        self._unwritten.clear()
        if any(subscription.wants_variable(name) for name in SYSTEM_VARIABLES):
            self._update_system_wanted()
            self._next_system = min(self._next_system, now)
        for variable in covered:
            self._rebuild_routes(variable)
            message = variable.message
            if message is not None and subscription.wants_source(message.source):
                route = variable.filtered.get(client)
                if route is not None:
                    route.offer_latched(message, now)
                else:
                    record.mailbox.append(message)

    def unregister(self, client: str, pattern: str, source_pattern: str | None = None) -> None:
        """Withdraw a registration made with the same pattern; unknown ones are a no-op."""
        record = self._clients.get(client)
        if record is None:
            return
        if not record.remove(pattern, source_pattern):
            return
        self._update_system_wanted()
        for variable in self._records.values():
            if matches(pattern, variable.name):
                self._rebuild_routes(variable)

    # --- posting -----------------------------------------------------------------------------

    def door(self, client: str, otherwise: Callable[[Message], bool]) -> Callable[[Message], bool]:
        """A quick way in for the posts of one client; those that need a decision go through `otherwise`.

        Nearly every post is of the type and by the writer of the one before and its subscribers want all of
        them: then there is nothing to decide, and the door returns True. `otherwise` has to `publish`.
        """
        find = self._records.get

        def post(message: Message) -> bool:
            record = find(message[0])
            if (
                record is None
                or record.express != client
                or type(message[1]) is not record.kind
                or not message[5]
            ):
                return otherwise(message)
            record.message = message
            record.writes += 1
            direct = record.direct
            if direct:  # about half of all variables are heard by nobody
                for mailbox in direct:
                    mailbox.append(message)
            return True

        return post

    def numbers_door(
        self, client: str, otherwise: Callable[[Message], bool]
    ) -> Callable[[Iterable[tuple[str, Any]], float, str], None]:
        """As `door`, for several (name, number) of one time at once; the third argument is who posts."""
        find, new, community = self._records.get, tuple.__new__, self.community

        def post(posts: Iterable[tuple[str, Any]], now: float, source: str) -> None:
            for name, value in posts:
                record = find(name)
                if type(value) is not float:
                    value = float(value)
                message = new(Message, (name, value, now, source, "", community))
                if record is None or record.express != client or record.kind is not float or not community:
                    otherwise(message)
                    continue
                record.message = message
                record.writes += 1
                direct = record.direct
                if direct:
                    for mailbox in direct:
                        mailbox.append(message)

        return post

    def publish(self, client: str, message: Message, now: float) -> Refusal | None:
        """Store `message` and deliver it; returns why not, if its type is the wrong one.

        Mail reaches one client in the order in which it arrives here.
        """
        name, community = message.name, message.community
        fields: tuple[Any, ...] = message  # as they are, which need not be as `Message` says
        value = fields[1]
        record = self._records.get(name)
        if record is None:
            if len(self._records) >= self.max_variables and client != self.name:
                return self._refuse(one_too_many(name, client, self.max_variables), now)
            record = self._record(name)
        if type(value) is not record.kind:
            if record.kind is not None:
                kind = type(value)
                return self._refuse(wrong_type(record.name, record.kind, kind, client), now)
            if type(value) not in KIND_NAME or type(fields[2]) is not float:
                raise TypeError(
                    f"{client} posted {message!r}: a value is float, str or bytes, a time is float"
                )
            record.kind = type(value)
        if not community:
            message = message._replace(community=self.community)
        record.message = message
        record.writes += 1
        if record.express != client:
            writer = self._clients.get(client)
            if writer is not None:
                writer.published[name] = None
                record.express = "" if record.filtered else client
        for mailbox in record.direct:
            mailbox.append(message)
        if record.filtered:
            for route in record.filtered.values():
                route.offer(message, now)
                if route.pending is not None:
                    self._throttled[route] = None
        return None

    def _post(self, message: Message, now: float) -> None:
        self.publish(self.name, message, now)

    def _refuse(self, refusal: Refusal, now: float) -> Refusal:
        self._statistics.refused += 1
        known = any(r.event == refusal.event for r in self.refusals)
        if not known and len(self.refusals) < MAX_REFUSALS_KEPT:
            self.refusals.append(refusal)
            self._post(Message("DB_EVENT", refusal.event, now, self.name, "", self.community), now)
        return refusal

    # --- time --------------------------------------------------------------------------------

    def tick(self, now: float) -> None:
        """Release throttled mail that is due and update the `DB_*` variables."""
        if self._throttled:
            for route in list(self._throttled):
                if route.release(now):
                    del self._throttled[route]
        if now >= self._next_system and self._clients:
            self._next_system = now + SYSTEM_PERIOD
            for name, value in build_system_variables(self, self._system_wanted, now):
                self._post(Message(name, value, now, self.name, "", self.community), now)

    def next_deadline(self) -> float:
        """Mission time at which `tick` next has something to do."""
        deadline = self._next_system if self._clients else float("inf")
        for route in self._throttled:
            deadline = min(deadline, route.deadline())
        return deadline

    # --- looking -----------------------------------------------------------------------------

    def get(self, name: str) -> Message | None:
        """The last message of a variable, None if it was never written."""
        record = self._records.get(name)
        return record.message if record is not None else None

    def records(self) -> Iterator[Record]:
        """All variables, written or only asked for, in order of first mention."""
        return iter(self._records.values())

    def connected(self) -> Iterator[Client]:
        """Connected clients, oldest first."""
        return iter(self._clients.values())

    def has_subscriber(self, name: str) -> bool:
        """Whether any client would be sent posts of the variable."""
        record = self._records.get(name)
        if record is not None:
            return bool(record.direct or record.filtered)
        # Asked many times a second for variables that are not posted because nobody wants them.
        wanted = self._unwritten.get(name)
        if wanted is None:
            wanted = any(c.wishes(name) for c in self._clients.values())
            if len(self._unwritten) < MAX_REMEMBERED:
                self._unwritten[name] = wanted
        return wanted

    def published_by(self, client: str) -> tuple[str, ...]:
        """Variables that the client has posted, in order of its first posts."""
        record = self._clients.get(client)
        return record.published_names() if record is not None else ()

    def registered_by(self, client: str) -> tuple[str, ...]:
        """Names and patterns that the client is registered for."""
        record = self._clients.get(client)
        return record.registered_names() if record is not None else ()

    def clear(self, now: float) -> None:
        """Forget all values and types, keep subscriptions, restart the uptime (`DB_CLEAR`)."""
        self._writes_before = self.statistics.accepted
        for record in self._records.values():
            record.message = None
            record.kind = None
            record.writes = record.last_writes = 0
        for route in self._throttled:
            route.pending = None
        self._throttled.clear()
        self.started = now

    # --- routes ------------------------------------------------------------------------------

    def _record(self, name: str) -> Record:
        record = self._records.get(name)
        if record is None:
            record = self._records[name] = Record(name)
            self._rebuild_routes(record)
        return record

    def _rebuild_all_routes(self) -> None:
        for record in self._records.values():
            self._rebuild_routes(record)

    def _rebuild_routes(self, record: Record) -> None:
        direct: list[list[Message]] = []
        filtered: dict[str, Route] = {}
        for client in self._clients.values():
            wishes = client.wishes(record.name)
            if not wishes:
                continue
            if any(s.interval == 0.0 and s.source == "*" for s in wishes):
                direct.append(client.mailbox)
                continue
            route = Route(client.mailbox, wishes)
            former = record.filtered.get(client.name)
            if former is not None and former.mailbox is client.mailbox:
                route.adopt(former)
                if route.pending is not None:
                    self._throttled[route] = None
            filtered[client.name] = route
        for former in record.filtered.values():
            self._throttled.pop(former, None)
        record.direct = direct
        record.filtered = filtered
        record.express = ""

    def _update_system_wanted(self) -> None:
        self._unwritten.clear()
        self._system_wanted = frozenset(
            name for name in SYSTEM_VARIABLES if any(c.wishes(name) for c in self._clients.values())
        )

    def value(self, name: str) -> Value | None:
        """The last value of a variable, None if it was never written."""
        message = self.get(name)
        return None if message is None else message.value
