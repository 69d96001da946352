"""The ANTLER block of a mission: which apps run, under which names, in which order (community.md 9)."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from pymoos_lite.config.mission import Block, ConfigLine, MissionFile, key_name, read_flag, read_number
from pymoos_lite.config.problems import ConfigurationError, Problem, did_you_mean

# A tilde before a slash is somebody's home directory.
_ALIAS = re.compile(r"~(?!/)")
RUN_OPTIONS = ("NewConsole", "Path", "InhibitMOOSParams", "ExtraProcessParams", "XConfig", "AntlerID")
_SETTINGS = (
    "Run",
    "MSBetweenLaunches",
    "ExecutablePath",
    "GentleKill",
    "EnableDistributed",
    "KillOnDBDisconnect",
    "AppTick",
    "CommsTick",
)


@dataclass(frozen=True, slots=True)
class AppRun:
    """One `Run` line. `alias` is the name in the community and of the configuration block.

    `options` maps lower-case option names to values; `extra` are further command-line arguments.
    """

    app: str
    alias: str
    options: dict[str, str] = field(default_factory=dict)
    extra: tuple[str, ...] = ()
    line: int = 0


@dataclass(frozen=True, slots=True)
class Antler:
    """What pAntler would launch. `pause` is in seconds of real time between two launches."""

    runs: tuple[AppRun, ...] = ()
    pause: float = 1.0
    line: int = 0
    problems: tuple[Problem, ...] = ()

    def find(self, alias: str) -> AppRun | None:
        return next((run for run in self.runs if run.alias.lower() == alias.lower()), None)


def read_antler(mission: MissionFile) -> Antler | None:
    """The launch list of a mission in file order, or None when the mission has no ANTLER block.

    Two runs of one name cannot both connect: the later one is left out, with a warning.
    """
    block = mission.block("ANTLER")
    if block is None:
        return None
    problems: list[Problem] = []
    runs: dict[str, AppRun] = {}
    for entry in block.all("Run"):
        run = _read_run(entry, block, mission.file, problems)
        if run is None:
            continue
        first = runs.setdefault(run.alias, run)
        if first is not run:
            text = f"'{run.alias}' runs by line {first.line} already; skipped (give it an alias: ~ name)"
            problems.append(Problem(mission.file, entry.line, text, "warning"))
    pause = 1.0
    try:
        if (line := block.last("MSBetweenLaunches")) is not None:
            pause = max(0.0, read_number(line, mission.file) / 1000.0)
        for name in ("GentleKill", "EnableDistributed", "KillOnDBDisconnect"):
            if (line := block.last(name)) is not None:
                read_flag(line, mission.file)
    except ConfigurationError as refusal:
        problems.append(refusal.problem)
    settings = {key_name(name) for name in _SETTINGS}
    for entry in block.lines:
        # Any other name is a named string that a Run line may refer to; a near miss of a setting is not.
        if entry.name not in settings and not _is_referenced(block, entry.key):
            hint = did_you_mean(entry.key, _SETTINGS, cutoff=0.8)
            if hint:
                problems.append(Problem(mission.file, entry.line, f"unknown '{entry.key}'{hint}", "warning"))
    return Antler(tuple(runs.values()), pause, block.line, tuple(sorted(problems)))


def _is_referenced(block: Block, name: str) -> bool:
    return any(f"={name.lower()}" in "".join(e.value.split()).lower() for e in block.all("Run"))


def _read_run(entry: ConfigLine, block: Block, file: str, problems: list[Problem]) -> AppRun | None:
    # The alias may stand before or after the options; it ends at the next comma or '@'.
    text, alias = entry.value.replace('"', ""), ""
    if tilde := _ALIAS.search(text):
        before, after = text[: tilde.start()], text[tilde.end() :]
        cut = min((i for i in (after.find(","), after.find("@")) if i >= 0), default=len(after))
        alias, text = after[:cut].strip(), f"{before}{',' if '@' in before else '@'}{after[cut:]}"
    app, _, option_text = text.partition("@")
    app = app.strip()
    if not app:
        problems.append(
            Problem(file, entry.line, "Run names no app: expected 'Run = app [@ options] [~ alias]'")
        )
        return None
    options: dict[str, str] = {}
    for part in option_text.replace("@", ",").split(","):
        key, equals, value = (piece.strip() for piece in part.partition("="))
        if not key:
            continue
        known = {name.lower(): name for name in RUN_OPTIONS}
        if key.lower() not in known or not equals:
            hint = did_you_mean(key, RUN_OPTIONS) or f"; expected one of {', '.join(RUN_OPTIONS)}"
            what = "unknown option" if key.lower() not in known else "no value for option"
            problems.append(Problem(file, entry.line, f"{what} '{key}' of Run{hint}", "warning"))
            continue
        options[key.lower()] = value
    # Both separators: a mission written on Windows names programs with a backslash.
    name = app.replace("\\", "/").rstrip("/").rpartition("/")[2] or app
    extra = _named_string(options.get("extraprocessparams"), block, entry, file, problems)
    return AppRun(app, alias or name, options, extra, entry.line)


def _named_string(
    name: str | None, block: Block, entry: ConfigLine, file: str, problems: list[Problem]
) -> tuple[str, ...]:
    if not name:
        return ()
    line = block.last(name)
    if line is None:
        text = f"ExtraProcessParams={name}: the ANTLER block has no line '{name} = ...'"
        problems.append(Problem(file, entry.line, text, "warning"))
        return ()
    return tuple(part.strip() for part in line.value.replace('"', "").split(",") if part.strip())
