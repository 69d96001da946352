"""pHelmIvP: the helm as an app. It reads the `.bhv` files, moves mail in and posts out, and reports.

All decisions are made in `helm.HelmCore`; this module only knows files, the registry of behaviours and
the community (helm.md 8).
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from time import process_time
from typing import Final

from mypy_extensions import mypyc_attr

from ivp_helm.behavior_file import BehaviorFile, merge, read_behavior_file
from ivp_helm.helm import HelmCore
from ivp_helm.ivp import warm_up
from ivp_helm.plugins import BehaviorFinder
from ivp_helm.report import report_lines
from ivp_helm.settings import HELM_PARAMETERS, HelmSettings
from pymoos_lite.app import App
from pymoos_lite.app.datum import mission_geodesy
from pymoos_lite.app.standard import STANDARD_PARAMETERS
from pymoos_lite.config.mission import ConfigLine
from pymoos_lite.config.parameters import Values, unquote
from pymoos_lite.config.problems import Problem, did_you_mean
from pymoos_lite.core.message import Message

_NEVER_ASKED: Final = (-math.inf, False)
_new_tuple: Final = tuple.__new__  # what Message(...) does, in a third of the time
ASK_PERIOD = 1.0
"""Mission seconds after which it is asked again whether anybody reads functions and reasons."""


@mypyc_attr(allow_interpreted_subclasses=True)
class Helm(App):
    """Decides heading, speed (and depth) by interval programming."""

    PARAMETERS = HELM_PARAMETERS
    DEFAULT_TICK = 4.0

    def on_start_up(self) -> None:
        context = self.context
        problems = [p for p in self.problems if p.severity == "error"]
        problems += unknown_lines(context.lines, context.mission_file)
        content = read_files(context.lines, context.mission_dir, context.mission_file, problems)
        folders = plugin_folders(self.config, context.mission_dir, context.mission_file, problems)
        settings = HelmSettings.from_values(self.config, self.community)
        self.core = HelmCore(
            settings,
            content,
            BehaviorFinder(folders),
            name=self.name,
            problems=problems,
            geodesy=mission_geodesy(self, needed=False),
            seed=None if context.seed is None else f"{context.seed}:{self.community}:{self.name}",
            stopwatch=float if context.deterministic else process_time,
            listens=self._listens,
        )
        for problem in self.core.problems:
            self.config_warning(str(problem))
        self.core.start(self.now)
        self._met = False
        self._listeners: dict[str, tuple[float, bool]] = {}
        self._cpu = 0.0
        self._measured = (0.0, process_time())

    def on_connect(self) -> None:
        if self._met:
            self.core.reintroduce()
        self._met = True
        self._register()
        for line in self.config.behaviors:
            self.notify("PLOGGER_CMD", f"COPY_FILE_REQUEST = {self.mission_path(line)}")
        self._publish()

    @classmethod
    def warm_up(cls) -> None:
        warm_up()

    def on_mail(self, mail: list[Message]) -> None:
        self.core.deliver(mail, self.now)

    def iterate(self) -> None:
        core = self.core
        core.warning_count = len(self.log.config_warnings) + self.log.run_warnings_total
        core.iterate(self.now, self._cpu_load())
        self._register()
        self._publish()

    def report(self) -> Iterable[str]:
        return report_lines(self.core, self.config.comms_policy)

    def _cpu_load(self) -> float:
        """Percent of one core since about a second ago; nothing in lockstep, where runs must not differ."""
        if not self.context.deterministic:
            wall, used = self.clock.wall(), process_time()
            before, used_before = self._measured
            if wall - before > 1.0:
                self._cpu = 100.0 * (used - used_before) / (wall - before)
                self._measured = (wall, used)
        return self._cpu

    # --- moving values ----------------------------------------------------------------------------------

    def _register(self) -> None:
        for name in self.core.take_registrations():
            self.register(name)

    def _publish(self) -> None:
        core = self.core
        # What `notify` does: forty posts in every iteration, whose values the core has made proper already.
        publish, now, name, community = self.connection.publish, self.now, self.name, self.community
        for post in core.take_posts():
            publish(_new_tuple(Message, (post.variable, post.value, now, name, post.aux, community)))
        for kind, text in core.take_notes():
            if kind == "warning":
                self.run_warning(text)
            elif kind == "retract":
                self.retract_run_warning(text)
            else:
                self.event(text)

    def _listens(self, variable: str) -> bool:
        """Whether functions and reasons are worth posting: somebody is registered for the variable."""
        choice = self.config.bhv_ipf
        if choice != "auto":
            return bool(choice == "always")
        asked, answer = self._listeners.get(variable, _NEVER_ASKED)
        if self.now - asked >= ASK_PERIOD:
            answer = self.connection.wanted(variable)
            self._listeners[variable] = (self.now, answer)
        return answer

    # --- configuration ----------------------------------------------------------------------------------

    @classmethod
    def check_block(cls, lines: Sequence[ConfigLine], mission_dir: Path, file: str) -> list[Problem]:
        """Everything wrong with the block's `.bhv` files, found by building all behaviours and sailing none."""
        bound = HELM_PARAMETERS.bind(
            [line for line in lines if HELM_PARAMETERS.find(line.key) is not None], "pHelmIvP", file
        )
        problems = [p for p in bound.problems if p.severity == "error"]
        known = len(problems)
        content = read_files(lines, mission_dir, file, problems)
        finder = BehaviorFinder(plugin_folders(bound.values, mission_dir, file, problems))
        core = HelmCore(HelmSettings.from_values(bound.values, "check"), content, finder, problems=problems)
        return list(core.problems)[known:]


