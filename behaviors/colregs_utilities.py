"""How good every course and speed is under each rule of the road (behaviors.md C7).

All take the utility of the closest approach (0 to 100 by course and speed) as `base` where they build on it,
and return tables of that shape, which they may write into.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ivp_helm.ivp import Domain, IvPFunction, couple, zaic_hdg, zaic_spd
from pymoos_lite.geometry.encounter import RelativeState

Array = NDArray[np.float64]

NEAR_OVERTAKING = 15.0
"""Utility of the smallest closest approach that is allowed while overtaking."""


def overtaking(
    m: RelativeState, courses: Array, speeds: Array, cpa: Array, near: float, far: float, port: bool
) -> Array:
    """Pass on the chosen side of the contact."""
    share = (cpa - near) / (far - near) if far > near else np.ones_like(cpa)
    utility = np.where(
        cpa < near, 0.0, np.where(cpa > far, 100.0, NEAR_OVERTAKING + (100.0 - NEAR_OVERTAKING) * share)
    )
    engine = m.engine
    wrong = engine.passes_star_grid(courses, speeds) if port else engine.passes_port_grid(courses, speeds)
    wrong[:, speeds == 0.0] = False
    utility[wrong] = 0.0
    return utility


def headon(m: RelativeState, courses: Array, speeds: Array, base: Array) -> Array:
    """Pass port to port, the more clearly the better."""
    engine = m.engine
    if m.os_port_of_cn:
        base[engine.crosses_bow_grid(courses, speeds)] = -np.inf
    base[engine.passes_star_grid(courses, speeds)] = -np.inf
    drawing = engine.bearing_rate_grid(courses, speeds)
    # As the bearing would change if both went at the contact's speed across the line between them.
    least = -2.0 * m.cnv * 360.0 / (2.0 * math.pi * m.range) if m.range > 0.0 else 0.0
    if least < 0.0:
        base += np.clip(drawing / least, 0.0, 1.0) * 100.0
    return np.maximum(base, 0.0)


def giveway_stern(m: RelativeState, courses: Array, speeds: Array, base: Array, port_turns: bool) -> Array:
    """Pass astern of the contact, turning to starboard unless port turns are as good."""
    engine = m.engine
    turn = np.mod(courses - m.osh, 360.0)
    astern = engine.crosses_stern_grid(courses, speeds)
    if port_turns:
        starboard = (turn > 0.0) & (turn < 180.0)
        base[engine.crosses_bow_grid(courses, speeds)] = 0.0
        base[~starboard[:, None] & ~astern] = 0.0
    else:
        base[~astern | (turn > 180.0)[:, None]] = 0.0
    return base


def giveway_bow(m: RelativeState, courses: Array, speeds: Array, base: Array) -> Array:
    """Pass ahead of the contact: starboard turns only if they do so."""
    turn = np.mod(courses - m.osh, 360.0)
    starboard = (turn > 0.0) & (turn < 180.0)
    base[starboard[:, None] & ~m.engine.crosses_bow_grid(courses, speeds)] = 0.0
    return base


def stand_on(domain: Domain, heading: float, speed: float) -> IvPFunction:
    """Keep course and speed."""
    keep_speed = zaic_spd(domain, "speed", speed, 0.1, speed + 0.4, 50.0, 50.0)
    keep_course = zaic_hdg(domain, "course", heading, 20.0, 20.0, 25.0, 25.0)
    return couple(keep_course, keep_speed)
