"""pObstacleMgr: the obstacle manager as an app (marine_apps.md 6)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from pymoos_lite.app.mail_values import Handler, HandlerApp, on_number, on_text
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.geometry.specs import parse_polygon
from pymoos_lite.marine.able_orders import AbleOrders
from pymoos_lite.marine.contact_alerts import flag_post
from pymoos_lite.marine.obstacle_manager_core import (
    AlertRequest,
    ObstacleManagerCore,
    ObstacleManagerParameters,
)
from pymoos_lite.records.csp import clip, num, parse_flag, parse_number


def _given(text: str) -> str:
    polygon = parse_polygon(text)
    if not polygon.label or not polygon.is_convex:
        raise ValueError("expected a convex polygon with a label")
    return text


def _off_or_metres(text: str) -> float | None:
    number = parse_number(text)
    if text.strip().lower() in ("off", "-1"):
        return None
    if number is None or number <= 0.0:
        raise ValueError("expected a number above 0, or off")
    return number


def _flag(text: str) -> str:
    parse_flag(text)
    return text


def _flags(name: str, doc: str) -> Parameter:
    return Parameter(
        name, "custom", None, "", doc, parse=_flag, repeated=True, example="OBSTACLES=$[OBS_NOW]"
    )


def _custom(name: str, parse: Any, default: Any, unit: str, doc: str, **more: Any) -> Parameter:
    return Parameter(name, "custom", default, unit, doc, parse=parse, **more)


_ORDERS_KEPT = 200
"""Names of obstacles switched off that are remembered."""


class ObstacleManager(HandlerApp):
    """Follows given obstacles and clusters of points, and tells the helm of those nearby."""

    PARAMETERS = Declaration(
        (
            Parameter(
                "point_var", "variable", "TRACKED_FEATURE", "", "Variable that carries tracked points."
            ),
            _custom(
                "given_obstacle",
                _given,
                None,
                "",
                "An obstacle known from the start.",
                repeated=True,
                aliases=("given_obstable",),
                example="pts={0,0:9,0:9,9},label=rock",
            ),
            Parameter("alert_range", "number", 20.0, "m", "Range of interest.", low=0.0, open_low=True),
            _custom(
                "ignore_range",
                _off_or_metres,
                None,
                "m",
                "Points farther away are dropped; off: none.",
                example="off",
            ),
            Parameter(
                "max_pts_per_cluster", "integer", 20, "", "Points kept per cluster.", low=1, high=10_000
            ),
            Parameter("max_age_per_point", "number", 20.0, "s", "Age at which a point is dropped.", low=0.0),
            _custom(
                "given_max_duration",
                _off_or_metres,
                60.0,
                "s",
                "Longest duration of an obstacle given by mail; off: any.",
                example="off",
            ),
            Parameter(
                "post_dist_to_polys",
                "choice",
                "close",
                "",
                "Post OBM_DIST_TO_OBJ of all obstacles, none, or those in range.",
                choices=("true", "false", "close"),
            ),
            Parameter("post_view_polys", "boolean", True, "", "Draw the obstacles."),
            Parameter("obstacles_color", "text", "blue", "", "Colour of the drawings."),
            Parameter("poly_label_thresh", "integer", 25, "", "No labels with more obstacles.", low=0),
            Parameter("poly_shade_thresh", "integer", 100, "", "No shading with more obstacles.", low=0),
            Parameter("poly_vertex_thresh", "integer", 150, "", "No vertices with more obstacles.", low=0),
            Parameter("lasso", "boolean", False, "", "A regular polygon instead of a cluster's hull."),
            Parameter("lasso_points", "integer", 6, "", "Corners of it.", low=3, high=360),
            Parameter("lasso_radius", "number", 5.0, "m", "Radius of it.", low=0.0, open_low=True),
            _custom(
                "general_alert",
                AlertRequest.parse,
                None,
                "",
                "One more alert for every obstacle.",
                example="name=ob,update_var=OB_NEAR,alert_range=30",
            ),
            _flags("new_obs_flag", "Posted for each new obstacle."),
            Parameter("disable_var", "variable", "", "", "Variable that disables obstacle behaviours."),
            Parameter("enable_var", "variable", "", "", "Variable that enables obstacle behaviours."),
            Parameter("expunge_var", "variable", "", "", "Variable that removes obstacle behaviours."),
            _flags("able_flag", "Posted on disabling and enabling."),
            _flags("disable_flag", "Posted on disabling."),
            _flags("enable_flag", "Posted on enabling."),
        ),
        ignored=("mailflag",),
    )

    def on_start_up(self) -> None:
        v = self.config
        self.core = ObstacleManagerCore(
            ObstacleManagerParameters(
                v.alert_range,
                v.ignore_range,
                v.max_pts_per_cluster,
                v.max_age_per_point,
                v.given_max_duration,
                v.post_dist_to_polys,
                v.post_view_polys,
                v.obstacles_color,
                v.poly_label_thresh,
                v.poly_shade_thresh,
                v.poly_vertex_thresh,
                v.lasso,
                v.lasso_points,
                v.lasso_radius,
                v.general_alert,
            )
        )
        for text in v.given_obstacle:
            try:
                self.core.hear_given(text, self.now, lasting=True)
            except ValueError as error:
                self.config_warning(f"given_obstacle: {error}")
        if v.point_var == "GIVEN_OBSTACLE":
            self.config_warning("point_var cannot be GIVEN_OBSTACLE, which carries polygons")
        self._orders = AbleOrders(self, "obstacle_id", self._ordered, _ORDERS_KEPT)
        self._handlers = self._mail_handlers()

    def on_connect(self) -> None:
        super().on_connect()
        self.notify("OBM_CONNECT", "true")

    def iterate(self) -> None:
        core = self.core
        if self.config.new_obs_flag:
            for _ in core.take_new():
                self._post_flags(self.config.new_obs_flag)
        for variable, value in core.step(self.now):
            self.notify(variable, value)

    def report(self) -> Iterable[str]:
        core = self.core
        least = num(core.min_dist_ever) if core.min_dist_ever < float("inf") else "-"
        yield f"Obstacles: {len(core.obstacles)} now, {core.ever} ever; alerts {core.alerts}; nearest ever {least} m"
        asked = core.request
        yield f"Alerts: {'nobody asked' if asked is None else f'{asked.update_var} within {asked.alert_range:g} m'}"
        yield f"{'Key':<16}{'Range':>9}  {'Kind':<8}{'Points':>7}"
        nearest = sorted(core.obstacles.values(), key=lambda each: (each.range, each.key))
        for obstacle in nearest[:20]:
            kind = "given" if obstacle.given else "points"
            yield f"{clip(obstacle.key, 15):<16}{obstacle.range:>9.1f}  {kind:<8}{len(obstacle.points):>7}"

    # --- mail -----------------------------------------------------------------------------------------------

    def _mail_handlers(self) -> dict[str, Handler]:
        core, values = self.core, self.config
        handlers: dict[str, Handler] = {
            "NAV_X": on_number(self, lambda v: setattr(core, "own_x", v)),
            "NAV_Y": on_number(self, lambda v: setattr(core, "own_y", v)),
            "GIVEN_OBSTACLE": on_text(self, lambda told: core.hear_given(told, self.now)),
            "OBM_ALERT_REQUEST": on_text(self, core.request_alert),
        }
        if values.point_var not in handlers:
            handlers[values.point_var] = on_text(self, lambda told: core.hear_point(told, self.now))
        orders = self._orders.handlers(values.disable_var, values.enable_var, values.expunge_var)
        return {**orders, **handlers}

    def _ordered(self, action: str) -> None:
        flags = self.config.disable_flag if action == "disable" else self.config.enable_flag
        self._post_flags([*self.config.able_flag, *flags])

    def _post_flags(self, flags: list[str]) -> None:
        macros = {
            "OBS_NOW": str(len(self.core.obstacles)),
            "OBS_EVER": str(self.core.ever),
            **self._orders.macros(),
        }
        for flag in flags:
            self.notify(*flag_post(flag, macros))
