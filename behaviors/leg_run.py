"""BHV_LegRun: sail to and fro between two points, turning about beyond them (behaviors.md C17)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import hypot
from typing import ClassVar

from behaviors import leg_run_views as views
from behaviors.arrival import ArrivalEngine
from behaviors.leg_course import LegCourse, TurnShape
from behaviors.leg_run_parameters import LEG_RUN_PARAMETERS, LegSpec
from behaviors.odometers import Odometers
from behaviors.speed_schedule import ScheduleChange, SpeedSchedule
from behaviors.steering import speed_band, toward
from behaviors.track_line import track_point
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import ParameterError
from pymoos_lite.geometry.angles import bearing
from pymoos_lite.geometry.shapes import XY, Point, SegList
from pymoos_lite.geometry.text import num

INVALID = "Invalid or unset legrun"
SHOW_TRACK_POINT_BEYOND = 5.0
FOLLOWING = {"leg1": "turn1", "turn1": "leg2", "leg2": "turn2", "turn2": "leg1"}
AFTER_IDLE = {"turn1": "leg2", "turn2": "leg1"}


def _turn_setter(
    numbers: tuple[int, ...], quantity: str, relative: bool = False
) -> Callable[[LegRun, float], None]:
    def change(self: LegRun, value: float) -> None:
        for number in numbers:
            shape = self.turns[number]
            self.turns[number] = shape.with_value(quantity, value, relative, self.config.turn_rad_min)

    return change


def _side_setter(numbers: tuple[int, ...]) -> Callable[[LegRun, str], None]:
    def change(self: LegRun, side: str) -> None:
        for number in numbers:
            shape = self.turns[number]
            port = not shape.port if side == "toggle" else side == "port"
            self.turns[number] = replace(shape, port=port)

    return change


class LegRun(Behavior):
    """A race track: leg 1 to p1, a turn about, leg 2 to p2, a turn about, and so on."""

    BHV_NAME = "BHV_LegRun"
    DEFAULT_NAME = "bhv_legrun"
    PARAMETERS = LEG_RUN_PARAMETERS
    DEFAULTS: ClassVar = {"perpetual": True}
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED")

    set_turn_rad = _turn_setter((1, 2), "radius")
    set_turn1_rad = _turn_setter((1,), "radius")
    set_turn2_rad = _turn_setter((2,), "radius")
    set_turn_rad_mod = _turn_setter((1, 2), "radius", relative=True)
    set_turn1_rad_mod = _turn_setter((1,), "radius", relative=True)
    set_turn2_rad_mod = _turn_setter((2,), "radius", relative=True)
    set_turn_bias = _turn_setter((1, 2), "bias")
    set_turn1_bias = _turn_setter((1,), "bias")
    set_turn2_bias = _turn_setter((2,), "bias")
    set_turn_bias_mod = _turn_setter((1, 2), "bias", relative=True)
    set_turn1_bias_mod = _turn_setter((1,), "bias", relative=True)
    set_turn2_bias_mod = _turn_setter((2,), "bias", relative=True)
    set_turn_ext = _turn_setter((1, 2), "extension")
    set_turn1_ext = _turn_setter((1,), "extension")
    set_turn2_ext = _turn_setter((2,), "extension")
    set_turn_ext_mod = _turn_setter((1, 2), "extension", relative=True)
    set_turn1_ext_mod = _turn_setter((1,), "extension", relative=True)
    set_turn2_ext_mod = _turn_setter((2,), "extension", relative=True)
    set_turn_dir = _side_setter((1, 2))
    set_turn1_dir = _side_setter((1,))
    set_turn2_dir = _side_setter((2,))

    def setup(self) -> None:
        self.turns = {1: TurnShape(), 2: TurnShape()}
        self.course: LegCourse | None = None
        self.engine = ArrivalEngine()
        self.schedule = SpeedSchedule()
        self.hints = views.HINTS
        self._ends: list[XY | None] = [None, None]
        self._phase = "init"
        self._told_phase = ""
        self._leg_speed: float | None = None
        self._legs = 0
        self._rounds_left: int | None = 0
        self._hits = 0
        self._mid_told = False
        self._odometers = Odometers("leg")
        self._leg_begun = False
        self._views_key: tuple[object, ...] = ()
        self._views: tuple[list[views.View], list[views.View]] = ([], [])

    # --- parameters ---------------------------------------------------------------------------------------

    def set_speed(self, speed: float) -> None:
        if "speed" in self.domain and speed > self.max_speed:
            raise ParameterError(
                f"speed = {speed:g} is beyond the domain: give at most {self.max_speed:g} m/s"
            )
        vars(self.config)["speed"] = speed

    def set_p1(self, point: Point) -> None:
        self._ends[0] = (point.x, point.y)

    def set_p2(self, point: Point) -> None:
        self._ends[1] = (point.x, point.y)

    def set_leg(self, leg: LegSpec) -> None:
        course = LegCourse.about(*leg)
        self._ends = [course.p1, course.p2]

    def set_leg_len(self, length: float) -> None:
        self._move(length=length)

    def set_leg_len_mod(self, change: float) -> None:
        self._move(length=self._legs_now().length + change)

    def set_leg_ang(self, angle: float) -> None:
        self._move(angle=angle)

    def set_leg_ang_mod(self, change: float) -> None:
        self._move(angle=self._legs_now().angle + change)

    def set_shift_pt(self, point: Point) -> None:
        self._move(center=(point.x, point.y))

    def set_leg_spds(self, change: ScheduleChange) -> None:
        if any(speed > self.max_speed for speed in change.speeds):
            raise ParameterError(
                f"leg_spds: speeds must be within the domain, at most {self.max_speed:g} m/s"
            )
        self.schedule.change(change)

    def set_repeat(self, rounds: int | None) -> None:
        vars(self.config)["repeat"] = self._rounds_left = rounds

    def set_visual_hints(self, text: str) -> None:
        self.hints = self.hints.updated(text)

    def _legs_now(self) -> LegCourse:
        p1, p2 = self._ends
        if p1 is None or p2 is None:
            raise ValueError("the legs are not known yet: give p1 and p2, or leg, before")
        return LegCourse(p1, p2)

    def _move(
        self, center: XY | None = None, angle: float | None = None, length: float | None = None
    ) -> None:
        course = self._legs_now().moved(center, angle, length)
        self._ends = [course.p1, course.p2]

    def on_parameters(self) -> None:
        config, engine, (p1, p2) = self.config, self.engine, self._ends
        former = self.course
        self.course = None
        if p1 is not None and p2 is not None:
            course = LegCourse(p1, p2, self.turns[1], self.turns[2], config.turn_pt_gap)
            self.course = course if course.is_complete else None
        line = config.capture_line
        engine.capture_line = line != "false"
        engine.capture_radius = 0.0 if line == "absolute" else config.capture_radius
        engine.slip_radius = 0.0 if line == "absolute" else config.slip_radius
        if self.course is None:
            self.warn(INVALID)
        else:
            self.retract_warning(INVALID)
            if former is not None and former != self.course:
                self._follow_changes()
        for key in self.hints.unknown_keys():
            if key != "nextpt_color":
                self.event(f"visual_hints: nothing is drawn with '{key}'")
        self._tell_phase()

    def _follow_changes(self) -> None:
        """Legs or turns changed under way: go on with the point of the same number."""
        if self._phase != "init":
            points, index = self._points(self._phase), self.engine.index
            self.engine.replace_points(points)
            self.engine.set_index(min(index, len(points) - 1))

    def settings(self) -> str:
        config = self.config
        return (
            f"speed={num(config.speed, 3)},currix={self._leg_index()},"
            f"capture_radius={num(self.engine.capture_radius, 3)},"
            f"slip_radius={num(self.engine.slip_radius, 3)},patience={num(config.patience, 3)}"
        )

    # --- state changes ------------------------------------------------------------------------------------

    def on_idle_to_run(self) -> None:
        self.engine.forget_distance()

    def on_run_to_idle(self) -> None:
        if self._phase in AFTER_IDLE:
            self._enter(AFTER_IDLE[self._phase])
            self._tell_phase()
        self._erase()

    def on_complete(self) -> None:
        self._erase()

    # --- running ------------------------------------------------------------------------------------------

    def on_run(self) -> IvPFunction | None:
        if self.course is None:
            self.warn(INVALID)
            self.why = INVALID
            return None
        own = self.own
        if self._phase == "init":
            self._enter(self._first_phase(self.course))
            self._tell_phase()
        if not self._leg_begun:
            self._leg_begun = True
            self._odometers.restart(own.x, own.y)
        self._odometers.move(own.x, own.y)
        if self._sail(own.x, own.y):
            return None
        self._post_mid_flags(own.x, own.y)
        track = self._track_point(own.x, own.y)
        self._draw(track)
        self._tell_phase()
        speed = self._speed_now()
        self.post("LR_NOW_SPD", speed)
        px, py = self.engine.current
        self.why = (
            f"{self._phase}, {hypot(own.x - px, own.y - py):.0f} m to the next point at {num(speed, 2)} m/s"
        )
        return toward(
            self.domain,
            bearing(own.x, own.y, *track),
            speed_band(self.domain, speed, 70.0, 20.0),
            self.config.patience,
            100.0 - self.config.patience,
        )

    def _first_phase(self, course: LegCourse) -> str:
        own, mode = self.own, self.config.init_leg_mode
        nearer_p1 = hypot(own.x - course.p1[0], own.y - course.p1[1]) <= hypot(
            own.x - course.p2[0], own.y - course.p2[1]
        )
        if mode == "close_turn":
            return "leg1" if nearer_p1 else "leg2"
        if mode == "far_turn":
            return "leg2" if nearer_p1 else "leg1"
        return "leg1"

    def _sail(self, x: float, y: float) -> bool:
        """Reach points and change from leg to turn and back; True when the behaviour has ended."""
        # A leg that ends and a turn whose first point is right here take one iteration.
        for _ in range(2):
            event = self.engine.arrive(x, y)
            if event == "none":
                return False
            self._hits += 1
            if event != "completed":
                return False
            if self._end_phase():
                return True
        return False

    def _end_phase(self) -> bool:
        config, phase = self.config, self._phase
        leg = phase.startswith("leg")
        self.post_flags(config.leg_end_flag if leg else config.turn_end_flag)
        self.post_flags(getattr(config, f"{phase}_end_flag"))
        if leg:
            self._legs += 1
            if self._legs % 2 == 0 and self._round_ended():
                return True
        self._enter(FOLLOWING[phase])
        return False

    def _round_ended(self) -> bool:
        left = self._rounds_left
        if left is None:
            return False
        if left > 0:
            self._rounds_left = left - 1
            return False
        self._rounds_left = self.config.repeat
        self.complete("all rounds sailed")
        return self.completed

    def _enter(self, phase: str) -> None:
        """Sail this leg or turn from now on."""
        course, engine = self.course, self.engine
        if course is None:
            self._phase = "init"
            return
        fresh = self._phase == "init"
        self._phase = phase
        before = {"leg1": course.p2, "leg2": course.p1, "turn1": course.p2, "turn2": course.p1}[phase]
        engine.set_points(self._points(phase))
        # On the very first leg there is no line to keep to.
        engine.previous = None if fresh else before
        self._mid_told = False
        self._leg_begun = False
        if phase.startswith("leg"):
            self._leg_speed = self.schedule.take(self.config.leg_spds_repeat)

    def _points(self, phase: str) -> tuple[XY, ...]:
        course = self.course
        assert course is not None
        return {
            "leg1": (course.p1,),
            "leg2": (course.p2,),
            "turn1": course.path1,
            "turn2": course.path2,
        }[phase]

    def _track_point(self, x: float, y: float) -> XY:
        engine, lead = self.engine, self.config.lead
        point = engine.current
        anchor = engine.points[engine.index - 1] if engine.index > 0 else engine.previous
        if lead <= 0.0 or anchor is None:
            return point
        return track_point(anchor, point, x, y, lead, self.config.lead_damper)

    def _speed_now(self) -> float:
        config = self.config
        scheduled = self._leg_speed if self._phase.startswith("leg") or config.leg_spds_onturn else None
        return float(config.speed if scheduled is None else scheduled)

    def _post_mid_flags(self, x: float, y: float) -> None:
        if self._mid_told:
            return
        config = self.config
        leg = self._phase.startswith("leg")
        if self._share_done(x, y) * 100.0 >= (config.mid_leg_pct if leg else config.mid_turn_pct):
            self._mid_told = True
            self.post_flags(config.mid_leg_flag if leg else config.mid_turn_flag)

    def _share_done(self, x: float, y: float) -> float:
        """How much of the leg or turn lies behind, 0 to 1."""
        course, engine = self.course, self.engine
        if course is None or not engine.points:
            return 0.0
        px, py = engine.current
        left = hypot(x - px, y - py)
        if self._phase.startswith("leg"):
            return min(max(1.0 - left / course.length, 0.0), 1.0)
        left += SegList(engine.points[engine.index :]).length
        return min(max(1.0 - left / SegList(engine.points).length, 0.0), 1.0)

    # --- words for flags ----------------------------------------------------------------------------------

    def _leg_index(self) -> int:
        return 1 if self._phase in ("leg2", "turn1") else 0

    def macro(self, name: str) -> float | str | None:
        own, engine = self.surroundings.own, self.engine
        x, y = (own.x, own.y) if own is not None else (0.0, 0.0)
        nx, ny = engine.current if engine.points else (0.0, 0.0)
        px, py = engine.previous or (x, y)
        rounds = self._rounds_left
        values: dict[str, float | str] = {
            "SPEED": self.config.speed,
            "NI": float(self._leg_index()),
            "NX": nx,
            "NY": ny,
            "CYCLES": float(self._legs // 2),
            "CYCREM": "forever" if rounds is None else float(rounds),
            "WPTS_HIT": float(self._hits),
            "MODE": self._phase,
            "DIST_NP": hypot(x - nx, y - ny),
            "DIST_PP": hypot(x - px, y - py),
            "PCT_NP": 100.0 * self._share_done(x, y),
            "LEG_ODO": self._odometers["leg"],
            "LEG_ID": self.config.id,
            "WRAPS": float(self.schedule.wraps),
        }
        return values.get(name)

    # --- telling ------------------------------------------------------------------------------------------

    def _tell_phase(self) -> None:
        phase = self._phase
        if phase == self._told_phase:
            return
        self._told_phase = phase
        self.post("LR_MODE", phase)
        self.post("LR_MODE_REPORT", f"vname={self.community},mode={phase},utc={num(self.now, 3)}")
        if phase.startswith("turn") and self.visuals:
            self._show(views.turn_view(self.community, self.engine.points, self.hints))

    def _draw(self, track: XY) -> None:
        course = self.course
        if not self.visuals or course is None:
            return
        key = (course, self.hints)
        if key != self._views_key:
            self._views_key = key
            self._views = views.course_views(self.community, course, self.hints)
        for view in self._views[0]:
            self._show(view)
        target = self.engine.current
        far = hypot(track[0] - target[0], track[1] - target[1]) > SHOW_TRACK_POINT_BEYOND
        for view in views.target_views(self.community, target, track if far else None, self.hints):
            self._show(view)
        for view in self._views[1]:
            self._show(view)

    def _erase(self) -> None:
        if self.visuals:
            for view in views.erasures(self.community):
                self._show(view)

    def _show(self, view: views.View) -> None:
        variable, text, key = view
        self.post(variable, text, key)
