"""uFldNodeBroker: a vehicle finds its shoreside, bridges to it (marine_apps.md 8.2, native_wire.md 4.4)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from mypy_extensions import mypyc_attr

from pymoos_lite.app import App
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.field.bridges import Bridge, WantedRoutes, parse_bridge
from pymoos_lite.field.routes import Channels, parse_endpoint
from pymoos_lite.records.csp import RecordError, clip
from pymoos_lite.records.host_record import HostRecord

PING_PERIOD = 5.0
PING_PERIOD_ACKED = 20.0
ACK_FRESH = 5.0
MAX_SHORES = 32
_UNMEDIATED = Bridge("NODE_MESSAGE_LOCAL", "NODE_MESSAGE")
_MEDIATED = Bridge("MEDIATED_MESSAGE_LOCAL", "MEDIATED_MESSAGE")


def parse_shore(text: str) -> str:
    """The route in ``pshare_route=HOST:PORT`` or ``pshare_route=multicast_N``.

    Raises:
        ValueError: it has another form.
    """
    compact = "".join(text.split())
    key, equals, route = compact.partition("=")
    if not equals or key.lower() != "pshare_route":
        raise ValueError("expected pshare_route=HOST:PORT")
    parse_endpoint(route, Channels())
    return route


@dataclass(slots=True)
class _Shore:
    """A shoreside that may be there."""

    route: str
    pings: int = 0
    acks: int = 0
    last_ping: float = float("-inf")
    last_ack: float = float("-inf")
    community: str = ""
    status: str = ""
    bridged: bool = False


@mypyc_attr(allow_interpreted_subclasses=True)
class NodeBroker(App):
    """Pings every shoreside it was told of, and bridges to those that answer."""

    DEFAULT_TICK = 1.0
    PARAMETERS = Declaration(
        (
            Parameter(
                "try_shore_host",
                "custom",
                doc="Where a shoreside's share may listen: pshare_route=HOST:PORT or multicast_N.",
                parse=parse_shore,
                repeated=True,
                example="pshare_route=localhost:9200",
            ),
            Parameter(
                "bridge",
                "custom",
                doc="A variable for the shoreside: src=VAR[,alias=VAR].",
                parse=parse_bridge,
                repeated=True,
                example="src=NODE_REPORT_LOCAL, alias=NODE_REPORT",
            ),
            Parameter(
                "auto_bridge_realmcast",
                "boolean",
                True,
                doc="Bridge REALMCAST, WATCHCAST and REALMCAST_CHANNELS.",
            ),
            Parameter("auto_bridge_appcast", "boolean", True, doc="Bridge APPCAST."),
            Parameter("auto_bridge_pshare_vars", "boolean", True, doc="Bridge NODE_PSHARE_VARS."),
            Parameter("keyword", "text", "", doc="Word that the shoreside may ask for."),
            Parameter(
                "strict",
                "boolean",
                True,
                doc="Do not bridge to a shoreside that reports a mismatch (time warp, keyword).",
            ),
        )
    )

    def on_start_up(self) -> None:
        config = self.config
        self.shores: list[_Shore] = []
        self._own: HostRecord | None = None
        self._routes = WantedRoutes()
        self._bad_acks = 0
        self.bridges = self._bridges()
        for route in config.try_shore_host:
            self._try(route)
        if not self.shores:
            self.config_warning("no try_shore_host is given: no shoreside will be found")

    def _bridges(self) -> list[Bridge]:
        config = self.config
        wanted: list[Bridge] = []
        for bridge in config.bridge:
            other = {_UNMEDIATED: _MEDIATED, _MEDIATED: _UNMEDIATED}.get(bridge)
            if other is not None and other in wanted:
                self.config_warning(
                    f"Conflicted messaging policy: {bridge.source} is not bridged, {other.source} is"
                )
                continue
            wanted.append(bridge)
        names: list[str] = []
        if config.auto_bridge_realmcast:
            names += ["REALMCAST", "WATCHCAST", "REALMCAST_CHANNELS"]
        if config.auto_bridge_appcast:
            names.append("APPCAST")
        if config.auto_bridge_pshare_vars:
            names.append("NODE_PSHARE_VARS")
        return list(dict.fromkeys([*wanted, *(Bridge(name, name) for name in names)]))

    def on_connect(self) -> None:
        for name in ("PHI_HOST_INFO", "NODE_BROKER_ACK", "TRY_SHORE_HOST", "PSHARE_OUTPUT_SUMMARY"):
            self.register(name)

    def on_mail(self, mail: list[Message]) -> None:
        for message in mail:
            name = message.name
            if name == "NODE_BROKER_ACK":
                if message.community != self.community:
                    self._on_ack(message)
            elif name == "PHI_HOST_INFO":
                if message.community == self.community:
                    self._on_own_host(message.text)
            elif name == "PSHARE_OUTPUT_SUMMARY":
                if message.community == self.community:
                    self._routes.note_summary(message.text)
            elif name == "TRY_SHORE_HOST":
                try:
                    self._try(parse_shore(message.text))
                except ValueError as error:
                    self.run_warning(f"TRY_SHORE_HOST '{clip(message.text)}': {error}")

    def iterate(self) -> None:
        self._ping()
        for command in self._routes.commands(self.now):
            self.notify("PSHARE_CMD", command)

    # --- finding -----------------------------------------------------------------------------

    def _try(self, route: str) -> None:
        if any(shore.route == route for shore in self.shores):
            return
        if len(self.shores) >= MAX_SHORES:
            self.run_warning(f"more than {MAX_SHORES} shoresides to try: {route} is left out")
            return
        index = len(self.shores)
        self.shores.append(_Shore(route))
        self._routes.want(f"NODE_BROKER_PING_{index}", "NODE_BROKER_PING", route)

    def _on_own_host(self, text: str) -> None:
        try:
            record = HostRecord.parse(text)
        except RecordError as error:
            self.run_warning(f"PHI_HOST_INFO: {error.reason}")
            return
        if self._own is not None and record.iroutes != self._own.iroutes:
            # Tell at once: until the shoreside knows, all it sends goes to the old place.
            for shore in self.shores:
                shore.last_ping = float("-inf")
        self._own = record

    def _ping(self) -> None:
        own = self._own
        if own is None or not own.iroutes or own.warp is None:
            return
        for index, shore in enumerate(self.shores):
            period = PING_PERIOD_ACKED if self.now - shore.last_ack <= ACK_FRESH else PING_PERIOD
            if self.now - shore.last_ping >= period:
                shore.last_ping = self.now
                shore.pings += 1
                ping = replace(own, time=self.now, key=str(index), keyword=self.config.keyword)
                self.notify(f"NODE_BROKER_PING_{index}", ping.to_text())

    # --- found -------------------------------------------------------------------------------

    def _on_ack(self, message: Message) -> None:
        try:
            record = HostRecord.parse(message.text)
        except RecordError as error:
            self._reject_ack(message, error.reason)
            return
        key = record.key
        if not (key.isascii() and key.isdigit() and len(key) < 6 and int(key) < len(self.shores)):
            self._reject_ack(message, f"key '{clip(key, 20)}' names no shoreside that was pinged")
            return
        shore = self.shores[int(key)]
        shore.acks += 1
        shore.last_ack = self.now
        if shore.community and shore.community != record.community:
            self.event(f"{shore.route} is now {record.community}, was {shore.community}")
        shore.community = record.community
        self._judge(shore, record.status)
        self.notify("NODE_PSHARE_VARS", ",".join(bridge.alias for bridge in self.bridges))
        if not shore.bridged and (shore.status in ("", "ok") or not self.config.strict):
            shore.bridged = True
            self.event(f"found {record.community} at {shore.route}")
            for bridge in self.bridges:
                self._routes.want(bridge.source, bridge.alias, shore.route)

    def _reject_ack(self, message: Message, reason: str) -> None:
        self._bad_acks += 1
        self.run_warning(f"NODE_BROKER_ACK from {clip(message.community, 20)}: {reason}")

    def _judge(self, shore: _Shore, status: str) -> None:
        if status == shore.status:
            return
        if shore.status not in ("", "ok"):
            self.retract_run_warning(f"{shore.community} says: {shore.status}")
        if status not in ("", "ok"):
            self.run_warning(f"{shore.community} says: {status}")
        shore.status = status

    def report(self) -> Iterable[str]:
        own = self._own
        yield f"Own share: {', '.join(own.iroutes) or 'not known yet' if own else 'not known yet'}"
        yield "Shoreside route            pings   acks  status        community"
        for shore in self.shores:
            state = (shore.status or "no answer") + ("" if shore.bridged else " (not bridged)")
            yield f"  {shore.route:<24} {shore.pings:>6} {shore.acks:>6}  {state:<12}  {shore.community}"
        missing = self._routes.missing()
        yield f"Routes wanted: {len(self._routes)}, not standing yet: {len(missing)}"
        for bridge in self.bridges:
            yield f"  {bridge.source} -> {bridge.alias}"
        if self._bad_acks:
            yield f"Acknowledgements thrown away: {self._bad_acks}"
