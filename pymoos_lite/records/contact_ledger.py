"""The contact ledger: what is known of every vessel that reports (marine_apps.md 4).

Contact manager, node comms, referees and viewers share its rules: which reports count, what is filled
in, how old a contact is. No clock and no mail: reports and mission time (seconds) come in as arguments.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from pymoos_lite.geometry.angles import bearing, unit_vector
from pymoos_lite.geometry.geodesy import Geodesy, GeodesyError
from pymoos_lite.geometry.text import parse_number
from pymoos_lite.records.csp import fields
from pymoos_lite.records.node_report import NodeReport

_TYPE_NAMES = (
    "auv kayak uuv usv glider asv ship mokai longship buoy heron swimmer cray bcray crayx bcrayx "
    "wamv smr smrx skyw skywalker quad quadcopter"
)
VESSEL_TYPES = frozenset(_TYPE_NAMES.split())
_DIVERS = ("auv", "glider")
_LENGTHS = {
    "auv": 3.0,
    "heron": 3.0,
    "kayak": 3.0,
    "glider": 2.0,
    "cray": 1.5,
    "bcray": 1.5,
    "crayx": 1.5,
    "bcrayx": 1.5,
    "ship": 12.0,
    "longship": 15.0,
    "wamv": 6.0,
    "smr": 6.0,
}
MAX_CONTACTS = 2000
_BACKWARDS = 0.1


class Refused(ValueError):
    """A report that the ledger does not take; the text is the reason."""


@dataclass(slots=True)
class Contact:
    """One vessel: its last report, completed, and when it came (mission seconds).

    The report has x, y, cog, type and length; lat and lon too if the ledger knows the datum.
    """

    report: NodeReport
    received: float
    reports: int = 1

    def age(self, now: float) -> float:
        """Seconds since the last report came."""
        return now - self.received


class ContactLedger:
    """A table of contacts by name, bounded in size."""

    def __init__(self, geodesy: Geodesy | None) -> None:
        self._geodesy = geodesy
        self._contacts: dict[str, Contact] = {}

    def __len__(self) -> int:
        return len(self._contacts)

    def __contains__(self, name: str) -> bool:
        return name in self._contacts

    def __iter__(self) -> Iterator[str]:
        """Names, in order of first mention."""
        return iter(self._contacts)

    def get(self, name: str) -> Contact | None:
        return self._contacts.get(name)

    def items(self) -> Iterator[tuple[str, Contact]]:
        return iter(self._contacts.items())

    def update(self, report: NodeReport, now: float) -> Contact:
        """Take in a report.

        Raises:
            Refused: it lacks a name, a time or a position, is a diver without depth, or one too many.
        """
        name = report.name
        former = self._contacts.get(name)
        completed = self._complete(report, former)
        if former is None:
            if len(self._contacts) >= MAX_CONTACTS:
                raise Refused(f"more than {MAX_CONTACTS} contacts")
            former = self._contacts[name] = Contact(completed, now)
        else:
            former.report = completed
            former.received = now
            former.reports += 1
        return former

    def forget(self, name: str) -> None:
        """Drop a contact; an unknown name does nothing."""
        self._contacts.pop(name, None)

    def forget_older(self, age: float, now: float) -> list[str]:
        """Drop contacts that have not reported for `age` seconds; their names."""
        gone = [name for name, contact in self._contacts.items() if now - contact.received > age]
        for name in gone:
            del self._contacts[name]
        return gone

    def _complete(self, report: NodeReport, former: Contact | None) -> NodeReport:
        if not report.name:
            raise Refused("Missing vname.")
        if report.time is None:
            raise Refused("Missing timestamp.")
        has_xy, has_latlon = report.has_xy(), report.has_latlon()
        if not has_xy and not has_latlon:
            raise Refused("Missing both x/y and lat/lon.")
        kind = _vessel_type(report)
        more: dict[str, object] = {"type": kind}
        x, y = report.x, report.y
        geodesy = self._geodesy
        try:
            if not has_xy:
                if geodesy is None:
                    raise Refused("lat/lon only, and this mission has no datum")
                assert report.lat is not None
                assert report.lon is not None
                x, y = geodesy.to_local(report.lat, report.lon)
                more["x"], more["y"] = x, y
            elif not has_latlon and geodesy is not None:
                assert x is not None
                assert y is not None
                more["lat"], more["lon"] = geodesy.to_latlon(x, y)
        except GeodesyError as error:
            raise Refused(f"position: {error}") from None
        if not report.length:
            more["length"] = _LENGTHS.get(kind, 0.0)
        if report.cog is None:
            more["cog"] = _course(report, former, x, y)
        # A copy by its dictionary: many reports a second for every vessel of a fleet.
        completed = NodeReport.__new__(NodeReport)
        completed.__dict__.update(report.__dict__)
        completed.__dict__.update(more)
        return completed


def _vessel_type(report: NodeReport) -> str:
    kind = report.type.lower()
    kind = "auv" if kind == "uuv" else kind if kind in VESSEL_TYPES else "ship"
    if kind in _DIVERS and report.depth is None:
        raise Refused(f"{kind} without a depth")
    return kind


def _course(report: NodeReport, former: Contact | None, x: float | None, y: float | None) -> float:
    """Course over ground: from the previous position if it moved, else the heading."""
    if former is not None and x is not None and y is not None:
        old = former.report
        if old.x is not None and old.y is not None and (old.x != x or old.y != y):
            return bearing(old.x, old.y, x, y)
        if old.cog is not None:
            return old.cog
    return report.heading or 0.0


@dataclass(frozen=True, slots=True)
class Extrapolation:
    """How a contact is thought to have moved on since its report.

    `mode` is off, hdg or cog; linear motion, slowing down between `decay_start` and `decay_end`
    seconds (both 0: no slowing down).
    """

    mode: str = "off"
    decay_start: float = 0.0
    decay_end: float = 0.0

    @classmethod
    def parse(cls, text: str) -> Extrapolation:
        """``mode=hdg,decay=10:15`` or ``decay=off``; other keys are the viewer's.

        Raises:
            ValueError: unknown mode or a decay that is no range.
        """
        mode, start, end = "off", 0.0, 0.0
        for key, value in fields(text):
            if key.lower() == "mode":
                mode = value.lower()
                if mode not in ("off", "hdg", "cog"):
                    raise ValueError(f"mode={value}: expected off, hdg or cog")
            elif key.lower() == "decay" and value.lower() != "off":
                low, colon, high = value.partition(":")
                first, last = parse_number(low), parse_number(high)
                if not colon or first is None or last is None or not 0.0 <= first <= last:
                    raise ValueError(f"decay={value}: expected off or two ages in seconds, as 10:15")
                start, end = first, last
        return cls(mode, start, end)

    def position(self, report: NodeReport, now: float) -> tuple[float, float]:
        """Where the vessel is by now; where it was, if time seems to run backwards.

        Raises:
            ValueError: the report has no x, y.
        """
        x, y = report.x, report.y
        if x is None or y is None:
            raise ValueError("the report has no x, y")
        course = report.cog if self.mode == "cog" else report.heading
        speed = report.speed
        if self.mode == "off" or course is None or speed is None or report.time is None:
            return x, y
        age = now - report.time
        if age < -_BACKWARDS:
            return x, y
        east, north = unit_vector(course)
        distance = speed * self._effective(max(0.0, age))
        return x + east * distance, y + north * distance

    def _effective(self, age: float) -> float:
        """The seconds at full speed that give the distance covered in `age` seconds."""
        start, end = self.decay_start, self.decay_end
        if age <= start or end <= 0.0:
            return age
        if end <= start:
            return start
        part = min(age, end) - start
        return start + part - part * part / (2.0 * (end - start))
