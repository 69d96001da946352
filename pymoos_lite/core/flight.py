"""The sending half of a link: what waits, what is on its way, what has to be sent again and when.

Records form a stream that is cut into numbered segments, several small records to a segment or one
large record over many. A segment stays here until it is acknowledged, and no more than a window of
bytes is on its way. Loss detection and timers follow the ideas of RFC 9002 (numbered transmissions,
probe timeout), round-trip smoothing RFC 6298; the window grows additively and shrinks mildly, since a
radio loses datagrams that no slowing down would have saved.
"""

from __future__ import annotations

import math
from collections import deque

from pymoos_lite.core.frames import MAX_SEGMENTS_AHEAD

_REORDER_THRESHOLD = 3
_INITIAL_RTT = 0.1
_MIN_PROBE = 0.02
_MAX_PROBE = 0.6
_INITIAL_SEGMENTS = 10
_FLOOR_SEGMENTS = 4
_FLOOR_BYTES = 24_000
_DECREASE = 0.7


class Segment:
    """A piece of the stream on its way."""

    __slots__ = ("arrived", "lost", "number", "payload", "records", "sent_at", "seq", "size")

    def __init__(self, seq: int, payload: bytes, records: int) -> None:
        self.seq = seq
        self.payload = payload
        self.size = len(payload)
        self.records = records  # how many records end in this segment
        self.number = 0  # of the frame that carried it last; the link's business
        self.sent_at = 0.0
        self.arrived = False
        self.lost = False


