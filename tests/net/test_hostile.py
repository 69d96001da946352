"""Hostile input against a live database over real sockets: it is counted, costs nothing, and ends nothing."""

from __future__ import annotations

import random
import time
from collections.abc import Callable

import msgpack
import psutil
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from pymoos_lite.core import frames
from pymoos_lite.core.assembly import frame_record
from pymoos_lite.core.clock import RealClock
from pymoos_lite.core.database import Database
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.ports import DatabaseServer, RemoteClient, UdpEndpoint

SALVO = 1000
VOLLEY = 100
PATIENCE = 30.0

Recipe = Callable[[random.Random, list[bytes]], bytes]


def noise(rng: random.Random, corpus: list[bytes]) -> bytes:
    return rng.randbytes(rng.choice((0, 1, 9, 10, 11, 25, 60, 300, 1500, 9000)))


def noise_behind_a_header(rng: random.Random, corpus: list[bytes]) -> bytes:
    return rng.choice(corpus)[:9] + rng.randbytes(rng.randrange(200))


def any_array(rng: random.Random, corpus: list[bytes]) -> bytes:
    def anything(depth: int = 0) -> object:
        return rng.choice(
            [
                None,
                rng.random() < 0.5,
                rng.randrange(-(2**63), 2**64),
                rng.randrange(40),
                rng.uniform(-1e9, 1e9),
                float("nan"),
                rng.randbytes(rng.choice((0, 8, 16, 24, 64))),
                "name"[: rng.randrange(5)],
                [] if depth > 3 else [anything(depth + 1) for _ in range(rng.randrange(4))],
                {} if depth > 3 else {rng.randrange(9): anything(depth + 1)},
            ]
        )

    array = [rng.randrange(11), *(anything() for _ in range(rng.randrange(9)))]
    return rng.choice(corpus)[:9] + msgpack.packb(array)


def flipped(rng: random.Random, corpus: list[bytes]) -> bytes:
    datagram = bytearray(rng.choice(corpus))
    for _ in range(rng.randrange(1, 8)):
        datagram[rng.randrange(len(datagram))] ^= 1 << rng.randrange(8)
    return bytes(datagram)


def cut_or_stretched(rng: random.Random, corpus: list[bytes]) -> bytes:
    datagram = rng.choice(corpus)
    place = rng.randrange(len(datagram) + 1)
    return datagram[:place] + rng.randbytes(rng.randrange(30)) * rng.randrange(2)


def spliced(rng: random.Random, corpus: list[bytes]) -> bytes:
    one, other = rng.choice(corpus), rng.choice(corpus)
    return one[: rng.randrange(len(one))] + other[rng.randrange(len(other)) :]


def replayed(rng: random.Random, corpus: list[bytes]) -> bytes:
    return rng.choice(corpus)


def forged_request(rng: random.Random, corpus: list[bytes]) -> bytes:
    connection = rng.randbytes(8)
    if rng.random() < 0.5:
        return frames.encode(frames.Hello(bytes(frames.HELLO_PADDING)), connection)
    request = frames.Connect(rng.randbytes(24), "app", rng.randbytes(16), b"", 0, 1400, 1 << 20)
    return frames.encode(request, connection)


RECIPES: list[Recipe] = [
    noise,
    noise_behind_a_header,
    any_array,
    flipped,
    cut_or_stretched,
    spliced,
    replayed,
    forged_request,
]


