"""Functions that many behaviours share: go there, at that speed (behaviors.md B3).

Every builder remembers what it built last: asked again for the same numbers it returns the very same
function, which tells the helm that nothing changed. Functions are immutable, so behaviours may share them.
Courses are degrees clockwise from north, speeds m/s.
"""

from __future__ import annotations

from functools import lru_cache

from ivp_helm.ivp import CoupledPeak, Domain, IvPFunction, Peak, couple, zaic_leq, zaic_peak, zaic_spd
from pymoos_lite.geometry.angles import angle360

_REMEMBERED = 256


@lru_cache(maxsize=_REMEMBERED)
def course_peak(
    domain: Domain, course: float, peakwidth: float = 0.0, basewidth: float = 180.0, delta: float = 0.0
) -> IvPFunction:
    """A preference for one course, wrapped at north."""
    return zaic_peak(domain, "course", Peak(course, peakwidth, basewidth, delta), wrap=True)


@lru_cache(maxsize=_REMEMBERED)
def speed_peak(
    domain: Domain,
    speed: float,
    peakwidth: float,
    basewidth: float,
    delta: float = 0.0,
    top: float = 100.0,
) -> IvPFunction:
    """A preference for one speed, the less the further from it."""
    return zaic_peak(domain, "speed", Peak(speed, peakwidth, basewidth, delta, 0.0, top))


@lru_cache(maxsize=_REMEMBERED)
def speed_band(domain: Domain, speed: float, low_util: float, high_util: float) -> IvPFunction:
    """A preference for one speed with `low_util` left near standstill and `high_util` 0.4 m/s above it."""
    return zaic_spd(domain, "speed", speed, 0.1, speed + 0.4, low_util, high_util)


@lru_cache(maxsize=_REMEMBERED)
def depth_peak(
    domain: Domain, depth: float, peakwidth: float, basewidth: float, delta: float = 0.0
) -> IvPFunction:
    """A preference for one depth."""
    return zaic_peak(domain, "depth", Peak(depth, peakwidth, basewidth, delta))


@lru_cache(maxsize=_REMEMBERED)
def at_most(domain: Domain, variable: str, limit: float, basewidth: float) -> IvPFunction:
    """All values up to a limit are as good; beyond it they lose all utility over `basewidth`."""
    return zaic_leq(domain, variable, limit, basewidth)


@lru_cache(maxsize=_REMEMBERED)
def coupled(
    first: IvPFunction, second: IvPFunction, first_weight: float = 50.0, second_weight: float = 50.0
) -> IvPFunction:
    """Both preferences in one function; the two arguments are told apart by identity."""
    return couple(first, second, first_weight, second_weight)


@lru_cache(maxsize=_REMEMBERED)
def toward(
    domain: Domain,
    course: float,
    preference: IvPFunction,
    course_weight: float = 50.0,
    preference_weight: float = 50.0,
) -> IvPFunction:
    """`coupled` of `course_peak` and another preference: what most behaviours want, made in one step.

    Quick for a preference that stays the same; for one that is new every time take `coupled`.
    """
    return _toward(domain, preference, course_weight, preference_weight).at(course)


@lru_cache(maxsize=_REMEMBERED)
def _toward(
    domain: Domain, preference: IvPFunction, course_weight: float, preference_weight: float
) -> CoupledPeak:
    peak = Peak(0.0, 0.0, 180.0)
    return CoupledPeak(domain, "course", peak, preference, course_weight, preference_weight, wrap=True)


def on_grid(domain: Domain, course: float) -> float:
    """The course of the domain nearest to `course`, across north if that is nearer."""
    variable = domain["course"]
    wrapped = angle360(course - variable.low) + variable.low
    circle = variable.low + 360.0
    if wrapped > variable.high and circle - wrapped < wrapped - variable.high:
        return variable.low
    return variable.snap(wrapped)
