"""Who wants to hear of what: exact names, wildcards over variable and source, minimum intervals.

A subscription decides for one message at a time. `Route` adds the throttle: it remembers the last
value it held back, so that the last value of a burst always arrives, late rather than never (the
reference loses it; community.md 6.1).
"""

from __future__ import annotations

from dataclasses import dataclass

from mypy_extensions import mypyc_attr

from pymoos_lite.core.message import Message


def is_pattern(text: str) -> bool:
    """Whether `text` holds a wildcard (``*`` any run, ``?`` one character)."""
    return "*" in text or "?" in text


def matches(pattern: str, name: str) -> bool:
    """Whether `name` matches the MOOS wildcard `pattern`.

    >>> matches("NAV_*", "NAV_X"), matches("NAV_?", "NAV_XY")
    (True, False)
    """
    return _wildcard_match(pattern, name) if is_pattern(pattern) else pattern == name


def _wildcard_match(pattern: str, name: str) -> bool:
    # Greedy two-pointer matching: linear-ish time for any pattern, where a regular expression
    # with many stars could be made to backtrack for minutes by a hostile client.
    p = n = 0
    star = -1
    mark = 0
    while n < len(name):
        if p < len(pattern) and (pattern[p] == "?" or pattern[p] == name[n]) and pattern[p] != "*":
            p += 1
            n += 1
        elif p < len(pattern) and pattern[p] == "*":
            star, mark = p, n
            p += 1
        elif star >= 0:
            p = star + 1
            mark += 1
            n = mark
        else:
            return False
    return all(char == "*" for char in pattern[p:])


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Subscription:
    """A wish to hear of variables.

    `pattern` names variables and `source` the apps that post them (wildcards allowed in both);
    `interval` is the least time in mission seconds between two deliveries of one variable, 0 for
    every post; variables that match one of `omit` are left out.
    """

    pattern: str
    source: str = "*"
    interval: float = 0.0
    omit: tuple[str, ...] = ()

    def wants_variable(self, name: str) -> bool:
        return matches(self.pattern, name) and not any(matches(o, name) for o in self.omit)

    def wants_source(self, source: str) -> bool:
        return self.source == "*" or matches(self.source, source)


class Route:
    """One client's way to one variable when not every post goes through.

    Several subscriptions of a client may cover a variable; a post is delivered once if any of
    them lets it through.
    """

    __slots__ = ("_always", "_last_sent", "mailbox", "pending", "subscriptions")

    def __init__(self, mailbox: list[Message], subscriptions: list[Subscription]) -> None:
        self.mailbox = mailbox
        self.subscriptions = subscriptions
        only = subscriptions[0] if len(subscriptions) == 1 else None
        self._always = only.interval if only is not None and only.source == "*" else None
        """The interval of whatever source, where there is just one."""
        self.pending: Message | None = None
        self._last_sent = float("-inf")

    def offer(self, message: Message, now: float) -> None:
        """Deliver `message` now, or hold it back until its interval has passed."""
        interval = self._interval_for(message.source)
        if interval is None:
            return
        if now - self._last_sent >= interval:
            self._deliver(message, now)
        else:
            self.pending = message

    def offer_latched(self, message: Message, now: float) -> None:
        """Deliver a variable's current value to a new subscriber, whatever the interval."""
        self._deliver(message, now)

    def deadline(self) -> float:
        """Mission time at which the held-back message is due (infinity without one)."""
        if self.pending is None:
            return float("inf")
        interval = self._interval_for(self.pending.source)
        return self._last_sent + (interval or 0.0)

    def release(self, now: float) -> bool:
        """Deliver the held-back message if it is due; True if nothing stays held back."""
        # Compared with the deadline itself, not as a difference: a host that sleeps until
        # `deadline()` must find the message due, rounding or not.
        if self.pending is not None and now >= self.deadline():
            self._deliver(self.pending, now)
        return self.pending is None

    def adopt(self, other: Route) -> None:
        """Take over throttle state when subscriptions of the same client change."""
        self._last_sent = other._last_sent
        self.pending = other.pending

    def _deliver(self, message: Message, now: float) -> None:
        self.mailbox.append(message)
        self._last_sent = now
        self.pending = None

    def _interval_for(self, source: str) -> float | None:
        if self._always is not None:
            return self._always
        intervals = [s.interval for s in self.subscriptions if s.wants_source(source)]
        return min(intervals) if intervals else None
