"""The reliable link: records in at one end, the same records out at the other, once and in order.

A record is bytes of any length up to a limit. Records form a stream that is cut into numbered
segments, several small records to a segment or one large record over many. A segment is repeated
until acknowledged, and at most a window of bytes is on its way, so both ends hold bounded memory.
Every datagram carries a frame number that is used once: a frame that comes twice, by accident of
the network or by somebody's intent, is dropped.

No socket and no clock: datagrams and wall time (seconds) come in as arguments, datagrams to send
come back. Loss detection and timers follow the ideas of RFC 9002 (numbered transmissions, probe
timeout), round-trip smoothing RFC 6298, window control is additive increase with a mild decrease,
since a radio loses datagrams that no slowing down would have saved.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from struct import Struct
from typing import NamedTuple

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

_LENGTH = Struct(">I")
_REPLAY_WINDOW = 2048
_REPLAY_MASK = (1 << _REPLAY_WINDOW) - 1
_REORDER_THRESHOLD = 3
_INITIAL_RTT = 0.1
_MIN_PROBE = 0.02
_MAX_PROBE = 0.6
_ACK_EVERY = 16
_INITIAL_SEGMENTS = 10
_FLOOR_SEGMENTS = 4
_FLOOR_BYTES = 24_000
_DECREASE = 0.7


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


@dataclass(slots=True)
class LinkStatistics:
    """What one link has seen."""

    sent: int = 0
    received: int = 0
    resent: int = 0
    duplicates: int = 0
    probes: int = 0


class RecordError(Exception):
    """The peer announced a record larger than allowed; the link cannot go on."""


def frame_record(record: bytes) -> bytes:
    """`record` as the stream carries it; whoever keeps it for a resend keeps it in this form, once."""
    return _LENGTH.pack(len(record)) + record


class _Segment:
    __slots__ = ("arrived", "lost", "number", "payload", "records", "sent_at", "seq", "size")

    def __init__(self, seq: int, payload: bytes, records: int) -> None:
        self.seq = seq
        self.payload = payload
        self.size = len(payload)
        self.records = records  # how many records end in this segment
        self.number = 0
        self.sent_at = 0.0
        self.arrived = False
        self.lost = False


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
        self.statistics = LinkStatistics()
        self.acknowledged = 0
        """Records that the peer has received, counted from the first."""
        self.last_heard = now
        self.closed: str | None = None
        """Why the peer closed the connection; None while it stands."""
        self._send_key = send_key
        self._receive_key = receive_key
        # Sending
        self._segment_size = max(64, min(limits.path.budget, peer_budget or limits.path.budget) - OVERHEAD)
        self._peer_window = max(
            self._segment_size, min(limits.path.window, peer_window or limits.path.window)
        )
        self._unsent: deque[bytes] = deque()
        self._unsent_bytes = 0
        self._offset = 0  # of the first unsent record: bytes already cut into segments
        self._next_seq = 0
        self._segments: dict[int, _Segment] = {}  # outstanding, in order of seq
        self._first = 0  # lowest outstanding seq
        self._outstanding_bytes = 0
        self._flight_bytes = 0  # outstanding, neither arrived nor taken for lost
        self._resend: deque[_Segment] = deque()
        self._number = 0
        self._last_sent = now
        self._stirred = False  # something came in that may let `datagrams` send at once
        # Round trip and window
        self._srtt: float | None = None
        self._rttvar = 0.0
        self._backoff = 0
        self._probe_after = self._probe_interval()
        self._probe_at = math.inf
        self._cwnd = float(_INITIAL_SEGMENTS * self._segment_size)
        # Never so narrow that one lost datagram of three stops the flow of acknowledgements.
        self._floor = float(max(_FLOOR_SEGMENTS * self._segment_size, _FLOOR_BYTES))
        self._threshold = math.inf
        self._last_decrease = -math.inf
        # Receiving
        self._expected = 0
        self._early: dict[int, bytes] = {}
        self._early_bytes = 0
        self._partial = bytearray()
        self._needed = 0
        self._seen = 0
        self._seen_at = now
        self._seen_mask = 0
        self._ack_at = math.inf
        self._unacked = 0
        self._unacked_bytes = 0

    # --- what a session asks ------------------------------------------------------------------

    @property
    def unsent(self) -> int:
        """Bytes of records that wait for their first transmission."""
        return self._unsent_bytes

    @property
    def backlog(self) -> int:
        """Bytes that the peer has not acknowledged, sent or not."""
        return self._unsent_bytes + self._outstanding_bytes

    @property
    def buffered(self) -> int:
        """Bytes received that do not yet form a whole record in order."""
        return self._early_bytes + len(self._partial)

    @property
    def round_trip(self) -> float | None:
        """Smoothed round-trip time in wall seconds; None before the first measurement."""
        return self._srtt

    def expired(self, now: float) -> bool:
        """Whether the peer has been silent too long."""
        return now - self.last_heard >= self.limits.timeout

    # --- sending ------------------------------------------------------------------------------

    def submit(self, framed: bytes) -> None:
        """Queue a record, framed by `frame_record`. The caller bounds the queue by looking at `backlog`.

        Raises:
            ValueError: the record is larger than the limit.
        """
        if len(framed) - _LENGTH.size > self.limits.max_record:
            raise ValueError(f"a record of {len(framed)} bytes exceeds the limit of {self.limits.max_record}")
        self._unsent.append(framed)
        self._unsent_bytes += len(framed)
        self._stirred = True

    def datagrams(self, now: float) -> list[bytes]:
        """What is to be sent now: repeats, new segments, an acknowledgement or a sign of life."""
        out: list[bytes] = []
        self._stirred = False
        if now >= self._probe_at:
            self._probe(now)
        resend = self._resend
        while resend:
            segment = resend[0]
            if segment.arrived or not segment.lost:
                resend.popleft()
                continue
            if self._flight_bytes and self._flight_bytes + segment.size > self._cwnd:
                break
            resend.popleft()
            self.statistics.resent += 1
            out.append(self._transmit(segment, now))
        if self._unsent and not resend:
            while self._unsent and self._may_cut():
                out.append(self._transmit(self._cut(), now))
        if now >= self._ack_at:
            out.append(self._ack(now, echo=False))
        if now >= self._sign_of_life_at():
            out.append(self._ack(now, echo=now - self.last_heard >= 3 * self.limits.keepalive))
        if out:
            self._last_sent = now
            self.statistics.sent += len(out)
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
            self._probe_at,
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

    def _may_cut(self) -> bool:
        if self._next_seq - self._first >= MAX_SEGMENTS_AHEAD:
            return False
        size = min(self._segment_size, self._unsent_bytes)
        if self._flight_bytes and self._flight_bytes + size > self._cwnd:
            return False
        return not self._outstanding_bytes or self._outstanding_bytes + size <= self._peer_window

    def _cut(self) -> _Segment:
        """Form the next segment: whole records as long as they fit, or a slice of a large one."""
        limit = self._segment_size
        unsent = self._unsent
        record = unsent[0]
        remaining = len(record) - self._offset
        records = 0
        if remaining > limit:
            payload = record[self._offset : self._offset + limit]
            self._offset += limit
        else:
            unsent.popleft()
            records = 1
            payload = record[self._offset :] if self._offset else record
            self._offset = 0
            if unsent and remaining + len(unsent[0]) <= limit:
                parts = [payload]
                while unsent and remaining + len(unsent[0]) <= limit:
                    record = unsent.popleft()
                    parts.append(record)
                    remaining += len(record)
                    records += 1
                payload = b"".join(parts)
        segment = _Segment(self._next_seq, payload, records)
        self._next_seq += 1
        self._segments[segment.seq] = segment
        self._unsent_bytes -= segment.size
        self._outstanding_bytes += segment.size
        return segment

    def _transmit(self, segment: _Segment, now: float) -> bytes:
        self._number += 1
        segment.number = self._number
        segment.sent_at = now
        segment.lost = False
        self._flight_bytes += segment.size
        self._probe_at = now + self._probe_after
        seen = 0 if self._early else self._seen
        if not self._early:
            # This frame says all that an acknowledgement would.
            self._ack_at = math.inf
            self._unacked = self._unacked_bytes = 0
        frame = Data(self._number, self._expected, seen, self._held(now), segment.seq, segment.payload)
        return encode(frame, self.connection, self._send_key)

    def _ack(self, now: float, echo: bool) -> bytes:
        self._number += 1
        self._ack_at = math.inf
        self._unacked = self._unacked_bytes = 0
        sack = b""
        if self._early:
            mask = 0
            for seq in self._early:
                mask |= 1 << (seq - self._expected)
            sack = mask.to_bytes((mask.bit_length() + 7) // 8, "little")
        frame = Ack(self._number, self._expected, self._seen, self._held(now), sack, echo)
        return encode(frame, self.connection, self._send_key)

    def _held(self, now: float) -> int:
        return max(0, int((now - self._seen_at) * 1e6))

    def _probe_interval(self) -> float:
        if self._srtt is None:
            interval = 2 * _INITIAL_RTT
        else:
            interval = self._srtt + max(4 * self._rttvar, 0.001) + self.limits.ack_delay
        interval = max(interval, _MIN_PROBE)
        # Repeated silence backs off, though not so far that the timeout passes between two tries.
        return float(max(interval, min(interval * 2**self._backoff, _MAX_PROBE)))

    def _probe(self, now: float) -> None:
        """Nothing was acknowledged for long: repeat the oldest segments to provoke an answer."""
        self._probe_at = math.inf
        repeated = 0
        for segment in self._segments.values():
            if not segment.arrived and not segment.lost:
                self._take_for_lost(segment)
                repeated += 1
                if repeated == 2:
                    break
        if repeated:
            self.statistics.probes += 1
            self._backoff = min(self._backoff + 1, 16)
            self._probe_after = self._probe_interval()
            if self._backoff >= 3:
                self._decrease_window(now, now)

    def _take_for_lost(self, segment: _Segment) -> None:
        segment.lost = True
        self._flight_bytes -= segment.size
        self._resend.append(segment)

    def _decrease_window(self, sent_at: float, now: float) -> None:
        # Once per round trip: losses among datagrams sent before the last decrease say nothing new.
        if sent_at > self._last_decrease:
            self._last_decrease = now
            self._cwnd = max(self._floor, self._cwnd * _DECREASE)
            self._threshold = self._cwnd

    # --- receiving ----------------------------------------------------------------------------

    def receive(self, datagram: bytes, now: float) -> list[bytes]:
        """Take in one datagram; return the records that are complete and in order.

        Raises:
            FrameError: the datagram is not acceptable; the link is unchanged.
            RecordError: the peer broke the rules; the link is to be given up.
        """
        frame = decode(datagram, self._receive_key)
        return self.handle(frame, now)

    def handle(self, frame: Frame, now: float) -> list[bytes]:
        """`receive` for a frame that is decoded already."""
        if not isinstance(frame, Data | Ack | Close):
            raise FrameError(Fault.UNEXPECTED)
        number = frame.number
        if isinstance(frame, Data) and frame.seq - self._expected >= MAX_SEGMENTS_AHEAD:
            raise FrameError(Fault.OUT_OF_WINDOW)
        if frame.__class__ is not Close and frame.ack > self._next_seq:  # type: ignore[union-attr]
            raise FrameError(Fault.OUT_OF_WINDOW)
        if number > self._seen:
            ahead = number - self._seen
            self._seen_mask = ((self._seen_mask << ahead) | 1) & _REPLAY_MASK if ahead < _REPLAY_WINDOW else 1
            self._seen = number
            self._seen_at = now
        else:
            bit = 1 << (self._seen - number) if self._seen - number < _REPLAY_WINDOW else 0
            if not bit or self._seen_mask & bit:
                self.statistics.duplicates += 1
                raise FrameError(Fault.REPLAYED)
            self._seen_mask |= bit
        self.last_heard = now
        self.statistics.received += 1
        self._stirred = True
        if isinstance(frame, Close):
            self.closed = frame.reason or "closed by the other side"
            return []
        if isinstance(frame, Ack):
            self._take_ack(frame.ack, frame.seen, frame.held, frame.sack, now)
            if frame.echo:
                self._ack_at = now
            return []
        self._take_ack(frame.ack, frame.seen, frame.held, b"", now)
        return self._take_segment(frame.seq, frame.payload, now)

    def _take_segment(self, seq: int, payload: bytes, now: float) -> list[bytes]:
        records: list[bytes] = []
        if seq != self._expected:
            self._ack_at = now
            if seq < self._expected or seq in self._early:
                self.statistics.duplicates += 1
            elif self._early_bytes + len(payload) <= self.limits.window:
                self._early[seq] = payload
                self._early_bytes += len(payload)
            return records
        self._expected += 1
        self._absorb(payload, records)
        if self._early:
            self._ack_at = now
            while self._expected in self._early:
                payload = self._early.pop(self._expected)
                self._early_bytes -= len(payload)
                self._expected += 1
                self._absorb(payload, records)
            return records
        self._unacked += 1
        self._unacked_bytes += len(payload)
        if self._unacked >= _ACK_EVERY or self._unacked_bytes >= 2 * self._segment_size:
            self._ack_at = now
        else:
            self._ack_at = min(self._ack_at, now + self.limits.ack_delay)
        return records

    def _absorb(self, payload: bytes, records: list[bytes]) -> None:
        """Append `payload` to the stream and move whole records to `records`."""
        partial = self._partial
        if partial:
            partial += payload
            if len(partial) < self._needed:
                return
            payload = bytes(partial)
            partial.clear()
        start, end = 0, len(payload)
        self._needed = 4
        while end - start >= 4:
            (length,) = _LENGTH.unpack_from(payload, start)
            if length > self.limits.max_record:
                raise RecordError(
                    f"the peer announced a record of {length} bytes, allowed are {self.limits.max_record}"
                )
            if end - start - 4 < length:
                self._needed = 4 + length
                break
            records.append(payload[start + 4 : start + 4 + length])
            start += 4 + length
        if start < end:
            partial += payload[start:]

    def _take_ack(self, ack: int, seen: int, held: int, sack: bytes, now: float) -> None:
        if ack < self._first:
            return  # an older statement than one that came before it
        segments = self._segments
        arrived_bytes = 0
        newest: _Segment | None = None
        while self._first < ack:
            segment = segments.pop(self._first)
            self._first += 1
            self.acknowledged += segment.records
            self._outstanding_bytes -= segment.size
            if not segment.arrived:
                segment.arrived = True
                arrived_bytes += segment.size
                if not segment.lost:
                    self._flight_bytes -= segment.size
                if segment.number == seen:
                    newest = segment
        if sack:
            mask = int.from_bytes(sack, "little")
            seq = ack
            while mask:
                skip = (mask & -mask).bit_length() - 1
                seq += skip
                mask >>= skip + 1
                early = segments.get(seq)
                seq += 1
                if early is not None and not early.arrived:
                    early.arrived = True
                    arrived_bytes += early.size
                    if not early.lost:
                        self._flight_bytes -= early.size
                    if early.number == seen:
                        newest = early
        if newest is not None:
            self._measure(max(0.0, now - newest.sent_at - held * 1e-6))
        if arrived_bytes:
            self._backoff = 0
            self._probe_after = self._probe_interval()
            self._widen(arrived_bytes)
        if not segments:
            self._probe_at = math.inf
            return
        if arrived_bytes:
            self._probe_at = now + self._probe_after
        if seen and (sack or segments[self._first].number + _REORDER_THRESHOLD <= seen):
            # `seen` and the rest of this frame are one moment's truth: a transmission well before
            # that frame, and not listed, did not arrive.
            for segment in segments.values():
                if not segment.arrived and not segment.lost and segment.number + _REORDER_THRESHOLD <= seen:
                    self._take_for_lost(segment)
                    self._decrease_window(segment.sent_at, now)

    def _measure(self, sample: float) -> None:
        if self._srtt is None:
            self._srtt = sample
            self._rttvar = sample / 2
        else:
            self._rttvar += (abs(sample - self._srtt) - self._rttvar) / 4
            self._srtt += (sample - self._srtt) / 8

    def _widen(self, arrived_bytes: int) -> None:
        if self._cwnd < self._threshold:
            self._cwnd += arrived_bytes
        else:
            self._cwnd += arrived_bytes * self._segment_size / self._cwnd
        self._cwnd = min(self._cwnd, float(self._peer_window))
