"""uTimerScript: posts events by a timetable, with random times and values (community.md 14).

This is the app around `timer_core.Script`: mail, macros of the moment, posts and status.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

from pymoos_lite.app import App, AppContext
from pymoos_lite.apps.timer_core import Due, Script, ScriptPlan, joined_events
from pymoos_lite.apps.timer_values import (
    Span,
    expand_value,
    macros_of,
    parse_event,
    parse_rand_pair,
    parse_randvar,
    parse_span,
)
from pymoos_lite.config.conditions import parse_condition
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message, Value
from pymoos_lite.records.csp import clip, fix, num, parse_bool, parse_number

STATUS_PERIOD = 5.0
_POSITION = ("NAV_X", "NAV_Y")


def parse_reset_time(text: str) -> float:
    """`none` as 0, `end` and `all-posted` as -1, seconds as themselves. Raises ValueError."""
    word = text.strip().lower()
    if word == "none":
        return 0.0
    if word in ("end", "all-posted"):
        return -1.0
    seconds = parse_number(word)
    if seconds is None or seconds <= 0:
        raise ValueError("expected none, end, all-posted or seconds above 0")
    return seconds


def parse_reset_max(text: str) -> int:
    """`any`, `unlimited`, `nolimit` as -1, else a whole number. Raises ValueError."""
    word = text.strip().lower()
    if word in ("any", "unlimited", "nolimit"):
        return -1
    count = parse_number(word)
    if count is None or count < 0 or count != int(count):
        raise ValueError("expected any, unlimited, nolimit or a number of resets")
    return int(count)


def parse_upon_awake(text: str) -> str:
    """`n/a`, `reset` or `restart`. Raises ValueError."""
    word = text.strip().lower().replace("re-start", "restart")
    if word not in ("n/a", "reset", "restart"):
        raise ValueError("expected n/a, reset or restart")
    return word


def parse_warp(text: str) -> Span:
    """A factor above 0, or a range of them. Raises ValueError."""
    warp = parse_span(text)
    if warp.low <= 0:
        raise ValueError("expected a number above 0")
    return warp


def parse_delay(text: str) -> Span:
    """Seconds of at least 0, or a range. Raises ValueError."""
    delay = parse_span(text)
    if delay.low < 0:
        raise ValueError("expected seconds of at least 0")
    return delay


def parse_names(text: str) -> list[str]:
    """Comma-separated names."""
    return [name.strip() for name in text.split(",") if name.strip()]


def _seconds(name: str, default: Span, doc: str) -> Parameter:
    return Parameter(name, "custom", default, "s", doc, parse=parse_delay, example="0:10")


class TimerScript(App):
    """The timer script app; see the module."""

    DEFAULT_TICK: ClassVar[float] = 4.0
    PARAMETERS = Declaration(
        (
            Parameter(
                "event", "custom", None, "", "One event: var=V, val=X, time=T or T1:T2, amt=N; or quit, time=T.",
                repeated=True, parse=parse_event, example="var=DEPLOY, val=true, time=5:10",
            ),
            Parameter("paused", "boolean", False, "", "Begin paused."),
            Parameter(
                "reset_time", "custom", 0.0, "s", "When to begin again: none, end, or script seconds.",
                parse=parse_reset_time, example="end",
            ),
            Parameter(
                "reset_max", "custom", -1, "", "How often to begin again: a number or any.",
                parse=parse_reset_max, example="any",
            ),
            _seconds("delay_start", Span(0, 0), "Added to all times of the first pass."),
            _seconds("delay_reset", Span(0, 0), "Added to all times of later passes."),
            Parameter(
                "time_warp", "custom", Span(1, 1), "", "Speed of the script's clock, drawn for each pass.",
                parse=parse_warp, example="1",
            ),
            Parameter("shuffle", "boolean", True, "", "Draw event times anew at each reset."),
            Parameter(
                "condition", "custom", None, "", "The clock stands still unless all conditions hold.",
                repeated=True, parse=parse_condition, example="DEPLOY = true",
            ),
            Parameter("script_atomic", "boolean", False, "", "Finish a pass whatever the conditions say."),
            Parameter(
                "upon_awake", "custom", "n/a", "", "When conditions hold again: n/a, reset or restart.",
                parse=parse_upon_awake, example="restart",
            ),
            Parameter(
                "randvar", "custom", None, "", "A random number for values: varname, min, max, key, snap, type.",
                repeated=True, aliases=("rand_var",), parse=parse_randvar,
                example="varname=ANGLE, min=0, max=359, key=at_reset",
            ),
            Parameter(
                "rand_pair", "custom", None, "", "A random point of a polygon for values.",
                repeated=True, parse=parse_rand_pair,
                example='var1=X, var2=Y, key=at_post, type=poly, poly="pts={0,0:9,0:9,9}"',
            ),
            Parameter("forward_var", "variable", "UTS_FORWARD", "", "Hears how far to skip."),
            Parameter("pause_var", "variable", "UTS_PAUSE", "", "Hears true, false or toggle."),
            Parameter("reset_var", "variable", "UTS_RESET", "", "Hears reset."),
            Parameter("status_var", "variable", "UTS_STATUS", "", "Carries the status; silent for none."),
            Parameter(
                "block_on", "custom", None, "", "Wait until these apps are connected.",
                repeated=True, parse=parse_names, example="pHelmIvP,pNodeReporter",
            ),
            Parameter(
                "time_zero", "choice", "script_start", "", "Where the clock starts.",
                choices=("script_start", "db_start"),
            ),
            Parameter("script_name", "text", "unnamed", "", "Shown in status and reports."),
            Parameter("verbose", "boolean", True, "", "Report each post as an event."),
        )
    )  # fmt: skip

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        config = self.config
        self.plan = ScriptPlan(
            events=joined_events(config.event),
            random_variables=(*config.randvar, *config.rand_pair),
            paused=config.paused,
            reset_time=config.reset_time,
            reset_max=config.reset_max,
            delay_start=config.delay_start,
            delay_reset=config.delay_reset,
            time_warp=config.time_warp,
            shuffle=config.shuffle,
            atomic=config.script_atomic,
            upon_awake=config.upon_awake,
        )
        self.awaited = dict.fromkeys(name for group in config.block_on for name in group)
        self.known: dict[str, Value] = {}
        self.db_start: float | None = None
        self.quitting = False
        self._status = ""
        self._next_status = 0.0

    def on_start_up(self) -> None:
        self.script = Script(self.plan, self.random)
        for condition in self.config.condition:
            for warning in condition.warnings:
                self.config_warning(f"condition = {condition.text}: {warning}")

    def on_connect(self) -> None:
        config = self.config
        names = [config.forward_var, config.pause_var, config.reset_var, "EXITED_NORMALLY"]
        used = {name for event in self.plan.events for name in macros_of(event.value)}
        names += [name for name in _POSITION if name in used]
        if "DBTIME" in used or config.time_zero == "db_start":
            names.append("DB_UPTIME")
        names += [name for condition in config.condition for name in condition.registrations()]
        if self.awaited:
            names.append("DB_CLIENTS")
        for name in dict.fromkeys(names):
            self.register(name)

    # --- mail ----------------------------------------------------------------------------------

    def on_mail(self, mail: list[Message]) -> None:
        config = self.config
        for message in mail:
            name = message.name
            self.known[name] = message.value
            if name == config.forward_var:
                if (seconds := message.number) is not None:
                    self.script.forward(seconds, self.now)
            elif name == config.pause_var:
                wanted = parse_bool(message.text, self.script.paused)
                if wanted is not None:
                    self.script.paused = wanted
            elif name == config.reset_var:
                if message.text.strip().lower() in ("reset", "true"):
                    self.script.reset(self.now)
                    self.event("reset by mail")
            elif name == "DB_UPTIME":
                if (uptime := message.number) is not None:
                    self.db_start = message.time - uptime
            elif name == "DB_CLIENTS":
                for client in message.text.split(","):
                    self.awaited.pop(client.strip(), None)
            elif name == "EXITED_NORMALLY" and self.quitting and message.value == self.name:
                self.quit()

    # --- time ----------------------------------------------------------------------------------

    def iterate(self) -> None:
        script, now = self.script, self.now
        if script.start is None:
            if self.config.time_zero == "db_start" and self.db_start is None:
                return  # the database's age is not known yet
            script.begin(now, self.db_start if self.config.time_zero == "db_start" else None)
        held = all(condition.holds(self.known.get) for condition in self.config.condition)
        for due in script.update(now, conditions=held, blocked=bool(self.awaited)):
            self._post(due)
        script.settle(now)
        self._post_status()

    def _post(self, due: Due) -> None:
        event = due.event
        if event.quits:
            self.quitting = True
            self.notify("EXITED_NORMALLY", self.name)
            return
        script = self.script
        script.draw_variables("at_post")
        numbers = self._numbers()
        value = expand_value(event.value, event.quoted, numbers, self._texts(), self.random)
        script.posted()
        self.notify(event.var, value)
        if self.config.verbose:
            shown = num(value, 6) if isinstance(value, float) else clip(value)
            self.event(f"{event.var} = {shown}")

    def _numbers(self) -> dict[str, float]:
        utc = self.now
        return {
            "DBTIME": 0.0 if self.db_start is None else utc - self.db_start,
            "UTCTIME": utc,
            "UTC": utc,
            "COUNT": float(self.script.count),
            "TCOUNT": float(self.script.total),
        }

    def _texts(self) -> dict[str, str]:
        texts = {name: fix(self._position(name), 2) for name in _POSITION}
        texts["VNAME"] = self.community
        texts.update(self.script.values)
        return texts

    def _position(self, name: str) -> float:
        value = self.known.get(name)
        return value if isinstance(value, float) else 0.0

    # --- saying how it goes --------------------------------------------------------------------

    def status(self) -> str:
        """The text of `UTS_STATUS`."""
        script, config = self.script, self.config
        limit = "any" if self.plan.reset_max < 0 else str(self.plan.reset_max)
        return (
            f"name={config.script_name}, elapsed_time={script.elapsed(self.now):.2f}, posted={script.count}, "
            f"pending={len(script.pending)}, {self._settings()}, resets={script.resets}/{limit}"
        )

    def _settings(self) -> str:
        script = self.script
        delays = [script.delay, 0.0] if script.resets == 0 else [0.0, script.delay]
        return (
            f"paused={_word(script.paused)}, conditions_ok={_word(script.conditions_ok)}, "
            f"time_warp={num(script.warp, 4)}, delay_start={num(delays[0], 4)}, "
            f"delay_reset={num(delays[1], 4)}, shuffle={_word(self.plan.shuffle)}, "
            f"upon_awake={self.plan.upon_awake}"
        )

    def _post_status(self) -> None:
        script = self.script
        state = f"{script.count},{len(script.pending)},{script.resets},{self._settings()}"
        if self.config.status_var.lower() == "silent":
            return
        if state != self._status or self.now >= self._next_status:
            self._status, self._next_status = state, self.now + STATUS_PERIOD
            self.notify(self.config.status_var, self.status())

    def report(self) -> Iterable[str]:
        script = self.script
        yield self.status().replace(", ", "\n")
        if self.awaited:
            yield f"waiting for: {', '.join(self.awaited)}"
        ahead = script.next_time(self.now)
        if ahead < float("inf"):
            yield f"next event in {max(ahead, 0.0):.1f} script seconds"
        for name, value in script.values.items():
            yield f"{name} = {value}"


def _word(value: bool) -> str:
    return "true" if value else "false"
