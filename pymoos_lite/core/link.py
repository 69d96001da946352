"""The reliable link: records in at one end, the same records out at the other, once and in order.

A record is bytes of any length up to a limit. `Flight` decides what to send and to send again,
`Assembly` puts together what arrives; the link joins them to the frames on the wire, acknowledges,
shows signs of life and notices when there are none. Every datagram carries a frame number that is used
once: a frame that comes twice, by accident of the network or by somebody's intent, is dropped.

No socket and no clock: datagrams and wall time (seconds) come in as arguments, datagrams to send
come back. Both ends hold bounded memory.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from pymoos_lite.core.assembly import Assembly
from pymoos_lite.core.flight import Flight, Segment
from pymoos_lite.core.frames import (
    MAX_REASON,
    MAX_SEGMENTS_AHEAD,
    OVERHEAD,
    Ack,
    Close,
    Data,
    Fault,
    Frame,
    FrameError,
    decode,
    encode,
)

_REPLAY_WINDOW = 2048
_REPLAY_MASK = (1 << _REPLAY_WINDOW) - 1
_ACK_EVERY = 16
_LENGTH_BYTES = 4


class PathLimits(NamedTuple):
    """What the way to a peer carries: the largest datagram, and the most bytes worth having on it."""

    budget: int = 1400
    window: int = 1 << 20


@dataclass(frozen=True, slots=True)
class LinkLimits:
    """What a link may use, in bytes and wall seconds.

    `path` bounds what is sent, `window` what is kept of the peer's out-of-order segments and told to
    it, `max_record` is the largest record; a peer that is silent for `timeout` is taken for dead.
    """

    path: PathLimits = field(default_factory=PathLimits)
    window: int = 1 << 20
    max_record: int = (16 << 20) + 4096
    timeout: float = 5.0
    keepalive: float = 0.5
    ack_delay: float = 0.004


@dataclass(frozen=True, slots=True)
class LinkStatistics:
    """What one link has seen: datagrams sent, taken and dropped as repetitions, segments sent again."""

    sent: int = 0
    received: int = 0
    resent: int = 0
    duplicates: int = 0
    probes: int = 0


class Link:
    """One connection's two streams of records.

    Call `receive` for each datagram, `submit` for each record to send, then `datagrams` for what is
    to be sent now; call `datagrams` again at `next_deadline` at the latest. After a pause in which
    nothing could be received, receive first: `expired` judges by what was handed in.
    """

    def __init__(
        self,
        connection: bytes,
        now: float,
        limits: LinkLimits,
        *,
        send_key: bytes | None = None,
        receive_key: bytes | None = None,
        peer_budget: int | None = None,
        peer_window: int | None = None,
    ) -> None:
        self.connection = connection
        self.limits = limits
        self.last_heard = now
        self.closed: str | None = None
        """Why the connection was closed; None while it stands."""
        path = limits.path
        self.flight = Flight(
            max(64, min(path.budget, peer_budget or path.budget) - OVERHEAD),
            min(path.window, peer_window or path.window),
            limits.ack_delay,
        )
        self.assembly = Assembly(limits.window, limits.max_record)
        self._send_key = send_key
        self._receive_key = receive_key
        self._number = 0
        self._last_sent = now
        self._stirred = False  # something came in that may let `datagrams` send at once
        self._sent = self._received = self._duplicates = 0
        # Which frame numbers have been seen, the highest one as the lowest bit
        self._seen = 0
        self._seen_at = now
        self._seen_mask = 0
        self._ack_at = math.inf
        self._unacked = 0
        self._unacked_bytes = 0

    # --- what a session asks ------------------------------------------------------------------

    @property
    def acknowledged(self) -> int:
        """Records that the peer has received, counted from the first."""
        return self.flight.acknowledged

    @property
    def unsent(self) -> int:
        """Bytes of records that wait for their first transmission."""
        return self.flight.unsent

    @property
    def backlog(self) -> int:
        """Bytes that the peer has not acknowledged, sent or not."""
        return self.flight.unsent + self.flight.outstanding

    @property
    def buffered(self) -> int:
        """Bytes received that do not yet form a whole record in order."""
        return self.assembly.buffered

    @property
    def round_trip(self) -> float | None:
        """Smoothed round-trip time in wall seconds; None before the first measurement."""
        return self.flight.round_trip

    @property
    def statistics(self) -> LinkStatistics:
        flight = self.flight
        return LinkStatistics(self._sent, self._received, flight.resent, self._duplicates, flight.probes)

    def expired(self, now: float) -> bool:
        """Whether the peer has been silent too long."""
        return now - self.last_heard >= self.limits.timeout

    # --- sending ------------------------------------------------------------------------------

    def submit(self, framed: bytes) -> None:
        """Queue a record, framed by `frame_record`. The caller bounds the queue by looking at `backlog`.

        Raises:
            ValueError: the record is larger than the limit.
        """
        if len(framed) - _LENGTH_BYTES > self.limits.max_record:
            raise ValueError(f"a record of {len(framed)} bytes exceeds the limit of {self.limits.max_record}")
        self.flight.submit(framed)
        self._stirred = True

    def datagrams(self, now: float) -> list[bytes]:
        """What is to be sent now: repeats, new segments, an acknowledgement or a sign of life."""
        self._stirred = False
        out = [self._data(segment, now) for segment in self.flight.departures(now)]
        if out:
            self._last_sent = now
        if now >= self._ack_at:
            out.append(self._ack(now, echo=False))
        if now >= self._sign_of_life_at():
            out.append(self._ack(now, echo=now - self.last_heard >= 3 * self.limits.keepalive))
        self._sent += len(out)
        return out

    def close(self, reason: str, now: float) -> bytes:
        """The datagram that tells the peer that the connection is over."""
        self.closed = reason
        self._number += 1
        self._last_sent = now
        return encode(Close(self._number, reason[:MAX_REASON]), self.connection, self._send_key)

    def next_deadline(self) -> float:
        """Wall time by which `datagrams` must be called, or `expired` looked at."""
        if self._stirred:
            return -math.inf
        return min(
            self.flight.probe_at,
            self._ack_at,
            self._sign_of_life_at(),
            self.last_heard + self.limits.timeout,
        )

    def _sign_of_life_at(self) -> float:
        keepalive = self.limits.keepalive
        # A peer not heard for a while is asked more often: with four datagrams of ten lost, a
        # handful of signs a second still makes silence until the timeout very unlikely.
        if self._last_sent - self.last_heard >= 3 * keepalive:
            keepalive /= 4
        return self._last_sent + keepalive

    def _data(self, segment: Segment, now: float) -> bytes:
        self._number += 1
        segment.number = self._number
        seen = 0
        if not self.assembly.has_holes:
            # This frame says all that an acknowledgement would.
            seen = self._seen
            self._ack_at = math.inf
            self._unacked = self._unacked_bytes = 0
        frame = Data(
            self._number, self.assembly.expected, seen, self._held(now), segment.seq, segment.payload
        )
        return encode(frame, self.connection, self._send_key)

    def _ack(self, now: float, echo: bool) -> bytes:
        self._number += 1
        self._last_sent = now
        self._ack_at = math.inf
        self._unacked = self._unacked_bytes = 0
        assembly = self.assembly
        sack = assembly.early_bitmap() if assembly.has_holes else b""
        frame = Ack(self._number, assembly.expected, self._seen, self._held(now), sack, echo)
        return encode(frame, self.connection, self._send_key)

    def _held(self, now: float) -> int:
        return max(0, int((now - self._seen_at) * 1e6))

    # --- receiving ----------------------------------------------------------------------------

    def receive(self, datagram: bytes, now: float) -> list[bytes]:
        """Take in one datagram; return the records that are complete and in order.

        Raises:
            FrameError: the datagram is not acceptable; the link is unchanged.
            RecordError: the peer broke the rules; the link is to be given up.
        """
        return self._handle(decode(datagram, self._receive_key), now)

    def _handle(self, frame: Frame, now: float) -> list[bytes]:
        if isinstance(frame, Data):
            if frame.seq - self.assembly.expected >= MAX_SEGMENTS_AHEAD or frame.ack > self.flight.next_seq:
                raise FrameError(Fault.OUT_OF_WINDOW)
            self._note_number(frame.number, now)
            self.flight.take_ack(frame.ack, frame.seen, frame.held, b"", now)
            return self._take_segment(frame.seq, frame.payload, now)
        if isinstance(frame, Ack):
            if frame.ack > self.flight.next_seq:
                raise FrameError(Fault.OUT_OF_WINDOW)
            self._note_number(frame.number, now)
            self.flight.take_ack(frame.ack, frame.seen, frame.held, frame.sack, now)
            if frame.echo:
                self._ack_at = now
            return []
        if isinstance(frame, Close):
            self._note_number(frame.number, now)
            self.closed = frame.reason or "closed by the other side"
            return []
        raise FrameError(Fault.UNEXPECTED)

    def _note_number(self, number: int, now: float) -> None:
        """Admit a frame number that has not been used yet; the frame is then a sign of life."""
        if number > self._seen:
            ahead = number - self._seen
            self._seen_mask = ((self._seen_mask << ahead) | 1) & _REPLAY_MASK if ahead < _REPLAY_WINDOW else 1
            self._seen = number
            self._seen_at = now
        else:
            bit = 1 << (self._seen - number) if self._seen - number < _REPLAY_WINDOW else 0
            if not bit or self._seen_mask & bit:
                self._duplicates += 1
                raise FrameError(Fault.REPLAYED)
            self._seen_mask |= bit
        self.last_heard = now
        self._received += 1
        self._stirred = True

    def _take_segment(self, seq: int, payload: bytes, now: float) -> list[bytes]:
        assembly = self.assembly
        if seq != assembly.expected:
            self._ack_at = now  # the peer should know at once that something is missing, or is not
            if not assembly.keep_early(seq, payload):
                self._duplicates += 1
            return []
        if assembly.has_holes:
            self._ack_at = now
            return assembly.take_next(payload)
        self._unacked += 1
        self._unacked_bytes += len(payload)
        if self._unacked >= _ACK_EVERY or self._unacked_bytes >= 2 * self.flight.segment_size:
            self._ack_at = now
        else:
            self._ack_at = min(self._ack_at, now + self.limits.ack_delay)
        return assembly.take_next(payload)
