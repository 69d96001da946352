"""BHV_Voronoi: go to the middle of the own cell, and rest there (gcid.md 14).

The cell and its region come from the cell app (pProxonoi) in PROXONOI_POLY and PROXONOI_REGION.
"""

from __future__ import annotations

from math import hypot

from mypy_extensions import mypyc_attr

from behaviors import forms
from behaviors.steering import speed_peak, toward
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.geometry.angles import bearing
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.shapes import XY, Point
from pymoos_lite.geometry.specs import erase_point_text, parse_point, parse_polygon, point_text

CELL, REGION, SEARCH = "PROXONOI_POLY", "PROXONOI_REGION", "PROX_SEARCHCENTER"
BASE_WIDTH, SUMMIT_DELTA = 1.6, 20.0
SLIPPING_LEAST = 0.1  # of the relevance of an activated vessel


@mypyc_attr(allow_interpreted_subclasses=True)
class Voronoi(Behavior):
    """Sails to a set point in the own cell while it is far from it, and lets go the nearer it comes.

    captured   within `capture_radius` of the set point: no function
    slipping   was captured, not yet beyond `activate_radius`: a tenth of the weight up to all of it
    activated  on the way: full weight
    """

    BHV_NAME = "BHV_Voronoi"
    DEFAULT_NAME = "bhv_voronoi"
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED", CELL, REGION, SEARCH)
    PARAMETERS = Declaration(
        (
            forms.number("speed", 0.0, "m/s", "Speed on the way."),
            forms.number("capture_radius", 10.0, "m", "Within it the set point is reached.", open_low=True),
            forms.number("activate_radius", 12.0, "m", "Beyond it the vessel sets out again."),
            forms.number("stale_nav_thresh", 5.0, "s", "Age of the position at which it gives up."),
            forms.number("stale_poly_thresh", 10.0, "s", "Age at which the cell is not believed any more."),
            Parameter("setpt_method", "choice", "center", "", "Which point of the cell: middle of its box, centre "
                      "of gravity, or PROX_SEARCHCENTER.", choices=("center", "centroid", "gridsearch")),
            Parameter("allow_slipping", "boolean", False, "", "Go on for ever; false: complete on capture."),
            forms.polygon("op_region", "The region, until PROXONOI_REGION says another."),
            forms.hint_lines("setpt_color=white"),
        ),
        ignored=("visual_hints", "setpt_viewable", "post_poly"),
    )  # fmt: skip

    def setup(self) -> None:
        self.phase = "activated"
        self.set_point: XY | None = None
        self._texts: dict[str, str] = {}
        self._shapes: dict[str, Polygon | None] = {CELL: None, REGION: None}

    def on_run(self) -> IvPFunction | None:
        config, own = self.config, self.own
        if (self.buffer.age("NAV_X") or 0.0) > config.stale_nav_thresh:
            self.warn("the position is stale")
            return None
        self.retract_warning("the position is stale")
        self.set_point = self._choose()
        if self.set_point is None:
            self.why = "there is neither a cell nor a region"
            return None
        x, y = self.set_point
        distance = hypot(x - own.x, y - own.y)
        relevance = self._update_phase(distance)
        self._tell(distance)
        self.why = f"{self.phase}, {distance:.0f} m from the set point"
        if self.phase == "captured":
            if not config.allow_slipping:
                self.complete("captured")
            return None
        self.relevance = relevance * 100.0
        speed = speed_peak(self.domain, config.speed, config.speed / 2.0, BASE_WIDTH, SUMMIT_DELTA)
        return toward(self.domain, bearing(own.x, own.y, x, y), speed)

    # --- where to -----------------------------------------------------------------------------------------

    def _choose(self) -> XY | None:
        own = self.own
        region = self._shape(REGION) or self.config.op_region
        cell = self._shape(CELL)
        if (self.buffer.age(CELL) or 0.0) > self.config.stale_poly_thresh:
            cell = None
        if cell is not None and region is not None and not region.contains(own.x, own.y):
            cell = None
        polygon = cell or region
        if polygon is None:
            return None
        method = self.config.setpt_method
        if method == "gridsearch" and cell is not None:
            point = self._search_center()
            if point is not None:
                return point
        return polygon.area_centroid if method == "centroid" else polygon.center

    def _search_center(self) -> XY | None:
        text = self.buffer.text(SEARCH)
        if not text:
            return None
        try:
            point = parse_point(text)
        except ValueError as error:
            self.warn(f"{SEARCH}: {error}")
            return None
        return point.x, point.y

    def _shape(self, variable: str) -> Polygon | None:
        """The polygon in a variable; None if there is none, or it is inactive. Parsed once per text."""
        text = self.buffer.text(variable) or ""
        if text != self._texts.get(variable, ""):
            self._texts[variable] = text
            try:
                # A cell is convex by its making, but for round-off in the text.
                polygon = parse_polygon(text, convex=variable == REGION)
                self._shapes[variable] = polygon if polygon.attributes.active and len(polygon) >= 3 else None
            except ValueError as error:
                self.warn(f"{variable}: {error}")
        return self._shapes[variable]

    # --- how badly ----------------------------------------------------------------------------------------

    def _update_phase(self, distance: float) -> float:
        """Set the phase; the share of the full weight, 0 to 1."""
        capture: float = self.config.capture_radius
        activate = max(self.config.activate_radius, 1.02 * capture, capture + 2.0)
        if distance <= capture:
            self.phase = "captured"
            return 0.0
        if distance >= activate or self.phase == "activated":
            self.phase = "activated"
            return 1.0
        self.phase = "slipping"
        return float(SLIPPING_LEAST + (1.0 - SLIPPING_LEAST) * (distance - capture) / (activate - capture))

    def _tell(self, distance: float) -> None:
        self.post("VOI_STATE", self.phase)
        self.post("BVOI_STATE", self.phase)
        self.post_int("VOI_DIST_TO_SETPT", distance)
        if self.visuals and self.set_point is not None:
            looks = Attributes(label=self._label, vertex_color="white", vertex_size=3.0)
            text = point_text(Point(*self.set_point, attributes=looks), 1)
            self.post("BVOI_SETPT", text)
            self.post("VIEW_POINT", text)

    @property
    def _label(self) -> str:
        return f"{self.community}:{self.name}:setpt"

    # --- leaving ------------------------------------------------------------------------------------------

    def on_run_to_idle(self) -> None:
        self.post("PROX_CLEAR", "true", repeat=True)
        self.phase = "activated"
        self._erase()

    def on_complete(self) -> None:
        self._erase()

    def _erase(self) -> None:
        if self.visuals:
            self.post("VIEW_POINT", erase_point_text(self._label))
