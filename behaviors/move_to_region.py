"""BHV_MoveToRegion: go into a region by the shortest way (gcid.md 15)."""

from __future__ import annotations

from behaviors import forms
from behaviors.steering import coupled, course_peak
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction, zaic_spd
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.geometry.angles import bearing
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.shapes import Point
from pymoos_lite.geometry.specs import erase_point_text, point_text

LOW, ABOVE = 0.1, 0.4
LOW_UTIL, HIGH_UTIL = 85.0, 20.0
STALE = "no position for more than {:g} s"


class MoveToRegion(Behavior):
    """Heads for the nearest point of a region's boundary; complete as soon as the vessel is inside."""

    BHV_NAME = "BHV_MoveToRegion"
    DEFAULT_NAME = "bhv_move_to_region"
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED")
    PARAMETERS = Declaration(
        (
            forms.polygon("region", "Where to go; convex.", "polygon"),
            forms.number("speed", 0.0, "m/s", "Speed on the way."),
            Parameter("patience", "number", 80.0, "", "Weight of course against speed.", low=1.0, high=99.0, clip=True),
            forms.number("stale_nav_thresh", 2.0, "s", "Age of the position at which it gives up."),
            Parameter("setpt_viewable", "boolean", True, "", "Draw the point it heads for."),
            Parameter("label", "text", "", "", "A name for the region, for people."),
            forms.hint_lines("vertex_color=red"),
        ),
        ignored=("visual_hints",),
    )  # fmt: skip

    def on_run(self) -> IvPFunction | None:
        config, own, region = self.config, self.own, self.config.region
        if region is None:
            self.why = "there is no region"
            self.warn("region is not set")
            return None
        self.retract_warning("region is not set")
        stale = STALE.format(config.stale_nav_thresh)
        if (self.buffer.age("NAV_X") or 0.0) > config.stale_nav_thresh:
            self.warn(stale)
            return None
        self.retract_warning(stale)
        if region.contains(own.x, own.y):
            self.why = "inside the region"
            self._erase()
            self.complete("in the region")
            return None
        x, y = region.nearest_point(own.x, own.y)
        self.why = f"{region.dist(own.x, own.y):.0f} m to go"
        if self.visuals and config.setpt_viewable:
            label = Attributes(label=self._label, vertex_color="red", vertex_size=4.0)
            self.post("VIEW_POINT", point_text(Point(x, y, attributes=label)))
        speed = zaic_spd(self.domain, "speed", config.speed, LOW, config.speed + ABOVE, LOW_UTIL, HIGH_UTIL)
        course = course_peak(self.domain, bearing(own.x, own.y, x, y))
        return coupled(course, speed, config.patience, 100.0 - config.patience)

    def on_run_to_idle(self) -> None:
        self._erase()

    @property
    def _label(self) -> str:
        return f"{self.community}:{self.name}:setpt"

    def _erase(self) -> None:
        if self.visuals and self.config.setpt_viewable:
            self.post("VIEW_POINT", erase_point_text(self._label))
