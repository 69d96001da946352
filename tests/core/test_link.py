"""The reliable link, in virtual time and all weathers."""

from __future__ import annotations

import itertools
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule
from wires import Pair, Weather, any_weather

from pymoos_lite.core.assembly import RecordError, frame_record
from pymoos_lite.core.frames import Data as DataFrame
from pymoos_lite.core.frames import Fault, FrameError, encode
from pymoos_lite.core.link import Link, LinkLimits, PathLimits

CONNECTION = b"abcdefgh"
SMALL = LinkLimits(path=PathLimits(400, 4000), window=4000, max_record=100_000)


def link(limits: LinkLimits = SMALL, now: float = 0.0, **kwargs: object) -> Link:
    return Link(CONNECTION, now, limits, **kwargs)  # type: ignore[arg-type]


def pair(weather: Weather | None = None, seed: int = 1, limits: LinkLimits = SMALL) -> Pair:
    return Pair((link(limits), link(limits)), weather or Weather(), seed)


def numbered(count: int, size: int = 20) -> list[bytes]:
    return [b"%08d" % n + bytes(max(0, size - 8)) for n in range(count)]


weathers = any_weather(0.2)


def assert_memory_bounded(both: Pair) -> None:
    for end in both.links:
        limits = end.limits
        assert end.flight.outstanding <= limits.window
        assert end.assembly._early_bytes <= limits.window
        assert len(end.assembly._partial) <= limits.max_record + limits.path.budget
        assert len(end.flight._segments) <= 4096
        assert len(end.flight._again) <= 4096


@settings(max_examples=80, deadline=None)
@given(weathers, st.integers(0, 2**32), st.integers(0, 150), st.integers(0, 150))
def test_every_record_of_both_directions_arrives_once_and_in_order_in_any_weather(
    weather: Weather, seed: int, records_up: int, records_down: int
) -> None:
    rng = random.Random(seed)
    up, down = (
        [rng.randbytes(rng.choice((0, 1, 8, 100, 400, 3000))) for _ in range(count)]
        for count in (records_up, records_down)
    )
    both = pair(weather, seed)
    both.check = lambda: assert_memory_bounded(both)
    for end, records in zip(both.links, (up, down), strict=True):
        for record in records:
            end.submit(frame_record(record))
    both.run(lambda: not any(end.backlog for end in both.links))
    assert both.received == (down, up)
    assert [end.acknowledged for end in both.links] == [len(up), len(down)]


@settings(max_examples=20, deadline=None)
@given(weathers, st.integers(0, 2**32))
def test_records_submitted_over_time_arrive_in_order(weather: Weather, seed: int) -> None:
    both = pair(weather, seed)
    rng = random.Random(seed)
    records = numbered(200, 50)
    waiting = list(records)
    while waiting or both.links[0].backlog:
        for _ in range(rng.randrange(5)):
            if waiting:
                both.links[0].submit(frame_record(waiting.pop(0)))
        both.step()
        assert both.now < 600
    assert both.received[1] == records


class Carrier(RuleBasedStateMachine):
    """Anything may happen to any datagram at any time; then the weather clears and all must arrive."""

    def __init__(self) -> None:
        super().__init__()
        self.now = 0.0
        self.links = (link(), link())
        self.sent: tuple[list[bytes], list[bytes]] = ([], [])
        self.received: tuple[list[bytes], list[bytes]] = ([], [])
        self.on_air: list[tuple[int, bytes]] = []
        self.past: list[tuple[int, bytes]] = []

    def _deliver(self, to: int, datagram: bytes) -> None:
        try:
            self.received[to].extend(self.links[to].receive(datagram, self.now))
        except FrameError as error:
            if error.fault is not Fault.REPLAYED:
                raise

    @rule(side=st.integers(0, 1), size=st.integers(0, 2000))
    def submit(self, side: int, size: int) -> None:
        record = b"%d:" % len(self.sent[side]) + bytes(size)
        self.sent[side].append(record)
        self.links[side].submit(frame_record(record))

    @rule(side=st.integers(0, 1))
    def send(self, side: int) -> None:
        self.on_air += [(1 - side, d) for d in self.links[side].datagrams(self.now)]

    @precondition(lambda self: self.on_air)
    @rule(data=st.data())
    def deliver_any(self, data: st.DataObject) -> None:
        entry = self.on_air.pop(data.draw(st.integers(0, len(self.on_air) - 1)))
        self.past = [*self.past[-20:], entry]
        self._deliver(*entry)

    @precondition(lambda self: self.on_air)
    @rule()
    def lose(self) -> None:
        self.past = [*self.past[-20:], self.on_air.pop(0)]

    @precondition(lambda self: self.past)
    @rule(data=st.data())
    def replay(self, data: st.DataObject) -> None:
        self._deliver(*data.draw(st.sampled_from(self.past)))

    @rule(seconds=st.floats(0.0, 0.5))
    def wait(self, seconds: float) -> None:
        self.now += seconds

    @invariant()
    def what_arrived_is_a_prefix_of_what_was_sent(self) -> None:
        for side in (0, 1):
            got, sent = self.received[side], self.sent[1 - side]
            assert got == sent[: len(got)]
            assert self.links[1 - side].acknowledged <= len(got)
            assert self.links[side].assembly._early_bytes <= SMALL.window
            assert self.links[side].flight._in_flight >= 0

    def teardown(self) -> None:
        both = Pair(self.links, Weather(), 1)
        both.now = self.now
        both.received = self.received
        both.run(lambda: not any(end.backlog for end in self.links), self.now + 600)
        assert self.received == (self.sent[1], self.sent[0])