def unknown_lines(lines: Iterable[ConfigLine], file: str) -> list[Problem]:
    """Lines of the block that nobody understands: they keep a helm from driving (helm.md 8)."""
    declaration = STANDARD_PARAMETERS + HELM_PARAMETERS
    return [
        Problem(file, line.line, f"Unhandled config line: {line.key} = {line.value}{hint}")
        for line in lines
        if declaration.find(line.key) is None and line.key.lower() not in declaration.ignored
        for hint in [did_you_mean(line.key, declaration.names())]
    ]


def read_files(lines: Iterable[ConfigLine], folder: Path, file: str, problems: list[Problem]) -> BehaviorFile:
    """The `.bhv` files that the block names, as one, in the order given; complaints go to `problems`."""
    contents = []
    seen: set[Path] = set()
    for line in lines:
        if line.name != "behaviors":
            continue
        name = unquote(line.value)
        path = folder / Path(name).expanduser()
        if path in seen:
            problems.append(Problem(file, line.line, f"Behaviors = {name}: given twice"))
            continue
        seen.add(path)
        try:
            text = path.read_text(encoding="utf-8", errors="replace")
        except OSError as error:
            reason = error.strerror or type(error).__name__
            problems.append(Problem(file, line.line, f"Could not find File: {name}: {reason}"))
            continue
        contents.append(read_behavior_file(text, name))
    return merge(contents) if contents else BehaviorFile(file)


def plugin_folders(values: Values, folder: Path, file: str, problems: list[Problem]) -> list[Path]:
    """Where to look for behaviours: the mission's folder, IVP_BEHAVIOR_DIRS, and the folders of the block."""
    named = [folder / Path(text).expanduser() for text in values.ivp_behavior_dir]
    if not values.bhv_dir_not_found_ok:
        for path in named:
            if not path.is_dir():
                problems.append(Problem(file, 0, f"ivp_behavior_dir: there is no folder {path}"))
    environment = os.environ.get("IVP_BEHAVIOR_DIRS", "").split(os.pathsep)
    return list(dict.fromkeys([folder, *(Path(part) for part in environment if part), *named]))
