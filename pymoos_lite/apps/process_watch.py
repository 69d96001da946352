"""uProcessWatch: says which apps are there, missing, excused or back (community.md 16).

`WatchList` is the pure part: from the names that are connected to what changed.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from pymoos_lite.app import App, AppContext
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.records.csp import clip, parse_bool, parse_number

GRACE = 10.0
"""Wall seconds after the start during which nothing counts as missing."""

OUTPUTS = (
    "PROC_WATCH_SUMMARY",
    "PROC_WATCH_ALL_OK",
    "PROC_WATCH_FULL_SUMMARY",
    "PROC_WATCH_EVENT",
    "PROC_WATCH_TIME_WARP",
)
_OWN_TOOLS = "pymoos"
# Two fields of a long text that comes from every app every two seconds: no need to take all of it apart.
_STATUS = re.compile(r",cpuload=([^,]*),.*?MOOSName=([^,]*)")


@dataclass(frozen=True, slots=True)
class Pattern:
    """An app's name or, with `prefix`, the beginning of names; `variable` is told about changes."""

    text: str
    prefix: bool = False
    variable: str = ""

    def covers(self, name: str) -> bool:
        return name.startswith(self.text) if self.prefix else name == self.text


def parse_apps(text: str) -> list[Pattern]:
    """`pHelmIvP, uSim*, pLogger:LOGGER_THERE`. Raises ValueError."""
    patterns = []
    for part in text.split(","):
        name, colon, variable = (piece.strip() for piece in part.partition(":"))
        bare = name.removesuffix("*")
        if not bare or "*" in bare or len(bare.split()) != 1 or (colon and len(variable.split()) != 1):
            raise ValueError(f"'{clip(part.strip())}': expected APP, APP* or APP:VARIABLE")
        patterns.append(Pattern(bare, name.endswith("*"), variable))
    return patterns


def parse_retractions(text: str) -> float:
    """`true` as 0, `false` as -1, else the wall seconds an app must be back. Raises ValueError."""
    word = parse_bool(text)
    if word is not None:
        return 0.0 if word else -1.0
    seconds = parse_number(text)
    if seconds is None or seconds < 0:
        raise ValueError("expected true, false or seconds")
    return seconds


def parse_mapping(text: str) -> tuple[str, str]:
    """`PROC_WATCH_SUMMARY, MY_NAME`. Raises ValueError."""
    old, comma, new = (part.strip() for part in text.partition(","))
    if not comma or old.upper() not in OUTPUTS or len(new.split()) != 1:
        raise ValueError(f"'{clip(text)}': expected OLD, NEW with OLD one of {', '.join(OUTPUTS)}")
    return old.upper(), new


@dataclass(slots=True)
class Watched:
    """One app on the list. `seen` and `lost` count how often it came and went."""

    name: str
    present: bool = False
    missing: bool = False
    excused: bool = False
    seen: int = 0
    lost: int = 0
    back_since: float = 0.0
    cpu: str = ""

    @property
    def state(self) -> str:
        if self.present:
            return "OK"
        return "EXCUSED" if self.excused else "MISSING" if self.missing else "AWAITED"


@dataclass(slots=True)
class WatchList:
    """Who is watched, and how it stands with each."""

    watch: Sequence[Pattern] = ()
    nowatch: Sequence[Pattern] = ()
    everybody: bool = True
    apps: dict[str, Watched] = field(default_factory=dict)

    def expect(self, name: str) -> None:
        """Put an app on the list that should come, unless it is not to be watched."""
        if name not in self.apps and not self._ignored(name):
            self.apps[name] = Watched(name)

    def _ignored(self, name: str) -> bool:
        if any(p.covers(name) for p in self.watch):
            return False
        return any(p.covers(name) for p in self.nowatch)

    def variables(self, name: str) -> list[str]:
        return [p.variable for p in self.watch if p.variable and p.covers(name)]

    def excuse(self, name: str) -> None:
        if (app := self.apps.get(name)) is not None:
            app.excused = True

    def update(self, clients: Sequence[str], now: float, grace_over: bool) -> list[tuple[Watched, str]]:
        """Take the connected names; returns each app whose state changed with the text of the event."""
        for name in clients:
            explicit = any(p.covers(name) for p in self.watch)
            if explicit or (self.everybody and not name.startswith(_OWN_TOOLS)):
                self.expect(name)
        here = set(clients)
        changes = []
        for app in self.apps.values():
            if app.name in here and not app.present:
                app.present, app.excused, app.back_since = True, False, now
                came_back = app.missing or app.seen > 0
                app.missing = False
                app.seen += 1
                changes.append(
                    (app, f"{'Resurrected' if came_back else 'Noted to be present'}: [{app.name}]")
                )
            elif app.name not in here and (
                app.present or (grace_over and not app.missing and not app.excused)
            ):
                app.present = False
                app.lost += 1
                app.missing = not app.excused
                text = f"Process [{app.name}] is gone but excused." if app.excused else missing_text(app.name)
                changes.append((app, text))
        return changes

    @property
    def absent(self) -> list[str]:
        return [app.name for app in self.apps.values() if app.missing]

    def summary(self) -> str:
        return f"AWOL: {','.join(self.absent)}" if self.absent else "All Present"

    def full_summary(self) -> str:
        return ",".join(f"{app.name}({app.seen}/{app.lost})" for app in self.apps.values())

    @property
    def settled(self) -> bool:
        """Whether every app has been heard of, one way or the other."""
        return all(app.seen or app.missing or app.excused for app in self.apps.values())


