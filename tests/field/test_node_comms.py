"""uFldNodeComms: who hears whom, messages, drops, and what is told of it (marine_apps.md 9)."""

import pytest
from fleet_fixture import Fleet, Listener

from pymoos_lite.core.message import Message
from pymoos_lite.field.comms_rules import parse_factor, parse_range
from pymoos_lite.field.node_comms import NodeComms, parse_sharing
from pymoos_lite.records.node_report import NodeReport
from pymoos_lite.records.view import CommsPulse

DATUM = {"latorigin": "43.8253", "longorigin": "-70.3304"}
QUIET = ("view_node_rpt_pulses", "false")


class Sea:
    """A shoreside with node comms, and vessels that report when told to."""

    def __init__(self, *config, seed=0):
        self.fleet = Fleet(seed)
        self.comms = self.fleet.app("shoreside", NodeComms, "uFldNodeComms", *config, datum=DATUM)
        self.ear = self.fleet.app("shoreside", Listener, "ear", ("hear", "*"))
        self.index = 0
        self.fleet.run(0.1)  # connected

    def report(self, name, x=0.0, y=0.0, **more):
        self.index += 1
        report = NodeReport(
            name=name, x=x, y=y, speed=1.0, heading=90.0, time=self.now, index=self.index, **more
        )
        self.post("NODE_REPORT", report.to_text(), name)

    def post(self, name, value, community="abe"):
        message = Message(name, value, self.now, "pShare", "", community)
        self.fleet.host.communities["shoreside"].database.publish("pShare", message, self.now)

    @property
    def now(self):
        return self.fleet.host.clock.now()

    def run(self, seconds=1.0):
        self.fleet.run(seconds)

    def heard(self, prefix):
        return [m.name for m in self.ear.heard if m.name.startswith(prefix)]

    def clear(self):
        self.ear.heard.clear()


def test_a_report_goes_to_everybody_else_in_range_with_all_that_is_known_filled_in():
    sea = Sea(("comms_range", "100"), QUIET)
    sea.report("abe")
    sea.report("ben", x=60.0)
    sea.report("cal", x=200.0)
    sea.run()
    assert sorted(sea.heard("NODE_REPORT_")) == ["NODE_REPORT_ABE", "NODE_REPORT_BEN"]
    report = NodeReport.parse(next(m.value for m in sea.ear.heard if m.name == "NODE_REPORT_BEN"))
    assert (report.name, report.x, report.y) == ("abe", 0.0, 0.0)
    assert report.lat == pytest.approx(43.8253)
    assert report.cog == 90.0
    assert report.length == 12.0
    assert sea.comms.dropped["report: out of range"] == 4


def test_unknown_fields_of_a_report_are_passed_on():
    sea = Sea(QUIET)
    sea.report("abe", properties=(("ODOMETRY", "47.1"),))
    sea.report("ben")
    sea.run()
    text = next(m.value for m in sea.ear.heard if m.name == "NODE_REPORT_BEN")
    assert text.endswith("ODOMETRY=47.1")


def test_a_report_with_latitude_and_longitude_only_is_placed_by_the_datum():
    sea = Sea(QUIET)
    sea.post("NODE_REPORT", f"NAME=abe,LAT=43.8253,LON=-70.3304,SPD=1,HDG=0,TIME={sea.now}")
    sea.report("ben", x=5.0)
    sea.run()
    report = NodeReport.parse(next(m.value for m in sea.ear.heard if m.name == "NODE_REPORT_BEN"))
    assert (report.x, report.y) == (0.0, 0.0)


def test_within_critical_range_reports_pass_whatever_else_holds():
    sea = Sea(
        ("comms_range", "0"), ("critical_range", "30"), ("groups", "true"), ("drop_percentage", "100"), QUIET
    )
    sea.report("abe", group="red")
    sea.report("ben", x=29.0, group="blue")
    sea.report("cal", x=40.0, group="blue")
    sea.run()
    assert sorted(sea.heard("NODE_REPORT_")) == [
        "NODE_REPORT_ABE",
        "NODE_REPORT_BEN",
        "NODE_REPORT_BEN",
        "NODE_REPORT_CAL",
    ]


@pytest.mark.parametrize(("groups", "same"), [("true", False), ("false", True)])
def test_groups_keep_apart_if_asked_to(groups, same):
    sea = Sea(("groups", groups), QUIET)
    for i, (name, group) in enumerate((("abe", "Red"), ("ben", "red"), ("cal", ""), ("dan", ""))):
        sea.report(name, x=20.0 * i, group=group)
    sea.comms.settings.critical_range = 0.0
    sea.run()
    assert len(sea.heard("NODE_REPORT_")) == (12 if same else 4)


