"""pNodeReporter: tells the world about ownship, once per iteration (marine_apps.md 3)."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable

from mypy_extensions import mypyc_attr

from pymoos_lite.app import App
from pymoos_lite.app.datum import mission_geodesy
from pymoos_lite.app.mail_values import MAX_MAGNITUDE, Handler, HandlerApp, on_number, on_truth
from pymoos_lite.core.message import Message
from pymoos_lite.geometry.angles import angle180, angle360
from pymoos_lite.marine.helm_status import HelmStatus
from pymoos_lite.marine.node_reporter_config import NODE_REPORTER_DECLARATION
from pymoos_lite.marine.ownship_state import (
    NAV_NUMBERS,
    NAV_SUFFIXES,
    STAMPS,
    OwnshipState,
    default_length,
)
from pymoos_lite.marine.platform_report import PlatformReport
from pymoos_lite.marine.riders import Rider, RiderSet
from pymoos_lite.records.csp import clip, fields, num, parse_bool
from pymoos_lite.records.node_report import NodeReport

_ALT_NAV_AGE = 5.0  # s; alternative navigation older than this is not reported
_MAX_EXTRAPOLATION = 5.0  # s
_WAITING = "Waiting for NAV_X/Y or NAV_LAT/LONG"


@mypyc_attr(allow_interpreted_subclasses=True)
class NodeReporter(HandlerApp):
    """Publishes NODE_REPORT_LOCAL; see `PARAMETERS` for what shapes it."""

    PARAMETERS = NODE_REPORTER_DECLARATION

    def on_start_up(self) -> None:
        values = self.config
        self._geodesy = mission_geodesy(self)
        self._nav = OwnshipState()
        self._alt_nav = OwnshipState()
        self._helm = HelmStatus(values.nohelm_threshold)
        self._riders = RiderSet(_distinct(self, values.rider))
        self._platform = PlatformReport(values.plat_report_input)
        self._color: str = values.platform_color
        self._group: str = values.platform_group
        self._paused: bool = values.paused
        self._load_warning = ""
        self._mode_aux = ""
        self._reverse = False
        self._mission_hash = ""
        self._posted: NodeReport | None = None
        self._posted_xy: tuple[float, float] | None = None
        self._posted_at = -math.inf
        self._alt_index = 0
        self._index = 0
        self._waiting = False
        self._blackout = self._draw_blackout()
        self._cog_from: tuple[float, float] | None = None
        self._cog: float | None = None
        self._start_xy: tuple[float, float] | None = None
        self._extent = 0.0
        self._extent_posted = 0.0
        self._last_text = ""
        self._length = self._platform_length()
        self._json_mode, self._json_variable = self._json_policy(values.json_report)
        prefix = values.alt_nav_prefix
        self._alt_prefix = prefix if not prefix or prefix.endswith("_") else f"{prefix}_"
        self._handlers = self._mail_handlers()

    def on_connect(self) -> None:
        super().on_connect()
        if self.iteration == 0 and not self.context.deterministic:
            self.notify("PNODEREPORTER_PID", float(os.getpid()))

    def iterate(self) -> None:
        now = self.now
        if not self._paused and self._nav_is_good() and now - self._posted_at > self._blackout:
            report = self._make_report(self._nav, self.community, self._group, self._index)
            if report is not None and self._is_news(report):
                self._post_report(report)
        if self._alt_prefix and now - self._alt_nav.heard_at <= _ALT_NAV_AGE and not self._paused:
            self._post_alternative()
        text = self._platform.take(self.community, now)
        if text:
            self.notify(self.config.plat_report_output, text)
        self._follow_extent()

    def report(self) -> Iterable[str]:
        values = self.config
        yield f"Vessel:    {self.community}  type {values.platform_type}  group {self._group or '-'}"
        yield f"Output:    {values.node_report_output}{'  (paused)' if self._paused else ''}"
        yield f"Reports:   {self._index}"
        if self._posted is not None:
            yield f"Last:      {self.now - self._posted_at:.1f} s ago"
            yield f"  {clip(self._last_text, 400)}"
        yield f"Helm:      {self._helm.mode(self.now)}  allstop {self._helm.allstop}"
        if self._alt_prefix:
            yield f"Second:    {self._alt_name()} from {self._alt_prefix}*, {self._alt_index} reports"

    # --- start-up ----------------------------------------------------------------------------

    def _platform_length(self) -> float:
        values = self.config
        if values.platform_length is not None:
            return float(values.platform_length)
        length = default_length(values.platform_type)
        if length is None:
            self.config_warning(f"platform_length is not given and unknown for a '{values.platform_type}'")
            return 0.0
        return length

    def _json_policy(self, text: str) -> tuple[bool, str]:
        if not text:
            return False, ""
        replaces = parse_bool(text)
        return (replaces, "") if replaces is not None else (False, text)

    def _mail_handlers(self) -> dict[str, Handler]:
        handlers: dict[str, Handler] = {}
        prefixes = [("NAV_", self._nav)]
        if self._alt_prefix:
            prefixes.append((self._alt_prefix, self._alt_nav))
        for prefix, nav in prefixes:
            for suffix in NAV_SUFFIXES:
                handlers[prefix + suffix] = self._nav_handler(nav, suffix)
        helm = self._helm
        handlers["IVPHELM_STATE"] = lambda m: helm.hear_state(m.text, self.now)
        handlers["IVPHELM_SUMMARY"] = lambda m: helm.hear_summary(m.text, self.now)
        handlers["IVPHELM_ALLSTOP"] = lambda m: setattr(helm, "allstop", m.text)
        handlers["AUX_MODE"] = lambda m: setattr(self, "_mode_aux", m.text)
        handlers["LOAD_WARNING"] = self._hear_load_warning
        handlers["THRUST_MODE_REVERSE"] = self._hear_reverse
        handlers["NODE_GROUP_UPDATE"] = lambda m: setattr(self, "_group", m.text.strip())
        handlers["PLATFORM_COLOR"] = lambda m: setattr(self, "_color", m.text.strip())
        if self.config.allow_color_change:
            handlers["NODE_COLOR_CHANGE"] = handlers["PLATFORM_COLOR"]
        handlers["PNR_PAUSE"] = on_truth(self, lambda paused: setattr(self, "_paused", paused))
        handlers["MISSION_HASH"] = self._hear_mission_hash
        for name in self._riders.variables:
            handlers[name] = _both(handlers.get(name), self._hear_rider)
        for name in self._platform.variables:
            handlers[name] = _both(handlers.get(name), self._hear_platform)
        return handlers

    def _nav_handler(self, nav: OwnshipState, suffix: str) -> Handler:
        if suffix == "TRAJECTORY":
            return lambda message: setattr(nav, "trajectory", message.text)
        attribute = NAV_NUMBERS.get(suffix)
        if attribute is None:
            return on_number(self, lambda value: None)  # registered for, and not used
        known = attribute
        stamp = STAMPS.get(known, "heard_at")
        warn = on_number(self, lambda value: nav.hear(suffix, value, self.now))

        def handle(message: Message) -> None:
            value = message[1]
            if type(value) is float and -MAX_MAGNITUDE <= value <= MAX_MAGNITUDE:
                # As `nav.hear`, without asking each time which quantity this is.
                setattr(nav, known, value)
                nav.heard_at = now = self.now
                setattr(nav, stamp, now)
            else:
                warn(message)

        return handle

    # --- reporting ---------------------------------------------------------------------------

    def _nav_is_good(self) -> bool:
        """Whether navigation allows a report; keeps the warning about missing navigation up to date."""
        valid = self._nav.is_valid
        in_grace = self.uptime <= self.config.nav_grace_period
        if valid and self._waiting:
            self._waiting = False
            self.retract_run_warning(_WAITING)
        elif not (valid or in_grace or self._waiting):
            self._waiting = True
            self.run_warning(_WAITING)
        return valid or (in_grace and (self._nav.has_xy or self._nav.has_latlon))

    def _make_report(self, nav: OwnshipState, name: str, group: str, index: int) -> NodeReport | None:
        """The report of `nav`, None if it has no position in the coordinates that are asked for."""
        values, now = self.config, self.now
        x, y, lat, lon = nav.position(values.cross_fill_policy, self._geodesy)
        if values.coord_policy_global:
            if lat is None or lon is None:
                _, _, lat, lon = nav.position("local", self._geodesy)
            if lat is None or lon is None:
                self.run_warning(
                    "coord_policy_global needs NAV_LAT and NAV_LONG, or LatOrigin and LongOrigin"
                )
                return None
            x = y = None
        elif values.terse_reports and x is not None and y is not None:
            lat = lon = None
        heading = nav.heading
        if heading is not None:
            heading = angle360(heading + values.hdg_error)
        terse = values.terse_reports
        transparency = nav.transparency
        if transparency is None:
            transparency = values.platform_transparency
        return NodeReport.of(
            {
                "name": name,
                "x": x,
                "y": y,
                "speed": nav.speed,
                "heading": heading,
                "cog": self._cog if nav is self._nav and values.report_cog else None,
                "depth": None if terse else nav.depth,
                "lat": lat,
                "lon": lon,
                "type": values.platform_type,
                "color": self._color,
                "group": group,
                "vsource": values.platform_vsource,
                "mode": self._helm.mode(now),
                "mode_aux": self._mode_aux,
                "allstop": self._helm.allstop,
                "load_warning": self._load_warning,
                "altitude": nav.altitude,
                "index": index,
                "thrust_mode_reverse": self._reverse,
                "yaw": None if terse or heading is None else math.radians(angle180(90.0 - heading)),
                "time": now,
                "transparency": transparency,
                "length": self._length or None,
                "beam": values.platform_beam,
                "trajectory": nav.trajectory,
                "properties": tuple(sorted(values.platform_aspect)),
            }
        )

    def _is_news(self, report: NodeReport) -> bool:
        """False when receivers of the last report can extrapolate to this one (marine_apps.md 3.4)."""
        values, last = self.config, self._posted
        if not values.extrap_enabled or last is None or self._posted_xy is None:
            return True
        here = self._local_position(self._nav)
        if here is None or last.heading is None or last.speed is None or report.heading is None:
            return True
        elapsed = self.now - self._posted_at
        run = last.speed * min(elapsed, _MAX_EXTRAPOLATION)
        toward = math.radians(last.heading)
        x = self._posted_xy[0] + run * math.sin(toward)
        y = self._posted_xy[1] + run * math.cos(toward)
        position_gap = math.hypot(here[0] - x, here[1] - y)
        heading_gap = abs(angle180(report.heading - last.heading))
        self.notify("PNR_EXTRAP_POS_GAP", position_gap)
        self.notify("PNR_EXTRAP_HDG_GAP", heading_gap)
        return bool(
            elapsed >= values.extrap_max_gap
            or position_gap >= values.extrap_pos_thresh
            or heading_gap >= values.extrap_hdg_thresh
        )

    def _post_report(self, report: NodeReport) -> None:
        now, output = self.now, self.config.node_report_output
        riders = self._riders.take(now)
        text = report.to_json(riders) if self._json_mode else report.to_text(riders)
        self.notify(output, text)
        if self._index == 0:
            self.notify(f"{output}_FIRST", text)
        else:
            self.notify("PNR_POST_GAP", now - self._posted_at)
        if self._json_variable:
            self.notify(self._json_variable, report.to_json(riders))
        self._last_text = text
        self._posted = report
        self._posted_xy = self._local_position(self._nav)
        self._posted_at = now
        self._index += 1
        self._load_warning = ""
        self._blackout = self._draw_blackout()
        self._follow_course()

    def _post_alternative(self) -> None:
        if not self._alt_nav.is_valid:
            return
        group = self.config.alt_nav_group or self._group
        report = self._make_report(self._alt_nav, self._alt_name(), group, self._alt_index)
        if report is not None:
            self._alt_index += 1
            output = self.config.node_report_output
            self.notify(output, report.to_json() if self._json_mode else report.to_text())

    def _alt_name(self) -> str:
        name: str = self.config.alt_nav_name
        return f"{self.community}{name}" if name.startswith("_") or not name else name

    def _draw_blackout(self) -> float:
        """Least time to the next report; negative if there is none."""
        interval: float = self.config.blackout_interval
        if interval <= 0.0:
            return -1.0
        variance: float = self.config.blackout_variance
        return interval + (self.random.uniform(-variance, variance) if variance else 0.0)

    def _local_position(self, nav: OwnshipState) -> tuple[float, float] | None:
        if nav.x is not None and nav.y is not None:
            return nav.x, nav.y
        x, y, _, _ = nav.position("fill-empty", self._geodesy)
        return None if x is None or y is None else (x, y)

    def _follow_course(self) -> None:
        """Course over ground from one report to the next; kept while the vessel does not move."""
        here = self._local_position(self._nav)
        if here is not None and here != self._cog_from:
            if self._cog_from is not None:
                east, north = here[0] - self._cog_from[0], here[1] - self._cog_from[1]
                self._cog = angle360(math.degrees(math.atan2(east, north)))
            self._cog_from = here

    def _follow_extent(self) -> None:
        """Say with the mission's hash how far from its start the vessel has been (marine_apps.md 3.4)."""
        here = self._local_position(self._nav) if self._mission_hash else None
        if here is None:
            return
        if self._start_xy is None:
            self._start_xy = here
        extent = math.hypot(here[0] - self._start_xy[0], here[1] - self._start_xy[1])
        self._extent = max(self._extent, extent)
        if self._extent >= max(1.02 * self._extent_posted, self._extent_posted + 1.0):
            self._extent_posted = self._extent
            self.notify("PNR_MHASH", f"mhash={self._mission_hash},ext={num(self._extent, 1)}")

    # --- mail --------------------------------------------------------------------------------

    def _hear_load_warning(self, message: Message) -> None:
        told = {key.lower(): value for key, value in fields(message.text)}
        if told.get("app") and told.get("maxgap"):
            self._load_warning = f"{told['app']}:{told['maxgap']}"

    def _hear_reverse(self, message: Message) -> None:
        self._reverse = message.text.strip().lower() in ("true", "reverse")

    def _hear_mission_hash(self, message: Message) -> None:
        told = {key.lower(): value for key, value in fields(message.text)}
        self._mission_hash = clip(told.get("mhash", ""), 100)

    def _hear_rider(self, message: Message) -> None:
        self._riders.hear(message.name, message.value if type(message.value) is float else message.text)

    def _hear_platform(self, message: Message) -> None:
        self._platform.hear(message.name, message.value if type(message.value) is float else message.text)


def _both(first: Handler | None, second: Handler) -> Handler:
    """A handler that lets both hear: a rider may ride on a variable that the reporter itself needs."""
    if first is None:
        return second

    def handle(message: Message) -> None:
        first(message)
        second(message)

    return handle


def _distinct(app: App, riders: list[Rider]) -> list[Rider]:
    kept: dict[str, Rider] = {}
    for rider in riders:
        if rider.variable in kept:
            app.config_warning(f"rider: variable {rider.variable} is given twice; the last one wins")
        kept[rider.variable] = rider
    return list(kept.values())
