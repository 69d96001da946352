"""The base of contact behaviours: whom they follow, what they say about it, when they end (behaviors.md B4)."""

from __future__ import annotations

import pytest

from ivp_helm.bearing_line import parse_bearing_line
from ivp_helm.contact_behavior import ContactBehavior, graded
from ivp_helm.ivp import IvPFunction, Peak, zaic_peak
from ivp_helm.testing import HelmRig
from pymoos_lite.geometry.encounter import RelativeState


class KeepAway(ContactBehavior):
    """Heads straight away from a contact nearer than 100 m."""

    BHV_NAME = "BHV_KeepAway"
    VARIABLES = ("course",)

    def look(self, meeting: RelativeState) -> None:
        self.post("SEEN", meeting.range, repeat=True)

    def decide(self, meeting: RelativeState) -> IvPFunction | None:
        self.relevance = graded(meeting.range, 20.0, 100.0)
        return zaic_peak(self.domain, "course", Peak(meeting.engine.bng_cn_os, 0, 180))

    def alert_ranges(self) -> tuple[float, float]:
        return 100.0, 150.5


def ben(x=0.0, y=50.0, heading=180.0, speed=1.0, **more):
    return {"name": "ben", "x": x, "y": y, "heading": heading, "speed": speed, **more}


def rig(*flags: str, contact=None, **parameters) -> HelmRig:
    lines = [("name", "away"), ("contact", "ben"), *parameters.items(), *(("cnflag", flag) for flag in flags)]
    helm = HelmRig([(KeepAway, lines)], domain=("course:0:359:360",))
    helm.own(0, 0, 0, 1)
    helm.contacts([contact or ben()])
    return helm


def sail(helm: HelmRig, *places: float) -> None:
    """One iteration with ben at each place: metres ahead of own ship, negative astern."""
    for place in places:
        helm.contacts([ben(x=5.0, y=place)])
        helm.iterate()


def test_a_known_contact_is_decided_upon():
    helm = rig()
    helm.iterate()
    assert helm.decision == {"course": 180.0}
    assert helm.outcome("away").function.weight == pytest.approx(62.5)
    assert helm.posted("SEEN") == [50.0]


def test_an_unknown_contact_is_a_warning_that_ends_when_it_is_heard():
    helm = rig()
    helm.contacts([])
    helm.iterate()
    assert helm.reason == "NothingToDo"
    assert helm.posted("BHV_WARNING") == ["away: ben x/y/heading/speed info not found"]
    helm.contacts([ben()])
    helm.iterate()
    assert helm.reason == "clear"
    assert [note.kind for note in helm.core.take_notes() if "not found" in note.text] == [
        "warning",
        "retract",
    ]


def test_an_unknown_contact_is_complained_of_once_while_idle_and_always_while_running():
    helm = rig(condition="DEPLOY = true")
    helm.contacts([])
    helm.iterate(3)
    assert len(helm.posted("BHV_WARNING")) == 1
    helm.mail("DEPLOY", "true")
    helm.iterate(3)
    assert len(helm.posted("BHV_WARNING")) == 4


def test_an_unknown_contact_stops_the_vehicle_where_the_mission_says_so():
    helm = rig(on_no_contact_ok="false")
    helm.contacts([])
    helm.iterate()
    assert helm.reason == "BehaviorError"


def test_a_contact_that_may_be_unset_is_no_reason_to_complain():
    helm = rig(contact=ben())
    helm.core.population.lives[0].behavior.set_parameter("contact", "unset_ok")
    helm.iterate(3)
    assert helm.posted("BHV_WARNING") == []
    assert helm.reason == "NothingToDo"


def test_contacts_are_not_extrapolated():
    helm = rig(contact=ben(report_age=8.0, speed=5.0))
    helm.iterate()
    assert helm.posted("SEEN") == [50.0]


@pytest.mark.parametrize(
    ("flag", "places", "wanted"),
    [
        ("@<30 HIT=$[CN_RANGE]", [40, 31, 29, 20, 40, 28], [29.4, 28.4]),
        ("@>30 HIT=$[CN_RANGE]", [20, 31, 50, 10, 60], [31.4, 60.2]),
        ("<30 HIT=$[RANGE]", [40, 29, 20], [29.4, 20.6]),
        (">30 HIT=$[RANGE]", [40, 29, 35], [40.3, 35.4]),
        ("@cpa HIT=$[CN_RANGE]", [20, 15, 10, 5, 1, 0, -1, -5, -9], [7.1]),
        ("@os_passed_cn HIT=$[CN_NAME]", [3, 1, -1, -3], ["ben"]),
        ("@os_passed_cn_port HIT=$[CN_NAME]", [3, 1, -1, -3], []),
        ("@os_passed_cn_star HIT=$[CN_NAME]", [3, 1, -1, -3], ["ben"]),
        ("@cn_passed_os HIT=$[CN_NAME]", [3, 1, -1, -3], ["ben"]),
        ("@<30 HIT=yes [if] WANTED = true", [40, 29], []),
    ],
)
def test_contact_flags_are_posted_at_their_moments(flag, places, wanted):
    helm = rig(flag)
    sail(helm, *places)
    assert helm.posted("HIT") == wanted


