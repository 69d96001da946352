"""uFldCollisionDetect: encounters, near misses and collisions, and what is told of them."""

import pytest

from pymoos_lite.app import App, AppContext
from pymoos_lite.config.mission import ConfigLine
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.local import LocalConnection
from pymoos_lite.hosts.lockstep import Lockstep
from pymoos_lite.marine.collision_detect import CollisionDetect
from pymoos_lite.records.node_report import NodeReport


class Field:
    """A shoreside with the referee, and vessels on straight lines."""

    def __init__(self, *config):
        self.host = Lockstep()
        home = self.host.add_community("shoreside")
        self.database = home.database
        self.mail = LocalConnection(self.database, "ear", self.host.clock)
        self.mail.register("*", "*", 0.0, ())
        lines = [ConfigLine(k, v, i) for i, (k, v) in enumerate(config, 1)]
        context = AppContext(
            "uFldCollisionDetect", "shoreside", self.host.clock,
            LocalConnection(self.database, "uFldCollisionDetect", self.host.clock), lines, mission_file="s.moos",
        )  # fmt: skip
        runner = self.host.add_app(home, CollisionDetect, context)
        assert runner is not None, self.host.failures
        self.app: App = runner.app
        self.host.run(0.5)
        self.heard: list[Message] = []

    def report(self, name, x, y, heading=0.0, **more):
        now = self.host.clock.now()
        report = NodeReport(name=name, x=x, y=y, speed=1.0, heading=heading, time=now, **more)
        self.database.publish("x", Message("NODE_REPORT", report.to_text(), now, "x", "", name), now)

    def post(self, name, value):
        now = self.host.clock.now()
        self.database.publish("x", Message(name, value, now, "x", "", "shoreside"), now)

    def pass_by(self, miss, names=("abe", "ben"), **more):
        """Two vessels pass each other at `miss` metres, the first northwards, the second southwards."""
        for i in range(120):
            along = -30.0 + 0.5 * i
            self.report(names[0], 0.0, along, 0.0, **more)
            self.report(names[1], miss, -along, 180.0, **more)
            self.host.run(0.5)
        self.heard += self.mail.take_mail()
        return self

    def values(self, name):
        return [m.value for m in self.heard if m.name == name]


QUIET = (("encounter_rings", "false"),)


@pytest.mark.parametrize(
    ("miss", "rank", "totals"),
    [
        (2.0, "collision", (1, 0, 1)),
        (5.0, "near_miss", (1, 1, 0)),
        (15.0, "clear", (1, 0, 0)),
        (25.0, None, (0, 0, 0)),
    ],
)
def test_a_passing_is_ranked_by_its_least_range(miss, rank, totals):
    field = Field(*QUIET, ("report_all_encounters", "true")).pass_by(miss)
    names = ("ENCOUNTER_TOTAL", "NEAR_MISS_TOTAL", "COLLISION_TOTAL")
    assert tuple(field.values(name)[-1] for name in names) == totals
    assert [field.values(name)[0] for name in names] == [0.0, 0.0, 0.0]
    reports = field.values("UCD_REPORT")
    if rank is None:
        assert reports == []
    else:
        # The first of the two is whoever was heard first when they came near each other.
        assert reports[0].startswith(f"cpa={miss:g},vname1=ben,vname2=abe,rank={rank},")
        assert "ptype=star:star" in reports[0]


def test_clear_encounters_are_counted_but_only_reported_if_asked_for():
    field = Field(*QUIET).pass_by(15.0)
    assert field.values("ENCOUNTER_TOTAL")[-1] == 1.0
    assert field.values("UCD_REPORT") == []


def test_every_passing_of_the_same_two_counts():
    field = Field(*QUIET).pass_by(5.0).pass_by(2.0).pass_by(5.0)
    assert (field.values("NEAR_MISS_TOTAL")[-1], field.values("COLLISION_TOTAL")[-1]) == (2.0, 1.0)


