"""The socket layer over real loopback sockets, among them a relay that loses, doubles and reorders."""

from __future__ import annotations

import contextlib
import random
import socket
import time
from collections.abc import Iterator

import pytest

from pymoos_lite.core.client_session import ClientLimits, Connected, Disconnected, Refused
from pymoos_lite.core.clock import RealClock
from pymoos_lite.core.database import Database
from pymoos_lite.core.link import LinkLimits
from pymoos_lite.core.message import Message
from pymoos_lite.hosts import ports
from pymoos_lite.hosts.ports import DatabaseServer, PortError, RemoteClient, UdpEndpoint, free_port

PATIENCE = 30.0


class Relay:
    """Stands between clients and a database; a socket of its own towards the database per client."""

    def __init__(self, target: tuple[str, int], seed: int, loss: float) -> None:
        self.front = UdpEndpoint()
        self.target = target
        self.rng = random.Random(seed)
        self.loss = loss
        self.backs: dict[object, UdpEndpoint] = {}
        self.late: list[tuple[UdpEndpoint, bytes, object]] = []
        self.passed = self.lost = 0

    def pump(self) -> None:
        out: list[tuple[UdpEndpoint, bytes, object]] = self.late
        self.late = []
        for datagram, address in self.front.receive():
            if address not in self.backs:
                self.backs[address] = UdpEndpoint()
            out.append((self.backs[address], datagram, self.target))
        for address, back in self.backs.items():
            out += [(self.front, datagram, address) for datagram, _ in back.receive()]
        self.rng.shuffle(out)
        for entry in out:
            fate = self.rng.random()
            if fate < self.loss:
                self.lost += 1
                continue
            if fate < self.loss + 0.1:
                self.late.append(entry)
                if fate < self.loss + 0.05:
                    continue
            self.passed += 1
            endpoint, datagram, address = entry
            endpoint.send([(datagram, address)])

    def close(self) -> None:
        for endpoint in (self.front, *self.backs.values()):
            endpoint.close()


class Harbour:
    """A database server and clients pumped in turn by one loop."""

    def __init__(self, key: str | None = None) -> None:
        self.clock = RealClock()
        self.key = key
        self.server = DatabaseServer(Database("alpha", self.clock.now()), self.clock, key=key)
        self.clients: list[RemoteClient] = []
        self.relay: Relay | None = None
        self.mail: dict[RemoteClient, list[Message]] = {}

    def add(self, name: str, limits: ClientLimits | None = None) -> RemoteClient:
        port = (self.relay.front if self.relay else self.server.endpoint).address[1]
        client = RemoteClient(name, port=port, key=self.key, limits=limits)
        self.clients.append(client)
        self.mail[client] = []
        return client

    def turn(self) -> None:
        for client in self.clients:
            self.mail[client] += client.poll(0.0)
        if self.relay is not None:
            self.relay.pump()
        self.server.pump(0.0)

    def until(self, done: object) -> None:
        end = time.monotonic() + PATIENCE
        while not done():  # type: ignore[operator]
            assert time.monotonic() < end, "took too long"
            self.turn()

    def close(self) -> None:
        for client in self.clients:
            client.close(0.0)
        if self.relay is not None:
            self.relay.close()
        self.server.close()


@pytest.fixture(params=[None, "a secret"])
def harbour(request: pytest.FixtureRequest) -> Iterator[Harbour]:
    with contextlib.closing(Harbour(request.param)) as harbour:
        yield harbour


@pytest.mark.parametrize("budget", [1400, ports.LOOPBACK_BUDGET])
def test_ten_thousand_messages_cross_a_lossy_relay_once_and_in_order(
    harbour: Harbour, budget: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ports, "LOOPBACK_BUDGET", budget)
    harbour.relay = Relay(harbour.server.address, 7, loss=0.3)
    sub, texts, doubles = (harbour.add(name) for name in ("sub", "texts", "doubles"))
    sub.register("TEXT")
    sub.register("DOUBLE")
    harbour.until(lambda: all(c.connected and c.flush() for c in harbour.clients))
    rng = random.Random(1)
    sent_texts = [f"{n} {'x' * rng.randrange(200)}" for n in range(10_000)]
    for n, text in enumerate(sent_texts):
        assert texts.notify("TEXT", text)
        assert doubles.notify("DOUBLE", float(n))
        if n % 50 == 0:
            harbour.turn()
    mail = harbour.mail[sub]
    harbour.until(lambda: len(mail) >= 20_000 and not texts.session.unacknowledged)
    harbour.turn()
    assert [m.value for m in mail if m.name == "TEXT"] == sent_texts
    assert [m.value for m in mail if m.name == "DOUBLE"] == [float(n) for n in range(10_000)]
    assert len(mail) == 20_000
    assert harbour.relay.lost > 50
    for client in harbour.clients:
        assert [type(event) for event in client.take_events()] == [Connected]