def test_contact_flags_go_to_other_vessels_where_they_say_so():
    helm = rig("@<30 #all HIT=$[CN_NAME]")
    sail(helm, 40, 29)
    assert helm.posted("HIT") == []
    (message,) = helm.posted("NODE_MESSAGE_LOCAL")
    assert "dest_node=all" in message
    assert "var_name=HIT" in message


def test_contact_flags_are_posted_while_idle():
    helm = rig("@<30 HIT=1", condition="DEPLOY = true")
    sail(helm, 40, 29)
    assert helm.outcome("away").state == "idle"
    assert helm.posted("HIT") == [1.0]


@pytest.mark.parametrize("flag", ["HIT=1", "@sometimes HIT=1", "@<x HIT=1", "@cpa HIT"])
def test_a_contact_flag_without_a_moment_is_a_mistake_in_the_mission(flag):
    helm = HelmRig(
        [(KeepAway, [("contact", "ben"), ("cnflag", flag)])], domain=("course:0:359:360",), faulty=True
    )
    assert helm.core.authority.malconfig


def test_macros_tell_the_encounter():
    names = ["CNX", "CNY", "CNH", "CNV", "CN_NAME", "CN_VTYPE", "CN_GROUP", "CN_RANGE", "ROC"]
    names += ["OS_CN_REL_BNG", "CN_OS_REL_BNG", "BNG_RATE"]
    names += ["CN_SPD_IN_OS_POS", "OS_FORE_OF_CN", "OS_AFT_OF_CN", "CN_FORE_OF_OS", "CN_AFT_OF_OS"]
    helm = rig("<100 M=" + "|".join(f"$[{name}]" for name in names))
    helm.iterate()
    (text,) = helm.posted("M")
    told = dict(zip(names, text.split("|"), strict=True))
    assert told == {
        "CNX": "0",
        "CNY": "50",
        "CNH": "180",
        "CNV": "1",
        "CN_NAME": "ben",
        "CN_VTYPE": "kayak",
        "CN_GROUP": "",
        "CN_RANGE": "50",
        "ROC": "2",
        "OS_CN_REL_BNG": "0",
        "CN_OS_REL_BNG": "0",
        "BNG_RATE": "0",
        "CN_SPD_IN_OS_POS": "1",
        "OS_FORE_OF_CN": "true",
        "OS_AFT_OF_CN": "false",
        "CN_FORE_OF_OS": "true",
        "CN_AFT_OF_OS": "false",
    }


def test_port_and_starboard_are_told_from_either_vessel():
    helm = rig("<100 M=$[OS_PORT_OF_CN] $[OS_STAR_OF_CN] $[CN_PORT_OF_OS] $[CN_STAR_OF_OS]")
    helm.contacts([ben(x=30.0, y=30.0, heading=270.0)])
    helm.iterate()
    assert helm.posted("M") == ["true false false true"]


@pytest.mark.parametrize(
    ("parameters", "exits"),
    [
        ({"match_type": "kayak", "exit_on_filter_vtype": "true"}, False),
        ({"match_type": "KAYAK, ship", "exit_on_filter_vtype": "true"}, False),
        ({"match_type": "{heron,ship}", "exit_on_filter_vtype": "true"}, True),
        ({"match_type": "heron"}, False),
        ({"ignore_type": "kayak", "exit_on_filter_vtype": "true"}, True),
        ({"ignore_group": "red", "exit_on_filter_group": "true"}, True),
        ({"ignore_group": "red", "strict_ignore": "false", "exit_on_filter_group": "true"}, False),
        ({"match_region": "pts={-9,0:9,0:9,60:-9,60}", "exit_on_filter_region": "true"}, False),
        ({"ignore_region": "pts={-9,0:9,0:9,60:-9,60}", "exit_on_filter_region": "true"}, True),
    ],
)
def test_a_behaviour_ends_when_its_contact_no_longer_passes_the_filter(parameters, exits):
    helm = rig(endflag="GONE=$[CNY]", **parameters)
    helm.iterate(2)
    assert helm.posted("GONE") == ([50.0] if exits else [])
    assert len(helm.core.population.lives) == (0 if exits else 1)


def test_a_word_cannot_be_both_matched_and_ignored():
    lines = [("contact", "ben"), ("match_type", "kayak"), ("ignore_type", "heron,Kayak")]
    helm = HelmRig([(KeepAway, lines)], domain=("course:0:359:360",), faulty=True)
    assert "kayak" in str(helm.core.problems[0])


