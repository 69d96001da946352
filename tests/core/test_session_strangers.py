"""Sessions over virtual networks: keys, replays and spoofed addresses."""

from __future__ import annotations

import random

import pytest
from wires import Town, Weather

from pymoos_lite.core.client_session import (
    Refused,
    State,
    Warned,
)
from pymoos_lite.core.frames import (
    CONNECTION_BYTES,
    HELLO_PADDING,
    Close,
    Connect,
    Data,
    Fault,
    Hello,
    RefusalCode,
    Reset,
    decode,
    encode,
)


def test_a_client_with_the_key_is_served_in_any_weather_and_one_without_is_refused() -> None:
    town = Town(Weather(0.3, 0.3, 0.001, 0.05), key=b"key")
    town.add("sub").register("X")
    town.add("pub")
    stranger = town.add("stranger", key=None)
    forger = town.add("forger", key=b"guess")
    town.clients["pub"].post("X", 1.0, 1.0)
    town.run(lambda: bool(town.mail["sub"]))
    town.run_for(20.0)
    assert stranger.state is State.REFUSED
    (event,) = town.events["stranger"]
    assert event == Refused(
        RefusalCode.KEY_NEEDED, "the database wants a community key and this client has none"
    )
    assert forger.state is State.CONNECTING
    assert sorted(town.database.clients()) == ["pub", "sub"]
    assert town.server is not None
    dropped = town.server.statistics.dropped
    assert dropped[Fault.UNSEALED] >= 1
    assert dropped[Fault.BAD_SEAL] >= 5


def test_a_client_with_a_key_is_told_when_the_database_has_none_but_does_not_trust_the_word() -> None:
    town = Town()
    app = town.add("app", key=b"key")
    town.run_for(5.0)
    assert app.state is State.CONNECTING
    assert town.events["app"] == [Warned("the database here uses no community key, this client does")]


@pytest.mark.parametrize("key", [None, b"key"])
def test_a_recorded_session_played_back_changes_nothing(key: bytes | None) -> None:
    town = Town(key=key)
    server = town.server
    assert server is not None
    recording: list[tuple[bytes, object]] = []
    receive = server.receive
    server.receive = lambda d, a, w, n: (recording.append((d, a)), receive(d, a, w, n))[1]  # type: ignore[method-assign,func-returns-value,assignment]
    app = town.add("app")
    for n in range(20):
        app.post("X", float(n), town.now)
    town.run(town.settled)
    writes = server.database.statistics.accepted
    for datagram, address in list(recording):
        receive(datagram, address, town.now, town.now)
    town.run_for(0.5)
    assert app.connected
    assert server.database.statistics.accepted == writes
    for datagram in app.close(town.now):
        receive(datagram, "app", town.now, town.now)
    del town.clients["app"]
    writes = server.database.statistics.accepted
    for _ in range(3):
        for datagram, address in list(recording):
            receive(datagram, address, town.now, town.now)
        town.run_for(7.0)
    assert server.database.clients() == []
    assert server.database.statistics.accepted == writes
    assert server.statistics.admitted == 1


def test_a_replayed_datagram_does_not_keep_a_dead_client_alive() -> None:
    town = Town(key=b"key")
    server = town.server
    assert server is not None
    app = town.add("app")
    town.run(town.settled)
    app.post("X", 1.0, 1.0)
    recording = app.datagrams(town.now)
    del town.clients["app"]
    for _ in range(60):
        for datagram in recording:
            server.receive(datagram, "app", town.now, town.now)
        town.run_for(0.1)
    assert server.database.clients() == []


def test_strangers_cost_no_memory_and_get_no_more_than_they_send() -> None:
    town = Town()
    server = town.server
    assert server is not None
    rng = random.Random(1)
    for n in range(5000):
        connection = rng.randbytes(CONNECTION_BYTES)
        hello = encode(Hello(bytes(HELLO_PADDING)), connection)
        connect = encode(
            Connect(rng.randbytes(24), f"app{n}", rng.randbytes(16), b"", 0, 1400, 10**6), connection
        )
        data = encode(Data(1, 0, 0, 0, 0, b"x"), connection)
        for datagram in (hello, connect, data):
            server.receive(datagram, ("10.0.0.1", n), 1.0, 1.0)
            assert sum(len(d) for d, _ in server.datagrams(1.0, 1.0)) <= len(datagram)
    assert not server._peers
    assert not len(server._cookies)
    assert server.statistics.dropped[Fault.BAD_COOKIE] == 5000
    assert server.statistics.dropped[Fault.UNKNOWN_CONNECTION] == 5000
    assert server.statistics.resets <= 100  # and answers to the last kind are rationed


def test_a_cookie_holds_only_for_its_address_its_connection_and_ten_seconds() -> None:
    town = Town()
    server = town.server
    assert server is not None
    server.receive(encode(Hello(bytes(HELLO_PADDING)), b"aaaaaaaa"), "home", 1.0, 1.0)
    ((answer, _),) = server.datagrams(1.0, 1.0)
    cookie = decode(answer).cookie  # type: ignore[union-attr]
    connect = Connect(cookie, "app", bytes(16), b"", 0, 1400, 10**6)
    server.receive(encode(connect, b"aaaaaaaa"), "elsewhere", 1.0, 1.0)
    server.receive(encode(connect, b"bbbbbbbb"), "home", 1.0, 1.0)
    server.receive(encode(connect, b"aaaaaaaa"), "home", 11.5, 11.5)
    assert server.statistics.dropped[Fault.BAD_COOKIE] == 3
    server.receive(encode(connect, b"aaaaaaaa"), "home", 10.5, 10.5)
    assert server.clients() == ["app"]


def test_resets_and_closes_of_strangers_do_not_touch_a_connection() -> None:
    town = Town(key=b"key")
    app = town.add("app")
    town.run(town.settled)
    for forged in (
        encode(Reset(), app._connection),
        encode(Reset(), app._connection, b"guess"),
        encode(Close(999, "bye"), app._connection),
        encode(Close(999, "bye"), app._connection, b"guess"),
    ):
        app.receive(forged, town.now)
        assert town.server is not None
        town.server.receive(forged, "app", town.now, town.now)
    assert app.connected
    assert town.database.clients() == ["app"]
