"""How fast the wind drives a vessel: the polar plot and the wind of the simulator (marine_apps.md 1.8)."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass

from pymoos_lite.geometry.angles import angle180, angle360
from pymoos_lite.records.csp import fields, parse_number


@dataclass(frozen=True, slots=True)
class Wind:
    """Wind speed in m/s and the direction it comes from, degrees."""

    speed: float
    direction: float


@dataclass(frozen=True, slots=True)
class PolarPlot:
    """Boat speed as a percentage of wind speed, by the angle off the wind (0..180 degrees, sorted)."""

    points: tuple[tuple[float, float], ...]

    def percentage(self, off_wind: float) -> float:
        """Interpolated at whole degrees, flat beyond the outermost points; both sides are alike."""
        angle = float(round(abs(angle180(off_wind))))
        points = self.points
        index = bisect_left(points, (angle, float("-inf")))
        if index == len(points):
            return points[-1][1]
        right_angle, right = points[index]
        if index == 0 or right_angle == angle:
            return right
        left_angle, left = points[index - 1]
        return left + (right - left) * (angle - left_angle) / (right_angle - left_angle)


def sail_speed(polar: PolarPlot, wind: Wind, heading: float) -> float:
    """The speed in m/s that the wind allows on `heading`; never more than the wind's own."""
    return min(1.0, polar.percentage(heading - wind.direction) / 100.0) * wind.speed


def parse_wind(text: str) -> Wind:
    """`spd=4, dir=180`; raises ValueError unless both are there and the speed is not negative."""
    numbers: dict[str, float] = {}
    for key, value in fields(text):
        number = parse_number(value)
        if key.lower() not in ("spd", "dir") or number is None:
            raise ValueError(f"expected spd=m/s, dir=deg, found '{key}={value}'")
        numbers[key.lower()] = number
    if len(numbers) != 2 or numbers["spd"] < 0.0:
        raise ValueError("wind needs spd (not negative) and dir")
    return Wind(numbers["spd"], angle360(numbers["dir"]))


def parse_polar(text: str) -> PolarPlot:
    """`hdg,pct: hdg,pct: ...`; raises ValueError for an angle off 0..180 or repeated, or a negative share."""
    points: dict[float, float] = {}
    for pair in text.split(":"):
        angle_text, comma, share_text = pair.partition(",")
        angle, share = parse_number(angle_text), parse_number(share_text)
        if not comma or angle is None or share is None:
            raise ValueError(f"expected hdg,pct: hdg,pct, found '{pair.strip()}'")
        if not 0.0 <= angle <= 180.0 or share < 0.0:
            raise ValueError(f"'{pair.strip()}': the angle must be in 0..180 and the percentage not negative")
        if angle in points:
            raise ValueError(f"angle {angle:g} is given twice")
        points[angle] = share
    return PolarPlot(tuple(sorted(points.items())))
