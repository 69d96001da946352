"""uFldObstacleSim: the shoreside's ground truth of obstacles as an app (marine_apps.md 7.1)."""

from __future__ import annotations

import math
import random
from collections.abc import Iterable
from dataclasses import replace

from pymoos_lite.app.datum import mission_geodesy
from pymoos_lite.app.mail_values import Handler, HandlerApp, on_text
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.shapes import Point
from pymoos_lite.geometry.specs import erase_seglist_text, point_text, seglist_text
from pymoos_lite.marine.obstacle_field import (
    ObstacleField,
    known_obstacle_text,
    parse_obstacle_file,
    visible_point,
)
from pymoos_lite.records.contact_ledger import ContactLedger
from pymoos_lite.records.csp import clip, num, parse_number
from pymoos_lite.records.node_report import NodeReport

_POINT_DURATION = 10.0  # s that a sensed point stays drawn
_MAX_VESSELS = 500


def _seconds(name: str, doc: str) -> Parameter:
    return Parameter(name, "number", -1.0, "s", f"{doc}; negative: never.")


def _color(name: str, default: str, doc: str) -> Parameter:
    return Parameter(name, "text", default, "", doc)


def _size(name: str, default: float, doc: str) -> Parameter:
    return Parameter(name, "number", default, "px", doc, low=0.0)


