"""The thin socket layer: one UDP socket, and the loops that pump a session through it.

Everything that decides lives in the cores; here bytes move and time is read from the clock. Sockets are
bound to loopback unless told otherwise. One thread per object: neither shell may be shared.
"""

from __future__ import annotations

import contextlib
import ipaddress
import math
import os
import select
import socket
import sys
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, cast

from pymoos_lite.core.client_session import ClientLimits, ClientSession, Event
from pymoos_lite.core.clock import Clock, RealClock
from pymoos_lite.core.database import Database
from pymoos_lite.core.frames import as_key
from pymoos_lite.core.link import PathLimits
from pymoos_lite.core.message import Message
from pymoos_lite.core.server_session import Address, ServerLimits, ServerSession

LOOPBACK = "127.0.0.1"
NETWORK_BUDGET = 1400
LOOPBACK_BUDGET = 8 * 1024 if sys.platform == "darwin" else 32 * 1024
"""Largest datagram inside one machine. macOS sends none above 9216 bytes in its default settings."""
LOOPBACK_WINDOW = 512 * 1024

_LARGEST_DATAGRAM = 65535
_LONGEST_WAIT = 1e5
_PAUSE = 1.0
_MOST_AT_ONCE = 200
_SOCKET_BUFFER = 4 << 20
_BATCH = 64
_AT_ONCE = 128 << 10  # bytes read in one go: then what they caused is sent on


class PortError(OSError):
    """A socket could not be bound or a host not found; the message says which and why."""


def path_to(address: Address) -> PathLimits:
    """What the way to `address` carries: large datagrams on loopback, else what fits an Ethernet frame.

    On loopback nothing is gained by more on its way than the other process can take in at once;
    it would only wait longer.
    """
    host = cast(tuple[str, int], address)[0]
    if is_loopback(host):
        return PathLimits(LOOPBACK_BUDGET, LOOPBACK_WINDOW)
    return PathLimits(NETWORK_BUDGET, 1 << 20)


