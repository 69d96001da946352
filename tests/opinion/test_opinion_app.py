"""pOpinionManager in lockstep communities."""

import pytest

from opinion_engine.app import OpinionManager
from pymoos_lite.app import AppContext
from pymoos_lite.config.mission import ConfigLine
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.local import LocalConnection
from pymoos_lite.hosts.lockstep import Lockstep
from pymoos_lite.records.node_message import NodeMessage

OPTIONS = "".join(
    f"""social_option
{{
  name = {name}
  active_condition = DEPLOY=true
  option_output = OPTION={name.upper()}
  social_mode = custom
  input = {name}_input
  input_function_type = none
  input_min = -100
  resistance_weight = 0.25
  intra_agent_same_option_coupling = {alpha}
  inter_agent_same_option_coupling = {gamma}
  inter_agent_inter_option_coupling = {other} = {delta}
  input_gain = {gain}
}}
"""
    for name, alpha, gamma, other, delta, gain in (
        ("exploit", 0.05, -0.05, "explore", 0.01, 1),
        ("explore", 0.05, -0.05, "exploit", 0.01, 1),
        ("migrate", 1.0, 8.0, "explore", 0.0, 40),
    )
)
SETTINGS = {
    "option_file": "fleet.opt",
    "AppTick": "4",
    "tau_u": "4",
    "min_attention": "0.5",
    "max_attention": "2",
    "u_th": "2000",
}


class Fleet:
    """Vessels whose opinion messages reach each other at once, in both forms."""

    def __init__(self, folder, names, **extra):
        (folder / "fleet.opt").write_text(OPTIONS)
        self.host = Lockstep(seed=1)
        self.watch = {}
        self.apps = {}
        lines = [ConfigLine(k, v, i) for i, (k, v) in enumerate({**SETTINGS, **extra}.items(), 1)]
        for name in names:
            home = self.host.add_community(name)
            watch = LocalConnection(home.database, "watch", self.host.clock)
            for variable in ("*",):
                watch.register(variable, "*", 0.0, ())
            self.watch[name] = watch
            context = AppContext(
                "pOpinionManager",
                name,
                self.host.clock,
                LocalConnection(home.database, "pOpinionManager", self.host.clock),
                lines,
                mission_dir=folder,
                mission_file="m.moos",
                seed=1,
            )
            runner = self.host.add_app(home, OpinionManager, context)
            self.apps[name] = runner.app if runner else None
        self.posts = {name: [] for name in names}

    def post(self, name, variable, value):
        now = self.host.clock.now()
        self.watch[name].publish(Message(variable, value, now, "watch", "", name))

    def run(self, seconds, cut=()):
        for _ in range(round(seconds * 4)):
            self.host.run(0.25)
            for name, watch in self.watch.items():
                for message in watch.take_mail():
                    self.posts[name].append(message)
                    self.forward(name, message, cut)

    def forward(self, name, message, cut):
        now = self.host.clock.now()
        if name in cut:
            return
        if message.name == "NODE_MESSAGE_LOCAL":
            envelope = NodeMessage.parse(message.value)
            message = Message(envelope.var_name, envelope.value, now, "pNodeMsgs", "", name)
        elif message.name == "OPINION_MESSAGE_LOCAL":
            message = message._replace(name="OPINION_MESSAGE")
        else:
            return
        for other, watch in self.watch.items():
            if other != name and other not in cut:
                watch.publish(message._replace(time=now))

    def values(self, name, variable):
        return [m.value for m in self.posts[name] if m.name == variable]


@pytest.mark.parametrize("encoding", ["text", "i8", "f32"])
def test_one_vessel_s_storm_makes_the_fleet_migrate(tmp_path, encoding):
    fleet = Fleet(tmp_path, ["abe", "ben", "cal"], encoding=encoding)
    for name in fleet.apps:
        fleet.post(name, "DEPLOY", "true")
        fleet.post(name, "EXPLORE_INPUT", 60.0)
    fleet.run(20)
    assert {n: fleet.values(n, "OPTION") for n in fleet.apps} == {n: ["EXPLORE"] for n in fleet.apps}
    assert fleet.values("abe", "EXPLORE_LIST")[-1] == "ben,cal"
    fleet.post("abe", "MIGRATE_INPUT", 100.0)
    fleet.run(60)
    assert all(fleet.values(n, "OPTION") == ["EXPLORE", "MIGRATE"] for n in fleet.apps)
    assert fleet.values("ben", "MIGRATE_LIST")[-1] == "abe,cal"
    assert fleet.values("ben", "OWN_ATTENTION")[-1] > 1.0
    assert fleet.values("ben", "OWN_OPINION_STATE")[-1].startswith("ben:leader:exploit=-")
    rate = fleet.apps["abe"].engine.bytes_per_second(fleet.host.clock.now())
    assert rate == pytest.approx({"text": 60, "i8": 3, "f32": 12}[encoding], rel=0.1)