class ObstacleSim(HandlerApp):
    """Tells vehicles of obstacles, as polygons or as points that they could sense, and makes new ones."""

    PARAMETERS = Declaration(
        (
            Parameter("obstacle_file", "text", "", "", "File with the region, the sizes and the obstacles."),
            _color("poly_fill_color", "white", "Filling of the obstacles."),
            _color("poly_edge_color", "gray50", "Their edges."),
            _color("poly_vert_color", "gray50", "Their corners."),
            _color("poly_label_color", "invisible", "Their labels."),
            _size("poly_edge_size", 1.0, "Width of their edges."),
            _size("poly_vert_size", 1.0, "Size of their corners."),
            Parameter("poly_transparency", "number", 0.15, "", "How opaque they are.", low=0.0, high=1.0),
            Parameter("draw_region", "boolean", True, "", "Draw the region."),
            _color("region_edge_color", "gray50", "Its edge."),
            _color("region_vert_color", "white", "Its corners."),
            Parameter(
                "post_points", "boolean", False, "", "Let vehicles sense points instead of telling polygons."
            ),
            Parameter(
                "rate_points", "number", 5.0, "", "Points per vehicle and iteration.", low=0.0, high=1000.0
            ),
            Parameter("point_size", "number", 2.0, "px", "Size of drawn points.", low=1.0),
            Parameter("sensor_range", "number", 50.0, "m", "How far vehicles sense.", low=0.0),
            _seconds("min_duration", "Least duration that an obstacle is told with"),
            _seconds("max_duration", "Greatest duration"),
            _seconds("refresh_interval", "Time between tellings"),
            _seconds(
                "reset_interval", "Time after which the field is made anew, once all vehicles have left it"
            ),
            Parameter(
                "reset_range", "number", 10.0, "m", "Vehicles that far from the region have left it.", low=0.0
            ),
            Parameter("reuse_ids", "boolean", True, "", "New obstacles take the names of the old ones."),
            Parameter("post_visuals", "boolean", True, "", "Draw anything at all."),
        ),
    )

    def on_start_up(self) -> None:
        values = self.config
        self.random = random.Random(f"{self.context.seed} {self.name} {self.community}")
        self._ledger = ContactLedger(mission_geodesy(self), capacity=_MAX_VESSELS)
        self._durations: dict[str, float] = {}
        self._next_number = 0
        self._wanted = True
        self._reset_wanted = False
        self._outside = True
        self._refreshed_at = self._reset_at = self.now
        self._point_size: float = values.point_size
        path = self.mission_path(values.obstacle_file) if values.obstacle_file else None
        if path is None:
            raise ValueError("obstacle_file is not given")
        with path.open(encoding="utf-8", errors="replace") as file:
            self.field: ObstacleField = parse_obstacle_file(file, path.name)
        self._next_number = len(self.field.obstacles)
        self._handlers: dict[str, Handler] = {
            "NODE_REPORT": self._hear_report,
            "PMV_CONNECT": self._wish,
            "OBM_CONNECT": self._wish,
            "UFOS_RESET": self._wish_reset,
            "UFOS_POINT_SIZE": on_text(self, self._set_point_size),
        }

    def on_connect(self) -> None:
        super().on_connect()
        self.notify("PLOGGER_CMD", f"COPY_FILE_REQUEST = {self.mission_path(self.config.obstacle_file)}")
        self.notify("UFOS_MIN_RNG", self.field.min_range)

    def iterate(self) -> None:
        values = self.config
        if self._is_time_to_reset():
            self._reset()
        if 0.0 <= values.refresh_interval <= self.now - self._refreshed_at:
            self._wanted = True
        if self._wanted:
            self._refresh()
        if values.post_points:
            self._let_sense()

    def report(self) -> Iterable[str]:
        field = self.field
        yield f"Obstacles: {len(field.obstacles)}, at least {field.min_range:g} m apart; vehicles: {len(self._ledger)}"
        yield f"Told last {self.now - self._refreshed_at:.0f} s ago, made {self.now - self._reset_at:.0f} s ago"

    # --- mail -----------------------------------------------------------------------------------------------

    def _hear_report(self, message: Message) -> None:
        try:
            report = NodeReport.parse(message.text)
            self._wanted = self._wanted or report.name not in self._ledger
            self._ledger.receive(report, self.now)
        except ValueError as error:
            self.run_warning(f"NODE_REPORT refused: {clip(str(error), 80)}")

    def _wish(self, message: Message) -> None:
        self._wanted = True

    def _wish_reset(self, message: Message) -> None:
        self._reset_wanted = True

    def _set_point_size(self, told: str) -> None:
        size = {"smaller": self._point_size - 1.0, "bigger": self._point_size + 1.0}.get(told.strip().lower())
        size = parse_number(told) if size is None else max(1.0, size)
        if size is None or size < 1.0:
            raise ValueError("expected a number of at least 1, smaller or bigger")
        self._point_size = size

    # --- the field ------------------------------------------------------------------------------------------

    def _is_time_to_reset(self) -> bool:
        reach = self.config.reset_range
        outside = all(self.field.region.signed_dist(c.x, c.y) > reach for c in self._ledger)
        left = outside and not self._outside
        self._outside = outside
        if self._reset_wanted and outside:
            return True
        interval = self.config.reset_interval
        return left and 0.0 <= interval <= self.now - self._reset_at

    def _reset(self) -> None:
        self._reset_wanted = False
        first = 0 if self.config.reuse_ids else self._next_number
        fresh, complete = self.field.redrawn(self.random, first)
        if not complete:
            self.run_warning(
                f"only {len(fresh.obstacles)} of {len(self.field.obstacles)} obstacles found room"
            )
        if not self.config.reuse_ids and self.config.post_visuals:
            for obstacle in self.field.obstacles:
                self.notify("VIEW_POLYGON", erase_seglist_text(obstacle.label))
        self.field = fresh
        self._next_number += len(fresh.obstacles)
        self._durations.clear()
        self._reset_at = self.now
        self._wanted = True
        self.notify("KNOWN_OBSTACLE_CLEAR", "all")
        self.notify("UFOS_MIN_RNG", fresh.min_range)
        self.event(f"{len(fresh.obstacles)} new obstacles")

    def _refresh(self) -> None:
        self._wanted = False
        self._refreshed_at = self.now
        values = self.config
        if values.post_visuals and values.draw_region:
            looks = Attributes(
                label="obstacle_region",
                edge_color=values.region_edge_color,
                vertex_color=values.region_vert_color,
            )
            self.notify("VIEW_POLYGON", seglist_text(replace(self.field.region, attributes=looks), 2))
        for obstacle in self.field.obstacles:
            if values.post_visuals:
                looks = Attributes(
                    label=obstacle.label,
                    label_color=values.poly_label_color,
                    edge_color=values.poly_edge_color,
                    vertex_color=values.poly_vert_color,
                    fill_color=values.poly_fill_color,
                    vertex_size=values.poly_vert_size,
                    edge_size=values.poly_edge_size,
                    fill_transparency=values.poly_transparency,
                )
                self.notify("VIEW_POLYGON", seglist_text(replace(obstacle, attributes=looks), 2))
            text = known_obstacle_text(obstacle, obstacle.attributes.vsource, self._duration(obstacle.label))
            self.notify("KNOWN_OBSTACLE", text)
            if not values.post_points:
                self.notify("GIVEN_OBSTACLE", text)

    def _duration(self, label: str) -> float | None:
        least, most = self.config.min_duration, self.config.max_duration
        if most < 0.0:
            return None
        if label not in self._durations:
            self._durations[label] = round(self.random.uniform(min(max(0.0, least), most), most), 2)
        return self._durations[label]

    def _let_sense(self) -> None:
        values = self.config
        for contact in self._ledger:
            near = [
                obstacle
                for obstacle in self.field.obstacles
                if obstacle.signed_dist(contact.x, contact.y) <= values.sensor_range
            ]
            if not near:
                continue
            count = math.floor(values.rate_points) + (self.random.random() < values.rate_points % 1.0)
            for _ in range(count):
                obstacle = self.random.choice(near)
                x, y = visible_point(obstacle, contact.x, contact.y, self.random)
                self.notify(
                    f"TRACKED_FEATURE_{contact.name.upper()}", f"x={num(x)},y={num(y)},key={obstacle.label}"
                )
                if values.post_visuals:
                    looks = Attributes(
                        label=f"{contact.name}:{obstacle.label}",
                        vertex_size=self._point_size,
                        duration=_POINT_DURATION,
                        time=self.now,
                    )
                    self.notify("VIEW_POINT", point_text(Point(x, y, attributes=looks)))
