"""A small mission with apps of its own, and hosts that are always closed."""

import textwrap
import time

import pytest

from pymoos_lite.hosts.mission import load_plan
from pymoos_lite.hosts.ports import RemoteClient
from pymoos_lite.hosts.processes import ProcessHost
from pymoos_lite.hosts.realtime import HostOptions

PLUGINS = """
    from pymoos_lite.app import App

    class Counter(App):
        '''Posts the number of its iteration and repeats what it hears.'''
        MOOS_NAME = "pCounter"
        DEFAULT_TICK = 50.0

        def on_start_up(self):
            self.count = 0
            self.heard = 0

        def on_connect(self):
            self.register("ORDER")
            self.event("connected")

        def on_mail(self, mail):
            for message in mail:
                self.heard += 1
                self.notify("ECHO", message.text)
                if message.text == "fall":
                    raise RuntimeError("told to fall")

        def iterate(self):
            self.count += 1
            self.notify(f"COUNT_{self.name}", self.count)

        def report(self):
            return [f"count {self.count}"]

    class Sleeper(App):
        '''Registers for everything and then stops reading.'''
        MOOS_NAME = "pSleeper"
        DEFAULT_TICK = 5.0

        def on_connect(self):
            self.register("COUNT_*")

        def iterate(self):
            import time
            if self.iteration == 3:
                self.notify("ASLEEP", "true")
            if self.iteration > 3:
                time.sleep(3600)
"""

MISSION = """
    ServerHost = localhost
    ServerPort = 9000
    Community  = alpha
    ProcessConfig = ANTLER
    {
      MSBetweenLaunches = 10
      Run = MOOSDB @ NewConsole = false
    @RUNS@
    }
    @BLOCKS@
"""


@pytest.fixture
def mission(tmp_path):
    """A function that writes a mission with the given `program ~ alias` runs and returns its path."""

    def write(*runs):
        (tmp_path / "plugins.py").write_text(textwrap.dedent(PLUGINS))
        rows = "\n".join(f"  Run = {run}" for run in runs)
        names = [run.rpartition("~")[2].strip() for run in runs]
        blocks = "\n".join(
            f"ProcessConfig = {name}\n{{\n  CommsTick = 10\n}}" for name in dict.fromkeys(names)
        )
        text = textwrap.dedent(MISSION).replace("@RUNS@", rows).replace("@BLOCKS@", blocks)
        path = tmp_path / "small.moos"
        path.write_text(text)
        return path

    return write


class Fleet:
    """A process host, an observing client, and waiting for what should happen."""

    def __init__(self, path, **options):
        self.said = []
        plan = load_plan(str(path))
        assert not plan.errors
        self.host = ProcessHost(plan, HostOptions(**options), str(path), {}, self.said.append)
        self.client = RemoteClient("watcher", *self.host.address, options.get("key"))
        self.mail = []
        self.host.start_apps()

    def wait_for(self, happened, what, seconds=20.0):
        """Turn the host and read mail until `happened()`; fails after `seconds`, saying `what`."""
        end = time.monotonic() + seconds
        while not happened():
            assert time.monotonic() < end, f"{what} did not happen; said: {self.said}"
            self.host.turn(0.01)
            self.mail += self.client.poll(0.01)

    def values(self, name):
        return [m.value for m in self.mail if m.name == name]

    def close(self):
        self.client.close(0.2)
        self.host.close()


@pytest.fixture
def fleet(mission):
    """A function that launches a mission in processes; everything it starts is ended."""
    running = []

    def launch(*runs, **options):
        running.append(Fleet(mission(*runs), **options))
        return running[-1]

    yield launch
    for one in running:
        one.close()
