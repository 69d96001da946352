"""The app life cycle as seen by an app author, in the lockstep host."""

import pytest

from pymoos_lite.app import App, AppContext
from pymoos_lite.config.mission import ConfigLine
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.hosts.local import LocalConnection
from pymoos_lite.hosts.lockstep import Lockstep
from pymoos_lite.records.appcast import AppCast


def start(host, cls, name="pTest", lines=(), community="alpha"):
    if community not in host.communities:
        host.add_community(community)
    home = host.communities[community]
    context = AppContext(
        name,
        community,
        host.clock,
        LocalConnection(home.database, name, host.clock),
        [ConfigLine(k, v, i + 1) for i, (k, v) in enumerate(lines)],
        mission_file="m.moos",
        seed=host.seed,
        deterministic=True,
    )
    return host.add_app(home, cls, context)


class Recorder(App):
    """Writes down its life."""

    DEFAULT_TICK = 2.0
    PARAMETERS = Declaration((Parameter("depth", "number", 5.0, "m", low=0.0),))

    def __init__(self, context):
        super().__init__(context)
        self.life = []

    def on_start_up(self):
        self.life.append("start")

    def on_connect(self):
        self.life.append("connect")
        self.register("X")

    def on_mail(self, mail):
        self.life.append([m.value for m in mail])

    def iterate(self):
        self.life.append(self.now - self.started)

    def on_quit(self):
        self.life.append("quit")

    def report(self):
        return ["two", "lines"]


def test_an_app_starts_connects_hears_mail_iterates_and_quits():
    host = Lockstep(seed=1)
    runner = start(host, Recorder)
    database = host.communities["alpha"].database
    host.run(0.75)
    for value in (1.0, 2.0):
        runner.app.notify("X", value)
    host.run(0.5)
    host.stop()
    assert runner.app.life == ["start", "connect", 0.0, 0.5, [1.0, 2.0], 1.0, "quit"]
    assert database.clients() == []


def test_app_tick_sets_the_rate_and_parameters_are_bound():
    host = Lockstep()
    runner = start(host, Recorder, lines=[("AppTick", "10"), ("depth", "7.5")])
    host.run(10.0)
    assert runner.app.iteration == 100
    assert runner.app.config.depth == 7.5


def test_bad_parameters_are_config_warnings_with_file_and_line():
    host = Lockstep()
    runner = start(host, Recorder, lines=[("dept", "3"), ("depth", "-1")])
    warnings = runner.app.log.config_warnings
    assert any(w.startswith("m.moos:1:") and "did you mean 'depth'" in w for w in warnings)
    assert any(w.startswith("m.moos:2:") and "at least 0" in w for w in warnings)
    assert runner.app.config.depth == 5.0


def test_a_requested_report_is_cast_and_an_unrequested_one_is_not():
    host = Lockstep()
    runner = start(host, Recorder)
    listener = LocalConnection(host.communities["alpha"].database, "uMAC", host.clock)
    listener.register("APPCAST", "*", 0.0, ())
    host.run(5.0)
    listener.take_mail()
    host.run(5.0)
    assert listener.take_mail() == []
    request = "node=alpha,app=pTest,duration=3,key=uMAC:app,thresh=any"
    host.poke(host.elapsed, "APPCAST_REQ", request)
    runner.app.run_warning("low battery")
    runner.app.run_warning("low battery")
    host.run(10.0)
    casts = [AppCast.parse(m.value) for m in listener.take_mail()]
    assert casts[0].proc == "pTest"
    assert casts[0].messages == ("two", "lines")
    assert casts[0].run_warnings == (("low battery", 2),)
    assert 5 <= len(casts) <= 7


def test_status_says_what_the_app_publishes_and_hears():
    host = Lockstep()
    runner = start(host, Recorder)
    host.run(1.0)
    runner.app.notify("OUT", 1.0)
    host.run(2.5)
    status = host.communities["alpha"].database.value("PTEST_STATUS")
    assert status.startswith("AppErrorFlag=false,Uptime=2,cpuload=0,")
    assert "MOOSName=pTest" in status
    assert 'Publishing="PTEST_STATUS,' in status
    assert ",OUT," in status
    assert status.endswith('Subscribing="APPCAST_REQ,LOADCAST_REQ,X,"')


def test_load_is_reported_while_requested():
    host = Lockstep()
    start(host, Recorder)
    host.poke(1.0, "LOADCAST_REQ", "app=pTest,thresh=any,duration=4")
    host.run(10.0)
    database = host.communities["alpha"].database
    assert database.value("PTEST_ITER_GAP") == pytest.approx(1.0)
    assert database.value("PTEST_ITER_LEN") == pytest.approx(0.0)
    assert database.get("PTEST_ITER_GAP").time - host.clock.start < 6.0


def test_a_wrong_typed_post_is_refused_and_said():
    host = Lockstep()
    runner = start(host, Recorder)
    assert runner.app.notify("N", 1.0)
    assert not runner.app.notify("N", "text")
    host.run(1.0)
    assert any("N, which holds a double" in w for w in runner.app.log.run_warnings)


def test_an_app_that_raises_is_reported_and_takes_nobody_else_down():
    class Broken(App):
        def iterate(self):
            if self.iteration == 3:
                raise RuntimeError("no more fuel")

    host = Lockstep()
    start(host, Broken, "pBroken")
    other = start(host, Recorder, "pOther")
    host.run(10.0)
    assert [f.app for f in host.failures] == ["pBroken"]
    assert "no more fuel" in str(host.failures[0])
    assert "test_runner.py:" in str(host.failures[0])
    assert other.app.iteration == 20
    assert host.communities["alpha"].database.clients() == ["pOther"]


@pytest.mark.parametrize(("mode", "rate"), [("1", 4.0), ("2", 1.0)])
def test_mail_driven_modes_hear_mail_before_the_next_tick(mode, rate):
    class Talker(App):
        DEFAULT_TICK = 4.0

        def iterate(self):
            self.notify("X", self.now)

    host = Lockstep()
    lines = [("AppTick", "1"), ("IterateMode", mode), ("MaxAppTick", "20")]
    listener = start(host, Recorder, "pListener", lines)
    start(host, Talker, "pTalker")
    host.run(10.0)
    heard = [v for entry in listener.app.life if isinstance(entry, list) for v in entry]
    assert len(heard) == 40
    assert listener.app.iteration / 10.0 == pytest.approx(rate, rel=0.15)


def test_random_numbers_follow_the_seed_and_the_app():
    draws = []
    for seed in (1, 1, 2):
        host = Lockstep(seed=seed)
        one, two = start(host, Recorder, "pOne"), start(host, Recorder, "pTwo")
        draws.append((one.app.random.random(), two.app.random.random()))
    assert draws[0] == draws[1] != draws[2]
    assert draws[0][0] != draws[0][1]


def test_a_flood_of_appcast_keys_stays_bounded():
    host = Lockstep()
    runner = start(host, Recorder)
    for i in range(500):
        host.poke(1.0, "APPCAST_REQ", f"node=all,app=all,duration=30,key=k{i},thresh=any")
    host.run(5.0)
    assert len(runner._requests) <= 100
