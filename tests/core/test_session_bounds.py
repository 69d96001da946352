"""Sessions over virtual networks: what is too much, too wrong or too odd, and what becomes of it."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from wires import Town, Weather, values

from pymoos_lite.core.assembly import frame_record
from pymoos_lite.core.client_session import (
    ClientLimits,
    ClientSession,
    Connected,
    Disconnected,
    QueueFull,
    QueueOpen,
    State,
    WriteRefused,
)
from pymoos_lite.core.link import LinkLimits
from pymoos_lite.core.message import Message
from pymoos_lite.core.parcels import Kind
from pymoos_lite.core.server_session import ServerLimits


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
