"""One vessel's mission control, fed by hand."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.bloom.control import Control, ControlSettings, standby_offset
from missions.bloom.inputs import InputSettings
from missions.bloom.zones import XRAY, YANKEE
from pymoos_lite.geometry.specs import parse_point, parse_polygon

ZONES = (parse_polygon(XRAY), parse_polygon(YANKEE))
IN_XRAY, IN_YANKEE, NOWHERE = (-115.0, -300.0), (320.0, -120.0), (0.0, 0.0)
INPUTS = InputSettings(
    finish_migration_input=100.0, migration_pause=600.0, migration_resistance=-200.0, no_samples_patience=1e9
)


def control(at=IN_XRAY, option="explore", **changes):
    made = Control("abe", ControlSettings(ZONES, INPUTS, **changes), 0.0)
    made.hear_position(*at)
    made.hear_option(option, 0.0)
    return made


def values(posts, variable):
    return [post.value for post in posts if post.variable == variable]


def test_entering_a_bloom_while_exploring_gives_five_sample_points_to_everybody():
    abe = control()
    abe.hear_bloom(True)
    posts = abe.step(1.0)
    sent = [parse_point(post.value) for post in posts if post.variable == "SAMPLE_LOC"]
    assert all(post.to_all for post in posts if post.variable == "SAMPLE_LOC")
    assert [p.label for p in sent] == [f"abe_1_{side}" for side in ("cent", "north", "east", "south", "west")]
    assert [(p.x, p.y) for p in sent] == [
        (-115, -300),
        (-115, -285),
        (-100, -300),
        (-115, -315),
        (-130, -300),
    ]
    assert set(abe.points) == {p.label for p in sent}


@pytest.mark.parametrize("option", ["exploit", "migrate", ""])
def test_only_explorers_discover(option):
    abe = control(option=option)
    abe.hear_bloom(True)
    assert abe.points == {}


def test_a_bloom_is_discovered_when_it_is_entered_not_while_inside():
    abe = control(option="exploit")
    abe.hear_bloom(True)
    abe.hear_option("explore", 1.0)
    abe.hear_bloom(True)
    assert abe.points == {}
    abe.hear_bloom(False)
    abe.hear_bloom(True)
    assert len(abe.points) == 5


def test_nothing_is_discovered_outside_the_zone_or_next_to_known_sample_points():
    away = control(at=NOWHERE)
    away.hear_bloom(True)
    assert away.points == {}
    near = control()
    near.hear_sample_point("x=-115,y=-271,label=ben_1_cent")
    near.hear_bloom(True)
    assert list(near.points) == ["ben_1_cent"]


def test_sample_points_of_others_are_known_until_withdrawn():
    abe = control()
    abe.hear_sample_point("x=-100,y=-250,label=ben_1_cent")
    abe.hear_sample_point("x=-100,y=-265,label=ben_1_south")
    abe.hear_sample_point("x=-100,y=-265,label=ben_1_south,active=false")
    assert list(abe.points) == ["ben_1_cent"]


@pytest.mark.parametrize("text", ["", "abc", "x=1", "x=1,y=2", "x=nan,y=0,label=a", "label=a"])
def test_a_damaged_sample_point_is_refused(text):
    abe = control()
    with pytest.raises(ValueError):
        abe.hear_sample_point(text)
    assert abe.points == {}


def test_the_nearest_sample_point_nobody_else_is_nearer_to_is_the_target():
    abe = control(option="exploit")
    abe.hear_sample_point("x=-115,y=-280,label=near")
    abe.hear_sample_point("x=-115,y=-200,label=far")
    abe.hear_report("BEN", -115.0, -285.0, 0.0)
    abe.hear_coalition("exploit", ["ben"])
    posts = abe.step(1.0)
    assert abe.target == "far"
    assert values(posts, "SAMPLE_TRAVEL_UPDATE") == ["point=-115.00,-200.00"]
    assert values(posts, "SAMPLE_AVAILABLE") == ["true"]
    abe.hear_coalition("exploit", [])
    posts = abe.step(1.25)
    assert abe.target == "near"
    assert values(posts, "SAMPLE_TRAVEL_UPDATE") == ["point=-115.00,-280.00"]
    assert values(abe.step(1.5), "SAMPLE_TRAVEL_UPDATE") == []


def test_where_to_sample_and_to_wait_is_said_again_for_a_helm_that_was_parked():
    abe = control()
    steps = [abe.step(0.25 * k) for k in range(17)]
    for variable in ("SAMPLE_UPDATE", "SAMPLE_TRAVEL_UPDATE"):
        said = [bool(values(posts, variable)) for posts in steps]
        assert said == [k % 8 == 0 for k in range(17)], "at once, and every two seconds"


def test_a_vessel_not_heard_of_for_35_seconds_competes_no_more():
    abe = control(option="exploit")
    abe.hear_sample_point("x=-115,y=-280,label=near")
    abe.hear_report("ben", -115.0, -285.0, 0.0)
    abe.hear_coalition("exploit", ["ben"])
    abe.step(35.0)
    assert abe.target is None
    abe.step(35.5)
    assert abe.target == "near"


def test_a_sample_point_is_taken_by_a_sampler_that_announces_at_it():
    abe = control(option="exploit")
    abe.hear_sample_point("x=-115,y=-297,label=here")
    abe.hear_sample_point("x=-115,y=-250,label=there")
    assert values(abe.step(1.0), "SAMPLE_UPDATE") == ["station_pt=-115.00,-297.00"]
    assert abe.target == "here"
    abe.hear_start("abe", 2.0)
    posts = abe.step(2.0)
    assert list(abe.points) == ["there"]
    assert values(posts, "SAMPLE_UPDATE") == [], "it stays where it samples"
    assert values(posts, "SAMPLE_TRAVEL_UPDATE") == ["point=-115.00,-250.00"]
    abe.hear_finish("abe")
    assert abe.totals.samples == 1
    assert values(abe.step(12.0), "NUMBER_OF_SAMPLED_BLOOMS") == ["1"]


def test_who_announces_without_being_a_sampler_takes_nothing():
    abe = control()
    abe.hear_sample_point("x=-115,y=-297,label=here")
    abe.hear_report("ben", -115.0, -297.0, 0.0)
    abe.hear_start("ben", 1.0)
    abe.step(1.0)
    assert list(abe.points) == ["here"]
    abe.hear_coalition("exploit", ["BEN"])
    abe.step(1.25)
    assert abe.points == {}


def test_an_announcement_without_an_end_is_forgotten():
    abe = control(sample_time=20.0)
    abe.hear_start("abe", 0.0)
    abe.step(20.0)
    assert abe.inputs[1] == 50.0
    abe.step(20.25)
    assert abe.inputs[1] == 0.0


def test_an_end_without_a_beginning_is_no_sample():
    abe = control()
    abe.hear_finish("abe")
    abe.hear_finish("ben")
    assert abe.totals.samples == 0


def test_a_migration_moves_everything_to_the_other_zone():
    abe = control()
    abe.hear_sample_point("x=-100,y=-250,label=ben_1_cent")
    abe.step(1.0)
    abe.hear_option("MIGRATE", 700.0)
    posts = abe.step(700.0)
    assert abe.zone == 1
    assert abe.points == {}
    assert "active=false" in values(posts, "VIEW_POINT")[0]
    assert parse_polygon(values(posts, "PROX_UP_REGION")[0]).points == ZONES[1].points
    assert parse_polygon(values(posts, "CURR_REGION")[0]).points == ZONES[1].points
    assert values(posts, "OP_REGION_RESET") == ["true"]
    assert values(posts, "MIGRATION_DONE") == ["false"]
    assert values(posts, "UP_MOVE")[0].startswith("region=pts={114.3,-27.4:")
    assert values(posts, "VECTOR_UPDATE")[0].startswith("op_region=pts={114.3,-27.4:")


def test_a_second_migration_within_the_pause_does_not_turn_back():
    abe = control()
    abe.hear_option("migrate", 700.0)
    abe.hear_option("explore", 800.0)
    abe.hear_option("migrate", 1299.0)
    assert abe.zone == 1
    abe.hear_option("explore", 1299.5)
    abe.hear_option("migrate", 1300.0)
    assert abe.zone == 0
    assert abe.totals.migrations == 2


def test_a_migration_is_unfinished_until_all_known_vessels_are_there():
    abe = control()
    assert not abe.unfinished()
    abe.hear_option("migrate", 700.0)
    assert abe.unfinished()
    abe.hear_position(*IN_YANKEE)
    assert not abe.unfinished()
    abe.hear_report("ben", *IN_XRAY, 700.0)
    assert not abe.unfinished()
    abe.hear_contacts(["BEN"])
    assert abe.unfinished()
    abe.step(701.0)
    assert abe.inputs[2] == 100.0 - 200.0 * 0.0
    abe.hear_migration_done(True, 702.0)
    abe.step(705.0)
    assert abe.inputs[2] == pytest.approx(-200.0 * (1.0 - 3.0 / 600.0))


def test_contacts_that_do_not_explore_are_to_be_ignored_in_the_partition():
    abe = control()
    abe.hear_contacts(["ben", "cal", "deb"])
    abe.hear_coalition("explore", ["cal"])
    assert values(abe.step(1.0), "PROX_SET_IGNORE_LIST") == ["ben,deb"]
    assert values(abe.step(1.25), "PROX_SET_IGNORE_LIST") == []
    abe.hear_coalition("explore", ["cal", "deb"])
    assert values(abe.step(1.5), "PROX_SET_IGNORE_LIST") == ["ben"]


def test_fixed_coalitions_outrank_what_others_choose():
    abe = control(exploit_set=frozenset({"abe", "cal"}), explore_set=frozenset({"ben"}))
    abe.hear_contacts(["ben", "cal"])
    abe.hear_coalition("exploit", ["ben"])
    abe.hear_coalition("explore", ["cal"])
    assert abe.samplers == {"abe", "cal"}
    assert abe.explorers == {"ben"}


def test_without_a_sample_point_every_vessel_waits_at_a_place_of_its_own():
    places = {standby_offset(i, 4, 25.0) for i in range(4)}
    assert len(places) == 4
    assert all(x * x + y * y == pytest.approx(625.0) for x, y in places)
    abe = control(standby=(25.0, 0.0))
    x, y = ZONES[0].area_centroid
    assert values(abe.step(1.0), "SAMPLE_UPDATE") == [f"station_pt={x + 25.0:.2f},{y:.2f}"]


def test_the_odometer_sums_the_way_made():
    abe = control(at=(0.0, 0.0))
    for x, y in ((3.0, 4.0), (3.0, 4.0), (3.0, 10.0)):
        abe.hear_position(x, y)
    assert abe.odometer == pytest.approx(11.0)


NEWS = st.one_of(
    st.tuples(st.just("hear_position"), st.tuples(st.floats(-600, 600), st.floats(-600, 600))),
    st.tuples(st.just("hear_option"), st.tuples(st.sampled_from(["EXPLORE", "EXPLOIT", "MIGRATE", "x"]))),
    st.tuples(st.just("hear_bloom"), st.tuples(st.booleans())),
    st.tuples(st.just("hear_start"), st.tuples(st.sampled_from(["abe", "ben"]))),
    st.tuples(st.just("hear_finish"), st.tuples(st.sampled_from(["abe", "ben"]))),
    st.tuples(st.just("hear_contacts"), st.tuples(st.lists(st.sampled_from(["ben", "cal"]), max_size=2))),
    st.tuples(st.just("hear_migration_done"), st.tuples(st.booleans())),
)
TIMED = {"hear_option", "hear_start", "hear_migration_done"}


@settings(max_examples=60, deadline=None)
@given(st.lists(NEWS, max_size=40))
def test_whatever_the_news_the_inputs_stay_finite_and_targets_are_known_points(news):
    abe = Control("abe", ControlSettings(ZONES, INPUTS), 0.0)
    for second, (method, arguments) in enumerate(news):
        now = 40.0 * second
        getattr(abe, method)(*arguments, *([now] if method in TIMED else []))
        abe.step(now)
        assert all(abs(value) <= 1000.0 for value in abe.inputs)
        assert abe.target is None or abe.target in abe.points
        assert abe.zone in (0, 1)
