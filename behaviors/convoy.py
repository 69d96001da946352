"""BHV_Convoy: follow in another vessel's wake (behaviors.md C13)."""

from __future__ import annotations

from collections import deque
from itertools import pairwise
from math import hypot
from typing import NamedTuple

from behaviors.steering import speed_peak
from ivp_helm.contact_behavior import ContactBehavior
from ivp_helm.ivp import IvPFunction, Peak, couple, zaic_peak
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.geometry.angles import bearing
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.encounter import RelativeState
from pymoos_lite.geometry.shapes import Point
from pymoos_lite.geometry.specs import erase_point_text, point_text

SHORT_MEMORY = 2.0  # s over which the contact's speed is averaged for own speed
LONG_MEMORY = 5.0  # s of the average that is only told
SAFE_STOP = 5.0  # m
SAFE_GAP = 10.0  # m between the ranges of one speed and the next


class Mark(NamedTuple):
    """Where the contact has been, and the number it is drawn under."""

    x: float
    y: float
    number: int


def _above(name: str, default: float, unit: str, doc: str, **more: float) -> Parameter:
    return Parameter(name, "number", default, unit, doc, low=0.0, open_low=True, **more)  # type: ignore[arg-type]


def _range(name: str, alias: str, default: float, doc: str) -> Parameter:
    return Parameter(name, "number", default, "m", doc, low=0.0, aliases=(alias,))


class Convoy(ContactBehavior):
    """Steers along marks that the contact left behind, at its speed, adapted to the distance."""

    BHV_NAME = "BHV_Convoy"
    DEFAULT_NAME = "bhv_convoy"
    ALERTS = False
    PARAMETERS = Declaration(
        (
            Parameter("radius", "number", 5.0, "m", "This near a mark it is reached.", low=0.0),
            Parameter(
                "nm_radius", "number", 20.0, "m", "This near a mark, opening again counts too.", low=0.0
            ),
            _above("inter_mark_range", 10.0, "m", "Distance from mark to mark."),
            _above("max_mark_range", 150.0, "m", "Longest trail of marks."),
            Parameter("cruise_speed", "number", -1.0, "m/s", "Speed to go at; the contact's if negative."),
            Parameter("spd_max", "number", 2.0, "m/s", "Limit of cruise_speed.", low=0.0),
            _above("spd_slower", 0.5, "", "Factor on the contact's speed when near it.", high=1.0),
            Parameter("spd_faster", "number", 1.5, "", "Factor when far behind it.", low=1.0, high=3.0),
            _range("rng_estop", "range_estop", 15.0, "Stop below this range."),
            _range("rng_tgating", "range_tailgating", 30.0, "Below this range go slower."),
            _range("rng_lagging", "range_lagging", 70.0, "Beyond this range go faster."),
            Parameter(
                "rng_safety", "boolean", True, "", "Keep the ranges apart and cruise_speed in its limit."
            ),
        )
    )

    def setup(self) -> None:
        self._marks: deque[Mark] = deque()
        self._number = 0
        self._speeds: deque[tuple[float, float]] = deque()

    def on_parameters(self) -> None:
        config = self.config
        if not config.rng_safety:
            return
        values = vars(config)
        for key, least in (
            ("rng_estop", SAFE_STOP),
            ("rng_tgating", max(SAFE_STOP, config.rng_estop) + SAFE_GAP),
            ("rng_lagging", max(max(SAFE_STOP, config.rng_estop) + SAFE_GAP, config.rng_tgating) + SAFE_GAP),
        ):
            if values[key] < least:
                self.warn(f"{key} = {values[key]:g} is raised to {least:g} (rng_safety)")
                values[key] = least
        if config.cruise_speed > config.spd_max:
            self.warn(f"cruise_speed = {config.cruise_speed:g} is lowered to {config.spd_max:g} (rng_safety)")
            values["cruise_speed"] = config.spd_max

    def on_run_to_idle(self) -> None:
        super().on_run_to_idle()
        while self._marks:
            self._drop_oldest()
        self._speeds.clear()

    def on_complete(self) -> None:
        self.on_run_to_idle()

    def decide(self, meeting: RelativeState) -> IvPFunction | None:
        self._remember(meeting.cnv)
        self.post("TLEN", self._length())
        self.post("QLEN", float(len(self._marks)))
        self.post("MXRNG", self.config.max_mark_range)
        short = self._mean_speed(SHORT_MEMORY)
        self.post("AVG2", short)
        self.post("AVG5", self._mean_speed(LONG_MEMORY))
        self._update_marks(meeting)
        mark = self._marks[0]
        self.post("WPTX", mark.x)
        self.post("WPTY", mark.y)
        speed = self._speed(meeting.range, short)
        self.why = (
            f"{meeting.range:.0f} m behind {self.config.contact}, mark {mark.number} next, {speed:.1f} m/s"
        )
        course = zaic_peak(
            self.domain,
            "course",
            Peak(bearing(meeting.osx, meeting.osy, mark.x, mark.y), 0.0, 180.0),
            Peak(meeting.osh, 30.0, 180.0, 5.0, 0.0, 20.0),
            wrap=True,
            combine="sum",
        )
        return couple(course, speed_peak(self.domain, speed, speed / 2.0, 1.6, 20.0))

    # --- marks --------------------------------------------------------------------------------------------

    def _length(self) -> float:
        return sum(hypot(b.x - a.x, b.y - a.y) for a, b in pairwise(self._marks))

    def _update_marks(self, meeting: RelativeState) -> None:
        config, marks = self.config, self._marks
        newest = marks[-1] if marks else None
        if newest is None or hypot(meeting.cnx - newest.x, meeting.cny - newest.y) > config.inter_mark_range:
            self._add(meeting.cnx, meeting.cny)
        while len(marks) > 1 and (self._length() > config.max_mark_range or self._has_reached(meeting)):
            self._drop_oldest()

    def _has_reached(self, meeting: RelativeState) -> bool:
        mark = self._marks[0]
        away = hypot(meeting.osx - mark.x, meeting.osy - mark.y)
        return away <= float(self.config.radius)

    def _add(self, x: float, y: float) -> None:
        mark = Mark(x, y, self._number)
        self._number = (self._number + 1) % (
            int(self.config.max_mark_range / self.config.inter_mark_range) + 1
        )
        self._marks.append(mark)
        if self.visuals:
            looks = Attributes(label=self._label(mark), label_color="invisible", vertex_color="white")
            self.post("VIEW_POINT", point_text(Point(x, y, attributes=looks)), f"mark{mark.number}")

    def _drop_oldest(self) -> None:
        mark = self._marks.popleft()
        if self.visuals:
            self.post("VIEW_POINT", erase_point_text(self._label(mark)), f"mark{mark.number}")

    def _label(self, mark: Mark) -> str:
        return f"{self.community}_{self.config.contact}_{mark.number}"

    # --- speed --------------------------------------------------------------------------------------------

    def _remember(self, speed: float) -> None:
        self._speeds.append((self.now, speed))
        while self.now - self._speeds[0][0] > LONG_MEMORY:
            self._speeds.popleft()

    def _mean_speed(self, seconds: float) -> float:
        recent = [speed for time, speed in self._speeds if self.now - time <= seconds]
        return sum(recent) / len(recent)

    def _speed(self, reach: float, contact_speed: float) -> float:
        config = self.config
        if reach < config.rng_estop:
            return 0.0
        if config.cruise_speed > 0.0:
            return float(config.cruise_speed)
        if reach > config.rng_lagging:
            return float(contact_speed * config.spd_faster)
        return contact_speed if reach > config.rng_tgating else float(contact_speed * config.spd_slower)
