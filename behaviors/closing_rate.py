"""The closing-rate function of BHV_Waypoint and relatives: make way toward a bearing (behaviors.md C1, roc)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ivp_helm.ivp import Build, Domain, IvPFunction, reflect

BUILD = Build(uniform_amount=600, smart_amount=500)
Array = NDArray[np.float64]


def closing_rate(course: Array, speed: Array, bearing: float, wanted: float, top: float) -> Array:
    """Utility of courses and speeds (arrays of one length) for closing at `wanted` m/s on `bearing` degrees.

    80 % of it is how near the speed made good is to the one wanted (too fast counts half), 20 % how little
    way is made off the bearing. `top` is the highest speed of the domain.
    """
    off = np.abs((course - bearing + 180.0) % 360.0 - 180.0)
    short = wanted - np.cos(np.radians(off)) * speed
    short = np.minimum(np.where(short < 0.0, -short / 2.0, short), 2.0 * top)
    made_good = 100.0 * (1.0 - short / (2.0 * top))
    detour = 100.0 * (1.0 - off * speed / (180.0 * top))
    utility: Array = 0.8 * made_good + 0.2 * detour
    return utility


def closing_rate_function(domain: Domain, bearing: float, wanted: float, build_info: str = "") -> IvPFunction:
    """That utility as pieces over course and speed, stretched to 0..100."""
    part = domain.subdomain(("course", "speed"))
    top = part["speed"].high

    def underlying(course: Array, speed: Array) -> Array:
        return closing_rate(course, speed, bearing, wanted, top)

    return reflect(part, underlying, build_info, build=BUILD)