def test_the_envelope_has_the_fields_in_the_known_order(tmp_path):
    fleet = Fleet(tmp_path, ["abe"])
    fleet.post("abe", "DEPLOY", "true")
    fleet.run(3)
    text = fleet.values("abe", "OWN_OPINION_STATE")[-1]
    assert fleet.values("abe", "NODE_MESSAGE_LOCAL")[-1] == (
        "src_node=abe,dest_node=all,src_app=OpinionManager,var_name=OPINION_MESSAGE,color=off,string_val="
        + text
    )
    grouped = Fleet(tmp_path, ["abe"], node_message_dest_group="red", node_message_color="green")
    grouped.post("abe", "DEPLOY", "true")
    grouped.run(3)
    assert grouped.values("abe", "NODE_MESSAGE_LOCAL")[-1].startswith(
        "src_node=abe,dest_group=red,src_app=OpinionManager,var_name=OPINION_MESSAGE,color=green,string_val=abe:"
    )


def test_a_vessel_that_is_not_deployed_says_nothing_but_keeps_its_lists(tmp_path):
    fleet = Fleet(tmp_path, ["abe", "ben"])
    fleet.post("ben", "DEPLOY", "true")
    fleet.post("ben", "EXPLORE_INPUT", 60.0)
    fleet.run(10)
    assert fleet.values("abe", "NODE_MESSAGE_LOCAL") == []
    assert fleet.values("abe", "EXPLORE_LIST") == ["ben"]
    fleet.run(5, cut=["ben"])
    assert fleet.values("abe", "EXPLORE_LIST") == ["ben", ""]


def test_a_reset_silences_the_app_for_five_seconds_and_posts_the_choice_again(tmp_path):
    fleet = Fleet(tmp_path, ["abe"])
    fleet.post("abe", "DEPLOY", "true")
    fleet.post("abe", "EXPLORE_INPUT", 60.0)
    fleet.run(10)
    before = len(fleet.values("abe", "OWN_ATTENTION"))
    fleet.post("abe", "RESET_OPINIONS", "yes")
    fleet.run(4.5)
    assert len(fleet.values("abe", "OWN_ATTENTION")) == before
    fleet.run(5)
    assert fleet.values("abe", "OPTION") == ["EXPLORE", "EXPLORE"]


def test_bad_mail_is_a_run_warning_and_changes_nothing(tmp_path):
    fleet = Fleet(tmp_path, ["abe"])
    app = fleet.apps["abe"]
    fleet.post("abe", "DEPLOY", "true")
    fleet.run(1)
    mail = [("EXPLORE_INPUT", v) for v in ("north", float("nan"), b"\x00")]
    mail += [("OPINION_MESSAGE", v) for v in ("nonsense", 3.0, b"1234567")] + [
        ("PROPOSAL_MESSAGE", "anything")
    ]
    app.on_mail([Message(name, value, app.now, "x", "", "ben") for name, value in mail])
    fleet.run(5)
    assert app.engine.inputs == (0.0, 0.0, 0.0)
    assert app.engine.counters.rejected == 3
    assert app.log.run_warnings_total == 2
    assert not fleet.host.failures


def test_the_report_shows_opinions_neighbours_and_lists(tmp_path):
    fleet = Fleet(tmp_path, ["abe", "ben"])
    for name in fleet.apps:
        fleet.post(name, "DEPLOY", "true")
        fleet.post(name, "EXPLORE_INPUT", 60.0)
    fleet.post("abe", "OPINION_MESSAGE", "bad")
    fleet.run(10)
    report = "\n".join(fleet.apps["abe"].report())
    for expected in ("model paper", "explore          abe, ben", "Row sum", "B/s as text", "1 damaged"):
        assert expected in report, expected
    assert any(row.startswith("ben ") and "ben:leader:" in row for row in report.splitlines())


@pytest.mark.parametrize(
    ("extra", "reason"),
    [
        ({"option_file": "missing.opt"}, "missing.opt: cannot open"),
        ({"numerical_int_gain": "2"}, "numerical_int_gain has no place"),
        ({"min_attention": "3"}, "u_max is 2, expected at least u_min, 3"),
        ({"group": "a:b"}, "group 'a:b'"),
    ],
)
def test_a_bad_configuration_refuses_to_start_with_one_line(tmp_path, extra, reason):
    fleet = Fleet(tmp_path, ["abe"], **extra)
    assert fleet.apps["abe"] is None
    (failure,) = fleet.host.failures
    assert reason in str(failure)


def test_the_reference_accepts_its_dead_gain(tmp_path):
    assert Fleet(tmp_path, ["abe"], numerical_int_gain="2", model="reference").apps["abe"] is not None
