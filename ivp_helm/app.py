"""pHelmIvP: the helm as an app. It reads the `.bhv` files, moves mail in and posts out, and reports.

All decisions are made in `helm.HelmCore`; this module only knows files, the registry of behaviours and
the community (helm.md 8).
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from time import process_time

from ivp_helm.behavior import Behavior
from ivp_helm.behavior_file import BehaviorFile, merge, read_behavior_file
from ivp_helm.helm import HelmCore
from ivp_helm.report import report_lines
from ivp_helm.settings import HELM_PARAMETERS, HelmSettings
from pymoos_lite.app import App
from pymoos_lite.app.standard import STANDARD_PARAMETERS
from pymoos_lite.config.problems import Problem, did_you_mean
from pymoos_lite.config.registry import Registry, behaviors, import_file
from pymoos_lite.core.message import Message
from pymoos_lite.geometry.geodesy import Geodesy, GeodesyError
from pymoos_lite.geometry.text import parse_number


class Helm(App):
    """Decides heading, speed (and depth) by interval programming."""

    PARAMETERS = HELM_PARAMETERS
    DEFAULT_TICK = 4.0

    def on_start_up(self) -> None:
        problems = [p for p in self.problems if p.severity == "error"] + self._unknown_lines()
        content = self._read_files(problems)
        registry = self._registry(problems)
        settings = HelmSettings.from_values(self.config, self.community)
        quiet = self.context.deterministic
        self.core = HelmCore(
            settings,
            content,
            lambda kind: _behavior_class(registry, kind),
            name=self.name,
            problems=problems,
            geodesy=self._geodesy(),
            seed=f"{self.context.seed}:{self.community}:{self.name}" if self.context.seed is not None else None,
            stopwatch=float if quiet else process_time,
            listens=self._listens,
        )
        for problem in self.core.problems:
            self.config_warning(str(problem))
        self.core.start(self.now)

    def on_connect(self) -> None:
        self._register()
        for line in self.config.behaviors:
            self.notify("PLOGGER_CMD", f"COPY_FILE_REQUEST = {self.mission_path(line)}")
        self._publish()

    def on_mail(self, mail: list[Message]) -> None:
        self.core.deliver(mail, self.now)

    def iterate(self) -> None:
        core = self.core
        core.warning_count = len(self.log.config_warnings) + self.log.run_warnings_total
        core.iterate(self.now)
        self._register()
        self._publish()

    def report(self) -> Iterable[str]:
        return report_lines(self.core, self.config.comms_policy)

    # --- moving values ----------------------------------------------------------------------------------

    def _register(self) -> None:
        for name in self.core.take_registrations():
            self.register(name)

    def _publish(self) -> None:
        core = self.core
        notify = self.notify
        for variable, value, aux in core.take_posts():
            notify(variable, value, None, aux)
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
        wanted = getattr(self.connection, "wanted", None)
        return True if wanted is None else bool(wanted(variable))

    # --- configuration ----------------------------------------------------------------------------------

    def _unknown_lines(self) -> list[Problem]:
        """Lines of the block that nobody understands: they keep a helm from driving."""
        declaration = STANDARD_PARAMETERS + HELM_PARAMETERS
        file = self.context.mission_file
        return [
            Problem(file, line.line, f"Unhandled config line: {line.key} = {line.value}{hint}")
            for line in self.context.lines
            if declaration.find(line.key) is None and line.key.lower() not in declaration.ignored
            for hint in [did_you_mean(line.key, declaration.names())]
        ]

    def _read_files(self, problems: list[Problem]) -> BehaviorFile:
        contents = []
        seen: set[Path] = set()
        for line in self.context.lines:
            if line.key.lower() != "behaviors":
                continue
            name = line.value.strip().strip('"')
            path = self.mission_path(name)
            where = Problem(self.context.mission_file, line.line, f"Behaviors = {name}: given twice")
            if path in seen:
                problems.append(where)
                continue
            seen.add(path)
            try:
                text = path.read_text(encoding="utf-8", errors="replace")
            except OSError as error:
                reason = error.strerror or type(error).__name__
                problems.append(
                    Problem(self.context.mission_file, line.line, f"Could not find File: {name}: {reason}")
                )
                continue
            contents.append(read_behavior_file(text, name))
        return merge(contents) if contents else BehaviorFile(self.context.mission_file)

    def _registry(self, problems: list[Problem]) -> Registry:
        """Behaviours built in, installed, in the mission's folder, and in the folders named for plug-ins."""
        folders = [self.mission_path(text) for text in self.config.ivp_behavior_dir]
        missing = [folder for folder in folders if not folder.is_dir()]
        if missing and not self.config.bhv_dir_not_found_ok:
            for folder in missing:
                problems.append(
                    Problem(self.context.mission_file, 0, f"ivp_behavior_dir: there is no folder {folder}")
                )
        extra = [Path(part) for part in os.environ.get("IVP_BEHAVIOR_DIRS", "").split(os.pathsep) if part]
        entries = []
        for folder in (self.context.mission_dir, *extra, *folders):
            entries += _entries_in(folder, problems)
        return Registry("behavior", (*behaviors().entries, *entries))

    def _geodesy(self) -> Geodesy | None:
        lat, lon = parse_number(self.mission_global("LatOrigin")), parse_number(self.mission_global("LongOrigin"))
        if lat is None or lon is None:
            return None
        try:
            return Geodesy(lat, lon, self.mission_global("geodesy", "utm").lower() or "utm")
        except GeodesyError as error:
            self.config_warning(str(error))
            return None
