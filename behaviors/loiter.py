"""BHV_Loiter: go around a convex polygon (behaviors.md C2)."""

from __future__ import annotations

from collections.abc import Iterable
from math import hypot

from mypy_extensions import mypyc_attr

from behaviors.arrival import ArrivalEngine
from behaviors.forms import tolerant_hints
from behaviors.loiter_entry import better_clockwise, entry
from behaviors.loiter_parameters import LOITER_PARAMETERS
from behaviors.steering import speed_band, speed_peak, toward
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.geometry.angles import angle180, bearing
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.hints import VisualHints
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.shapes import XY, Point
from pymoos_lite.geometry.specs import point_text, seglist_text
from pymoos_lite.geometry.text import fields, fix, num

NO_POLYGON = "Empty/NULL Loiter Specification."
SNAP = 0.1
"""Metres to which vertices are rounded."""
LEAST_RADIUS = 5.0
DEFAULT_SPIRAL = -2.0

HINTS = VisualHints(
    {
        "vertex_size": 1.0,
        "edge_size": 1.0,
        "vertex_color": "dodger_blue",
        "edge_color": "white",
        "nextpt_color": "yellow",
        "nextpt_label_color": "aqua",
        "nextpt_vertex_size": 5.0,
    },
    ("nextpt",),
)
HINT_KEYS = (
    "vertex_size",
    "edge_size",
    "vertex_color",
    "edge_color",
    "label_color",
    "nextpt_color",
    "nextpt_label_color",
    "nextpt_vertex_size",
)


