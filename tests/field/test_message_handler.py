"""uFldMessageHandler: what is posted, what is rejected (marine_apps.md 10)."""

import pytest
from fleet_fixture import Fleet, Listener

from pymoos_lite.field.message_handler import MessageHandler


class Vessel:
    def __init__(self, *config):
        self.fleet = Fleet()
        self.app = self.fleet.app("ben", MessageHandler, "uFldMessageHandler", *config)
        self.ear = self.fleet.app("ben", Listener, "ear", ("hear", "*"))
        self.fleet.run(0.1)  # connected

    def take(self, *texts):
        for text in texts:
            self.fleet.post("ben", "NODE_MESSAGE", text)
        self.fleet.run(1.0)
        return self

    def posted(self, name):
        return [m for m in self.ear.heard if m.name == name]


@pytest.mark.parametrize(
    ("body", "value"),
    [
        ("string_val=bar", "bar"),
        ('string_val="x=1,y=2"', "x=1,y=2"),
        ('string_val="3.5"', "3.5"),
        ("string_val=3.5", "3.5"),
        ("double_val=3.5", 3.5),
        ("color=red", 0.0),
    ],
)
def test_the_variable_is_posted_with_its_value_and_origin(body, value):
    vessel = Vessel().take(f"src_node=abe,dest_node=ben,src_app=pX,var_name=FOO,{body}")
    (message,) = vessel.posted("FOO")
    assert (message.value, message.aux, message.source) == (value, "abe", "uFldMessageHandler")
    assert vessel.fleet.value("ben", "UMH_SUMMARY_MSGS") == "total=1,valid=1,rejected=0"


@pytest.mark.parametrize(
    ("address", "strict", "taken"),
    [
        ("dest_node=ben", "true", True),
        ("dest_node=BEN", "true", True),
        ("dest_node=abe:ben", "true", True),
        ("dest_node=all", "false", True),
        ("dest_node=all", "true", False),
        ("dest_group=red", "false", True),
        ("dest_group=red", "true", False),
        ("dest_node=cal", "false", False),
        ("dest_node=benny", "false", False),
    ],
)
def test_only_what_is_addressed_to_this_vessel_is_taken(address, strict, taken):
    vessel = Vessel(("strict_addressing", strict)).take(f"src_node=abe,{address},var_name=FOO,double_val=1")
    assert bool(vessel.posted("FOO")) == taken
    assert (vessel.app.valid, vessel.app.rejected) == ((1, 0) if taken else (0, 1))


def test_flags_tell_of_messages_taken_and_rejected():
    vessel = Vessel(("msg_flag", "GOOD=$[GOOD_CTR]"), ("bad_msg_flag", "BAD=$(BAD_CTR) of $[CTR]"))
    good, bad = (
        "src_node=abe,dest_node=ben,var_name=F,double_val=1",
        "src_node=abe,dest_node=x,var_name=F,double_val=1",
    )
    vessel.take(good, bad, good)
    assert [m.value for m in vessel.posted("GOOD")] == [1.0, 2.0]
    assert [m.value for m in vessel.posted("BAD")] == ["1 of 2"]


def test_the_sending_app_is_told_if_asked_for():
    vessel = Vessel(("aux_info", "node+app")).take(
        "src_node=abe,dest_node=ben,src_app=pX,var_name=F,double_val=1"
    )
    assert vessel.posted("F")[0].aux == "abe+pX"


def test_invalid_messages_are_counted_and_post_nothing():
    vessel = Vessel().take("", "src_node=abe", "dest_node=ben,var_name=F,double_val=1", "x" * 2_000_000)
    assert (vessel.app.total, vessel.app.invalid, vessel.app.rejected) == (4, 4, 0)
    assert not vessel.posted("F")


def test_a_message_of_the_wrong_type_is_refused_and_counted():
    vessel = Vessel()
    vessel.fleet.post("ben", "FOO", 1.0)
    vessel.fleet.run(1)
    vessel.take("src_node=abe,dest_node=ben,var_name=FOO,string_val=text")
    assert vessel.app.rejected == 1
    assert any("FOO" in w for w in vessel.app.log.run_warnings)


def test_the_summary_comes_now_and_then_without_mail():
    vessel = Vessel(("AppTick", "4"))
    vessel.fleet.run(60)
    assert len(vessel.posted("UMH_SUMMARY_MSGS")) == 2
