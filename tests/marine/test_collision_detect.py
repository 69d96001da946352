"""uFldCollisionDetect: encounters found from node reports, ranked, counted and told (marine_apps.md 7.2)."""

import csv
from pathlib import Path

import pytest
from marine_harness import Sea, warnings_of

from pymoos_lite.marine.collision_detect import CollisionDetect

DATA = Path(__file__).parents[1] / "data" / "contacts"


class Shore(Sea):
    """The referee with vessels that report."""

    def __init__(self, config=""):
        super().__init__()
        self.referee = self.add(CollisionDetect, "uFldCollisionDetect", config)

    def report(self, name, x, y, heading=0.0, speed=1.0, **more):
        extra = "".join(f",{key.upper()}={value}" for key, value in more.items())
        now = self.host.clock.now()
        text = f"NAME={name},TYPE=kayak,TIME={now:.3f},X={x},Y={y},SPD={speed},HDG={heading}{extra}"
        self.post("NODE_REPORT", text)

    def pass_by(self, abreast, group=""):
        """abe rests at the origin; ben comes from the south and passes to the east of it."""
        more = {"group": group} if group else {}
        for k in range(-40, 41):
            self.report("abe", 0.0, 0.0, speed=0.0, **more)
            self.report("ben", abreast, float(k), **more)
            self.run(0.5)


def test_a_close_pass_is_counted_and_told():
    shore = Shore("encounter_range = 20")
    shore.run(1.0)
    assert [shore.heard(f"{name}_TOTAL") for name in ("ENCOUNTER", "NEAR_MISS", "COLLISION")] == [[0.0]] * 3
    shore.pass_by(5.0)
    assert shore.heard("ENCOUNTER_TOTAL") == [0.0, 1.0]
    assert shore.heard("NEAR_MISS_TOTAL") == [0.0, 1.0]
    assert shore.heard("COLLISION_TOTAL") == [0.0]
    (text,) = shore.heard("UCD_REPORT")
    assert text.startswith("cpa=5,vname1=abe,vname2=ben,rank=near_miss,")


@pytest.mark.parametrize(
    ("abreast", "all_told", "ranks"),
    [(2.0, "false", ["collision"]), (15.0, "false", []), (15.0, "true", ["clear"]), (25.0, "true", [])],
)
def test_passes_are_told_by_rank(abreast, all_told, ranks):
    shore = Shore(f"report_all_encounters = {all_told}")
    shore.pass_by(abreast)
    found = [text.partition("rank=")[2].partition(",")[0] for text in shore.heard("UCD_REPORT")]
    assert found == ranks
    assert shore.heard("COLLISION_TOTAL")[-1] == (1.0 if "collision" in ranks else 0.0)


def test_flags_know_who_met_and_how_close():
    shore = Shore(
        "encounter_flag = MET_$UP_V1=$V1 and $V2 at $CPA m\n"
        "near_miss_flag = CLOSE=$CPA\n"
        "near_miss_flag = COUNT=$IDX\n"
        "near_miss_flag = CROWD=$[V1@50],$[ben@1]\n"
        "collision_flag = CRASH=true"
    )
    shore.pass_by(5.0)
    assert shore.heard("MET_ABE") == ["abe and ben at 5 m"]
    assert shore.heard("CLOSE") == [pytest.approx(5.0)]
    assert shore.heard("COUNT") == [1.0]
    assert shore.heard("CROWD") == ["1,0"]
    assert shore.heard("CRASH") == []


def test_vessels_of_ignored_groups_may_meet_each_other():
    shore = Shore("ignore_group = red, blue")
    shore.pass_by(5.0, group="Red")
    assert shore.heard("ENCOUNTER_TOTAL") == [0.0]


def test_vessels_of_rejected_groups_are_not_followed():
    shore = Shore("reject_group = red")
    shore.pass_by(5.0, group="red")
    assert shore.heard("ENCOUNTER_TOTAL") == [0.0]


def test_nothing_is_judged_unless_the_conditions_hold():
    shore = Shore("condition = MISSION = running")
    shore.pass_by(5.0)
    assert shore.heard("ENCOUNTER_TOTAL") == [0.0]
    shore.post("MISSION", "running")
    shore.run(1.0)
    shore.pass_by(5.0)
    assert shore.heard("ENCOUNTER_TOTAL") == [0.0, 1.0]


def test_the_closest_ranges_are_posted_on_request():
    shore = Shore("post_closest_range = true\npost_closest_range_ever = true")
    shore.pass_by(5.0)
    ranges, ever = shore.heard("UCD_CLOSEST_RANGE"), shore.heard("UCD_CLOSEST_RANGE_EVER")
    assert min(ranges) == pytest.approx(5.0, abs=0.05)
    assert ever[-1] == min(ever) == pytest.approx(5.0, abs=0.05)
    shore.post("UCD_RESET", "true")
    shore.run(1.0)
    assert shore.referee.referee.closest_ever == float("inf")


def test_ranges_out_of_order_are_raised_with_a_warning():
    shore = Shore("collision_range = 9")
    shore.run(1.0)
    ranges = "collision_range=9, near_miss_range=9, encounter_range=20"
    assert shore.heard("COLLISION_DETECT_PARAMS") == [ranges]
    assert any("raised" in text for text in shore.referee.log.config_warnings)


def test_each_vessel_is_told_the_ranges_once():
    shore = Shore()
    shore.pass_by(5.0)
    assert len(shore.heard("COLLISION_DETECT_PARAMS_BEN")) == 1


def test_a_worthless_report_is_a_warning():
    shore = Shore()
    shore.post("NODE_REPORT", "NAME=abe,X=1,Y=2")
    shore.run(1.0)
    assert any("timestamp" in text for text in warnings_of(shore.referee))


def recorded(config):
    """UCD_REPORTs of the recorded passes: closest range by pair of names."""
    shore = Shore(f"encounter_range = 40\nreport_all_encounters = true\n{config}")
    with (DATA / "referee.csv").open() as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        for name in ("abe", "ben", "cal"):
            shore.report(name, row[f"{name}_x"], row[f"{name}_y"], row[f"{name}_heading"])
            shore.run(0.16)
        shore.run(0.02)
    return shore, {
        (text.partition("vname1=")[2][:3], text.partition("vname2=")[2][:3]): float(text[4 : text.index(",")])
        for text in shore.heard("UCD_REPORT")
    }


def test_the_recorded_near_miss_is_found_which_the_sampled_rule_overlooks():
    shore, ranges = recorded("")
    assert (shore.last("COLLISION_TOTAL"), shore.last("NEAR_MISS_TOTAL")) == (1.0, 1.0)
    assert ranges["abe", "cal"] == pytest.approx(4.83, abs=0.5)  # stamped up to 0.3 s late
    _, sampled = recorded("sampled_cpa = true")
    assert sampled["abe", "cal"] > ranges["abe", "cal"] + 0.3
