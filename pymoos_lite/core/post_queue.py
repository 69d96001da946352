"""Posts on their way out of an app: checked when made, kept in order, bounded in number and bytes.

What is refused here is what no database would take, said at once and to the one who posted it.
"""

from __future__ import annotations

from pymoos_lite.core.message import Message, Value, as_value
from pymoos_lite.core.parcels import (
    MAX_AUX,
    MAX_VARIABLE,
    ROW_BYTES,
    Kind,
    Outbox,
    check_variable,
    is_text,
)

Row = tuple[object, ...]

_MAX_NAMES = 100_000
_PLAIN_TEXT = 4096  # text up to here needs no look at its encoded length, if it is ASCII
_FRINGE = 64  # room in a parcel for everything but value, name and aux


class PostQueue:
    """Posts that wait to be packed.

    Args:
        outbox: where packed posts wait for the database; they count towards the bounds as well.
        posts: most posts that may wait.
        post_bytes: most bytes that may wait.
        max_record: most bytes of a record of the link.
    """

    def __init__(self, outbox: Outbox, posts: int, post_bytes: int, max_record: int) -> None:
        self.rows = 0
        """Posts in this queue; in the outbox there may be more."""
        self.bytes = 0
        self._outbox = outbox
        self._most = posts
        self._most_bytes = post_bytes
        self._largest = max_record - MAX_AUX - MAX_VARIABLE - _FRINGE
        self._batches: list[tuple[Kind, list[Row]]] = []
        self._kind: Kind | None = None  # of the batch that grows
        self._current: list[Row] = []
        self._names: set[str] = set()

    def post(self, name: str, value: object, time: float, aux: str) -> bool:
        """Queue a post of this client; False if there is no room.

        Raises:
            ValueError, TypeError: see `ClientSession.post`.
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
        if aux:
            _check_text("aux", name, aux, MAX_AUX)
        if type(time) is not float or not -1e300 < time < 1e300:
            time = _as_time(name, time)
        return self._queue(Kind.POSTS, (name, value, time, aux), size)

    def relay(self, message: Message) -> bool:
        """Queue a post of somebody else, as it is; False if there is no room."""
        name, value, time, source, aux, community = message
        value = as_value(value)
        size = self._size_of(name, value)
        if name not in self._names:
            self._learn_name(name)
        _check_text("aux", name, aux, MAX_AUX)
        _check_text("source", name, source, MAX_VARIABLE)
        _check_text("community", name, community, MAX_VARIABLE)
        return self._queue(Kind.RELAYED, (name, value, _as_time(name, time), source, aux, community), size)

    def take(self) -> list[tuple[Kind, list[Row]]]:
        """All that waits, in order, in runs of one kind; the queue is empty afterwards."""
        batches = self._batches
        self._batches = []
        self._kind = None
        self.rows = self.bytes = 0
        return batches

    def half_empty(self) -> bool:
        """Whether the queue has room again after having been full."""
        return (
            2 * (self.rows + self._outbox.rows) <= self._most
            and 2 * (self.bytes + self._outbox.bytes) <= self._most_bytes
        )

    def shut(self) -> None:
        """Refuse whatever comes from now on."""
        self._most = 0

    def _queue(self, kind: Kind, row: Row, size: int) -> bool:
        outbox = self._outbox
        if self.rows + outbox.rows >= self._most or self.bytes + outbox.bytes + size > self._most_bytes:
            return False
        if kind is not self._kind:
            self._kind = kind
            self._current = []
            self._batches.append((kind, self._current))
        self._current.append(row)
        self.rows += 1
        self.bytes += size
        return True

    def _size_of(self, name: str, value: Value) -> int:
        """What `value` counts for in the queue; refuses what no link carries."""
        if isinstance(value, float):
            return ROW_BYTES
        size = len(value)
        if isinstance(value, str) and not value.isascii():
            if not is_text(value):
                raise ValueError(f"the value of {name} is no text: it holds half a surrogate pair")
            if size * 4 > self._largest:
                size = len(value.encode("utf-8", "surrogateescape"))
        if size > self._largest:
            raise ValueError(f"the value of {name} has {size} bytes, allowed are {self._largest}")
        return ROW_BYTES + size

    def _learn_name(self, name: str) -> None:
        check_variable(name)
        if len(self._names) >= _MAX_NAMES:
            self._names.clear()
        self._names.add(name)


def _check_text(what: str, name: str, text: str, longest: int) -> None:
    if type(text) is not str or len(text) > longest or not is_text(text):
        raise ValueError(f"the {what} of {name} must be text of at most {longest} characters")


def _as_time(name: str, time: object) -> float:
    try:
        stamp = float(time)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        stamp = float("nan")
    if not -1e300 < stamp < 1e300:
        raise ValueError(f"the time of {name} must be a finite number of seconds, not {time!r:.60}")
    return stamp
