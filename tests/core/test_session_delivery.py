"""Sessions over virtual networks: what is posted arrives, once and in order, in any weather."""

from __future__ import annotations

import random

from hypothesis import given, settings
from hypothesis import strategies as st
from wires import Town, Weather, keys, values, weathers

from pymoos_lite.core.message import Message
from pymoos_lite.core.server_session import ServerLimits


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
