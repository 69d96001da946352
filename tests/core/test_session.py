"""Server and client sessions over virtual networks: admission, reconnection, bounds, refusals."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from wires import Town, Weather

from pymoos_lite.core.assembly import frame_record
from pymoos_lite.core.client_session import (
    ClientLimits,
    ClientSession,
    Connected,
    Disconnected,
    QueueFull,
    QueueOpen,
    Refused,
    State,
    Warned,
    WriteRefused,
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
from pymoos_lite.core.link import LinkLimits
from pymoos_lite.core.message import Message
from pymoos_lite.core.parcels import Kind
from pymoos_lite.core.server_session import ServerLimits

weathers = st.builds(
    Weather,
    loss=st.floats(0, 0.4),
    duplication=st.floats(0, 0.4),
    shortest=st.just(0.0005),
    longest=st.floats(0.0005, 0.1),
)
keys = st.sampled_from([None, b"community key"])


def values(mail: list[Message], name: str) -> list[object]:
    return [m.value for m in mail if m.name == name]


# --- delivery ---------------------------------------------------------------------------------


@settings(max_examples=30, deadline=None)
@given(weathers, st.integers(0, 2**32), keys, st.integers(1, 4), st.integers(1, 3), st.integers(1, 300))
def test_every_post_of_every_client_arrives_once_and_in_order_in_any_weather(
    weather: Weather, seed: int, key: bytes | None, publishers: int, subscribers: int, posts: int
) -> None:
    town = Town(weather, seed, key)
    for n in range(subscribers):
        town.add(f"sub{n}").register("V*")
    town.run(town.all_connected)
    town.run(lambda: all(not c.unacknowledged for c in town.clients.values()))
    rng = random.Random(seed)
    pubs = [town.add(f"pub{n}") for n in range(publishers)]
    for n in range(posts):
        for index, client in enumerate(pubs):
            assert client.post(f"V{index}", float(n), town.now)
        if rng.random() < 0.1:
            town.step()
    town.run(town.settled)
    town.run_for(0.5)
    expected = [float(n) for n in range(posts)]
    for n in range(subscribers):
        mail = town.mail[f"sub{n}"]
        assert len(mail) == posts * publishers
        for index in range(publishers):
            assert values(mail, f"V{index}") == expected
            assert {m.source for m in mail if m.name == f"V{index}"} == {f"pub{index}"}


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32), keys, st.data())
def test_no_post_is_lost_or_doubled_through_blackouts_and_restarts(
    seed: int, key: bytes | None, data: st.DataObject
) -> None:
    """Within one life of the database exactly once and in order; over all lives nothing is missing."""
    calm = Weather(0.1, 0.1, 0.001, 0.02)
    town = Town(calm, seed, key)
    pubs = [town.add(f"pub{n}") for n in range(3)]
    lives = [town.database.connect("observer", 0.0)]
    town.database.register("observer", "V*", 0.0)
    posted = 0
    for what in data.draw(st.lists(st.sampled_from(["post", "blackout", "restart", "pause"]), max_size=12)):
        if what == "restart":
            town.server = None
            town.run_for(data.draw(st.floats(0.0, 8.0)))
            town.start_server()
            lives.append(town.database.connect("observer", town.now))
            town.database.register("observer", "V*", town.now)
        elif what == "blackout":
            town.weather = Weather(1.0)
            town.run_for(data.draw(st.floats(0.1, 12.0)))
            town.weather = calm
        elif what == "pause":
            town.run_for(data.draw(st.floats(0.0, 2.0)))
        for _ in range(data.draw(st.integers(0, 40))):
            for index, client in enumerate(pubs):
                assert client.post(f"V{index}", float(posted), town.now)
            posted += 1
        town.run_for(data.draw(st.floats(0.0, 0.1)))
    town.run(town.settled)
    for index in range(3):
        seen: set[object] = set()
        for mailbox in lives:
            got = values(mailbox, f"V{index}")
            assert got == sorted(set(got)), "out of order or doubled"  # type: ignore[type-var]
            seen.update(got)
        assert seen == {float(n) for n in range(posted)}


def test_a_value_of_nine_megabytes_crosses_two_lossy_hops() -> None:
    town = Town(Weather(0.1, 0.1, 0.0005, 0.001))
    town.limits = ServerLimits()
    town.add("sub").register("BIG")
    pub = town.add("pub")
    town.run(town.all_connected)
    town.run_for(1.0)
    big = random.Random(1).randbytes(9 << 20)
    assert pub.post("BIG", big, 1.0)
    town.run(lambda: bool(town.mail["sub"]))
    assert town.mail["sub"][0].value == big


def test_posts_carry_time_aux_and_the_name_under_which_the_client_connected() -> None:
    town = Town()
    town.add("sub").register("*")
    pub = town.add("pHelmIvP")
    town.run(town.settled)
    pub.post("DESIRED_SPEED", 2, 123.5, "12:waypt")
    town.run(lambda: any(m.name == "DESIRED_SPEED" for m in town.mail["sub"]))
    message = next(m for m in town.mail["sub"] if m.name == "DESIRED_SPEED")
    assert message == Message("DESIRED_SPEED", 2.0, 123.5, "pHelmIvP", "12:waypt", "alpha")


def test_relayed_messages_keep_source_and_community() -> None:
    town = Town()
    town.add("sub").register("X")
    bridge = town.add("pShare")
    foreign = Message("X", "v", 5.0, "pHelmIvP", "aux", "henry")
    bridge.relay(foreign)
    bridge.post("X", "own", 6.0)
    bridge.relay(foreign)
    town.run(lambda: len(town.mail["sub"]) >= 3)
    own = Message("X", "own", 6.0, "pShare", "", "alpha")
    assert town.mail["sub"] == [foreign, own, foreign]


def test_what_an_app_in_the_databases_process_posts_reaches_remote_subscribers() -> None:
    town = Town()
    town.add("sub").register("NAV_*")
    town.run(town.settled)
    town.database.connect("local", town.now)
    town.database.publish("local", Message("NAV_X", 1.0, 2.0, "local"), town.now)
    town.run(lambda: bool(town.mail["sub"]), 1.0)
    assert town.mail["sub"] == [Message("NAV_X", 1.0, 2.0, "local", "", "alpha")]


def test_unregistering_stops_the_mail() -> None:
    town = Town()
    sub, pub = town.add("sub"), town.add("pub")
    sub.register("X")
    sub.register("Y*", source="pub")
    town.run(town.settled)
    sub.unregister("X")
    sub.unregister("Y*")
    town.run(town.settled)
    pub.post("X", 1.0, 1.0)
    pub.post("Y1", 1.0, 1.0)
    town.run(town.settled)
    town.run_for(0.2)
    assert town.mail["sub"] == []


def test_a_registration_without_anything_else_leaves_by_itself() -> None:
    town = Town()
    sub = town.add("sub")
    town.run(town.settled)
    sub.register("DB_TIME")
    assert sub.next_deadline() <= town.now


# --- reconnection -----------------------------------------------------------------------------


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


# --- admission --------------------------------------------------------------------------------


def test_a_second_client_of_one_name_is_refused_and_the_first_unaffected() -> None:
    town = Town()
    first = town.add("app")
    town.run(town.settled)
    second = town.add("app", "other")
    town.run(lambda: second.state is not State.CONNECTING)
    assert second.state is State.REFUSED
    (event,) = town.events["other"]
    assert event == Refused(RefusalCode.NAME_CLASH, 'A client of this name ("app") already exists')
    assert not second.post("X", 1.0, 1.0)
    town.run_for(10.0)
    assert first.connected
    assert len(town.events["app"]) == 1


def test_a_name_used_inside_the_databases_process_is_refused_as_well() -> None:
    town = Town()
    town.database.connect("app", 0.0)
    app = town.add("app")
    town.run(lambda: app.state is State.REFUSED, 5.0)
    assert town.database.clients() == ["app"], "the first one keeps its place"
    assert town.server is not None
    assert town.server.statistics.admitted == 0


def test_with_patience_a_successor_waits_until_its_killed_predecessor_is_missed() -> None:
    town = Town(client_limits=ClientLimits(clash_patience=8.0))
    town.add("app")
    town.run(town.settled)
    del town.clients["app"]
    town.add("app", "successor")
    town.run(town.all_connected, 8.0)
    assert town.now > 4.0


def test_a_name_that_is_no_text_is_refused_on_the_spot() -> None:
    with pytest.raises(ValueError, match="must be text"):
        Town().add("\ud800")


@pytest.mark.parametrize("name", ["", "x" * 129, "new\nline"])
def test_an_unacceptable_name_is_refused_with_what_would_be_right(name: str) -> None:
    town = Town()
    town.add(name, "app")
    town.run(lambda: town.clients["app"].state is State.REFUSED, 5.0)
    (event,) = town.events["app"]
    assert isinstance(event, Refused)
    assert event.code is RefusalCode.BAD_NAME
    assert "1 to 128 printable characters" in event.reason


def test_a_full_community_makes_newcomers_wait_and_says_so() -> None:
    town = Town(limits=ServerLimits(clients=2))
    for name in "ab":
        town.add(name)
    town.run(town.settled)
    town.add("c")
    town.run_for(3.0)
    assert not town.clients["c"].connected
    assert town.events["c"] == [Warned("the community has 2 clients, no more are admitted now; waiting")]
    del town.clients["a"]
    town.run(town.all_connected, 10.0)


# --- keys, replays, spoofing ------------------------------------------------------------------


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


# --- bounds and refusals ----------------------------------------------------------------------


def test_a_subscriber_that_stops_reading_is_disconnected_and_others_are_unaffected() -> None:
    town = Town(limits=ServerLimits(mail_bytes=100_000))
    for name in ("stuck", "fine"):
        town.add(name).register("X")
    pub = town.add("pub")
    town.run(town.settled)
    server = town.server
    assert server is not None
    stuck = town.clients.pop("stuck")
    most = 0
    for n in range(300):
        pub.post("X", f"{n:05d}" + "x" * 1000, town.now)
        town.run_for(0.01)
        most = max([most, *(peer.outbox.bytes for peer in server._peers.values())])
    assert most <= 110_000
    assert server.statistics.slow == 1
    assert [str(v)[:5] for v in values(town.mail["fine"], "X")] == [f"{n:05d}" for n in range(300)]
    event = town.database.get("DB_EVENT")
    assert event is not None
    assert "disconnected=stuck,reason=stuck reads too slowly" in str(event.value)
    town.clients["stuck"] = stuck  # it wakes up
    town.run(lambda: not stuck.connected)
    town.run(town.all_connected, 10.0)
    assert [type(e) for e in town.events["stuck"]] == [Connected, Disconnected, Connected]


def test_the_writer_of_a_wrong_type_is_told_once_per_batch_with_a_count() -> None:
    town = Town()
    app = town.add("app")
    app.post("X", 1.0, 1.0)
    for _ in range(10):
        app.post("X", "text", 2.0)
    town.run(lambda: len(town.events["app"]) >= 2)
    refusals = [e for e in town.events["app"] if isinstance(e, WriteRefused)]
    assert sum(e.count for e in refusals) == 10
    assert refusals[0].name == "X"
    assert "app wrote a string to X, which holds a double" in refusals[0].reason


def test_posts_wait_for_the_database_up_to_a_bound_in_number_and_then_are_refused_visibly() -> None:
    town = Town(client_limits=ClientLimits(posts=100))
    app = town.add("app")
    accepted = [app.post("X", float(n), 1.0) for n in range(150)]
    assert accepted == [True] * 100 + [False] * 50
    assert app.refused_posts == 50
    mailbox = town.database.connect("observer", 0.0)
    town.database.register("observer", "X", 0.0)
    town.run(town.settled)
    assert values(mailbox, "X") == [float(n) for n in range(100)]
    full, opened = (e for e in town.events["app"] if not isinstance(e, Connected))
    assert isinstance(full, QueueFull)
    assert full.waiting == 100
    assert opened == QueueOpen(50)


def test_posts_wait_for_the_database_up_to_a_bound_in_bytes() -> None:
    town = Town(client_limits=ClientLimits(post_bytes=10_000))
    app = town.add("app")
    accepted = [app.post("X", "x" * 936, 1.0) for _ in range(12)]
    assert accepted == [True] * 10 + [False] * 2
    assert app.unacknowledged_bytes <= 10_000


@pytest.mark.parametrize(
    ("post", "error", "text"),
    [
        (("", 1.0, 1.0), ValueError, "1 to 256 characters"),
        (("x" * 257, 1.0, 1.0), ValueError, "1 to 256 characters"),
        (("\ud800", 1.0, 1.0), ValueError, "1 to 256 characters"),
        (("X", [1.0], 1.0), TypeError, "not list"),
        (("X", None, 1.0), TypeError, "not NoneType"),
        (("X", "\ud800", 1.0), ValueError, "half a surrogate pair"),
        (("X", bytes((16 << 20) + 1), 1.0), ValueError, "allowed are"),
        (("X", "\u20ac" * (6 << 20), 1.0), ValueError, "allowed are"),
        (("X", 1.0, float("nan")), ValueError, "finite number"),
        (("X", 1.0, "now"), ValueError, "finite number"),
        (("X", 1.0, 1.0, "a" * 4097), ValueError, "4096"),
        (("X", 1.0, 1.0, "\ud800"), ValueError, "4096"),
    ],
)
def test_posts_that_no_database_would_take_are_refused_on_the_spot(
    post: tuple[object, ...], error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=text):
        Town().add("app").post(*post)  # type: ignore[arg-type]


def test_registrations_that_make_no_sense_are_refused_on_the_spot() -> None:
    app = Town().add("app")
    for wrong in (("",), ("X", -1.0), ("X", float("nan")), ("X", 0.0, "")):
        with pytest.raises(ValueError, match=r"variable name|interval"):
            app.register(*wrong)  # type: ignore[arg-type]


def test_a_client_may_not_hold_more_registrations_than_the_limit() -> None:
    town = Town(limits=ServerLimits(registrations=3))
    app = town.add("app")
    for n in range(5):
        app.register(f"X{n}")
    town.run(town.settled)
    town.run_for(0.1)
    refused = [e for e in town.events["app"] if isinstance(e, WriteRefused)]
    assert [e.name for e in refused] == ["X3", "X4"]


def test_a_client_that_breaks_the_rules_is_cut_off_alone() -> None:
    town = Town()
    rogue, good = town.add("rogue"), town.add("good")
    town.run(town.settled)
    assert rogue._link is not None
    rogue._link.submit(frame_record(b"\xc1 no parcel"))
    town.run(lambda: not rogue.connected)
    assert town.server is not None
    assert town.server.statistics.violations == 1
    reason = town.events["rogue"][-1].reason  # type: ignore[attr-defined]
    assert reason.startswith("unacceptable parcel")
    assert good.connected
    assert len(town.events["good"]) == 1


def test_clients_together_cannot_make_the_server_hold_more_than_the_limit() -> None:
    limits = ServerLimits(unfinished_bytes=500_000)
    town = Town(limits=limits)
    rogues = [town.add(f"rogue{n}") for n in range(10)]
    town.run(town.settled)
    server = town.server
    assert server is not None
    most = 0

    def watch() -> None:
        nonlocal most
        most = max(most, sum(peer.link.buffered for peer in server._peers.values()))

    town.check = watch
    for rogue in rogues:
        assert rogue._link is not None
        # A record that never ends: announced with 10 MB, 100 kB sent.
        record = rogue._outbox.add(Kind.POSTS, [("X", bytes(100_000), 1.0, "")])
        rogue._link.submit((10 << 20).to_bytes(4, "big") + record[4:])
    town.run_for(2.0)
    assert 400_000 < most <= 500_000 + 1400
    assert server.statistics.violations > 0
    assert server._buffered == sum(peer.buffered for peer in server._peers.values())


def test_an_oversized_value_posted_inside_the_databases_process_does_not_stop_the_mail() -> None:
    small = replace(LinkLimits(), max_record=10_000)
    town = Town(limits=ServerLimits(link=small))
    town.add("sub").register("X")
    town.run(town.settled)
    town.database.connect("local", town.now)
    town.database.publish("local", Message("X", "x" * 20_000, 1.0, "local"), town.now)
    town.database.publish("local", Message("X", "fine", 2.0, "local"), town.now)
    town.run(lambda: len(town.events["sub"]) > 1)
    assert values(town.mail["sub"], "X") == ["fine"]
    notice = town.events["sub"][-1]
    assert isinstance(notice, WriteRefused)
    assert notice.reason.startswith("not delivered")


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32))
def test_garbage_in_both_directions_changes_nothing(seed: int) -> None:
    town = Town(Weather(0.05, 0.05, 0.001, 0.01), seed)
    sub, pub = town.add("sub"), town.add("pub")
    sub.register("X")
    town.run(town.settled)
    rng = random.Random(seed)

    def meddle() -> None:
        for _, _, (_, who), datagram in list(town.on_air):  # type: ignore[misc]
            # A forger who reads along can do as he likes without a key; noise can only cut short.
            assert town.server is not None
            town.server.receive(datagram[: rng.randrange(len(datagram))], who, town.now, town.now)
            assert isinstance(who, str)
            town.clients[who].receive(rng.randbytes(rng.randrange(40)), town.now)

    town.check = meddle
    for n in range(30):
        pub.post("X", float(n), town.now)
        town.step()
    town.run(town.settled)
    assert values(town.mail["sub"], "X") == [float(n) for n in range(30)]


def test_a_client_session_asks_for_nothing_while_nobody_is_there_but_now_and_then_a_hello() -> None:
    app = ClientSession("app", 0.0, random.Random(1).randbytes)
    now, sent = 0.0, 0
    while now < 60.0:
        sent += len(app.datagrams(now))
        assert app.next_deadline() > now
        now = app.next_deadline()
    assert 60 < sent < 200
    assert app.state is State.CONNECTING
