"""The race track of BHV_LegRun: two points, and a way to turn about beyond each of them (behaviors.md C17).

Immutable geometry; every change gives a new course. Metres and degrees, angle = bearing from p1 to p2.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import hypot

from pymoos_lite.geometry.angles import angle360, bearing, project_point
from pymoos_lite.geometry.shapes import XY
from pymoos_lite.geometry.turn_paths import williamson

LEAST_LENGTH = 1.0


@dataclass(frozen=True, slots=True)
class TurnShape:
    """How to turn about: radius in metres (0: not given), bias in percent, extension in metres, and side."""

    radius: float = 0.0
    bias: float = 0.0
    extension: float = 0.0
    port: bool = True

    def with_value(self, quantity: str, value: float, relative: bool, least_radius: float) -> TurnShape:
        """One quantity set or changed, held to its range."""
        if relative:
            value += getattr(self, quantity)
        if quantity == "bias":
            return replace(self, bias=min(max(value, -100.0), 100.0))
        if quantity == "extension":
            return replace(self, extension=max(value, 0.0))
        return replace(self, radius=max(value, least_radius))


@dataclass(frozen=True)
class LegCourse:
    """Leg 1 leads to p1, where turn 1 is sailed; leg 2 leads to p2, where turn 2 is."""

    p1: XY
    p2: XY
    turn1: TurnShape = field(default_factory=TurnShape)
    turn2: TurnShape = field(default_factory=TurnShape)
    point_gap: float = 20.0

    @classmethod
    def about(cls, x: float, y: float, angle: float, length: float) -> LegCourse:
        """By its centre."""
        half = length / 2.0
        return cls(project_point(angle + 180.0, half, x, y), project_point(angle, half, x, y))

    @property
    def center(self) -> XY:
        """Half way between the points."""
        return (self.p1[0] + self.p2[0]) / 2.0, (self.p1[1] + self.p2[1]) / 2.0

    @property
    def angle(self) -> float:
        """Bearing of p2 from p1."""
        return bearing(*self.p1, *self.p2)

    @property
    def length(self) -> float:
        """Metres between the points."""
        return hypot(self.p2[0] - self.p1[0], self.p2[1] - self.p1[1])

    def moved(
        self, center: XY | None = None, angle: float | None = None, length: float | None = None
    ) -> LegCourse:
        """The same legs elsewhere, in another direction or of another length."""
        x, y = self.center if center is None else center
        new = LegCourse.about(
            x,
            y,
            self.angle if angle is None else angle360(angle),
            max(self.length if length is None else length, LEAST_LENGTH),
        )
        return replace(self, p1=new.p1, p2=new.p2)

    @property
    def is_complete(self) -> bool:
        """Whether it can be sailed: two different points, and a radius for each turn."""
        return self.p1 != self.p2 and self.turn1.radius > 0.0 and self.turn2.radius > 0.0

    @cached_property
    def path1(self) -> tuple[XY, ...]:
        """Vertices of turn 1, from p1 back to p1."""
        return self._path(self.p1, bearing(*self.p2, *self.p1), self.turn1)

    @cached_property
    def path2(self) -> tuple[XY, ...]:
        """Vertices of turn 2, from p2 back to p2."""
        return self._path(self.p2, self.angle, self.turn2)

    def _path(self, end: XY, heading: float, turn: TurnShape) -> tuple[XY, ...]:
        return tuple(
            williamson(
                *end,
                heading,
                turn.radius,
                port=turn.port,
                extension=turn.extension,
                bias=turn.bias,
                point_gap=self.point_gap,
            )
        )
