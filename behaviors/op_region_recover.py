"""BHV_OpRegionRecover: come back into a region once it was left (behaviors.md C24)."""

from __future__ import annotations

from behaviors import forms
from behaviors.region_watch import RegionWatch
from behaviors.steering import coupled
from behaviors.way_back import Side, way_back
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction, zaic_spd
from pymoos_lite.config.parameters import Declaration
from pymoos_lite.geometry.buffer import buffered
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.specs import parse_polygon

SPEED, LOW, HIGH = 0.3, 0.1, 0.5
AT_REST, AT_FULL = 80.0, 30.0
"""Utilities of standing still and of full speed: it would rather wait than rush off."""
ARC_DEGREES = 15.0


class OpRegionRecover(Behavior):
    """Has no opinion inside its region; outside, once the region was entered, it steers back.

    The region may be replaced at run time through `dynamic_region_var`; a truthy post of `reset_var` makes
    it wait for the next entry.
    """

    BHV_NAME = "BHV_OpRegionRecover"
    DEFAULT_NAME = "bhv_opregion_recover"
    CONSTRAINT = True
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED")
    PARAMETERS = Declaration(
        (
            forms.polygon("polygon", "The region to stay in; convex.", "region"),
            forms.number("buffer_dist", 0.0, "m", "The vessel counts as inside up to so far outside."),
            forms.number("trigger_entry_time", 1.0, "s", "Time inside after which the region is entered."),
            forms.number("trigger_exit_time", 0.5, "s", "Time outside after which it is left."),
            forms.variable("dynamic_region_var", "", "Variable that brings new polygons."),
            forms.variable("reset_var", "", "true in this variable: wait for the next entry."),
            forms.hint_lines("edge_color=white"),
        ),
        ignored=("visual_hints",),
    )

    def setup(self) -> None:
        self.watch_region = RegionWatch()
        self.region: Polygon | None = None
        self._side: Side = "none"

    def on_parameters(self) -> None:
        config = self.config
        self.watch(config.dynamic_region_var, config.reset_var)
        self._take(config.polygon)

    def _take(self, polygon: Polygon | None) -> None:
        self.region = None if polygon is None else buffered(polygon, self.config.buffer_dist, ARC_DEGREES)

    def on_every_state(self) -> None:
        config = self.config
        if config.dynamic_region_var and self.buffer.updated(config.dynamic_region_var):
            text = self.buffer.text(config.dynamic_region_var) or ""
            try:
                self._take(parse_polygon(text))
            except ValueError as error:
                self.warn(f"{config.dynamic_region_var}: {error}")
        reset = config.reset_var
        if reset and self.buffer.updated(reset) and (self.buffer.text(reset) or "").lower() in ("true", "poly"):
            self.watch_region.restart()
            self._side = "none"

    def on_run(self) -> IvPFunction | None:
        config, own, region = self.config, self.own, self.region
        if region is None:
            self.why = "there is no region"
            return None
        watch = self.watch_region
        watch.update(region.contains(own.x, own.y), self.now, config.trigger_entry_time)
        if not watch.entered or not watch.left(config.trigger_exit_time):
            self._side = "none"
            self.why = "inside the region" if watch.entered else "the region was not entered yet"
            return None
        back = way_back(self.domain, region, own.x, own.y, own.heading, self._side)
        self._side = back.side
        self.post("OPR_TURN", self._side)
        self.why = f"{region.dist(own.x, own.y):.0f} m outside the region, coming back"
        speed = zaic_spd(self.domain, "speed", SPEED, LOW, HIGH, 0.0, 0.0, AT_REST, AT_FULL)
        return coupled(back.course, speed)
