"""BHV_AvoidObstacleV24: keep clear of one convex obstacle (behaviors.md C8)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from math import cos, radians
from typing import Any

import numpy as np
from numpy.typing import NDArray

from behaviors.forms import custom, hint_lines, number, polygon
from ivp_helm.base_parameters import flag_parameter
from ivp_helm.behavior import Behavior
from ivp_helm.flags import CLEAR, Flag, parse_flag
from ivp_helm.ivp import Domain, IvPFunction, from_table
from pymoos_lite.config.parameters import Declaration, Parameter, ParameterError
from pymoos_lite.geometry.angles import bearing, rel_bearing
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.buffer import buffered
from pymoos_lite.geometry.encounter import ContactTag
from pymoos_lite.geometry.hints import VisualHints
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.specs import erase_seglist_text, seglist_text
from pymoos_lite.geometry.text import num, parse_number

Array = NDArray[np.float64]

RESOLVED = "OBM_RESOLVED"
AFT = 20.0
"""An obstacle all of which is so many degrees abaft the beam is no longer in the way."""
LOCK, UNLOCK = 0.6, 0.1
"""Relevance from which on the side to pass is settled, and below which it is open again."""
LEAST = 0.01
"""Relevance of an obstacle that is no danger as own ship heads."""
HYSTERESIS = 1.0  # m that the range must change by before a new direction is believed
BUFFER_STEP = 30.0  # degrees between the points of rounded corners
PIECE = (3,)

ORDERED = (
    ("pwt_inner_dist", "pwt_outer_dist"),
    ("pwt_outer_dist", "completed_dist"),
    ("min_util_cpa_dist", "max_util_cpa_dist"),
)
"""Distances of which the first must not be above the second."""

HINTS = VisualHints(
    {
        "vertex_color": "gray50",
        "edge_color": "gray50",
        "label_color": "white",
        "vertex_size": 0.0,
        "edge_size": 1.0,
        "gut_fill_color": "gray60",
        "mid_fill_color": "gray70",
        "rim_fill_color": "gray70",
    },
    ("gut", "mid", "rim"),
)
LOCKED_COLOR = "pink"


def read_range_flag(text: str) -> Flag | None:
    """``VAR=value``, or ``<R VAR=value`` for ranges below R; None for ``clearall``.

    Raises:
        ValueError: it is none.
    """
    if text.strip().lower() == CLEAR:
        return None
    flag = parse_flag(text)
    if flag.tag and ContactTag.parse(flag.tag).kind != "<":
        raise ParameterError(f"rng_flag = {text.strip()!r}: expected VAR=value or <R VAR=value")
    return flag


class AvoidObstacle(Behavior):
    """Prefers courses that lead past the obstacle at a distance."""

    BHV_NAME = "BHV_AvoidObstacleV24"
    DEFAULT_NAME = "avd_obstacle"
    INFO = (RESOLVED,)
    CONSTRAINT = True
    PARAMETERS = Declaration(
        (
            polygon("polygon", "The obstacle, a convex polygon.", "poly"),
            Parameter("id", "text", "", "", "The obstacle's name.", aliases=("obid", "obstacle_key")),
            number("min_util_cpa_dist", 8.0, "m", "Paths nearer to the obstacle are worth nothing."),
            number("max_util_cpa_dist", 16.0, "m", "Paths farther from it are all as good."),
            number("buffer_dist", 0.0, "m", "The older name of min_util_cpa_dist."),
            number("allowable_ttc", 20.0, "s", "Accepted for missions that give it; not used."),
            number("pwt_inner_dist", 10.0, "m", "Full weight below this range."),
            number("pwt_outer_dist", 50.0, "m", "No weight beyond this range."),
            number("completed_dist", 50.0, "m", "The behaviour ends beyond this range."),
            Parameter("allstop_on_breach", "boolean", True, "", "Stop the vehicle inside the obstacle."),
            Parameter("holonomic_ok", "boolean", False, "", "Do not warn that no turn model is given."),
            custom(
                "rng_flag",
                read_range_flag,
                None,
                "Posted in every iteration (within a range, if one is given).",
                "<30 NEAR=$[OID]",
                repeated=True,
            ),
            flag_parameter("cpa_flag", "Posted on passing the obstacle."),
            Parameter("can_disable", "boolean", False, "", "Obey BHV_ABLE_FILTER."),
            Parameter(
                "use_refinery",
                "boolean",
                False,
                "",
                "Near the obstacle, be content with paths that come hardly nearer than own ship is.",
            ),
            hint_lines("gut_fill_color=red"),
        ),
        ignored=(
            "draw_buff_min_poly",
            "draw_buff_max_poly",
            "resolved",
            "i_understand_this_behavior_is_deprecated",
        ),
    )

    def setup(self) -> None:
        self.hints = HINTS
        self.range = float("inf")
        """Metres from own ship to the obstacle, 0 inside."""
        self.locked = False
        self._least_ever = float("inf")
        self._least = self._most = float("inf")
        self._closing = True
        self._passed_at: float | None = None
        self._erased = False
        self._drawn: dict[str, tuple[object, str]] = {}

    # --- parameters ---------------------------------------------------------------------------------------

    def set_id(self, name: str) -> None:
        """The obstacle's name, once and for all."""
        former = self.config.id
        if former and name != former:
            raise ParameterError(f"id = {name}: this is the behaviour of obstacle {former}")
        vars(self.config)["id"] = name

    def set_buffer_dist(self, value: float) -> None:
        """The older name of min_util_cpa_dist."""
        self.event(f"buffer_dist is the older name of min_util_cpa_dist, which is {value:g} now")
        vars(self.config)["min_util_cpa_dist"] = value
        self.given.add("min_util_cpa_dist")

    def set_visual_hints(self, text: str) -> None:
        """Colours and sizes."""
        self.hints = self.hints.updated(text)

    def check(self) -> Iterable[str]:
        config = self.config
        if config.polygon is None and not config.updates:
            yield "there is no polygon"
        for near, far in ORDERED:
            if near in self.given and far in self.given and getattr(config, near) > getattr(config, far):
                yield f"{near} = {getattr(config, near):g} is above {far} = {getattr(config, far):g}"
        self._order()

    def on_parameters(self) -> None:
        self._order()
        self._drawn.clear()

    def _order(self) -> None:
        """Adjust the distances that nobody gave to those that somebody did."""
        values = vars(self.config)
        for near, far in (*ORDERED, *ORDERED[:2]):
            if values[near] > values[far]:
                given, other = (near, far) if near in self.given and far not in self.given else (far, near)
                values[other] = values[given]

    def settings(self) -> str:
        c = self.config
        return (
            f"allowable_ttc={c.allowable_ttc:.2f},min_util_cpa={c.min_util_cpa_dist:.2f},"
            f"max_util_cpa={c.max_util_cpa_dist:.2f},pwt_outer_dist={c.pwt_outer_dist:.2f},"
            f"pwt_inner_dist={c.pwt_inner_dist:.2f},completed_dist={c.completed_dist:.2f}"
        )

    # --- life ---------------------------------------------------------------------------------------------

    def on_helm_start(self) -> None:
        if self.is_template and self.config.updates:
            ask = f"name={self.name},update_var={self.config.updates}"
            self.post(
                "OBM_ALERT_REQUEST", f"{ask},alert_range={num(self.config.pwt_outer_dist)}", repeat=True
            )

    def on_every_state(self) -> None:
        obstacle = self.config.polygon
        if obstacle is None:
            return
        own = self.own
        self.range = 0.0 if obstacle.contains(own.x, own.y) else obstacle.dist(own.x, own.y)
        self._least_ever = min(self._least_ever, self.range)
        self._watch_passing()
        for flag in self.config.rng_flag:
            if not flag.tag or self.range < ContactTag.parse(flag.tag).range:
                self.post_flags([flag], repeat=False)
        if self.buffer.updated(RESOLVED) and self.config.id in self.buffer.delta_texts(RESOLVED):
            self.post("NOTED_RESOLVED", self.config.id)
            self.complete("resolved")
        elif self.range > self.config.completed_dist:
            self.complete(f"rng={self.range:.1f}")

    def on_idle(self) -> None:
        self._erase()

    def on_idle_to_run(self) -> None:
        self.post("BHV_SETTINGS", f"type={self.BHV_NAME},name={self.name},{self.settings()}", repeat=True)
        if not self.config.holonomic_ok and self.surroundings.platform.model.is_holonomic:
            self.warn("holo plat_model")

    def on_run(self) -> IvPFunction | None:
        obstacle = self.config.polygon
        if self.completed or obstacle is None:
            return None
        own = self.own
        if self.range <= 0.0:
            self._breached()
            return None
        if obstacle.is_aft_of(own.x, own.y, own.heading, AFT):
            self.why = f"{self.config.id} is astern"
            self.locked = False
            return None
        self.relevance = self._relevance(obstacle)
        if self.relevance > LOCK:
            self.locked = True
        elif self.relevance < UNLOCK:
            self.locked = False
        self._draw(obstacle, *self.shrunk_distances)
        self.why = f"{self.config.id} is {self.range:.0f} m off on {self.side}" + (
            ", side settled" * self.locked
        )
        function = from_table(self._courses, self.utilities(obstacle), PIECE, extent=0.0)
        if function.maximum <= 0.0:
            self.error("Allstop: obstacle unavoidable")
            self._erase()
            return None
        return function.normalised().expanded(self.domain.subdomain(("course", "speed")))

    def on_inactive(self) -> None:
        self._erase()

    def on_run_to_idle(self) -> None:
        self._erase()

    def on_complete(self) -> None:
        self._erase()

    def _breached(self) -> None:
        self.warn("Unable to init AOF_AvoidObstacleV24:m_obstacle contains osx,osy")
        self.why = f"inside {self.config.id}"
        if self.config.allstop_on_breach:
            self.error("Allstop: Obstacle Breached")
        else:
            self.warn("Allstop: Obstacle Breached")

    # --- what it wants --------------------------------------------------------------------------------------

    @property
    def _courses(self) -> Domain:
        return self.domain.subdomain(("course",))

    @property
    def side(self) -> str:
        """On which side of own ship the obstacle is: port or star."""
        x, y = self.config.polygon.center
        own = self.own
        return "star" if 0.0 < rel_bearing(own.x, own.y, own.heading, x, y) < 180.0 else "port"

    def _relevance(self, obstacle: Polygon) -> float:
        """By range, and by how nearly own ship heads for it."""
        config, own = self.config, self.own
        outer, inner = config.pwt_outer_dist, config.pwt_inner_dist
        if self.range <= inner:
            share = 1.0
        elif self.range < outer:
            share = (outer - self.range) / (outer - inner)
        else:
            share = 0.0
        ahead = max(0.0, cos(radians(obstacle.heading_wedge_offset(own.x, own.y, own.heading))))
        return share * ahead or LEAST

    @property
    def shrunk_distances(self) -> tuple[float, float]:
        """The worthless and the sufficient distance, both short of where own ship already is."""
        reach = max(0.0, self.range - 1.0)
        return min(self.config.min_util_cpa_dist, reach), min(self.config.max_util_cpa_dist, reach)

    def _distances(self) -> tuple[float, float]:
        """The worthless and the sufficient distance of a path.

        Nearer to the obstacle than the former every path would be worthless, those that lead away too: there
        the distances shrink.
        """
        config = self.config
        if self.range > config.min_util_cpa_dist:
            return config.min_util_cpa_dist, config.max_util_cpa_dist
        return self.shrunk_distances

    def utilities(self, obstacle: Polygon) -> Array:
        """The utility of every course of the domain, 0 to 100."""
        courses = self._courses["course"].values()
        near, far = self._distances()
        away = self.surroundings.platform.model.dists_to_polygon(courses, obstacle)
        if far > near:
            found = np.clip((away - near) / (far - near), 0.0, 1.0) * 100.0
        else:
            found = np.where(away > near, 100.0, 0.0)
        if self.config.use_refinery:
            # The reference takes its plateaus from the rim that it draws, which shrinks as own ship comes near.
            found = np.where(away >= max(self.shrunk_distances[1], near), 100.0, found)
        if self.locked:
            own = self.own
            x, y = obstacle.center
            there = np.mod(bearing(own.x, own.y, x, y) - courses, 360.0)
            star = (there > 0.0) & (there < 180.0)
            found[star != (self.side == "star")] = 0.0
        return np.asarray(found)

    # --- passing ------------------------------------------------------------------------------------------

    def _watch_passing(self) -> None:
        self._passed_at = None
        if self._closing:
            self._least = min(self._least, self.range)
            if self.range > self._least + HYSTERESIS:
                self._closing = False
                self._most = self.range
                if self.range < self.config.pwt_outer_dist:
                    self._passed_at = self._least
                    self.post_flags(self.config.cpa_flag)
        else:
            self._most = max(self._most, self.range)
            if self.range < self._most - HYSTERESIS:
                self._closing = True
                self._least = self.range

    def macro(self, name: str) -> float | str | None:
        config = self.config
        if name in ("BNG", "RBNG", "SIDE") and config.polygon is not None:
            own = self.own
            x, y = config.polygon.center
            if name == "SIDE":
                return self.side
            return (
                bearing(own.x, own.y, x, y) if name == "BNG" else rel_bearing(own.x, own.y, own.heading, x, y)
            )
        values: dict[str, Any] = {
            "RNG": self.range,
            "OID": config.id,
            "OIDX": config.id.rpartition("_")[2],
            "CPA": self._least_ever if self._passed_at is None else self._passed_at,
            "SLOCK": "true" if self.locked else "false",
            "MINU_CPA": config.min_util_cpa_dist,
            "MAXU_CPA": config.max_util_cpa_dist,
        }
        value = values.get(name)
        if isinstance(value, str):
            found = parse_number(value)
            return value if found is None else found
        return None if value is None else float(value)

    def able_fields(self) -> dict[str, str]:
        obstacle = self.config.polygon
        vsource = "" if obstacle is None else obstacle.attributes.vsource
        return {"obstacle": self.config.id, "obstacle_id": self.config.id, "vsource": vsource}

    # --- drawing ------------------------------------------------------------------------------------------

    def _draw(self, obstacle: Polygon, near: float, far: float) -> None:
        if not self.visuals:
            return
        self._erased = False
        label = obstacle.label
        fill = LOCKED_COLOR if self.locked else self.hints.color("fill_color", "gut")
        looks = replace(self.hints.attributes("gut", Attributes(label=label)), fill_color=fill)
        self.post("VIEW_POLYGON", self._shape("gut", obstacle, 0.0, looks), "gut")
        for prefix, distance in (("mid", near), ("rim", far)):
            looks = self.hints.attributes(prefix, Attributes(label=f"{label}_{prefix}_poly"))
            self.post("VIEW_POLYGON", self._shape(prefix, obstacle, distance, looks), prefix)

    def _shape(self, name: str, obstacle: Polygon, distance: float, looks: Attributes) -> str:
        """The text of a drawing, made again only when something about it changed."""
        key = (obstacle, distance, looks)
        known = self._drawn.get(name)
        if known is None or known[0] != key:
            shape = buffered(obstacle, distance, BUFFER_STEP) if distance > 0.0 else obstacle
            known = self._drawn[name] = (key, seglist_text(replace(shape, attributes=looks), 5))
        return known[1]

    def _erase(self) -> None:
        obstacle = self.config.polygon
        if self._erased or not self.visuals or obstacle is None:
            return
        self._erased = True
        label = obstacle.label
        for prefix, drawn in (("gut", label), ("mid", f"{label}_mid_poly"), ("rim", f"{label}_rim_poly")):
            self.post("VIEW_POLYGON", erase_seglist_text(drawn), prefix)
