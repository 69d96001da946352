"""pMissionEval: grades a mission by conditions, posts the result and appends a line to a report (community.md 17).

`Evaluation` is the pure part: a sequence of aspects, each with lead, pass and fail conditions.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from pymoos_lite.app import App, AppContext
from pymoos_lite.config.conditions import Condition, Lookup, parse_condition
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message, Value
from pymoos_lite.records.csp import RecordError, clip, num, parse_flag
from pymoos_lite.records.mission_hash import MissionHash

PENDING = "pending"
_MACRO = re.compile(r"\$[\[(](\w+)[\])]")
_KEYS = ("lead_condition", "pass_condition", "fail_condition")
_SEPARATORS = {"white": "  ", "csp": ", "}
_CLOCK = {
    "YEAR": "%Y",
    "MONTH": "%m",
    "DAY": "%d",
    "HOUR": "%H",
    "MIN": "%M",
    "SEC": "%S",
    "DATE": "%Y:%m:%d",
    "TIME": "%H:%M:%S",
}


@dataclass(slots=True)
class Aspect:
    """What must hold, and must not, at the moment when all lead conditions hold."""

    leads: list[Condition] = field(default_factory=list)
    passes: list[Condition] = field(default_factory=list)
    fails: list[Condition] = field(default_factory=list)


@dataclass(slots=True)
class Evaluation:
    """The aspects in their order; `result` is `pending` until the last one is done or one is not met."""

    aspects: list[Aspect]
    result: str = PENDING
    status: str = PENDING
    done: int = 0

    def update(self, lookup: Lookup) -> bool:
        """Look again; True if the result became final just now."""
        while self.result == PENDING and self.done < len(self.aspects):
            aspect = self.aspects[self.done]
            unmet = next((c for c in aspect.leads if not c.holds(lookup)), None)
            if unmet is not None or not aspect.leads:
                self.status = PENDING if unmet is None else f"unmet_lead_cond: [{unmet.text}]"
                return False
            failed = _failure(aspect, lookup)
            if failed:
                self.result, self.status = "fail", failed
                return True
            self.done += 1
            if self.done == len(self.aspects):
                self.result = self.status = "pass"
                return True
        return False


def _failure(aspect: Aspect, lookup: Lookup) -> str:
    """Why an aspect whose moment has come is not satisfied; empty if it is."""
    for condition in aspect.passes:
        if not condition.holds(lookup):
            return f"unmet_pass_cond: [{condition.text}]"
    for condition in aspect.fails:
        if condition.holds(lookup):
            return f"met_fail_cond: [{condition.text}]"
    return ""


def build_aspects(lines: Iterable[tuple[str, Condition]]) -> list[Aspect]:
    """Aspects from (key, condition) lines: a lead condition behind pass or fail conditions begins the next one."""
    aspects: list[Aspect] = []
    for key, condition in lines:
        begins = key == "lead_condition" and (not aspects or aspects[-1].passes or aspects[-1].fails)
        if begins or not aspects:
            aspects.append(Aspect())
        aspect = aspects[-1]
        {"lead_condition": aspect.leads, "pass_condition": aspect.passes, "fail_condition": aspect.fails}[
            key
        ].append(condition)
    return aspects


def parse_flag_text(text: str) -> str:
    """A flag `VAR=value` that may hold macros, kept as text. Raises ValueError."""
    parse_flag(text)
    return text.strip()


def parse_mail_flag(text: str) -> tuple[str, str]:
    """`@MAIL_VAR VAR=value` (a `#` between them is accepted). Raises ValueError."""
    variable, _, flag = text.strip().partition(" ")
    name = variable.removeprefix("@").rstrip("#")
    flag = flag.strip().removeprefix("#").strip()
    if not variable.startswith("@") or not name or not flag:
        raise ValueError(f"'{clip(text)}': expected @MAIL_VAR VAR=value")
    return name, parse_flag_text(flag)


def macro_names(text: str) -> list[str]:
    return _MACRO.findall(text)


def expand_macros(text: str, macros: Mapping[str, str]) -> str:
    """`$[X]` and `$(X)` replaced; unknown ones stay."""
    return _MACRO.sub(lambda match: macros.get(match[1], match[0]), text)


def append_text(path: Path, text: str) -> None:
    """The one place where this app writes to the disk."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8", newline="\n") as file:
        file.write(text)