TestCarrier = Carrier.TestCase
TestCarrier.settings = settings(max_examples=60, stateful_step_count=60, deadline=None)


def test_a_record_of_nine_megabytes_crosses_a_lossy_link() -> None:
    limits = LinkLimits(path=PathLimits(1400, 1 << 20))
    both = pair(Weather(0.1, 0.1, 0.001, 0.003), 3, limits)
    record = random.Random(1).randbytes(9 << 20)
    both.links[0].submit(frame_record(record))
    both.run(lambda: bool(both.received[1]))
    assert both.received[1] == [record]


def test_small_records_share_a_datagram() -> None:
    both = pair()
    for record in numbered(10, 20):
        both.links[0].submit(frame_record(record))
    assert len(both.links[0].datagrams(0.0)) == 1


def test_a_record_leaves_at_once_when_the_link_is_idle() -> None:
    sender, receiver = link(), link()
    sender.submit(frame_record(b"now"))
    (datagram,) = sender.datagrams(0.0)
    assert receiver.receive(datagram, 0.0) == [b"now"]


def test_no_more_than_the_window_is_on_its_way() -> None:
    sender = link()
    for record in numbered(100, 350):
        sender.submit(frame_record(record))
    total = sum(map(len, sender.datagrams(0.0)))
    assert total <= 4000
    assert sender.datagrams(0.0) == []


def test_a_lost_datagram_is_repeated_without_waiting_for_the_timer() -> None:
    limits = LinkLimits(path=PathLimits(400, 1 << 20))
    sender, receiver = link(limits), link(limits)
    for record in numbered(8, 300):
        sender.submit(frame_record(record))
    datagrams = sender.datagrams(0.0)
    assert len(datagrams) == 8
    for datagram in datagrams[1:]:
        receiver.receive(datagram, 0.001)
    (ack,) = receiver.datagrams(0.001)
    sender.receive(ack, 0.002)
    (again,) = sender.datagrams(0.002)
    assert receiver.receive(again, 0.003) == numbered(8, 300)
    assert sender.statistics.resent == 1
    assert sender.statistics.probes == 0


def test_repetition_backs_off_while_nobody_answers() -> None:
    limits = LinkLimits(path=PathLimits(400, 4000), timeout=1e9, keepalive=1e9)
    sender = link(limits)
    sender.submit(frame_record(b"hello?"))
    moments = []
    now = 0.0
    for _ in range(8):
        if sender.datagrams(now):
            moments.append(now)
        now = sender.next_deadline()
    gaps = [b - a for a, b in itertools.pairwise(moments)]
    assert gaps == sorted(gaps)
    assert gaps[-1] > gaps[0]


def test_round_trip_is_measured_without_the_time_an_acknowledgement_was_held() -> None:
    both = pair(Weather(shortest=0.05, longest=0.05))
    for _ in range(20):
        both.links[0].submit(frame_record(b"x"))
        both.run(lambda: not both.links[0].backlog)
    assert both.links[0].round_trip == pytest.approx(0.1, rel=0.02)


def test_an_idle_link_stays_alive_though_four_datagrams_of_ten_are_lost() -> None:
    both = pair(Weather(loss=0.4, shortest=0.001, longest=0.01), seed=5)
    while both.now < 600.0:
        both.step()
        assert not any(end.expired(both.now) for end in both.links)
    assert both.turns < 600 * 20  # and is not noisy either


def test_a_link_expires_when_its_peer_is_silent_and_not_before() -> None:
    both = pair()
    both.links[0].submit(frame_record(b"x"))
    both.run(lambda: not both.links[0].backlog)
    heard = both.links[0].last_heard
    assert not both.links[0].expired(heard + 4.9)
    assert both.links[0].expired(heard + 5.0)
    assert both.links[0].next_deadline() <= heard + 5.0


