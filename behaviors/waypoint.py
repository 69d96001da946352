"""BHV_Waypoint: traverse a list of points (behaviors.md C1)."""

from __future__ import annotations

from math import hypot

from mypy_extensions import mypyc_attr

from behaviors.arrival import XY, ArrivalEngine
from behaviors.efficiency import Efficiency
from behaviors.track_line import track_point
from behaviors.waypoint_parameters import WAYPOINT_PARAMETERS, reversed_order
from ivp_helm.behavior import Behavior
from ivp_helm.conditions import ConditionSet
from ivp_helm.ivp import IvPFunction, Peak, couple, zaic_peak, zaic_spd
from pymoos_lite.config.parameters import ParameterError
from pymoos_lite.geometry.angles import bearing
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.hints import VisualHints
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.shapes import Point, SegList
from pymoos_lite.geometry.specs import (
    erase_point_text,
    parse_polygon,
    parse_seglist,
    point_text,
    seglist_text,
)
from pymoos_lite.geometry.text import num

NO_POINTS = "No waypts given. Set val to empty if intentional"
SHOW_TRACK_POINT_BEYOND = 5.0
"""Metres between the track point and the next point below which it is not drawn."""

HINTS = VisualHints(
    {
        "vertex_size": 3.0,
        "edge_size": 1.0,
        "vertex_color": "dodger_blue",
        "edge_color": "white",
        "label_color": "white",
        "nextpt_color": "yellow",
        "nextpt_label_color": "aqua",
        "nextpt_vertex_size": 5.0,
    },
    ("nextpt",),
)


