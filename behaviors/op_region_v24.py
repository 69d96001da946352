"""BHV_OpRegionV24: stay in a region, come back into it, stop before leaving it for good (behaviors.md C5)."""

from __future__ import annotations

from collections.abc import Iterable

from behaviors import forms
from behaviors.region_watch import RegionWatch
from behaviors.steering import speed_peak
from behaviors.way_back import Side, way_back
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction, couple
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.buffer import buffered
from pymoos_lite.geometry.hints import VisualHints
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.specs import erase_seglist_text, parse_polygon, seglist_text

COURSE_WEIGHT, SPEED_WEIGHT = 80.0, 20.0
ARC_DEGREES = 15.0
STATUS_RADIUS = 4.0
REGIONS = ("core", "save", "halt")

HINTS = VisualHints(
    {
        "vertex_size": 0.0,
        "edge_size": 1.0,
        "vertex_color": "gray50",
        "edge_color": "gray50",
        "label_color": "off",
        "core_edge_color": "gray30",
        "save_edge_color": "gray50",
        "halt_edge_color": "pink",
        "save_status_edge_color": "yellow",
        "halt_status_edge_color": "red",
    },
    (*REGIONS, "save_status", "halt_status"),
)


def _reset(text: str) -> bool:
    if text.strip().lower() != "true":
        raise ValueError("only true has a meaning")
    return True


def _distance(name: str, doc: str) -> Parameter:
    reader = forms.read_off_or(lambda value: value >= 0.0, "metres of at least 0")
    return forms.custom(name, reader, None, doc, "off", unit="m")


PARAMETERS = Declaration(
    (
        forms.polygon("core_poly", "The region to stay in; convex."),
        forms.polygon("save_poly", "Outside of this the vessel is steered back; convex."),
        forms.polygon("halt_poly", "Outside of this the vessel is stopped; convex."),
        _distance("save_dist", "save_poly is core_poly widened by so much."),
        _distance("halt_dist", "halt_poly is core_poly widened by so much."),
        forms.number("max_depth", 0.0, "m", "Deeper than this the vessel is stopped; 0: no limit."),
        forms.number("min_altitude", 0.0, "m", "Nearer to the bottom than this it is stopped; 0: no limit."),
        forms.number("max_time", 0.0, "s", "After running so long it is stopped; 0: no limit."),
        forms.number(
            "recover_spd",
            0.8,
            "m/s",
            "Speed of coming back.",
            open_low=True,
            aliases=("recover_speed",),
        ),
        Parameter("trigger_on_poly_entry", "boolean", True, "", "halt_poly counts only once it was entered."),
        forms.number("trigger_entry_time", 1.0, "s", "Time inside halt_poly after which it is entered."),
        forms.number("trigger_exit_time", 0.5, "s", "Time outside halt_poly after which it is left."),
        forms.variable("dynamic_region_var", "", "Variable that brings new core polygons."),
        forms.custom("reset", _reset, False, "true: forget entries and clocks.", "true"),
        forms.flag("save_flag", "Posted on leaving save_poly."),
        forms.flag("savex_flag", "Posted in every iteration outside save_poly."),
        forms.flag("breached_poly_flag", "Posted on leaving halt_poly."),
        forms.flag("breached_time_flag", "Posted when max_time is over."),
        forms.flag("breached_depth_flag", "Posted below max_depth."),
        forms.flag("breached_altitude_flag", "Posted below min_altitude."),
        Parameter("draw_save_status", "boolean", True, "", "Mark own ship outside save_poly."),
        Parameter("draw_halt_status", "boolean", True, "", "Mark own ship outside halt_poly."),
        forms.hint_lines("core_edge_color=white"),
    )
)


