"""pDeadManPost: when the heartbeat stays away."""

import pytest
from fleet_fixture import Fleet, Listener

from pymoos_lite.field.dead_man import DeadMan

FLAGS = (("heartbeat_var", "BEAT"), ("deadflag", "RETURN=true"), ("deadflag", "DEAD=1"), ("AppTick", "1"))


def returns(*config, beats=(), seconds=60):
    fleet = Fleet()
    fleet.app("abe", DeadMan, "pDeadManPost", *FLAGS, *config)
    ear = fleet.app("abe", Listener, "ear", ("hear", "RETURN"), ("hear", "DEAD"))
    for at in beats:
        fleet.host.poke(at, "BEAT", f"beat at {at}", "abe")
    fleet.run(seconds)
    assert len(ear.values("DEAD")) == len(ear.values("RETURN"))
    return [round(m.time - fleet.host.clock.start) for m in ear.heard if m.name == "RETURN"]


def test_without_a_beat_the_flags_are_posted_once_after_the_longest_silence():
    assert returns() == [11]
    assert returns(("max_noheart", "25")) == [26]


def test_beats_put_it_off():
    assert returns(beats=[5, 12.5, 20.5]) == [32]


@pytest.mark.parametrize(
    ("policy", "expected"),
    [("once", [11]), ("reset", [11, 32]), ("repeat", [*range(11, 21), *range(32, 40)])],
)
def test_the_policy_says_how_often(policy, expected):
    assert returns(("post_policy", policy), beats=[20.5], seconds=40) == expected


def test_it_may_wait_for_the_first_beat():
    assert returns(("active_at_start", "false")) == []
    assert returns(("active_at_start", "false"), beats=[30.5]) == [42]


def test_a_block_that_watches_nothing_is_warned_of():
    fleet = Fleet()
    app = fleet.app("abe", DeadMan, "pDeadManPost")
    assert len(app.log.config_warnings) == 2
