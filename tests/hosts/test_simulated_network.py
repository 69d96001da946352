"""The simulated network: delays, losses, bandwidth, addresses, and that nothing vanishes uncounted."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pymoos_lite.app.network import Bundle
from pymoos_lite.core.clock import VirtualClock
from pymoos_lite.hosts.network import IP_OVERHEAD, Conditions, SimulatedNetwork


class Wire:
    """A network with a port each for some communities, and a loop that delivers."""

    def __init__(self, *names, seed=1, **conditions):
        self.clock = VirtualClock(0.0)
        self.network = SimulatedNetwork(self.clock, seed, Conditions(**conditions))
        self.ports = {n: self.network.member(n, "pShare").open(9200 + i) for i, n in enumerate(names)}

    def send(self, source, target, data):
        return self.ports[source].send(data, self.ports[target].address)

    def run(self, until=1e9):
        """(time, who, data) of everything delivered up to mission time `until`."""
        arrived = []
        flight = self.network.in_flight
        while flight and flight[0][0] <= until:
            self.clock.advance_to(max(self.clock.now(), flight[0][0]))
            owner = self.network.deliver_next()
            if owner is not None:
                port = self.ports[owner[0]]
                arrived += [(self.clock.now(), owner[0], data) for data, _ in port.receive()]
        return arrived


def test_a_datagram_arrives_after_the_latency_at_the_port_it_was_sent_to():
    wire = Wire("a", "b", latency=0.25)
    assert wire.send("a", "b", b"hello")
    assert wire.run() == [(0.25, "b", b"hello")]


def test_equal_times_are_delivered_in_the_order_of_sending():
    wire = Wire("a", "b", "c", latency=0.5)
    for i in range(20):
        wire.send("ab"[i % 2], "c", bytes([i]))
    assert [data[0] for _, _, data in wire.run()] == list(range(20))


def test_loss_is_as_frequent_as_asked_for_and_counted():
    wire = Wire("a", "b", loss=0.2)
    for _ in range(5000):
        assert wire.send("a", "b", b"x")
    arrived = len(wire.run())
    traffic = wire.network.total()
    assert arrived == traffic.delivered == 5000 - traffic.lost
    assert 0.18 < traffic.lost / 5000 < 0.22


def test_a_bundle_of_many_parts_is_lost_with_any_of_them():
    wire = Wire("a", "b", loss=0.1)
    for _ in range(2000):
        wire.send("a", "b", Bundle("x", 10_000, 8))
    assert len(wire.run()) / 2000 == pytest.approx(0.9**8, abs=0.04)
    assert wire.network.total().sent == 16_000


def test_jitter_delays_within_its_range_and_may_change_the_order():
    wire = Wire("a", "b", latency=0.1, jitter=0.2)
    for i in range(300):
        wire.send("a", "b", i.to_bytes(2, "big"))
    arrived = wire.run()
    times = [when for when, _, _ in arrived]
    assert min(times) >= 0.1
    assert max(times) <= 0.3
    assert max(times) - min(times) > 0.18
    assert [data for _, _, data in arrived] != sorted(data for _, _, data in arrived)


def test_bandwidth_spaces_datagrams_and_drops_what_would_wait_too_long():
    wire = Wire("a", "b", latency=0.0, bandwidth=1000.0, queue=1000.0)
    size = 100 - IP_OVERHEAD
    sent = [wire.send("a", "b", bytes(size)) for _ in range(15)]
    assert sent == [True] * 10 + [False] * 5
    assert [when for when, _, _ in wire.run()] == pytest.approx([0.1 * (i + 1) for i in range(10)])
    assert wire.network.total().squeezed == 5
    assert wire.send("a", "b", bytes(size))


def test_duplicates_are_delivered_twice_and_counted():
    wire = Wire("a", "b", duplication=1.0)
    wire.send("a", "b", b"x")
    assert len(wire.run()) == 2
    assert wire.network.total().doubled == 1


def test_conditions_of_one_pair_leave_the_others_alone():
    wire = Wire("a", "b", "c", latency=0.1)
    wire.network.set_conditions(Conditions(latency=2.0), "a", "b")
    for target in "bc":
        wire.send("a", target, b"x")
    wire.send("b", "a", b"x")
    assert sorted((when, who) for when, who, _ in wire.run()) == [(0.1, "a"), (0.1, "c"), (2.0, "b")]
    wire.network.set_conditions(Conditions(latency=0.5))
    wire.send("a", "b", b"x")
    assert wire.run()[0][0] == pytest.approx(2.5)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 5), st.booleans())
def test_what_happens_between_two_does_not_depend_on_who_else_sails(seed, crowded):
    def fates(names):
        wire = Wire(*names, seed=seed, loss=0.3, jitter=1.0)
        for i in range(50):
            for other in names[2:]:
                wire.send(other, "a", b"noise")
            wire.send("a", "b", bytes([i]))
        return [(when, data) for when, who, data in wire.run() if who == "b"]

    assert fates(["a", "b"]) == fates(["a", "b", "c", "d"] if crowded else ["a", "b"])


def test_a_port_that_is_taken_or_out_of_range_is_refused():
    wire = Wire("a")
    member = wire.network.member("b", "pShare")
    with pytest.raises(OSError, match="in use by a"):
        member.open(9200)
    with pytest.raises(OSError, match="not in"):
        member.open(70000)
    free = member.open()
    assert free.address[1] >= 49152
    free.close()
    free.close()
    assert not free.send(b"x", ("127.0.0.1", 9200))


def test_datagrams_for_nobody_are_counted():
    wire = Wire("a", "b")
    wire.ports["a"].send(b"x", ("127.0.0.1", 7777))
    wire.send("a", "b", b"y")
    wire.ports["b"].close()
    assert wire.run() == []
    assert wire.network.total().unreachable == 2


def test_who_reopens_a_port_gets_what_is_still_on_its_way():
    wire = Wire("a", "b", latency=1.0)
    wire.send("a", "b", b"x")
    wire.ports["b"].close()
    wire.ports["b"] = wire.network.member("b", "pShare").open(9201)
    assert wire.run() == [(1.0, "b", b"x")]


def test_a_community_that_moves_is_reached_at_its_new_address_only():
    wire = Wire("a", "b", latency=1.0)
    old = wire.ports["b"].address
    wire.send("a", "b", b"on its way")
    wire.network.move("b", "10.0.0.2")
    assert wire.ports["b"].address == ("10.0.0.2", 9201)
    wire.ports["a"].send(b"to the old place", old)
    wire.send("a", "b", b"to the new place")
    assert [data for _, _, data in wire.run()] == [b"to the new place"]
    member = wire.network.member("b", "pHostInfo")
    assert member.addresses() == [("sim0", "10.0.0.2")]
    assert member.resolve("localhost") == "10.0.0.2"
    assert wire.network.member("a", "x").resolve("b") == "10.0.0.2"
    with pytest.raises(OSError, match="not known"):
        member.resolve("nowhere.example")


def test_two_communities_cannot_have_one_port_at_one_address():
    wire = Wire("a", "b")
    wire.network.move("b", "10.0.0.2")
    wire.network.member("c", "x").open(9201)
    with pytest.raises(OSError, match="9201 is in use"):
        wire.network.move("b", "127.0.0.1")
    assert wire.ports["b"].address == ("10.0.0.2", 9201)


@pytest.mark.parametrize(
    "wrong",
    [{"loss": 1.5}, {"loss": -0.1}, {"latency": -1.0}, {"jitter": float("nan")}, {"bandwidth": float("inf")}],
)
def test_conditions_that_make_no_sense_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Conditions(**wrong)
