"""pProxonoi: the own Voronoi cell in a region shared with other vessels (gcid.md 14).

Hears node reports and its own position; posts the cell, the region and, if wanted, pictures of them. The
geometry is in `pymoos_lite.geometry.voronoi`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from math import hypot, inf

from mypy_extensions import mypyc_attr

from pymoos_lite.app.mail_values import HandlerApp, on_number, on_text
from pymoos_lite.config.parameters import Declaration, Parameter, parse_number
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.shapes import XY
from pymoos_lite.geometry.specs import erase_seglist_text, parse_polygon, seglist_text
from pymoos_lite.geometry.voronoi import voronoi_cell
from pymoos_lite.records.csp import parse_bool
from pymoos_lite.records.node_report import NodeReport

REGION_PERIOD = 200
"""Iterations between two posts of an unchanged region."""
DECIMALS = 2


def _range(text: str) -> float:
    if text.strip().lower() == "nolimit":
        return inf
    value = parse_number(text.strip())
    if value <= 0.0:
        raise ValueError("expected metres above 0, or nolimit")
    return value


def _names(text: str) -> list[str]:
    return [name for name in (part.strip().lower() for part in text.split(",")) if name]


@mypyc_attr(allow_interpreted_subclasses=True)
class Proxonoi(HandlerApp):
    """Cuts the own cell out of the region by the bisector towards each other vessel in it."""

    DEFAULT_TICK = 2.0
    PARAMETERS = Declaration(
        (
            Parameter("region", "custom", None, "", "The region shared; convex.", parse=parse_polygon,
                      example="pts={0,0:50,0:50,50:0,50}"),
            Parameter("post_poly", "boolean", False, "", "Draw the cell."),
            Parameter("post_region", "boolean", False, "", "Draw the region."),
            Parameter("reject_range", "custom", 10000.0, "m", "Vessels first heard of beyond it do not count; "
                      "nolimit: all do.", parse=_range, example="10000"),
            Parameter("ignore_name", "custom", None, "", "Vessels that do not count, until an update of the list.",
                      parse=_names, repeated=True, example="abe, ben"),
            Parameter("always_ignore_name", "custom", None, "", "Vessels that never count.",
                      parse=_names, repeated=True, example="abe, ben"),
            Parameter("region_update_var", "variable", "PROX_UP_REGION", doc="Variable that brings a new region."),
            Parameter("ignore_list_update_var", "variable", "PROX_SET_IGNORE_LIST",
                      doc="Variable that brings the names of all vessels to ignore from now on."),
            Parameter("contact_max_age", "number", 35.0, "s", "Age at which a vessel stops to count.",
                      low=0.0, open_low=True),
            Parameter("vcolor", "text", "white", "", "Colour of the cell's picture."),
        ),
        ignored=("neighbor_stale_treshold", "neighbor_stale_threshold"),
    )  # fmt: skip

    def on_start_up(self) -> None:
        config = self.config
        self.region: Polygon | None = config.region
        self.cell: Polygon | None = None
        self._x: float | None = None
        self._y: float | None = None
        self._contacts: dict[str, tuple[float, float, float]] = {}
        """Name in lower case to x, y and the time it was heard."""
        self._always = {name for names in config.always_ignore_name for name in names}
        self._ignored = {name for names in config.ignore_name for name in names}
        self._draw: bool = config.post_poly
        self._region_due = 0
        self._last = ""
        self._handlers = {
            "NODE_REPORT": on_text(self, self._hear),
            "NAV_X": on_number(self, lambda x: setattr(self, "_x", x)),
            "NAV_Y": on_number(self, lambda y: setattr(self, "_y", y)),
            "PROX_CLEAR": on_text(self, lambda _: self._contacts.clear()),
            "PROX_POLY_VIEW": on_text(self, self._switch),
            config.region_update_var: on_text(self, self._take_region),
            config.ignore_list_update_var: on_text(self, self._take_ignored),
        }

    # --- mail --------------------------------------------------------------------------------

    def _hear(self, text: str) -> None:
        report = NodeReport.parse(text)
        name = report.name.lower()
        if report.x is None or report.y is None or not name or name == self.community.lower():
            return
        if name not in self._contacts and self._x is not None and self._y is not None:
            limit: float = self.config.reject_range
            if hypot(report.x - self._x, report.y - self._y) > limit:
                return
        self._contacts[name] = (report.x, report.y, self.now)

    def _switch(self, text: str) -> None:
        state = parse_bool(text, self._draw)
        if state is None:
            raise ValueError("expected true, false or toggle")
        if self._draw and not state and self.cell is not None:
            self.notify("VIEW_POLYGON", erase_seglist_text(self._label("cell")))
        self._draw = state

    def _take_region(self, text: str) -> None:
        region = parse_polygon(text)
        if len(region) < 3:
            raise ValueError("expected a convex polygon")
        self.region = region
        self._region_due = 0

    def _take_ignored(self, text: str) -> None:
        self._ignored = set(_names(text))

    # --- work --------------------------------------------------------------------------------

    def neighbours(self) -> list[XY]:
        """Places of the vessels that share the region now, in order of their names."""
        region, oldest = self.region, self.now - self.config.contact_max_age
        found = []
        for name in sorted(self._contacts):
            x, y, heard = self._contacts[name]
            if heard < oldest:
                del self._contacts[name]
            elif name in self._always or name in self._ignored:
                continue
            elif region is not None and region.contains(x, y):
                found.append((x, y))
        return found

    def iterate(self) -> None:
        if self.region is not None and self._region_due <= 0:
            self._region_due = REGION_PERIOD
            self.notify("PROXONOI_REGION", seglist_text(Polygon(self.region.points), DECIMALS))
            if self.config.post_region:
                self._view(self.region, "region", "gray50")
        self._region_due -= 1
        self.cell = None
        if self.region is not None and self._x is not None and self._y is not None:
            self.cell = voronoi_cell(self.region, (self._x, self._y), self.neighbours())
        if self.cell is None:
            if self._last != "none":
                self._last = "none"
                self.notify("PROXONOI_POLY", erase_seglist_text(self._label("cell")))
                if self._draw:
                    self.notify("VIEW_POLYGON", erase_seglist_text(self._label("cell")))
            return
        self._last = "cell"
        self.notify("PROXONOI_POLY", seglist_text(self.cell, DECIMALS))
        if self._draw:
            self._view(self.cell, "cell", self.config.vcolor)

    def _label(self, what: str) -> str:
        return f"{self.community}_prox_{what}"

    def _view(self, polygon: Polygon, what: str, color: str) -> None:
        looks = Attributes(label=self._label(what), edge_color=color, vertex_color=color, vertex_size=0.0)
        self.notify("VIEW_POLYGON", seglist_text(replace(polygon, attributes=looks), 1))

    def report(self) -> Iterable[str]:
        yield f"Region: {'none' if self.region is None else f'{self.region.area:.0f} m2'}"
        yield f"Cell:   {'none' if self.cell is None else f'{self.cell.area:.0f} m2'}"
        ignored = ", ".join(sorted(self._ignored | self._always)) or "nobody"
        yield f"Ignored: {ignored}"
        for name, (x, y, heard) in sorted(self._contacts.items()):
            yield f"  {name:<12} {x:>8.1f} {y:>8.1f}   {self.now - heard:.1f} s ago"
