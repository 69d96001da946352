"""Keeping a place: how fast to go back to it, and when to wait instead (behaviors.md C3, C26).

Shared by the station keeping behaviours; it knows no course and posts nothing.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Radii:
    """Within `inner` metres all is well; beyond `outer` the way back is made at full speed."""

    inner: float
    outer: float
    outer_speed: float
    transit_speed: float

    def speed(self, distance: float) -> float:
        """Metres per second: 0 inside, rising to `outer_speed` at the outer radius, then `transit_speed`."""
        outer = max(self.outer, self.inner)
        if distance <= self.inner:
            return 0.0
        if distance >= outer:
            return self.transit_speed
        return self.outer_speed * (distance - self.inner) / (outer - self.inner)


HIBERNATING = "hibernating"
SEEKING = "seeking_station"

PROGRESS_SPAN = 5.0
"""Seconds over which it is judged whether the vessel comes nearer."""
MEMORY = 10.0
"""Seconds of distances that are kept."""


class Hibernation:
    """Passive station keeping: drift freely until `radius` is left, then go back as far as that goes.

    Seeking ends within `inner`, or when the vessel, once it has come nearer, comes no nearer any more.
    """

    def __init__(self) -> None:
        self.state = HIBERNATING
        self._approaching = False
        self._history: deque[tuple[float, float]] = deque()

    def restart(self) -> None:
        """The station is new."""
        self.__init__()  # type: ignore[misc]

    def update(self, now: float, distance: float, radius: float, inner: float) -> str:
        """The state with own ship this far from the station."""
        if self.state == HIBERNATING:
            if distance > radius:
                self.restart()
                self.state = SEEKING
            return self.state
        history = self._history
        history.append((now, distance))
        while now - history[0][0] > MEMORY:
            history.popleft()
        if distance <= inner or self._stalled(now, distance, radius):
            self.restart()
        return self.state

    def _stalled(self, now: float, distance: float, radius: float) -> bool:
        then, former = self._history[0]
        if now - then < PROGRESS_SPAN or distance > radius:
            return False
        if not self._approaching:
            self._approaching = distance <= former
            return False
        return distance >= former
