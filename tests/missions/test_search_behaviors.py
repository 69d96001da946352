"""The behaviours of the bloom mission on the bench: Voronoi, region search, moving into and back into a region."""

from math import hypot

import pytest

from behaviors.region_search import edge_distance, rotate_course
from ivp_helm.testing import HelmRig
from pymoos_lite.geometry.angles import angle_diff, bearing, project_point
from pymoos_lite.geometry.polygon import Polygon

SQUARE = "pts={0,0:100,0:100,100:0,100}"
REGION = Polygon(((0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)))
DOMAIN = ("course:0:359:360", "speed:0:2:21")


def rig(kind, parameters, **own):
    made = HelmRig([(kind, {"name": "b", **parameters})], domain=DOMAIN)
    made.own(**{"x": 50.0, "y": 50.0, **own})
    return made


def weight(made):
    """How much the behaviour had to say in the last iteration."""
    function = made.outcome("b").function
    return 0.0 if function is None else function.weight


def give(made, **values):
    for name, value in values.items():
        made.mail(name, value)


# --- Voronoi --------------------------------------------------------------------------------------------

VORONOI = {
    "speed": 1.0, "capture_radius": 10, "activate_radius": 40, "allow_slipping": "true", "op_region": SQUARE, "pwt": 1,
}  # fmt: skip


def test_without_a_cell_it_sails_to_the_middle_of_the_region():
    made = rig("BHV_Voronoi", VORONOI, x=-50.0)
    made.iterate()
    assert made.decision == {"course": 90.0, "speed": 1.0}


def test_with_a_cell_it_sails_to_the_middle_of_its_box_or_to_its_centre_of_gravity():
    triangle = "pts={0,0:90,0:0,90}"
    for method, target in (("center", (45.0, 45.0)), ("centroid", (30.0, 30.0))):
        made = rig("BHV_Voronoi", {**VORONOI, "setpt_method": method}, x=5.0, y=80.0)
        give(made, PROXONOI_POLY=triangle, PROXONOI_REGION=SQUARE)
        made.iterate()
        assert made.decision["course"] == pytest.approx(bearing(5.0, 80.0, *target), abs=0.5)


def test_outside_the_region_the_cell_does_not_count():
    made = rig("BHV_Voronoi", VORONOI, x=-50.0, y=50.0)
    give(made, PROXONOI_POLY="pts={0,0:10,0:0,10}", PROXONOI_REGION=SQUARE)
    made.iterate()
    assert made.decision["course"] == 90.0


def test_it_is_captured_slips_and_is_activated_again():
    made = rig("BHV_Voronoi", VORONOI, x=50.0, y=45.0)
    weights = []
    for y in (45.0, 35.0, 20.0, 9.0, 20.0):
        made.own(x=50.0, y=y)
        made.iterate()
        weights.append(weight(made))
    assert made.posted("VOI_STATE") == ["captured", "slipping", "activated"]
    assert weights[0] == 0.0
    assert weights[1] == pytest.approx(10.0 + 90.0 * (15.0 - 10.0) / 30.0)
    assert weights[2] == pytest.approx(10.0 + 90.0 * (30.0 - 10.0) / 30.0)
    assert weights[3:] == [100.0, 100.0], "once activated it stays so until captured"


def test_a_stale_cell_is_not_believed():
    made = rig("BHV_Voronoi", {**VORONOI, "stale_poly_thresh": 1.0}, x=5.0, y=80.0)
    give(made, PROXONOI_POLY="pts={0,0:90,0:0,90}", PROXONOI_REGION=SQUARE)
    made.iterate()
    assert made.decision["course"] == pytest.approx(bearing(5.0, 80.0, 45.0, 45.0), abs=0.5)
    for _ in range(6):
        made.iterate()
    assert made.decision["course"] == pytest.approx(bearing(5.0, 80.0, 50.0, 50.0), abs=0.5)


def test_leaving_clears_the_cell_app_s_contacts():
    made = rig("BHV_Voronoi", {**VORONOI, "condition": "GO = true"})
    give(made, GO="true")
    made.iterate()
    give(made, GO="false")
    made.iterate()
    assert made.posted("PROX_CLEAR") == ["true"]


# --- region search --------------------------------------------------------------------------------------


def test_the_smallest_distance_to_an_edge_sets_the_circle():
    assert edge_distance(REGION) == 50.0
    assert edge_distance(Polygon(((0.0, 0.0), (200.0, 0.0), (200.0, 60.0), (0.0, 60.0)))) == 30.0


@pytest.mark.parametrize(("x", "y", "course"), [(40, 0, 180), (0, 40, 90), (-40, 0, 0), (0, -40, 270)])
def test_on_the_circle_it_goes_round_clockwise(x, y, course):
    assert rotate_course(x, y, (0.0, 0.0), 40.0) == pytest.approx(course)