def test_a_value_of_eight_megabytes_crosses_the_loopback(harbour: Harbour) -> None:
    sub, pub = harbour.add("sub"), harbour.add("pub")
    sub.register("BIG")
    harbour.until(lambda: sub.connected and sub.flush())
    big = random.Random(1).randbytes(8 << 20)
    pub.notify("BIG", big)
    harbour.until(lambda: bool(harbour.mail[sub]))
    assert harbour.mail[sub][0].value == big


def test_apps_in_the_databases_process_and_outside_hear_each_other(harbour: Harbour) -> None:
    database = harbour.server.database
    inside = database.connect("inside", harbour.clock.now())
    database.register("inside", "FROM_OUTSIDE", harbour.clock.now())
    outside = harbour.add("outside")
    outside.register("FROM_INSIDE")
    outside.notify("FROM_OUTSIDE", "hello", time=5.0, aux="why")
    harbour.until(lambda: bool(inside))
    assert inside == [Message("FROM_OUTSIDE", "hello", 5.0, "outside", "why", "alpha")]
    database.publish("inside", Message("FROM_INSIDE", b"\x00\xff", 6.0, "inside"), 6.0)
    harbour.until(lambda: bool(harbour.mail[outside]))
    assert harbour.mail[outside] == [Message("FROM_INSIDE", b"\x00\xff", 6.0, "inside", "", "alpha")]


def test_throttled_mail_and_database_variables_arrive_without_anybody_posting(harbour: Harbour) -> None:
    sub = harbour.add("sub")
    sub.register("X", interval=0.2)
    sub.register("DB_TIME")
    pub = harbour.add("pub")
    harbour.until(lambda: sub.connected and sub.flush())
    pub.notify("X", 1.0)
    pub.notify("X", 2.0)
    pub.notify("X", 3.0)
    harbour.until(lambda: [m.value for m in harbour.mail[sub] if m.name == "X"] == [1.0, 3.0])
    harbour.until(lambda: any(m.name == "DB_TIME" for m in harbour.mail[sub]))


def test_a_client_notices_at_once_that_nobody_listens_any_more() -> None:
    harbour = Harbour()
    client = harbour.add("app")
    harbour.until(lambda: client.connected)
    harbour.server.endpoint.close()  # as when the process is killed: no farewell
    began = time.monotonic()
    client.notify("X", 1.0)
    while client.connected:
        client.poll(0.05)
        assert time.monotonic() - began < 10.0
    events = client.take_events()
    assert [type(e) for e in events] == [Connected, Disconnected]
    assert client.close(0.0) is False  # and says that something was not delivered


def test_poll_waits_no_longer_than_asked_and_returns_early_with_mail(harbour: Harbour) -> None:
    client = harbour.add("app")
    client.register("X")
    harbour.until(lambda: client.connected and client.flush())
    began = time.monotonic()
    client.poll(0.05)
    assert time.monotonic() - began >= 0.05
    harbour.server.database.connect("inside", 1.0)
    harbour.server.database.publish("inside", Message("X", 1.0, 1.0, "inside"), 1.0)
    harbour.server.flush()
    assert [m.value for m in client.poll(PATIENCE)] == [1.0]


def test_close_says_whether_all_was_delivered_and_frees_the_name(harbour: Harbour) -> None:
    client, forgetful = harbour.add("app"), harbour.add("forgetful")
    harbour.until(lambda: client.connected and forgetful.connected)
    client.notify("X", 1.0)
    harbour.until(client.flush)
    assert client.close(0.0) is True
    forgetful.notify("Y", 1.0)
    assert forgetful.close(0.0) is False
    harbour.clients.clear()
    harbour.until(lambda: harbour.server.database.clients() == [])
    assert harbour.server.database.value("X") == 1.0


def test_a_second_client_of_one_name_hears_why_it_is_refused(harbour: Harbour) -> None:
    first = harbour.add("app")
    harbour.until(lambda: first.connected)
    second = harbour.add("app")
    events: list[object] = []
    harbour.until(lambda: events.extend(second.take_events()) or bool(events))
    assert isinstance(events[0], Refused)
    assert not second.notify("X", 1.0)


def test_a_port_in_use_is_an_error_that_names_it() -> None:
    with contextlib.closing(UdpEndpoint()) as endpoint:
        port = endpoint.address[1]
        with pytest.raises(PortError, match=f"cannot use UDP port {port} on 127.0.0.1"):
            UdpEndpoint(port=port)


def test_an_unknown_host_and_an_impossible_port_are_errors_that_name_them() -> None:
    with pytest.raises(PortError, match=r"host 'no such host' is not known"):
        RemoteClient("app", "no such host")
    with pytest.raises(PortError, match=r"0\.\.65535, not 70000"):
        RemoteClient("app", port=70_000)


