"""uFldCollisionDetect: the shoreside's referee of encounters between vessels (marine_apps.md 7.2)."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from mypy_extensions import mypyc_attr

from pymoos_lite.app import App
from pymoos_lite.app.datum import mission_geodesy
from pymoos_lite.config.conditions import Condition, parse_condition
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message, Value
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.shapes import Circle
from pymoos_lite.marine.encounters import Encounter, EncounterReferee, Fix, Ranks
from pymoos_lite.records.contact_ledger import ContactLedger
from pymoos_lite.records.csp import Flag, clip, num, parse_flag, parse_number
from pymoos_lite.records.node_report import NodeReport
from pymoos_lite.records.view import RangePulse, circle_text, view_text

_CLOSENESS = re.compile(r"\$\[([^\[\]@]+)@([^\[\]@]+)\]")
_PULSE_COLORS = {"collision": "red", "near_miss": "yellow"}
_REMEMBERED = 20  # encounters shown in the report
_MAX_VESSELS = 2000


def _range(name: str, default: float, doc: str) -> Parameter:
    return Parameter(name, "number", default, "m", doc, low=0.0)


def _flags(name: str, doc: str) -> Parameter:
    return Parameter(
        name, "custom", None, "", doc, parse=parse_flag, repeated=True, example="MET=$V1 and $V2 at $CPA m"
    )


def _groups(name: str, doc: str) -> Parameter:
    return Parameter(name, "text", None, "", doc, repeated=True, example="red, green")


def _words(texts: Iterable[str]) -> frozenset[str]:
    return frozenset(word.strip().lower() for text in texts for word in text.split(",") if word.strip())


@mypyc_attr(allow_interpreted_subclasses=True)
class CollisionDetect(App):
    """Finds the closest point of approach of every encounter, ranks it and counts."""

    DEFAULT_TICK = 4.0
    PARAMETERS = Declaration(
        (
            _range("encounter_range", 20.0, "An approach to within this is an encounter."),
            _range("near_miss_range", 6.0, "An encounter to within this is a near miss."),
            _range("collision_range", 3.0, "An encounter to within this is a collision."),
            Parameter(
                "report_all_encounters", "boolean", False, "", "Post UCD_REPORT of clear passes as well."
            ),
            Parameter(
                "encounter_rings", "boolean", True, "", "Draw the encounter range around every vessel."
            ),
            Parameter("pulse_render", "boolean", True, "", "Draw a pulse where vessels came too close."),
            _range("pulse_range", 20.0, "Radius of such a pulse."),
            Parameter("pulse_duration", "number", 10.0, "s", "Duration of such a pulse.", low=0.0),
            _flags("encounter_flag", "Posted at each encounter."),
            _flags("near_miss_flag", "Posted at each near miss."),
            _flags("collision_flag", "Posted at each collision."),
            _groups("ignore_group", "Two vessels of these groups are not judged."),
            _groups("reject_group", "Vessels of these groups are not followed."),
            Parameter(
                "condition",
                "custom",
                None,
                "",
                "Encounters are judged only while all conditions hold.",
                parse=parse_condition,
                repeated=True,
                example="MISSION = running",
            ),
            Parameter("post_closest_range", "boolean", False, "", "Post UCD_CLOSEST_RANGE."),
            Parameter("post_closest_range_ever", "boolean", False, "", "Post UCD_CLOSEST_RANGE_EVER."),
            Parameter(
                "sampled_cpa",
                "boolean",
                False,
                "",
                "Judge by latest reports alone as MOOS-IvP does, late and too leniently; for comparison.",
            ),
        ),
        ignored=("verbose",),
    )

    def on_start_up(self) -> None:
        values = self.config
        ranks = Ranks(values.encounter_range, values.near_miss_range, values.collision_range)
        self.referee = EncounterReferee(ranks, values.sampled_cpa)
        if self.referee.ranks != ranks:
            self.config_warning(f"ranges are raised to keep their order: {self._ranges_text()}")
        self._ledger = ContactLedger(mission_geodesy(self), capacity=_MAX_VESSELS)
        self._ignored = _words(values.ignore_group)
        self._rejected = _words(values.reject_group)
        self._groups: dict[str, str] = {}
        if self._ignored:
            self.referee.excuses = lambda one, other: (
                {
                    self._groups[one],
                    self._groups[other],
                }
                <= self._ignored
            )
        self._conditions: list[Condition] = values.condition
        self._known: dict[str, Value] = {}
        self._waiting: list[Encounter] = []
        self._last: list[Encounter] = []
        self._moved: dict[str, None] = {}
        self._said: dict[str, float] = {}

    def on_connect(self) -> None:
        self.register("NODE_REPORT")
        self.register("UCD_RESET")
        for condition in self._conditions:
            for name in condition.registrations():
                self.register(name)
        for name in ("ENCOUNTER_TOTAL", "NEAR_MISS_TOTAL", "COLLISION_TOTAL"):
            self.notify(name, 0.0)
        self.notify("COLLISION_DETECT_PARAMS", self._ranges_text())

    def on_mail(self, mail: list[Message]) -> None:
        for message in mail:
            if message.name == "NODE_REPORT":
                self._hear(message)
            elif message.name == "UCD_RESET":
                self.referee.closest_ever = math.inf
            else:
                self._known[message.name] = message.value

    def iterate(self) -> None:
        for encounter in self._waiting:
            self._tell(encounter)
        self._waiting.clear()
        if self.config.encounter_rings:
            self._draw_rings()
        self._moved.clear()
        if self.config.post_closest_range:
            self._say("UCD_CLOSEST_RANGE", self.referee.closest_range())
        if self.config.post_closest_range_ever:
            self._say("UCD_CLOSEST_RANGE_EVER", self.referee.closest_ever)

    def report(self) -> Iterable[str]:
        totals, ever = self.referee.totals, self.referee.closest_ever
        yield (
            f"Encounters {totals.encounters}, near misses {totals.near_misses}, collisions {totals.collisions}"
            f"; closest ever {num(ever) if math.isfinite(ever) else '-'} m   ({self._ranges_text()})"
        )
        if self._last:
            yield f"{'Vessels':<24}{'CPA':>8}  {'Rank':<10}{'Ago':>7}"
        for encounter in reversed(self._last):
            both = f"{clip(encounter.vname1, 11)}, {clip(encounter.vname2, 11)}"
            ago = self.now - encounter.time
            yield f"{both:<24}{encounter.cpa:>8.2f}  {encounter.rank:<10}{ago:>7.0f}"

    # --- reports --------------------------------------------------------------------------------

    def _hear(self, message: Message) -> None:
        try:
            contact = self._ledger.receive(NodeReport.parse(message.text), self.now)
        except ValueError as error:
            self.run_warning(f"NODE_REPORT refused: {clip(str(error), 80)}")
            return
        name, group = contact.name, contact.report.group.lower()
        if group in self._rejected:
            self.referee.forget(name)
            return
        if name not in self._groups:
            if len(self._groups) >= _MAX_VESSELS:
                self.run_warning(f"more than {_MAX_VESSELS} vessels: the others are not judged")
                return
            self.notify(f"COLLISION_DETECT_PARAMS_{name.upper()}", self._ranges_text())
        self._groups[name] = group
        self._moved[name] = None
        referee = self.referee
        if self._conditions:
            referee.judging = all(condition.holds(self._known.get) for condition in self._conditions)
        self._waiting += referee.hear(name, Fix(contact.time, contact.x, contact.y, contact.heading))

    # --- telling --------------------------------------------------------------------------------

    def _tell(self, encounter: Encounter) -> None:
        totals, rank, config = self.referee.totals, encounter.rank, self.config
        self._last = [*self._last, encounter][-_REMEMBERED:]
        self.notify("ENCOUNTER_TOTAL", float(totals.encounters))
        self._post_flags(config.encounter_flag, encounter, totals.encounters)
        if rank == "collision":
            self.notify("COLLISION_TOTAL", float(totals.collisions))
            self._post_flags(config.collision_flag, encounter, totals.collisions)
        elif rank == "near_miss":
            self.notify("NEAR_MISS_TOTAL", float(totals.near_misses))
            self._post_flags(config.near_miss_flag, encounter, totals.near_misses)
        if rank != "clear" or config.report_all_encounters:
            self.notify("UCD_REPORT", encounter.report())
            self.event(f"{encounter.vname1} and {encounter.vname2}: {rank}, {num(encounter.cpa)} m")
        if rank != "clear" and config.pulse_render:
            looks = Attributes(
                label=f"{encounter.vname1}_{encounter.vname2}_{rank}",
                edge_color=_PULSE_COLORS[rank],
                time=self.now,
                duration=config.pulse_duration,
            )
            pulse = RangePulse(encounter.x, encounter.y, config.pulse_range, attributes=looks)
            self.notify("VIEW_RANGE_PULSE", view_text(pulse))

    def _post_flags(self, flags: list[Flag], encounter: Encounter, index: int) -> None:
        numbers = {"$CPA": encounter.cpa, "$IDX": float(index)}
        for flag in flags:
            value = flag.value
            if isinstance(value, str):
                value = numbers[value] if value in numbers else self._expand(value, encounter, index)
            self.notify(self._expand(flag.var, encounter, index), value)

    def _expand(self, text: str, encounter: Encounter, index: int) -> str:
        if "$" not in text:
            return text
        one, other = encounter.vname1, encounter.vname2

        def near(match: re.Match[str]) -> str:
            name = {"V1": one, "V2": other}.get(match[1], match[1])
            reach = parse_number(match[2])
            return match[0] if reach is None else str(self.referee.within(name, reach))

        text = _CLOSENESS.sub(near, text)
        for macro, value in (
            ("$UP_V1", one.upper()),
            ("$UP_V2", other.upper()),
            ("$V1", one),
            ("$V2", other),
            ("$CPA", num(encounter.cpa)),
            ("$IDX", str(index)),
        ):
            text = text.replace(macro, value)
        return text

    def _say(self, variable: str, value: float) -> None:
        if math.isfinite(value) and self._said.get(variable) != value:
            self._said[variable] = value
            self.notify(variable, value)

    def _draw_rings(self) -> None:
        for name in self._moved:
            contact = self._ledger.get(name)
            if contact is not None:
                looks = Attributes(label=f"{name}rng", edge_color="white", duration=10.0)
                ring = Circle(contact.x, contact.y, self.referee.ranks.encounter, looks)
                self.notify("VIEW_CIRCLE", circle_text(ring))

    def _ranges_text(self) -> str:
        ranks = self.referee.ranks
        return (
            f"collision_range={num(ranks.collision)}, near_miss_range={num(ranks.near_miss)},"
            f" encounter_range={num(ranks.encounter)}"
        )
