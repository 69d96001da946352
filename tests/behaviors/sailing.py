"""A vessel on the bench that follows its helm's decisions: turns at a limited rate, takes up speed at once."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, hypot, radians, sin
from typing import Any

from ivp_helm.testing import HelmRig


class Sailor:
    """Own ship at a rig's helm. `turn_rate` is in degrees per second; all-stop means speed 0."""

    def __init__(
        self,
        rig: HelmRig,
        x: float = 0.0,
        y: float = 0.0,
        heading: float = 0.0,
        speed: float = 0.0,
        turn_rate: float = 40.0,
        dive_rate: float = 1.0,
    ) -> None:
        self.rig = rig
        self.x, self.y, self.heading, self.speed, self.depth = x, y, heading, speed, 0.0
        self.turn_rate = turn_rate
        self.dive_rate = dive_rate
        self.track: list[tuple[float, float]] = []
        self.rig.own(x, y, heading, speed, 0.0)

    def sail(self, seconds: float, until: Callable[[Sailor], Any] | None = None) -> bool:
        """Iterate for so long, or until something holds; True if it came to hold."""
        for _ in range(round(seconds / self.rig.period)):
            self.rig.own(self.x, self.y, self.heading, self.speed, self.depth)
            self.rig.iterate()
            self._follow(self.rig.decision, self.rig.period)
            self.track.append((self.x, self.y))
            if until is not None and until(self):
                return True
        return False

    def _follow(self, decision: dict[str, float], seconds: float) -> None:
        self.speed = decision.get("speed", 0.0)
        off = (decision.get("course", self.heading) - self.heading + 180.0) % 360.0 - 180.0
        most = self.turn_rate * seconds
        self.heading = (self.heading + max(-most, min(most, off))) % 360.0
        self.x += self.speed * seconds * sin(radians(self.heading))
        self.y += self.speed * seconds * cos(radians(self.heading))
        down = decision.get("depth", self.depth) - self.depth
        self.depth += max(-self.dive_rate * seconds, min(self.dive_rate * seconds, down))

    def distance_to(self, x: float, y: float) -> float:
        return hypot(self.x - x, self.y - y)
