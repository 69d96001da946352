"""BHV_AbortToPoint: make for a point, whatever else (behaviors.md C26)."""

from __future__ import annotations

from collections.abc import Iterable
from math import hypot

from behaviors import forms
from behaviors.steering import coupled, course_peak, speed_peak
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.geometry.angles import bearing

KINDS = {"zaic": "zaic", "roc": "roc", "rate_of_closure": "roc"}


def _kind(text: str) -> str:
    kind = KINDS.get(text.strip().lower())
    if kind is None:
        raise ValueError(f"expected one of {', '.join(KINDS)}")
    return kind


class AbortToPoint(Behavior):
    """Steers for a point at a speed, and goes on doing so on getting there: it never completes."""

    BHV_NAME = "BHV_AbortToPoint"
    DEFAULT_NAME = "bhv_abort_to_point"
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED")
    PARAMETERS = Declaration(
        (
            forms.point("point", "The point to make for; required."),
            forms.number("speed", 0.0, "m/s", "Speed to go at; required.", open_low=True),
            Parameter("radius", "number", 25.0, "m", "Accepted; without effect.", low=0.0),
            Parameter("nm_radius", "number", 200.0, "m", "Accepted; without effect.", low=0.0),
            forms.custom("ipf_type", _kind, "zaic", "Shape of the function.", "zaic", aliases=("ipf-type",)),
        )
    )

    def check(self) -> Iterable[str]:
        if self.config.point is None:
            yield "no point is given"
        if not self.config.speed > 0.0:
            yield "speed must be above 0"

    def on_run(self) -> IvPFunction | None:
        own, point = self.own, self.config.point
        if point is None:
            self.warn("no point is given")
            return None
        course = bearing(own.x, own.y, point.x, point.y)
        speed = min(self.config.speed, self.max_speed)
        self.why = f"{hypot(own.x - point.x, own.y - point.y):.0f} m to the point of retreat"
        if self.config.ipf_type == "roc":
            from behaviors.closing_rate import closing_rate_function

            return closing_rate_function(self.domain, course, speed, self.config.build_info)
        return coupled(
            course_peak(self.domain, course, 0.0, 180.0, 50.0), speed_peak(self.domain, speed, 0.0, 2.6)
        )
