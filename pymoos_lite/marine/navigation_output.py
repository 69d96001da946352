"""What a simulator tells of a vessel's state: the variables `<prefix>_X`, `<prefix>_Y` ... (marine_apps.md 1.8)."""

from __future__ import annotations

import math

from pymoos_lite.app import App
from pymoos_lite.geometry.angles import angle180, angle360
from pymoos_lite.geometry.geodesy import Geodesy, GeodesyError
from pymoos_lite.marine.vessel_model import Pose
from pymoos_lite.records.csp import num

_WORDS = (
    *("X", "Y", "LAT", "LONG", "HEADING", "SPEED", "DEPTH", "HEADING_OVER_GROUND", "SPEED_OVER_GROUND"),
    *("ALTITUDE", "Z", "PITCH", "YAW"),
)


class NavigationOutput:
    """Posts poses under one prefix.

    `max_speed` (m/s) caps the published speed, `underwater` adds depth as Z, pitch and yaw, `summary` adds
    USM_NAVPOS_SUMMARY.
    """

    def __init__(
        self,
        app: App,
        prefix: str,
        geodesy: Geodesy | None,
        max_speed: float,
        underwater: bool,
        summary: bool,
    ) -> None:
        self.prefix = prefix
        self._named = {word: f"{prefix}_{word}" for word in _WORDS}
        self._app = app
        self._geodesy = geodesy
        self._max_speed = max_speed
        self._underwater = underwater
        self._summary = summary

    def publish(self, pose: Pose, reverse: bool, stopped: bool, water_depth: float) -> None:
        """Post one state; `reverse` turns the heading round, `stopped` shows no speed, depth 0 is unknown."""
        named = self._named
        x, y, heading, speed, depth, pitch, course, speed_over_ground = pose
        if reverse:
            heading = angle360(heading + 180.0)
        posts = [(named["X"], x), (named["Y"], y)]
        if self._geodesy is not None:
            self._add_latlon(posts, self._geodesy, x, y)
        posts += (
            (named["HEADING"], heading),
            (named["SPEED"], 0.0 if stopped else self._shown(speed)),
            (named["DEPTH"], depth),
            (named["HEADING_OVER_GROUND"], course),
            (named["SPEED_OVER_GROUND"], 0.0 if stopped else speed_over_ground),
        )
        if water_depth > 0.0:
            posts.append((named["ALTITUDE"], max(0.0, water_depth - depth)))
        if self._underwater:
            posts += (
                (named["Z"], 0.0 - depth),  # and never -0
                (named["PITCH"], pitch + 0.0),
                (named["YAW"], 0.0 - math.radians(angle180(heading))),
            )
        self._app.notify_numbers(posts)

    def _add_latlon(self, posts: list[tuple[str, float]], geodesy: Geodesy, x: float, y: float) -> None:
        try:
            lat, lon = geodesy.to_latlon(x, y)
        except GeodesyError:
            self._app.run_warning("The vessel is too far from the datum to have a latitude and longitude")
            return
        posts += ((self._named["LAT"], lat), (self._named["LONG"], lon))
        if self._summary:
            self._app.notify_numbers(posts)  # the summary comes after what it sums up
            posts.clear()
            text = f"x={num(x, 3)},y={num(y, 3)},lat={num(lat, 7)},lon={num(lon, 7)}"
            self._app.notify("USM_NAVPOS_SUMMARY", text)

    def _shown(self, speed: float) -> float:
        """Speed to 0.01 m/s, halves away from zero."""
        shown = math.copysign(math.floor(abs(speed) * 100.0 + 0.5) / 100.0, speed) + 0.0
        return min(shown, self._max_speed)
