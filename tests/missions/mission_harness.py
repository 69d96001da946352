"""One app alone in a lockstep community, with mail put in and all it says collected."""

from pymoos_lite.app import AppContext
from pymoos_lite.config.moos_file import parse_mission
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.local import LocalConnection
from pymoos_lite.hosts.lockstep import Lockstep


class Bench:
    """`said` maps each variable that the app posted to its values, in order."""

    def __init__(self, cls, block="", community="abe", seed=1):
        self.host = Lockstep(seed)
        self.home = self.host.add_community(community)
        self.watcher = LocalConnection(self.home.database, "watcher", self.host.clock)
        self.watcher.register("*", "*", 0.0, ())
        lines = parse_mission(f"ProcessConfig = x\n{{\n{block}\n}}\n").blocks[0].lines
        connection = LocalConnection(self.home.database, "app", self.host.clock)
        context = AppContext(
            "app", community, self.host.clock, connection, lines, mission_file="m.moos", seed=seed, deterministic=True
        )  # fmt: skip
        runner = self.host.add_app(self.home, cls, context)
        self.failure = None if runner is not None else self.host.failures[0]
        self.app = None if runner is None else runner.app
        self.said = {}

    def run(self, seconds):
        self.host.run(seconds)
        assert self.host.failures == []
        for message in self.watcher.take_mail():
            if message.source == "app":
                self.said.setdefault(message.name, []).append(message.value)
        return self

    def post(self, **values):
        now = self.host.clock.now()
        for name, value in values.items():
            typed = float(value) if isinstance(value, int) else value
            refusal = self.home.database.publish("tester", Message(name, typed, now, "tester"), now)
            assert refusal is None, str(refusal)
        return self

    def last(self, name):
        return self.said[name][-1]


def report(name, x, y):
    return f"NAME={name},X={x},Y={y},SPD=1,HDG=0,TIME=0"