class OpRegionV24(Behavior):
    """Three nested regions: free inside the first, steered back outside the second, stopped outside the third.

    It also limits depth, altitude and time. Each breach is an error, so the helm stops the vehicle.
    """

    BHV_NAME = "BHV_OpRegionV24"
    DEFAULT_NAME = "bhv_opregion"
    PARAMETERS = PARAMETERS
    CONSTRAINT = True
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED", "NAV_DEPTH", "NAV_ALTITUDE")

    def setup(self) -> None:
        self.regions: dict[str, Polygon] = {}
        """Those that are defined, by the names of `REGIONS`."""
        self.hints = HINTS
        self.halt_watch = RegionWatch()
        self.save_watch = RegionWatch()
        self._outside_save = False
        self._side: Side = "none"
        self._began: float | None = None
        self._drawing_key: tuple[object, ...] = ()
        self._drawing: list[str] = []

    # --- parameters ---------------------------------------------------------------------------------------

    def set_visual_hints(self, text: str) -> None:
        self.hints = self.hints.updated(text)

    def set_reset(self, wanted: bool) -> None:
        self.halt_watch.restart()
        self.save_watch.restart()
        self._outside_save = False
        self._side = "none"
        self._began = None

    def check(self) -> Iterable[str]:
        config = self.config
        for which in ("save", "halt"):
            if getattr(config, f"{which}_dist") is not None and config.core_poly is None:
                yield f"{which}_dist needs a core_poly"

    def on_parameters(self) -> None:
        config = self.config
        self.watch(config.dynamic_region_var)
        for key in self.hints.unknown_keys():
            self.event(f"visual_hints: nothing is drawn with '{key}'")
        self._define_regions()
        self._draw_regions()

    def _define_regions(self) -> None:
        config = self.config
        core = config.core_poly
        found = {"core": core, "save": config.save_poly, "halt": config.halt_poly}
        if core is not None:
            for which in ("save", "halt"):
                distance = getattr(config, f"{which}_dist")
                if distance is not None:
                    found[which] = buffered(core, distance, ARC_DEGREES)
        self.regions = {which: polygon for which, polygon in found.items() if polygon is not None}

    # --- states -------------------------------------------------------------------------------------------

    def on_every_state(self) -> None:
        variable = self.config.dynamic_region_var
        if variable and self.buffer.updated(variable):
            text = self.buffer.text(variable) or ""
            try:
                vars(self.config)["core_poly"] = parse_polygon(text)
            except ValueError as error:
                self.warn(f"{variable}: {error}")
                return
            self._define_regions()
            self._draw_regions()

    def on_idle_to_run(self) -> None:
        self._draw_regions()

    def on_run_to_idle(self) -> None:
        self._side = "none"
        self._erase_status()

    def on_complete(self) -> None:
        self._erase_status()

    # --- running ------------------------------------------------------------------------------------------

    def on_run(self) -> IvPFunction | None:
        own = self.own
        if self._began is None:
            self._began = self.now
        inside = {which: polygon.contains(own.x, own.y) for which, polygon in self.regions.items()}
        self.halt_watch.update(inside.get("halt", True), self.now, self.config.trigger_entry_time)
        in_save = inside.get("save", True)
        self.save_watch.update(in_save, self.now, 0.0)
        if self._breached():
            self.why = "a limit is breached"
            return None
        if in_save:
            self._outside_save = False
            self._side = "none"
            self._erase_status()
            self.why = "inside the region"
            return None
        if not self.save_watch.entered:
            self.why = "outside the region, which was never entered"
            return None
        return self._come_back()

    def _breached(self) -> bool:
        """Post everything that is wrong; True if anything is."""
        config = self.config
        errors: list[str] = []
        if config.max_depth > 0.0:
            depth = self.buffer.number("NAV_DEPTH")
            if depth is None:
                errors.append("No ownship depth in info_buffer.")
            elif depth > config.max_depth:
                self.post_flags(config.breached_depth_flag, repeat=False)
                errors.append("OpRegion Depth failure")
        if config.min_altitude > 0.0:
            altitude = self.buffer.number("NAV_ALTITUDE")
            if altitude is None:
                errors.append("No ownship altitude in info_buffer.")
            elif altitude < config.min_altitude:
                self.post_flags(config.breached_altitude_flag, repeat=False)
                errors.append("OpRegion Altitude failure")
        if config.max_time > 0.0 and self._elapsed > config.max_time:
            self.post_flags(config.breached_time_flag, repeat=False)
            errors.append("OpRegion timeout failure")
        armed = self.halt_watch.entered or not config.trigger_on_poly_entry
        if armed and self.halt_watch.left(config.trigger_exit_time):
            if config.draw_halt_status:
                self._draw_status("halt_status", 8, None)
            self.post_flags(config.breached_poly_flag, repeat=False)
            errors.append("OpRegion HaltPoly Failure")
        for text in errors:
            self.error(text)
        return bool(errors)

    def _come_back(self) -> IvPFunction:
        config, own = self.config, self.own
        if not self._outside_save:
            self._outside_save = True
            self.post_flags(config.save_flag)
        self.post_flags(config.savex_flag, repeat=False)
        if config.draw_save_status:
            self._draw_status("save_status", 12, 2.0)
        back = way_back(self.domain, self.regions["save"], own.x, own.y, own.heading, self._side)
        self._side = back.side
        self.post("COMMITTED", self._side, repeat=True)
        self._draw_regions()
        self.why = f"{self._far('save'):.0f} m outside the region, coming back"
        speed = speed_peak(self.domain, config.recover_spd, config.recover_spd / 2.0, 0.2, 20.0)
        return couple(back.course, speed, COURSE_WEIGHT, SPEED_WEIGHT)

    @property
    def _elapsed(self) -> float:
        return 0.0 if self._began is None else self.now - self._began

    # --- words for flags ----------------------------------------------------------------------------------

    def macro(self, name: str) -> float | str | None:
        config = self.config
        kind, _, which = name.rpartition("_")
        which = which.lower()
        if which in REGIONS:
            measures = {"DIST_TO": False, "TRAJ_DIST_TO": False, "ETA_TO": True, "TRAJ_ETA_TO": True}
            if kind in measures:
                distance = self._far(which, along=kind.startswith("TRAJ"))
                return self._seconds(distance) if measures[kind] else distance
        for which in REGIONS:
            if name == f"{which.upper()}_POLY":
                polygon = self.regions.get(which)
                return "" if polygon is None else seglist_text(Polygon(polygon.points), 3)
        depth, altitude = self.buffer.number("NAV_DEPTH"), self.buffer.number("NAV_ALTITUDE")
        values: dict[str, float | None] = {
            "SAVE_DIST": -1.0 if config.save_dist is None else config.save_dist,
            "HALT_DIST": -1.0 if config.halt_dist is None else config.halt_dist,
            "SECS_IN_HALT_POLY": self.halt_watch.seconds_inside,
            "SECS_OUT_HALT_POLY": self.halt_watch.seconds_outside,
            "SECS_OUT_SAVE_POLY": self.save_watch.seconds_outside,
            "TIME_LEFT": config.max_time - self._elapsed if config.max_time > 0.0 else None,
            "DEPTH_LEFT": config.max_depth - depth if config.max_depth > 0.0 and depth is not None else None,
            "ALT_LEFT": altitude - config.min_altitude if altitude is not None else None,
        }
        if name not in values:
            return None
        value = values[name]
        return "n/a" if value is None else value

    def _far(self, which: str, along: bool = False) -> float:
        """Metres to the edge of a region, the nearest way or along the heading; -1 if there is none."""
        polygon, own = self.regions.get(which), self.surroundings.own
        if polygon is None or own is None:
            return -1.0
        return polygon.ray_dist(own.x, own.y, own.heading) if along else polygon.dist(own.x, own.y)

    def _seconds(self, distance: float) -> float:
        return distance / self.max_speed if distance >= 0.0 and self.max_speed > 0.0 else -1.0

    # --- drawing ------------------------------------------------------------------------------------------

    @property
    def _status_label(self) -> str:
        return f"{self.community}_stat"

    def _draw_regions(self) -> None:
        if not self.visuals:
            return
        key = (tuple(self.regions.values()), self.hints)
        if key != self._drawing_key:
            self._drawing_key = key
            labels = {
                "core": f"core{self.community}",
                "save": f"opreg_save_{self.community}",
                "halt": f"opreg_halt_{self.community}",
            }
            self._drawing = [
                seglist_text(
                    Polygon(
                        polygon.points,
                        attributes=self.hints.attributes(which, Attributes(label=labels[which])),
                    ),
                    3,
                )
                for which, polygon in self.regions.items()
            ]
        for text in self._drawing:
            self.post("VIEW_POLYGON", text)

    def _erase_status(self) -> None:
        if self.visuals:
            self.post("VIEW_POLYGON", erase_seglist_text(self._status_label))

    def _draw_status(self, which: str, corners: int, duration: float | None) -> None:
        if not self.visuals:
            return
        own = self.own
        circle = Polygon.radial(own.x, own.y, STATUS_RADIUS, corners)
        looks = self.hints.attributes(which, Attributes(label=self._status_label, duration=duration))
        self.post("VIEW_POLYGON", seglist_text(Polygon(circle.points, attributes=looks), 1))
