"""From a mission file to what a host must start: communities, apps, their names and blocks.

Reading and checking happen here, before anything runs, so that a mission with an error starts
nothing at all. The same plan feeds the real-time and the lockstep host.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pymoos_lite.app.base import App
from pymoos_lite.app.standard import STANDARD_PARAMETERS
from pymoos_lite.config import registry
from pymoos_lite.config.antler import AppRun, read_antler
from pymoos_lite.config.catalogue import VIEWERS
from pymoos_lite.config.mission import ConfigLine, MissionFile
from pymoos_lite.config.problems import Problem, did_you_mean


@dataclass(frozen=True)
class AppPlan:
    """One app to start: the class, the name it runs under and the lines of its block."""

    name: str
    program: str
    cls: type[App]
    lines: tuple[ConfigLine, ...]
    has_block: bool
    line: int = 0


@dataclass(frozen=True)
class CommunityPlan:
    """One community to start, and everything that is wrong with its mission."""

    community: str
    host: str
    port: int
    warp: float
    mission: MissionFile
    mission_dir: Path
    apps: tuple[AppPlan, ...]
    globals: dict[str, str]
    problems: tuple[Problem, ...] = ()
    skipped: tuple[str, ...] = ()

    @property
    def errors(self) -> list[Problem]:
        return [p for p in self.problems if p.severity == "error"]

    @property
    def app_names(self) -> list[str]:
        return [app.name for app in self.apps]


@dataclass
class _Findings:
    file: str
    problems: list[Problem] = field(default_factory=list)
    skipped: list[str] = field(default_factory=list)

    def warn(self, line: int, text: str) -> None:
        self.problems.append(Problem(self.file, line, text, "warning"))

    def error(self, line: int, text: str) -> None:
        self.problems.append(Problem(self.file, line, text))


def plan_community(mission: MissionFile, mission_dir: Path, only: Sequence[str] = ()) -> CommunityPlan:
    """Work out what `mission` starts. `only` restricts it to these run names.

    Nothing is raised: all problems, of the reader, the launch list, the names of apps and their
    parameters, are in the plan's `problems`, sorted by line.
    """
    found = _Findings(mission.file)
    found.problems += mission.problems
    antler = read_antler(mission)
    runs: tuple[AppRun, ...] = ()
    if antler is None:
        found.error(0, "there is no 'ProcessConfig = ANTLER' block: nothing says which apps to run")
    else:
        found.problems += antler.problems
        runs = antler.runs
        if not runs:
            found.error(antler.line, "the ANTLER block has no 'Run = ...' line: nothing to run")
    table = _registry(mission_dir, found)
    apps = [app for run in runs if (app := _plan_app(run, mission, table, found, only)) is not None]
    _check_orphans(mission, runs, table, found)
    try:
        port, warp = mission.port(), mission.time_warp()
    except ValueError:  # already among the mission's problems
        port, warp = 0, 1.0
    return CommunityPlan(
        community=mission.text("Community") or "",
        host=mission.text("ServerHost", "localhost") or "localhost",
        port=port,
        warp=warp,
        mission=mission,
        mission_dir=mission_dir,
        apps=tuple(apps),
        globals={line.name: mission.text(line.key) or "" for line in reversed(mission.globals)},
        problems=tuple(sorted(set(found.problems), key=lambda p: (p.line, p.text))),
        skipped=tuple(found.skipped),
    )


def _registry(mission_dir: Path, found: _Findings) -> registry.Registry:
    try:
        return registry.apps(mission_dir)
    except ImportError as error:
        found.error(0, f"an app in the mission's folder cannot be imported: {error}")
        return registry.apps()


def _plan_app(
    run: AppRun,
    mission: MissionFile,
    table: registry.Registry,
    found: _Findings,
    only: Sequence[str],
) -> AppPlan | None:
    if only and run.alias not in only:
        return None
    program = run.app.replace("\\", "/").rpartition("/")[2]
    entry = table.find(program)
    if entry is None:
        if program in VIEWERS:
            found.warn(run.line, f"'{program}' is a viewer of its own; skipped (pymoos shows the mission)")
        else:
            hint = did_you_mean(program, table.names())
            found.warn(run.line, f"there is no app '{program}'{hint}; it is skipped")
        found.skipped.append(run.alias)
        return None
    if entry.host:
        return None
    try:
        cls = registry.load_target(entry.target)
    except ImportError as error:
        found.error(run.line, f"app '{program}' cannot be loaded: {error}")
        return None
    block = mission.block(run.alias)
    lines = block.lines if block is not None else ()
    if not issubclass(cls, App):
        found.error(run.line, f"app '{program}' ({entry.target}) is not a subclass of pymoos_lite.app.App")
        return None
    bound = (STANDARD_PARAMETERS + cls.PARAMETERS).bind(lines, run.alias, mission.file)
    found.problems += bound.problems
    if block is None and not cls.BLOCK_OPTIONAL:
        found.warn(run.line, f"there is no 'ProcessConfig = {run.alias}' block; defaults are used")
    return AppPlan(run.alias, program, cls, lines, block is not None, run.line)


def _check_orphans(
    mission: MissionFile, runs: Sequence[AppRun], table: registry.Registry, found: _Findings
) -> None:
    """A block that nothing runs is usually a misspelt name."""
    names = [run.alias for run in runs]
    lowered = {name.lower() for name in names}
    for block in mission.blocks:
        word = block.app.lower()
        if word in lowered or word == "antler" or table.find(block.app) or block.app in VIEWERS:
            continue
        hint = did_you_mean(block.app, names)
        if hint:
            found.warn(block.line, f"no Run line starts '{block.app}', so its block is not used{hint}")


def warm_up(plan: CommunityPlan) -> None:
    """Let every kind of app compile or load its numerics (`App.warm_up`)."""
    for cls in dict.fromkeys(app.cls for app in plan.apps):
        cls.warm_up()
