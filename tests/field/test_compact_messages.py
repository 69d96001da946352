"""Binary variables that node comms passes as they are: in range only, under the sender's name, counted."""

from test_node_comms import QUIET, Sea


def sea(*more):
    made = Sea(("comms_range", "100"), ("pass_binary", "OPINION_MESSAGE"), QUIET, *more)
    made.report("abe")
    made.report("ben", x=60.0)
    made.report("cal", x=200.0)
    made.run()
    made.clear()
    return made


def heard(made):
    return [(m.name, m.value, m.community) for m in made.ear.heard if m.name.startswith("OPINION_MESSAGE_")]


def test_a_compact_message_reaches_those_in_range_with_its_bytes_and_its_sender():
    made = sea()
    made.post("OPINION_MESSAGE", b"\xa7\x45\x54", "abe")
    made.run()
    assert heard(made) == [("OPINION_MESSAGE_BEN", b"\xa7\x45\x54", "abe")]
    assert made.comms.passed["compact message"] == 1
    assert made.comms.dropped["binary: out of range"] == 1


def test_from_a_vessel_that_never_reported_nothing_passes():
    made = sea()
    made.post("OPINION_MESSAGE", b"\x00\x00\x00", "zoe")
    made.run()
    assert heard(made) == []
    assert made.comms.dropped["binary: unknown source"] == 1


def test_drops_hit_compact_messages_too():
    made = sea(("drop_percentage", "100"))
    made.post("OPINION_MESSAGE", b"\x00\x00\x00", "abe")
    made.run()
    assert heard(made) == []


def test_other_binary_variables_are_not_passed():
    made = sea()
    made.post("SECRET", b"\x00", "abe")
    made.run()
    assert not made.heard("SECRET_")
