"""BHV_OpRegion: stop the vehicle where it must not be (behaviors.md C23)."""

from __future__ import annotations

from behaviors import forms
from behaviors.perimeter import Perimeter
from behaviors.region_watch import RegionWatch
from ivp_helm.behavior import Behavior
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.hints import VisualHints
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.specs import seglist_text
from pymoos_lite.geometry.text import fix, num

HINTS = VisualHints(
    {
        "vertex_color": "brown",
        "edge_color": "aqua",
        "label_color": "aqua",
        "vertex_size": 3.0,
        "edge_size": 1.0,
    }
)
HINT_KEYS = ("vertex_color", "edge_color", "label_color", "vertex_size", "edge_size")
RESETS = ("true", "poly", "time", "altitude", "depth")


class OpRegion(Behavior):
    """Limits of place, depth, altitude and time; each breach is an error, so the helm stops the vehicle.

    It never steers. OpRegionV24 does, and is the better choice for new missions.
    """

    BHV_NAME = "BHV_OpRegion"
    DEFAULT_NAME = "bhv_opregion"
    VARIABLES = ()
    CONSTRAINT = True
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED", "NAV_DEPTH", "NAV_ALTITUDE")
    PARAMETERS = Declaration(
        (
            forms.polygon("polygon", "The region to stay in; convex."),
            forms.number("max_depth", 0.0, "m", "Greatest depth; 0: no limit."),
            forms.number("min_altitude", 0.0, "m", "Least height above the bottom; 0: no limit."),
            forms.number("max_time", 0.0, "s", "Longest time of running; 0: no limit."),
            forms.number(
                "trigger_entry_time", 1.0, "s", "Given: the region counts once it was entered for so long."
            ),
            forms.number("trigger_exit_time", 0.5, "s", "Time outside after which the region is left."),
            Parameter(
                "soft_poly_breach", "boolean", False, "", "Leaving takes manual control instead of an error."
            ),
            forms.variable(
                "reset_var", "", "A fresh true, poly, time, altitude or depth in it forgets breaches."
            ),
            forms.variable("time_remaining_var", "", "Variable for the seconds left of max_time."),
            forms.variable("opregion_poly_var", "", "Variable for the polygon."),
            forms.flag("breached_poly_flag", "Posted once on leaving the region."),
            forms.flag("breached_time_flag", "Posted once when max_time is over."),
            forms.flag("breached_depth_flag", "Posted once below max_depth."),
            forms.flag("breached_altitude_flag", "Posted once below min_altitude."),
            forms.hint_lines("edge_color=white"),
        )
    )

    def setup(self) -> None:
        self.region_watch = RegionWatch()
        self.hints = HINTS
        self._began: float | None = None
        self._told: set[str] = set()
        """Breaches whose flags were posted."""
        self._drawn = False

    def set_visual_hints(self, text: str) -> None:
        self.hints, complaints = forms.tolerant_hints(self.hints, text, HINT_KEYS)
        for complaint in complaints:
            self.event(complaint)

    def on_parameters(self) -> None:
        self.watch(self.config.reset_var)
        polygon = self.config.polygon
        if polygon is not None and self.config.opregion_poly_var:
            self.post(self.config.opregion_poly_var, seglist_text(Polygon(polygon.points)))

    # --- states -------------------------------------------------------------------------------------------

    def on_every_state(self) -> None:
        variable = self.config.reset_var
        if variable and self.buffer.updated(variable):
            word = (self.buffer.text(variable) or "").strip().lower()
            if word in RESETS:
                self._reset(word)

    def _reset(self, word: str) -> None:
        everything = word == "true"
        if everything or word == "poly":
            self.region_watch.restart()
        if everything or word == "time":
            self._began = None
        self._told = set() if everything else self._told - {word}

    def on_idle(self) -> None:
        polygon = self.config.polygon
        if self.visuals and polygon is not None:
            label = self._label if self._drawn else ""
            self.post("VIEW_POLYGON", seglist_text(Polygon(polygon.points, attributes=_gone(label))))

    def on_complete(self) -> None:
        self.on_idle()

    def on_run(self) -> None:
        if self._began is None:
            self._began = self.now
        self.why = "within all limits"
        for check in (self._check_region, self._check_depth, self._check_altitude, self._check_time):
            check()

    # --- limits -------------------------------------------------------------------------------------------

    def _check_region(self) -> None:
        config, own, polygon = self.config, self.own, self.config.polygon
        if polygon is None:
            return
        self._tell_perimeter(polygon)
        self.region_watch.update(polygon.contains(own.x, own.y), self.now, config.trigger_entry_time)
        self.post("SECS_IN_POLY", self.region_watch.seconds_inside)
        self._draw(polygon)
        armed = self.region_watch.entered or not self._waits_for_entry
        if armed and self.region_watch.left(config.trigger_exit_time):
            text = f"BHV_OpRegion Polygon containment failure:  x={fix(own.x, 1)} y={fix(own.y, 1)}"
            if config.soft_poly_breach:
                self._flag("poly")
                self.post("MOOS_MANUAL_OVERRIDE", "true")
                self.warn(text)
                self.why = text
            else:
                self._fail("poly", text)

    @property
    def _waits_for_entry(self) -> bool:
        return "trigger_entry_time" in self.given and self.config.trigger_entry_time > 0.0

    def _check_depth(self) -> None:
        limit = self.config.max_depth
        if limit > 0.0:
            depth = self.buffer.number("NAV_DEPTH")
            if depth is None:
                self.error("No ownship depth in info_buffer.")
            elif depth > limit:
                self._fail("depth", f"OpRegion Depth failure: max:{num(limit, 2)} detected:{num(depth, 2)}")

    def _check_altitude(self) -> None:
        limit = self.config.min_altitude
        if limit > 0.0:
            altitude = self.buffer.number("NAV_ALTITUDE")
            if altitude is None:
                self.error("No ownship altitude in info_buffer.")
            elif altitude < limit:
                self._fail(
                    "altitude", f"OpRegion Altitude failure: min:{num(limit, 2)} detected:{num(altitude, 2)}"
                )

    def _check_time(self) -> None:
        limit = self.config.max_time
        if limit <= 0.0:
            return
        assert self._began is not None
        elapsed = self.now - self._began
        left = max(0.0, limit - elapsed)
        self.post("OPREG_TIME_REMAINING", left)
        self.post(self.config.time_remaining_var, left)
        if elapsed > limit:
            self._fail("time", f"OpRegion timeout failure: max:{num(limit, 2)} elapsed:{num(elapsed, 2)}")

    def _fail(self, which: str, text: str) -> None:
        self._flag(which)
        self.error(text)
        self.why = text

    def _flag(self, which: str) -> None:
        if which not in self._told:
            self._told.add(which)
            self.post_flags(getattr(self.config, f"breached_{which}_flag"))

    # --- telling ------------------------------------------------------------------------------------------

    def _tell_perimeter(self, polygon: Polygon) -> None:
        edge = Perimeter.measure(polygon, self.own, self.max_speed)
        self.post_int("OPREG_TRAJECTORY_PERIM_DIST", edge.trajectory_dist)
        self.post_int("OPREG_TRAJECTORY_PERIM_ETA", edge.trajectory_eta)
        self.post_int("OPREG_ABSOLUTE_PERIM_DIST", edge.absolute_dist)
        self.post_int("OPREG_ABSOLUTE_PERIM_ETA", edge.absolute_eta)

    @property
    def _label(self) -> str:
        return f"{self.community}:{self.name}:opreg"

    def _draw(self, polygon: Polygon) -> None:
        if self.visuals:
            self._drawn = True
            looks = self.hints.attributes(base=Attributes(label=self._label))
            self.post("VIEW_POLYGON", seglist_text(Polygon(polygon.points, attributes=looks)))


def _gone(label: str) -> Attributes:
    return Attributes(label=label, active=False)
