"""The database's side of the network: admits clients, carries posts in and mail out.

Many links, one database, no socket and no clock: datagrams come in with the address they came from,
wall time (for liveness) and mission time (for the database). A stranger costs no memory: until it has
shown, by returning a cookie, that it receives at its address, nothing about it is remembered and no
answer is larger than its question. What is wrong with a datagram is counted and the datagram dropped.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from pymoos_lite.core.assembly import RecordError
from pymoos_lite.core.cookies import Cookies
from pymoos_lite.core.database import Database
from pymoos_lite.core.frames import (
    IDENTITY_BYTES,
    MAX_NAME,
    MAX_REASON,
    Challenge,
    Connect,
    Fault,
    Frame,
    FrameError,
    Hello,
    Keys,
    RefusalCode,
    Refuse,
    Reset,
    Welcome,
    connection_keys,
    connection_of,
    decode,
    encode,
    handshake_keys,
)
from pymoos_lite.core.link import Link, LinkLimits, PathLimits
from pymoos_lite.core.message import Message
from pymoos_lite.core.parcels import (
    Kind,
    Outbox,
    ParcelError,
    Parser,
    Posts,
    Register,
    Unregister,
    split,
)
from pymoos_lite.core.refusals import NameClashError

Address = Hashable
"""Whatever the socket layer calls an address; compared and used as a key, never looked into."""

_RESETS_PER_SECOND = 50
_QUALITY_PERIOD = 1.0
_NOTICES_KEPT = 64


@dataclass(frozen=True, slots=True)
class ServerLimits:
    """Bounds on what all clients together, and any one of them, can make the server hold.

    A client whose mail is more than `mail_bytes` behind is disconnected. `unfinished_bytes` bounds
    what all clients together may have half-way delivered. For `gathering` wall seconds after a
    database has taken the place of another one, clients are asked to hold their posts.
    """

    link: LinkLimits = field(default_factory=LinkLimits)
    clients: int = 256
    mail_bytes: int = 64 << 20
    unfinished_bytes: int = 256 << 20
    registrations: int = 4096
    remembered: int = 1024
    gathering: float = 2.0


@dataclass(slots=True)
class ServerStatistics:
    """What the network brought, for people and tests.

    `dropped` counts datagrams by the `Fault` that condemned them.
    """

    datagrams: int = 0
    dropped: dict[Fault, int] = field(default_factory=lambda: dict.fromkeys(Fault, 0))
    admitted: int = 0
    resumed: int = 0
    refused: int = 0
    resets: int = 0
    slow: int = 0
    silent: int = 0
    violations: int = 0
    closed: int = 0

    @property
    def bad_datagrams(self) -> int:
        return sum(self.dropped.values())


class _Peer:
    """One client that has been admitted."""

    __slots__ = (
        "address", "buffered", "confirmed", "deadline", "heard", "identity", "keys", "link", "mailbox",
        "name", "notices", "outbox", "parser", "quality_due", "received", "registrations", "welcome",
    )  # fmt: skip

    def __init__(
        self, name: str, identity: bytes, mailbox: list[Message], received: int, community: str
    ) -> None:
        self.name = name
        self.identity = identity
        self.mailbox = mailbox
        self.received = received  # number of the last parcel taken from this identity
        self.outbox = Outbox()
        self.parser = Parser(name, community)
        self.registrations: set[tuple[str, str]] = set()
        self.notices: dict[tuple[str, str], int] = {}
        self.address: Address = None
        self.link: Link
        self.keys: Keys
        self.welcome = b""
        self.confirmed = False
        self.heard = False  # something arrived that may have changed the deadline
        self.deadline = 0.0
        self.buffered = 0
        self.quality_due = 0.0


class ServerSession:
    """All clients of one database.

    Hand in every datagram with `receive`, then take what is to be sent from `datagrams`; do the latter
    also when `next_deadline` (wall time) comes and after anything else posted to the database.

    Args:
        database: the community's database; shared with clients that live in the same process.
        wall: wall time in seconds now.
        random: gives that many unpredictable bytes (`os.urandom`).
        key: community key; with one, only clients that have it are heard.
        limits: see `ServerLimits`.
        path: what the way to an address carries.
    """

    def __init__(
        self,
        database: Database,
        wall: float,
        random: Callable[[int], bytes],
        *,
        key: bytes | None = None,
        limits: ServerLimits | None = None,
        path: Callable[[Address], PathLimits] | None = None,
    ) -> None:
        self.database = database
        self.limits = limits or ServerLimits()
        self.statistics = ServerStatistics()
        self.identity = random(IDENTITY_BYTES)
        self._cookies = Cookies(random(32), 16 * self.limits.clients)
        self._key = key
        self._handshake = handshake_keys(key)
        self._path = path
        self._peers: dict[tuple[Address, bytes], _Peer] = {}
        self._by_name: dict[str, _Peer] = {}
        self._remembered: OrderedDict[bytes, int] = OrderedDict()  # identity -> last parcel taken
        self._outgoing: list[tuple[bytes, Address]] = []
        self._buffered = 0
        self._gathered_at: float | None = None  # None until a client of a former database returns
        self._resets_left = float(_RESETS_PER_SECOND)
        self._resets_at = wall

    def clients(self) -> list[str]:
        """Names of the clients that are connected through this session."""
        return list(self._by_name)

    # --- datagrams in -------------------------------------------------------------------------

    def receive(self, datagram: bytes, address: Address, wall: float, now: float) -> None:
        """Take in one datagram; anything that is not acceptable is counted and dropped."""
        self.statistics.datagrams += 1
        try:
            connection, sealed = connection_of(datagram)
            peer = self._peers.get((address, connection))
            if peer is not None:
                self._receive_from(peer, datagram, wall, now)
            else:
                self._receive_stranger(datagram, connection, sealed, address, wall, now)
        except FrameError as error:
            self.statistics.dropped[error.fault] += 1

    def _receive_from(self, peer: _Peer, datagram: bytes, wall: float, now: float) -> None:
        link = peer.link
        try:
            records = link.receive(datagram, wall)
        except FrameError as error:
            if peer.confirmed or error.fault not in (Fault.UNEXPECTED, Fault.BAD_SEAL):
                raise
            self._repeat_welcome(peer, datagram)
            return
        except RecordError as error:
            self._violation(peer, str(error), wall, now)
            return
        peer.confirmed = peer.heard = True
        if wall >= peer.quality_due and link.round_trip is not None:
            peer.quality_due = wall + _QUALITY_PERIOD
            self.database.note_latency(peer.name, link.round_trip / 2)
        if link.closed is not None:
            # Closing is answered, so that the client need not wonder.
            self._outgoing.append((link.close("closed", wall), peer.address))
            self.statistics.closed += 1
            self._forget(peer, now, link.closed)
            return
        for record in records:
            try:
                self._take(peer, record, now)
            except ParcelError as error:
                self._violation(peer, f"unacceptable parcel ({error})", wall, now)
                return
        self._count_buffered(peer, link.buffered)
        if self._buffered > self.limits.unfinished_bytes:
            self._violation(peer, "too much unfinished data at the server", wall, now)

    def _repeat_welcome(self, peer: _Peer, datagram: bytes) -> None:
        # The first one may have been lost. Only a genuine repetition of the request is answered.
        frame = decode(datagram, self._handshake.to_server)
        if not isinstance(frame, Connect) or frame.identity != peer.identity:
            raise FrameError(Fault.UNEXPECTED)
        self._outgoing.append((peer.welcome, peer.address))

    def _receive_stranger(
        self, datagram: bytes, connection: bytes, sealed: bool, address: Address, wall: float, now: float
    ) -> None:
        if sealed != (self._key is not None):
            self._hint_at_key(datagram, connection, sealed, address)
            raise FrameError(Fault.BAD_SEAL if sealed else Fault.UNSEALED)
        try:
            frame = decode(datagram, self._handshake.to_server)
        except FrameError as error:
            if error.fault is Fault.BAD_SEAL:
                # Sealed for a connection that is no more, perhaps: the client may need to know.
                self._reset(datagram, connection, address, wall)
            raise
        if isinstance(frame, Hello):
            cookie = self._cookies.make(connection, address, wall)
            self._answer(Challenge(cookie), connection, address)
        elif isinstance(frame, Connect):
            self._admit(frame, connection, address, wall, now)
        else:
            self._reset(datagram, connection, address, wall)
            raise FrameError(Fault.UNKNOWN_CONNECTION)

    def _answer(self, frame: Frame, connection: bytes, address: Address) -> None:
        self._outgoing.append((encode(frame, connection, self._handshake.to_client), address))

    def _hint_at_key(self, datagram: bytes, connection: bytes, sealed: bool, address: Address) -> None:
        """Tell an honest client that has no key, or one too many, why nobody answers."""
        frame = Refuse(RefusalCode.NO_KEY_HERE if sealed else RefusalCode.KEY_NEEDED, "")
        hint = encode(frame, connection)
        if not sealed and not isinstance(decode(datagram), Hello):
            return
        if len(hint) <= len(datagram):
            self._outgoing.append((hint, address))

    def _reset(self, datagram: bytes, connection: bytes, address: Address, wall: float) -> None:
        self._resets_left = min(
            float(_RESETS_PER_SECOND), self._resets_left + (wall - self._resets_at) * _RESETS_PER_SECOND
        )
        self._resets_at = wall
        answer = encode(Reset(), connection, self._handshake.to_client)
        if self._resets_left >= 1.0 and len(answer) <= len(datagram):
            self._resets_left -= 1.0
            self.statistics.resets += 1
            self._outgoing.append((answer, address))

    # --- admission ----------------------------------------------------------------------------

    def _admit(self, frame: Connect, connection: bytes, address: Address, wall: float, now: float) -> None:
        self._cookies.check(frame.cookie, connection, address, wall)
        former = self._by_name.get(frame.name)
        if former is not None and former.identity != frame.identity:
            self._refuse(RefusalCode.NAME_CLASH, str(NameClashError(frame.name)), connection, address)
            return
        if not _acceptable_name(frame.name):
            reason = f"a client name is 1 to {MAX_NAME} printable characters"
            self._refuse(RefusalCode.BAD_NAME, reason, connection, address)
            return
        full = len(self._peers) >= self.limits.clients and former is None
        if full or self._cookies.crowded:
            reason = f"the community has {len(self._peers)} clients, no more are admitted now"
            self._refuse(RefusalCode.SERVER_FULL, reason, connection, address)
            return
        resumed = former is not None and frame.server == self.identity
        if former is not None and resumed:
            peer = former
            del self._peers[(peer.address, peer.link.connection)]
            self._count_buffered(peer, 0)
            self.statistics.resumed += 1
        else:
            if former is not None:
                self._forget(former, now, "connected anew")
            try:
                mailbox = self.database.connect(frame.name, now)
            except NameClashError as clash:
                self._refuse(RefusalCode.NAME_CLASH, str(clash), connection, address)
                return
            received = self._remembered.pop(frame.identity, 0)
            community = self.database.community
            peer = _Peer(frame.name, frame.identity, mailbox, received, community)
            self._by_name[frame.name] = peer
            self.statistics.admitted += 1
        if self._gathered_at is None and frame.server not in (b"", self.identity):
            # This client knew another database here. Others will be back within moments as well,
            # and what one of them has waiting, another may have to hear.
            self._gathered_at = wall + self.limits.gathering
        self._cookies.spend(connection, wall)
        self._open(peer, frame, connection, address, resumed, wall, now)

    def _open(
        self,
        peer: _Peer,
        frame: Connect,
        connection: bytes,
        address: Address,
        resumed: bool,
        wall: float,
        now: float,
    ) -> None:
        limits = self.limits.link
        if self._path is not None:
            limits = replace(limits, path=self._path(address))
        peer.keys = connection_keys(self._key, connection, frame.cookie)
        peer.address = address
        peer.link = Link(
            connection,
            wall,
            limits,
            send_key=peer.keys.to_client,
            receive_key=peer.keys.to_server,
            peer_budget=frame.budget,
            peer_window=frame.window,
        )
        peer.confirmed = False
        peer.heard = True
        self._peers[(address, connection)] = peer
        for record in peer.outbox.resume(frame.received):
            peer.link.submit(record)
        welcome = Welcome(
            self.identity,
            self.database.community,
            resumed,
            peer.received,
            limits.path.budget,
            limits.window,
            float(now),
            max(0, int(1000 * ((self._gathered_at or wall) - wall))),
        )
        # Sealed with the connection's key: an old welcome does not verify.
        peer.welcome = encode(welcome, connection, peer.keys.to_client)
        self._outgoing.append((peer.welcome, address))

    def _refuse(self, code: RefusalCode, reason: str, connection: bytes, address: Address) -> None:
        self.statistics.refused += 1
        self._answer(Refuse(code, reason[:MAX_REASON]), connection, address)

    # --- parcels ------------------------------------------------------------------------------

    def _take(self, peer: _Peer, record: bytes, now: float) -> None:
        parcel = peer.parser.parse(record)
        if parcel.number:
            if parcel.number <= peer.received:
                return  # sent again after a reconnection, though it had arrived
            peer.received = parcel.number
        if isinstance(parcel, Posts):
            publish = self.database.publish
            name = peer.name
            for message in parcel.messages:
                refusal = publish(name, message, now)
                if refusal is not None:
                    self._note(peer, message.name, str(refusal))
        elif isinstance(parcel, Register):
            wish = (parcel.pattern, parcel.source)
            if wish not in peer.registrations and len(peer.registrations) >= self.limits.registrations:
                limit = self.limits.registrations
                self._note(
                    peer, parcel.pattern, f"not registered: {peer.name} has {limit} registrations already"
                )
                return
            try:
                self.database.register(
                    peer.name, parcel.pattern, now, parcel.source, parcel.interval, parcel.omit
                )
            except ValueError as error:
                self._note(peer, parcel.pattern, f"not registered: {error}")
                return
            peer.registrations.add(wish)
        elif isinstance(parcel, Unregister):
            peer.registrations = {
                wish
                for wish in peer.registrations
                if wish[0] != parcel.pattern or (parcel.source and wish[1] != parcel.source)
            }
            self.database.unregister(peer.name, parcel.pattern, parcel.source or None)
        else:
            raise ParcelError(f"{type(parcel).__name__.lower()} from a client")

    def _note(self, peer: _Peer, name: str, text: str) -> None:
        key = (name, text[:MAX_REASON])
        if key in peer.notices or len(peer.notices) < _NOTICES_KEPT:
            peer.notices[key] = peer.notices.get(key, 0) + 1

    # --- datagrams out ------------------------------------------------------------------------

    def datagrams(self, wall: float, now: float) -> list[tuple[bytes, Address]]:
        """What is to be sent now, and to whom. Also ends links that are silent or hopelessly behind."""
        out = self._outgoing
        self._outgoing = []
        ended: list[tuple[_Peer, str]] = []
        for peer in self._peers.values():
            link = peer.link
            if peer.heard:
                peer.heard = False
                peer.deadline = link.next_deadline()
            if not peer.mailbox and peer.deadline > wall and not peer.notices:
                continue
            peer.outbox.settle(link.acknowledged)
            if peer.mailbox or peer.notices:
                self._send_mail(peer)
            if peer.outbox.bytes > self.limits.mail_bytes:
                self.statistics.slow += 1
                ended.append(
                    (peer, f"{peer.name} reads too slowly: {peer.outbox.bytes} bytes of mail unread")
                )
                continue
            address = peer.address
            for datagram in link.datagrams(wall):
                out.append((datagram, address))
            peer.deadline = link.next_deadline()
            if link.expired(wall):
                self.statistics.silent += 1
                ended.append((peer, f"silent for {self.limits.link.timeout:g} s"))
        for peer, reason in ended:
            out.append((peer.link.close(reason, wall), peer.address))
            self._forget(peer, now, reason)
        return out

    def _send_mail(self, peer: _Peer) -> None:
        if peer.notices:
            rows = tuple((name, text, count) for (name, text), count in peer.notices.items())
            peer.notices.clear()
            peer.link.submit(peer.outbox.add(Kind.NOTICE, rows, rows=len(rows)))
        rows_of_mail = peer.mailbox[:]
        peer.mailbox.clear()
        for chunk in split(rows_of_mail):
            if not self._submit_mail(peer, chunk):
                for row in chunk:
                    if not self._submit_mail(peer, [row]):
                        # Only a client in the database's own process can post what no link carries.
                        limit = peer.link.limits.max_record
                        self._note(peer, row[0], f"not delivered: larger than {limit} bytes")

    def _submit_mail(self, peer: _Peer, rows: Sequence[tuple[Any, ...]]) -> bool:
        record = peer.outbox.add(Kind.MAIL, rows, rows=len(rows))
        try:
            peer.link.submit(record)
        except ValueError:
            peer.outbox.discard_last()
            return False
        return True

    def next_deadline(self) -> float:
        """Wall time by which `datagrams` must be called."""
        if self._outgoing:
            return float("-inf")
        return min((peer.deadline for peer in self._peers.values()), default=float("inf"))

    def close(
        self, wall: float, now: float, reason: str = "the database is shutting down"
    ) -> list[tuple[bytes, Address]]:
        """Disconnect everybody; returns the datagrams that tell them."""
        peers = list(self._peers.values())
        out = self.datagrams(wall, now)
        for peer in peers:
            if peer.name in self._by_name:
                out.append((peer.link.close(reason, wall), peer.address))
                self._forget(peer, now, reason)
        return out

    # --- endings ------------------------------------------------------------------------------

    def _violation(self, peer: _Peer, reason: str, wall: float, now: float) -> None:
        self.statistics.violations += 1
        self._outgoing.append((peer.link.close(reason, wall), peer.address))
        self._forget(peer, now, reason)

    def _forget(self, peer: _Peer, now: float, reason: str) -> None:
        del self._peers[(peer.address, peer.link.connection)]
        del self._by_name[peer.name]
        self._count_buffered(peer, 0)
        self._remembered[peer.identity] = peer.received
        while len(self._remembered) > self.limits.remembered:
            self._remembered.popitem(last=False)
        self.database.disconnect(peer.name, now, reason)

    def _count_buffered(self, peer: _Peer, buffered: int) -> None:
        self._buffered += buffered - peer.buffered
        peer.buffered = buffered


def _acceptable_name(name: str) -> bool:
    return 0 < len(name) <= MAX_NAME and name.isprintable()
