"""Whether a vessel has reached the points of a list, one after the other (behaviors.md C1, arrival engine).

Shared by the behaviours that follow points. It knows nothing of steering and posts nothing.
"""

from __future__ import annotations

from itertools import pairwise
from math import hypot
from typing import Literal

from pymoos_lite.geometry.segments import angle_from_three_points

XY = tuple[float, float]
Event = Literal["none", "advanced", "cycled", "completed"]


class ArrivalEngine:
    """Follows a list of points; `arrive` is asked once per iteration and moves on by one point at most.

    Distances are metres. `repeats` counts further rounds after the first one, None for endless rounds.
    `perpetual` lets a round that ends be repeated at all.
    """

    def __init__(self) -> None:
        self.points: tuple[XY, ...] = ()
        self.capture_radius = 3.0
        self.slip_radius = 15.0
        self.capture_line = False
        self.repeats: int | None = 0
        self.perpetual = False
        self.index = 0
        self.capture_hits = 0
        self.hits = 0
        self.cycles = 0
        self.repeats_done = 0
        self.previous: XY | None = None
        """The point the present leg began at, None before it is known."""
        self._best = -1.0

    # --- the list -----------------------------------------------------------------------------------------

    def set_points(self, points: tuple[XY, ...]) -> None:
        """Take new points and start at the first."""
        self.points = points
        self.index = 0
        self.cycles = 0
        self.repeats_done = 0
        self.previous = None
        self._best = -1.0

    def replace_points(self, points: tuple[XY, ...]) -> None:
        """Take other points and go on with the one of the same number."""
        self.points = points
        self.index = min(self.index, max(0, len(points) - 1))
        self._best = -1.0

    def set_index(self, index: int) -> bool:
        """Go for the point of that number; False if there is none."""
        if not 0 <= index < len(self.points):
            return False
        self.index = index
        self._best = -1.0
        return True

    def forget_distance(self) -> None:
        """Time passed unseen (idle): nothing is known of how near the vessel came."""
        self._best = -1.0

    def restart(self) -> None:
        """Begin at the first point again; counters of hits and rounds go on."""
        self.index = 0
        self.repeats_done = 0
        self._best = -1.0

    @property
    def current(self) -> XY:
        """The point to go for."""
        return self.points[self.index]

    # --- arriving -----------------------------------------------------------------------------------------

    def arrive(self, x: float, y: float) -> Event:
        """What happens with the vessel at (x, y)."""
        if not self.points or not self._reached(x, y):
            return "none"
        self.hits += 1
        self.previous = self.current
        self.index += 1
        event: Event = "advanced"
        if self.index >= len(self.points):
            self.index = 0
            self.cycles += 1
            event = self._round_ended()
        self._best = hypot(x - self.current[0], y - self.current[1])
        return event

    def _round_ended(self) -> Event:
        if not self.perpetual:
            return "completed"
        self.repeats_done += 1
        if self.repeats is not None and self.repeats_done > self.repeats:
            self.repeats_done = 0
            return "completed"
        return "cycled"

    def _reached(self, x: float, y: float) -> bool:
        px, py = self.current
        distance = hypot(x - px, y - py)
        if distance < self.capture_radius:
            self.capture_hits += 1
            return True
        slipping = self.slip_radius > self.capture_radius and 0.0 <= self._best <= self.slip_radius
        if slipping and distance > self._best:
            return True
        if self.capture_line and self.previous is not None and self.previous != (px, py):
            qx, qy = self.previous
            if angle_from_three_points(px, py, qx, qy, x, y) >= 90.0:
                return True
        if self._best < 0.0 or distance < self._best:
            self._best = distance
        return False

    # --- the way ahead ------------------------------------------------------------------------------------

    @property
    def points_left(self) -> int:
        """Points not yet reached in this round."""
        return len(self.points) - self.index

    @property
    def repeats_left(self) -> int | None:
        """Rounds after this one, None for ever."""
        if not self.perpetual:
            return 0
        return None if self.repeats is None else max(0, self.repeats - self.repeats_done)

    def distance_left(self, x: float, y: float) -> float:
        """From (x, y) over the points left to the end of this round."""
        if not self.points:
            return 0.0
        return hypot(x - self.current[0], y - self.current[1]) + length(self.points[self.index :])

    def distance_left_of_all(self, x: float, y: float) -> float | None:
        """From (x, y) to the end of all rounds, None if they never end."""
        left = self.repeats_left
        if left is None:
            return None
        if not self.points:
            return 0.0
        (ax, ay), (bx, by) = self.points[-1], self.points[0]
        return self.distance_left(x, y) + left * (length(self.points) + hypot(ax - bx, ay - by))


def length(points: tuple[XY, ...]) -> float:
    """Metres along the points."""
    return sum(hypot(bx - ax, by - ay) for (ax, ay), (bx, by) in pairwise(points))