class Siege:
    """A database with two honest clients, a stranger and an admitted client that sends rubbish."""

    def __init__(self, key: str | None) -> None:
        clock = RealClock()
        self.server = DatabaseServer(Database("alpha", clock.now()), clock, key=key)
        port = self.server.address[1]
        self.sub = RemoteClient("sub", port=port, key=key)
        self.pub = RemoteClient("pub", port=port, key=key)
        self.rogue = RemoteClient("rogue", port=port, key=key)
        self.stranger = UdpEndpoint(peer=self.server.address)
        self.mail: list[Message] = []
        self.posted = 0
        self.sent = 0
        self.corpus: list[bytes] = []
        for client in (self.sub, self.pub, self.rogue):
            self._record(client)
        self.sub.register("X")
        end = time.monotonic() + PATIENCE
        while not (self.sub.connected and self.pub.connected and self.rogue.connected):
            assert time.monotonic() < end
            self.turn()
        self.sub.flush()

    def _record(self, client: RemoteClient) -> None:
        send = client.endpoint.send_to_peer

        def recording(datagrams: list[bytes]) -> None:
            self.corpus.extend(datagrams)
            del self.corpus[:-200]
            send(datagrams)

        client.endpoint.send_to_peer = recording  # type: ignore[method-assign,assignment]

    def turn(self) -> None:
        self.mail += [message for message in self.sub.poll(0.0) if message.source == "pub"]
        self.pub.poll(0.0)
        self.rogue.poll(0.0)
        while self.server.pump(0.0):
            pass

    def fire(self, rng: random.Random, recipes: list[Recipe]) -> None:
        for _ in range(SALVO // VOLLEY):
            volley = [rng.choice(recipes)(rng, self.corpus) for _ in range(VOLLEY)]
            self.sent += len(volley)
            # The rogue's socket is one that the database has admitted; the stranger's is not.
            endpoint = self.rogue.endpoint if rng.random() < 0.5 else self.stranger
            UdpEndpoint.send_to_peer(endpoint, volley)
            if rng.random() < 0.3 and self.rogue.session._link is not None:
                # Rubbish that is well packed: it reaches the parser of parcels.
                rubbish = [rng.randrange(9), rng.randrange(9), [["ROGUE", rng.choice(volley), 1.0, ""]]]
                record = rng.choice([rng.randbytes(40), msgpack.packb(rubbish)])
                self.rogue.session._outbox.add(1, [["ROGUE", 1.0, 1.0, ""]])  # type: ignore[arg-type]
                self.rogue.session._link.submit(frame_record(record))
            self.stranger.receive()
            self.turn()
        self.pub.notify("X", float(self.posted))
        self.posted += 1

    def close(self) -> None:
        for client in (self.sub, self.pub, self.rogue):
            client.close(0.0)
        self.stranger.close()
        self.server.close()


@pytest.mark.slow
@pytest.mark.parametrize(("key", "salvos"), [(None, 220), ("a community key", 40)])
def test_a_live_database_survives_hundreds_of_thousands_of_hostile_datagrams(
    key: str | None, salvos: int
) -> None:
    siege = Siege(key)
    resident: list[int] = []
    process = psutil.Process()

    @settings(
        max_examples=salvos,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(st.integers(0, 2**64), st.lists(st.sampled_from(RECIPES), min_size=1, max_size=4))
    def bombard(seed: int, recipes: list[Recipe]) -> None:
        siege.fire(random.Random(seed), recipes)
        resident.append(process.memory_info().rss)

    bombard()
    end = time.monotonic() + PATIENCE
    while len(siege.mail) < siege.posted:
        assert time.monotonic() < end
        siege.turn()

    session, database = siege.server.session, siege.server.database
    statistics = session.statistics
    assert siege.sent >= 0.9 * salvos * SALVO
    assert statistics.datagrams >= siege.sent
    # Counted: nearly all of it is bad; the rest are repetitions, greetings and genuine replays.
    assert statistics.bad_datagrams > 0.5 * siege.sent
    if key is None:
        assert siege.sent >= 200_000
        assert statistics.violations > 10
    # Still serving: the honest clients never noticed.
    assert [m.value for m in siege.mail] == [float(n) for n in range(siege.posted)]
    for honest in (siege.sub, siege.pub):
        assert [type(e).__name__ for e in honest.take_events()] == ["Connected"]
    newcomer = RemoteClient("newcomer", port=siege.server.address[1], key=key)
    while not newcomer.connected:
        assert time.monotonic() < end
        newcomer.poll(0.0)
        siege.turn()
    newcomer.close(0.0)
    # No growth: neither in the books nor in memory.
    assert len(session._peers) <= 4
    assert len(session._cookies) <= 16 * session.limits.clients
    assert session._buffered < 1 << 20
    assert len(list(database.records())) < 200
    assert resident[-1] - resident[len(resident) // 4] < 8 << 20
    siege.close()
