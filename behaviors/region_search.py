"""BHV_SearchControl: keep moving inside a region, round its middle or in random legs (gcid.md 14)."""

from __future__ import annotations

from math import atan2, degrees, hypot

from mypy_extensions import mypyc_attr

from behaviors import forms
from behaviors.steering import speed_peak, toward
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.geometry.angles import angle360, bearing, project_point
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.shapes import XY

BASE_WIDTH, SUMMIT_DELTA = 1.6, 20.0
RING = 0.8
"""Radius of the circle, as a share of the distance from the middle to the nearest edge."""
PULL = 200.0
"""Degrees by which the course turns in for each radius of distance outside the circle."""
MODES = (
    "rotate",
    "stochastic",
    "stochastic_free",
    "rotate_speed",
    "stochastic_speed",
    "stochastic_free_speed",
)


def edge_distance(region: Polygon) -> float:
    """The smallest distance, in metres, from a convex region's middle to the line of one of its edges."""
    x, y = region.center
    return min(abs(nx * x + ny * y - c) for nx, ny, c in region.half_planes)


def rotate_course(x: float, y: float, center: XY, radius: float) -> float:
    """Course, degrees, of a vessel at (x, y) that circles `center` clockwise at `radius` metres.

    Outside the circle it turns in, by up to a right angle; inside it heads straight out.
    """
    dx, dy = x - center[0], y - center[1]
    tangent = degrees(atan2(dy, -dx)) % 360.0
    distance = hypot(dx, dy)
    if distance >= radius:
        return angle360(tangent + min(90.0, PULL * (distance - radius) / radius))
    return angle360(tangent - 90.0)


@mypyc_attr(allow_interpreted_subclasses=True)
class SearchControl(Behavior):
    """Moves about in a region; with a `_speed` mode, random legs get random speeds of 1, 2 .. `speed_max`."""

    BHV_NAME = "BHV_SearchControl"
    DEFAULT_NAME = "bhv_search_control"
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED")
    PARAMETERS = Declaration(
        (
            forms.polygon("op_region", "The region; convex."),
            forms.number("speed", 0.0, "m/s", "Speed."),
            forms.number("speed_max", 3.0, "m/s", "Highest random speed, a whole number.", low=1.0),
            Parameter("mode", "choice", "rotate", "", "How to move.", choices=MODES),
            forms.hint_lines("edge_color=white"),
        ),
        ignored=("spin_rad", "random_number", "visual_hints", "stale_nav_thresh"),
    )

    def setup(self) -> None:
        self._course: float | None = None
        self._speed: float | None = None
        self._homing = False

    def on_parameters(self) -> None:
        self._homing = False

    def on_run_to_idle(self) -> None:
        self._course = None
        self._homing = False

    def on_run(self) -> IvPFunction | None:
        region = self.config.op_region
        if region is None:
            self.why = "there is no region"
            self.warn("op_region is not set")
            return None
        self.retract_warning("op_region is not set")
        mode = self.config.mode.removesuffix("_speed")
        own = self.own
        if mode == "rotate":
            course = rotate_course(own.x, own.y, region.center, RING * edge_distance(region))
        elif mode == "stochastic":
            course = self._legs_through_the_middle(region)
        else:
            course = self._free_legs(region)
        speed = self._speed if self.config.mode.endswith("_speed") and self._speed else self.config.speed
        self.why = f"{self.config.mode}, course {course:.0f}"
        width = speed / (2.0 if mode == "rotate" else 4.0)
        return toward(self.domain, course, speed_peak(self.domain, speed, width, BASE_WIDTH, SUMMIT_DELTA))

    # --- random legs --------------------------------------------------------------------------------------

    def _new_leg(self) -> float:
        chance = self.surroundings.random
        self._course = chance.uniform(0.0, 360.0)
        self._speed = float(chance.randint(1, max(1, int(self.config.speed_max))))
        return self._course

    def _ahead(self, course: float, seconds: float) -> XY:
        own = self.own
        return project_point(course, seconds * max(own.speed, self.config.speed), own.x, own.y)

    def _legs_through_the_middle(self, region: Polygon) -> float:
        """Straight on until the region would be left, then to the middle, then any way."""
        own, (x, y) = self.own, region.center
        if self._course is None:
            self._new_leg()
        assert self._course is not None
        if self._homing and hypot(own.x - x, own.y - y) <= max(4.0, 0.2 * edge_distance(region)):
            self._homing = False
            self._new_leg()
        elif not self._homing and not region.contains(*self._ahead(self._course, 5.0)):
            self._homing = True
        return bearing(own.x, own.y, x, y) if self._homing else self._course

    def _free_legs(self, region: Polygon) -> float:
        """Straight on until the region would be left, then any way; in need, to the middle."""
        own = self.own
        if self._course is None or not region.contains(*self._ahead(self._course, 10.0)):
            self._new_leg()
        assert self._course is not None
        if not region.contains(*self._ahead(self._course, 2.0)):
            return bearing(own.x, own.y, *region.center)
        return self._course
