"""pHelmIvP as an app: its block, its files, its community (helm.md 8, 11.5, 13)."""

from __future__ import annotations

from pathlib import Path

import pytest

from ivp_helm.app import Helm
from pymoos_lite.app import AppContext
from pymoos_lite.config.mission import ConfigLine
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.local import LocalConnection
from pymoos_lite.hosts.lockstep import Community, Lockstep

BHV = """
initialize DEPLOY = false
Behavior = BHV_Waypoint
{
  name = far
  condition = DEPLOY = true
  points = 0,1000
  speed = 2
}
"""
BLOCK = "Behaviors = a.bhv\nDomain = course:0:359:360\nDomain = speed:0:4:41\n"
NAV = {"NAV_X": 0.0, "NAV_Y": 0.0, "NAV_HEADING": 0.0, "NAV_SPEED": 1.0}


class Bench:
    """A community with a helm in it, fed by publishing."""

    def __init__(self, folder: Path, block: str = BLOCK, bhv: str = BHV, **mission_globals: str) -> None:
        (folder / "a.bhv").write_text(bhv)
        lines = [
            ConfigLine(key.strip(), value.strip(), number)
            for number, (key, _, value) in enumerate((row.partition("=") for row in block.splitlines()), 1)
        ]
        self.host = Lockstep(seed=1)
        self.community: Community = self.host.add_community("alpha")
        connection = LocalConnection(self.community.database, "pHelmIvP", self.host.clock)
        context = AppContext(
            name="pHelmIvP",
            community="alpha",
            clock=self.host.clock,
            connection=connection,
            lines=lines,
            globals={key.lower(): value for key, value in mission_globals.items()},
            mission_file="a.moos",
            mission_dir=folder,
            seed=1,
            deterministic=True,
        )
        self.runner = self.host.add_app(self.community, Helm, context)
        assert not self.host.failures, self.host.failures

    def say(self, **values: object) -> None:
        now = self.host.clock.now()
        for name, value in values.items():
            self.community.database.publish("test", Message(name, value, now, "test"), now)

    def value(self, name: str) -> object:
        return self.community.database.value(name)

    @property
    def helm(self) -> Helm:
        app = self.community.app("pHelmIvP")
        assert isinstance(app, Helm)
        return app


def test_a_helm_in_a_community_parks_then_drives_and_decides(tmp_path):
    bench = Bench(tmp_path)
    bench.say(**NAV)
    bench.host.run(2)
    assert (bench.value("IVPHELM_STATE"), bench.value("IVPHELM_ALLSTOP")) == ("PARK", "ManualOverride")
    bench.say(MOOS_MANUAL_OVERRIDE="false", DEPLOY="true")
    bench.host.run(1)
    assert (bench.value("IVPHELM_STATE"), bench.value("IVPHELM_ALLSTOP")) == ("DRIVE", "clear")
    assert (bench.value("DESIRED_HEADING"), bench.value("DESIRED_SPEED")) == (0.0, 2.0)


def test_posts_carry_the_iteration_and_the_behaviour_they_come_from(tmp_path):
    bench = Bench(tmp_path, BLOCK + "start_in_drive = true\n")
    bench.say(**NAV, DEPLOY="true")
    bench.host.run(3)
    message = bench.community.database.get("WPT_STAT")
    assert message is not None
    assert message.source == "pHelmIvP"
    iteration, _, name = message.aux.partition(":")
    assert iteration.isdigit()
    assert name == "far"


def test_the_logger_is_asked_to_copy_the_behaviour_file(tmp_path):
    bench = Bench(tmp_path)
    bench.host.run(0.5)
    assert str(bench.value("PLOGGER_CMD")).startswith("COPY_FILE_REQUEST = ")
    assert str(bench.value("PLOGGER_CMD")).endswith("a.bhv")


@pytest.mark.parametrize(
    "line",
    [
        "verbose = quiet",
        "Verbose = terse",
        "bhv_dir_not_found_ok = true",
        "hold_on_apps = pContactMgrV20, uFldNodeBroker",
        "ok_skew = any",
        "app_logging = true",
        "term_report_interval = 0.4",
        "maxapptick = 8",
        "pmgen = alg=dubins # radius=5 # spoke_degs=10",
        "start_in_drive = true",
        "active_start = true",
        "comms_policy = lean",
        "node_skew = ben,20",
        "contact_max_age = 60",
        "Domain = depth:0:100:101:optional",
        "Domain = depth:0:100:delta=0.5",
        "helm_alias = henry",
        "seed_random = false",
    ],
)
def test_every_line_that_stock_blocks_use_is_understood(tmp_path, line):
    bench = Bench(tmp_path, BLOCK + line + "\n")
    assert bench.helm.log.config_warnings == []
    bench.host.run(1)
    assert bench.value("IVPHELM_STATE") != "MALCONFIG"


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("Behaviors = b.bhv", "a.moos:4: error: Could not find File: b.bhv"),
        ("Behaviors = a.bhv", "given twice"),
        ("Domain = course:0:9:10", "given twice"),
        ("Domain = depth:5:0:10", "is above high"),
        (
            "start_in_dirve = true",
            "Unhandled config line: start_in_dirve = true; did you mean 'start_in_drive'?",
        ),
        ("contact_max_age = 5", "contact_max_age = 5 is out of range: give a number in [10, 1800], s"),
        ("ok_skew = never", "ok_skew"),
        ("pmgen = alg=hover", "pmgen"),
        ("ivp_behavior_dir = plugins", "there is no folder"),
        ("standby = 0", "standby"),
    ],
)
def test_a_faulty_block_is_malconfig_with_the_line_and_the_reason(tmp_path, line, words):
    bench = Bench(tmp_path, BLOCK + line + "\n")
    assert any(words in text for text in bench.helm.log.config_warnings), bench.helm.log.config_warnings
    bench.say(**NAV, MOOS_MANUAL_OVERRIDE="false", DEPLOY="true")
    bench.host.run(2)
    assert bench.value("IVPHELM_STATE") == "MALCONFIG"
    assert bench.value("DESIRED_SPEED") is None


