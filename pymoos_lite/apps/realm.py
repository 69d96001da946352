"""pRealm: answers requests for tables of the community's variables (community.md 11).

It listens only to what somebody has asked for: a request registers for the variables of its channel and the
database replays their current values, so that an idle pRealm costs next to nothing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from pymoos_lite.app import App, AppContext
from pymoos_lite.apps.realm_table import TableStyle, history_table, shown_value, variable_table
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.records.csp import RecordError, clip, fields
from pymoos_lite.records.realmcast import RealmCast, RealmCastRequest, WatchCast, channels_text

EARLY = 60.0
EARLY_PERIOD = 0.5
PURGE_AFTER = 30.0
MAX_CLIENTS = 50
_HIDDEN = ("uQueryDB", "uPokeDB", "uXMS", "uMAC", "pymoos_")


def parse_scope_set(text: str) -> tuple[str, tuple[str, ...]]:
    """`name=N, vars=A:B:C`. Raises ValueError."""
    found = {key.lower(): value for key, value in fields(text)}
    names = tuple(name.strip() for name in found.get("vars", "").split(":") if name.strip())
    if not found.get("name") or not names:
        raise ValueError(f"'{clip(text)}': expected name=N, vars=A:B:C")
    return found["name"], names


@dataclass(slots=True)
class Client:
    """A standing request; `sent` is what it was told last."""

    request: RealmCastRequest
    until: float
    next_cast: float = 0.0
    count: int = 0
    sent: object = None
    fresh: bool = True
    told: dict[str, Message | None] = field(default_factory=dict)


class Realm(App):
    """The realm app; see the module."""

    BLOCK_OPTIONAL = True
    PARAMETERS = Declaration(
        (
            Parameter(
                "relcast_interval", "number", 0.8, "wall s", "Least time between casts.", low=0.4, high=15.0
            ),
            Parameter(
                "summary_interval",
                "number",
                5.0,
                "wall s",
                "Time between lists of channels.",
                low=1.0,
                high=10.0,
            ),
            Parameter("wrap_length", "integer", 90, "", "Where values are wrapped on request.", low=1),
            Parameter("trunc_length", "integer", 270, "", "Where values are cut on request.", low=1),
            Parameter(
                "msg_max_hist",
                "integer",
                10,
                "",
                "Posts kept by a history.",
                low=1,
                high=10000,
                aliases=("msg_max_history",),
            ),
            Parameter(
                "hist_var", "variable", None, "", "A history of one variable.", repeated=True, example="MODE"
            ),
            Parameter(
                "scope_set",
                "custom",
                None,
                "",
                "A history of several: name=N, vars=A:B:C.",
                repeated=True,
                parse=parse_scope_set,
                example="name=nav, vars=NAV_X:NAV_Y",
            ),
        )
    )

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        config = self.config
        self.database = f"MOOSDB_{self.community}"
        self.histories: dict[str, tuple[str, ...]] = {name: (name,) for name in config.hist_var}
        self.histories.update(dict(config.scope_set))
        self.kept = {name: deque[Message](maxlen=config.msg_max_hist) for name in self.histories}
        self.latest: dict[str, Message] = {}
        self.subscribed: dict[str, list[str]] = {}
        self.published: dict[str, list[str]] = {}
        self.names: list[str] = []
        self.clients: dict[str, Client] = {}
        self._heard: set[str] = set()
        self._always = {
            "REALMCAST_REQ",
            "DB_CLIENTS",
            *(v for names in self.histories.values() for v in names),
        }
        self._channels = ""
        self._next_channels = 0.0
        self._unchanged = 0

    def on_connect(self) -> None:
        for name in sorted(self._always):
            self.register(name)

    # --- mail ----------------------------------------------------------------------------------

    def on_mail(self, mail: list[Message]) -> None:
        for message in mail:
            name = message.name
            self.latest[name] = message
            for channel, names in self.histories.items():
                if name in names:
                    self.kept[channel].append(message)
            if name == "REALMCAST_REQ":
                self._take_request(message.text)
            elif name == "DB_CLIENTS":
                connected = (n for n in message.text.split(",") if n)
                self.names = [n for n in connected if not any(word in n for word in _HIDDEN)]
            elif name == "DB_RWSUMMARY":
                self._take_summary(message.text)

    def _take_request(self, text: str) -> None:
        try:
            request = RealmCastRequest.parse(text)
        except RecordError:
            self.run_warning(f"Bad RealmCastReq:{clip(text, 120)}")
            return
        until = self.now + request.duration * self.clock.warp
        former = self.clients.get(request.client)
        if former is not None and former.request == request:
            former.until = until  # a renewal: go on as before
            return
        if former is None and len(self.clients) >= MAX_CLIENTS:
            self.run_warning(f"more than {MAX_CLIENTS} clients: {clip(request.client)} is not served")
            return
        self.clients[request.client] = Client(request, until)

    def _take_summary(self, text: str) -> None:
        """`client=sub:sub&pub:pub,client2=...`"""
        self.subscribed.clear()
        self.published.clear()
        for part in text.split(","):
            app, _, lists = part.partition("=")
            subscribed, _, published = lists.partition("&")
            # Our own listening on behalf of others is no news to anybody.
            if app != self.name:
                self.subscribed[app] = [n for n in subscribed.split(":") if n]
            self.published[app] = [n for n in published.split(":") if n]

    # --- time ----------------------------------------------------------------------------------

    def iterate(self) -> None:
        warp = self.clock.warp
        for name in [n for n, c in self.clients.items() if self.now > c.until + PURGE_AFTER]:
            del self.clients[name]
        active = [client for client in self.clients.values() if self.now <= client.until]
        changed = self._listen(active)
        for client in active:
            # What was registered for just now is replayed by the next iteration.
            if self.now >= client.next_cast and not changed:
                client.next_cast = self.now + self.config.relcast_interval * warp
                if client.request.variables:
                    self._watch(client)
                else:
                    self._cast(client)
        self._list_channels()

    def _listen(self, active: list[Client]) -> bool:
        """Register for what the standing requests need, and for nothing else; True if that is more than before."""
        wanted: set[str] = set()
        for client in active:
            wanted.update(client.request.variables)
            channel = client.request.channel
            if channel and channel not in self.histories:
                wanted.add("DB_RWSUMMARY")
                wanted.update(self._published_by(channel))
                if "nosubs" not in client.request.words:
                    wanted.update(self._subscribed_by(channel))
        wanted -= self._always
        for name in sorted(wanted - self._heard):
            self.register(name)
        for name in sorted(self._heard - wanted):
            self.unregister(name)
            self.latest.pop(name, None)
        grown = not wanted <= self._heard
        self._heard = wanted
        return grown

    def _subscribed_by(self, channel: str) -> list[str]:
        return self.subscribed.get(channel, [])

    def _published_by(self, channel: str) -> list[str]:
        if channel == self.database:
            return [
                "DB_CLIENTS",
                "DB_EVENT",
                "DB_QOS",
                "DB_RWSUMMARY",
                "DB_TIME",
                "DB_UPTIME",
                "DB_VARSUMMARY",
            ]
        return self.published.get(channel, [])

    def _style(self, words: frozenset[str]) -> TableStyle:
        return TableStyle(
            start=None if "utc" in words else self.started,
            source="nosrc" not in words,
            community="nocom" not in words,
            wrap=self.config.wrap_length if "wrap" in words else 0,
            trunc=self.config.trunc_length if "trunc" in words else 0,
            mask="mask" in words,
        )

    def _cast(self, client: Client) -> None:
        request = client.request
        style = self._style(request.words)
        channel = request.channel
        if channel in self.histories:
            lines = history_table(list(self.kept[channel]), style, named=len(self.histories[channel]) > 1)
        else:
            if not self.published and channel != self.database:
                client.next_cast = self.now  # the summary has been asked for and is on its way
                return
            lines = []
            if "nosubs" not in request.words:
                rows = [(name, self.latest.get(name)) for name in sorted(self._subscribed_by(channel))]
                lines += variable_table("Subscriptions", rows, style)
            rows = [(name, self.latest.get(name)) for name in sorted(self._published_by(channel))]
            lines += variable_table("Publications", rows, replace(style, mask=True))
        shown = "uQueryDB" if "uQueryDB" in channel else channel
        if lines != client.sent or "force" in request.words:
            client.sent = lines
            client.count += 1
            self.notify("REALMCAST", RealmCast(self.community, shown, tuple(lines), client.count).to_text())

    def _watch(self, client: Client) -> None:
        for name in client.request.variables:
            message = self.latest.get(name)
            if not client.fresh and client.told.get(name) is message and "force" not in client.request.words:
                continue
            client.told[name] = message
            if message is None:
                cast = WatchCast(self.community, name, "", "", -1.0, self.now / self.clock.warp, None)
            else:
                value = message.value if isinstance(message.value, float) else shown_value(message)
                age = message.time - self.started
                utc = message.time / self.clock.warp
                cast = WatchCast(self.community, name, message.source, message.community, age, utc, value)
            self.notify("WATCHCAST", cast.to_text())
        client.fresh = False

    def _list_channels(self) -> None:
        text = channels_text(self.community, [*self.names, self.database], list(self.histories))
        if not self.names:
            return
        changed = text != self._channels
        if not changed and self.now < self._next_channels:
            return
        early = self.uptime < EARLY
        self._next_channels = self.now + (
            EARLY_PERIOD if early else self.config.summary_interval * self.clock.warp
        )
        self._unchanged = 0 if changed else self._unchanged + 1
        if changed or self._unchanged % 10 == 0:
            self._channels = text
            self.notify("REALMCAST_CHANNELS", text)

    def report(self) -> Iterable[str]:
        yield f"channels: {len(self.names) + 1} apps, histories: {', '.join(self.histories) or 'none'}"
        for name, client in self.clients.items():
            what = client.request.channel or ":".join(client.request.variables)
            yield f"{name}: {what}, {client.count} casts, {client.until - self.now:.0f} s left"