def test_the_post_mortem_says_how_far_off_the_contact_was():
    helm = rig(match_type="heron", exit_on_filter_vtype="true")
    helm.iterate()
    assert "post_mortem=filter_vtype#rng=50.0#bng=0.0" in str(helm.posted("IVPHELM_LIFE_EVENT")[-1])


TEMPLATE = {"name": "away_", "templating": "spawn", "updates": "CONTACT_INFO", "contact": "to-be-set"}


@pytest.mark.parametrize(
    ("more", "tail"),
    [
        ({}, ""),
        ({"match_type": "kayak"}, ", match_type=kayak"),
        ({"ignore_name": "cal,deb"}, ", ignore_name={cal,deb}"),
        ({"ignore_group": "red", "strict_ignore": "false"}, ", ignore_group=red, strict_ignore=false"),
    ],
)
def test_a_template_asks_the_contact_manager_for_alerts(more, tail):
    helm = HelmRig([(KeepAway, {**TEMPLATE, **more})], domain=("course:0:359:360",))
    helm.own()
    helm.iterate()
    request = (
        "id=away_, on_flag=CONTACT_INFO=name=$[VNAME] # contact=$[VNAME],alert_range=100, cpa_range=150.5"
    )
    assert helm.posted("BCM_ALERT_REQUEST") == [request + tail]


def test_the_contact_manager_understands_the_request():
    from pymoos_lite.marine.contact_alerts import Alert, apply_request

    helm = HelmRig([(KeepAway, {**TEMPLATE, "ignore_name": "cal,deb"})], domain=("course:0:359:360",))
    helm.own()
    helm.iterate()
    alerts: dict[str, Alert] = {}
    alert = apply_request(str(helm.posted("BCM_ALERT_REQUEST")[0]), alerts)
    assert alert.on_flags == ("CONTACT_INFO=name=$[VNAME] # contact=$[VNAME]",)
    assert (alert.alert_range, alert.cpa_range) == (100.0, 150.5)
    assert not alert.filter.passes("Deb", "", "kayak", 0, 0)
    assert alert.filter.passes("eve", "", "kayak", 0, 0)


def test_a_behaviour_that_is_no_template_asks_for_no_alerts():
    helm = rig(updates="CONTACT_INFO")
    helm.iterate()
    assert helm.posted("BCM_ALERT_REQUEST") == []


def test_an_alert_spawns_a_behaviour_that_ends_with_its_contact():
    helm = HelmRig([(KeepAway, TEMPLATE)], domain=("course:0:359:360",), period=1.0)
    helm.own()
    helm.contacts([ben()])
    helm.iterate()
    helm.mail("CONTACT_INFO", "name=ben # contact=ben")
    helm.iterate()
    assert helm.decision == {"course": 180.0}
    helm.contacts([])
    helm.iterate(100)
    assert helm.core.population.lives == []


def test_the_bearing_line_takes_the_first_colour_whose_threshold_is_reached():
    line = parse_bearing_line("white:0, green:0.65, yellow:0.8, red:1.0")
    colors = [line.color(index) for index in (0.0, 0.1, 0.65, 0.7, 1.0, 1.1)]
    assert colors == ["white", "green", "green", "yellow", "red", "blank"]


@pytest.mark.parametrize("text", ["white", "white:x", "nocolor:1", "info:size", ""])
def test_a_faulty_bearing_line_is_refused(text):
    with pytest.raises(ValueError, match="bearing_line_config"):
        parse_bearing_line(text)


def test_the_bearing_line_is_drawn_while_active_and_erased_after():
    helm = rig(bearing_line_config="white:0, green:0.65, red:1.0", comms_policy="open")
    helm.iterate()
    helm.contacts([ben(y=200.0)])
    helm.iterate(2)
    drawn, erased = helm.posted("VIEW_SEGLIST")
    assert str(drawn).startswith("pts={0,0:0,50},label=alpha_away,label_color=invisible,edge_color=green")
    assert "active=false,label=alpha_away" in str(erased)


def test_no_lines_are_drawn_under_a_lean_policy():
    helm = rig(bearing_line_show="true", comms_policy="lean")
    helm.iterate()
    assert helm.posted("VIEW_SEGLIST") == []


@pytest.mark.parametrize(
    ("value", "grade", "wanted"),
    [
        (120.0, "linear", 0.0),
        (100.0, "linear", 0.0),
        (60.0, "linear", 0.5),
        (60.0, "quadratic", 0.25),
        (60.0, "quasi", 0.5**1.5),
        (20.0, "linear", 1.0),
        (5.0, "linear", 1.0),
    ],
)
def test_relevance_grows_from_the_outer_to_the_inner_distance(value, grade, wanted):
    assert graded(value, 20.0, 100.0, grade) == pytest.approx(wanted)


def test_relevance_is_a_step_where_both_distances_are_one():
    assert (graded(49.9, 50.0, 50.0), graded(50.0, 50.0, 50.0)) == (1.0, 0.0)
