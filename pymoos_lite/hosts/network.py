"""The simulated network of the lockstep host: datagrams between communities, late, lost or squeezed.

Every ordered pair of communities has its own conditions and its own random numbers, drawn from the
run's seed, so that what happens between two of them does not depend on who else sails. Deliveries
are ordered by time, then by the order of sending. Nothing vanishes uncounted.
"""

from __future__ import annotations

import errno
import heapq
import random
from collections.abc import Iterator
from dataclasses import dataclass, field, fields

from mypy_extensions import mypyc_attr

from pymoos_lite.app.network import Address, Bundle, Datagrams, Payload
from pymoos_lite.core.clock import Clock

LOOPBACK = "127.0.0.1"
FIRST_FREE_PORT = 49152
MAX_PORT = 65535
IP_OVERHEAD = 28
"""Bytes that an IPv4 and a UDP header add to each datagram."""


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Conditions:
    """How the way from one community to another behaves; times in mission seconds.

    A datagram is lost with probability `loss`, else arrives after `latency` plus up to `jitter`
    (uniform), which may change the order; with probability `duplication` it arrives twice.
    `bandwidth` in bytes per second is that of the pair (0: unlimited); what would have to wait
    behind more than `queue` bytes is dropped.

    Raises:
        ValueError: a probability outside [0, 1] or a negative amount.
    """

    latency: float = 0.01
    jitter: float = 0.0
    loss: float = 0.0
    duplication: float = 0.0
    bandwidth: float = 0.0
    queue: float = 65536.0

    def __post_init__(self) -> None:
        for name in ("loss", "duplication"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} is a probability in [0, 1], not {getattr(self, name):g}")
        for name in ("latency", "jitter", "bandwidth", "queue"):
            if not 0.0 <= getattr(self, name) < float("inf"):
                raise ValueError(f"{name} must not be negative, found {getattr(self, name):g}")


@dataclass(slots=True)
class Traffic:
    """What went from one community to another, in datagrams (fragments counted apart) and bytes."""

    sent: int = 0
    bytes: int = 0
    delivered: int = 0
    lost: int = 0
    squeezed: int = 0
    doubled: int = 0
    unreachable: int = 0

    @property
    def dropped(self) -> int:
        """Everything that did not arrive anywhere."""
        return self.lost + self.squeezed + self.unreachable


@dataclass(slots=True)
class _Way:
    """One ordered pair of communities."""

    conditions: Conditions
    random: random.Random
    traffic: Traffic = field(default_factory=Traffic)
    free_at: float = 0.0


class SimulatedPort:
    """A port of one app; see `pymoos_lite.app.network.DatagramPort`."""

    def __init__(self, network: SimulatedNetwork, owner: tuple[str, str], address: Address) -> None:
        self.address = address
        self.owner = owner
        self.groups: list[Address] = []
        self._network = network
        self.inbox: Datagrams = []

    @property
    def has_data(self) -> bool:
        return bool(self.inbox)

    def send(self, data: Payload, to: Address) -> bool:
        return self._network.send(self, data, to)

    def receive(self) -> Datagrams:
        taken = self.inbox
        self.inbox = []
        return taken

    def close(self) -> None:
        self._network.close(self)


class Member:
    """The network as one app of one community sees it."""

    def __init__(self, network: SimulatedNetwork, community: str, app: str) -> None:
        self.by_reference = network.by_reference
        self._network = network
        self._owner = (community, app)

    def open(self, port: int = 0, group: str = "") -> SimulatedPort:
        return self._network.open(self._owner, port, group)

    def resolve(self, host: str) -> str:
        return self._network.resolve(self._owner[0], host)

    def addresses(self) -> list[tuple[str, str]]:
        host = self._network.host_of(self._owner[0])
        return [] if host == LOOPBACK else [("sim0", host)]


