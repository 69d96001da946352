"""pSwapStations: gives every vessel of the berta mission a station, and lets pairs swap theirs for ever.

Every `interval` seconds two vessels, drawn at random from those that have arrived, change places. A vessel
that does not start, or does not make for its station, is told again: what is sent over the bridge may be lost.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import cos, hypot, pi, sin

from pymoos_lite.app import App
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.records.csp import RecordError, field_map, num, parse_number
from pymoos_lite.records.node_report import NodeReport

ARRIVED = 30.0
"""Metres from its station within which a vessel counts as there."""

PATIENCE = 20.0
"""Seconds in which a vessel under way must have come nearer to its station."""

PROGRESS = 5.0
ASK_AGAIN = 15.0
"""Seconds after which a vessel that was deployed and does not sail is deployed again."""


def parse_names(text: str) -> list[str]:
    """Names separated by colons. Raises ValueError."""
    names = [name.strip() for name in text.split(":") if name.strip()]
    if not names or len(set(names)) < len(names):
        raise ValueError("expected names separated by colons, each once")
    return names


def parse_place(text: str) -> tuple[float, float]:
    """``x,y`` in metres. Raises ValueError."""
    x, y = (parse_number(part) for part in (*text.split(","), "")[:2])
    if x is None or y is None:
        raise ValueError("expected x,y")
    return x, y


class Vessel:
    """What is known of one vessel."""

    def __init__(self, station: int) -> None:
        self.station = station
        self.place: tuple[float, float] | None = None
        self.told_at = float("-inf")
        self.distance_then = float("inf")
        self.swaps = 0
        self.sails = False
        self.asked_at = float("-inf")


class SwapStations(App):
    """Assigns stations on a ring, and keeps the book of encounters."""

    MOOS_NAME = "pSwapStations"
    DEFAULT_TICK = 1.0
    PARAMETERS = Declaration(
        (
            Parameter(
                "vehicles",
                "custom",
                [],
                doc="Who takes part: NAME:NAME.",
                parse=parse_names,
                example="abe:ben",
            ),
            Parameter(
                "center", "custom", (0.0, 0.0), "m", "Middle of the ring.", parse=parse_place, example="0,0"
            ),
            Parameter("spacing", "number", 60.0, "m", "Between neighbouring stations.", low=1.0),
            Parameter("interval", "number", 45.0, "s", "Between one pair's swap and the next.", low=1.0),
        )
    )

    def on_start_up(self) -> None:
        names = self.config.vehicles
        self.vessels = {name: Vessel(i) for i, name in enumerate(names)}
        self.deployed_at: float | None = None
        self.interval: float = self.config.interval
        self.next_swap = float("inf")
        self.swaps = 0
        self.encounters: list[tuple[float, str, str, str]] = []
        self.totals = {"near_miss": 0, "collision": 0}

    def on_connect(self) -> None:
        for name in ("DEPLOY_ALL", "NODE_REPORT", "UCD_REPORT", "SWAP_INTERVAL"):
            self.register(name)

    def station(self, index: int) -> tuple[float, float]:
        """Where station `index` is."""
        count = len(self.vessels)
        x, y = self.config.center
        radius = self.config.spacing / (2.0 * sin(pi / count)) if count > 1 else 0.0
        angle = 2.0 * pi * index / max(1, count)
        return x + radius * sin(angle), y + radius * cos(angle)

    def on_mail(self, mail: list[Message]) -> None:
        for message in mail:
            if message.name == "NODE_REPORT":
                self._hear(message.text)
            elif message.name == "UCD_REPORT":
                self._enter(message.text)
            elif message.name == "DEPLOY_ALL" and message.text == "true" and self.deployed_at is None:
                self.deployed_at = self.now
                self.next_swap = self.now + self.interval
                self._assign()
            elif message.name == "SWAP_INTERVAL":
                self._change_interval(message)

    def iterate(self) -> None:
        if self.deployed_at is None:
            return
        for name, vessel in self.vessels.items():
            if vessel.sails:
                self._remind(name, vessel)
            elif vessel.place is not None and self.now - vessel.asked_at >= ASK_AGAIN:
                self._deploy(name, vessel)
        if self.now >= self.next_swap:
            self.next_swap += self.interval
            self._swap()

    def _change_interval(self, message: Message) -> None:
        value = message.number
        if value is None or not value >= 1.0:
            self.run_warning(f"SWAP_INTERVAL: expected seconds, 1 at least, not '{message.text}'")
            return
        self.interval = value
        if self.deployed_at is not None:
            self.next_swap = self.now + value

    # --- stations ----------------------------------------------------------------------------

    def distance(self, vessel: Vessel) -> float:
        """Metres from a vessel to its station; infinite while it has not been heard."""
        return float("inf") if vessel.place is None else self._way(vessel, vessel.station)

    def _assign(self) -> None:
        """Give out the stations so that the ways to them are short together, and so do not cross."""
        from scipy.optimize import linear_sum_assignment

        heard = [vessel for vessel in self.vessels.values() if vessel.place is not None]
        silent = [vessel for vessel in self.vessels.values() if vessel.place is None]
        stations = range(len(self.vessels))
        ways = [[self._way(vessel, station) for station in stations] for vessel in heard]
        chosen = [int(i) for i in linear_sum_assignment(ways)[1]] if heard else []
        left = [station for station in stations if station not in chosen]
        for vessel, station in zip(heard + silent, chosen + left, strict=True):
            vessel.station = station

    def _way(self, vessel: Vessel, station: int) -> float:
        assert vessel.place is not None
        x, y = self.station(station)
        return hypot(vessel.place[0] - x, vessel.place[1] - y)

    def _deploy(self, name: str, vessel: Vessel) -> None:
        """The command to all may have been lost on its way to one; once it sails it is left alone."""
        if vessel.asked_at > float("-inf"):
            self.notify(f"DEPLOY_{name.upper()}", "true")
            self.notify(f"MOOS_MANUAL_OVERRIDE_{name.upper()}", "false")
        vessel.asked_at = self.now

    def _remind(self, name: str, vessel: Vessel) -> None:
        """Tell a vessel its station, first of all and whenever it makes no way towards it."""
        if vessel.place is None or self.now - vessel.told_at < PATIENCE:
            return
        distance = self.distance(vessel)
        never_told = vessel.told_at == float("-inf")
        if never_told or (distance > ARRIVED and distance > vessel.distance_then - PROGRESS):
            self._tell(name, vessel)
        vessel.told_at, vessel.distance_then = self.now, distance

    def _tell(self, name: str, vessel: Vessel) -> None:
        x, y = self.station(vessel.station)
        vessel.told_at, vessel.distance_then = self.now, self.distance(vessel)
        self.notify(f"UP_LOITER_{name.upper()}", f"center_assign={num(x)},{num(y)}")

    def _swap(self) -> None:
        there = [name for name, vessel in self.vessels.items() if self.distance(vessel) <= ARRIVED]
        if len(there) < 2:
            return
        one, other = self.random.sample(there, 2)
        a, b = self.vessels[one], self.vessels[other]
        a.station, b.station = b.station, a.station
        for name, vessel in ((one, a), (other, b)):
            vessel.swaps += 1
            self._tell(name, vessel)
        self.swaps += 1
        self.event(f"{one} and {other} swap")
        self.notify("SWAP", f"{one}:{other}")
        self.notify("MISSION_REPORT", self.summary())

    def _hear(self, text: str) -> None:
        try:
            report = NodeReport.parse(text)
        except RecordError as error:
            self.run_warning(str(error))
            return
        vessel = self.vessels.get(report.name)
        if vessel is not None and report.x is not None and report.y is not None:
            vessel.place = report.x, report.y
            vessel.sails = vessel.sails or report.mode.startswith("MODE@ACTIVE")

    # --- encounters --------------------------------------------------------------------------

    def _enter(self, text: str) -> None:
        try:
            fields = field_map("UCD_REPORT", text)
        except RecordError as error:
            self.run_warning(str(error))
            return
        cpa = parse_number(fields.get("cpa", ""))
        if cpa is None:
            return
        rank = fields.get("rank", "clear")
        self.encounters.append((cpa, fields.get("vname1", "?"), fields.get("vname2", "?"), rank))
        if rank in self.totals:
            self.totals[rank] += 1
        self.notify("MISSION_REPORT", self.summary())

    def summary(self) -> str:
        """The statistics of all encounters so far, as lines for a person."""
        met = sorted(self.encounters)
        lines = [
            f"swaps {self.swaps}, encounters {len(met)}, near misses {self.totals['near_miss']}, "
            f"collisions {self.totals['collision']}"
        ]
        if met:
            ranges = [cpa for cpa, _, _, _ in met]
            middle = ranges[len(ranges) // 2]
            lines.append(f"closest points of approach: least {ranges[0]:.1f} m, median {middle:.1f} m")
            lines += [f"  {cpa:5.1f} m  {one} and {other}  {rank}" for cpa, one, other, rank in met[:5]]
        return "\n".join(lines)

    def report(self) -> Iterable[str]:
        yield "vessel        station  distance  swaps"
        for name, vessel in self.vessels.items():
            yield f"{name:<12}  {vessel.station:>7}  {self.distance(vessel):>8.1f}  {vessel.swaps:>5}"
        yield from self.summary().split("\n")

    def on_quit(self) -> None:
        self.notify("MISSION_REPORT", self.summary())
