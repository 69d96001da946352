"""The real-time host with every app in a process of its own, talking UDP to the database here."""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from pymoos_lite.core.clock import RealClock
from pymoos_lite.hosts.failures import Failure
from pymoos_lite.hosts.plan import AppPlan, CommunityPlan
from pymoos_lite.hosts.realtime import RESTART_DELAY, HostOptions, RealtimeHost

GOODBYE = 3.0
"""Wall seconds that apps are given to end in an orderly way before they are ended."""


@dataclass
class _Child:
    app: AppPlan
    process: subprocess.Popen[str]


class ProcessHost(RealtimeHost):
    """Hosts the database here and starts one process per app; see the module.

    `mission` and `settings` are what the person typed: each process reads the mission itself.
    """

    def __init__(
        self,
        plan: CommunityPlan,
        options: HostOptions,
        mission: str,
        settings: Mapping[str, str],
        tell: Callable[[str], None] = print,
        clock: RealClock | None = None,
    ) -> None:
        super().__init__(plan, options, clock, tell)
        self._mission = mission
        self._settings = dict(settings)
        self._children: dict[str, _Child] = {}
        self._words: queue.SimpleQueue[tuple[str, str]] = queue.SimpleQueue()
        self._restart_children: list[tuple[float, AppPlan]] = []

    def pid(self, name: str) -> int:
        """Process id of an app.

        Raises:
            KeyError: no such app runs.
        """
        return self._children[name].process.pid

    def start_apps(self) -> None:
        for app in self.plan.apps:
            self._spawn(app)

    def alive(self) -> bool:
        return bool(self._children or self._restart_children)

    def turn(self, longest_wait: float = 0.2) -> None:
        super().turn(longest_wait)
        while not self._words.empty():
            name, line = self._words.get()
            self.tell(f"{name}: {line}")
        self._look_after_children()

    def close(self) -> None:
        children = list(self._children.values())
        for child in children:
            if child.process.stdin is not None:
                child.process.stdin.close()  # the end of its input tells an app to end
        deadline = self.clock.wall() + GOODBYE
        while any(c.process.poll() is None for c in children) and self.clock.wall() < deadline:
            super().turn(0.02)
        for child in children:
            if child.process.poll() is None:
                child.process.kill()
            child.process.wait()
        self._children.clear()
        super().close()

    def _spawn(self, app: AppPlan) -> None:
        host, port = self.server.address
        order = {
            "mission": str(self.plan.mission_dir / self._mission_file()),
            "settings": self._settings,
            "app": app.name,
            "host": host,
            "port": port,
            "warp": self.clock.warp,
            "key": self.options.key,
            "log_dir": str(self.options.log_dir) if self.options.log_dir else None,
            "seed": self.options.seed,
            "apps": self.plan.app_names,
        }
        process = subprocess.Popen(
            [sys.executable, "-m", "pymoos_lite.hosts.remote"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            errors="replace",
        )
        assert process.stdin is not None
        process.stdin.write(json.dumps(order) + "\n")
        process.stdin.flush()
        self._children[app.name] = _Child(app, process)
        threading.Thread(target=self._listen, args=(app.name, process), daemon=True).start()

    def _mission_file(self) -> str:
        return self.plan.mission.file.replace("\\", "/").rpartition("/")[2]

    def _listen(self, name: str, process: subprocess.Popen[str]) -> None:
        # A thread per child: reading a pipe without blocking differs between platforms.
        assert process.stdout is not None
        for line in process.stdout:
            if line.strip():
                self._words.put((name, line.rstrip()))

    def _look_after_children(self) -> None:
        for name, child in list(self._children.items()):
            status = child.process.poll()
            if status is None:
                continue
            del self._children[name]
            if status == 0:
                continue
            how = f"was ended by signal {-status}" if status < 0 else f"ended with status {status}"
            failure = Failure(self.plan.community, name, "its process", how, f"pid {child.process.pid}", "")
            self.failures.append(failure)
            self.tell(str(failure))
            if self.options.restart:
                self._restart_children.append((self.clock.wall() + RESTART_DELAY, child.app))
        for entry in [e for e in self._restart_children if e[0] <= self.clock.wall()]:
            self._restart_children.remove(entry)
            self._spawn(entry[1])
            self.tell(f"{entry[1].name} was started again")
