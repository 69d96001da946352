"""Who is out there: the latest report of every other vessel, and where it should be by now (marine_apps.md 4).

Shared by the contact manager, node comms, viewers and referees. The ledger refuses reports that cannot be used
and says why; whoever feeds it decides what to make of that. Metres, m/s, degrees; times in seconds.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache

from mypy_extensions import mypyc_attr

from pymoos_lite.geometry.angles import bearing, unit_vector
from pymoos_lite.geometry.geodesy import Geodesy, GeodesyError
from pymoos_lite.records.csp import fields, parse_number
from pymoos_lite.records.node_report import NodeReport

KNOWN_TYPES = frozenset(
    {"auv", "kayak", "uuv", "usv", "glider", "asv", "ship", "mokai", "longship", "buoy", "heron", "swimmer"}
    | {"cray", "bcray", "crayx", "bcrayx", "wamv", "smr", "smrx", "skyw", "skywalker", "quad", "quadcopter"}
)
_LENGTHS = {
    **dict.fromkeys(("auv", "kayak", "heron"), 3.0),
    "glider": 2.0,
    **dict.fromkeys(("cray", "bcray", "crayx", "bcrayx"), 1.5),
    "ship": 12.0,
    "longship": 15.0,
    **dict.fromkeys(("wamv", "smr"), 6.0),
}
_NEEDS_DEPTH = frozenset({"auv", "glider"})
_FARTHEST = 1e8  # m; more than any ocean, and far from where arithmetic overflows
_FASTEST = 1e5  # m/s
_BACKWARD = 0.1  # s that a report may be ahead of now and still be extrapolated


class ExtrapolationMode(Enum):
    """Which direction an extrapolated contact moves in."""

    OFF = "off"
    HEADING = "hdg"
    COURSE = "cog"


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Extrapolation:
    """How a contact is moved on between reports.

    It runs at its reported speed for `decay_start` seconds, then slower and slower, and rests from
    `decay_end` on; without decay it runs for ever. Contacts slower than `thresh` m/s are left where they are.
    """

    mode: ExtrapolationMode = ExtrapolationMode.OFF
    thresh: float = 0.0
    decay_start: float = math.inf
    decay_end: float = math.inf

    def __post_init__(self) -> None:
        if not 0.0 <= self.decay_start <= self.decay_end:
            raise ValueError("decay needs 0 <= start <= end, in seconds")

    def distance(self, speed: float, elapsed: float) -> float:
        """Metres run at `speed` in `elapsed` seconds."""
        start, end = self.decay_start, self.decay_end
        if elapsed <= start:
            return speed * elapsed
        span = end - start
        if span <= 0.0:
            return speed * start
        slowing = min(elapsed - start, span)
        return speed * (start + slowing - slowing * slowing / (2.0 * span))


def parse_extrapolation(text: str) -> Extrapolation:
    """`mode=hdg|cog|off, thresh=0.1, decay=10:15|off`; raises ValueError for anything else."""
    mode, thresh = ExtrapolationMode.OFF, 0.0
    start = end = math.inf
    for key, value in fields(text):
        word = key.lower()
        if word == "mode":
            mode = ExtrapolationMode(value.lower())
        elif word == "thresh" and (number := parse_number(value)) is not None and number >= 0.0:
            thresh = number
        elif word == "decay" and value.lower() == "off":
            start = end = math.inf
        elif word == "decay":
            start, end = parse_decay(value, ":")
        else:
            raise ValueError(f"'{key}={value}': expected mode=hdg|cog|off, thresh=m/s, decay=start:end|off")
    return Extrapolation(mode, thresh, start, end)


def parse_decay(text: str, separator: str = ",") -> tuple[float, float]:
    """`start,end` in seconds; raises ValueError unless 0 <= start <= end."""
    numbers = [parse_number(part) for part in text.split(separator)]
    if len(numbers) != 2 or numbers[0] is None or numbers[1] is None or not 0.0 <= numbers[0] <= numbers[1]:
        raise ValueError(f"expected start{separator}end in seconds, the start not after the end")
    return numbers[0], numbers[1]


class Contact:
    """One vessel as last heard; never changed, as many hold it.

    `report` is what it said; beside it stand the values to use: a local position, a known type, a length (None
    where nobody knows), a course over ground. `heard_at` is the local time of receipt, `time` the report's stamp.
    """

    # No dataclass, whose frozen kind is dear to make: every vessel makes one of every report of every other, twice.
    __slots__ = (
        "cog",
        "heading",
        "heard_at",
        "length",
        "name",
        "report",
        "speed",
        "time",
        "type",
        "x",
        "y",
    )

    def __init__(
        self,
        name: str,
        report: NodeReport,
        x: float,
        y: float,
        speed: float,
        heading: float,
        cog: float,
        time: float,
        heard_at: float,
        type: str,
        length: float | None,
    ) -> None:
        self.name = name
        self.report = report
        self.x, self.y = x, y
        self.speed, self.heading, self.cog = speed, heading, cog
        self.time, self.heard_at = time, heard_at
        self.type = type
        self.length = length

    def at(self, x: float, y: float) -> Contact:
        """The same contact at another place."""
        return Contact(
            self.name,
            self.report,
            x,
            y,
            self.speed,
            self.heading,
            self.cog,
            self.time,
            self.heard_at,
            self.type,
            self.length,
        )

    def age(self, now: float) -> float:
        """Seconds since the report was received."""
        return now - self.heard_at

    def position(self, now: float, policy: Extrapolation) -> tuple[float, float]:
        """Where the contact should be at `now`."""
        elapsed, mode, speed = now - self.time, policy.mode, self.speed
        if mode is ExtrapolationMode.OFF or elapsed < -_BACKWARD or abs(speed) < policy.thresh:
            return self.x, self.y
        if elapsed < 0.0:
            elapsed = 0.0
        run = speed * elapsed if elapsed <= policy.decay_start else policy.distance(speed, elapsed)
        east, north = unit_vector(self.heading if mode is ExtrapolationMode.HEADING else self.cog)
        return self.x + run * east, self.y + run * north


class ContactLedger:
    """Contacts by name, at most `capacity` of them; when full, the one not heard for longest goes.

    `history` is how many past positions are kept per contact (0 for none).
    """

    def __init__(self, geodesy: Geodesy | None, history: int = 0, capacity: int = 2000) -> None:
        self._geodesy = geodesy
        self._contacts: dict[str, Contact] = {}
        self._trails: dict[str, deque[tuple[float, float]]] = {}
        self._history = history
        self._capacity = capacity
        self._sorted: list[str] | None = []

    def __len__(self) -> int:
        return len(self._contacts)

    def __contains__(self, name: object) -> bool:
        return name in self._contacts

    def __iter__(self) -> Iterator[Contact]:
        """Contacts by name, so that equal runs are equal."""
        contacts = self._contacts
        return iter([contacts[name] for name in self._in_order()])

    def get(self, name: str) -> Contact | None:
        """The contact of exactly that name."""
        return self._contacts.get(name)

    def names(self) -> list[str]:
        """All names, sorted."""
        return list(self._in_order())

    def _in_order(self) -> list[str]:
        # Asked for many times a second, and changed when a vessel comes or goes.
        if self._sorted is None:
            self._sorted = sorted(self._contacts)
        return self._sorted

    def trail(self, name: str) -> list[tuple[float, float]]:
        """Past positions of a contact, oldest first."""
        return list(self._trails.get(name, ()))

    def receive(self, report: NodeReport, now: float) -> Contact:
        """Take a report; returns the contact it makes.

        Raises:
            ValueError: it cannot be used; the text is one line saying why.
        """
        return self.take(self.examine(report, now))

    def take(self, contact: Contact) -> Contact:
        """Take in what `examine` made of a report."""
        name = contact.name
        if name not in self._contacts:
            if len(self._contacts) >= self._capacity:
                oldest = min(self._contacts.values(), key=lambda each: (each.heard_at, each.name))
                self.drop(oldest.name)
            self._sorted = None
        self._contacts[name] = contact
        if self._history:
            self._trails.setdefault(name, deque(maxlen=self._history)).append((contact.x, contact.y))
        return contact

    def examine(self, report: NodeReport, now: float) -> Contact:
        """The contact that `receive` would make of a report, without taking it in; raises ValueError likewise."""
        name, x, y, speed, heading, course, time, kind, length = _said(report)
        if x is None or y is None:
            x, y = self._local_position(report)
        if not (abs(x) <= _FARTHEST and abs(y) <= _FARTHEST and abs(speed) <= _FASTEST):
            raise ValueError("Position or speed is beyond belief.")
        cog = course
        if cog is None:
            before = self._contacts.get(name)
            moved = before is not None and (before.x, before.y) != (x, y)
            cog = bearing(before.x, before.y, x, y) if before is not None and moved else heading
        return Contact(name, report, x, y, speed, heading, cog, time, now, kind, length)

    def complete(self, contact: Contact) -> NodeReport:
        """The contact's report with everything filled in that the ledger knows: what others are told of it."""
        report = contact.report
        lat, lon = report.lat, report.lon
        if (lat is None or lon is None) and self._geodesy is not None:
            try:
                lat, lon = self._geodesy.to_latlon(contact.x, contact.y)
            except GeodesyError:
                lat = lon = None  # too far for the projection: the local position has to do
        # A copy by its dictionary: node comms does this for every report of every vessel.
        completed = NodeReport.of(report.__dict__)
        completed.__dict__.update(
            x=contact.x,
            y=contact.y,
            lat=lat,
            lon=lon,
            cog=contact.cog,
            type=contact.type,
            length=contact.length,
        )
        return completed

    def drop(self, name: str) -> None:
        """Forget a contact; an unknown name is no error."""
        if self._contacts.pop(name, None) is not None:
            self._sorted = None
        self._trails.pop(name, None)

    def drop_older_than(self, age: float, now: float) -> list[str]:
        """Forget contacts not heard for more than `age` seconds; returns their names, sorted."""
        stale = [name for name, contact in self._contacts.items() if now - contact.heard_at > age]
        for name in stale:
            self.drop(name)
        return sorted(stale)

    def _local_position(self, report: NodeReport) -> tuple[float, float]:
        if report.lat is None or report.lon is None:
            raise ValueError("Missing both x/y and lat/lon.")
        if self._geodesy is None:
            raise ValueError("Missing x/y, and there is no datum to compute them from lat/lon.")
        try:
            return self._geodesy.to_local(report.lat, report.lon)
        except GeodesyError as error:
            raise ValueError(str(error)) from None


