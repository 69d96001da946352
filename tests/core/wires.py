"""Virtual networks for the tests of link and sessions: time and mishap are arguments."""

from __future__ import annotations

import heapq
import itertools
import random
from collections.abc import Callable
from dataclasses import dataclass, field

from hypothesis import strategies as st

from pymoos_lite.core.client_session import ClientLimits, ClientSession
from pymoos_lite.core.database import Database
from pymoos_lite.core.link import Link
from pymoos_lite.core.message import Message
from pymoos_lite.core.server_session import ServerLimits, ServerSession

TIE = 1e-6  # sessions that ask to be called "now" are called this much later


@dataclass
class Weather:
    """What a network does to datagrams. Delays are drawn anew for each, which reorders."""

    loss: float = 0.0
    duplication: float = 0.0
    shortest: float = 0.001
    longest: float = 0.001

    def fates(self, rng: random.Random) -> list[float]:
        """Delays of the copies that arrive."""
        copies = 2 if rng.random() < self.duplication else 1
        return [rng.uniform(self.shortest, self.longest) for _ in range(copies) if rng.random() >= self.loss]


class Pair:
    """Two links, mouth to ear."""

    def __init__(self, links: tuple[Link, Link], weather: Weather, seed: int) -> None:
        self.links = links
        self.weather = weather
        self.rng = random.Random(seed)
        self.now = 0.0
        self.received: tuple[list[bytes], list[bytes]] = ([], [])
        self.on_air: list[tuple[float, int, int, bytes]] = []
        self.order = itertools.count()
        self.turns = 0
        self.check: Callable[[], None] = lambda: None

    def send(self) -> None:
        for side, link in enumerate(self.links):
            for datagram in link.datagrams(self.now):
                for delay in self.weather.fates(self.rng):
                    entry = (self.now + delay, next(self.order), 1 - side, datagram)
                    heapq.heappush(self.on_air, entry)

    def step(self) -> None:
        """Go to the next thing that happens."""
        self.send()
        self.turns += 1
        moment = min(self.links[0].next_deadline(), self.links[1].next_deadline())
        if self.on_air:
            moment = min(moment, self.on_air[0][0])
        self.now = max(self.now + TIE, moment)
        while self.on_air and self.on_air[0][0] <= self.now:
            _, _, side, datagram = heapq.heappop(self.on_air)
            try:
                self.received[side].extend(self.links[side].receive(datagram, self.now))
            except Exception as error:
                if type(error).__name__ != "FrameError":
                    raise
        self.check()

    def run(self, until: Callable[[], bool], longest: float = 3600.0) -> None:
        while not until():
            assert self.now < longest, f"not done after {self.now} s"
            self.step()


@dataclass
class Town:
    """A database, its server session and clients, joined by a network of one weather."""

    weather: Weather = field(default_factory=Weather)
    seed: int = 1
    key: bytes | None = None
    limits: ServerLimits = field(default_factory=ServerLimits)
    client_limits: ClientLimits = field(default_factory=ClientLimits)

    def __post_init__(self) -> None:
        self.rng = random.Random(self.seed)
        self.now = 0.0
        self.on_air: list[tuple[float, int, object, bytes]] = []
        self.order = itertools.count()
        self.clients: dict[str, ClientSession] = {}
        self.mail: dict[str, list[Message]] = {}
        self.events: dict[str, list[object]] = {}
        self.check: Callable[[], None] = lambda: None
        self.server: ServerSession | None = None
        self.start_server()

    def start_server(self) -> ServerSession:
        self.database = Database("alpha", self.now)
        self.server = ServerSession(
            self.database, self.now, self.rng.randbytes, key=self.key, limits=self.limits
        )
        return self.server

    def add(self, name: str, label: str | None = None, key: bytes | str | None = "same") -> ClientSession:
        """A client; `label` tells two of one name apart."""
        used = self.key if key == "same" else key
        client = ClientSession(name, self.now, self.rng.randbytes, key=used, limits=self.client_limits)  # type: ignore[arg-type]
        label = label or name
        self.clients[label] = client
        self.mail[label] = []
        self.events[label] = []
        return client

    def _launch(self, datagram: bytes, to: object) -> None:
        for delay in self.weather.fates(self.rng):
            heapq.heappush(self.on_air, (self.now + delay, next(self.order), to, datagram))

    def step(self, until: float = float("inf")) -> None:
        """Go to the next thing that happens, not beyond `until`."""
        server = self.server
        if server is not None:
            for datagram, address in server.datagrams(self.now, self.now):
                self._launch(datagram, ("client", address))
        for label, client in self.clients.items():
            for datagram in client.datagrams(self.now):
                self._launch(datagram, ("server", label))
        moment = min([c.next_deadline() for c in self.clients.values()], default=float("inf"))
        if server is not None:
            moment = min(moment, server.next_deadline())
        if self.on_air:
            moment = min(moment, self.on_air[0][0])
        self.now = max(self.now + TIE, min(moment, self.now + 1.0, until))
        while self.on_air and self.on_air[0][0] <= self.now:
            _, _, (way, who), datagram = heapq.heappop(self.on_air)  # type: ignore[misc]
            if way == "server":
                if self.server is not None:
                    self.server.receive(datagram, who, self.now, self.now)
            elif who in self.clients:
                self.clients[who].receive(datagram, self.now)
        for label, client in self.clients.items():
            self.mail[label] += client.take_mail()
            self.events[label] += client.take_events()
        self.check()

    def run(self, until: Callable[[], bool], longest: float = 600.0) -> None:
        end = self.now + longest
        while not until():
            assert self.now < end, f"not done after {longest} s: {self.events}"
            self.step()

    def run_for(self, seconds: float) -> None:
        end = self.now + seconds
        while self.now < end:
            self.step(end)

    def all_connected(self) -> bool:
        return all(client.connected for client in self.clients.values())

    def settled(self) -> bool:
        """Everything posted has been taken, and everything mailed has arrived."""
        assert self.server is not None
        return (
            self.all_connected()
            and not any(client.unacknowledged for client in self.clients.values())
            and not any(peer.mailbox or peer.link.backlog for peer in self.server._peers.values())
        )


def any_weather(longest: float) -> st.SearchStrategy[Weather]:
    """Weather of all kinds, with delays of up to `longest` seconds."""
    return st.builds(
        Weather,
        loss=st.floats(0, 0.4),
        duplication=st.floats(0, 0.4),
        shortest=st.just(0.0005),
        longest=st.floats(0.0005, longest),
    )


weathers = any_weather(0.1)
keys = st.sampled_from([None, b"community key"])


def values(mail: list[Message], name: str) -> list[object]:
    """The values of a variable among the mail, in order."""
    return [m.value for m in mail if m.name == name]
