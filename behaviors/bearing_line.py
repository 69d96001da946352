"""BHV_BearingLine: draw a line towards a point (behaviors.md C27)."""

from __future__ import annotations

from behaviors import forms
from ivp_helm.behavior import Behavior
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.shapes import Point, SegList
from pymoos_lite.geometry.specs import erase_point_text, erase_seglist_text, point_text, seglist_text


class BearingLine(Behavior):
    """Has no opinion; draws a part of the way from own ship to a point, and the point."""

    BHV_NAME = "BHV_BearingLine"
    DEFAULT_NAME = "bhv_bearing_line"
    VARIABLES = ()
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING")
    PARAMETERS = Declaration(
        (
            forms.point("bearing_point", "The point to draw to."),
            Parameter("line_pct", "number", 50.0, "percent", "Part of the way drawn.", low=0.0, high=100.0),
            Parameter("show_pt", "boolean", True, "", "Draw the point too."),
        )
    )

    def setup(self) -> None:
        self._line_label = f"{self.community}_bng_line"
        self._point_label = f"{self.community}_bng_point"

    def on_run(self) -> None:
        own, point, config = self.own, self.config.bearing_point, self.config
        if point is None:
            self.warn("no bearing_point is given")
            return
        if not self.visuals:
            return
        share = config.line_pct / 100.0
        end = own.x + share * (point.x - own.x), own.y + share * (point.y - own.y)
        looks = Attributes(
            label=self._line_label, label_color="invisible", edge_color="white", vertex_size=0.0
        )
        self.post("VIEW_SEGLIST", seglist_text(SegList(((own.x, own.y), end), attributes=looks)))
        if config.show_pt:
            mark = Attributes(label=self._point_label, label_color="invisible", vertex_size=4.0)
            self.post("VIEW_POINT", point_text(Point(point.x, point.y, attributes=mark)))

    def on_run_to_idle(self) -> None:
        if self.visuals:
            self.post("VIEW_SEGLIST", erase_seglist_text(self._line_label))
            self.post("VIEW_POINT", erase_point_text(self._point_label))

    def on_complete(self) -> None:
        self.on_run_to_idle()