def _condition_parameter(name: str, doc: str) -> Parameter:
    return Parameter(
        name, "custom", None, "", doc, repeated=True, parse=parse_condition, example="ARRIVED = true"
    )


def _flag_parameter(name: str, doc: str) -> Parameter:
    return Parameter(
        name, "custom", None, "", doc, repeated=True, parse=parse_flag_text, example="DONE=$[GRADE]"
    )


class MissionEval(App):
    """The evaluation app; see the module."""

    APPEND: ClassVar[Callable[[Path, str], None]] = staticmethod(append_text)
    PARAMETERS = Declaration(
        (
            _condition_parameter("lead_condition", "When all hold, the aspect is graded."),
            _condition_parameter("pass_condition", "Must hold at that moment."),
            _condition_parameter("fail_condition", "Must not hold at that moment."),
            _flag_parameter("result_flag", "Posted when there is a result."),
            _flag_parameter("pass_flag", "Posted on pass."),
            _flag_parameter("fail_flag", "Posted on fail."),
            Parameter(
                "mailflag",
                "custom",
                None,
                "",
                "Posted whenever mail of a variable comes.",
                repeated=True,
                parse=parse_mail_flag,
                example="@ENCOUNTER COUNT=$[TOTAL]",
            ),
            Parameter(
                "report_file", "text", "", "", "Results are appended to this file.", example="results.txt"
            ),
            Parameter(
                "report_column",
                "text",
                None,
                "",
                "One column, with macros.",
                repeated=True,
                example="$[GRADE]",
            ),
            Parameter(
                "prereport_column", "text", None, "", "Written before the result is known.", repeated=True
            ),
            Parameter(
                "report_line_format",
                "choice",
                "white",
                "",
                "Columns apart by blanks or commas.",
                choices=("white", "csp"),
            ),
            Parameter("mission_form", "text", "", "", "For the macro MISSION_FORM."),
            Parameter("mission_mod", "text", "", "", "For the macro MMOD."),
        )
    )

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        self.evaluation = Evaluation(build_aspects(self._conditions()))
        self.known: dict[str, Value] = {}
        self.hash: MissionHash | None = None
        self.prereported = False
        self._status = ""
        self._db_start: float | None = None

    def _conditions(self) -> Iterable[tuple[str, Condition]]:
        """All conditions in the order of the file, which a parameter of its own for each kind does not keep."""
        for line in self.context.lines:
            key = line.key.strip().lower()
            if key in _KEYS:
                try:
                    yield key, parse_condition(line.value)
                except ValueError:
                    continue  # already among the configuration's problems

    def on_start_up(self) -> None:
        if not self.evaluation.aspects:
            self.config_warning("no lead_condition is given: the mission is never graded")
        for number, aspect in enumerate(self.evaluation.aspects, start=1):
            if not aspect.leads:
                self.config_warning(f"aspect {number} has no lead_condition: it is never graded")

    def on_connect(self) -> None:
        config = self.config
        names = ["DB_UPTIME", "MISSION_HASH", *(name for name, _ in config.mailflag)]
        for aspect in self.evaluation.aspects:
            for condition in (*aspect.leads, *aspect.passes, *aspect.fails):
                names += condition.registrations()
        texts = [
            *config.result_flag,
            *config.pass_flag,
            *config.fail_flag,
            *(flag for _, flag in config.mailflag),
        ]
        own = self._macros()
        for text in (*texts, *config.report_column, *config.prereport_column):
            names += [name for name in macro_names(text) if name not in own]
        for name in dict.fromkeys(names):
            self.register(name)
        self.notify("MISSION_RESULT", self.evaluation.result)

    def on_mail(self, mail: list[Message]) -> None:
        for message in mail:
            self.known[message.name] = message.value
            if message.name == "MISSION_HASH":
                try:
                    self.hash = MissionHash.parse(message.text)
                except RecordError as refusal:
                    self.run_warning(str(refusal))
            elif message.name == "DB_UPTIME" and message.number is not None:
                self._db_start = message.time - message.number
            for name, flag in self.config.mailflag:
                if name == message.name:
                    self._post(flag)

    def iterate(self) -> None:
        if self.hash is not None:
            self._prereport()
        finished = self.evaluation.update(self.known.get)
        if self.evaluation.status != self._status:
            self._status = self.evaluation.status
            self.notify("MISSION_LCHECK_STAT", self._status)
        if finished:
            self._conclude()

    def _conclude(self) -> None:
        config, result = self.config, self.evaluation.result
        for flag in config.result_flag:
            self._post(flag)
        self.notify("MISSION_EVALUATED", True)
        self.notify("MISSION_RESULT", result)
        for flag in config.pass_flag if result == "pass" else config.fail_flag:
            self._post(flag)
        self._prereport()
        if config.report_column:
            gap = "  " if config.prereport_column else ""
            self._append(gap + self._columns(config.report_column) + "\n")
        elif config.prereport_column:
            self._append("\n")
        self.event(f"result: {result}")

    def _post(self, flag: str) -> None:
        try:
            posting = parse_flag(expand_macros(flag, self._macros()))
        except RecordError as refusal:
            self.run_warning(str(refusal))
            return
        self.notify(posting.var, posting.value)

    # --- report --------------------------------------------------------------------------------

    def _prereport(self) -> None:
        if not self.prereported and self.config.prereport_column:
            self._append(self._columns(self.config.prereport_column))
        self.prereported = True

    def _columns(self, columns: Iterable[str]) -> str:
        macros = self._macros()
        return _SEPARATORS[self.config.report_line_format].join(
            expand_macros(text, macros) for text in columns
        )

    def _append(self, text: str) -> None:
        if not self.config.report_file:
            return
        try:
            type(self).APPEND(Path(self.config.report_file).expanduser(), text)
        except OSError as refusal:
            self.run_warning(f"cannot write {self.config.report_file}: {refusal.strerror or refusal}")

    def _macros(self) -> dict[str, str]:
        """All macros: latest values of variables, and those of our own, which go first."""
        texts = {name: num(v, 4) if isinstance(v, float) else str(v) for name, v in self.known.items()}
        made, unix_time = self.hash, self.now / self.clock.warp
        at = time.gmtime(unix_time) if self.context.deterministic else time.localtime(unix_time)
        uptime = 0.0 if self._db_start is None else self.now - self._db_start
        texts |= {
            "MHASH_SHORT": f"[{made.short}]" if made is not None else "",
            "MHASH_LSHORT": made.full.partition("-")[2] if made is not None else "",
            "MHASH": made.full if made is not None else "",
            "MISSION_HASH": made.full if made is not None else "",
            "MHASH_UTC": f"{made.utc:.2f}" if made is not None else "",
            "MISSION_FORM": self.config.mission_form,
            "MMOD": self.config.mission_mod,
            "GRADE": self.evaluation.result,
            "WALL_TIME": num(uptime / self.clock.warp, 2),
            **{name: time.strftime(form, at) for name, form in _CLOCK.items()},
        }
        return texts

    def report(self) -> Iterable[str]:
        evaluation = self.evaluation
        yield f"result: {evaluation.result}   aspect {evaluation.done} of {len(evaluation.aspects)} done"
        yield f"status: {evaluation.status}"
        for number, aspect in enumerate(evaluation.aspects, start=1):
            for word, conditions in (("lead", aspect.leads), ("pass", aspect.passes), ("fail", aspect.fails)):
                for condition in conditions:
                    yield f"  {number} {word}: [{'T' if condition.holds(self.known.get) else 'F'}] {condition.text}"
