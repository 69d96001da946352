"""The headings of the last seconds, their mean and their spread (behaviors.md C15, C25)."""

from __future__ import annotations

from collections import deque
from math import sqrt

from pymoos_lite.geometry.angles import angle_diff, heading_average


class HeadingMemory:
    """Headings of the last `seconds`, both ends of the window included."""

    def __init__(self) -> None:
        self._headings: deque[tuple[float, float]] = deque()

    def forget(self) -> None:
        """Begin anew."""
        self._headings.clear()

    def add(self, now: float, heading: float, seconds: float) -> None:
        """Another heading; those from before the window are dropped."""
        self._headings.append((now, heading))
        while now - self._headings[0][0] > seconds + 1e-9:
            self._headings.popleft()

    @property
    def mean(self) -> float:
        """Vector mean in degrees, 0 while empty."""
        return heading_average(heading for _, heading in self._headings) if self._headings else 0.0

    @property
    def variance(self) -> float:
        """Mean square of the differences to the mean, square degrees."""
        if not self._headings:
            return 0.0
        mean = self.mean
        return sum(angle_diff(heading, mean) ** 2 for _, heading in self._headings) / len(self._headings)

    @property
    def deviation(self) -> float:
        """Root of the variance, degrees."""
        return sqrt(self.variance)