def missing_text(name: str) -> str:
    return f"Process [{name}] is missing."


class ProcessWatch(App):
    """The watch app; see the module."""

    PARAMETERS = Declaration(
        (
            Parameter(
                "watch_all",
                "choice",
                "true",
                "",
                "Watch the apps of the launch list, all that connect, both or none.",
                choices=("true", "false", "antler", "dbclients"),
            ),
            Parameter(
                "watch",
                "custom",
                None,
                "",
                "Watch these: APP, APP*, APP:VAR posts true or false on VAR.",
                repeated=True,
                parse=parse_apps,
                example="pHelmIvP:HELM_THERE",
            ),
            Parameter(
                "nowatch",
                "custom",
                None,
                "",
                "Do not watch these.",
                repeated=True,
                parse=parse_apps,
                example="uXMS*,uMAC*",
            ),
            Parameter(
                "summary_wait", "number", -1.0, "wall s", "Time between repeated summaries; -1 for none."
            ),
            Parameter(
                "allow_retractions",
                "custom",
                0.0,
                "wall s",
                "Take back the warning of an app that is back: true, false, or after seconds.",
                parse=parse_retractions,
                example="true",
            ),
            Parameter(
                "post_mapping",
                "custom",
                None,
                "",
                "Rename an output: OLD, NEW.",
                repeated=True,
                parse=parse_mapping,
                example="PROC_WATCH_SUMMARY, MY_SUMMARY",
            ),
        )
    )

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        config = self.config
        watch = [p for group in config.watch for p in group]
        own = [Pattern(self.name), Pattern("MOOSDB", prefix=True)]
        nowatch = [*own, *(p for group in config.nowatch for p in group)]
        self.list = WatchList(watch, nowatch, everybody=config.watch_all in ("true", "dbclients"))
        self.names = dict(config.post_mapping)
        self.clients: list[str] | None = None
        self.dirty = False
        self._summary = ""
        self._next_summary = float("inf")
        self._registered: set[str] = set()

    def on_start_up(self) -> None:
        if self.config.watch_all in ("true", "antler"):
            for name in self.context.apps:
                self.list.expect(name)
        for pattern in self.list.watch:
            if not pattern.prefix:
                self.list.expect(pattern.text)

    def on_connect(self) -> None:
        self.register("DB_CLIENTS")
        self.register("EXITED_NORMALLY")
        self._post("PROC_WATCH_TIME_WARP", float(self.clock.warp))

    def on_mail(self, mail: list[Message]) -> None:
        for message in mail:
            if message.name == "DB_CLIENTS":
                self.clients = [name for name in message.text.split(",") if name]
                self.dirty = True
            elif message.name == "EXITED_NORMALLY":
                self.list.excuse(message.text.strip())
            elif message.name.endswith("_STATUS"):
                self._take_status(message.text)

    def _take_status(self, text: str) -> None:
        match = _STATUS.search(text)
        app = self.list.apps.get(match[2]) if match is not None else None
        if match is not None and app is not None:
            app.cpu = match[1]

    def iterate(self) -> None:
        grace_over = self.uptime / self.clock.warp >= GRACE
        if self.clients is not None and (self.dirty or (grace_over and not self.list.settled)):
            self.dirty = False
            for app, text in self.list.update(self.clients, self.now, grace_over):
                self._tell(app, text)
        for app in self.list.apps.values():
            # Only names that are watched: a wildcard would bring the status of everybody.
            variable = f"{app.name.upper()}_STATUS"
            if variable not in self._registered:
                self._registered.add(variable)
                self.register(variable, 2.0)
        self._retract()
        self._summarise()

    def _tell(self, app: Watched, text: str) -> None:
        self._post("PROC_WATCH_EVENT", text)
        self.event(text)
        if app.missing:
            self.run_warning(text)
        for variable in self.list.variables(app.name):
            self.notify(variable, app.present)

    def _retract(self) -> None:
        wait = self.config.allow_retractions * self.clock.warp
        if wait < 0:
            return
        for app in self.list.apps.values():
            if app.present and app.lost and self.now - app.back_since >= wait:
                self.retract_run_warning(missing_text(app.name))

    def _summarise(self) -> None:
        if self.clients is None or not self.list.settled:
            return
        state = f"{self.list.summary()};{self.list.full_summary()}"
        if state == self._summary and self.now < self._next_summary:
            return
        self._summary = state
        wait = self.config.summary_wait
        self._next_summary = self.now + wait * self.clock.warp if wait >= 0 else float("inf")
        self._post("PROC_WATCH_SUMMARY", self.list.summary())
        self._post("PROC_WATCH_ALL_OK", not self.list.absent)
        self._post("PROC_WATCH_FULL_SUMMARY", self.list.full_summary())

    def _post(self, name: str, value: str | float | bool) -> None:
        self.notify(self.names.get(name, name), value)

    def report(self) -> Iterable[str]:
        yield f"Summary: {self.list.summary()}"
        yield ""
        yield f"{'App':<24} {'Status':<8} {'CPU %':>6}  here/gone"
        for app in sorted(self.list.apps.values(), key=lambda a: (a.present, a.name)):
            yield f"{app.name:<24} {app.state:<8} {app.cpu:>6}  {app.seen}/{app.lost}"