class Flight:
    """Decides which segments to transmit; times are wall seconds.

    Args:
        segment_size: most bytes in one segment.
        window: most bytes between the first one not acknowledged and the last one sent.
        ack_delay: how long the peer may hold an acknowledgement back.
    """

    def __init__(self, segment_size: int, window: int, ack_delay: float) -> None:
        self.segment_size = segment_size
        self.window = max(window, segment_size)
        self.acknowledged = 0
        """Records that the peer has received, counted from the first."""
        self.unsent = 0
        """Bytes of records that wait for their first transmission."""
        self.outstanding = 0
        """Bytes sent and not acknowledged."""
        self.resent = 0
        self.probes = 0
        self.probe_at = math.inf
        self.round_trip: float | None = None
        self.next_seq = 0
        self._ack_delay = ack_delay
        self._queue: deque[bytes] = deque()
        self._offset = 0  # of the first queued record: bytes already cut into segments
        self._segments: dict[int, Segment] = {}  # outstanding, in order of seq
        self._first = 0  # lowest outstanding seq
        self._in_flight = 0  # bytes outstanding that neither arrived nor are taken for lost
        self._again: deque[Segment] = deque()
        self._variation = 0.0
        self._backoff = 0
        self._probe_after = self._probe_interval()
        self._width = float(_INITIAL_SEGMENTS * segment_size)
        # Never so narrow that one lost datagram of three stops the flow of acknowledgements.
        self._floor = float(max(_FLOOR_SEGMENTS * segment_size, _FLOOR_BYTES))
        self._threshold = math.inf
        self._last_decrease = -math.inf

    def submit(self, framed: bytes) -> None:
        """Queue a framed record."""
        self._queue.append(framed)
        self.unsent += len(framed)

    # --- departures ---------------------------------------------------------------------------

    def departures(self, now: float) -> list[Segment]:
        """Segments to transmit now, repeats before new ones."""
        if now >= self.probe_at:
            self._probe(now)
        out: list[Segment] = []
        again = self._again
        while again:
            segment = again[0]
            if segment.arrived or not segment.lost:
                again.popleft()
                continue
            if self._in_flight and self._in_flight + segment.size > self._width:
                return out
            again.popleft()
            self.resent += 1
            self._launch(segment, now)
            out.append(segment)
        while self._queue and self._may_cut():
            segment = self._cut()
            self._launch(segment, now)
            out.append(segment)
        return out

    def _launch(self, segment: Segment, now: float) -> None:
        segment.sent_at = now
        segment.lost = False
        self._in_flight += segment.size
        self.probe_at = now + self._probe_after

    def _may_cut(self) -> bool:
        if self.next_seq - self._first >= MAX_SEGMENTS_AHEAD:
            return False
        size = min(self.segment_size, self.unsent)
        if self._in_flight and self._in_flight + size > self._width:
            return False
        return not self.outstanding or self.outstanding + size <= self.window

    def _cut(self) -> Segment:
        """Form the next segment: whole records as long as they fit, or a slice of a large one."""
        limit = self.segment_size
        queue = self._queue
        record = queue[0]
        remaining = len(record) - self._offset
        records = 0
        if remaining > limit:
            payload = record[self._offset : self._offset + limit]
            self._offset += limit
        else:
            queue.popleft()
            records = 1
            payload = record[self._offset :] if self._offset else record
            self._offset = 0
            if queue and remaining + len(queue[0]) <= limit:
                parts = [payload]
                while queue and remaining + len(queue[0]) <= limit:
                    record = queue.popleft()
                    parts.append(record)
                    remaining += len(record)
                    records += 1
                payload = b"".join(parts)
        segment = Segment(self.next_seq, payload, records)
        self.next_seq += 1
        self._segments[segment.seq] = segment
        self.unsent -= segment.size
        self.outstanding += segment.size
        return segment

    # --- what the peer says -------------------------------------------------------------------

    def take_ack(self, ack: int, seen: int, held: int, sack: bytes, now: float) -> None:
        """The peer has all segments below `ack` and those above it that are set in the bitmap `sack`.

        `seen` is the highest frame number that it had received when it said so, `held` microseconds
        before. With `seen` 0 the statement is incomplete and proves no loss.
        """
        if ack < self._first:
            return  # an older statement than one that came before it
        segments = self._segments
        arrived_bytes = 0
        newest: Segment | None = None
        while self._first < ack:
            segment = segments.pop(self._first)
            self._first += 1
            self.acknowledged += segment.records
            self.outstanding -= segment.size
            if not segment.arrived:
                arrived_bytes += self._arrive(segment)
                if segment.number == seen:
                    newest = segment
        if sack:
            for seq in _bits(sack, ack):
                early = segments.get(seq)
                if early is not None and not early.arrived:
                    arrived_bytes += self._arrive(early)
                    if early.number == seen:
                        newest = early
        if newest is not None:
            self._measure(max(0.0, now - newest.sent_at - held * 1e-6))
        if arrived_bytes:
            self._backoff = 0
            self._probe_after = self._probe_interval()
            self._widen(arrived_bytes)
        if not segments:
            self.probe_at = math.inf
            return
        if arrived_bytes:
            self.probe_at = now + self._probe_after
        if seen and (sack or segments[self._first].number + _REORDER_THRESHOLD <= seen):
            self._find_losses(seen, now)

    def _arrive(self, segment: Segment) -> int:
        segment.arrived = True
        if not segment.lost:
            self._in_flight -= segment.size
        return segment.size

    def _find_losses(self, seen: int, now: float) -> None:
        # `seen` and the rest of the statement are one moment's truth: a transmission well before
        # that frame, and not listed, did not arrive.
        for segment in self._segments.values():
            if not segment.arrived and not segment.lost and segment.number + _REORDER_THRESHOLD <= seen:
                self._take_for_lost(segment)
                self._narrow(segment.sent_at, now)

    def _take_for_lost(self, segment: Segment) -> None:
        segment.lost = True
        self._in_flight -= segment.size
        self._again.append(segment)

    # --- timers and window --------------------------------------------------------------------

    def _probe_interval(self) -> float:
        if self.round_trip is None:
            interval = 2 * _INITIAL_RTT
        else:
            interval = self.round_trip + max(4 * self._variation, 0.001) + self._ack_delay
        interval = max(interval, _MIN_PROBE)
        # Repeated silence backs off, though not so far that the timeout passes between two tries.
        return float(max(interval, min(interval * 2**self._backoff, _MAX_PROBE)))

    def _probe(self, now: float) -> None:
        """Nothing was acknowledged for long: repeat the oldest segments to provoke an answer."""
        self.probe_at = math.inf
        repeated = 0
        for segment in self._segments.values():
            if not segment.arrived and not segment.lost:
                self._take_for_lost(segment)
                repeated += 1
                if repeated == 2:
                    break
        if repeated:
            self.probes += 1
            self._backoff = min(self._backoff + 1, 16)
            self._probe_after = self._probe_interval()
            if self._backoff >= 3:
                self._narrow(now, now)

    def _measure(self, sample: float) -> None:
        if self.round_trip is None:
            self.round_trip = sample
            self._variation = sample / 2
        else:
            self._variation += (abs(sample - self.round_trip) - self._variation) / 4
            self.round_trip += (sample - self.round_trip) / 8

    def _widen(self, arrived_bytes: int) -> None:
        if self._width < self._threshold:
            self._width += arrived_bytes
        else:
            self._width += arrived_bytes * self.segment_size / self._width
        self._width = min(self._width, float(self.window))

    def _narrow(self, sent_at: float, now: float) -> None:
        # Once per round trip: losses among datagrams sent before the last decrease say nothing new.
        if sent_at > self._last_decrease:
            self._last_decrease = now
            self._width = max(self._floor, self._width * _DECREASE)
            self._threshold = self._width


def _bits(bitmap: bytes, start: int) -> list[int]:
    """Positions of the set bits, counted from `start`, lowest first."""
    mask = int.from_bytes(bitmap, "little")
    found: list[int] = []
    while mask:
        low = mask & -mask
        found.append(start + low.bit_length() - 1)
        mask ^= low
    return found
