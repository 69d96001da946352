"""BHV_RStationKeep: keep a place beside another vessel (behaviors.md C26)."""

from __future__ import annotations

from collections.abc import Iterable
from math import hypot

from behaviors import forms
from behaviors.station import Radii
from behaviors.station_keep import radii_parameters
from behaviors.steering import coupled, course_peak, speed_peak
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter, parse_number
from pymoos_lite.geometry.angles import angle360, bearing, project_point
from pymoos_lite.geometry.shapes import XY
from pymoos_lite.geometry.text import fix, num, split_protected

Place = tuple[float, float]
"""Range in metres and angle in degrees off the contact's heading."""


def _position(text: str) -> Place | None:
    """None for ``present_position``."""
    if text.strip().lower() == "present_position":
        return None
    pieces = split_protected(text, ",")
    if len(pieces) != 2:
        raise ValueError("give range,angle or present_position")
    distance, angle = parse_number(pieces[0]), parse_number(pieces[1])
    if distance < 0.0:
        raise ValueError("the range must be at least 0")
    return distance, angle360(angle)


class RStationKeep(Behavior):
    """Keeps a place at a range and angle off another vessel's heading; has no opinion close to it.

    It follows the contact by the variables CONTACT_NAV_X and so on, not by node reports.
    """

    BHV_NAME = "BHV_RStationKeep"
    DEFAULT_NAME = "bhv_rstation_keep"
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED")
    PARAMETERS = Declaration(
        (
            forms.custom(
                "rstation_position",
                _position,
                (0.0, 0.0),
                "Range and angle off the contact's heading, or present_position.",
                "20,180",
            ),
            forms.custom(
                "contact", lambda text: text.strip().upper(), "", "The other vessel.", aliases=("them",)
            ),
            Parameter("center_activate", "boolean", False, "", "Keep the place it has on starting to run."),
            *radii_parameters(25.0, 5.0, 1.4, 2.0),
        )
    )

    def setup(self) -> None:
        self._place: Place | None = (0.0, 0.0)
        self._station: XY = (0.0, 0.0)
        self._seen = False

    def set_rstation_position(self, place: Place | None) -> None:
        vars(self.config)["rstation_position"] = place
        self._place = place

    def check(self) -> Iterable[str]:
        if not self.config.contact:
            yield "no contact is given"

    def on_parameters(self) -> None:
        self.watch(*(f"{self.config.contact}_NAV_{what}" for what in ("X", "Y", "SPEED", "HEADING")))

    def lost_its_contact(self) -> bool:
        return False

    def on_idle_to_run(self) -> None:
        if self.config.center_activate:
            self._place = None

    def on_idle(self) -> None:
        if not self.visuals:
            return
        label = f"{self.community}_rstation"
        if not self._seen and self._place is not None:
            self._station = project_point(self._place[1], self._place[0], 0.0, 0.0)
        x, y = self._station
        self.post("RSTATION_CIRCLE", f"{fix(x, 1)},{fix(y, 1)},0,{label}")
        self.post("RVIEW_POINT", f"x=0,y=0,label={label},type=rstation, active=false")

    def on_run(self) -> IvPFunction | None:
        config, own = self.config, self.own
        name = config.contact
        x, y = self.number(f"{name}_NAV_X"), self.number(f"{name}_NAV_Y")
        heading = self.number(f"{name}_NAV_HEADING")
        if x is None or y is None or heading is None:
            self.why = f"nothing is known of {name}"
            return None
        self._seen = True
        if self._place is None:
            angle = bearing(x, y, own.x, own.y) - heading
            self._place = hypot(own.x - x, own.y - y), angle360(angle)
        self._station = sx, sy = project_point(heading + self._place[1], self._place[0], x, y)
        distance = hypot(own.x - sx, own.y - sy)
        self.post_int("DIST_TO_RSTATION", distance)
        self._draw()
        self.why = f"{distance:.0f} m from the place beside {name}"
        if distance <= config.inner_radius:
            return None
        radii = Radii(config.inner_radius, config.outer_radius, config.outer_speed, config.extra_speed)
        return coupled(
            course_peak(self.domain, bearing(own.x, own.y, sx, sy)),
            speed_peak(self.domain, radii.speed(distance), 0.0, 0.4, 0.0, 25.0),
        )

    def _draw(self) -> None:
        if not self.visuals:
            return
        (x, y), label = self._station, f"{self.community}_rstation"
        outer = fix(max(self.config.outer_radius, self.config.inner_radius), 1)
        self.post("RSTATION_CIRCLE", f"{fix(x, 1)},{fix(y, 1)},{outer},{label}")
        self.post("RVIEW_POINT", f"x={num(x)},y={num(y)},label={label},type=rstation")