def test_a_silent_vessel_hears_nothing_and_is_forgotten_in_the_end():
    sea = Sea(("stale_time", "5"), ("critical_range", "0"), QUIET)
    sea.report("abe")
    sea.report("ben", x=50.0)
    sea.run(6)
    sea.clear()
    sea.report("abe")
    sea.run()
    assert sea.heard("NODE_REPORT_") == []
    assert sea.comms.dropped["report: stale receiver"] == 1
    sea.run(96)
    assert sea.comms.ledger.names() == ["abe"]


def test_stealth_shortens_and_earange_lengthens_the_reach():
    sea = Sea(
        ("comms_range", "100"),
        ("stealth", "vname=abe,stealth=0.5"),
        ("earange", "vname=ben,earange=1.5"),
        QUIET,
    )
    for x, expected in ((70.0, ["NODE_REPORT_ABE", "NODE_REPORT_BEN"]), (80.0, ["NODE_REPORT_ABE"])):
        sea.clear()
        sea.report("abe")
        sea.report("ben", x=x)
        sea.run()
        assert sorted(sea.heard("NODE_REPORT_")) == expected


def test_reports_between_two_are_thinned_out_if_asked_to():
    sea = Sea(("min_rpt_interval", "2"), ("critical_range", "0"), QUIET)
    for _ in range(40):
        sea.report("abe")
        sea.report("ben", x=50.0)
        sea.run(0.25)
    assert 5 <= len(sea.heard("NODE_REPORT_ABE")) <= 6


def test_drops_are_as_frequent_as_asked_for_and_the_same_whoever_else_sails():
    def fates(names):
        sea = Sea(("drop_percentage", "30"), ("critical_range", "0"), QUIET, seed=5)
        for _ in range(200):
            for i, name in enumerate(names):
                sea.report(name, x=10.0 * i)
            sea.run(0.25)
        times = [m.time for m in sea.ear.heard if m.name == "NODE_REPORT_BEN" and "NAME=abe" in m.value]
        return times, sea.comms.dropped["report: dropped by chance"]

    alone, dropped = fates(["abe", "ben"])
    crowd, _ = fates(["abe", "ben", "cal"])
    assert alone == crowd
    assert dropped / 400 == pytest.approx(0.3, abs=0.06)


def message(source, target, value="hi", **more):
    extra = "".join(f",{k}={v}" for k, v in more.items())
    return f"src_node={source},dest_node={target},var_name=FOO,string_val={value}{extra}"


def crew(*config):
    sea = Sea(("min_msg_interval", "10"), ("comms_range", "100"), QUIET, *config)
    keep(sea)
    return sea


def keep(sea):
    sea.report("abe", group="red")
    sea.report("ben", x=50.0, group="red")
    sea.report("cal", x=80.0, group="blue")
    sea.report("dan", x=300.0, group="blue")
    sea.run()


@pytest.mark.parametrize(
    ("text", "receivers"),
    [
        (message("abe", "ben"), ["BEN"]),
        (message("abe", "BEN"), ["BEN"]),
        (message("abe", "ben:cal:dan:eve"), ["BEN", "CAL"]),
        (message("abe", "all"), ["BEN", "CAL"]),
        (message("abe", "abe"), []),
        (message("abe", "dan"), []),
        ("src_node=abe,dest_group=RED,var_name=X,double_val=3", ["BEN"]),
        ("src_node=abe,dest_node=cal,dest_group=red,var_name=X,double_val=3", ["BEN", "CAL"]),
        ("src_node=zed,dest_node=ben,var_name=X,double_val=3", []),
        ("src_node=abe,var_name=X,double_val=3", []),
        ("nonsense", []),
    ],
)
def test_a_message_reaches_those_it_names_if_they_are_in_range(text, receivers):
    sea = crew()
    sea.post("NODE_MESSAGE", text)
    sea.run()
    assert [name[13:] for name in sea.heard("NODE_MESSAGE_")] == receivers
    assert all(m.value == text for m in sea.ear.heard if m.name.startswith("NODE_MESSAGE_"))


def test_a_vessel_that_sends_too_quickly_is_held_back_even_after_a_blocked_message():
    sea = crew(("max_msg_length", "5"))
    sea.post("NODE_MESSAGE", message("abe", "ben", "too long a text"))
    sea.run(5)
    keep(sea)
    sea.post("NODE_MESSAGE", message("abe", "ben", "ok"))
    sea.run(5)
    keep(sea)
    sea.post("NODE_MESSAGE", message("abe", "ben", "ok"))
    sea.run()
    assert sea.heard("NODE_MESSAGE_BEN") == ["NODE_MESSAGE_BEN"]
    assert sea.comms.dropped["message: too long"] == 1
    assert sea.comms.dropped["message: too quick"] == 1