def test_inside_it_heads_out_and_far_outside_it_heads_in():
    assert rotate_course(10.0, 0.0, (0.0, 0.0), 40.0) == pytest.approx(90.0)
    assert rotate_course(44.0, 0.0, (0.0, 0.0), 40.0) == pytest.approx(200.0)
    assert rotate_course(400.0, 0.0, (0.0, 0.0), 40.0) == pytest.approx(270.0)


def sail(made, seconds, speed):
    """Follow the decisions as a vessel that turns at once; the places it was at."""
    x, y = 50.0, 50.0
    places = []
    for _ in range(int(seconds)):
        made.own(x=x, y=y, speed=speed)
        made.iterate()
        x, y = project_point(made.decision["course"], speed, x, y)
        places.append((x, y))
    return places


def test_rotating_it_settles_on_the_circle():
    made = rig("BHV_RegionSearchControl", {"op_region": SQUARE, "speed": 0.5})
    places = sail(made, 400, 0.5)
    assert made.decision["speed"] == 0.5
    radii = [hypot(x - 50.0, y - 50.0) for x, y in places[200:]]
    assert min(radii) > 38.0
    assert max(radii) < 43.0


@pytest.mark.parametrize("mode", ["stochastic", "stochastic_free"])
def test_random_legs_stay_in_the_region_and_differ(mode):
    made = rig("BHV_SearchControl", {"op_region": SQUARE, "speed": 1.0, "mode": mode})
    places = sail(made, 600, 1.0)
    assert all(-2.0 <= x <= 102.0 and -2.0 <= y <= 102.0 for x, y in places)
    corners = {(x > 50.0, y > 50.0) for x, y in places}
    assert len(corners) >= 3


def test_equal_seeds_give_equal_random_legs():
    runs = [
        sail(rig("BHV_SearchControl", {"op_region": SQUARE, "speed": 1.0, "mode": "stochastic"}), 100, 1.0)
        for _ in range(2)
    ]
    assert runs[0] == runs[1]


# --- into a region, and back into it ------------------------------------------------------------------------


def test_it_moves_to_the_nearest_point_of_the_region_and_is_done_inside():
    made = rig(
        "BHV_MoveToRegion",
        {"region": SQUARE, "speed": 1.0, "endflag": "ARRIVED = true", "perpetual": "true"},
        x=-30.0,
        y=20.0,
    )
    made.iterate()
    assert made.decision == {"course": 90.0, "speed": 1.0}
    assert made.posted("ARRIVED") == []
    made.own(x=1.0, y=20.0)
    made.iterate()
    assert made.posted("ARRIVED") == ["true"]


def test_the_region_to_move_to_can_be_replaced_at_run_time():
    made = rig("BHV_MoveToRegion", {"region": SQUARE, "speed": 1.0, "updates": "UP"}, x=150.0, y=50.0)
    give(made, UP="region=pts={300,0:400,0:400,100:300,100},label=two")
    made.iterate()
    made.iterate()
    assert made.decision["course"] == 90.0


def test_it_recovers_only_once_the_region_was_entered():
    recover = {"polygon": SQUARE, "trigger_entry_time": 0.5, "trigger_exit_time": 0.5}
    made = rig("BHV_OpRegionRecover", recover, x=-20.0, heading=270.0)
    for _ in range(5):
        made.iterate()
    assert weight(made) == 0.0
    made.own(x=20.0, y=50.0, heading=270.0)
    for _ in range(4):
        made.iterate()
    made.own(x=-20.0, y=50.0, heading=270.0)
    made.iterate()
    assert weight(made) == 0.0, "the exit time is not over"
    for _ in range(3):
        made.iterate()
    assert weight(made) > 0.0
    assert angle_diff(made.decision["course"], 90.0) < 90.0


def test_a_new_region_and_a_reset_make_it_wait_for_the_next_entry():
    recover = {
        "polygon": SQUARE, "trigger_entry_time": 0.0, "trigger_exit_time": 0.0,
        "dynamic_region_var": "CURR", "reset_var": "RESET",
    }  # fmt: skip
    made = rig("BHV_OpRegionRecover", recover)
    made.iterate()
    give(made, CURR="pts={300,0:400,0:400,100:300,100}", RESET="true")
    made.iterate()
    made.iterate()
    assert weight(made) == 0.0
    made.own(x=350.0, y=50.0)
    made.iterate()
    made.own(x=290.0, y=50.0, heading=270.0)
    made.iterate()
    assert weight(made) > 0.0


def test_a_buffer_lets_it_stray_a_little():
    made = rig("BHV_OpRegionRecover", {"polygon": SQUARE, "buffer_dist": 15, "trigger_exit_time": 0})
    for _ in range(6):
        made.iterate()
    made.own(x=-14.0, y=50.0, heading=270.0)
    made.iterate()
    assert weight(made) == 0.0
    made.own(x=-16.0, y=50.0, heading=270.0)
    made.iterate()
    assert weight(made) > 0.0
