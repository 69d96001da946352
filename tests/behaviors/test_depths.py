"""BHV_GoToDepth and BHV_PeriodicSurface beyond the measured cases (behaviors.md C20, C22)."""

from __future__ import annotations

import pytest
from sailing import Sailor

from ivp_helm.testing import HelmRig

DEPTH = ("depth:0:100:101",)
UNDER_WATER = ("speed:0:4:41", "depth:0:100:101")


def go(**parameters):
    return HelmRig([("BHV_GoToDepth", {"name": "go", **parameters})], domain=DEPTH)


def test_it_goes_to_each_depth_stays_there_and_completes():
    rig = go(depth="10,4:20,2:5", capture_flag="HERE", endflag="DONE=1")
    sailor = Sailor(rig, dive_rate=2.0)
    reached = []
    assert sailor.sail(60, lambda s: reached.append(round(s.depth)) or not list(rig.core.population))
    assert rig.posted("GTD_HERE") == [1.0, 2.0, 3.0]
    assert rig.posted("LEVEL_DEPTH") == [20.0, 5.0]
    assert rig.posted("DONE") == [1.0]
    assert reached.count(10) >= 16
    assert max(reached) == 20


def test_it_repeats_its_depths():
    rig = go(depth="4:2", repeat=2, capture_flag="HERE")
    sailor = Sailor(rig, dive_rate=2.0)
    assert sailor.sail(60, lambda s: not list(rig.core.population))
    assert rig.posted("GTD_HERE")[-1] == 6.0


def test_passing_a_depth_between_two_iterations_is_arriving():
    rig = go(depth="10,100", capture_delta=0.5, capture_flag="HERE")
    rig.own(depth=8.0)
    rig.iterate()
    assert rig.posted("GTD_HERE") == []
    rig.own(depth=12.0)
    rig.iterate()
    assert rig.posted("GTD_HERE") == [1.0]


def test_further_lines_append_depths():
    rig = go(depth=["10", "20,5"])
    assert rig.life("go").behavior.config.depth == ((10.0, 0.0), (20.0, 5.0))


@pytest.mark.parametrize("text", ["", "deep", "10,5,3", "-4", "10:"])
def test_faulty_depths_are_configuration_errors(text):
    rig = HelmRig([("BHV_GoToDepth", {"name": "go", "depth": text})], domain=DEPTH, faulty=True)
    assert rig.core.authority.malconfig


def test_no_depth_at_all_is_a_configuration_error():
    rig = HelmRig([("BHV_GoToDepth", {"name": "go"})], domain=DEPTH, faulty=True)
    assert "no depth is given" in " ".join(str(p) for p in rig.core.problems)


# --- coming up --------------------------------------------------------------------------------------------


def surface(**parameters):
    given = {"name": "up", "period": 5, "max_time_at_surface": 3, "ascent_speed": 2, **parameters}
    rig = HelmRig([("BHV_PeriodicSurface", given)], domain=UNDER_WATER)
    return rig, Sailor(rig, dive_rate=2.0)


def test_it_waits_comes_up_stays_and_waits_again():
    rig, vessel = surface()
    vessel.depth = 10.0
    vessel.sail(5)
    assert rig.reason == "NothingToDo"
    assert vessel.sail(20, lambda s: rig.posted("PERIODIC_ASCEND") == ["true", "false"])
    assert vessel.depth == 0.0
    assert vessel.sail(5, lambda s: rig.posted("PSF_AT_SURFACE_TIMEOUT"))
    assert str(rig.posted("PSF_AT_SURFACE_TIMEOUT")[0]).startswith("Timestamp=17000000")
    assert max(rig.posted("TIME_AT_SURFACE")) == 3.0
    vessel.sail(0.5)
    assert rig.posted("PENDING_SURFACE")[-1] == 5.0


def test_a_mark_ends_the_stay_and_begins_a_new_wait():
    rig, vessel = surface()
    vessel.depth = 4.0
    assert vessel.sail(20, lambda s: rig.posted("PERIODIC_ASCEND") == ["true", "false"])
    rig.mail("GPS_UPDATE_RECEIVED", "fix=1")
    vessel.sail(0.5)
    assert rig.reason == "NothingToDo"
    assert rig.posted("PENDING_SURFACE")[-1] == 5.0


def test_marks_while_waiting_put_the_ascent_off():
    rig, vessel = surface()
    vessel.depth = 4.0
    for _ in range(10):
        rig.mail("GPS_UPDATE_RECEIVED", "fix")
        vessel.sail(2)
    assert rig.posted("PERIODIC_ASCEND") == []


def test_acoustic_messages_put_it_off_only_so_far():
    rig, vessel = surface(acomms_mark_variable="ACOMMS,4,6")
    vessel.depth = 4.0
    for _ in range(4):
        rig.mail("ACOMMS", "x")
        vessel.sail(0.25)
    assert rig.posted("PENDING_SURFACE")[:2] == [9.0, 11.0]
    assert not vessel.sail(9.5, lambda s: rig.posted("PERIODIC_ASCEND"))
    assert vessel.sail(1.5, lambda s: rig.posted("PERIODIC_ASCEND"))


@pytest.mark.parametrize(
    ("grade", "speed"), [("linear", 1.0), ("quadratic", 0.5), ("quasi", 0.7), ("fullspeed", 2.0)]
)
def test_speed_falls_on_the_way_up_by_the_grade(grade, speed):
    rig, _ = surface(ascent_grade=grade, period=0)
    rig.own(depth=20.0)
    rig.iterate()
    assert rig.decision["speed"] == 2.0
    rig.own(depth=10.0)
    rig.iterate()
    assert rig.decision == {"speed": pytest.approx(speed), "depth": 0.0}


def test_the_ascent_may_begin_with_the_present_speed():
    rig, _ = surface(ascent_speed="current", period=0)
    rig.own(speed=1.3, depth=20.0)
    rig.iterate()
    assert rig.decision["speed"] == pytest.approx(1.3)