def test_a_datagram_that_comes_twice_is_taken_once() -> None:
    sender, receiver = link(), link()
    sender.submit(frame_record(b"once"))
    (datagram,) = sender.datagrams(0.0)
    assert receiver.receive(datagram, 0.0) == [b"once"]
    with pytest.raises(FrameError) as caught:
        receiver.receive(datagram, 0.1)
    assert caught.value.fault is Fault.REPLAYED
    assert receiver.last_heard == 0.0  # a replay is no sign of life
    assert receiver.statistics.duplicates == 1


def test_an_old_recording_is_refused_long_after_the_replay_window() -> None:
    sender, receiver = link(), link()
    sender.submit(frame_record(b"first"))
    (first,) = sender.datagrams(0.0)
    receiver.receive(first, 0.0)
    for n in range(3000):
        sender.submit(frame_record(b"%d" % n))
        for datagram in sender.datagrams(0.0):
            receiver.receive(datagram, 0.0)
        for datagram in receiver.datagrams(0.0):
            sender.receive(datagram, 0.0)
    with pytest.raises(FrameError) as caught:
        receiver.receive(first, 1.0)
    assert caught.value.fault is Fault.REPLAYED


def test_a_record_over_the_limit_is_not_accepted_for_sending() -> None:
    with pytest.raises(ValueError, match="exceeds the limit of 100000"):
        link().submit(frame_record(bytes(100_001)))


def test_a_peer_that_announces_too_large_a_record_is_given_up_at_once() -> None:
    receiver = link()
    huge = encode(DataFrame(1, 0, 0, 0, 0, (100_001).to_bytes(4, "big") + b"x"), CONNECTION)
    with pytest.raises(RecordError, match="100001 bytes"):
        receiver.receive(huge, 0.0)


def test_segments_far_ahead_are_refused_and_cost_no_memory() -> None:
    receiver = link()
    with pytest.raises(FrameError) as caught:
        receiver.receive(encode(DataFrame(1, 0, 0, 0, 4096, b"x"), CONNECTION), 0.0)
    assert caught.value.fault is Fault.OUT_OF_WINDOW
    for seq in range(1, 100):
        receiver.receive(encode(DataFrame(seq, 0, 0, 0, seq, bytes(300)), CONNECTION), 0.0)
    assert receiver.buffered <= SMALL.window


def test_an_early_segment_that_is_repeated_is_counted_once() -> None:
    receiver = link()
    for number in range(1, 40):
        receiver.receive(encode(DataFrame(number, 0, 0, 0, 1, bytes(300)), CONNECTION), 0.0)
    assert receiver.buffered == 300


def test_a_silent_peer_is_asked_more_often_than_a_lively_one() -> None:
    both = pair()
    both.links[0].submit(frame_record(b"x"))
    both.run(lambda: not both.links[0].backlog)
    end, now, moments = both.links[0], both.now, []
    while not end.expired(now):
        moments += [now] * len(end.datagrams(now))
        now = end.next_deadline()
    gaps = [later - earlier for earlier, later in itertools.pairwise(moments)]
    assert gaps[0] == pytest.approx(0.5)
    assert gaps[-1] == pytest.approx(0.125)
    assert len(moments) >= 20


def test_acknowledging_what_was_never_sent_is_refused() -> None:
    with pytest.raises(FrameError) as caught:
        link().receive(encode(DataFrame(1, 5, 0, 0, 0, b"\0\0\0\0"), CONNECTION), 0.0)
    assert caught.value.fault is Fault.OUT_OF_WINDOW


def test_closing_tells_the_peer_why() -> None:
    one, other = link(), link()
    other.receive(one.close("enough for today", 0.0), 0.0)
    assert other.closed == "enough for today"


def test_the_deadline_is_never_in_the_past_so_that_no_loop_spins() -> None:
    both = pair(Weather(0.3, 0.2, 0.001, 0.05), 9)
    for record in numbered(300, 100):
        both.links[0].submit(frame_record(record))

    def not_in_the_past() -> None:
        both.send()
        assert all(end.next_deadline() > both.now for end in both.links)

    both.check = not_in_the_past
    both.run(lambda: len(both.received[1]) == 300)


def test_segments_respect_the_smaller_budget_of_the_two_ends() -> None:
    sender = link(LinkLimits(path=PathLimits(32_000, 1 << 20)), peer_budget=500)
    sender.submit(frame_record(bytes(3000)))
    assert max(map(len, sender.datagrams(0.0))) <= 500
