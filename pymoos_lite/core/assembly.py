"""The receiving half of a link: segments in any order in, whole records in order out.

Early segments wait for the missing ones within a window of bytes; an unfinished record grows to its
announced length, which is bounded before a byte of it is kept.
"""

from __future__ import annotations

from struct import Struct

_LENGTH = Struct(">I")


class RecordError(Exception):
    """The peer announced a record larger than allowed; the link cannot go on."""


def frame_record(record: bytes) -> bytes:
    """`record` as the stream carries it; whoever keeps it for a resend keeps it in this form, once."""
    return _LENGTH.pack(len(record)) + record


class Assembly:
    """Puts a stream together again.

    Args:
        window: most bytes of early segments to keep.
        max_record: most bytes of a record.
    """

    def __init__(self, window: int, max_record: int) -> None:
        self.expected = 0
        """The segment that is next in order."""
        self._window = window
        self._max_record = max_record
        self._early: dict[int, bytes] = {}
        self._early_bytes = 0
        self._partial = bytearray()
        self._needed = 0  # length of the stream's beginning that makes a whole record

    @property
    def has_holes(self) -> bool:
        """Whether something has arrived beyond the segment that is next in order."""
        return bool(self._early)

    @property
    def buffered(self) -> int:
        """Bytes received that do not yet form a whole record in order."""
        return self._early_bytes + len(self._partial)

    def early_bitmap(self) -> bytes:
        """Early segments as a bitmap that starts at `expected`; empty without holes."""
        mask = 0
        for seq in self._early:
            mask |= 1 << (seq - self.expected)
        return mask.to_bytes((mask.bit_length() + 7) // 8, "little")

    def keep_early(self, seq: int, payload: bytes) -> bool:
        """Keep a segment beyond `expected` if it is new and there is room; whether it was new."""
        if seq < self.expected or seq in self._early:
            return False
        if self._early_bytes + len(payload) <= self._window:
            self._early[seq] = payload
            self._early_bytes += len(payload)
        return True

    def take_next(self, payload: bytes) -> list[bytes]:
        """Take the segment `expected`; return the records that it completes.

        Raises:
            RecordError: a record is announced that is longer than allowed.
        """
        records: list[bytes] = []
        self.expected += 1
        self._absorb(payload, records)
        while self._early and self.expected in self._early:
            payload = self._early.pop(self.expected)
            self._early_bytes -= len(payload)
            self.expected += 1
            self._absorb(payload, records)
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
        self._needed = _LENGTH.size
        while end - start >= _LENGTH.size:
            (length,) = _LENGTH.unpack_from(payload, start)
            if length > self._max_record:
                raise RecordError(
                    f"the peer announced a record of {length} bytes, allowed are {self._max_record}"
                )
            if end - start - _LENGTH.size < length:
                self._needed = _LENGTH.size + length
                break
            start += _LENGTH.size
            records.append(payload[start : start + length])
            start += length
        if start < end:
            partial += payload[start:]
