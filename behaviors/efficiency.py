"""How straight and how fast the legs of a waypoint list are sailed (behaviors.md C1, efficiency_measure)."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

from pymoos_lite.geometry.text import num


@dataclass(slots=True)
class _Sum:
    linear: float = 0.0
    sailed: float = 0.0
    ideal_time: float = 0.0
    time: float = 0.0


class Efficiency:
    """Distance and time of the running leg, and of all legs that counted.

    A leg counts if it was sailed from hit to hit in one go at one speed. The first one does not: it
    begins anywhere.
    """

    def __init__(self) -> None:
        self.odometer = 0.0
        """Metres sailed since the run began, or since the last counted leg ended."""
        self._at: tuple[float, float] | None = None
        self._leg_start: tuple[float, float, float] | None = None
        self._all = _Sum()

    def begin(self, x: float, y: float, now: float) -> None:
        """A run begins here: what is sailed until the first hit counts for the odometer only."""
        self._at = (x, y)
        self._leg_start = None

    def disqualify(self) -> None:
        """Speed or state changed: the running leg does not count."""
        self._leg_start = None

    def move(self, x: float, y: float) -> float:
        """The odometer with the vessel at (x, y)."""
        if self._at is not None:
            self.odometer += hypot(x - self._at[0], y - self._at[1])
        self._at = (x, y)
        return self.odometer

    def finish_leg(
        self, x: float, y: float, now: float, speed: float, head: str
    ) -> list[tuple[str, str | float]]:
        """A point was hit: what to post about the leg that ends, if it counts; the next leg begins."""
        start = self._leg_start
        sailed = self.odometer
        self._leg_start = (x, y, now)
        self.odometer = 0.0
        if start is None or speed <= 0.0:
            return []
        linear = hypot(x - start[0], y - start[1])
        leg = _Sum(linear, sailed, linear / speed, now - start[2])
        total = self._all
        total.linear += leg.linear
        total.sailed += leg.sailed
        total.ideal_time += leg.ideal_time
        total.time += leg.time
        return [
            ("WPT_EFF_SUMM_LEG", _summary(head, leg)),
            ("WPT_EFF_SUMM_ALL", _summary(head, total)),
            ("WPT_EFF_DIST_ALL", _ratio(total.linear, total.sailed)),
            ("WPT_EFF_TIME_ALL", _ratio(total.ideal_time, total.time)),
            ("WPT_EFF_DIST_LEG", _ratio(leg.linear, leg.sailed)),
            ("WPT_EFF_TIME_LEG", _ratio(leg.ideal_time, leg.time)),
        ]


def _ratio(part: float, whole: float) -> float:
    return part / whole if whole > 0.0 else 0.0


def _summary(head: str, leg: _Sum) -> str:
    return (
        f"{head},linear_dist={num(leg.linear, 1)},odo_dist={num(leg.sailed, 1)},"
        f"efficiency_dist={num(_ratio(leg.linear, leg.sailed), 3)},linear_time={num(leg.ideal_time, 1)},"
        f"odo_time={num(leg.time, 1)},efficiency_time={num(_ratio(leg.ideal_time, leg.time), 3)}"
    )