class SimulatedNetwork:
    """All communities of a lockstep host, on one machine unless they are given others.

    `by_reference` lets messages travel as objects with the size they would have; switched off,
    every datagram is really encoded and decoded, which is slower and otherwise the same.
    """

    def __init__(
        self,
        clock: Clock,
        seed: int | None = 0,
        conditions: Conditions | None = None,
        by_reference: bool = True,
    ) -> None:
        self.by_reference = by_reference
        self.in_flight: list[tuple[float, int, SimulatedPort | None, Payload, Address, _Way, Address]] = []
        """A heap of (time, order, port or None, data, sender, way, destination); the host's to read."""
        self._clock = clock
        self._seed = seed
        self._default = conditions or Conditions()
        self._rules: list[tuple[str, str, Conditions]] = []
        self._ways: dict[tuple[str, str], _Way] = {}
        self._hosts: dict[str, str] = {}
        self._ports: dict[Address, SimulatedPort] = {}
        self._groups: dict[Address, list[SimulatedPort]] = {}
        self._order = 0

    # --- where communities are ---------------------------------------------------------------

    def member(self, community: str, app: str) -> Member:
        """What the host hands to an app."""
        return Member(self, community, app)

    def host_of(self, community: str) -> str:
        """Numeric address of the community's machine."""
        return self._hosts.get(community, LOOPBACK)

    def move(self, community: str, host: str) -> None:
        """Give the community a machine of its own at `host`, or a new address.

        Its ports move with it; what is on its way to the old address arrives nowhere.

        Raises:
            OSError: a port of it is in use there.
        """
        mine = [port for port in self._ports.values() if port.owner[0] == community]
        for port in mine:
            there = self._ports.get((host, port.address[1]))
            if there is not None and there not in mine:
                raise OSError(errno.EADDRINUSE, f"port {port.address[1]} is in use at {host}")
        for port in mine:
            del self._ports[port.address]
        self._hosts[community] = host
        for port in mine:
            port.address = (host, port.address[1])
            self._ports[port.address] = port

    def resolve(self, community: str, host: str) -> str:
        """Numeric address of `host` as seen from `community`; names of communities are hosts too."""
        if host.lower() in ("localhost", LOOPBACK):
            return self.host_of(community)
        if host in self._hosts:
            return self._hosts[host]
        parts = host.split(".")
        if len(parts) == 4 and all(p.isascii() and p.isdigit() and int(p) < 256 for p in parts):
            return host
        raise OSError(f"host '{host}' is not known")

    # --- how the ways are --------------------------------------------------------------------

    def set_conditions(self, conditions: Conditions, source: str = "*", destination: str = "*") -> None:
        """Set how datagrams fare from `source` to `destination` (communities, ``*`` for any) from now on.

        The latest rule that names a pair counts.
        """
        self._rules.append((source, destination, conditions))
        for (a, b), way in self._ways.items():
            if source in ("*", a) and destination in ("*", b):
                way.conditions = conditions

    def traffic(self) -> Iterator[tuple[str, str, Traffic]]:
        """Source, destination and what went between them, in order of first use."""
        for (source, destination), way in self._ways.items():
            yield source, destination, way.traffic

    def total(self) -> Traffic:
        """The sum over all pairs."""
        total = Traffic()
        for _, _, traffic in self.traffic():
            for each in fields(Traffic):
                setattr(total, each.name, getattr(total, each.name) + getattr(traffic, each.name))
        return total

    def _way(self, source: str, destination: str) -> _Way:
        way = self._ways.get((source, destination))
        if way is None:
            conditions = self._default
            for a, b, rule in self._rules:
                if a in ("*", source) and b in ("*", destination):
                    conditions = rule
            dice = random.Random(f"{self._seed}:network:{source}:{destination}")
            way = self._ways[source, destination] = _Way(conditions, dice)
        return way

    # --- ports -------------------------------------------------------------------------------

    def open(self, owner: tuple[str, str], port: int, group: str) -> SimulatedPort:
        """Open a port at the community's host, or join a multicast group.

        Raises:
            OSError: the port is in use or out of range.
        """
        if not 0 <= port <= MAX_PORT:
            raise OSError(errno.EINVAL, f"port {port} is not in 0..{MAX_PORT}")
        host = self.host_of(owner[0])
        if group:
            # A group's port is shared by all who join; they send from a port of their own.
            joined = SimulatedPort(self, owner, (host, self._free_port(host)))
            joined.groups.append((group, port))
            self._groups.setdefault((group, port), []).append(joined)
            self._ports[joined.address] = joined
            return joined
        address = (host, port or self._free_port(host))
        if address in self._ports:
            raise OSError(errno.EADDRINUSE, f"port {port} is in use by {self._ports[address].owner[0]}")
        opened = self._ports[address] = SimulatedPort(self, owner, address)
        return opened

    def _free_port(self, host: str) -> int:
        for port in range(FIRST_FREE_PORT, MAX_PORT + 1):
            if (host, port) not in self._ports:
                return port
        raise OSError(errno.EADDRINUSE, f"no port is free at {host}")

    def close(self, port: SimulatedPort) -> None:
        """Close a port; closing it again does nothing."""
        if self._ports.get(port.address) is port:
            del self._ports[port.address]
        for group in port.groups:
            self._groups[group].remove(port)
        port.groups.clear()
        port.inbox = []

    def close_community(self, community: str) -> None:
        """Close whatever its apps left open, as an operating system does when a process dies."""
        for port in [p for p in self._ports.values() if p.owner[0] == community]:
            self.close(port)

    # --- moving ------------------------------------------------------------------------------

    def send(self, port: SimulatedPort, data: Payload, to: Address) -> bool:
        """Put a datagram on its way; False if nobody can ever have it."""
        if self._ports.get(port.address) is not port:
            return False
        group = self._groups.get(to)
        if group is not None:
            for member in group:  # the sender among them, as on a real interface
                self._dispatch(port, data, to, member)
            return True
        return self._dispatch(port, data, to, self._ports.get(to))

    def _dispatch(
        self, port: SimulatedPort, data: Payload, to: Address, target: SimulatedPort | None
    ) -> bool:
        source = port.owner[0]
        way = self._way(source, target.owner[0] if target is not None else f"{to[0]}:{to[1]}")
        conditions, traffic = way.conditions, way.traffic
        if type(data) is Bundle:
            parts, size = data.parts, data.size + IP_OVERHEAD * data.parts
        else:
            parts, size = 1, len(data) + IP_OVERHEAD
        traffic.sent += parts
        traffic.bytes += size
        now = self._clock.now()
        leaves = now
        if conditions.bandwidth > 0.0:
            start = max(now, way.free_at)
            if (start - now) * conditions.bandwidth + size > conditions.queue:
                traffic.squeezed += parts
                return False
            leaves = way.free_at = start + size / conditions.bandwidth
        if conditions.loss > 0.0 and way.random.random() >= (1.0 - conditions.loss) ** parts:
            traffic.lost += parts
            return True
        copies = 1
        if conditions.duplication > 0.0 and way.random.random() < conditions.duplication:
            copies = 2
            traffic.doubled += parts
        for _ in range(copies):
            arrives = leaves + conditions.latency
            if conditions.jitter > 0.0:
                arrives += way.random.random() * conditions.jitter
            self._order += 1
            heapq.heappush(self.in_flight, (arrives, self._order, target, data, port.address, way, to))
        return True

    def deliver_next(self) -> tuple[str, str] | None:
        """Put the next datagram in flight into its port; the community and app to wake, if any."""
        _, _, target, data, sender, way, to = heapq.heappop(self.in_flight)
        parts = data.parts if type(data) is Bundle else 1
        if target is None or to not in target.groups:
            target = self._ports.get(to)  # whoever has the port by now
        elif self._ports.get(target.address) is not target:
            target = None
        if target is None:
            way.traffic.unreachable += parts
            return None
        way.traffic.delivered += parts
        target.inbox.append((data, sender))
        return target.owner