def test_groups_of_messages_have_a_switch_of_their_own():
    sea = crew(("msg_groups", "true"))
    sea.post("NODE_MESSAGE", message("abe", "all"))
    sea.run()
    assert sea.heard("NODE_MESSAGE_") == ["NODE_MESSAGE_BEN"]
    assert sea.comms.dropped["message: other group"] == 2


def test_a_message_that_wants_an_acknowledgement_is_mediated_and_its_answer_comes_back():
    sea = crew()
    sea.post("MEDIATED_MESSAGE", "ack_id=abe_1,ack=true,src_node=abe,dest_node=ben,var_name=X,double_val=1")
    sea.run()
    assert sea.heard("MEDIATED_MESSAGE_") == ["MEDIATED_MESSAGE_BEN"]
    sea.post("ACK_MESSAGE", "id=abe_1, src=ben, dest=abe")
    sea.run()
    assert sea.heard("ACK_MESSAGE_") == ["ACK_MESSAGE_ABE"]


def test_pulses_show_reports_and_messages():
    sea = Sea(("comms_range", "100"), ("min_msg_interval", "0"), ("pulse_duration", "3"))
    sea.report("abe")
    sea.report("ben", x=80.0)
    sea.run()
    pulses = [CommsPulse.parse(m.value) for m in sea.ear.heard if m.name == "VIEW_COMMS_PULSE"]
    assert {p.label for p in pulses} == {"abe2ben", "ben2abe"}
    assert (pulses[0].beam_width, pulses[0].attributes.duration) == (8.0, 3.0)
    sea.clear()
    text = "ack_id=7," + message("abe", "ben")
    for _ in range(2):
        sea.post("NODE_MESSAGE", text)
        sea.run()
    pulses = [CommsPulse.parse(m.value) for m in sea.ear.heard if m.name == "VIEW_COMMS_PULSE"]
    assert [p.label for p in pulses] == ["abe2benwhite", "abe2benlight_green"]
    assert {(p.pulse_type, p.fill) for p in pulses} == {("msg", 0.6)}


def test_rules_change_at_run_time_and_nonsense_is_warned_of():
    sea = Sea(("critical_range", "0"), QUIET)
    sea.report("abe")
    sea.report("ben", x=500.0)
    sea.run()
    assert sea.heard("NODE_REPORT_") == []
    for name, value in (
        ("UNC_COMMS_RANGE", 800.0),
        ("UNC_STEALTH", "vname=ben,stealth=0.1"),
        ("UNC_DROP_PCT", "0"),
        ("UNC_VIEW_NODE_RPT_PULSES", "true"),
        ("UNC_SHARED_NODE_REPORTS", "true"),
        ("UNC_EARANGE", "vname=nobody,earange=2"),
    ):
        sea.post(name, value, "shoreside")
    sea.run(1)
    sea.clear()
    sea.report("abe")
    sea.report("ben", x=500.0)
    sea.run()
    assert sea.heard("NODE_REPORT_B") == ["NODE_REPORT_BEN"]
    assert sea.heard("NODE_REPORT_A") == []
    assert len(sea.heard("NODE_REPORT_UNC")) == 2
    assert len(sea.heard("VIEW_COMMS_PULSE")) == 1
    assert any("nobody" in w for w in sea.comms.log.run_warnings)


def test_malformed_reports_and_floods_of_messages_are_counted_and_survived():
    sea = crew()
    for text in ("", "junk", "NAME=x", "NAME=y,X=1,Y=1", "{" * 1000, "NAME=z,X=nan,Y=1,SPD=1,HDG=1,TIME=1"):
        sea.post("NODE_REPORT", text)
    for _ in range(5000):
        sea.post("NODE_MESSAGE", message("abe", "ben"))
    sea.run(1)
    dropped = sea.comms.dropped
    assert dropped["report: malformed"] + dropped["report: incomplete"] == 6
    assert dropped["message: flood"] == 4000
    assert dropped["message: too quick"] == 999
    text = "\n".join(sea.comms.report())
    assert "4000  message: flood" in text
    sea.report("abe")
    sea.run()
    assert "NODE_REPORT_BEN" in sea.heard("NODE_REPORT_")


def test_texts_of_parameters_are_checked():
    assert parse_range("nolimit") == parse_range("-1") == float("inf")
    assert parse_range("0") == 0.0
    assert parse_factor("vname=a,stealth=0.01", "stealth", 0.1, 1.0).value == 0.1
    assert [parse_sharing(t) for t in ("true", "false", "2.5")] == [0.1, -1.0, 2.5]
    for parse in (parse_range, parse_sharing, lambda t: parse_factor(t, "stealth", 0.1, 1.0)):
        for text in ("", "far", "nan", "vname=,stealth=1"):
            with pytest.raises(ValueError, match="expected"):
                parse(text)
