"""Small fleets in lockstep: a shoreside and vehicles made of the field apps and two test apps."""

from pymoos_lite.app import App, AppContext
from pymoos_lite.config.mission import ConfigLine
from pymoos_lite.core.message import Message
from pymoos_lite.field.host_info import HostInfo
from pymoos_lite.field.node_broker import NodeBroker
from pymoos_lite.field.share import ShareApp
from pymoos_lite.field.shore_broker import ShoreBroker
from pymoos_lite.hosts.local import LocalConnection
from pymoos_lite.hosts.lockstep import Lockstep
from pymoos_lite.hosts.network import SimulatedNetwork


class Talker(App):
    """Posts REPORT (text) and COUNT (number) once per tick."""

    DEFAULT_TICK = 2.0

    def iterate(self):
        self.notify("REPORT_LOCAL", f"name={self.community},index={self.iteration}")
        self.notify("COUNT", float(self.iteration))


class Listener(App):
    """Keeps all mail of the variables in its config block's `hear` lines."""

    DEFAULT_TICK = 4.0

    def on_connect(self):
        self.heard: list[Message] = []
        for line in self.context.lines:
            self.register(line.value)

    def on_mail(self, mail):
        self.heard += mail

    def values(self, name):
        return [m.value for m in self.heard if m.name == name]


def config_lines(*pairs):
    return [ConfigLine(key, value, number) for number, (key, value) in enumerate(pairs, start=1)]


class Fleet:
    """A lockstep host with helpers to start and kill communities."""

    def __init__(self, seed=0, by_reference=True):
        self.host = Lockstep(seed)
        self.host.network = SimulatedNetwork(self.host.clock, seed, by_reference=by_reference)

    def app(self, community, cls, name, *pairs, port_db=9000, datum=None):
        host = self.host
        home = host.communities.get(community) or host.add_community(community)
        context = AppContext(
            name,
            community,
            host.clock,
            LocalConnection(home.database, name, host.clock),
            config_lines(*pairs),
            globals={"serverport": str(port_db), **(datum or {})},
            mission_file=f"{community}.moos",
            seed=host.seed,
            deterministic=True,
            network=host.network.member(community, name),
        )
        runner = host.add_app(home, cls, context)
        assert runner is not None, host.failures
        return runner.app

    def shore(self, *broker, port=9200, share=(), hear=("REPORT", "COUNT", "PSHARE_OUTPUT_SUMMARY")):
        self.app("shoreside", ShareApp, "pShare", ("input", f"route=localhost:{port}"), *share)
        self.app("shoreside", HostInfo, "pHostInfo")
        broker = broker or (("qbridge", "DEPLOY, RETURN"), ("bridge", "src=LOW_$v, alias=LOW"))
        self.app("shoreside", ShoreBroker, "uFldShoreBroker", *broker)
        return self.app("shoreside", Listener, "listener", *(("hear", name) for name in hear))

    def vehicle(
        self, name, port, *broker, shore="localhost:9200", share=(), hear=("DEPLOY", "RETURN", "LOW")
    ):
        self.app(name, ShareApp, "pShare", ("input", f"route=localhost:{port}"), *share, port_db=port - 200)
        self.app(name, HostInfo, "pHostInfo", port_db=port - 200)
        broker = broker or (("bridge", "src=REPORT_LOCAL, alias=REPORT"), ("bridge", "src=COUNT"))
        self.app(name, NodeBroker, "uFldNodeBroker", ("try_shore_host", f"pshare_route={shore}"), *broker)
        self.app(name, Talker, "talker")
        return self.app(name, Listener, "listener", *(("hear", variable) for variable in hear))

    def run(self, seconds):
        self.host.run(seconds)
        assert not self.host.failures, [f.trace for f in self.host.failures]

    def post(self, community, name, value):
        self.host.poke(self.host.elapsed, name, value, community)

    def value(self, community, name):
        return self.host.communities[community].database.value(name)

    def get(self, community, app):
        return self.host.communities[community].app(app)