def is_loopback(host: str) -> bool:
    """Whether a numeric address stays on this machine."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def free_port(host: str = LOOPBACK) -> int:
    """A UDP port that was free a moment ago."""
    with contextlib.closing(UdpEndpoint(host)) as endpoint:
        return endpoint.address[1]


def resolve(host: str, port: int) -> tuple[int, tuple[str, int]]:
    """Socket family and numeric address of a host; IPv4 where there is a choice.

    Raises:
        PortError: the host is unknown or the port is not in 0..65535.
    """
    if not 0 <= port <= 65535:
        raise PortError(f"a port lies in 0..65535, not {port}")
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)
    except OSError as error:
        raise PortError(f"host {host!r} is not known: {error.strerror or error}") from None
    family, _, _, _, address = min(found, key=lambda entry: entry[0] != socket.AF_INET)
    return family, cast(tuple[str, int], address[:2])


class UdpEndpoint:
    """A non-blocking UDP socket that sends and receives batches.

    Args:
        host: address to bind to.
        port: 0 for any free one.
        peer: talk to this address only; then `unreachable` tells when nobody listens there.

    Raises:
        PortError: the port is in use, the host is unknown, ...
    """

    def __init__(self, host: str = LOOPBACK, port: int = 0, *, peer: tuple[str, int] | None = None) -> None:
        family, local = resolve(host, port)
        self.unreachable = False
        self.lost_on_sending = 0
        self._peer = peer
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        try:
            self._socket.setblocking(False)
            for option in (socket.SO_RCVBUF, socket.SO_SNDBUF):
                self._enlarge(option)
            if hasattr(socket, "SO_EXCLUSIVEADDRUSE"):
                self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
            self._socket.bind(local)
            if peer is not None:
                self._socket.connect(peer)
        except OSError as error:
            self._socket.close()
            raise PortError(f"cannot use UDP port {port} on {host}: {error.strerror or error}") from None
        self.address: tuple[str, int] = self._socket.getsockname()[:2]
        self._poll = _waiter(self._socket)

    def _enlarge(self, option: int) -> None:
        # Systems differ in whether they cut a request to what is allowed or refuse it.
        size = _SOCKET_BUFFER
        while size > self._socket.getsockopt(socket.SOL_SOCKET, option):
            try:
                self._socket.setsockopt(socket.SOL_SOCKET, option, size)
                return
            except OSError:
                size //= 2

    @property
    def window(self) -> int:
        """Bytes that one peer should have on its way, given the system's buffer (1 MB at most)."""
        # Linux reports twice what it grants and counts its own bookkeeping against it.
        buffer = self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
        return max(64 * 1024, min(1 << 20, buffer // 4))

    def fileno(self) -> int:
        return self._socket.fileno()

    def wait(self, seconds: float) -> bool:
        """Wait until a datagram is there, at most `seconds` (wall); whether one is."""
        return self._poll(max(0.0, seconds))

    def receive(self, limit: int = _BATCH) -> list[tuple[bytes, Any]]:
        """What has arrived, without waiting: pairs of datagram and sender, `limit` at most."""
        batch: list[tuple[bytes, Any]] = []
        recvfrom = self._socket.recvfrom
        total = 0
        while len(batch) < limit and total < _AT_ONCE:
            try:
                received = recvfrom(_LARGEST_DATAGRAM)
            except (BlockingIOError, InterruptedError):
                break
            except (ConnectionRefusedError, ConnectionResetError):
                # An earlier datagram of ours met a closed port. Windows says so even on a socket
                # that many peers share, where it means nothing.
                self.unreachable = self._peer is not None
                limit -= 1
                continue
            except OSError:
                break
            batch.append(received)
            total += len(received[0])
        return batch

    def send(self, datagrams: Iterable[tuple[bytes, Any]]) -> None:
        """Send pairs of datagram and address; what the system does not take is lost, as on any wire."""
        sendto = self._socket.sendto
        for datagram, address in datagrams:
            try:
                sendto(datagram, address)
            except OSError:
                self.lost_on_sending += 1

    def send_to_peer(self, datagrams: Iterable[bytes]) -> None:
        """`send` to the one peer of this endpoint."""
        send = self._socket.send
        for datagram in datagrams:
            try:
                send(datagram)
            except (ConnectionRefusedError, ConnectionResetError):
                self.unreachable = True
            except OSError:
                self.lost_on_sending += 1

    def close(self) -> None:
        self._socket.close()


def _waiter(sock: socket.socket) -> Callable[[float], bool]:
    """A function that waits until `sock` is readable.

    `select` counts microseconds, which matters at a high time warp, but on POSIX only knows the first
    1024 files of a process; `poll` counts milliseconds.
    """
    number = sock.fileno()
    if number < 1024 or not hasattr(select, "poll"):
        return lambda seconds: bool(select.select((number,), (), (), min(seconds, _LONGEST_WAIT))[0])
    poll = select.poll()
    poll.register(sock, select.POLLIN)
    return lambda seconds: bool(poll.poll(math.ceil(min(seconds, _LONGEST_WAIT) * 1000)))


class DatabaseServer:
    """Puts a database on the network. Call `pump` again and again, or `flush` after posting to it.

    The database stays usable in this process: apps here connect to it directly.

    Raises:
        PortError: the port is in use.
    """

    def __init__(
        self,
        database: Database,
        clock: Clock,
        host: str = LOOPBACK,
        port: int = 0,
        *,
        key: str | bytes | None = None,
        limits: ServerLimits | None = None,
    ) -> None:
        self.database = database
        self._clock = clock
        self._served = clock.wall()
        self.endpoint = UdpEndpoint(host, port)
        limits = limits or ServerLimits()
        window = min(limits.link.window, self.endpoint.window)
        self.session = ServerSession(
            database,
            clock.wall(),
            os.urandom,
            key=as_key(key),
            limits=replace(limits, link=replace(limits.link, window=window)),
            path=path_to,
        )

    @property
    def address(self) -> tuple[str, int]:
        return self.endpoint.address

    def fileno(self) -> int:
        return self.endpoint.fileno()

    def next_deadline(self) -> float:
        """Wall time at which `flush` is due, whatever arrives."""
        wall = self._clock.wall()
        due = self.database.next_deadline() - self._clock.now()
        return min(self.session.next_deadline(), wall + due / self._clock.warp)

    def pump(self, timeout: float = 0.0) -> int:
        """Wait up to `timeout` wall seconds, not beyond the next deadline; take in what came; answer.

        Returns the number of datagrams taken in.
        """
        if timeout > 0.0:
            self.endpoint.wait(min(timeout, self.next_deadline() - self._clock.wall()))
        return self.take_in()

    def take_in(self) -> int:
        """Take in what has arrived, without waiting, and answer; the number of datagrams."""
        count = self._receive()
        self.flush()
        return count

    def flush(self) -> None:
        """Send what is due: mail posted since, acknowledgements, signs of life."""
        wall, now = self._clock.wall(), self._clock.now()
        if wall - self._served > _PAUSE:
            # Something here took long. Before anybody is taken for silent, hear what they said.
            for _ in range(_MOST_AT_ONCE):
                if not self._receive():
                    break
        self._served = wall
        if self.database.next_deadline() <= now:
            self.database.tick(now)
        out = self.session.datagrams(wall, now)
        if out:
            self.endpoint.send(out)

    def _receive(self) -> int:
        batch = self.endpoint.receive()
        if batch:
            wall, now = self._clock.wall(), self._clock.now()
            receive = self.session.receive
            for datagram, address in batch:
                receive(datagram, address, wall, now)
        return len(batch)

    def close(self, reason: str = "the database is shutting down") -> None:
        """Tell every client and close the socket."""
        self.endpoint.send(self.session.close(self._clock.wall(), self._clock.now(), reason))
        self.endpoint.close()


class RemoteClient:
    """An app's connection to a database in another process.

    Connects, and connects again, whenever it is pumped: by `poll`, `flush` or `notify`. An app that
    does none of these for longer than the link's timeout is taken for dead, and reconnects later.

    Raises:
        PortError: the host is unknown.
    """

    def __init__(
        self,
        name: str,
        host: str = LOOPBACK,
        port: int = 9000,
        key: str | bytes | None = None,
        *,
        clock: Clock | None = None,
        limits: ClientLimits | None = None,
    ) -> None:
        self.clock: Clock = clock or RealClock()
        _, peer = resolve(host, port)
        local = ("::1" if ":" in peer[0] else LOOPBACK) if is_loopback(peer[0]) else ""
        self.endpoint = UdpEndpoint(local or ("::" if ":" in peer[0] else "0.0.0.0"), peer=peer)
        limits = limits or ClientLimits()
        path = path_to(peer)
        window = min(limits.link.window, self.endpoint.window)
        self.session = ClientSession(
            name,
            self.clock.wall(),
            os.urandom,
            key=as_key(key),
            limits=replace(limits, link=replace(limits.link, path=path, window=window)),
        )
        self._unsent_posts = 0
        self._turned = self.clock.wall()

    @property
    def connected(self) -> bool:
        return self.session.connected

    @property
    def community(self) -> str:
        """Name of the community, once connected."""
        return self.session.community

    def fileno(self) -> int:
        return self.endpoint.fileno()

    def next_deadline(self) -> float:
        """Wall time at which `poll` is due, whatever arrives."""
        return self.session.next_deadline()

    def notify(self, name: str, value: object, time: float | None = None, aux: str = "") -> bool:
        """Post; False if too many posts are waiting already (this one is then refused and counted).

        Posts leave with the next `poll` or `flush`, or by themselves when a parcel is full.
        """
        accepted = self.session.post(name, value, self.clock.now() if time is None else time, aux)
        self._unsent_posts += 1
        if self._unsent_posts >= 256:
            self._turn()
        return accepted

    def relay(self, message: Message) -> bool:
        """Post somebody else's message, source and community kept."""
        return self.session.relay(message)

    def register(
        self, pattern: str, interval: float = 0.0, source: str = "*", omit: tuple[str, ...] = ()
    ) -> None:
        """Subscribe to a variable or pattern, now and after every reconnection."""
        self.session.register(pattern, interval, source, omit)

    def unregister(self, pattern: str, source: str = "") -> None:
        """Withdraw a registration."""
        self.session.unregister(pattern, source)

    def poll(self, timeout: float = 0.0) -> list[Message]:
        """Mail, as soon as there is some, else after `timeout` wall seconds an empty list."""
        self._turn()
        mail = self.session.take_mail()
        if mail or timeout <= 0.0:
            return mail
        wall = self.clock.wall()
        end = wall + timeout
        while not mail and wall < end:
            self.endpoint.wait(min(end, self.session.next_deadline()) - wall)
            wall = self.clock.wall()
            self._take_in(wall)
            mail = self.session.take_mail()
        return mail

    def flush(self, timeout: float = 0.0) -> bool:
        """Send what waits; with a `timeout`, wait until the database has it all. Whether it has."""
        wall = self.clock.wall()
        end = wall + timeout
        self._turn()
        while self.session.unacknowledged and wall < end:
            self.endpoint.wait(min(end, self.session.next_deadline()) - wall)
            self._turn()
            wall = self.clock.wall()
        return not self.session.unacknowledged

    def take_events(self) -> list[Event]:
        """News of the connection since the last call, oldest first."""
        return self.session.take_events()

    def close(self, timeout: float = 1.0) -> bool:
        """Deliver what waits (up to `timeout` wall seconds), then end the connection; whether all was."""
        delivered = self.flush(timeout) if self.connected else not self.session.unacknowledged
        self.endpoint.send_to_peer(self.session.close(self.clock.wall()))
        self.endpoint.close()
        return delivered

    def _turn(self) -> None:
        wall = self.clock.wall()
        if wall - self._turned < _PAUSE:
            # What was posted leaves first. After a pause, though, the signs of life that came
            # meanwhile must be heard before the session may judge silence.
            self.endpoint.send_to_peer(self.session.datagrams(wall))
        self._unsent_posts = 0
        self._take_in(wall)

    def _take_in(self, wall: float) -> None:
        session = self.session
        self._turned = wall
        for datagram, _ in self.endpoint.receive():
            session.receive(datagram, wall)
        if self.endpoint.unreachable:
            self.endpoint.unreachable = False
            session.lose_contact("nobody listens at the database's address", wall)
        if session.next_deadline() <= wall:
            self.endpoint.send_to_peer(session.datagrams(wall))
