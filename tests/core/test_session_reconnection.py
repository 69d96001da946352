"""Sessions over virtual networks: restarts, blackouts, silence and orderly ends."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from wires import Town, Weather, values

from pymoos_lite.core.client_session import (
    Connected,
    Disconnected,
    State,
)
from pymoos_lite.core.message import Message
from pymoos_lite.core.parcels import Kind


def test_after_a_restart_clients_come_back_within_a_second_and_register_anew() -> None:
    town = Town()
    sub, pub = town.add("sub"), town.add("pub")
    sub.register("X", 0.0)
    sub.register("Z*", 0.5, "pub")
    sub.register("GONE")
    sub.unregister("GONE")
    town.run(town.settled)
    for n in range(20):  # so that the second life's mail is numbered lower than the first one's
        pub.post("X", float(n), town.now)
        town.run(town.settled)
    assert values(town.mail["sub"], "X") == [float(n) for n in range(20)]
    town.mail["sub"].clear()
    town.start_server()
    town.run(lambda: not town.all_connected())
    pub.post("X", 7.0, town.now)  # while disconnected
    lost_at = town.now
    town.run(town.all_connected)
    assert town.now - lost_at < 1.0
    town.run(town.settled)
    assert values(town.mail["sub"], "X") == [7.0]
    wishes = next(c.subscriptions for c in town.database.connected() if c.name == "sub")
    assert {(s.pattern, s.source, s.interval) for s in wishes.values()} == {
        ("X", "*", 0.0),
        ("Z*", "pub", 0.5),
    }
    kinds = [type(e) for e in town.events["sub"]]
    assert kinds == [Connected, Disconnected, Connected]


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32), st.floats(0.001, 0.1), st.floats(0.0, 20.0))
def test_what_was_posted_while_the_database_was_gone_reaches_all_former_subscribers(
    seed: int, delay: float, outage: float
) -> None:
    # Without loss: with it, one who is back later than the time of gathering finds the last value.
    town = Town(Weather(0.0, 0.1, 0.001, delay), seed)
    subs = [town.add(f"sub{n}") for n in range(3)]
    for sub in subs:
        sub.register("X")
    pub = town.add("pub")
    town.run(town.settled)
    town.server = None
    town.run_for(outage)
    for n in range(100):
        assert pub.post("X", float(n), town.now)
    town.start_server()
    town.run(lambda: not pub.unacknowledged and pub.connected)
    for n in range(100, 150):
        assert pub.post("X", float(n), town.now)
    town.run_for(2.0)
    town.run(town.settled)
    for n in range(3):
        assert values(town.mail[f"sub{n}"], "X") == [float(n) for n in range(150)]


def test_a_short_blackout_is_resumed_and_no_mail_is_lost() -> None:
    town = Town()
    sub, pub = town.add("sub"), town.add("pub")
    sub.register("X")
    town.run(town.settled)
    for n in range(50):
        pub.post("X", float(n), town.now)
    town.weather = Weather(1.0)
    town.run(lambda: not sub.connected)
    for n in range(50, 100):
        pub.post("X", float(n), town.now)
    town.weather = Weather()
    town.run(town.settled)
    assert values(town.mail["sub"], "X") == [float(n) for n in range(100)]
    assert Connected("alpha", True) in town.events["sub"]
    assert town.server is not None
    assert town.server.statistics.resumed == 2
    assert "disconnected=sub" not in str(town.database.get("DB_EVENT"))


def test_what_the_former_database_acknowledged_is_not_posted_to_its_successor() -> None:
    town = Town()
    pub = town.add("pub")
    town.run(town.all_connected)
    pub.post("X", 1.0, town.now)
    sent = pub.datagrams(town.now)
    assert town.server is not None
    for datagram in sent:
        town.server.receive(datagram, "pub", town.now, town.now)
    for datagram, _ in town.server.datagrams(town.now + 0.1, town.now):
        pub.receive(datagram, town.now)
    pub.lose_contact("killed", town.now)  # before the session was asked for anything else
    town.start_server()
    town.run(town.settled)
    assert town.database.get("X") is None


def test_a_parcel_that_was_taken_before_is_not_taken_again() -> None:
    town = Town()
    sub, pub = town.add("sub"), town.add("pub")
    sub.register("X")
    town.run(town.settled)
    pub.post("X", 1.0, 1.0)
    town.run(town.settled)
    server = town.server
    assert server is not None
    again = pub._outbox._pack((1, Kind.POSTS, [("X", 2.0, 1.0, "")]))
    assert pub._link is not None
    pub._link.submit(again)
    pub._outbox.add(Kind.UNREGISTER, "nothing", "")
    mail = server._by_name["sub"].outbox._pack((1, Kind.MAIL, [Message("X", 3.0, 1.0, "pub")]))
    server._by_name["sub"].link.submit(mail)
    server._by_name["sub"].outbox.add(Kind.UNREGISTER, "nothing", "")
    server._by_name["sub"].heard = True
    town.run_for(1.0)
    assert values(town.mail["sub"], "X") == [1.0]
    assert town.database.value("X") == 1.0


@pytest.mark.parametrize("key", [None, b"key"])
def test_a_lost_welcome_is_repeated_when_the_client_asks_again(key: bytes | None) -> None:
    town = Town(key=key)
    server = town.server
    assert server is not None
    app = town.add("app")
    lost: list[bytes] = []
    while not lost:
        for datagram in app.datagrams(town.now):
            server.receive(datagram, "app", town.now, town.now)
        for datagram, _ in server.datagrams(town.now, town.now):
            if server.clients():
                lost.append(datagram)
            else:
                app.receive(datagram, town.now)
        town.now += 0.01
    connection = app._connection
    town.run(town.all_connected, 0.3)
    assert app._connection == connection
    assert server.statistics.admitted == 1
    assert server.statistics.resumed == 0


def test_registrations_made_while_disconnected_hold_after_a_resumption() -> None:
    town = Town()
    sub, pub = town.add("sub"), town.add("pub")
    town.run(town.settled)
    town.weather = Weather(1.0)
    town.run(lambda: not sub.connected)
    sub.register("LATE")
    town.weather = Weather()
    town.run(town.settled)
    pub.post("LATE", 1.0, 1.0)
    town.run(lambda: values(town.mail["sub"], "LATE") == [1.0], 5.0)
    assert town.server is not None
    assert town.server.statistics.resumed == 2, "both went on with what they had"


def test_a_silent_client_is_missed_after_the_timeout_and_its_name_is_free() -> None:
    town = Town()
    town.add("app")
    town.run(town.settled)
    died = town.now
    del town.clients["app"]
    town.run(lambda: town.database.clients() == [])
    assert 4.4 < town.now - died < 5.1
    assert town.server is not None
    assert town.server.statistics.silent == 1
    town.add("app")
    town.run(town.all_connected, 1.0)


def test_an_orderly_close_frees_the_name_at_once() -> None:
    town = Town()
    first = town.add("app")
    town.run(town.settled)
    for datagram in first.close(town.now):
        town._launch(datagram, ("server", "app"))
    town.run_for(0.01)
    assert town.database.clients() == []
    assert first.state is State.CLOSED
    assert not first.post("X", 1.0, 1.0)
    assert town.server is not None
    assert town.server.statistics.closed == 1
    town.add("app", "second")
    town.run(lambda: town.clients["second"].connected, 1.0)


def test_a_database_that_closes_tells_its_clients() -> None:
    town = Town()
    town.add("app")
    town.run(town.settled)
    assert town.server is not None
    for datagram, address in town.server.close(town.now, town.now, "end of mission"):
        town._launch(datagram, ("client", address))
    town.server = None
    town.run_for(0.01)
    assert town.events["app"][-1] == Disconnected("end of mission")


def test_the_socket_layers_word_that_nobody_listens_ends_the_connection_but_not_the_session() -> None:
    town = Town()
    app = town.add("app")
    town.run(town.settled)
    app.lose_contact("nobody there", town.now)
    assert app.state is State.CONNECTING
    town.run(town.all_connected, 1.0)
    assert Connected("alpha", True) in town.events["app"] + app.take_events()
