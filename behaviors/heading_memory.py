"""The headings of the last seconds, their mean and their spread (behaviors.md C15, C25)."""

from __future__ import annotations

from collections import deque
from math import sqrt

from pymoos_lite.geometry.angles import angle_diff, bearing, unit_vector

_FRESH_SUMS = 256
"""After so many headings the running sums are taken anew, so that rounding cannot pile up."""


class HeadingMemory:
    """Headings of the last `seconds`, both ends of the window included."""

    def __init__(self) -> None:
        self._entries: deque[tuple[float, float, float, float]] = deque()
        self._east = self._north = 0.0
        self._added = 0

    def forget(self) -> None:
        """Begin anew."""
        self._entries.clear()
        self._east = self._north = 0.0

    def add(self, now: float, heading: float, seconds: float) -> None:
        """Another heading; those from before the window are dropped."""
        entries = self._entries
        east, north = unit_vector(heading)
        entries.append((now, heading, east, north))
        self._east += east
        self._north += north
        while now - entries[0][0] > seconds + 1e-9:
            _, _, east, north = entries.popleft()
            self._east -= east
            self._north -= north
        self._added += 1
        if self._added % _FRESH_SUMS == 0:
            self._east = sum(entry[2] for entry in entries)
            self._north = sum(entry[3] for entry in entries)

    @property
    def mean(self) -> float:
        """Vector mean in degrees, 0 while empty."""
        return bearing(0.0, 0.0, self._east, self._north)

    @property
    def variance(self) -> float:
        """Mean square of the differences to the mean, square degrees."""
        if not self._entries:
            return 0.0
        mean = self.mean
        return sum(angle_diff(entry[1], mean) ** 2 for entry in self._entries) / len(self._entries)

    @property
    def deviation(self) -> float:
        """Root of the variance, degrees."""
        return sqrt(self.variance)
