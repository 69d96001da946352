"""BHV_Shadow: take the course and speed of another vessel (behaviors.md C12)."""

from __future__ import annotations

from behaviors.steering import coupled, course_peak, speed_peak
from ivp_helm.contact_behavior import ContactBehavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.geometry.encounter import RelativeState


def _width(name: str, alias: str, default: float, unit: str, doc: str) -> Parameter:
    return Parameter(name, "number", default, unit, doc, low=0.0, aliases=(alias,))


class Shadow(ContactBehavior):
    """Goes as the contact goes, wherever it is."""

    BHV_NAME = "BHV_Shadow"
    DEFAULT_NAME = "bhv_shadow"
    ALERTS = False
    PARAMETERS = Declaration(
        (
            Parameter(
                "pwt_outer_dist", "number", 0.0, "m", "Only contacts nearer than this; 0: any.", low=0.0
            ),
            _width("heading_peakwidth", "hdg_peakwidth", 20.0, "deg", "Half width of the course's summit."),
            _width("heading_basewidth", "hdg_basewidth", 160.0, "deg", "Width of each of its flanks."),
            _width("speed_peakwidth", "spd_peakwidth", 0.1, "m/s", "Half width of the speed's summit."),
            _width("speed_basewidth", "spd_basewidth", 2.0, "m/s", "Width of each of its flanks."),
        )
    )

    def decide(self, meeting: RelativeState) -> IvPFunction | None:
        config = self.config
        limit = config.pwt_outer_dist
        self.relevance = 1.0 if limit <= 0.0 or meeting.range < limit else 0.0
        self.why = f"{config.contact}, {meeting.range:.0f} m off, goes {meeting.cnh:.0f} deg at {meeting.cnv:.1f} m/s"
        self.post_int("SHADOW_CONTACT_X", meeting.cnx)
        self.post_int("SHADOW_CONTACT_Y", meeting.cny)
        self.post_int("SHADOW_CONTACT_SPEED", meeting.cnv)
        self.post_int("SHADOW_CONTACT_HEADING", meeting.cnh)
        self.post("SHADOW_RELEVANCE", self.relevance)
        if self.relevance <= 0.0:
            return None
        course = course_peak(
            self.domain, meeting.cnh, config.heading_peakwidth, config.heading_basewidth, 50.0
        )
        speed = speed_peak(self.domain, meeting.cnv, config.speed_peakwidth, config.speed_basewidth, 10.0)
        return coupled(course, speed)