def test_flags_are_posted_with_their_macros():
    field = Field(
        *QUIET,
        ("encounter_flag", "MET_$UP_V1=$V2 at $CPA, $[V1@100] near"),
        ("near_miss_flag", "CLOSE=$CPA"),
        ("collision_flag", "NUMBER=$IDX"),
    )
    field.report("cal", 50.0, 0.0)
    field.pass_by(5.0).pass_by(2.0)
    assert field.values("MET_BEN") == ["abe at 5, 2 near", "abe at 2, 2 near"]
    assert field.values("CLOSE") == [5.0]
    assert field.values("NUMBER") == [2.0]


def test_nothing_counts_while_a_condition_does_not_hold():
    field = Field(*QUIET, ("condition", "DEPLOY_ALL = true")).pass_by(5.0)
    assert field.values("ENCOUNTER_TOTAL") == [0.0]
    field.post("DEPLOY_ALL", "true")
    assert field.pass_by(5.0).values("ENCOUNTER_TOTAL") == [0.0, 1.0]
    assert "1 while a condition did not hold" in "\n".join(field.app.report())


def test_groups_are_ignored_together_or_rejected_alone():
    assert Field(*QUIET, ("ignore_group", "red")).pass_by(5.0, group="Red").values("ENCOUNTER_TOTAL") == [0.0]
    assert Field(*QUIET, ("ignore_group", "blue")).pass_by(5.0, group="red").values("ENCOUNTER_TOTAL") == [
        0.0,
        1.0,
    ]
    field = Field(*QUIET, ("reject_group", "red")).pass_by(5.0, group="red")
    assert field.values("ENCOUNTER_TOTAL") == [0.0]
    assert len(field.app.ledger) == 0


def test_ranges_out_of_order_are_raised_with_a_warning():
    field = Field(*QUIET, ("collision_range", "9"), ("encounter_range", "4"))
    assert field.app.ranks.near_miss == field.app.ranks.encounter == 9.0
    assert any("raised to 9 and 9" in w for w in field.app.log.config_warnings)
    text = field.database.value("COLLISION_DETECT_PARAMS")
    assert text == "collision_range=9, near_miss_range=9, encounter_range=9"


def test_viewers_get_rings_and_pulses():
    field = Field(("pulse_range", "25")).pass_by(5.0)
    assert "label=aberng" in field.values("VIEW_CIRCLE")[0]
    (pulse,) = field.values("VIEW_RANGE_PULSE")
    assert "radius=25" in pulse
    assert "edge_color=yellow" in pulse
    assert field.values("COLLISION_DETECT_PARAMS_ABE") == [
        "collision_range=3, near_miss_range=6, encounter_range=20"
    ]


def test_the_closest_range_is_posted_and_reset():
    field = Field(*QUIET, ("post_closest_range", "true"), ("post_closest_range_ever", "true")).pass_by(5.0)
    assert min(field.values("UCD_CLOSEST_RANGE")) == pytest.approx(5.0, abs=0.1)
    assert field.values("UCD_CLOSEST_RANGE_EVER")[-1] == pytest.approx(5.0, abs=0.1)
    field.heard.clear()
    field.post("UCD_RESET", "true")
    field.pass_by(12.0)
    assert field.values("UCD_CLOSEST_RANGE_EVER")[-1] == pytest.approx(12.0, abs=0.1)


def test_malformed_reports_are_counted_and_a_silent_vessel_is_forgotten():
    field = Field(*QUIET)
    for text in ("", "junk", "NAME=x", "NAME=x,X=1,Y=nan,TIME=1"):
        field.post("NODE_REPORT", text)
    field.report("abe", 0.0, 0.0)
    field.host.run(5.0)
    assert field.app.dropped["unusable"] == 4
    assert field.app.ledger.names() == ["abe"]
    field.host.run(130.0)
    assert field.app.ledger.names() == []
