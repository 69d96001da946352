"""BHV_OpRegionRecover: come back into a region (behaviors.md C24)."""

from __future__ import annotations

from functools import lru_cache

from mypy_extensions import mypyc_attr

from behaviors import forms
from behaviors.perimeter import Perimeter
from behaviors.region_watch import RegionWatch
from behaviors.way_back import Side, way_back
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import Domain, IvPFunction, couple, zaic_spd
from pymoos_lite.config.parameters import Declaration
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.buffer import buffered
from pymoos_lite.geometry.hints import VisualHints
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.specs import parse_polygon, seglist_text

ARC_DEGREES = 15.0
HINTS = VisualHints({"vertex_color": "brown", "edge_color": "aqua", "vertex_size": 1.0, "edge_size": 1.0})
HINT_KEYS = ("vertex_color", "edge_color", "label_color", "vertex_size", "edge_size")


@lru_cache(maxsize=8)
def recovery_speed(domain: Domain) -> IvPFunction:
    """A slow return: 0.3 m/s, less stillness than full speed."""
    return zaic_spd(domain, "speed", 0.3, 0.1, 0.5, 0.0, 0.0, 80.0, 30.0)


@mypyc_attr(allow_interpreted_subclasses=True)
class OpRegionRecover(Behavior):
    """Steers a vessel slowly back into a region it was in and has left; no opinion inside.

    OpRegionV24 does the same and more, and is the better choice for new missions.
    """

    BHV_NAME = "BHV_OpRegionRecover"
    DEFAULT_NAME = "bhv_opregion_recover"
    CONSTRAINT = True
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED")
    PARAMETERS = Declaration(
        (
            forms.polygon("polygon", "The region to come back into; convex.", "region"),
            forms.number("buffer_dist", 0.0, "m", "The region is widened by so much."),
            forms.variable("dynamic_region_var", "", "Variable that brings new polygons."),
            forms.variable(
                "reset_var", "", "A fresh true or poly in it forgets that the region was entered."
            ),
            forms.number(
                "trigger_entry_time", 1.0, "s", "The region counts once it was entered for so long."
            ),
            forms.number("trigger_exit_time", 0.5, "s", "Time outside after which the region is left."),
            forms.hint_lines("edge_color=white"),
        )
    )

    def setup(self) -> None:
        self.region: Polygon | None = None
        self.region_watch = RegionWatch()
        self.hints = HINTS
        self._drawing_of: tuple[Polygon | None, VisualHints] = (None, HINTS)
        self._drawing_text = ""
        self._side: Side = "none"
        self._drawn = False

    def set_visual_hints(self, text: str) -> None:
        self.hints, complaints = forms.tolerant_hints(self.hints, text, HINT_KEYS)
        for complaint in complaints:
            self.event(complaint)

    def on_parameters(self) -> None:
        self.watch(self.config.dynamic_region_var, self.config.reset_var)
        self._define_region()

    def _define_region(self) -> None:
        polygon = self.config.polygon
        self.region = None if polygon is None else buffered(polygon, self.config.buffer_dist, ARC_DEGREES)

    # --- states -------------------------------------------------------------------------------------------

    def on_every_state(self) -> None:
        variable, reset = self.config.dynamic_region_var, self.config.reset_var
        if variable and self.buffer.updated(variable):
            try:
                vars(self.config)["polygon"] = parse_polygon(self.buffer.text(variable) or "")
            except ValueError as error:
                self.warn(f"{variable}: {error}")
            else:
                self._define_region()
        if (
            reset
            and self.buffer.updated(reset)
            and (self.buffer.text(reset) or "").lower() in ("true", "poly")
        ):
            self.region_watch.restart()
            self._side = "none"

    def on_idle(self) -> None:
        if self.visuals and self.region is not None:
            gone = Attributes(label=self._label if self._drawn else "", active=False)
            self.post("VIEW_POLYGON", seglist_text(Polygon(self.region.points, attributes=gone)))

    def on_complete(self) -> None:
        self.on_idle()

    def on_run(self) -> IvPFunction | None:
        own, region, watch = self.own, self.region, self.region_watch
        if region is None:
            if not self.config.dynamic_region_var:
                self.warn("no polygon is given")
            self.why = "there is no region"
            return None
        inside = region.contains(own.x, own.y)
        watch.update(inside, self.now, self.config.trigger_entry_time)
        self._tell(region)
        if inside:
            self._side = "none"
            self.post("OPR_DEBUG", "in poly no problemo", repeat=True)
            self.why = "inside the region"
            return None
        self.post("OPR_DEBUG", "not in poly", repeat=True)
        if not (watch.entered and watch.left(self.config.trigger_exit_time)):
            self.why = "outside the region, not yet to be taken seriously"
            return None
        back = way_back(self.domain, region, own.x, own.y, own.heading, self._side)
        self._side = back.side
        self.post("OPR_TURN", self._side)
        self.post("OPR_HDG_DIST_TO_POLY", region.ray_dist(own.x, own.y, own.heading))
        self.why = f"{region.dist(own.x, own.y):.0f} m outside the region, coming back"
        return couple(back.course, recovery_speed(self.domain))

    # --- telling ------------------------------------------------------------------------------------------

    def _tell(self, region: Polygon) -> None:
        edge = Perimeter.measure(region, self.own, self.max_speed)
        self.post("OPR_SECS_IN_POLY", self.region_watch.seconds_inside)
        self.post_int("OPR_TRAJECTORY_PERIM_DIST", edge.trajectory_dist)
        self.post_int("OPR_TRAJECTORY_PERIM_ETA", edge.trajectory_eta)
        self.post_int("OPR_ABSOLUTE_PERIM_DIST", edge.absolute_dist)
        self.post_int("OPR_ABSOLUTE_PERIM_ETA", edge.absolute_eta)
        if self.visuals:
            self._drawn = True
            self.post("VIEW_POLYGON", self._drawing(region))

    def _drawing(self, region: Polygon) -> str:
        """The region as viewers read it, written anew only when it, or how it is to look, changes."""
        if self._drawing_of != (region, self.hints):
            self._drawing_of = (region, self.hints)
            looks = self.hints.attributes(base=Attributes(label=self._label))
            self._drawing_text = seglist_text(Polygon(region.points, attributes=looks))
        return self._drawing_text

    @property
    def _label(self) -> str:
        return f"{self.community}:{self.name}:opreg"
