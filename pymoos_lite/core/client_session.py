"""An app's side of the network: finds the database, keeps the connection, loses nothing on the way.

The session connects by itself, again and again, and registers anew with a database that forgot it. Posts
wait while there is no connection, up to a stated bound; beyond it they are refused, visibly. Posts that
were sent but not acknowledged are sent again after a reconnection and taken once. No socket and no
clock: datagrams and wall time (seconds) come in as arguments.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from math import inf

from pymoos_lite.core.assembly import RecordError
from pymoos_lite.core.client_events import (
    Connected,
    Disconnected,
    Event,
    QueueFull,
    QueueOpen,
    Refused,
    Warned,
    WriteRefused,
)
from pymoos_lite.core.frames import (
    CONNECTION_BYTES,
    HELLO_PADDING,
    IDENTITY_BYTES,
    Challenge,
    Connect,
    Fault,
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
from pymoos_lite.core.link import Link, LinkLimits
from pymoos_lite.core.message import Message, Value, as_value
from pymoos_lite.core.parcels import (
    BATCH,
    MAX_AUX,
    MAX_VARIABLE,
    ROW_BYTES,
    Kind,
    Mail,
    Notice,
    Outbox,
    ParcelError,
    Parser,
    check_variable,
    is_text,
    split,
)

__all__ = [
    "ClientLimits",
    "ClientSession",
    "Connected",
    "Disconnected",
    "Event",
    "QueueFull",
    "QueueOpen",
    "Refused",
    "State",
    "Warned",
    "WriteRefused",
]

_RETRY_FIRST = 0.05
_RETRY_LAST = 0.5
_TRIES_PER_CONNECTION = 6
_CLASH_RETRY = 0.5
_MAX_EVENTS = 1000
_MAX_NAMES = 100_000
_PLAIN_TEXT = 4096  # text up to here needs no look at its encoded length, if it is ASCII
_UNFINISHED_VALUE = 64  # room in a parcel for everything but value, name and aux


class State(Enum):
    """Where a client session stands."""

    CONNECTING = "looking for the database"
    CONNECTED = "connected"
    REFUSED = "the database does not admit this client; it has stopped trying"
    CLOSED = "closed by its owner"


@dataclass(frozen=True, slots=True)
class ClientLimits:
    """Bounds of a client session.

    The client's timeout is shorter than the server's, so that after a silence it is the client that
    connects anew while the server still keeps its mail. At most `posts` posts of `post_bytes` bytes
    together wait for the database's acknowledgement. For `clash_patience` wall seconds a name in use
    is taken for a predecessor that the database has not yet missed, and asked for again.
    """

    link: LinkLimits = field(default_factory=lambda: LinkLimits(timeout=3.5))
    posts: int = 100_000
    post_bytes: int = 64 << 20
    clash_patience: float = 0.0


class ClientSession:
    """One app's connection to its community.

    Hand in datagrams with `receive`, take what is to be sent from `datagrams` (at `next_deadline`, and
    after posting), mail from `take_mail` and news of the connection from `take_events`.

    Args:
        name: the app's name in the community.
        wall: wall time in seconds now.
        random: gives that many unpredictable bytes (`os.urandom`).
        key: community key.
        limits: see `ClientLimits`.
    """

    def __init__(
        self,
        name: str,
        wall: float,
        random: Callable[[int], bytes],
        *,
        key: bytes | None = None,
        limits: ClientLimits | None = None,
    ) -> None:
        self.name = name
        self.limits = limits or ClientLimits()
        self.state = State.CONNECTING
        self.community = ""
        self.refused_posts = 0
        """Posts refused here because the queue was full."""
        self.dropped_datagrams = 0
        self.server_time_offset = 0.0
        """Mission time of the database at the last welcome minus wall time here."""
        self._random = random
        self._key = key
        self._handshake = handshake_keys(key)
        self._keys: Keys = self._handshake
        self._identity = random(IDENTITY_BYTES)
        self._server = b""
        self._received = 0
        self._link: Link | None = None
        self._parser = Parser()
        self._outbox = Outbox()
        self._holding = False  # the database asked to wait with posts
        self._hold_until = -inf
        self._held: list[bytes] = []  # records that wait for it
        self._rows: list[tuple[object, ...]] = []
        self._rows_kind = Kind.POSTS
        self._rows_bytes = 0
        self._names: set[str] = set()
        self._registrations: dict[tuple[str, str], tuple[float, tuple[str, ...]]] = {}
        self._mail: list[Message] = []
        self._events: deque[Event] = deque(maxlen=_MAX_EVENTS)
        self._refused_before: int | None = None  # posts refused before the queue was full; None if it is not
        self._posts_allowed = self.limits.posts  # none once the session has ended for good
        self._clash_since: float | None = None
        self._connection = b""
        self._cookie: bytes | None = None
        self._tries = 0
        self._retry_at = wall
        self._warned_of_key = False
        self._warned_of_crowd = False

    @property
    def connected(self) -> bool:
        return self.state is State.CONNECTED

    @property
    def unacknowledged(self) -> int:
        """Posts (and registrations) that the database has not yet confirmed."""
        return len(self._rows) + self._outbox.rows

    @property
    def unacknowledged_bytes(self) -> int:
        return self._rows_bytes + self._outbox.bytes

    @property
    def round_trip(self) -> float | None:
        """Smoothed round-trip time to the database in wall seconds."""
        return self._link.round_trip if self._link is not None else None

    # --- what an app does ---------------------------------------------------------------------

    def post(self, name: str, value: object, time: float, aux: str = "") -> bool:
        """Queue a post; False if the queue is full (then the post is refused and counted).

        Raises:
            ValueError: empty or overlong name or aux, a value over the limit, a time that is no number.
            TypeError: a value that is none of number, boolean, text or bytes.
        """
        if type(value) is float:
            size = ROW_BYTES
        elif type(value) is str and len(value) <= _PLAIN_TEXT and value.isascii():
            size = ROW_BYTES + len(value)
        else:
            value = as_value(value)
            size = self._size_of(name, value)
        if name not in self._names:
            self._learn_name(name)
        if aux and (type(aux) is not str or len(aux) > MAX_AUX or not is_text(aux)):
            raise ValueError(f"aux of {name} must be text of at most {MAX_AUX} characters")
        if type(time) is not float or not -1e300 < time < 1e300:
            time = _as_time(name, time)
        if self._rows_kind is not Kind.POSTS:
            self._pack_rows(Kind.POSTS)
        return self._queue((name, value, time, aux), size)

    def relay(self, message: Message) -> bool:
        """Queue a message of somebody else, source and community kept, as bridges do; else like `post`."""
        name, value, time, source, aux, community = message
        checked = as_value(value)
        size = self._size_of(name, checked)
        if name not in self._names:
            self._learn_name(name)
        for text, longest in ((aux, MAX_AUX), (source, MAX_VARIABLE), (community, MAX_VARIABLE)):
            if len(text) > longest or not is_text(text):
                raise ValueError(f"{text!r:.60} of {name} is no text of at most {longest} characters")
        if self._rows_kind is not Kind.RELAYED:
            self._pack_rows(Kind.RELAYED)
        return self._queue((name, checked, _as_time(name, time), source, aux, community), size)

    def _queue(self, row: tuple[object, ...], size: int) -> bool:
        rows = self._rows
        outbox = self._outbox
        if (
            len(rows) + outbox.rows >= self._posts_allowed
            or self._rows_bytes + outbox.bytes + size > self.limits.post_bytes
        ):
            self.refused_posts += 1
            if self._refused_before is None:
                self._refused_before = self.refused_posts - 1
                self._events.append(QueueFull(self.unacknowledged, self.unacknowledged_bytes))
            return False
        rows.append(row)
        self._rows_bytes += size
        return True

    def _size_of(self, name: str, value: Value) -> int:
        """What `value` counts for in the queue; refuses what no link carries."""
        if isinstance(value, float):
            return ROW_BYTES
        size = len(value)
        limit = self.limits.link.max_record - MAX_AUX - MAX_VARIABLE - _UNFINISHED_VALUE
        if isinstance(value, str) and not value.isascii():
            if not is_text(value):
                raise ValueError(f"the value of {name} is no text: it holds half a surrogate pair")
            if size * 4 > limit:
                size = len(value.encode("utf-8", "surrogateescape"))
        if size > limit:
            raise ValueError(f"the value of {name} has {size} bytes, allowed are {limit}")
        return ROW_BYTES + size

    def _learn_name(self, name: str) -> None:
        check_variable(name)
        if len(self._names) >= _MAX_NAMES:
            self._names.clear()
        self._names.add(name)

    def register(
        self, pattern: str, interval: float = 0.0, source: str = "*", omit: tuple[str, ...] = ()
    ) -> None:
        """Subscribe, now and after every reconnection.

        Raises:
            ValueError: empty or overlong pattern, or an interval that is negative or no number.
        """
        for text in (pattern, source, *omit):
            check_variable(text)
        interval = float(interval)
        if not 0.0 <= interval < inf:
            raise ValueError(f"the interval of a registration must not be negative: {interval}")
        self._registrations[(pattern, source)] = (interval, tuple(omit))
        self._control(Kind.REGISTER, pattern, source, interval, tuple(omit))

    def unregister(self, pattern: str, source: str = "") -> None:
        """Withdraw a registration; without `source` whatever source it was made with."""
        for key in [k for k in self._registrations if k[0] == pattern and source in ("", k[1])]:
            del self._registrations[key]
        if pattern:
            self._control(Kind.UNREGISTER, pattern, source)

    def take_mail(self) -> list[Message]:
        """Mail since the last call, in order."""
        mail = self._mail
        self._mail = []
        return mail

    def take_events(self) -> list[Event]:
        """What happened to the connection since the last call, in order."""
        events = list(self._events)
        self._events.clear()
        return events

    def close(self, wall: float) -> list[bytes]:
        """End the session; returns the datagrams that tell the database."""
        out: list[bytes] = []
        if self._link is not None:
            out.append(self._link.close("closed by the client", wall))
        self.state = State.CLOSED
        self._posts_allowed = 0
        return out

    # --- datagrams ----------------------------------------------------------------------------

    def receive(self, datagram: bytes, wall: float) -> None:
        """Take in one datagram; what is not acceptable is counted and dropped."""
        try:
            connection, _ = connection_of(datagram)
            if connection != self._connection or self.state in (State.REFUSED, State.CLOSED):
                raise FrameError(Fault.UNKNOWN_CONNECTION)
            if self._link is not None:
                self._receive_on_link(self._link, datagram, wall)
            else:
                self._receive_handshake(datagram, wall)
        except FrameError:
            self.dropped_datagrams += 1

    def _receive_on_link(self, link: Link, datagram: bytes, wall: float) -> None:
        try:
            records = link.receive(datagram, wall)
        except FrameError as error:
            if error.fault in (Fault.UNEXPECTED, Fault.BAD_SEAL) and isinstance(
                decode(datagram, self._handshake.to_client), Reset
            ):
                self._lose("the database does not know this connection (restarted?)", wall)
                return
            raise
        except RecordError as error:
            self._give_up(str(error), wall)
            return
        try:
            for record in records:
                self._take(record)
        except ParcelError as error:
            self._give_up(f"unacceptable parcel ({error})", wall)
            return
        if link.closed is not None:
            self._lose(link.closed, wall)

    def _take(self, record: bytes) -> None:
        parcel = self._parser.parse(record)
        if parcel.number <= self._received:
            return
        self._received = parcel.number
        if isinstance(parcel, Mail):
            if self._mail:
                self._mail += parcel.messages
            else:
                self._mail = parcel.messages
        elif isinstance(parcel, Notice):
            for name, text, count in parcel.rows:
                self._events.append(WriteRefused(name, text, count))
        else:
            raise ParcelError(f"{type(parcel).__name__.lower()} from the database")

    def _receive_handshake(self, datagram: bytes, wall: float) -> None:
        if self._cookie is not None:
            try:
                frame = decode(datagram, self._keys.to_client)
            except FrameError as error:
                if self._key is None or error.fault is not Fault.BAD_SEAL:
                    self._consider_hint(datagram)
                    raise
                frame = decode(datagram, self._handshake.to_client)
                if isinstance(frame, Welcome):
                    raise
        else:
            try:
                frame = decode(datagram, self._handshake.to_client)
            except FrameError:
                self._consider_hint(datagram)
                raise
        if isinstance(frame, Challenge):
            if self._cookie is None:
                self._cookie = frame.cookie
                self._keys = connection_keys(self._key, self._connection, frame.cookie)
                self._tries = 0
                self._retry_at = wall
        elif isinstance(frame, Welcome) and self._cookie is not None:
            self._enter(frame, wall)
        elif isinstance(frame, Refuse):
            self._be_refused(frame, wall)
        else:
            raise FrameError(Fault.UNEXPECTED)

    def _consider_hint(self, datagram: bytes) -> None:
        # Anybody could have sent an unsealed hint: it is passed on to people and changes nothing.
        if self._key is not None and not self._warned_of_key and isinstance(decode(datagram), Refuse):
            self._warned_of_key = True
            self._events.append(Warned("the database here uses no community key, this client does"))

    def _be_refused(self, frame: Refuse, wall: float) -> None:
        code = RefusalCode(frame.code)
        self._retry_at = wall + _CLASH_RETRY
        self._connection = b""
        if code is RefusalCode.SERVER_FULL:
            if not self._warned_of_crowd:
                self._warned_of_crowd = True
                self._events.append(Warned(f"{frame.reason}; waiting"))
            return
        if code is RefusalCode.NAME_CLASH:
            if self._clash_since is None:
                self._clash_since = wall
            if wall - self._clash_since < self.limits.clash_patience:
                return
        reason = frame.reason
        if code is RefusalCode.KEY_NEEDED:
            reason = "the database wants a community key and this client has none"
        self.state = State.REFUSED
        self._posts_allowed = 0
        self._events.append(Refused(code, reason or code.name))

    def _enter(self, welcome: Welcome, wall: float) -> None:
        link = Link(
            self._connection,
            wall,
            self.limits.link,
            send_key=self._keys.to_server,
            receive_key=self._keys.to_client,
            peer_budget=welcome.budget,
            peer_window=welcome.window,
        )
        self._link = link
        self._hold_until = wall + welcome.hold / 1000
        self._holding = welcome.hold > 0
        self._held = []
        self._clash_since = None
        self._warned_of_crowd = False
        if welcome.resumed:
            records = self._outbox.resume(welcome.received)
        else:
            self._received = 0
            wishes = [
                (Kind.REGISTER, pattern, source, interval, omit)
                for (pattern, source), (interval, omit) in self._registrations.items()
            ]
            records = self._outbox.resume(welcome.received, wishes)
            for record in records[: len(wishes)]:
                link.submit(record)
            del records[: len(wishes)]
        for record in records:
            self._submit(record)
        self._server = welcome.server
        self.community = welcome.community
        self.server_time_offset = welcome.now - wall
        self.state = State.CONNECTED
        self._events.append(Connected(welcome.community, welcome.resumed))

    def lose_contact(self, reason: str, wall: float) -> None:
        """Told by the socket layer that nobody listens at the database's address."""
        if self._link is not None:
            self._lose(reason, wall)

    def _give_up(self, reason: str, wall: float) -> None:
        # The other side broke the rules. A new connection starts from nothing, or it would again.
        self._server = b""
        self._identity = self._random(IDENTITY_BYTES)
        self._lose(reason, wall)

    def _lose(self, reason: str, wall: float) -> None:
        if self._link is not None:
            self._outbox.settle(self._link.acknowledged)
        self._link = None
        self._holding = False
        self._held = []
        self._connection = b""
        self._retry_at = wall
        self._tries = 0
        if self.state is State.CONNECTED:
            self.state = State.CONNECTING
            self._events.append(Disconnected(reason))

    def datagrams(self, wall: float) -> list[bytes]:
        """What is to be sent now."""
        if self.state is State.CONNECTED and self._link is not None:
            link = self._link
            self._outbox.settle(link.acknowledged)
            if wall >= self._hold_until:
                self._release_held(link)
            # While the link is busy rows gather, so that busy links carry few, large parcels.
            if self._rows and not self._holding and (not link.unsent or len(self._rows) >= BATCH):
                self._pack_rows(self._rows_kind)
            if self._refused_before is not None:
                self._consider_reopening()
            out = link.datagrams(wall)
            if link.expired(wall):
                self._lose(f"the database has been silent for {self.limits.link.timeout:g} s", wall)
            return out
        if self.state is State.CONNECTING and wall >= self._retry_at:
            return [self._knock(wall)]
        return []

    def _consider_reopening(self) -> None:
        limits = self.limits
        if 2 * self.unacknowledged <= limits.posts and 2 * self.unacknowledged_bytes <= limits.post_bytes:
            assert self._refused_before is not None
            self._events.append(QueueOpen(self.refused_posts - self._refused_before))
            self._refused_before = None

    def _knock(self, wall: float) -> bytes:
        if not self._connection or self._tries >= _TRIES_PER_CONNECTION:
            self._connection = self._random(CONNECTION_BYTES)
            self._cookie = None
            if self._tries >= _TRIES_PER_CONNECTION:
                self._tries = 2  # nobody is there: no need to hurry
        self._retry_at = wall + min(_RETRY_LAST, _RETRY_FIRST * 2**self._tries)
        self._tries += 1
        if self._cookie is None:
            return encode(Hello(bytes(HELLO_PADDING)), self._connection, self._handshake.to_server)
        limits = self.limits.link
        frame = Connect(
            self._cookie,
            self.name,
            self._identity,
            self._server,
            self._received,
            limits.path.budget,
            limits.window,
        )
        return encode(frame, self._connection, self._handshake.to_server)

    def next_deadline(self) -> float:
        """Wall time by which `datagrams` must be called."""
        if self.state is State.CONNECTED and self._link is not None:
            if self._rows and not self._holding and not self._link.unsent:
                return -inf
            return min(self._link.next_deadline(), self._hold_until if self._holding else inf)
        return self._retry_at if self.state is State.CONNECTING else inf

    # --- packing ------------------------------------------------------------------------------

    def _pack_rows(self, next_kind: Kind) -> None:
        rows, kind = self._rows, self._rows_kind
        self._rows_kind = next_kind
        if not rows:
            return
        self._rows = []
        self._rows_bytes = 0
        for chunk in split(rows):
            self._submit(self._outbox.add(kind, chunk, rows=len(chunk)))

    def _control(self, kind: Kind, *content: object) -> None:
        if not self._server:
            return  # never connected: the first connection starts with all registrations
        if self._link is None and self._outbox.rows >= self.limits.posts:
            self._server = b""  # too much to keep: start afresh, which registers everything
            return
        self._pack_rows(self._rows_kind)
        self._submit(self._outbox.add(kind, *content))

    def _submit(self, record: bytes) -> None:
        if self._holding:
            self._held.append(record)  # kept by the outbox already: this costs a reference
        elif self._link is not None:
            self._link.submit(record)

    def _release_held(self, link: Link) -> None:
        if self._holding:
            self._holding = False
            for record in self._held:
                link.submit(record)
            self._held = []


def _as_time(name: str, time: object) -> float:
    try:
        stamp = float(time)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        stamp = float("nan")
    if not -1e300 < stamp < 1e300:
        raise ValueError(f"the time of {name} must be a finite number of seconds, not {time!r:.60}")
    return stamp