@lru_cache(maxsize=256)
def _known_type(kind: str) -> str:
    word = kind.strip().lower()
    if word == "uuv":
        return "auv"
    return word if word in KNOWN_TYPES else "ship"


_Said = tuple[
    str, float | None, float | None, float, float, float | None, float, str, float | None
]  # name, x, y, speed, heading, course over ground, time, type, length
_MOST_KEPT = 1024
_kept: dict[int, tuple[NodeReport, _Said]] = {}


def _said(report: NodeReport) -> _Said:
    """What a report says that does not depend on who hears it, and when; raises ValueError if it is of no use.

    Kept for a while by identity: in a fleet in lockstep some dozen ledgers are handed the very same report.
    """
    known = _kept.get(id(report))
    if known is not None and known[0] is report:
        return known[1]
    if not report.name:
        raise ValueError("Missing vname.")
    if report.time is None:
        raise ValueError("Missing timestamp.")
    kind = _known_type(report.type)
    if kind in _NEEDS_DEPTH and report.depth is None:
        raise ValueError(f"Missing depth of type {kind}.")
    said: _Said = (
        report.name,
        report.x,
        report.y,
        report.speed or 0.0,
        report.heading or 0.0,
        report.cog,
        report.time,
        kind,
        report.length or _LENGTHS.get(kind),
    )
    if len(_kept) >= _MOST_KEPT:
        _kept.clear()
    _kept[id(report)] = (report, said)
    return said