def test_several_behaviour_files_are_read_in_the_order_given(tmp_path):
    (tmp_path / "z.bhv").write_text("Behavior = BHV_ConstantSpeed\n{\n name = first\n}\n")
    bench = Bench(tmp_path, "Behaviors = z.bhv\n" + BLOCK)
    assert [life.name for life in bench.helm.core.population] == ["first", "far"]


PLUGIN = '''
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import Peak, couple, zaic_peak


class North(Behavior):
    """Goes north."""

    BHV_NAME = "BHV_North"

    def on_run(self):
        course = zaic_peak(self.domain, "course", Peak(0, 0, 180), wrap=True)
        return couple(course, zaic_peak(self.domain, "speed", Peak(1, 0, 1)))
'''


@pytest.mark.parametrize("where", ["mission folder", "ivp_behavior_dir", "environment"])
def test_a_plug_in_is_found_by_its_name(tmp_path, monkeypatch, where):
    folder = tmp_path if where == "mission folder" else tmp_path / "plugins"
    folder.mkdir(exist_ok=True)
    (folder / "north.py").write_text(PLUGIN)
    if where == "environment":
        monkeypatch.setenv("IVP_BEHAVIOR_DIRS", str(folder))
    line = "ivp_behavior_dir = plugins\n" if where == "ivp_behavior_dir" else ""
    bench = Bench(
        tmp_path, BLOCK + "start_in_drive = true\n" + line, "Behavior = BHV_North\n{\n name = n\n}\n"
    )
    bench.say(**NAV)
    bench.host.run(2)
    assert (bench.value("DESIRED_HEADING"), bench.value("DESIRED_SPEED")) == (0.0, 1.0)


def test_a_broken_plug_in_hurts_only_the_mission_that_uses_it(tmp_path):
    (tmp_path / "broken.py").write_text('BHV_NAME = "BHV_Broken"\nimport nothing_of_that_name\n')
    bench = Bench(tmp_path)
    assert bench.helm.log.config_warnings == []
    bench = Bench(tmp_path, bhv="Behavior = BHV_Broken\n{\n name = b\n}\n")
    warning = bench.helm.log.config_warnings[0]
    assert "broken.py" in warning
    assert "nothing_of_that_name" in warning


def test_the_report_tells_decision_and_reasons_in_plain_words(tmp_path):
    bench = Bench(tmp_path, BLOCK + "start_in_drive = true\n")
    bench.say(**NAV)
    bench.host.run(2)
    text = "\n".join(bench.helm.report())
    assert "because not: DEPLOY = true" in text
    assert "no-decision" in text
    bench.say(DEPLOY="true")
    bench.host.run(1)
    text = "\n".join(bench.helm.report())
    assert "point 1 of 1, 1000 m to go at 2 m/s" in text
    assert "speed = 2" in text


def test_the_check_of_a_block_finds_the_problems_of_its_files_without_running(tmp_path):
    (tmp_path / "a.bhv").write_text("Behavior = BHV_Waypoint\n{\n  name = a\n  sped = 2\n}\n")
    lines = [ConfigLine("Behaviors", "a.bhv", 3), ConfigLine("Domain", "speed:0:4:41", 4)]
    found = Helm.check_block(lines, tmp_path, "a.moos")
    assert [str(p) for p in found] == [
        "a.bhv:4: error: BHV_Waypoint 'a': there is no parameter 'sped'; did you mean 'speed'?"
    ]


def test_two_runs_with_one_seed_post_the_same(tmp_path):
    def run() -> list[object]:
        bench = Bench(
            tmp_path, BLOCK + "start_in_drive = true\n", BHV.replace("speed = 2", "runflag = H=$[HASH]")
        )
        bench.say(**NAV, DEPLOY="true")
        bench.host.run(3)
        return [
            (r.name, r.message.value) for r in bench.community.database.records() if r.message is not None
        ]

    assert run() == run()


@pytest.mark.parametrize(
    ("choice", "listener", "posted"),
    [("auto", False, False), ("auto", True, True), ("never", True, False), ("always", False, True)],
)
def test_functions_are_posted_when_somebody_listens_or_as_told(tmp_path, choice, listener, posted):
    bench = Bench(tmp_path, BLOCK + f"start_in_drive = true\nbhv_ipf = {choice}\n")
    if listener:
        bench.community.database.connect("viewer", bench.host.clock.now())
        bench.community.database.register("viewer", "BHV_IPF", bench.host.clock.now())
    bench.say(**NAV, DEPLOY="true")
    bench.host.run(3)
    assert (bench.value("BHV_IPF") is not None) is posted
