"""The apps of the bloom mission and the cell app, each alone in a community."""

import pytest
from mission_harness import Bench, report

from missions.bloom.bloom_sim import BloomStormSim, parse_track
from missions.bloom.control_app import BloomControl, parse_place
from missions.bloom.environment import StormTrack
from missions.bloom.fixer import OpinionFixer, fixed_choice
from pymoos_lite.geometry.specs import parse_polygon
from pymoos_lite.marine.proxonoi import Proxonoi
from pymoos_lite.records.node_message import NodeMessage

SQUARE = "region = pts={0,0:100,0:100,100:0,100}"
BLOOMS = (
    "bloom_rad_min = 40\nbloom_rad_max = 50\ntime_between_bloom_attempts = 0\nprobability_of_new_bloom = 1"
)


def area(text):
    return parse_polygon(text).area


# --- pProxonoi --------------------------------------------------------------------------------------------


def test_two_vessels_share_the_region_by_the_line_between_them():
    bench = Bench(Proxonoi, SQUARE).post(NAV_X=25, NAV_Y=50, NODE_REPORT=report("ben", 75, 50)).run(1.0)
    assert area(bench.last("PROXONOI_POLY")) == pytest.approx(5000.0)
    assert area(bench.last("PROXONOI_REGION")) == pytest.approx(10000.0)


def test_ignored_vessels_and_those_outside_take_nothing():
    bench = Bench(Proxonoi, SQUARE).post(NAV_X=25, NAV_Y=50, NODE_REPORT=report("ben", 75, 50))
    bench.post(PROX_SET_IGNORE_LIST="BEN").run(1.0)
    assert area(bench.last("PROXONOI_POLY")) == pytest.approx(10000.0)
    bench.post(PROX_SET_IGNORE_LIST="").run(1.0)
    assert area(bench.last("PROXONOI_POLY")) == pytest.approx(5000.0)
    bench.post(NODE_REPORT=report("ben", 175, 50)).run(1.0)
    assert area(bench.last("PROXONOI_POLY")) == pytest.approx(10000.0)


def test_a_vessel_not_heard_of_for_long_takes_nothing_any_more():
    bench = Bench(Proxonoi, SQUARE + "\ncontact_max_age = 10").post(NAV_X=25, NAV_Y=50)
    bench.post(NODE_REPORT=report("ben", 75, 50)).run(8.0)
    assert area(bench.last("PROXONOI_POLY")) == pytest.approx(5000.0)
    bench.run(5.0)
    assert area(bench.last("PROXONOI_POLY")) == pytest.approx(10000.0)


def test_outside_the_region_the_cell_is_withdrawn_once():
    bench = Bench(Proxonoi, SQUARE).post(NAV_X=25, NAV_Y=50).run(1.0).post(NAV_X=-5).run(3.0)
    assert [text for text in bench.said["PROXONOI_POLY"] if "active=false" in text] == [
        bench.last("PROXONOI_POLY")
    ]


def test_a_new_region_counts_at_once_with_the_vessels_already_known():
    bench = Bench(Proxonoi, SQUARE).post(NAV_X=25, NAV_Y=50, NODE_REPORT=report("ben", 75, 50)).run(1.0)
    bench.post(PROX_UP_REGION="0,0:100,0:100,60:0,60").run(1.0)
    assert area(bench.last("PROXONOI_POLY")) == pytest.approx(3000.0)
    assert area(bench.last("PROXONOI_REGION")) == pytest.approx(6000.0)


@pytest.mark.parametrize("text", ["", "pts={0,0:1,1}", "nonsense", "0,0:10,0:1,1:0,10"])
def test_a_region_that_is_none_is_a_warning_and_changes_nothing(text):
    bench = Bench(Proxonoi, SQUARE).post(NAV_X=25, NAV_Y=50).run(1.0).post(PROX_UP_REGION=text).run(1.0)
    assert area(bench.last("PROXONOI_POLY")) == pytest.approx(10000.0)
    assert bench.app.log.run_warnings


# --- uFldBloomStormSim ------------------------------------------------------------------------------------


def sim(block=BLOOMS):
    return Bench(BloomStormSim, block, community="shoreside")


def test_a_vessel_in_a_bloom_is_told_so_and_one_outside_is_not():
    bench = sim().run(200.0)
    bloom = bench.app.environment.blooms[0]
    bench.post(NODE_REPORT=report("abe", bloom.x, bloom.y)).run(2.0)
    bench.post(NODE_REPORT=report("ben", 5000, 0)).run(2.0)
    assert bench.last("BLOOM_DETECTED_ABE") == "true"
    assert bench.last("SENSOR_MEAS_ABE") == 1.0
    assert bench.last("BLOOM_DETECTED_BEN") == "false"
    assert 0.0 < bench.last("SENSOR_MEAS_BEN") < 0.001
    assert bloom.detected


def test_a_sample_counts_where_the_vessel_last_reported_and_the_tally_follows():
    bench = sim().run(200.0)
    bloom = bench.app.environment.blooms[0]
    assert bench.last("SAMPLED_BLOOMS_COMPLETED") == "0"
    bench.post(NODE_REPORT=report("abe", bloom.x, bloom.y)).run(1.0).post(SAMPLE_FINISHED_LOG="abe").run(1.0)
    assert bloom.sampled
    bench.run(400.0)
    assert bench.last("SAMPLED_BLOOMS_COMPLETED") == "1"
    assert int(bench.last("UNSAMP_UNDETECT_BLOOMS_COMPLETED")) >= 1


def test_a_sample_of_a_vessel_never_heard_of_is_a_warning():
    bench = sim().run(5.0).post(SAMPLE_FINISHED_LOG="zoe").run(2.0)
    assert any("zoe" in text for text in bench.app.log.run_warnings)


