"""uFldCollisionDetect: the referee of encounters between vessels (marine_apps.md 7.2).

Who came how close is decided in `encounters`; this is the app around it: mail, flags, what viewers draw.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from math import inf

from pymoos_lite.app import App
from pymoos_lite.config.conditions import Condition, parse_condition
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message, Value
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.shapes import Circle
from pymoos_lite.marine.datum import mission_geodesy
from pymoos_lite.marine.encounters import Encounter, EncounterReferee, Fix, Ranks
from pymoos_lite.records.contact_ledger import Contact, ContactLedger
from pymoos_lite.records.csp import Flag, RecordError, clip, num, parse_flag
from pymoos_lite.records.node_report import NodeReport
from pymoos_lite.records.view import RangePulse, circle_text

FORGET_AFTER = 120.0
"""Mission seconds after which a silent vessel takes part no longer."""

_KEPT = 10
_NEAR = re.compile(r"\$\[([^\]@]+)@(\d+\.?\d*)\]")
_PULSE_COLORS = {"collision": "red", "near_miss": "yellow"}


def _range(name: str, default: float, doc: str) -> Parameter:
    return Parameter(name, "number", default, "m", doc, low=0.0)


def _switch(name: str, default: bool, doc: str) -> Parameter:
    return Parameter(name, "boolean", default, doc=doc)


def _flags(name: str, doc: str) -> Parameter:
    doc += " $V1 $V2 $UP_V1 $UP_V2 $CPA $IDX and $[NAME@RANGE] are replaced."
    return Parameter(name, "custom", doc=doc, parse=parse_flag, repeated=True, example="CLOSE=$V1 and $V2")


class CollisionDetect(App):
    """Ranks every encounter as clear, near miss or collision, and counts them."""

    DEFAULT_TICK = 4.0
    PARAMETERS = Declaration(
        (
            _range("encounter_range", 20.0, "Vessels within this range meet."),
            _range("near_miss_range", 6.0, "Least range of a near miss."),
            _range("collision_range", 3.0, "Least range of a collision."),
            _flags("encounter_flag", "VAR=value to post at every encounter."),
            _flags("near_miss_flag", "VAR=value to post at a near miss."),
            _flags("collision_flag", "VAR=value to post at a collision."),
            Parameter(
                "ignore_group",
                "text",
                doc="Encounters between two vessels of these groups do not count.",
                repeated=True,
                example="red",
            ),
            Parameter(
                "reject_group",
                "text",
                doc="Vessels of this group take no part.",
                repeated=True,
                example="buoys",
            ),
            Parameter(
                "condition",
                "custom",
                doc="Encounters count only while all conditions hold.",
                parse=parse_condition,
                repeated=True,
                example="DEPLOY_ALL = true",
            ),
            _switch("report_all_encounters", False, "Post UCD_REPORT for clear encounters too."),
            _switch("post_closest_range", False, "Post UCD_CLOSEST_RANGE, the present least range."),
            _switch("post_closest_range_ever", False, "Post UCD_CLOSEST_RANGE_EVER."),
            _switch("encounter_rings", True, "Draw a ring of encounter_range around every vessel."),
            _switch("pulse_render", True, "Draw a pulse at near misses and collisions."),
            _range("pulse_range", 20.0, "Radius of pulses."),
            Parameter("pulse_duration", "number", 10.0, "s", "How long a pulse is shown.", low=0.0),
            Parameter(
                "cpa_rule",
                "choice",
                "true",
                doc="true: the true closest point of approach; reference: as the reference finds it, late and too far.",
                choices=("true", "reference"),
            ),
        ),
        ignored=("verbose",),
    )

    def on_start_up(self) -> None:
        config = self.config
        self.ranks = Ranks(config.encounter_range, config.near_miss_range, config.collision_range)
        if self.ranks.ordered() != self.ranks:
            self.ranks = self.ranks.ordered()
            self.config_warning(
                "ranges must be collision <= near miss <= encounter: raised to "
                f"{num(self.ranks.near_miss)} and {num(self.ranks.encounter)}"
            )
        self.referee = EncounterReferee(self.ranks, config.cpa_rule == "reference")
        self.ledger = ContactLedger(mission_geodesy(self))
        self.totals: Counter[str] = Counter()
        self.dropped: Counter[str] = Counter()
        self._recent: list[str] = []
        self._ignored = {group.strip().lower() for text in config.ignore_group for group in text.split(",")}
        self._rejected = {group.strip().lower() for text in config.reject_group for group in text.split(",")}
        self._conditions: list[Condition] = config.condition
        self._known: dict[str, Value] = {}
        self._fresh: dict[str, Contact] = {}
        self._closest_posted = self._ever_posted = inf

    def on_connect(self) -> None:
        for name in ("NODE_REPORT", "NODE_REPORT_LOCAL", "UCD_RESET"):
            self.register(name)
        for condition in self._conditions:
            for name in condition.registrations():
                self.register(name)
        for name in ("ENCOUNTER_TOTAL", "NEAR_MISS_TOTAL", "COLLISION_TOTAL"):
            self.notify(name, float(self.totals[name]))
        self.notify("COLLISION_DETECT_PARAMS", self._parameters())

    def _parameters(self) -> str:
        ranks = self.ranks
        return (
            f"collision_range={num(ranks.collision)}, near_miss_range={num(ranks.near_miss)}, "
            f"encounter_range={num(ranks.encounter)}"
        )

    def on_mail(self, mail: list[Message]) -> None:
        for message in mail:
            if message.name in ("NODE_REPORT", "NODE_REPORT_LOCAL"):
                self._take_report(message)
            elif message.name == "UCD_RESET":
                self.referee.closest_ever = inf
                self._closest_posted = self._ever_posted = inf
            else:
                self._known[message.name] = message.value

    def iterate(self) -> None:
        for contact in self._fresh.values():
            self._judge(contact)
        self._fresh.clear()
        for name in self.ledger.drop_older_than(FORGET_AFTER, self.now):
            self.referee.forget(name)
        self._post_closest()

    # --- reports -----------------------------------------------------------------------------

    def _take_report(self, message: Message) -> None:
        try:
            report = NodeReport.parse(message.text)
            if report.group and report.group.lower() in self._rejected:
                self.dropped["of a rejected group"] += 1
                return
            is_new = report.name not in self.ledger
            contact = self.ledger.receive(report, self.now)
        except (RecordError, ValueError) as error:
            self.dropped["unusable"] += 1
            self.run_warning(f"{message.name} from {clip(message.community, 20)}: {error}")
            return
        if is_new:
            self.notify(f"COLLISION_DETECT_PARAMS_{contact.name.upper()}", self._parameters())
        if contact.name in self._fresh:
            self._judge(self._fresh[contact.name])  # two reports at once: neither is left out
        self._fresh[contact.name] = contact

    def _judge(self, contact: Contact) -> None:
        name = contact.name
        for encounter in self.referee.hear(name, Fix(contact.time, contact.x, contact.y, contact.heading)):
            if self._counts(encounter):
                self._announce(encounter)
        if self.config.encounter_rings:
            attributes = Attributes(label=f"{name}rng", edge_color="white")
            ring = Circle(contact.x, contact.y, self.ranks.encounter, attributes)
            self.notify("VIEW_CIRCLE", circle_text(ring))

    def _counts(self, encounter: Encounter) -> bool:
        if not all(condition.holds(self._lookup) for condition in self._conditions):
            self.dropped["while a condition did not hold"] += 1
            return False
        if self._ignored and all(
            self._group(n) in self._ignored for n in (encounter.vname1, encounter.vname2)
        ):
            self.dropped["between ignored groups"] += 1
            return False
        return True

    def _lookup(self, name: str) -> float | str | None:
        value = self._known.get(name)
        return None if isinstance(value, bytes) else value

    def _group(self, name: str) -> str:
        contact = self.ledger.get(name)
        return contact.report.group.lower() if contact is not None else ""

    # --- encounters --------------------------------------------------------------------------

    def _announce(self, encounter: Encounter) -> None:
        config, rank = self.config, encounter.rank
        self._count("ENCOUNTER_TOTAL", config.encounter_flag, encounter)
        if rank == "collision":
            self._count("COLLISION_TOTAL", config.collision_flag, encounter)
        elif rank == "near_miss":
            self._count("NEAR_MISS_TOTAL", config.near_miss_flag, encounter)
        text = encounter.report()
        if rank != "clear" or config.report_all_encounters:
            self.notify("UCD_REPORT", text)
        if rank != "clear":
            self.event(
                f"{rank.replace('_', ' ')} of {encounter.vname1} and {encounter.vname2}: {encounter.cpa:.1f} m"
            )
            if config.pulse_render:
                self._pulse(encounter)
        self._recent.append(text)
        del self._recent[:-_KEPT]

    def _count(self, total: str, flags: list[Flag], encounter: Encounter) -> None:
        self.totals[total] += 1
        self.notify(total, float(self.totals[total]))
        for flag in flags:
            variable = self._expand(flag.var, encounter)
            value = flag.value
            if value == "$CPA":
                value = encounter.cpa
            elif value == "$IDX":
                value = float(self.totals["ENCOUNTER_TOTAL"])
            elif isinstance(value, str):
                value = self._expand(value, encounter)
            self.notify(variable, value)

    def _expand(self, text: str, encounter: Encounter) -> str:
        macros = {
            "$V1": encounter.vname1,
            "$V2": encounter.vname2,
            "$UP_V1": encounter.vname1.upper(),
            "$UP_V2": encounter.vname2.upper(),
            "$CPA": num(encounter.cpa),
            "$IDX": str(self.totals["ENCOUNTER_TOTAL"]),
        }

        def count(found: re.Match[str]) -> str:
            name = {"V1": encounter.vname1, "V2": encounter.vname2}.get(found[1], found[1])
            return str(self.referee.within(name, float(found[2])))

        text = _NEAR.sub(count, text)
        for macro, value in macros.items():
            text = text.replace(macro, value)
        return text

    def _pulse(self, encounter: Encounter) -> None:
        pulse = RangePulse(
            x=encounter.x,
            y=encounter.y,
            radius=self.config.pulse_range,
            attributes=Attributes(
                label=f"{encounter.vname1}_{encounter.vname2}",
                edge_color=_PULSE_COLORS[encounter.rank],
                fill_color=_PULSE_COLORS[encounter.rank],
                time=self.now,
                duration=self.config.pulse_duration,
            ),
        )
        self.notify("VIEW_RANGE_PULSE", pulse.to_text())

    def _post_closest(self) -> None:
        if self.config.post_closest_range:
            closest = self.referee.closest_range()
            if closest != self._closest_posted and closest != inf:
                self._closest_posted = closest
                self.notify("UCD_CLOSEST_RANGE", closest)
        if self.config.post_closest_range_ever and self.referee.closest_ever < self._ever_posted:
            self._ever_posted = self.referee.closest_ever
            self.notify("UCD_CLOSEST_RANGE_EVER", self._ever_posted)

    # --- report ------------------------------------------------------------------------------

    def report(self) -> Iterable[str]:
        totals = self.totals
        yield (
            f"Encounters: {totals['ENCOUNTER_TOTAL']}, near misses: {totals['NEAR_MISS_TOTAL']}, "
            f"collisions: {totals['COLLISION_TOTAL']}"
        )
        yield f"Ranges: {self._parameters()}"
        yield f"Vessels: {', '.join(self.ledger.names()) or 'none'}"
        for (one, other), distance in sorted(self.referee.ranges().items(), key=lambda item: item[1])[:_KEPT]:
            yield f"  {one} and {other}: {distance:.1f} m"
        yield "Last encounters"
        yield from (f"  {text}" for text in reversed(self._recent))
        if self.dropped:
            yield "Left out: " + ", ".join(f"{n} {reason}" for reason, n in sorted(self.dropped.items()))
