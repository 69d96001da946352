"""BHV_Trail: keep a place relative to another vessel (behaviors.md C10)."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, hypot, radians, sin

from behaviors.pursuit import pursuit_function
from behaviors.steering import coupled, course_peak, speed_peak
from ivp_helm.contact_behavior import ContactBehavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter, ParameterError, parse_number
from pymoos_lite.geometry.angles import angle180, bearing, project_point
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.cpa import CpaEngine
from pymoos_lite.geometry.encounter import RelativeState
from pymoos_lite.geometry.shapes import Point
from pymoos_lite.geometry.specs import erase_point_text, point_text

SHORTEST = 10.0
"""Metres below which a modification never brings the trail range."""


def _angle(text: str) -> float:
    return angle180(parse_number(text))


def _change(name: str, doc: str) -> Parameter:
    return Parameter(name, "number", 0.0, "%" if name.endswith("pct") else "m", doc)


class Trail(ContactBehavior):
    """Goes to a point beside or behind the contact, and then goes as the contact goes."""

    BHV_NAME = "BHV_Trail"
    DEFAULT_NAME = "bhv_trail"
    PARAMETERS = Declaration(
        (
            Parameter("trail_range", "number", 50.0, "m", "Distance to keep from the contact.", low=0.0),
            _change("mod_trail_range", "Add this to trail_range, which stays at least 10."),
            _change("mod_trail_range_pct", "Take this percentage of trail_range, which stays at least 10."),
            Parameter(
                "trail_angle",
                "custom",
                180.0,
                "deg",
                "Where to be, clockwise from the contact's bow (or from north).",
                parse=_angle,
            ),
            Parameter(
                "trail_angle_type",
                "choice",
                "relative",
                "",
                "What trail_angle is measured from: the contact's bow or north.",
                choices=("relative", "absolute"),
            ),
            Parameter("radius", "number", 5.0, "m", "This near the point it is reached.", low=0.0),
            Parameter("nm_radius", "number", 20.0, "m", "This near the point speed is adapted.", low=0.0),
            Parameter(
                "pwt_outer_dist", "number", 0.0, "m", "Trail only contacts nearer than this; 0: any.", low=0.0
            ),
            Parameter("post_trail_dist_on_idle", "boolean", True, "", "Post TRAIL_DISTANCE while idle."),
            Parameter("no_alert_request", "boolean", True, "", "Do not ask the contact manager for alerts."),
            Parameter("can_disable", "boolean", False, "", "Obey BHV_ABLE_FILTER."),
        )
    )

    def setup(self) -> None:
        self._label = f"{self.community}_trailpoint"

    def set_mod_trail_range(self, metres: float) -> None:
        """Trail nearer or farther by so much."""
        vars(self.config)["trail_range"] = max(SHORTEST, self.config.trail_range + metres)

    def set_mod_trail_range_pct(self, percent: float) -> None:
        """Trail nearer or farther by this factor."""
        if not percent > 0.0:
            raise ParameterError(f"mod_trail_range_pct = {percent:g} is no percentage above 0")
        vars(self.config)["trail_range"] = max(SHORTEST, self.config.trail_range * percent / 100.0)

    def alert_ranges(self) -> tuple[float, float]:
        return self.config.pwt_outer_dist, self.config.pwt_outer_dist

    def trail_point(self, meeting: RelativeState) -> tuple[float, float]:
        """Where to be now, metres east and north."""
        angle = self.config.trail_angle
        if self.config.trail_angle_type == "relative":
            angle += meeting.cnh
        return project_point(angle, self.config.trail_range, meeting.cnx, meeting.cny)

    def on_idle(self) -> None:
        super().on_idle()
        if self.meeting is not None and self.config.post_trail_dist_on_idle:
            x, y = self.trail_point(self.meeting)
            self.post_int("TRAIL_DISTANCE", hypot(self.meeting.osx - x, self.meeting.osy - y))

    def on_run_to_idle(self) -> None:
        super().on_run_to_idle()
        if self.visuals:
            self.post("VIEW_POINT", erase_point_text(self._label))

    def decide(self, meeting: RelativeState) -> IvPFunction | None:
        config = self.config
        x, y = self.trail_point(meeting)
        away = hypot(meeting.osx - x, meeting.osy - y)
        if self.visuals:
            looks = Attributes(label=self._label, vertex_color="gray50", vertex_size=8.0, time=self.now)
            self.post("VIEW_POINT", point_text(Point(x, y, attributes=looks)))
        self.post_int("TRAIL_DISTANCE", away)
        limit = config.pwt_outer_dist
        if limit > 0.0:
            self.post_int("TRAIL_RANGE", meeting.range)
        self.relevance = 1.0 if limit <= 0.0 or meeting.range < limit else 0.0
        self.post("TRAIL_RELEVANCE", self.relevance, repeat=True)
        self.post("TRAIL_CTR", 1.0, repeat=True)
        self.post("PURSUIT", self.relevance)
        if self.relevance <= 0.0:
            self.why = f"{config.contact} is {meeting.range:.0f} m off, not within {limit:g} m"
            return None
        self.why = f"{away:.0f} m from its place {config.trail_range:g} m off {config.contact}"
        for region, beyond, function in self._regions():
            if away > beyond:
                self.post("REGION", region)
                return function(meeting, x, y)
        return None

    _Steer = Callable[[RelativeState, float, float], IvPFunction | None]

    def _regions(self) -> tuple[tuple[str, float, _Steer], ...]:
        """What to do beyond which distance from the point, farthest first."""
        return (
            ("Outside nm_radius", max(self.config.nm_radius, self.config.radius), self._pursue),
            ("Inside nm_radius", self.config.radius, self._close_up),
            ("Inside radius", -1.0, self._go_along),
        )

    def _pursue(self, meeting: RelativeState, x: float, y: float) -> IvPFunction | None:
        """Make for the point as it moves on with the contact."""
        engine = CpaEngine(x, y, meeting.cnh, meeting.cnv, meeting.osx, meeting.osy)
        plane = self.domain.subdomain(("course", "speed"))
        return pursuit_function(plane, engine, self.config.time_on_leg, 1.0)

    def _close_up(self, meeting: RelativeState, x: float, y: float) -> IvPFunction:
        """Steer for where the point will be, slower when ahead of it and faster when behind."""
        reach = self.config.nm_radius
        ahead_x, ahead_y = project_point(meeting.cnh, reach, x, y)
        heading = bearing(meeting.osx, meeting.osy, ahead_x, ahead_y)
        angle = radians(meeting.cnh)
        ahead = (meeting.osx - x) * sin(angle) + (meeting.osy - y) * cos(angle)
        speed = meeting.cnv * (1.0 - 0.5 * ahead / reach)
        if not self.config.extrapolate:
            speed = 0.0
        self.post_int("TRAIL_HEADING", heading)
        return self._steer(heading, max(0.0, speed))

    def _go_along(self, meeting: RelativeState, x: float, y: float) -> IvPFunction:
        """Go as the contact goes."""
        return self._steer(meeting.cnh, meeting.cnv)

    def _steer(self, heading: float, speed: float) -> IvPFunction:
        self.post("TRAIL_SPEED", speed)
        course = course_peak(self.domain, heading, 30.0, 150.0, 50.0)
        return coupled(course, speed_peak(self.domain, speed, 0.1, 2.0, 50.0))
