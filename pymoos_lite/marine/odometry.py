"""How far and how fast vessels have gone: the core of uFldPathCheck (marine_apps.md 7.4)."""

from __future__ import annotations

import math
from collections import deque
from itertools import pairwise

from pymoos_lite.marine.encounters import Fix
from pymoos_lite.records.csp import fix as fixed


class Odometer:
    """Distance and mean speed of one vessel, from its successive positions.

    Speed is the mean over the legs between the last `history` positions.
    """

    def __init__(self, history: int = 10) -> None:
        self.total = 0.0
        self.trip = 0.0
        self._fixes: deque[Fix] = deque(maxlen=max(2, history))

    def hear(self, where: Fix) -> None:
        """Take a position; one that is not newer than the last is ignored."""
        if self._fixes:
            last = self._fixes[-1]
            if where.time <= last.time:
                return
            leg = math.hypot(where.x - last.x, where.y - last.y)
            self.total += leg
            self.trip += leg
        self._fixes.append(where)

    def reset_trip(self) -> None:
        """Start a new trip."""
        self.trip = 0.0

    @property
    def mean_speed(self) -> float:
        """Mean of the leg speeds, m/s; 0 before the second position."""
        speeds = [math.hypot(b.x - a.x, b.y - a.y) / (b.time - a.time) for a, b in pairwise(self._fixes)]
        return sum(speeds) / len(speeds) if speeds else 0.0

    def speed_report(self, name: str) -> str:
        """The text of UPC_SPEED_REPORT."""
        return f"vname={name},avg_spd={fixed(self.mean_speed)}"

    def odometry_report(self, name: str) -> str:
        """The text of UPC_ODOMETRY_REPORT."""
        return f"vname={name},total_dist={fixed(self.total, 1)},trip_dist={fixed(self.trip, 1)}"