@mypyc_attr(allow_interpreted_subclasses=True)
class Loiter(Behavior):
    """Goes around a polygon for ever, vertex by vertex, in either direction.

    From afar it makes for the vertex at which the circuit is joined most smoothly. It never completes but
    by `slingshot` or `duration`.
    """

    BHV_NAME = "BHV_Loiter"
    DEFAULT_NAME = "bhv_loiter"
    PARAMETERS = LOITER_PARAMETERS
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED")

    def setup(self) -> None:
        self.engine = ArrivalEngine()
        self.engine.perpetual = True
        self.engine.repeats = None
        self.polygon: Polygon | None = None
        self.clockwise = True
        self.hints = HINTS
        self._label = ""
        self._fresh = True
        """The next run begins a new acquisition."""
        self._own_center_due = False
        self._acquiring = True
        self._mode = "idle"
        self._distance = 0.0
        self._eta: float | None = 0.0
        self._bearing: float | None = None
        self._turned = 0.0
        self._shape_key: tuple[object, ...] = ()
        self._shape_text = self._erase_text = ""
        self._report_key: tuple[object, ...] = ()
        self._report_text = ""
        self._point_key: tuple[object, ...] = ()
        self._point_text = ""
        self._point_label = f"{self.community}_waypoint"
        self._shown: XY = (0.0, 0.0)
        """The vertex drawn last."""

    # --- parameters ---------------------------------------------------------------------------------------

    def set_polygon(self, polygon: Polygon) -> None:
        """A new polygon, in whatever direction it is written; acquired anew."""
        self.config.__dict__["polygon"] = polygon
        self._take(polygon.snapped_convex(SNAP) or polygon)

    def set_clockwise(self, way: str) -> None:
        self.config.__dict__["clockwise"] = way
        if way != "best":
            self.clockwise = way == "true"
        if self.polygon is not None:
            self._take(self.polygon)

    def set_speed(self, speed: float) -> None:
        self.config.__dict__["speed"] = min(speed, self.max_speed) if "speed" in self.domain else speed

    def set_center_assign(self, center: tuple[float | None, float | None] | None) -> None:
        """Move the polygon, at the latest when own ship's position is known."""
        if center is None:
            self._own_center_due = True
        else:
            self._assign_center(*center)

    def set_xcenter_assign(self, x: float) -> None:
        self._assign_center(x, None)

    def set_ycenter_assign(self, y: float) -> None:
        self._assign_center(None, y)

    def _assign_center(self, x: float | None, y: float | None) -> None:
        former: tuple[float | None, float | None] = self.config.center_assign or (None, None)
        x, y = former[0] if x is None else x, former[1] if y is None else y
        self.config.__dict__["center_assign"] = (x, y)

    def set_mod_poly_rad(self, amount: float) -> None:
        polygon = self.polygon
        if polygon is None:
            raise ValueError("there is no polygon to change yet")
        self._take(polygon.grown_by(max(amount, LEAST_RADIUS - polygon.max_radius)))

    def set_visual_hints(self, text: str) -> None:
        rest = []
        for key, value in fields(text):
            if key.lower() == "label":
                self._label = value
            else:
                rest.append(f"{key}={value}")
        self.hints, complaints = tolerant_hints(self.hints, ",".join(rest), HINT_KEYS)
        for complaint in complaints:
            self.event(complaint)

    def check(self) -> Iterable[str]:
        if self.config.center_activate and self.config.center_assign is not None:
            yield "center_assign and center_activate: own ship's position at the start of a run will win"

    def _take(self, polygon: Polygon) -> None:
        """Sail this polygon from now on, in the direction in force."""
        if polygon.is_clockwise != self.clockwise:
            polygon = polygon.reversed()
        self.polygon = polygon
        self.engine.set_points(polygon.points)
        self._fresh = True
        self._acquiring = True

    def on_parameters(self) -> None:
        config = self.config
        self.engine.capture_radius = config.capture_radius
        self.engine.slip_radius = config.slip_radius
        center = config.center_assign
        if center is not None and self.polygon is not None:
            cx, cy = self.polygon.center
            x, y = cx if center[0] is None else center[0], cy if center[1] is None else center[1]
            config.__dict__["center_assign"] = None
            if (x, y) != (cx, cy):
                self._take(self.polygon.centered_at(x, y))

    def settings(self) -> str:
        x, y = self.polygon.center if self.polygon is not None else (0.0, 0.0)
        flag = ("false", "true")
        config = self.config
        shape = seglist_text(Polygon(self.polygon.points if self.polygon is not None else ()), 1)
        return (
            f"x={fix(x)},y={fix(y)},clockwise={flag[self.clockwise]},"
            f"dynamic_clockwise={flag[config.clockwise == 'best']},"
            f"center_activate={flag[config.center_activate]},"
            f'desired_speed={num(self.speed_in_force, 3)},polygon="{shape}"'
        )

    # --- state changes ------------------------------------------------------------------------------------

    def on_idle_to_run(self) -> None:
        self.post(
            "BHV_SETTINGS", f"type={type(self).BHV_NAME},name={self.name},{self.settings()}", repeat=True
        )
        self.engine.forget_distance()
        self._fresh = True
        self._bearing = None
        self._turned = 0.0
        if self.config.center_activate:
            self._own_center_due = True

    def on_idle(self) -> None:
        self._mode = "idle"
        self._erase()
        self._tell_status()

    def on_complete(self) -> None:
        self._erase()

    # --- running ------------------------------------------------------------------------------------------

    def on_run(self) -> IvPFunction | None:
        polygon = self.polygon
        if polygon is None:
            self.warn(NO_POLYGON)
            self.why = "there is no polygon"
            return None
        own = self.own
        self._distance = polygon.signed_dist(own.x, own.y)
        self._acquiring = self._distance > self.config.acquire_dist
        self._mode = self._next_mode()
        self._eta = self._time_to_polygon(own.speed)
        if self._own_center_due:
            self._own_center_due = False
            self._take(polygon.centered_at(own.x, own.y))
            self._acquiring = self._distance > self.config.acquire_dist
        if self._fresh or self._acquiring:
            self._acquire()
        self.engine.arrive(own.x, own.y)
        done = self._circled_enough()
        px, py = self.engine.current
        self.post("LOITER_DIST_TO_VERT", hypot(own.x - px, own.y - py))
        self._draw()
        self._tell_status()
        if done:
            self.complete(f"circled {num(self._turned, 1)} degrees")
            self._turned = 0.0
            self._erase()
            self.post("LOITER_COMPLETE", "true")
        return self._function()

    def _acquire(self) -> None:
        """Choose the vertex to join at, and on starting the direction if it is left to us."""
        own, polygon = self.own, self.polygon
        assert polygon is not None
        if self._fresh and self.config.clockwise == "best" and not polygon.contains(own.x, own.y):
            other = polygon.reversed()
            right, left = (polygon, other) if self.clockwise else (other, polygon)
            clockwise = better_clockwise(right, left, own.x, own.y, own.heading)
            if clockwise != self.clockwise:
                self.clockwise = clockwise
                self._take(polygon)
                polygon = self.polygon or polygon
                self._acquiring = self._distance > self.config.acquire_dist
        self._fresh = False
        factor = self.config.spiral_factor
        spiral = DEFAULT_SPIRAL if factor is None else -75.0 + 0.74 * factor
        index = entry(polygon, self.clockwise, own.x, own.y, own.heading, spiral)
        if index != self.engine.index:
            self.engine.set_index(index)

    def _next_mode(self) -> str:
        if abs(self._distance) <= self.config.acquire_dist:
            return "stable"
        side = "external" if self._distance > 0.0 else "internal"
        known = self._mode in ("stable", f"recovering_{side}")
        return f"recovering_{side}" if known else f"acquiring_{side}"

    def _time_to_polygon(self, speed: float) -> float | None:
        """Seconds at the present speed, None if that is no number."""
        if self._distance <= 0.0:
            return 0.0
        return self._distance / speed if speed > 1e-3 else None

    def _circled_enough(self) -> bool:
        """Follow own ship's bearing from the centre; True when the slingshot is to be released."""
        limit = float(self.config.slingshot)
        if limit < 0.0:
            return False
        assert self.polygon is not None
        around = bearing(*self.polygon.center, self.own.x, self.own.y)
        if self._bearing is not None:
            turn = angle180(around - self._bearing)
            turn = turn if self.clockwise else -turn
            self._turned += turn
            self.post("LOITER_BNG_TOTAL", self._turned)
            self.post("LOITER_BNG_DELTA", turn)
        self._bearing = around
        return self._turned >= limit

    @property
    def speed_in_force(self) -> float:
        """Metres per second."""
        config = self.config
        speed = config.speed_alt if config.use_alt_speed and config.speed_alt >= 0.0 else config.speed
        return float(min(speed, self.max_speed))

    def _function(self) -> IvPFunction:
        own, config, domain, engine = self.own, self.config, self.domain, self.engine
        course, speed = bearing(own.x, own.y, *engine.current), self.speed_in_force
        mode, distance, vertex, count = self._mode, self._distance, engine.index + 1, len(engine.points)
        self.explain(
            lambda: (
                f"{mode}, {abs(distance):.0f} m {'outside' if distance > 0 else 'inside'}"
                f" the polygon, vertex {vertex} of {count} at {num(speed, 2)} m/s"
            )
        )
        if config.ipf_type == "zaic_spd":
            preference = speed_band(domain, speed, 85.0, 20.0)
        else:
            preference = speed_peak(domain, speed, 0.0, 0.3)
        return toward(domain, course, preference, config.patience, 100.0 - config.patience)

    # --- words for flags ----------------------------------------------------------------------------------

    def macro(self, name: str) -> float | str | None:
        polygon = self.polygon if self.polygon is not None else Polygon(())
        cx, cy = polygon.center
        values: dict[str, float | str] = {
            "PTS": seglist_text(Polygon(polygon.points), 1),
            "CX": cx,
            "CY": cy,
            "CENTER": f"{num(cx, 2)},{num(cy, 2)}",
            "CWISE": "true" if self.clockwise else "false",
            "RAD": polygon.max_radius,
        }
        return values.get(name)

    # --- telling ------------------------------------------------------------------------------------------

    def _tell_status(self) -> None:
        engine, suffix = self.engine, self.config.post_suffix
        acquiring = "true" if self._acquiring else "false"
        key = (engine.index, engine.capture_hits, engine.hits, acquiring)
        if key != self._report_key:
            self._report_key = key
            self._report_text = (
                f"index={engine.index},capture_hits={engine.capture_hits},"
                f"nonmono_hits={engine.hits - engine.capture_hits},acquire_mode={acquiring}"
            )
        self.post(f"LOITER_REPORT{suffix}", self._report_text)
        self.post(f"LOITER_INDEX{suffix}", float(engine.index))
        self.post(f"LOITER_MODE{suffix}", self._mode)
        self.post(f"LOITER_ACQUIRE{suffix}", float(self._acquiring))
        self._post_rounded(f"LOITER_DIST_TO_POLY{suffix}", self._distance)
        if self._eta is not None:
            self._post_rounded(f"LOITER_ETA_TO_POLY{suffix}", self._eta)

    def _post_rounded(self, variable: str, value: float) -> None:
        if value > 10.0:
            self.post_int(variable, value)
        else:
            self.post(variable, value)

    # --- drawing ------------------------------------------------------------------------------------------

    def _draw(self) -> None:
        if not self.visuals:
            return
        self._write_shape()
        self.post("VIEW_POLYGON", self._shape_text)
        self._shown = self.engine.current
        key = (self._shown, self.hints)
        if self._point_key != key:
            self._point_key = key
            self._point_text = self._write_point()
        self.post("VIEW_POINT", self._point_text)

    def _write_point(self) -> str:
        hints = self.hints
        looks = Attributes(
            label=self._point_label,
            label_color=hints.color("label_color", "nextpt"),
            vertex_color=hints.color("color", "nextpt"),
            vertex_size=hints.size("vertex_size", "nextpt"),
        )
        return point_text(Point(*self._shown, attributes=looks))

    def _erase(self) -> None:
        if not self.visuals or self.polygon is None:
            return
        self._write_shape()
        gone = Attributes(label=self._point_label, active=False)
        self.post("VIEW_POINT", point_text(Point(*self._shown, attributes=gone)))
        self.post("VIEW_POLYGON", self._erase_text)

    def _write_shape(self) -> None:
        assert self.polygon is not None
        key = (self.polygon.points, self.hints, self._label)
        if self._shape_key == key:
            return
        self._shape_key = key
        base = Attributes(label=self._label or f"{self.community}_{self.name.lower()}")
        shape = Polygon(self.polygon.points, attributes=self.hints.attributes(base=base))
        self._shape_text = seglist_text(shape)
        gone = Attributes(label=base.label, active=False)
        self._erase_text = seglist_text(Polygon(self.polygon.points, attributes=gone))