@mypyc_attr(allow_interpreted_subclasses=True)
class Waypoint(Behavior):
    """Traverses points in order, steering for each one or for a point of the track line ahead."""

    BHV_NAME = "BHV_Waypoint"
    DEFAULT_NAME = "bhv_waypoint"
    PARAMETERS = WAYPOINT_PARAMETERS
    INFO = ("NAV_X", "NAV_Y", "NAV_SPEED")

    def setup(self) -> None:
        self.engine = ArrivalEngine()
        self.efficiency = Efficiency()
        self.hints = HINTS
        self._source: SegList | None = None
        self._polygon: Polygon | None = None
        self._intentional = ""
        self._start_wanted = False
        self._tour_due = False
        self._lead_conditions = ConditionSet()
        self._reverse = False
        self._run_start: XY | None = None
        self._first_run = True
        self._next_label = f"{self.community}'s nextpt"
        self._track_label = f"{self.community}'s trackpt"
        self._track_erased = erase_point_text(self._track_label)
        self._path_key: tuple[object, ...] = ()
        self._path_text = self._loop_text = self._next_text = ""
        self._next_key: tuple[object, ...] = ()
        self._function: tuple[tuple[object, ...], IvPFunction] | None = None
        self._speed_parts: dict[tuple[object, ...], IvPFunction] = {}

    # --- parameters ---------------------------------------------------------------------------------------

    def set_points(self, text: str) -> None:
        """New points: a seglist, else a polygon that begins at the vertex nearest own ship."""
        word = text.strip().lower()
        if word in ("empty", "start", "here"):
            self._source = self._polygon = None
            self._intentional = word
            self._start_wanted = word == "start"
        else:
            self._source, self._polygon = self._read_points(text)
            self._intentional = ""
        self._load()

    def set_xpoints(self, text: str) -> None:
        """Other points in the same number; the index stays."""
        shape, polygon = self._read_points(text)
        if len(shape) != len(self.engine.points):
            raise ParameterError(
                f"xpoints: {len(shape)} points given; expected as many as there are, {len(self.engine.points)}"
            )
        self._source, self._polygon = shape, polygon
        self.engine.replace_points(self._ordered())

    def set_newpt(self, text: str) -> None:
        """One more point at the end."""
        shape, _ = self._read_points(text)
        if not self._reverse:
            kept = self._source.points if self._source is not None else ()
            self._source, self._polygon = SegList.of([*kept, *shape.points]), None
            self.engine.replace_points(self._ordered())

    def set_order(self, word: str) -> None:
        """Which way the points are traversed."""
        self._reverse = reversed_order(word, self._reverse)
        self._load()

    def set_currix(self, index: int) -> None:
        """The point to go for next; ignored if there is none of that number."""
        self.engine.set_index(index)

    def set_repeat(self, rounds: int | None) -> None:
        """Further rounds; more than none makes the behaviour perpetual."""
        self.config.__dict__["repeat"] = rounds
        if rounds is None or rounds > 0:
            self.config.__dict__["perpetual"] = True

    def set_lead_condition(self, condition: object) -> None:
        self.config.lead_condition.append(condition)
        self._lead_conditions = ConditionSet(self.config.lead_condition)
        self.watch(*(name for c in self._lead_conditions for name in c.registrations()))

    def set_visual_hints(self, text: str) -> None:
        # 'inactive' is no colour, but stock files use it to hide the path.
        self.hints = self.hints.updated(
            text.replace("=inactive", "=invisible").replace("= inactive", "=invisible")
        )

    def set_use_alt_speed(self, use: bool) -> None:
        self.config.__dict__["use_alt_speed"] = use
        self.efficiency.disqualify()

    def set_speed(self, speed: float) -> None:
        self.config.__dict__["speed"] = min(speed, self.max_speed) if "speed" in self.domain else speed
        self.efficiency.disqualify()

    def _read_points(self, text: str) -> tuple[SegList, Polygon | None]:
        try:
            return parse_seglist(text), None
        except ValueError as complaint:
            try:
                polygon = parse_polygon(text)
            except ValueError:
                raise ParameterError(str(complaint)) from None
        own = self.surroundings.own
        first = (own.x, own.y) if own is not None else (0.0, 0.0)
        return polygon.starting_nearest(*first), polygon

    def _load(self) -> None:
        self.engine.set_points(self._ordered())
        self._tour_due = bool(self.config.greedy_tour)
        self._run_start = None
        self._first_run = True

    def _ordered(self) -> tuple[XY, ...]:
        points = self._source.points if self._source is not None else ()
        return tuple(reversed(points)) if self._reverse else tuple(points)

    def on_parameters(self) -> None:
        config, engine = self.config, self.engine
        line = config.capture_line
        engine.capture_line = line != "false"
        engine.capture_radius = 0.0 if line == "absolute" else config.capture_radius
        engine.slip_radius = 0.0 if line == "absolute" else config.slip_radius
        engine.repeats = config.repeat
        engine.perpetual = config.perpetual
        self._speed_parts.clear()
        if "greedy_tour" in self.given and config.greedy_tour and engine.index == 0 and self._first_run:
            self._tour_due = True
        if engine.points or self._intentional:
            self.retract_warning(NO_POINTS)
        else:
            self.warn(NO_POINTS)
        if len(engine.points) == 1 and config.repeat != 0:
            self.warn("cycles/repeats not supported with single waypt")
        for key in self.hints.unknown_keys():
            if key != "nextpt_color":
                self.event(f"visual_hints: nothing is drawn with '{key}'")

    # --- state changes ------------------------------------------------------------------------------------

    def on_every_state(self) -> None:
        if self._start_wanted and self.surroundings.own is not None:
            self._start_wanted = False
            own = self.own
            self._source = SegList.of([(own.x, own.y)])
            self._load()

    def on_idle_to_run(self) -> None:
        if self.config.reset_on_idle and not self._first_run:
            self.engine.restart()
        self.engine.forget_distance()
        own = self.own
        self.efficiency.begin(own.x, own.y, self.now)
        if self._tour_due and self._source is not None:
            self._tour_due = False
            self._source = self._source.greedy_path(own.x, own.y)
            self.engine.set_points(self._ordered())
        if self.engine.previous is None:
            self.engine.previous = (own.x, own.y)
        self._run_start = (own.x, own.y)

    def on_run_to_idle(self) -> None:
        self.engine.forget_distance()
        self.efficiency.disqualify()
        self._erase_points()
        self._draw_path(active=False)
        self.post(self.config.wpt_dist_to_prev, -1.0)
        self.post(self.config.wpt_dist_to_next, -1.0)

    def on_complete(self) -> None:
        self._erase_points()
        self._draw_path(active=False)

    # --- running ------------------------------------------------------------------------------------------

    def on_run(self) -> IvPFunction | None:
        config, engine, own = self.config, self.engine, self.own
        if not engine.points:
            if not self._intentional:
                self.warn(NO_POINTS)
            self.why = "there are no points"
            return None
        if engine.previous is None:  # new points came while running
            engine.previous = self._run_start = (own.x, own.y)
        if self._first_run:
            self._first_run = False
            if config.wptflag_on_start:
                self.post_flags(config.wptflag)
        odometer = self.efficiency.move(own.x, own.y)
        event = engine.arrive(own.x, own.y)
        if event != "none":
            self._tell_efficiency(own.x, own.y)
        self._say("WPT_ODO", odometer)
        if event == "completed":
            self._complete_round()
            return None
        if event == "cycled":
            self._say_status(f"behavior-name={self.name},cycled")
            self.post_flags(config.cycleflag)
            self.post_flags(config.wptflag)
            self._say_index(config.cycle_index_var, engine.cycles)
        elif event == "advanced":
            self.post_flags(config.wptflag)
        self._tell_progress()
        track = self._track_point()
        self._draw(track)
        self._tell_distances()
        return self._build(track)

    def _complete_round(self) -> None:
        config = self.config
        self._say_status(f"behavior-name={self.name},completed")
        self.post_flags(config.cycleflag)
        self.complete()
        self.post_flags(config.wptflag)
        self._say_index(config.cycle_index_var, self.engine.cycles)
        self._erase_points()
        self.why = f"all {len(self.engine.points)} points reached"

    def _track_point(self) -> XY:
        """The point steered for: on the track line ahead, or the point itself (behaviors.md C1)."""
        config, engine, own = self.config, self.engine, self.own
        point = engine.current
        if config.lead <= 0.0 or self._lead_conditions.first_false(self.buffer) is not None:
            return point
        anchor = self._anchor()
        if anchor is None:
            return point
        return track_point(anchor, point, own.x, own.y, config.lead, config.lead_damper)

    def _anchor(self) -> XY | None:
        """Where the track line to the current point begins; None on a first leg without `lead_to_start`."""
        engine = self.engine
        if engine.index > 0:
            return engine.points[engine.index - 1]
        if engine.cycles > 0 and len(engine.points) > 1:
            return engine.points[-1]
        return self._run_start if self.config.lead_to_start else None

    # --- the function -------------------------------------------------------------------------------------

    @property
    def speed_in_force(self) -> float:
        """Metres per second, before slowing down at the end."""
        config = self.config
        speed = config.speed_alt if config.use_alt_speed and config.speed_alt >= 0.0 else config.speed
        return float(min(speed, self.max_speed))

    def _speed_wanted(self) -> float:
        speed = self.speed_in_force
        slow = self.config.end_spd
        if slow is not None:
            left = self.engine.distance_left_of_all(self.own.x, self.own.y)
            if left is not None:
                start, stop = slow
                if left <= stop:
                    return 0.0
                if left < start:
                    return speed * float((left - stop) / (start - stop))
        return speed

    def _build(self, track: XY) -> IvPFunction:
        config, own = self.config, self.own
        course = bearing(own.x, own.y, *track)
        speed = self._speed_wanted()
        kind = config.ipf_type
        self._explain(speed)
        key = (course, speed, own.heading, own.x, own.y) if kind == "roc" else (course, speed, own.heading)
        if self._function is not None and self._function[0] == key:
            return self._function[1]
        if kind == "roc":
            function = self._closing_function(course)
        else:
            heading = zaic_peak(
                self.domain,
                "course",
                Peak(course, 0.0, 180.0),
                Peak(own.heading, 30.0, 180.0, 5.0, 0.0, 20.0),
                wrap=True,
                combine="sum",
            )
            patience = config.patience
            function = couple(heading, self._speed_function(kind, speed), patience, 100.0 - patience)
        self._function = (key, function)
        return function

    def _speed_function(self, kind: str, speed: float) -> IvPFunction:
        key = (kind, speed)
        found = self._speed_parts.get(key)
        if found is None:
            if kind == "zaic_spd":
                found = zaic_spd(self.domain, "speed", speed, 0.1, speed + 0.4, 70.0, 20.0)
            else:
                found = zaic_peak(self.domain, "speed", Peak(speed, speed / 2.0, 1.6, 20.0))
            if len(self._speed_parts) > 50:
                self._speed_parts.clear()
            self._speed_parts[key] = found
        return found

    def _closing_function(self, course: float) -> IvPFunction:
        from behaviors.closing_rate import closing_rate_function

        return closing_rate_function(self.domain, course, self.speed_in_force, self.config.build_info)

    def _explain(self, speed: float) -> None:
        engine, own = self.engine, self.own
        px, py = engine.current
        self.why = (
            f"point {engine.index + 1} of {len(engine.points)}, {hypot(own.x - px, own.y - py):.0f} m to go"
            f" at {num(speed, 2)} m/s, capture radius {num(engine.capture_radius, 1)} m"
        )

    # --- words for flags and settings ---------------------------------------------------------------------

    def macro(self, name: str) -> float | str | None:
        engine, config = self.engine, self.config
        own = self.surroundings.own
        x, y = (own.x, own.y) if own is not None else (0.0, 0.0)
        count = len(engine.points)
        point = engine.current if count else (0.0, 0.0)
        before = engine.previous or (x, y)
        left_of_all = engine.distance_left_of_all(x, y)
        values: dict[str, float | str] = {
            "POINTS": self._points_text(),
            "SPEED": config.speed,
            "SPEED_ALT": config.speed_alt,
            "USE_SPEED_ALT": "true" if config.use_alt_speed else "false",
            "IPF_TYPE": config.ipf_type,
            "WPT_FLAG_ON_START": "true" if config.wptflag_on_start else "false",
            "LEAD_TO_START": "true" if config.lead_to_start else "false",
            "LEAD_DAMPER": config.lead_damper or -1.0,
            "ORDER": self._order_text(),
            "NI": float(engine.index),
            "IX": float(engine.index),
            "NX": point[0],
            "NY": point[1],
            "X": point[0],
            "Y": point[1],
            "PI": float(self._previous_index()),
            "PX": before[0],
            "PY": before[1],
            "CYCLES": float(engine.cycles),
            "CYCREM": "forever" if engine.repeats_left is None else float(engine.repeats_left),
            "WPTS_HIT": float(engine.hits),
            "WPTS_REM": float(engine.points_left),
            "WPTS": float(count),
            "CYC_DIST_TOGO": engine.distance_left(x, y),
            "ALL_DIST_TOGO": -1.0 if left_of_all is None else left_of_all,
        }
        return values.get(name)

    def _previous_index(self) -> int:
        engine = self.engine
        return (engine.index - 1) % len(engine.points) if engine.hits and engine.points else 0

    def _points_text(self) -> str:
        return seglist_text(SegList.of(self.engine.points), 3)

    def _order_text(self) -> str:
        return "reverse" if self._reverse else "normal"

    def settings(self) -> str:
        config, engine = self.config, self.engine
        flag = ("false", "true")
        line = "" if config.capture_line == "false" else f",capture_line={config.capture_line}"
        return (
            f"points={self._points_text()},speed={num(config.speed, 3)},speed_alt={num(config.speed_alt, 3)},"
            f"currix={engine.index},greedy_tour={flag[config.greedy_tour]},"
            f"use_alt_speed={flag[config.use_alt_speed]},wpt_status={config.wpt_status},"
            f"wpt_dist_to_prev={config.wpt_dist_to_prev},wpt_dist_to_next={config.wpt_dist_to_next},"
            f"wpt_index={config.wpt_index},cycle_index_var={config.cycle_index_var},"
            f"post_suffix={config.post_suffix},post_suffix={config.post_suffix},"
            f"ipf_type={config.ipf_type},lead={num(config.lead or -1.0, 3)},"
            f"lead_damper={num(config.lead_damper or -1.0, 3)},lead_to_start={flag[config.lead_to_start]},"
            f"order={self._order_text()},repeats={'forever' if config.repeat is None else config.repeat},"
            f"efficiency_measure={config.efficiency_measure},capture_radius={num(engine.capture_radius, 3)},"
            f"slip_radius={num(engine.slip_radius, 3)}{line},crs_spd_zaic_ratio={num(config.patience, 3)}"
        )

    # --- telling ------------------------------------------------------------------------------------------

    def _say(self, variable: str, value: object) -> None:
        self.post(f"{variable}{self.config.post_suffix}", value)

    def _say_status(self, text: str) -> None:
        if self.config.wpt_status.lower() != "silent":
            self._say(self.config.wpt_status, text)

    def _say_index(self, variable: str, value: float) -> None:
        if variable.lower() != "silent":
            self._say(variable, float(value))

    def _tell_progress(self) -> None:
        engine, own = self.engine, self.own
        px, py = engine.current
        distance = hypot(own.x - px, own.y - py)
        eta = str(int(distance / own.speed + 0.5)) if own.speed > 0.0 else "inf"
        self._say_status(
            f"vname={self.community},behavior-name={self.name},index={engine.index},"
            f"hits={engine.capture_hits}/{engine.hits},cycles={engine.cycles},dist={int(distance + 0.5)},eta={eta}"
        )
        self._say_index(self.config.wpt_index, engine.index)

    def _tell_distances(self) -> None:
        config, engine, own = self.config, self.engine, self.own
        if config.wpt_dist_to_prev and engine.previous is not None:
            qx, qy = engine.previous
            self.post(config.wpt_dist_to_prev, hypot(own.x - qx, own.y - qy))
        if config.wpt_dist_to_next:
            px, py = engine.current
            self.post(config.wpt_dist_to_next, hypot(own.x - px, own.y - py))

    def _tell_efficiency(self, x: float, y: float) -> None:
        if self.config.efficiency_measure != "all":
            return
        head = f"vname={self.community},bhv_name={self.name}"
        for variable, value in self.efficiency.finish_leg(x, y, self.now, self.speed_in_force, head):
            self._say(variable, value)

    # --- drawing ------------------------------------------------------------------------------------------

    def _draw_path(self, active: bool = True) -> None:
        points = self.engine.points
        if not self.visuals or not points or (active and self._hides_path()):
            return
        key = (points, self.hints, active)
        if self._path_key != key:
            self._path_key = key
            base = Attributes(label=f"{self.community}_{self.name}", active=active)
            looks = self.hints.attributes(base=base) if active else base
            self._path_text = seglist_text(SegList(points, attributes=looks), 3)
            polygon = Polygon(points, attributes=looks)
            self._loop_text = seglist_text(polygon, 3) if polygon.is_convex else ""
        self.post("VIEW_SEGLIST", self._path_text)
        if self.config.draw_path_loop and self._loop_text:
            self.post("VIEW_POLYGON", self._loop_text)

    def _hides_path(self) -> bool:
        return self.hints.color("edge_color") in ("invisible", "")

    def _draw(self, track: XY) -> None:
        if not self.visuals:
            return
        self._draw_path()
        px, py = self.engine.current
        key = (px, py, self.hints)
        if self._next_key != key:
            self._next_key = key
            looks = Attributes(
                label=self._next_label,
                label_color=self.hints.color("label_color", "nextpt", "aqua"),
                vertex_color=self._next_color(),
                vertex_size=self.hints.size("vertex_size", "nextpt", 5.0),
            )
            self._next_text = point_text(Point(px, py, attributes=looks), show_active=True)
        self.post("VIEW_POINT", self._next_text, "wpt")
        if hypot(track[0] - px, track[1] - py) > SHOW_TRACK_POINT_BEYOND:
            color = self._next_color()
            tail = f"label={self._track_label},label_color={color},vertex_color={color},vertex_size=4"
            self.post("VIEW_POINT", f"x={num(track[0])},y={num(track[1])},{tail}", "trk")
        else:
            self.post("VIEW_POINT", self._track_erased, "trk")

    def _next_color(self) -> str:
        hints = self.hints
        return hints.color("color", "nextpt") or hints.color("vertex_color", "nextpt", "yellow")

    def _erase_points(self) -> None:
        if self.visuals:
            self.post("VIEW_POINT", erase_point_text(self._next_label), "wpt")
            self.post("VIEW_POINT", self._track_erased, "trk")
