"""uFldCollObDetect: the shoreside's referee of vessels and obstacles, as an app (marine_apps.md 7.3)."""

from __future__ import annotations

from collections.abc import Iterable

from pymoos_lite.app.datum import mission_geodesy
from pymoos_lite.app.mail_values import Handler, HandlerApp, on_text
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.geometry.specs import parse_polygon
from pymoos_lite.marine.encounters import Fix, Ranks
from pymoos_lite.marine.obstacle_encounters import ObstacleEncounter, ObstacleReferee
from pymoos_lite.records.contact_ledger import ContactLedger
from pymoos_lite.records.csp import Flag, clip, num, parse_flag
from pymoos_lite.records.node_report import NodeReport

_REMEMBERED = 20
_MAX_VESSELS = 2000


def _distance(name: str, default: float, doc: str) -> Parameter:
    return Parameter(name, "number", default, "m", doc, low=0.0)


def _flags(name: str, doc: str) -> Parameter:
    return Parameter(
        name, "custom", None, "", doc, parse=parse_flag, repeated=True, example="HIT=$VNAME hit $ID"
    )


class ObstacleCollisions(HandlerApp):
    """Finds how close vessels come to known obstacles, ranks it and counts."""

    DEFAULT_TICK = 4.0
    PARAMETERS = Declaration(
        (
            _distance("encounter_dist", 15.0, "A visit begins and ends at this distance."),
            _distance("near_miss_dist", 5.0, "A visit nearer than this is a near miss."),
            _distance("collision_dist", 1.0, "A visit nearer than this is a collision."),
            _flags("encounter_flag", "Posted at the end of each visit."),
            _flags("near_miss_flag", "Posted after each near miss."),
            _flags("collision_flag", "Posted after each collision."),
        ),
        ignored=("bin_min_val", "bin_delta"),
    )

    def on_start_up(self) -> None:
        values = self.config
        ranks = Ranks(values.encounter_dist, values.near_miss_dist, values.collision_dist)
        self.referee = ObstacleReferee(ranks)
        if self.referee.ranks != ranks:
            self.config_warning("distances are raised to keep their order: collision, near miss, encounter")
        self._ledger = ContactLedger(mission_geodesy(self), capacity=_MAX_VESSELS)
        self._waiting: list[ObstacleEncounter] = []
        self._last: list[ObstacleEncounter] = []
        self._least = float("inf")
        self._handlers: dict[str, Handler] = {
            "NODE_REPORT": self._hear_report,
            "KNOWN_OBSTACLE": on_text(self, self._hear_obstacle),
            "KNOWN_OBSTACLE_CLEAR": on_text(self, lambda label: self.referee.clear(label.strip(), self.now)),
        }

    def iterate(self) -> None:
        config = self.config
        for encounter in self._waiting:
            self._last = [*self._last, encounter][-_REMEMBERED:]
            if encounter.rank == "collision":
                self._post_flags(config.collision_flag, encounter)
            elif encounter.rank == "near_miss":
                self._post_flags(config.near_miss_flag, encounter)
            self._post_flags(config.encounter_flag, encounter)
            self.event(
                f"{encounter.vname} and {encounter.label}: {encounter.rank}, {num(encounter.distance)} m"
            )
        self._waiting.clear()
        if self.referee.global_min < self._least:
            self._least = self.referee.global_min
            self.notify("OB_GLOBAL_MIN", self._least)

    def report(self) -> Iterable[str]:
        totals = self.referee.totals
        yield (
            f"Obstacles {len(self.referee.labels())}; encounters {totals.encounters}, near misses"
            f" {totals.near_misses}, collisions {totals.collisions}"
        )
        for encounter in reversed(self._last):
            who, what = clip(encounter.vname, 15), clip(encounter.label, 15)
            yield f"{who:<16}{what:<16}{encounter.distance:>8.2f}  {encounter.rank}"

    def _hear_report(self, message: Message) -> None:
        try:
            contact = self._ledger.receive(NodeReport.parse(message.text), self.now)
        except ValueError as error:
            self.run_warning(f"NODE_REPORT refused: {clip(str(error), 80)}")
            return
        self._waiting += self.referee.hear(
            contact.name, Fix(contact.time, contact.x, contact.y, contact.heading)
        )

    def _hear_obstacle(self, told: str) -> None:
        polygon = parse_polygon(told)
        self.referee.add(polygon.label, polygon, self.now)

    def _post_flags(self, flags: list[Flag], encounter: ObstacleEncounter) -> None:
        totals = self.referee.totals
        numbers = {
            "$DIST": encounter.distance,
            "$ENC_CNT": float(totals.encounters),
            "$MISS_CNT": float(totals.near_misses),
            "$COLL_CNT": float(totals.collisions),
        }
        words = {
            "$UP_VNAME": encounter.vname.upper(),
            "$VNAME": encounter.vname,
            "$ID": encounter.label,
            **{macro: num(value) for macro, value in numbers.items()},
        }
        for flag in flags:
            value = flag.value
            if isinstance(value, str):
                value = numbers.get(value, _expanded(value, words))
            self.notify(_expanded(flag.var, words), value)


def _expanded(text: str, words: dict[str, str]) -> str:
    for macro, value in words.items():
        text = text.replace(macro, value)
    return text
