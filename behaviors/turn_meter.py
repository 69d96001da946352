"""Measures a turn while it is sailed: how far round, how wide, how much rudder (behaviors.md C18)."""

from __future__ import annotations

from math import hypot
from typing import Literal

from pymoos_lite.geometry.angles import angle180

HALF = 180.0


class TurnMeter:
    """Follows one turn from its first heading on; degrees count in the direction of the turn."""

    def __init__(self, side: Literal["port", "star"], now: float, x: float, y: float, heading: float) -> None:
        self.side = side
        self.progress = 0.0
        self.distance = 0.0
        self.began = now
        self.radii: list[float] = []
        """Half the distance of each position to the one half a turn before."""
        self._heading = heading
        self._track = [(0.0, x, y)]
        self._rudder = (0.0, 0)

    def add(self, x: float, y: float, heading: float, rudder: float | None) -> None:
        """The vessel's state in this iteration."""
        step = angle180(heading - self._heading)
        self.progress += -step if self.side == "port" else step
        self._heading = heading
        _, px, py = self._track[-1]
        self.distance += hypot(x - px, y - py)
        self._track.append((self.progress, x, y))
        if rudder is not None:
            self._rudder = self._rudder[0] + abs(rudder), self._rudder[1] + 1
        opposite = self._position_at(self.progress - HALF)
        if opposite is not None:
            self.radii.append(hypot(x - opposite[0], y - opposite[1]) / 2.0)

    def _position_at(self, progress: float) -> tuple[float, float] | None:
        """Where the vessel was at that progress, None if that was before the turn."""
        if progress < 0.0:
            return None
        # The last passage counts: the heading may have wavered.
        for (a, ax, ay), (b, bx, by) in zip(self._track[-2::-1], self._track[:0:-1], strict=False):
            if a <= progress <= b:
                t = (progress - a) / (b - a) if b > a else 0.0
                return ax + t * (bx - ax), ay + t * (by - ay)
        return None

    @property
    def radius(self) -> float:
        """The mean radius so far, 0 before half a turn is done."""
        return sum(self.radii) / len(self.radii) if self.radii else 0.0

    @property
    def mean_rudder(self) -> float:
        """Mean of the rudder angles, whichever side; 0 if none was known."""
        total, count = self._rudder
        return total / count if count else 0.0
