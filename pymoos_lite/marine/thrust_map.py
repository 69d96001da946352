"""How fast a vessel goes for a given thrust: the piecewise linear map of `thrust_map = 20:1, 100:5`.

Thrust runs from -100 to 100 (per cent), speed is in m/s. Positive and negative thrust have maps of
their own, both anchored at (0, 0). Source: marine_apps.md 1.3.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass, replace
from itertools import pairwise

DEFAULT_THRUST_FACTOR = 20.0


@dataclass(frozen=True, slots=True)
class ThrustMap:
    """Steady speed for each thrust.

    `positive` and `negative` hold (thrust, speed) pairs sorted by thrust, without the implied (0, 0).
    `factor` gives speed = thrust / factor while there is no positive pair; 0 means no speed at all.
    `reflect` lets negative thrust mirror the positive map while there is no negative pair.
    """

    positive: tuple[tuple[float, float], ...] = ()
    negative: tuple[tuple[float, float], ...] = ()
    factor: float = DEFAULT_THRUST_FACTOR
    reflect: bool = False

    def speed(self, thrust: float) -> float:
        """Speed in m/s that `thrust` sustains; flat beyond the outermost pairs, never extrapolated."""
        if thrust > 0.0:
            if not self.positive:
                return thrust / self.factor if self.factor else 0.0
            return _interpolate(self.positive, thrust)
        if thrust < 0.0:
            if self.negative:
                return -_interpolate(tuple((-t, -s) for t, s in reversed(self.negative)), -thrust)
            return -self.speed(-thrust) if self.reflect else 0.0
        return 0.0

    def with_pair(self, thrust: float, speed: float) -> ThrustMap:
        """The map with one more pair. Raises ValueError if the pair is out of range or makes the speed
        fall while the thrust rises; `0:0` is legal and changes nothing."""
        if not (math.isfinite(thrust) and math.isfinite(speed) and -100.0 <= thrust <= 100.0):
            raise ValueError(f"thrust {thrust:g} is outside -100..100")
        if thrust == 0.0:
            if speed != 0.0:
                raise ValueError(f"thrust 0 must map to speed 0, not {speed:g}")
            return self
        if (thrust > 0.0 > speed) or (thrust < 0.0 < speed):
            raise ValueError(f"thrust {thrust:g} and speed {speed:g} have opposite signs")
        side = dict(self.positive if thrust > 0.0 else self.negative)
        side[thrust] = speed
        pairs = tuple(sorted(side.items()))
        if any(later < earlier for (_, earlier), (_, later) in pairwise(pairs)):
            raise ValueError(f"pair {thrust:g}:{speed:g} makes the speed fall while the thrust rises")
        return replace(self, positive=pairs) if thrust > 0.0 else replace(self, negative=pairs)


def parse_thrust_map(text: str, base: ThrustMap | None = None) -> tuple[ThrustMap, str | None]:
    """Read `thrust:speed, thrust:speed, ...` on top of the factor and reflection of `base`.

    Returns the map and, if a pair is bad, one line that says which and why. Pairs before a bad one
    stay, those after it are ignored, as MOOS-IvP users expect from uSimMarineV22.
    """
    base = base or ThrustMap()
    result = ThrustMap(factor=base.factor, reflect=base.reflect)
    if not text.strip():
        return result, "thrust_map is empty; expected pairs such as 20:1, 100:5"
    for element in text.split(","):
        thrust_text, colon, speed_text = element.partition(":")
        try:
            if not colon:
                raise ValueError("expected thrust:speed")
            result = result.with_pair(float(thrust_text), float(speed_text))
        except ValueError as error:
            return result, f"thrust_map pair '{element.strip()}' rejected: {error}"
    return result, None


def _interpolate(pairs: tuple[tuple[float, float], ...], thrust: float) -> float:
    index = bisect_left(pairs, (thrust, -math.inf))
    if index == len(pairs):
        return pairs[-1][1]
    right_thrust, right_speed = pairs[index]
    left_thrust, left_speed = pairs[index - 1] if index else (0.0, 0.0)
    share = (thrust - left_thrust) / (right_thrust - left_thrust)
    return left_speed + (right_speed - left_speed) * share
