"""Follows the contacts around ownship and raises alerts about them (marine_apps.md 5.3).

The core of pContactMgrV20: reports, ownship's state, requests and the time go in; posts come out. Metres, m/s,
degrees, seconds.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

from mypy_extensions import mypyc_attr

from pymoos_lite.geometry.angles import angle360, bearing
from pymoos_lite.geometry.geodesy import Geodesy
from pymoos_lite.marine.contact_alerts import Alert, apply_request, flag_post
from pymoos_lite.marine.contact_filter import ContactFilter
from pymoos_lite.marine.contact_requests import RangeRequests
from pymoos_lite.records.contact_ledger import Contact, ContactLedger, Extrapolation, ExtrapolationMode
from pymoos_lite.records.csp import fix, num
from pymoos_lite.records.node_report import NodeReport

Post = tuple[str, float | str]
CPA_HORIZON = 36_000.0  # s
MAX_ALERTS = 500
_RETIRE_FACTOR = 1.05  # hysteresis of the reject range, and of the end of an early warning


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class ContactManagerParameters:
    """Configuration; None or a negative value switches a limit or feature off."""

    filter: ContactFilter = field(default_factory=ContactFilter)
    contact_max_age: float = 60.0
    max_retired_history: int = 5
    max_contacts: int = 500
    reject_range: float | None = 2000.0
    decay: tuple[float, float] = (15.0, 30.0)
    recap_interval: float | None = 1.0
    range_report_timeout: float = 10.0
    range_report_maxsize: int = 20
    post_closest_range: bool = False
    post_closest_relbng: bool = False
    post_all_ranges: bool = False
    alert_verbose: bool = False
    hold_alerts_for_helm: bool = False
    early_warning_time: float = -1.0
    early_warning_flags: tuple[str, ...] = ()
    cease_warning_flags: tuple[str, ...] = ()
    retire_flags: tuple[str, ...] = ()


@dataclass(slots=True)
class Tracked:
    """What the manager knows of one contact beyond the ledger."""

    range_actual: float = math.inf
    range_extrapolated: float = math.inf
    closure: float = 0.0
    x: float = 0.0
    y: float = 0.0
    alerts: set[str] = field(default_factory=set)
    warned_at: float | None = None
    warned_range: float = 0.0


class ContactManagerCore:
    """The contacts of `ownship`.

    Feed `receive`, `own_*`, `request_alert`; call `step(now)` once per iteration for the posts it causes.
    """

    def __init__(self, ownship: str, geodesy: Geodesy | None, parameters: ContactManagerParameters) -> None:
        self.ownship = ownship
        self._ownship = ownship.lower()
        self.parameters = parameters
        self._takes_all = parameters.filter.says_nothing
        start, end = parameters.decay
        self._policy = Extrapolation(ExtrapolationMode.HEADING, 0.0, start, end)
        self.ledger = ContactLedger(geodesy, capacity=2 * parameters.max_contacts + 1)
        self.tracked: dict[str, Tracked] = {}
        self.alerts: dict[str, Alert] = {}
        self.requests = RangeRequests(parameters.range_report_timeout, parameters.range_report_maxsize)
        self.retired: deque[str] = deque(maxlen=parameters.max_retired_history)
        self.own_x: float | None = None
        self.own_y: float | None = None
        self.own_speed = 0.0
        self.own_heading = 0.0
        self.helm_drives = False
        self._said: dict[str, float | str] = {}
        self._recap_at = -math.inf
        self._filtered: dict[str, None] = {}
        self._new: list[str] = []

    # --- input -------------------------------------------------------------------------------

    def receive(self, text: str, now: float) -> None:
        """Take the text of a node report.

        Raises:
            ValueError: it cannot be used; the text says why.
        """
        report = NodeReport.parse(text)
        name = report.name
        if name.lower() == self._ownship and name:
            return
        contact = self.ledger.examine(report, now)
        known = name in self.tracked
        # The filter sees the local position even of a report that gives latitude and longitude only.
        if not (
            self._takes_all
            or self.parameters.filter.passes(name, report.group, report.type, contact.x, contact.y)
        ):
            if known:
                self._filtered[name] = None
            return
        if not known:
            away = math.hypot(contact.x - (self.own_x or 0.0), contact.y - (self.own_y or 0.0))
            if self._beyond_reach(away, 1.0):
                return
            if len(self.tracked) >= 2 * self.parameters.max_contacts:  # more is a flood, not traffic
                raise ValueError(f"more than {2 * self.parameters.max_contacts} contacts at once")
            self.tracked[name] = Tracked()
            self._new.append(name)
        if self._filtered:
            self._filtered.pop(name, None)
        self.ledger.take(contact)

    def request_alert(self, text: str) -> Alert:
        """Take an alert of the configuration or a BCM_ALERT_REQUEST; raises ValueError saying what is wrong."""
        if len(self.alerts) >= MAX_ALERTS and not any(f"id={known}" in text for known in self.alerts):
            raise ValueError(f"there are {MAX_ALERTS} alerts already")
        return apply_request(text, self.alerts)

    # --- one iteration -----------------------------------------------------------------------

    def step(self, now: float) -> list[Post]:
        """Update ranges, alerts and retirements; returns what to post, in order."""
        posts: list[Post] = []
        if self.own_x is None or self.own_y is None:
            return posts
        if self.parameters.alert_verbose:
            posts += [("ALERT_VERBOSE", f"new_contact={name}") for name in self._new]
        self._new.clear()
        self._update_ranges(self.own_x, self.own_y, now)
        self._retire(now, posts)
        if self.parameters.early_warning_time >= 0.0:
            self._warn_early(now, posts)
        if self.helm_drives or not self.parameters.hold_alerts_for_helm:
            self._update_alerts(now, posts)
        self._summarise(now, posts)
        return posts

    def _update_ranges(self, own_x: float, own_y: float, now: float) -> None:
        own_rad = math.radians(self.own_heading)
        sin, cos, hypot, radians = math.sin, math.cos, math.hypot, math.radians
        own_east, own_north = self.own_speed * sin(own_rad), self.own_speed * cos(own_rad)
        find, policy = self.ledger.get, self._policy
        for name, tracked in self.tracked.items():
            contact = find(name)
            assert contact is not None
            tracked.range_actual = hypot(contact.x - own_x, contact.y - own_y)
            x, y = contact.position(now, policy)
            tracked.x, tracked.y = x, y
            dx, dy = x - own_x, y - own_y
            tracked.range_extrapolated = reach = hypot(dx, dy)
            speed, rad = contact.speed, radians(contact.heading)
            wx = speed * sin(rad) - own_east
            wy = speed * cos(rad) - own_north
            tracked.closure = -(dx * wx + dy * wy) / reach if reach > 0.0 else 0.0

    def cpa(self, name: str) -> float:
        """Closest point of approach of a contact and ownship if both hold course and speed, within ten hours."""
        contact, tracked = self.ledger.get(name), self.tracked[name]
        assert contact is not None
        own, other = math.radians(self.own_heading), math.radians(contact.heading)
        dx, dy = tracked.x - (self.own_x or 0.0), tracked.y - (self.own_y or 0.0)
        wx = contact.speed * math.sin(other) - self.own_speed * math.sin(own)
        wy = contact.speed * math.cos(other) - self.own_speed * math.cos(own)
        closing, square = -(dx * wx + dy * wy), wx * wx + wy * wy
        if closing <= 0.0 or square == 0.0:
            return math.hypot(dx, dy)
        t = min(closing / square, CPA_HORIZON)
        return math.hypot(dx + t * wx, dy + t * wy)

    # --- retirement --------------------------------------------------------------------------

    def _beyond_reach(self, distance: float, factor: float) -> bool:
        limit = self.parameters.reject_range
        return limit is not None and self.own_x is not None and distance > factor * limit

    def _retire(self, now: float, posts: list[Post]) -> None:
        p = self.parameters
        farthest = (
            math.inf if p.reject_range is None or self.own_x is None else _RETIRE_FACTOR * p.reject_range
        )
        oldest, filtered, find = p.contact_max_age, self._filtered, self.ledger.get
        gone = []
        for name, tracked in self.tracked.items():
            contact = find(name)
            assert contact is not None
            if now - contact.heard_at > oldest or name in filtered or tracked.range_actual > farthest:
                gone.append(name)
        gone.sort()
        excess = len(self.tracked) - len(gone) - p.max_contacts
        if excess > 0:
            gone += self._surplus(excess, set(gone), now)
        for name in gone:
            self._retire_one(name, now, posts)
        self._filtered.clear()

    def _surplus(self, count: int, gone: set[str], now: float) -> list[str]:
        """Whom to let go when there are too many: first those half way to their age limit, then the farthest."""

        def urgency(name: str) -> tuple[bool, float, str]:
            contact = self.ledger.get(name)
            assert contact is not None
            aging = contact.age(now) > self.parameters.contact_max_age / 2.0
            return (not aging, -self.tracked[name].range_actual, name)

        return sorted((name for name in self.tracked if name not in gone), key=urgency)[:count]

    def _retire_one(self, name: str, now: float, posts: list[Post]) -> None:
        contact = self.ledger.get(name)
        assert contact is not None
        # Whoever was alerted about a contact also hears that it is gone.
        for alert_id in sorted(self.tracked[name].alerts):
            self._switch_off(contact, self.tracked[name], alert_id, now, posts)
        macros = self.macros(contact, now)
        posts += [flag_post(flag, macros) for flag in self.parameters.retire_flags]
        if name in self.retired:
            self.retired.remove(name)
        self.retired.appendleft(name)
        del self.tracked[name]
        self.ledger.drop(name)

    # --- early warning -----------------------------------------------------------------------

    def _warn_early(self, now: float, posts: list[Post]) -> None:
        p = self.parameters
        far = max((alert.far_range for alert in self.alerts.values() if alert.is_usable), default=0.0)
        for name, tracked in sorted(self.tracked.items()):
            reach = tracked.range_extrapolated
            if tracked.warned_at is None:
                if tracked.closure > 0.0 and reach < far + tracked.closure * p.early_warning_time:
                    tracked.warned_at, tracked.warned_range = now, reach
                    self._post_warning(name, p.early_warning_flags, now, posts)
            elif reach > _RETIRE_FACTOR * tracked.warned_range:
                tracked.warned_at = None
                self._post_warning(name, p.cease_warning_flags, now, posts)

    def _post_warning(self, name: str, flags: tuple[str, ...], now: float, posts: list[Post]) -> None:
        tracked = self.tracked[name]
        macros = {
            "CONTACT": name,
            "RNG": num(tracked.range_actual),
            "RNG_EXT": num(tracked.range_extrapolated),
            "CPA": num(self.cpa(name)),
            "ROC": num(tracked.closure),
            "UTC": fix(now),
        }
        posts += [flag_post(flag, macros) for flag in flags]

    # --- alerts ------------------------------------------------------------------------------

    def _update_alerts(self, now: float, posts: list[Post]) -> None:
        usable = [a for _, a in sorted(self.alerts.items()) if a.enabled and a.is_usable]
        wanted = {a.id for a in usable}
        if not usable and not any(tracked.alerts for tracked in self.tracked.values()):
            return
        for name, tracked in sorted(self.tracked.items()):
            contact = self.ledger.get(name)
            assert contact is not None
            for alert_id in sorted(tracked.alerts - wanted):
                self._switch_off(contact, tracked, alert_id, now, posts)
            for alert in usable:
                applies = self._applies(alert, contact, tracked, now)
                if applies and alert.id not in tracked.alerts:
                    self._switch_on(contact, tracked, alert, now, posts)
                elif not applies and alert.id in tracked.alerts:
                    self._switch_off(contact, tracked, alert.id, now, posts)

    def _applies(self, alert: Alert, contact: Contact, tracked: Tracked, now: float) -> bool:
        # The cheap questions first: this is asked of every contact and alert in every iteration.
        near, reach = alert.alert_range or 0.0, tracked.range_actual
        if near > 0.0 and reach > near and reach > alert.far_range:
            return False
        if now - contact.heard_at > self.parameters.contact_max_age:
            return False
        report = contact.report
        if not alert.filter.passes(contact.name, report.group, report.type, contact.x, contact.y):
            return False
        return near <= 0.0 or reach <= near or self.cpa(contact.name) <= near

    def _switch_on(
        self, contact: Contact, tracked: Tracked, alert: Alert, now: float, posts: list[Post]
    ) -> None:
        tracked.alerts.add(alert.id)
        macros = self.macros(contact, now)
        posts += [flag_post(flag, macros) for flag in alert.on_flags]
        if self.parameters.alert_verbose:
            text = f"{self._verbose(contact, tracked, alert)},range_cpa={num(self.cpa(contact.name), 1)}"
            if tracked.warned_at is not None:
                text += f",after_warning={num(now - tracked.warned_at)}"
            posts.append(("ALERT_VERBOSE", text.replace("#", "off-->alerted", 1)))

    def _switch_off(
        self, contact: Contact, tracked: Tracked, alert_id: str, now: float, posts: list[Post]
    ) -> None:
        tracked.alerts.discard(alert_id)
        alert = self.alerts.get(alert_id)
        if alert is None:
            return
        macros = self.macros(contact, now)
        posts += [flag_post(flag, macros) for flag in alert.off_flags]
        if self.parameters.alert_verbose:
            text = self._verbose(contact, tracked, alert)
            posts.append(("ALERT_VERBOSE", text.replace("#", "alerted-->off", 1)))

    def _verbose(self, contact: Contact, tracked: Tracked, alert: Alert) -> str:
        return (
            f"contact={contact.name},alert_id={alert.id},#,alert_range={num(alert.alert_range or 0.0)},"
            f"alert_range_cpa={num(alert.far_range)},range_actual={num(tracked.range_actual, 1)}"
        )

    def macros(self, contact: Contact, now: float) -> dict[str, str]:
        """What flags may say about a contact."""
        report = self.ledger.complete(contact)
        return {
            "X": num(contact.x),
            "Y": num(contact.y),
            "LAT": "" if report.lat is None else num(report.lat, 8),
            "LON": "" if report.lon is None else num(report.lon, 8),
            "SPD": num(contact.speed),
            "HDG": num(contact.heading),
            "DEP": num(report.depth or 0.0),
            "VNAME": contact.name,
            "VTYPE": report.type,
            "GROUP": report.group,
            "UTIME": fix(contact.time),
            "UTC": fix(now),
        }

    # --- summaries ---------------------------------------------------------------------------

    def _summarise(self, now: float, posts: list[Post]) -> None:
        p = self.parameters
        names = sorted(self.tracked)
        tracked = self.tracked
        pairs = [
            (name.lower(), alert)
            for name in names
            if tracked[name].alerts
            for alert in sorted(tracked[name].alerts)
        ]
        self._say(posts, "CONTACTS_LIST", ",".join(names))
        self._say(posts, "CONTACTS_ALERTED", "".join(f"({name},{alert})" for name, alert in pairs))
        self._say(posts, "CONTACTS_COUNT", float(len(pairs)))
        self._say(posts, "CONTACTS_RETIRED", ",".join(self.retired))
        self._say_closest(posts, now)
        if p.post_all_ranges:
            ranges = sorted(tracked.range_extrapolated for tracked in self.tracked.values())
            posts.append(("CONTACT_RANGES", ",".join(num(each, 1) for each in ranges)))
        if p.recap_interval is not None and now - self._recap_at >= p.recap_interval:
            self._recap_at = now
            posts.append(("CONTACTS_RECAP", " # ".join(self._recap(name, now) for name in names)))
        for variable, text in self.requests.step(self._within, now):
            posts.append((variable, text))

    def _say(self, posts: list[Post], variable: str, value: float | str) -> None:
        """Post when it differs from what was said last."""
        if self._said.get(variable) != value:
            self._said[variable] = value
            posts.append((variable, value))

    def _say_closest(self, posts: list[Post], now: float) -> None:
        if not self.tracked:
            self._say(posts, "CONTACT_CLOSEST", "")
            return
        name = min([(each.range_extrapolated, name) for name, each in self.tracked.items()])[1]
        if self._said.get("CONTACT_CLOSEST") != name:
            self._say(posts, "CONTACT_CLOSEST", name)
            posts.append(("CONTACT_CLOSEST_TIME", now))
        tracked = self.tracked[name]
        if self.parameters.post_closest_range:
            self._say(posts, "CONTACT_CLOSEST_RANGE", float(int(tracked.range_extrapolated)))
        if self.parameters.post_closest_relbng:
            toward = bearing(self.own_x or 0.0, self.own_y or 0.0, tracked.x, tracked.y)
            self._say(posts, "CONTACT_CLOSEST_RELBNG", float(int(angle360(toward - self.own_heading))))

    def _recap(self, name: str, now: float) -> str:
        contact = self.ledger.get(name)
        assert contact is not None
        return f"vname={name},range={fix(self.tracked[name].range_extrapolated)},age={fix(contact.age(now))}"

    def _within(self, reach: float, group: str, kind: str) -> str:
        """Names of contacts within `reach`, of that group and type where given."""
        found = []
        for name, tracked in sorted(self.tracked.items()):
            contact = self.ledger.get(name)
            assert contact is not None
            told = contact.report
            if tracked.range_extrapolated >= reach:
                continue
            if group and told.group.lower() != group.lower():
                continue
            if kind and kind.lower() not in (told.type.lower(), contact.type):
                continue
            found.append(name)
        return ",".join(found)
