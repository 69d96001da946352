"""What moves a vessel beside its own thrust: a current, as a vector over ground (marine_apps.md 1.7)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pymoos_lite.geometry.angles import angle360, unit_vector
from pymoos_lite.records.csp import num, parse_number

MAX_DRIFT = 1000.0  # m/s; bounds what repeated scaling can do


@dataclass(frozen=True, slots=True)
class Drift:
    """Water moving to the east (x) and north (y), m/s.

    Raises ValueError when faster than `MAX_DRIFT`.
    """

    x: float = 0.0
    y: float = 0.0

    def __post_init__(self) -> None:
        if not math.hypot(self.x, self.y) <= MAX_DRIFT:
            raise ValueError(f"a drift of more than {MAX_DRIFT:g} m/s is not believed")

    @classmethod
    def toward(cls, heading: float, magnitude: float) -> Drift:
        """Water flowing to `heading` (degrees) with `magnitude` (m/s)."""
        east, north = unit_vector(heading)
        return cls(magnitude * east, magnitude * north)

    @classmethod
    def parse(cls, text: str) -> Drift:
        """`heading,magnitude`; raises ValueError for anything else."""
        numbers = [parse_number(part) for part in text.split(",")]
        if len(numbers) != 2 or numbers[0] is None or numbers[1] is None:
            raise ValueError("expected heading,magnitude")
        return cls.toward(numbers[0], numbers[1])

    def __add__(self, other: Drift) -> Drift:
        return Drift(self.x + other.x, self.y + other.y)

    def __mul__(self, factor: float) -> Drift:
        """Scaled in magnitude; a negative factor reverses it."""
        return Drift(self.x * factor, self.y * factor)

    def summary(self) -> str:
        """The text of USM_DRIFT_SUMMARY."""
        angle = angle360(math.degrees(math.atan2(self.x, self.y))) if self.x or self.y else 0.0
        magnitude = math.hypot(self.x, self.y)
        return f"ang={num(angle)}, mag={num(magnitude)}, xmag={num(self.x, 3)}, ymag={num(self.y, 3)}"
