"""uFldShoreBroker: the shoreside finds its vehicles (marine_apps.md 8.3, native_wire.md 4.5)."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from pymoos_lite.app import App
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.field.bridges import Bridge, WantedRoutes, parse_bridge
from pymoos_lite.field.routes import Channels, parse_endpoint
from pymoos_lite.geometry.text import num
from pymoos_lite.records.csp import RecordError, clip
from pymoos_lite.records.host_record import HostRecord

STALE_AFTER = 10.0
REPEAT_ACK_AFTER = 5.0
COUNT_PERIOD = 30.0
VNODE_PERIOD = 10.0
FLAPPING = 30.0
"""A vehicle that is back at a place it left less than this long ago is probably two vehicles."""
MAX_NODES = 512
DEFAULT_SHARE_PORT = 9200
_NAME = re.compile(r"[A-Za-z0-9_.-]{1,64}\Z")


def parse_names(text: str) -> list[str]:
    """Variables separated by commas.

    Raises:
        ValueError: there is none, or one has a blank.
    """
    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names or any(len(name.split()) != 1 or "=" in name for name in names):
        raise ValueError("expected variables separated by commas")
    return names


def parse_vnode(text: str) -> str:
    """The route in ``route=IP[:PORT]``, with the usual port if none is given.

    Raises:
        ValueError: it has another form.
    """
    key, equals, route = "".join(text.split()).partition("=")
    if not equals or key.lower() != "route" or not route:
        raise ValueError("expected route=HOST[:PORT]")
    if ":" not in route and not route.lower().startswith("multicast_"):
        route = f"{route}:{DEFAULT_SHARE_PORT}"
    parse_endpoint(route, Channels())
    return route


def expand(source: str, node: str, number: int) -> str:
    """`source` for one node: `$V` its name in capitals, `$v` as it is, `$N` its number."""
    return source.replace("$V", node.upper()).replace("$v", node).replace("$N", str(number))


def _is_channel(route: str) -> bool:
    """Whether a route is a multicast channel, where many may listen."""
    return route.lower().startswith("multicast_")


@dataclass(slots=True)
class _Node:
    """A vehicle that pinged."""

    number: int
    record: HostRecord
    place: str
    first_seen: float
    last_ping: float
    pings: int = 0
    status: str = "ok"
    bridged: bool = False
    ack_due: float = 0.0
    acks: int = 0
    skew: float = 0.0
    former: dict[str, float] = field(default_factory=dict)


class ShoreBroker(App):
    """Answers the pings of vehicles and makes the bridges to them."""

    DEFAULT_TICK = 1.0
    PARAMETERS = Declaration(
        (
            Parameter(
                "qbridge",
                "custom",
                doc="For each variable VAR: VAR_ALL goes to all vehicles as VAR, VAR_<NAME> to one.",
                parse=parse_names,
                repeated=True,
                example="DEPLOY, RETURN",
            ),
            Parameter(
                "bridge",
                "custom",
                doc="src=VAR[,alias=VAR]; $V in VAR is the vehicle's name in capitals, $v as it is, "
                "$N its number.",
                parse=parse_bridge,
                repeated=True,
                example="src=UP_LOITER_$N, alias=UP_LOITER",
            ),
            Parameter("auto_bridge_realmcast", "boolean", True, doc="Bridge REALMCAST_REQ like a qbridge."),
            Parameter("auto_bridge_appcast", "boolean", True, doc="Bridge APPCAST_REQ like a qbridge."),
            Parameter("auto_bridge_mhash", "boolean", True, doc="Bridge MISSION_HASH."),
            Parameter("keyword", "text", "", doc="Word that a vehicle must know."),
            Parameter("warning_on_stale", "boolean", False, doc="Warn when a vehicle has gone silent."),
            Parameter(
                "try_vnode",
                "custom",
                doc="Tell the vehicle whose share listens there of this shoreside: route=HOST[:PORT].",
                parse=parse_vnode,
                repeated=True,
                example="route=192.168.1.101",
            ),
            Parameter(
                "strict",
                "boolean",
                True,
                doc="Do not bridge to a vehicle whose time warp or keyword differs.",
            ),
        )
    )

    def on_start_up(self) -> None:
        config = self.config
        self.nodes: dict[str, _Node] = {}
        self._own: HostRecord | None = None
        self._routes = WantedRoutes()
        self._posted_count = -1
        self._next_count = self._next_vnode = float("-inf")
        self._dropped: dict[str, int] = {}
        quick = [name for names in config.qbridge for name in names]
        if config.auto_bridge_realmcast:
            quick.append("REALMCAST_REQ")
        if config.auto_bridge_appcast:
            quick.append("APPCAST_REQ")
        self.quick = list(dict.fromkeys(quick))
        bridges = [
            b for name in self.quick for b in (Bridge(f"{name}_ALL", name), Bridge(f"{name}_$V", name))
        ]
        bridges += config.bridge
        if config.auto_bridge_mhash:
            bridges.append(Bridge("MISSION_HASH", "MISSION_HASH"))
        self.bridges = list(dict.fromkeys(bridges))
        for route in config.try_vnode:
            self._routes.want("TRY_SHORE_HOST", "TRY_SHORE_HOST", route)

    def on_connect(self) -> None:
        for name in ("NODE_BROKER_PING", "PHI_HOST_INFO", "PSHARE_OUTPUT_SUMMARY"):
            self.register(name)
        self.notify("UFSB_QBRIDGE_VARS", ",".join(sorted(self.quick)))
        self.notify("UFSB_BRIDGE_VARS", ",".join(sorted({bridge.source for bridge in self.bridges})))
        self._posted_count = -1

    def on_mail(self, mail: list[Message]) -> None:
        for message in mail:
            name = message.name
            if name == "NODE_BROKER_PING":
                if message.community != self.community:
                    self._on_ping(message)
            elif name == "PSHARE_OUTPUT_SUMMARY":
                if message.community == self.community:
                    self._routes.note_summary(message.text)
            elif name == "PHI_HOST_INFO" and message.community == self.community:
                try:
                    self._own = HostRecord.parse(message.text)
                except RecordError as error:
                    self.run_warning(f"PHI_HOST_INFO: {error.reason}")

    def iterate(self) -> None:
        for name, node in self.nodes.items():
            if self.now >= node.ack_due:
                self._acknowledge(name, node)
            if self.config.warning_on_stale:
                self._watch(name, node)
        if len(self.nodes) != self._posted_count or self.now >= self._next_count:
            self._posted_count = len(self.nodes)
            self._next_count = self.now + COUNT_PERIOD
            self.notify("UFSB_NODE_COUNT", float(len(self.nodes)))
        own = self._own
        if self.config.try_vnode and self.now >= self._next_vnode and own is not None and own.port_udp:
            self._next_vnode = self.now + VNODE_PERIOD
            self.notify("TRY_SHORE_HOST", f"pshare_route={own.hostip}:{own.port_udp}")
        for command in self._routes.commands(self.now):
            self.notify("PSHARE_CMD", command)

    # --- pings -------------------------------------------------------------------------------

    def _on_ping(self, message: Message) -> None:
        try:
            record = HostRecord.parse(message.text)
        except RecordError as error:
            self._drop(f"NODE_BROKER_PING from {clip(message.community, 20)}: {error.reason}")
            return
        name = record.community
        if not _NAME.match(name) or name == self.community:
            self._drop(f"a vehicle cannot be named '{clip(name, 30)}'")
            return
        place = self._place(record)
        if not place:
            self._drop(f"NODE_BROKER_PING of {name} names no usable pshare_iroutes")
            return
        node = self.nodes.get(name)
        if node is None or place != node.place:
            self._evict_others(name, place)
        if node is None:
            node = self._welcome(name, record, place)
            if node is None:
                return
        elif place != node.place:
            self._moved(name, node, place)
        node.record = record
        node.pings += 1
        node.last_ping = self.now
        node.ack_due = self.now
        if record.time is not None:
            node.skew = self.now - record.time
        self._judge(name, node)
        if not node.bridged and (node.status == "ok" or not self.config.strict):
            self._bridge(name, node)

    def _place(self, record: HostRecord) -> str:
        """The vehicle's routes as we must use them, joined by ``&``; empty if one is unusable."""
        routes = record.routes_from(self._own.hostip if self._own is not None else "localhost")
        try:
            for route in routes:
                parse_endpoint(route, Channels())
        except ValueError:
            return ""
        return "&".join(routes)

    def _welcome(self, name: str, record: HostRecord, place: str) -> _Node | None:
        if len(self.nodes) >= MAX_NODES:
            self._drop(f"more than {MAX_NODES} vehicles: {name} is left out")
            return None
        for other in self.nodes:
            if other.upper() == name.upper():
                self.run_warning(f"{other} and {name} differ only in case: both hear what is meant for one")
        node = self.nodes[name] = _Node(len(self.nodes) + 1, record, place, self.now, self.now)
        self._want(f"NODE_BROKER_ACK_{name.upper()}", "NODE_BROKER_ACK", place)
        self.event(f"{name} is node {node.number}, at {place}")
        return node

    def _evict_others(self, name: str, place: str) -> None:
        """Whoever was at `place` before is there no more: its commands must not reach the newcomer."""
        routes = [route for route in place.split("&") if not _is_channel(route)]
        for other_name, other in self.nodes.items():
            if other_name != name and not set(routes).isdisjoint(other.place.split("&")):
                self.event(f"{name} is now at {other.place}, where {other_name} was")
                other.place, other.bridged = "", False
                for route in routes:
                    self._routes.drop(route)

    def _moved(self, name: str, node: _Node, place: str) -> None:
        if self.now - node.former.get(place, float("-inf")) < FLAPPING:
            self.run_warning(
                f"pings of {name} come from {node.place} and {place}: are there two of that name?"
            )
        node.former = {**dict(list(node.former.items())[-3:]), node.place: self.now}
        self.event(f"{name} moved from {node.place} to {place}")
        for route in node.place.split("&"):
            if not _is_channel(route):
                self._routes.drop(route)
        node.place = place
        node.bridged = False
        self._want(f"NODE_BROKER_ACK_{name.upper()}", "NODE_BROKER_ACK", place)

    def _judge(self, name: str, node: _Node) -> None:
        record = node.record
        status = "ok"
        warp, own = record.warp, self.clock.warp
        if warp is None or abs(warp - own) > 0.05 + 1e-9:  # the reference writes one decimal only
            status = f"timewarp ({num(own, 6)}!={num(warp, 6) if warp is not None else '?'})"
        if self.config.keyword and record.keyword != self.config.keyword:
            status = "keyword_mismatch"
        if status != node.status:
            self.retract_run_warning(f"{name}: {node.status}")
            if status != "ok":
                self.run_warning(f"{name}: {status}")
            node.status = status

    def _bridge(self, name: str, node: _Node) -> None:
        node.bridged = True
        for bridge in self.bridges:
            self._want(
                expand(bridge.source, name, node.number), expand(bridge.alias, name, node.number), node.place
            )

    def _want(self, source: str, alias: str, place: str) -> None:
        for route in filter(None, place.split("&")):
            self._routes.want(source, alias, route)

    def _drop(self, reason: str) -> None:
        if reason in self._dropped or len(self._dropped) < 50:
            self._dropped[reason] = self._dropped.get(reason, 0) + 1
        self.run_warning(reason)

    # --- answers -----------------------------------------------------------------------------

    def _acknowledge(self, name: str, node: _Node) -> None:
        """Answer a ping at once, and once more a little later in case the answer was lost."""
        if self._own is None:
            return
        repeat = node.ack_due > node.last_ping
        node.ack_due = float("inf") if repeat else node.last_ping + REPEAT_ACK_AFTER
        node.acks += 1  # for each vehicle by itself: its logs do not depend on how many others there are
        ack = replace(
            self._own,
            community=self.community,
            keyword="",
            warp=self.clock.warp,
            status=node.status,
            time=None,
            key=node.record.key,
            id=str(node.acks),
        )
        self.notify(f"NODE_BROKER_ACK_{name.upper()}", ack.to_text())
        self.notify("NODE_BROKER_VACK", name)

    def _watch(self, name: str, node: _Node) -> None:
        text = f"{name} is silent"
        if self.now - node.last_ping > STALE_AFTER:
            if text not in self.log.run_warnings:
                self.run_warning(text)
        elif text in self.log.run_warnings:
            self.retract_run_warning(text)

    def report(self) -> Iterable[str]:
        yield f"Vehicles: {len(self.nodes)}    bridges for each: {len(self.bridges)}"
        yield "  no  name          pings  last (s)  skew (s)  status      at"
        for name, node in self.nodes.items():
            state = node.status + ("" if node.bridged else " (not bridged)")
            yield (
                f"  {node.number:>2}  {name:<12} {node.pings:>6} {self.now - node.last_ping:>9.1f} "
                f"{node.skew:>9.2f}  {state:<10}  {node.place}"
            )
        missing = self._routes.missing()
        yield f"Routes wanted: {len(self._routes)}, not standing yet: {len(missing)}"
        for reason, count in self._dropped.items():
            yield f"Thrown away {count} times: {reason}"
