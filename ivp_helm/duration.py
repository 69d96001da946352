"""The duration clock of a behaviour (helm.md 5.3): counts from its first run, notices the end when it runs."""

from __future__ import annotations


class DurationClock:
    """`limit` seconds, negative for none. Idle time counts unless `idle_decay` is off."""

    __slots__ = ("_idle", "idle_decay", "limit", "started")

    def __init__(self, limit: float, idle_decay: bool = True) -> None:
        self.limit = limit
        self.idle_decay = idle_decay
        self.started: float | None = None
        self._idle = 0.0

    def run(self, now: float) -> None:
        """The conditions hold: start if not yet started."""
        if self.started is None:
            self.started = now
            self._idle = 0.0

    def idle(self, seconds: float) -> None:
        """`seconds` were spent idle since it started."""
        if self.started is not None and not self.idle_decay:
            self._idle += seconds

    def elapsed(self, now: float) -> float:
        return 0.0 if self.started is None else now - self.started - self._idle

    def remaining(self, now: float) -> float:
        """Seconds left, at least 0."""
        return max(0.0, self.limit - self.elapsed(now))

    def over(self, now: float) -> bool:
        """Whether the limit is reached (to a nanosecond, so that sums of ticks count as what they mean)."""
        return self.limit >= 0.0 and self.elapsed(now) >= self.limit - 1e-9

    def reset(self) -> None:
        """Start anew with the next run."""
        self.started = None
        self._idle = 0.0