def test_only_vessels_with_the_sensor_notice_a_storm():
    track = "storm_track = time=0,x=-115,y=-300,course=154\nstorm_sensors = abe"
    bench = sim(BLOOMS + "\n" + track + "\nstorm_speed = 10").run(10.0)
    storm = bench.app.environment.storm
    bench.post(NODE_REPORT=report("abe", storm.x, storm.y)).run(1.0)
    bench.post(NODE_REPORT=report("ben", storm.x, storm.y)).run(1.0)
    assert bench.last("STORM_DETECTED_ABE") == "true"
    assert bench.last("STORM_DETECTED_BEN") == "false"


def test_the_share_of_explorers_is_averaged_from_the_deployment_on():
    bench = sim().post(NODE_REPORT=report("abe", 0, 0)).run(1.0).post(NODE_REPORT=report("ben", 0, 0))
    bench.post(OPTION_abe="EXPLORE", OPTION_ben="EXPLOIT").run(10.0)
    assert "MIXED_STRAT" not in bench.said
    bench.post(DEPLOY_ALL="true").run(10.0).post(OPTION_ben="EXPLORE").run(10.0)
    assert bench.last("MIXED_STRAT") == 1.0
    assert bench.last("MIXED_STRAT_RNG_AVG") == pytest.approx(0.75, abs=0.05)


def test_blooms_are_drawn_by_their_state_and_erased_at_their_end():
    bench = sim(BLOOMS + "\nbloom_duration_min = 300\nbloom_duration_max = 300").run(100.0)
    bloom = bench.app.environment.blooms[0]
    bench.post(NODE_REPORT=report("abe", bloom.x, bloom.y)).run(5.0).post(SAMPLE_FINISHED_LOG="abe").run(5.0)
    bench.post(NODE_REPORT=report("abe", 5000, 0)).run(300.0)
    colors = [
        "erased"
        if "active=false" in text
        else next(c for c in ("red", "pink", "limegreen") if f"={c}" in text)
        for text in bench.said["VIEW_CIRCLE"]
        if f"label={bloom.label}," in text + ","
    ]
    assert list(dict.fromkeys(colors)) == ["red", "pink", "limegreen", "erased"]


def test_a_storm_track_reads_its_four_numbers_and_nothing_else():
    assert parse_track("time=5, x=1, y=2, course=90") == StormTrack(5.0, 1.0, 2.0, 90.0)
    for text in ("time=5", "time=5,x=1,y=2,course=a", "time=5,x=1,y=2,course=90,z=1", ""):
        with pytest.raises(ValueError):
            parse_track(text)


# --- pBloomStormCtrl --------------------------------------------------------------------------------------


def test_inputs_are_posted_and_a_discovery_is_told_to_all():
    bench = Bench(BloomControl).post(NAV_X=-115, NAV_Y=-300, OPTION="EXPLORE").run(1.0)
    assert bench.last("EXPLORE_INPUT") == 50.0
    assert bench.last("MIGRATE_INPUT") == 0.0
    bench.post(BLOOM_DETECTED="true").run(1.0)
    messages = [NodeMessage.parse(text) for text in bench.said["NODE_MESSAGE_LOCAL"]]
    assert [m.var_name for m in messages] == ["SAMPLE_LOC"] * 5
    assert all(m.is_for_all() and m.src_node == "abe" for m in messages)
    assert [m.value for m in messages] == bench.said["SAMPLE_LOC"]
    assert bench.last("SAMPLE_AVAILABLE") == "true"


def test_damaged_mail_is_a_warning_and_never_a_failure():
    bench = Bench(BloomControl).post(
        NODE_REPORT="nonsense", SAMPLE_LOC="x=,", BLOOM_DETECTED="maybe", NAV_X="far", M300_BATT_VOLTAGE="low"
    )
    bench.run(2.0)
    assert len(bench.app.log.run_warnings) >= 3


def test_alternate_sets_fix_the_coalitions_of_any_fleet():
    bench = Bench(BloomControl, "alternate_sets = abe:ben:cal").run(1.0)
    assert bench.app.control.samplers == {"abe", "cal"}
    assert bench.app.control.explorers == {"ben"}


@pytest.mark.parametrize(
    ("block", "complaint"),
    [
        ("max_batt = 11\nmin_batt = 12", "max_batt 11 must be more than min_batt 12"),
        ("dist_to_next_sample_max_input_range = 200", "must be more than"),
    ],
)
def test_settings_that_make_no_sense_stop_the_start(block, complaint):
    assert complaint in str(Bench(BloomControl, block).failure)


def test_a_place_is_a_number_of_a_count():
    assert parse_place("3/8") == (2, 8)
    for text in ("0/8", "9/8", "3", "a/b", "-1/2"):
        with pytest.raises(ValueError):
            parse_place(text)


# --- pOpinionFixer ----------------------------------------------------------------------------------------


def test_the_fixer_passes_migration_and_replaces_the_rest_in_the_same_case():
    sets = (frozenset({"abe"}), frozenset({"ben"}))
    assert fixed_choice("ABE", "EXPLORE", *sets) == "EXPLOIT"
    assert fixed_choice("ben", "exploit", *sets) == "explore"
    assert fixed_choice("abe", "MIGRATE", *sets) == "MIGRATE"
    assert fixed_choice("cal", "EXPLORE", *sets) == "EXPLORE"


def test_the_fixer_app_turns_option2_into_option():
    bench = Bench(OpinionFixer, "alternate_sets = ben:abe").post(OPTION2="EXPLOIT").run(1.0)
    assert bench.last("OPTION") == "EXPLORE"


def test_a_fixer_without_sets_says_so():
    assert any("no set" in text for text in Bench(OpinionFixer).run(1.0).app.log.config_warnings)
