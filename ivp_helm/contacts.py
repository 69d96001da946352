"""The contact ledger: what node reports say about other vessels (helm.md 11.2).

Behaviours see positions as last reported; nothing is extrapolated unless the helm is told to.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from math import cos, radians, sin

from pymoos_lite.geometry.angles import bearing
from pymoos_lite.records.csp import RecordError
from pymoos_lite.records.node_report import NodeReport

Geodesy = Callable[[float, float], tuple[float, float]]

KNOWN_TYPES = frozenset(
    [
        "auv",
        "kayak",
        "uuv",
        "usv",
        "glider",
        "asv",
        "ship",
        "mokai",
        "longship",
        "buoy",
        "heron",
        "swimmer",
        "cray",
        "bcray",
        "crayx",
        "bcrayx",
        "wamv",
        "smr",
        "smrx",
        "skyw",
        "skywalker",
        "quad",
        "quadcopter",
    ]
)
_LENGTHS = {
    **dict.fromkeys(("auv", "kayak", "heron"), 3.0),
    "glider": 2.0,
    **dict.fromkeys(("cray", "bcray", "crayx", "bcrayx"), 1.5),
    "ship": 12.0,
    "longship": 15.0,
    **dict.fromkeys(("wamv", "smr", "smrx"), 6.0),
}
MAX_CONTACTS = 1000


@dataclass(frozen=True, slots=True)
class Contact:
    """Another vessel: metres, degrees, m/s, metres down; `utc` is its report's time, `received` ours."""

    name: str
    x: float
    y: float
    heading: float
    speed: float
    depth: float
    lat: float
    lon: float
    utc: float
    received: float
    group: str = ""
    type: str = ""
    vsource: str = ""
    length: float = 0.0
    course_over_ground: float = 0.0

    def extrapolated(self, now: float, limit: float) -> Contact:
        """Where it is now if it kept course and speed, for at most `limit` seconds since its report."""
        seconds = min(max(0.0, now - self.utc), limit)
        way = self.speed * seconds
        angle = radians(self.heading)
        return replace(self, x=self.x + way * sin(angle), y=self.y + way * cos(angle))


class LedgerError(ValueError):
    """A node report that cannot be used; says why."""


class Ledger:
    """All contacts by their exact names.

    `to_local` turns latitude and longitude into x and y where a report has only those; `max_age` is in
    seconds and doubled for contacts that a behaviour refers to.
    """

    def __init__(
        self,
        own: str,
        max_age: float = 45.0,
        to_local: Geodesy | None = None,
        to_latlon: Geodesy | None = None,
        extrapolate: float = 0.0,
    ) -> None:
        self.own = own
        self.max_age = max_age
        self.reports = 0
        self._to_local = to_local
        self._to_latlon = to_latlon
        self._extrapolate = extrapolate
        self._reported: dict[str, Contact] = {}
        self.contacts: dict[str, Contact] = {}
        """The snapshot of this iteration; the same object for the ledger's whole life."""

    def take(self, text: str, now: float) -> Contact | None:
        """Note a report; None if it is about own ship.

        Raises:
            LedgerError: the report lacks something, or is no report.
        """
        try:
            report = NodeReport.parse(text)
        except RecordError as error:
            raise LedgerError(str(error)) from None
        if report.name == self.own:
            return None
        contact = self._contact(report, now)
        if contact.name not in self._reported and len(self._reported) >= MAX_CONTACTS:
            raise LedgerError(f"more than {MAX_CONTACTS} contacts")
        self.reports += 1
        self._reported[contact.name] = contact
        return contact

    def refresh(self, now: float, referred: Collection[str] = ()) -> None:
        """Drop contacts whose reports are too old, and make the snapshot of this iteration."""
        stale = [
            name
            for name, contact in self._reported.items()
            if now - contact.utc > (2.0 * self.max_age if name in referred else self.max_age)
        ]
        for name in stale:
            del self._reported[name]
        self.contacts.clear()
        if self._extrapolate > 0.0:
            self.contacts.update(
                {name: c.extrapolated(now, self._extrapolate) for name, c in self._reported.items()}
            )
        else:
            self.contacts.update(self._reported)

    def summary(self) -> str:
        """The value of IVPHELM_LEDGER_SUMMARY: ``now:2, reps:40, who:ben,cal`` (at most 20 names)."""
        who = ",".join(sorted(self._reported)[:20])
        return f"now:{len(self._reported)}, reps:{self.reports}, who:{who}"

    def _contact(self, report: NodeReport, now: float) -> Contact:
        if not report.name:
            raise LedgerError("NAME is missing")
        if report.time is None:
            raise LedgerError("TIME is missing")
        kind = report.type.lower()
        kind = "auv" if kind == "uuv" else kind if kind in KNOWN_TYPES else "ship"
        if kind in ("auv", "glider") and report.depth is None:
            raise LedgerError(f"a vessel of type {kind} must report its depth")
        x, y, lat, lon = report.x, report.y, report.lat, report.lon
        if x is None or y is None:
            if lat is None or lon is None:
                raise LedgerError("neither X,Y nor LAT,LON is given")
            if self._to_local is None:
                raise LedgerError("X,Y are missing, and without LatOrigin they cannot be found from LAT,LON")
            x, y = self._to_local(lat, lon)
        elif (lat is None or lon is None) and self._to_latlon is not None:
            lat, lon = self._to_latlon(x, y)
        heading = (report.heading or 0.0) % 360.0
        former = self._reported.get(report.name)
        return Contact(
            report.name,
            x,
            y,
            heading,
            max(0.0, report.speed or 0.0),
            report.depth or 0.0,
            lat or 0.0,
            lon or 0.0,
            report.time,
            now,
            report.group,
            kind,
            report.vsource,
            report.length if report.length else _LENGTHS.get(kind, 0.0),
            _course_over_ground(former, x, y, heading),
        )


def _course_over_ground(former: Contact | None, x: float, y: float, heading: float) -> float:
    if former is None or (former.x == x and former.y == y):
        return heading
    return bearing(former.x, former.y, x, y)
