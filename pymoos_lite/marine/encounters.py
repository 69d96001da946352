"""How close two vessels came: closest points of approach from their reports (marine_apps.md 7.2).

`ApproachMonitor` follows one pair along straight lines between reports, both vessels at the same time, and
finds the true minimum. `SampledApproach` is the rule of the reference, which compares the latest positions
whenever one of them is new; it comes late and reports too large a range, and is here for comparison with old logs.
`EncounterReferee` keeps all pairs, ranks each encounter and counts. No mail, no clock.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from mypy_extensions import mypyc_attr

from pymoos_lite.geometry.angles import angle180, angle360, bearing
from pymoos_lite.records.csp import num

HYSTERESIS = 1.0  # m that the range must change by before a new direction is believed
_FORGET_FACTOR = 1.5  # pairs farther apart than this many encounter ranges are forgotten
_HISTORY = 64  # reports kept per vessel while its partner is silent


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Fix:
    """Where a vessel was at a time; metres, degrees, seconds."""

    time: float
    x: float
    y: float
    heading: float


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Ranks:
    """Ranges in metres that make an approach an encounter, a near miss or a collision."""

    encounter: float = 20.0
    near_miss: float = 6.0
    collision: float = 3.0

    def ordered(self) -> Ranks:
        """The same with near miss and encounter raised to keep collision <= near miss <= encounter."""
        near_miss = max(self.near_miss, self.collision)
        return Ranks(max(self.encounter, near_miss), near_miss, self.collision)

    def rank(self, cpa: float) -> str:
        """`collision`, `near_miss` or `clear`."""
        if cpa <= self.collision:
            return "collision"
        return "near_miss" if cpa <= self.near_miss else "clear"


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Encounter:
    """One passing of two vessels.

    `cpa` is the least range; `x`, `y` the middle between them and the bearings relative to the bow those at the
    moment of detection, `beta` of the second vessel seen from the first, `alpha` the reverse.
    """

    vname1: str
    vname2: str
    cpa: float
    rank: str
    x: float
    y: float
    alpha: float
    beta: float
    time: float

    def report(self) -> str:
        """The text of UCD_REPORT."""
        return (
            f"cpa={num(self.cpa)},vname1={self.vname1},vname2={self.vname2},rank={self.rank},"
            f" alpha={num(self.alpha, 3)}, beta={num(self.beta, 3)},"
            f" ptype={_side(self.beta)}:{_side(self.alpha)}, xtype={_end(self.beta)}:{_end(self.alpha)}"
        )


def _side(relative: float) -> str:
    return "port" if relative > 180.0 else "star"


def _end(relative: float) -> str:
    return "fore" if relative <= 90.0 or relative >= 270.0 else "aft"


class ApproachMonitor:
    """Least range of one pair, by tracks that are straight between reports.

    Each vessel's reports may come at their own times and late; the pair is judged up to the latest time for
    which both are known.
    """

    def __init__(self) -> None:
        self._tracks: tuple[deque[Fix], deque[Fix]] = (deque(maxlen=_HISTORY), deque(maxlen=_HISTORY))
        self._upto = -math.inf
        self._closing = False
        self._least = math.inf
        self._most = -math.inf
        self.range = math.inf

    def hear(self, which: int, fix: Fix) -> Iterator[tuple[float, Fix, Fix]]:
        """Take a fix of the first (0) or second (1) vessel.

        Yields (least range, first vessel, second vessel) for each approach that is found to be over, with
        the vessels where they were when that was found.
        """
        own, other = self._tracks[which], self._tracks[1 - which]
        if own and fix.time <= own[-1].time:
            return  # a report overtaken on its way says nothing new
        own.append(fix)
        if not other:
            return
        first, second = self._tracks
        until = min(first[-1].time, second[-1].time)
        begin = max(first[0].time, second[0].time, self._upto)
        if until < begin or until <= self._upto:
            return
        between = [f.time for track in self._tracks for f in track if begin < f.time < until]
        moments = sorted({begin, until, *between}) if between else sorted({begin, until})
        before: tuple[Fix, Fix] | None = None
        for moment in moments:
            pair = _at(first, moment), _at(second, moment)
            over = self._advance(before, pair)
            if over is not None:
                yield over, *pair
            before = pair
        self._upto = until
        for track in self._tracks:  # only the last fix before `until` is still needed
            while len(track) > 1 and track[1].time <= until:
                track.popleft()

    def _advance(self, before: tuple[Fix, Fix] | None, pair: tuple[Fix, Fix]) -> float | None:
        dx, dy = pair[1].x - pair[0].x, pair[1].y - pair[0].y
        now = math.hypot(dx, dy)
        least = now
        if before is not None:
            least = _least_range(before[1].x - before[0].x, before[1].y - before[0].y, dx, dy)
        self.range = now
        if not self._closing:
            if self._most - least > HYSTERESIS:
                self._closing = True
                self._least = least
            else:
                self._most = max(self._most, now)
                return None
        self._least = min(self._least, least)
        if now - self._least > HYSTERESIS:
            self._closing = False
            self._most = now
            return self._least
        return None


def _at(track: deque[Fix], moment: float) -> Fix:
    """The vessel of `track` at `moment`, which lies within it."""
    later = track[-1]
    for fix in reversed(track):
        if fix.time <= moment:
            if fix is later or later.time <= fix.time:
                return fix
            share = (moment - fix.time) / (later.time - fix.time)
            return Fix(
                moment,
                fix.x + share * (later.x - fix.x),
                fix.y + share * (later.y - fix.y),
                angle360(fix.heading + share * angle180(later.heading - fix.heading)),
            )
        later = fix
    return track[0]


def _least_range(x0: float, y0: float, x1: float, y1: float) -> float:
    """Distance of the origin from the segment (x0, y0)-(x1, y1)."""
    ex, ey = x1 - x0, y1 - y0
    square = ex * ex + ey * ey
    share = 0.0 if square <= 0.0 else min(1.0, max(0.0, -(x0 * ex + y0 * ey) / square))
    return math.hypot(x0 + share * ex, y0 + share * ey)


class SampledApproach:
    """The reference's rule for one pair: latest positions, and extremes that are the latest falling or rising
    sample rather than the least or greatest."""

    def __init__(self) -> None:
        self._latest: list[Fix | None] = [None, None]
        self._before: float | None = None
        self._closing = False
        self._low = math.inf
        self._high = -math.inf
        self.range = math.inf

    def hear(self, which: int, fix: Fix) -> Iterator[tuple[float, Fix, Fix]]:
        """As `ApproachMonitor.hear`."""
        self._latest[which] = fix
        first, second = self._latest
        if first is None or second is None:
            return
        now = self.range = math.hypot(second.x - first.x, second.y - first.y)
        before, self._before = self._before, now
        if before is None:
            self._low = self._high = now
        elif now < before:
            if not self._closing and self._high - now > HYSTERESIS:
                self._closing = True
            self._low = now
        elif now > before:
            over = self._closing and now - self._low > HYSTERESIS
            if over:
                self._closing = False
            self._high = now
            if over:
                yield self._low, first, second


@dataclass(slots=True)
class Totals:
    """Counts since the start."""

    encounters: int = 0
    near_misses: int = 0
    collisions: int = 0


@dataclass(slots=True)
class _Pair:
    vname1: str
    vname2: str
    monitor: ApproachMonitor | SampledApproach = field(default_factory=ApproachMonitor)


class EncounterReferee:
    """All pairs of vessels.

    With `compat` pairs are judged by the reference's sampled rule. `totals` counts encounters, of which near
    misses and collisions are the worse ones (a collision is not a near miss as well).
    """

    def __init__(self, ranks: Ranks, compat: bool = False) -> None:
        self.ranks = ranks.ordered()
        self.totals = Totals()
        self.closest_ever = math.inf
        self.judging = True
        """While off, encounters are followed but those that end are neither counted nor told."""
        self.excuses: Callable[[str, str], bool] = lambda one, other: False
        """Says of two vessels that they are none of the referee's business."""
        self._compat = compat
        self._pairs: dict[tuple[str, str], _Pair] = {}
        self._latest: dict[str, Fix] = {}

    def hear(self, name: str, fix: Fix) -> list[Encounter]:
        """Take a vessel's position; returns the encounters that it shows to be over."""
        known = self._latest.get(name)
        if known is not None and fix.time < known.time:
            return []
        self._latest[name] = fix
        found: list[Encounter] = []
        x, y, pairs = fix.x, fix.y, self._pairs
        far = _FORGET_FACTOR * self.ranks.encounter
        for other, there in sorted(self._latest.items()):
            if other == name:
                continue
            key = (name, other) if name < other else (other, name)
            too_far = math.hypot(x - there.x, y - there.y) > far
            # Most vessels are far from most others, and nothing is known of those pairs.
            if not too_far or key in pairs:
                found += self._hear_pair(key, name, other, fix, too_far)
        return found

    def ranges(self) -> dict[tuple[str, str], float]:
        """Present range of each pair that is being followed, by names in alphabetical order."""
        return {key: pair.monitor.range for key, pair in sorted(self._pairs.items())}

    def closest_range(self) -> float:
        """Least present range of all pairs followed, infinite without any."""
        return min((pair.monitor.range for pair in self._pairs.values()), default=math.inf)

    def within(self, name: str, reach: float) -> int:
        """How many other vessels were last heard within `reach` metres of `name`."""
        here = self._latest.get(name)
        if here is None:
            return 0
        return sum(
            1
            for other, fix in self._latest.items()
            if other != name and math.hypot(fix.x - here.x, fix.y - here.y) <= reach
        )

    def forget(self, name: str) -> None:
        """Drop a vessel and its pairs."""
        self._latest.pop(name, None)
        for key in [key for key in self._pairs if name in key]:
            del self._pairs[key]

    def _hear_pair(
        self, key: tuple[str, str], name: str, other: str, fix: Fix, too_far: bool
    ) -> list[Encounter]:
        pair = self._pairs.get(key)
        if pair is None:
            if self.excuses(name, other):
                return []
            # Whoever reported first is the first vessel of the pair.
            pair = self._pairs[key] = _Pair(other, name)
            if self._compat:
                pair.monitor = SampledApproach()
            list(pair.monitor.hear(0, self._latest[other]))
        which = 0 if name == pair.vname1 else 1
        found = [
            self._judge(pair, cpa, first, second)
            for cpa, first, second in pair.monitor.hear(which, fix)
            if cpa <= self.ranks.encounter and self.judging
        ]
        self.closest_ever = min(self.closest_ever, pair.monitor.range, *(each.cpa for each in found))
        if too_far:
            del self._pairs[key]
        return found

    def _judge(self, pair: _Pair, cpa: float, first: Fix, second: Fix) -> Encounter:
        totals = self.totals
        totals.encounters += 1
        rank = self.ranks.rank(cpa)
        if rank == "collision":
            totals.collisions += 1
        elif rank == "near_miss":
            totals.near_misses += 1
        beta = angle360(bearing(first.x, first.y, second.x, second.y) - first.heading)
        alpha = angle360(bearing(second.x, second.y, first.x, first.y) - second.heading)
        return Encounter(
            pair.vname1,
            pair.vname2,
            cpa,
            rank,
            (first.x + second.x) * 0.5,
            (first.y + second.y) * 0.5,
            alpha,
            beta,
            max(first.time, second.time),
        )