def test_sockets_are_bound_to_loopback_unless_told_otherwise() -> None:
    with contextlib.closing(UdpEndpoint()) as endpoint:
        assert endpoint.address[0] == "127.0.0.1"
    clock = RealClock()
    server = DatabaseServer(Database("alpha", clock.now()), clock)
    assert server.address[0] == "127.0.0.1"
    server.close()


def test_datagrams_are_large_on_loopback_and_small_elsewhere() -> None:
    assert ports.path_to(("127.0.0.1", 9000)).budget == ports.LOOPBACK_BUDGET
    assert ports.path_to(("::1", 9000)).budget == ports.LOOPBACK_BUDGET
    assert ports.path_to(("192.168.1.7", 9000)).budget == 1400
    assert ports.path_to(("fe80::1", 9000)).budget == 1400


def test_a_free_port_can_be_used() -> None:
    port = free_port()
    with contextlib.closing(UdpEndpoint(port=port)) as endpoint:
        assert endpoint.address[1] == port


def test_an_endpoint_survives_peers_that_vanish_and_datagrams_that_do_not_fit() -> None:
    with contextlib.closing(UdpEndpoint()) as gone:
        address = gone.address
    with contextlib.closing(UdpEndpoint()) as endpoint:
        endpoint.send([(b"anybody?", address)] * 10)
        endpoint.send([(bytes(100_000), address)])
        assert endpoint.receive() == []
        assert endpoint.lost_on_sending == 1
        assert endpoint.unreachable is False
    assert any(tells_that_nobody_is_there() for _attempt in range(5))


def tells_that_nobody_is_there() -> bool:
    """Whether an endpoint hears that its peer's port is closed; False if somebody took the port meanwhile."""
    with contextlib.closing(UdpEndpoint()) as gone:
        address = gone.address
    with contextlib.closing(UdpEndpoint(peer=address)) as connected:
        end = time.monotonic() + 3.0
        while not connected.unreachable and time.monotonic() < end:
            connected.send_to_peer([b"anybody?"])
            connected.wait(0.01)
            connected.receive()
        return connected.unreachable


class PausedClock(RealClock):
    """A clock that can be told that time has passed, as when a process was stopped for a while."""

    skipped = 0.0

    def wall(self) -> float:
        return super().wall() + self.skipped


def test_after_a_long_pause_of_the_database_nobody_is_taken_for_silent_who_was_not() -> None:
    clock = PausedClock()
    server = DatabaseServer(Database("alpha", clock.now()), clock)
    limits = ClientLimits(link=LinkLimits(timeout=60.0))
    client = RemoteClient("app", port=server.address[1], limits=limits)
    end = time.monotonic() + PATIENCE
    while not (client.connected and client.flush()):
        assert time.monotonic() < end
        client.poll(0.0)
        server.pump(0.0)
    client.notify("X", 1.0)
    client.poll(0.0)
    clock.skipped = 6.0  # the database's process slept, and the client's post lies in its socket
    server.flush()
    assert server.database.clients() == ["app"]
    assert server.database.value("X") == 1.0
    clock.skipped = 12.0  # this time the client said nothing
    server.flush()
    assert server.database.clients() == []
    client.close(0.0)
    server.close()


def test_after_a_long_pause_of_an_app_its_connection_is_judged_by_what_came_meanwhile() -> None:
    with contextlib.closing(Harbour()) as harbour:
        clock = PausedClock()
        client = RemoteClient("app", port=harbour.server.address[1], clock=clock)
        harbour.clients.append(client)
        harbour.mail[client] = []
        harbour.until(lambda: client.connected and client.flush())
        harbour.server.database.connect("inside", 1.0)
        client.register("X")
        harbour.until(client.flush)
        harbour.server.database.publish("inside", Message("X", 1.0, 1.0, "inside"), 1.0)
        harbour.server.flush()
        clock.skipped = 4.0
        assert [m.value for m in client.poll(0.0)] == [1.0]
        assert client.connected


def test_the_link_timeout_of_a_client_can_be_chosen() -> None:
    with contextlib.closing(Harbour()) as harbour:
        client = harbour.add("app", ClientLimits(link=LinkLimits(timeout=1.0, keepalive=0.2)))
        harbour.until(lambda: client.connected)
        began = time.monotonic()
        while client.connected:  # the server is not pumped: it has stopped answering
            client.poll(0.05)
            assert time.monotonic() - began < 10.0
        assert time.monotonic() - began > 0.7


@pytest.mark.skipif(not socket.has_ipv6, reason="no IPv6 on this machine")
def test_a_community_can_live_on_ipv6() -> None:
    clock = RealClock()
    try:
        server = DatabaseServer(Database("alpha", clock.now()), clock, host="::1")
    except PortError:
        pytest.skip("no IPv6 loopback here")
    client = RemoteClient("app", "::1", server.address[1])
    end = time.monotonic() + PATIENCE
    while not client.connected and time.monotonic() < end:
        client.poll(0.0)
        server.pump(0.01)
    assert client.connected
    client.close(0.0)
    server.close()
