"""uFldObstacleSim, uFldCollObDetect and uFldPathCheck as apps (marine_apps.md 7)."""

import pytest
from marine_harness import Sea, warnings_of

from pymoos_lite.geometry.specs import parse_polygon
from pymoos_lite.marine.obstacle_collisions import ObstacleCollisions
from pymoos_lite.marine.obstacle_sim import ObstacleSim
from pymoos_lite.marine.path_check import PathCheck

FIELD = """region = pts={0,0:200,0:200,200:0,200}
min_range = 10
min_size = 5
max_size = 8
poly = pts={40,40:50,40:50,50:40,50},label=ob_0
poly = pts={90,90:100,90:100,100:90,100},label=ob_1
"""


def report(there, name, x, y, speed=1.0):
    now = there.now
    there.post("NODE_REPORT", f"NAME={name},TYPE=kayak,TIME={now:.3f},X={x},Y={y},SPD={speed},HDG=0")


@pytest.fixture
def shore(tmp_path):
    def start(config=""):
        path = tmp_path / "field.txt"
        path.write_text(FIELD)
        there = Sea()
        there.sim = there.add(ObstacleSim, "uFldObstacleSim", f"obstacle_file = {path}\n{config}")
        there.run(1.0)
        return there

    return start


def test_obstacles_are_told_at_start_and_to_whoever_comes(shore):
    there = shore()
    first = "pts={40,40:50,40:50,50:40,50},label=ob_0"
    assert there.heard("GIVEN_OBSTACLE")[0] == there.heard("KNOWN_OBSTACLE")[0] == first
    assert len(there.heard("GIVEN_OBSTACLE")) == 2
    report(there, "abe", 0, 0)
    there.run(1.0)
    report(there, "abe", 0, 0)
    there.run(1.0)
    assert len(there.heard("GIVEN_OBSTACLE")) == 4
    there.post("OBM_CONNECT", "true")
    there.run(1.0)
    assert len(there.heard("GIVEN_OBSTACLE")) == 6


def test_durations_are_drawn_once_per_obstacle(shore):
    there = shore("min_duration = 3\nmax_duration = 9\nrefresh_interval = 2")
    there.run(5.0)
    told = there.heard("GIVEN_OBSTACLE")
    assert len(told) >= 6
    assert len(set(told)) == 2
    assert all(3.0 <= parse_polygon(text).attributes.duration <= 9.0 for text in told)


def test_with_points_vehicles_sense_only_what_is_near(shore):
    there = shore("post_points = true\nsensor_range = 30\nrate_points = 2")
    assert there.heard("GIVEN_OBSTACLE") == []
    report(there, "abe", 30, 30)
    there.run(1.0)
    points = there.heard("TRACKED_FEATURE_ABE")
    assert len(points) >= 4
    assert all(text.endswith("key=ob_0") for text in points)


def test_the_field_is_made_anew_when_the_last_vehicle_has_left(shore):
    there = shore("reset_interval = 10\nreset_range = 5")
    before = there.sim.field.obstacles
    report(there, "abe", 100, 20)
    there.run(15.0)
    assert there.sim.field.obstacles == before
    report(there, "abe", -20, 20)
    there.run(1.0)
    assert there.sim.field.obstacles != before
    assert there.heard("KNOWN_OBSTACLE_CLEAR") == ["all"]
    assert [o.label for o in there.sim.field.obstacles] == ["ob_0", "ob_1"]


def test_a_wish_for_a_new_field_waits_until_it_is_empty(shore):
    there = shore("reuse_ids = false")
    report(there, "abe", 100, 20)
    there.post("UFOS_RESET", "true")
    there.run(3.0)
    assert [o.label for o in there.sim.field.obstacles] == ["ob_0", "ob_1"]
    report(there, "abe", 100, -30)
    there.run(1.0)
    assert [o.label for o in there.sim.field.obstacles] == ["ob_2", "ob_3"]
    erased = [text for text in there.heard("VIEW_POLYGON") if "active=false" in text]
    assert len(erased) == 2


def test_the_same_seed_gives_the_same_field(shore):
    fields = []
    for _ in range(2):
        there = shore()
        there.post("UFOS_RESET", "true")
        there.run(2.0)
        fields.append(there.sim.field.obstacles)
    assert fields[0] == fields[1]


@pytest.mark.parametrize(("text", "size"), [("5", 5.0), ("bigger", 3.0), ("smaller", 1.0), ("zero", 2.0)])
def test_the_size_of_points_can_be_changed(shore, text, size):
    there = shore()
    there.post("UFOS_POINT_SIZE", text)
    there.run(1.0)
    assert there.sim._point_size == size


# --- uFldCollObDetect ------------------------------------------------------------------------------------

ROCK = "pts={0,0:10,0:10,10:0,10},label=rock"


@pytest.mark.parametrize(
    ("abreast", "flags"), [(-10.0, ["E=10"]), (-3.0, ["M=3", "E=3"]), (5.0, ["C=0", "E=0"]), (-20.0, [])]
)
def test_visits_are_ranked_by_how_near_they_came(abreast, flags):
    there = Sea()
    config = "encounter_flag = F=E=$DIST\nnear_miss_flag = F=M=$DIST\ncollision_flag = F=C=$DIST"
    there.add(ObstacleCollisions, "uFldCollObDetect", config)
    there.run(1.0)
    there.post("KNOWN_OBSTACLE", ROCK)
    for y in range(-30, 41, 2):
        report(there, "abe", abreast, y)
        there.run(0.5)
    assert there.heard("F") == flags


def test_flags_that_are_one_macro_are_numbers():
    there = Sea()
    there.add(
        ObstacleCollisions,
        "uFldCollObDetect",
        "encounter_flag = N_$UP_VNAME=$ENC_CNT\nencounter_flag = W=$ID",
    )
    there.run(1.0)
    there.post("KNOWN_OBSTACLE", ROCK)
    for y in range(-30, 41, 2):
        report(there, "abe", -5, y)
        there.run(0.5)
    assert there.heard("N_ABE") == [1.0]
    assert there.heard("W") == ["rock"]
    assert there.last("OB_GLOBAL_MIN") == pytest.approx(5.0)


def test_a_cleared_obstacle_is_no_obstacle():
    there = Sea()
    referee = there.add(ObstacleCollisions, "uFldCollObDetect", "")
    there.post("KNOWN_OBSTACLE", ROCK)
    there.run(6.0)
    there.post("KNOWN_OBSTACLE_CLEAR", "all")
    there.run(1.0)
    assert referee.referee.labels() == []


# --- uFldPathCheck ---------------------------------------------------------------------------------------


def test_odometers_count_and_are_set_back():
    there = Sea()
    checker = there.add(PathCheck, "uFldPathCheck", "history_length = 4")
    for k in range(6):
        report(there, "abe", 0, 3.0 * k)
        there.run(1.0)
    assert there.last("UPC_SPEED_REPORT") == "vname=abe,avg_spd=3.00"
    assert there.last("UPC_ODOMETRY_REPORT") == "vname=abe,total_dist=15.0,trip_dist=15.0"
    there.post("UPC_TRIP_RESET", "abe")
    there.post("UPC_TRIP_RESET", "nobody")
    there.run(1.0)
    assert there.last("UPC_ODOMETRY_REPORT") == "vname=abe,total_dist=15.0,trip_dist=0.0"
    assert any("nobody" in text for text in warnings_of(checker))
    there.post("NODE_REPORT", "NAME=ben,TIME=1,LAT=1,LON=2")
    there.run(1.0)
    assert list(checker.odometers) == ["abe"]
