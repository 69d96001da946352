"""A mission as a record: globals and blocks of `key = value` lines, with lookups and typed reads.

Values are kept as written, with their quotes and inner blanks; what an app makes of its parameters is its own
business. The rules of who finds what are those of community.md 1.4 and 1.5.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from pymoos_lite.config.problems import ConfigurationError, Problem

KNOWN_GLOBALS = (
    "ServerHost",
    "ServerPort",
    "Community",
    "MOOSTimeWarp",
    "LatOrigin",
    "LongOrigin",
    "AltOrigin",
    "TERM_REPORTING",
    "GLOBALLOGPATH",
    "UseMOOSComms",
    "ClientTimeout",
    "WarningLatency",
    "NoNetwork",
    "tcpnodelay",
    "WEBSERVERPORT",
    "MULTICAST_BASE",
    "geodesy",
    "EndWhen",
)
MAX_TIME_WARP = 400.0
DEFAULT_PORT = 9000


_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?")
_INTEGER = re.compile(r"[+-]?\d+")
_TRUE = ("true", "on", "yes")
_FALSE = ("false", "off", "no")


def key_name(key: str) -> str:
    """The form in which keys compare: no blanks or tabs, lower case."""
    return "".join(key.split()).lower()


@dataclass(frozen=True, slots=True)
class ConfigLine:
    """One `key = value` as written (ends trimmed, comment cut); `line` is its 1-based place in the file."""

    key: str
    value: str
    line: int

    @property
    def name(self) -> str:
        return key_name(self.key)


@dataclass(frozen=True, slots=True)
class Block:
    """One `ProcessConfig = app { ... }` in file order; `line` is that of its head."""

    app: str
    lines: tuple[ConfigLine, ...]
    line: int

    def all(self, key: str) -> tuple[ConfigLine, ...]:
        """Every line with this key, in file order."""
        name = key_name(key)
        return tuple(entry for entry in self.lines if entry.name == name)

    def last(self, key: str) -> ConfigLine | None:
        """The line that counts for a single-valued parameter: the last one in the file."""
        found = self.all(key)
        return found[-1] if found else None


@dataclass(frozen=True, slots=True)
class MissionFile:
    """A parsed mission. `file` is the name used in messages; `findings` is what reading brought up."""

    file: str
    globals: tuple[ConfigLine, ...] = ()
    blocks: tuple[Block, ...] = ()
    defines: tuple[ConfigLine, ...] = ()
    findings: tuple[Problem, ...] = ()

    @property
    def problems(self) -> tuple[Problem, ...]:
        """Findings of the reader and unusable values of globals, by line."""
        return tuple(sorted((*self.findings, *self._unusable_globals())))

    @property
    def errors(self) -> tuple[Problem, ...]:
        return tuple(p for p in self.problems if p.severity == "error")

    def _unusable_globals(self) -> list[Problem]:
        """Globals whose type is known are read once, so that a bad one is found before anything starts."""
        found = []
        checks: tuple[Callable[[], object], ...] = (
            self.time_warp,
            self.port,
            lambda: self.number("LatOrigin"),
            lambda: self.number("LongOrigin"),
            lambda: self.number("ClientTimeout"),
            lambda: self.flag("TERM_REPORTING"),
        )
        for check in checks:
            try:
                check()
            except ConfigurationError as refusal:
                found.append(refusal.problem)
        return found

    def block(self, run_name: str) -> Block | None:
        """The first block of the app launched under `run_name` (its alias, not its program), or None."""
        wanted = key_name(run_name)
        return next((b for b in self.blocks if key_name(b.app) == wanted), None)

    def find_global(self, name: str) -> ConfigLine | None:
        """The first line outside all blocks with this name; block parameters never shadow a global."""
        wanted = key_name(name)
        return next((g for g in self.globals if g.name == wanted), None)

    def text(self, name: str, default: str | None = None) -> str | None:
        """A global as programs see it: first pair of quotes and all blanks removed."""
        line = self.find_global(name)
        return default if line is None else global_value(line.value)

    def number(self, name: str, default: float | None = None) -> float | None:
        """A global as a number; raises `ConfigurationError` when it is not one."""
        line = self.find_global(name)
        return default if line is None else read_number(line, self.file)

    def integer(self, name: str, default: int | None = None) -> int | None:
        """A global as a whole number; raises `ConfigurationError` when it is not one."""
        line = self.find_global(name)
        return default if line is None else read_integer(line, self.file)

    def flag(self, name: str, default: bool | None = None) -> bool | None:
        """A global as true or false; raises `ConfigurationError` when it is neither."""
        line = self.find_global(name)
        return default if line is None else read_flag(line, self.file)

    def time_warp(self) -> float:
        """`MOOSTimeWarp`, 1 when absent; raises `ConfigurationError` outside (0, 400]."""
        warp = self.number("MOOSTimeWarp", 1.0)
        assert warp is not None
        if not 0.0 < warp <= MAX_TIME_WARP:
            line = self.find_global("MOOSTimeWarp")
            assert line is not None
            text = f"MOOSTimeWarp = {line.value}: must be above 0 and at most {MAX_TIME_WARP:g}"
            raise ConfigurationError(Problem(self.file, line.line, text))
        return warp

    def port(self) -> int:
        """`ServerPort`, 9000 when absent; raises `ConfigurationError` outside 1..65535."""
        port = self.integer("ServerPort", DEFAULT_PORT)
        assert port is not None
        if not 0 < port < 65536:
            line = self.find_global("ServerPort")
            assert line is not None
            text = f"ServerPort = {line.value}: must be between 1 and 65535"
            raise ConfigurationError(Problem(self.file, line.line, text))
        return port


def global_value(value: str) -> str:
    """Value of a global as every program reads it: the first pair of quotes and all blanks go."""
    first = value.find('"')
    second = value.find('"', first + 1) if first >= 0 else -1
    if second > first >= 0:
        value = value[:first] + value[first + 1 : second] + value[second + 1 :]
    return "".join(value.split())


def read_number(line: ConfigLine, file: str) -> float:
    """The whole value as a number (`.5`, `+5` and `1e3` are fine); raises `ConfigurationError` otherwise."""
    text = global_value(line.value)
    if not _NUMBER.fullmatch(text):
        raise ConfigurationError(Problem(file, line.line, f"{line.key} = {line.value}: expected a number"))
    return float(text)


def read_integer(line: ConfigLine, file: str) -> int:
    """The whole value as an integer; raises `ConfigurationError` otherwise."""
    text = global_value(line.value)
    # The length bound keeps a hostile digit string away from the interpreter's own conversion limit.
    if not _INTEGER.fullmatch(text) or len(text) > 30:
        text = f"{line.key} = {line.value}: expected a whole number"
        raise ConfigurationError(Problem(file, line.line, text))
    return int(text)


def read_flag(line: ConfigLine, file: str) -> bool:
    """true/on/yes or false/off/no in any case, or a number (true when above 0)."""
    text = global_value(line.value).lower()
    if text in _TRUE:
        return True
    if text in _FALSE:
        return False
    if _NUMBER.fullmatch(text):
        return float(text) > 0
    raise ConfigurationError(Problem(file, line.line, f"{line.key} = {line.value}: expected true or false"))


def print_mission(mission: MissionFile) -> str:
    """A `.moos` text that reads back as the same globals and blocks (comments and line numbers are lost)."""
    rows = [f"define: {d.key} = {d.value}" for d in mission.defines]
    rows += [_row(g) for g in mission.globals]
    for block in mission.blocks:
        rows += ["", f"ProcessConfig = {block.app}", "{", *(f"  {_row(e)}" for e in block.lines), "}"]
    return "\n".join(rows) + "\n"


def _row(entry: ConfigLine) -> str:
    return f"{entry.key} = {entry.value}" if entry.value or "=" in entry.key else entry.key
