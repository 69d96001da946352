"""The simulator apps in a community: configuration, inputs, outputs, switches."""

from __future__ import annotations

import math

import pytest
from golden_replay import load
from hypothesis import given, settings
from hypothesis import strategies as st
from marine_harness import Sea, warnings_of

from pymoos_lite.core.message import Message
from pymoos_lite.marine.buoyancy import BuoyancyJobs
from pymoos_lite.marine.sailing import Wind, parse_polar, parse_wind, sail_speed
from pymoos_lite.marine.simulator import LegacySimulator, Simulator, SimulatorV23
from pymoos_lite.marine.simulator_config import read_pose
from pymoos_lite.marine.wormholes import parse_wormhole

MAP = "thrust_map = 0:0, 20:1, 40:2, 60:3, 80:4, 100:5"
PID = """
yaw_pid_kp = 0.9
yaw_pid_kd = 0.3
yaw_pid_ki = 0.3
yaw_pid_integral_limit = 0.07
speed_factor = 20
depth_control = false
"""


def sea_with(
    config: str = "", cls: type[Simulator] = Simulator, origin: bool = True
) -> tuple[Sea, Simulator]:
    sea = Sea(origin)
    return sea, sea.add(cls, "uSimMarineV22", f"prefix = NAV\nAppTick = 20\n{config}")


def test_navigation_goes_out_at_every_second_iteration_and_legacy_at_every_one() -> None:
    counts = []
    for cls in (Simulator, SimulatorV23, LegacySimulator):
        sea, _ = sea_with("DEPRECATED_OK = true", cls)
        sea.run(10.0)
        counts.append(len(sea.heard("NAV_X")))
    assert counts[0] == pytest.approx(100, abs=1)
    assert counts[1] == counts[0]
    assert counts[2] == pytest.approx(200, abs=1)


def test_every_documented_output_is_posted() -> None:
    sea, _ = sea_with(
        "start_pos = x=10,y=-20,heading=90,speed=2\ndefault_water_depth = 30\npost_navpos_summary = true"
    )
    sea.run(1.0)
    expected = "X Y HEADING SPEED DEPTH LAT LONG HEADING_OVER_GROUND SPEED_OVER_GROUND ALTITUDE Z PITCH YAW"
    for suffix in expected.split():
        assert isinstance(sea.last(f"NAV_{suffix}"), float), suffix
    assert sea.last("SIMULATION_MODE") == "TRUE"
    assert sea.last("TRUE_X") == sea.last("NAV_X")
    assert sea.last("NAV_YAW") == pytest.approx(-math.pi / 2)
    assert sea.last("NAV_ALTITUDE") == 30.0
    assert sea.last("NAV_LAT") == pytest.approx(43.8251, abs=2e-4)
    assert sea.last("USM_NAVPOS_SUMMARY").startswith(f"x={sea.last('NAV_X'):.3f}".rstrip("0"))
    assert sea.heard("USM_DRIFT_SUMMARY") == ["ang=0, mag=0, xmag=0, ymag=0"]


def test_without_an_origin_there_is_no_latitude_and_the_configuration_warns() -> None:
    sea, app = sea_with(origin=False)
    sea.run(1.0)
    assert sea.heard("NAV_X")
    assert not sea.heard("NAV_LAT")
    assert any("LatOrigin" in text for text in app.log.config_warnings)


def test_with_depth_control_off_the_underwater_outputs_are_silent() -> None:
    sea, _ = sea_with(PID)
    sea.run(1.0)
    assert not sea.heard("NAV_PITCH")
    assert not sea.heard("SIMULATION_MODE")


@pytest.mark.parametrize(
    ("text", "pose"),
    [
        ("x=0,y=-20,heading=180, 2", {"x": 0.0, "y": -20.0, "heading": 180.0, "speed": 2.0}),
        ("5, 6, 7, 8, 9", {"x": 5.0, "y": 6.0, "heading": 7.0, "speed": 8.0, "depth": 9.0}),
        ("hdg=90, spd=1, dep=3", {"heading": 90.0, "speed": 1.0, "depth": 3.0}),
        ("x=1,banana=2,y=3", {"x": 1.0}),
        ("x=1,2,3,4,5,6", {"x": 1.0, "y": 2.0, "heading": 3.0, "speed": 4.0, "depth": 5.0}),
    ],
)
def test_a_start_position_may_mix_named_and_placed_elements(text: str, pose: dict[str, float]) -> None:
    read = read_pose(text)
    assert read.parts == pose
    assert (read.problem is None) == ("banana" not in text and not text.endswith("6"))


def test_a_faulty_start_position_keeps_what_stands_before_the_fault_and_is_reported() -> None:
    sea, app = sea_with("start_pos = x=40,banana=2,y=3")
    sea.run(0.5)
    assert sea.last("NAV_X") == 40.0
    assert sea.last("NAV_Y") == 0.0
    assert any("banana" in text and "test.moos:3" in text for text in app.log.config_warnings)


def test_a_faulty_thrust_map_keeps_its_first_pairs_in_v22_and_stops_v23() -> None:
    speeds = []
    for cls in (Simulator, SimulatorV23):
        sea, app = sea_with("thrust_map = 20:1, 40:2, 60:0.5, 100:5", cls)
        assert any("thrust_map" in text for text in app.log.config_warnings)
        sea.post("DESIRED_THRUST", 100)
        sea.run(5.0)
        speeds.append(sea.last("NAV_SPEED"))
    assert speeds == [2.0, 0.0]


def test_published_speed_is_rounded_and_capped_while_the_vessel_sails_faster() -> None:
    sea, app = sea_with(f"{MAP}\nmax_speed = 2.005")
    sea.post("DESIRED_THRUST", 60)
    sea.run(10.0)
    assert sea.last("NAV_SPEED") == 2.005
    assert app.vessel.speed == pytest.approx(3.0)
    assert all(speed in (2.005, round(speed, 2)) for speed in sea.heard("NAV_SPEED"))


def test_drift_mail_sets_adds_and_scales() -> None:
    sea, app = sea_with()
    sea.post("DRIFT_VECTOR", "90,0.5")
    sea.run(0.2)
    sea.post("DRIFT_VECTOR_ADD", "0,0.3")
    sea.run(0.2)
    sea.post("DRIFT_VECTOR_MULT", 2)
    sea.run(0.2)
    assert app.vessel.drift_x == pytest.approx(1.0)
    assert app.vessel.drift_y == pytest.approx(0.6)
    assert sea.last("USM_DRIFT_SUMMARY") == "ang=59.04, mag=1.17, xmag=1, ymag=0.6"
    sea.post("CURRENT_X", 0.25)
    sea.post("DRIFT_Y", "0")
    sea.run(0.2)
    assert (app.vessel.drift_x, app.vessel.drift_y) == (0.25, 0.0)
    assert sea.last("NAV_SPEED_OVER_GROUND") == pytest.approx(0.25)
    assert sea.last("NAV_HEADING_OVER_GROUND") == pytest.approx(90.0)


def test_a_reset_moves_only_what_it_names_and_is_counted() -> None:
    sea, _ = sea_with("start_pos = 10,20,30,2,0")
    sea.post("USM_RESET", "x=100,hdg=45")
    sea.run(0.2)
    assert sea.heard("USM_RESET_COUNT") == [2.0]
    assert sea.last("NAV_X") == pytest.approx(100.0, abs=1.0)
    assert sea.last("NAV_Y") == pytest.approx(20.0, abs=1.0)
    assert sea.last("NAV_HEADING") == pytest.approx(45.0)


@pytest.mark.parametrize(
    ("switch", "on", "off"), [("USM_SIM_PAUSED", "true", "false"), ("OBSTACLE_HIT", "true", "false")]
)
def test_a_frozen_vessel_stays_where_it_is_and_does_not_jump_afterwards(
    switch: str, on: str, off: str
) -> None:
    sea, _ = sea_with("start_speed = 2\nmax_deceleration = 0.01")
    sea.run(1.0)
    sea.post(switch, on)
    sea.run(0.5)
    before = sea.last("NAV_Y")
    sea.run(10.0)
    assert sea.last("NAV_Y") == before
    assert (sea.last("NAV_SPEED") == 0.0) == (switch == "OBSTACLE_HIT")
    sea.post(switch, off)
    sea.run(0.5)
    assert sea.last("NAV_Y") - before == pytest.approx(0.5 * sea.last("NAV_SPEED"), abs=0.25)


def test_a_disabled_simulator_is_silent_and_follows_outside_navigation() -> None:
    sea, app = sea_with("start_speed = 1")
    sea.run(1.0)
    sea.post("USM_ENABLED", "false")
    sea.run(0.5)
    sea.forget()
    for name, value in (("NAV_X", 77), ("NAV_Y", 88), ("NAV_HEADING", 99)):
        sea.post(name, value)
    sea.run(2.0)
    assert len(sea.heard("NAV_X", source="uSimMarineV22")) == 0
    assert (app.vessel.x, app.vessel.y, app.vessel.heading) == (77.0, 88.0, 99.0)
    sea.post("USM_ENABLED", "true")
    sea.run(0.5)
    assert sea.last("NAV_X") == pytest.approx(77.0, abs=1.0)
    sea.run(0.5)
    assert not warnings_of(app)


def test_run_time_parameters_are_taken_and_clipped() -> None:
    sea, app = sea_with()
    sea.post("USM_TURN_RATE", 400)
    sea.post("USM_TURN_RADIUS", 12)
    sea.post("BUOYANCY_RATE", 0.1)
    sea.post("ROTATE_SPEED", 7)
    sea.post("WATER_DEPTH", 25)
    sea.run(0.3)
    parameters = app.vessel.parameters
    assert (parameters.turn_rate, parameters.turn_radius, parameters.buoyancy_rate) == (100.0, 12.0, 0.1)
    assert app.vessel.rotate_speed == 7.0
    assert sea.last("NAV_ALTITUDE") == 25.0
    sea.post("WATER_DEPTH", -1)
    sea.run(0.3)
    assert sea.last("NAV_ALTITUDE") == 25.0
    assert warnings_of(app)


def test_in_differential_mode_only_the_two_thrusters_count() -> None:
    sea, app = sea_with(f"thrust_mode_diff = differential\n{MAP}")
    sea.post("DESIRED_THRUST", 100)
    sea.post("DESIRED_RUDDER", 100)
    sea.run(1.0)
    assert sea.last("NAV_SPEED") == 0.0
    sea.post("DESIRED_THRUST_L", 250)
    sea.post("DESIRED_THRUST_R", 60)
    sea.run(1.0)
    assert app.vessel.thrust_left == 100.0
    assert sea.last("NAV_SPEED") > 2.0
    sea.post("THRUST_MODE_DIFFERENTIAL", "normal")
    sea.run(0.2)
    sea.post("DESIRED_THRUST", 20)
    sea.run(0.2)
    assert app.vessel.thrust == 20.0


def test_reverse_mode_shows_the_heading_turned_round() -> None:
    sea, _ = sea_with("thrust_mode_reverse = reverse\nstart_heading = 30\nthrust_reflect = true")
    sea.post("DESIRED_THRUST", 40)
    sea.run(10.0)
    assert sea.last("NAV_HEADING") == pytest.approx(210.0)
    assert sea.last("NAV_SPEED") == -2.0
    assert sea.last("NAV_Y") < 0.0


def test_in_dual_state_only_the_ground_truth_drifts() -> None:
    sea, app = sea_with("dual_state = true\ndrift_vector = 90,1")
    sea.run(5.0)
    assert sea.last("NAV_X") == 0.0
    assert sea.last("NAV_GT_X") == pytest.approx(5.0, abs=0.2)
    assert sea.last("TRUE_X") == sea.last("NAV_GT_X")
    sea.post("USM_RESET_NAV", "now")
    sea.run(0.1)
    assert app.vessel.x == pytest.approx(5.0, abs=0.3)


def test_a_vessel_with_a_pid_on_board_ignores_outside_actuators_and_steers_itself() -> None:
    sea, app = sea_with(f"{MAP}\n{PID}\npost_des_rudder = RUDX\npost_des_thrust = THRX")
    sea.post("MOOS_MANUAL_OVERRIDE", "false")
    sea.run(0.2)
    for _ in range(60):
        sea.post("DESIRED_THRUST", 100)
        sea.post("DESIRED_HEADING", 90)
        sea.post("DESIRED_SPEED", 2)
        sea.run(0.5)
    assert sea.last("NAV_HEADING") == pytest.approx(90.0, abs=2.0)
    assert sea.last("NAV_SPEED") == pytest.approx(2.0, abs=0.05)
    assert sea.last("THRX") == 40.0
    assert sea.heard("PID_HAS_CONTROL") == ["true"]
    sea.run(3.0)
    assert sea.last("THRX") == 0.0
    assert sea.last("PID_STALE").startswith("Stale Des")
    assert not warnings_of(app)


def test_a_pid_on_board_heeds_the_manual_override() -> None:
    sea, _ = sea_with(f"{MAP}\n{PID}\npost_des_thrust = THRX\nsimulation = true")
    sea.run(0.2)
    sea.post("DESIRED_HEADING", 90)
    sea.post("DESIRED_SPEED", 2)
    sea.run(1.0)
    assert sea.last("THRX") == 0.0
    sea.post("MOOS_MANUAL_OVERIDE", "FALSE")
    sea.run(0.2)
    sea.post("DESIRED_HEADING", 90)
    sea.post("DESIRED_SPEED", 2)
    sea.run(1.0)
    assert sea.last("THRX") == 40.0
    sea.post("MOOS_MANUAL_OVERRIDE", "true")
    sea.run(1.0)
    assert sea.last("THRX") == 0.0


def test_desired_values_from_another_clock_are_not_believed() -> None:
    sea, app = sea_with(PID)
    sea.run(0.2)
    sea.post("DESIRED_SPEED", 2, time=sea.now - 2000.0)
    sea.run(0.2)
    assert sea.last("USM_NOGO") == pytest.approx(2000.0, abs=1.0)
    assert any("not believed" in text for text in warnings_of(app))


def test_wind_and_polar_plot_cap_the_speed_and_the_fan_of_v23_adds_to_it() -> None:
    sail = "wind_conditions = spd=4, dir=0\npolar_plot = 0,0: 90,50: 180,25\nstart_heading = 90"
    sea, _ = sea_with(f"{sail}\n{MAP}")
    sea.post("DESIRED_THRUST", 100)
    sea.run(10.0)
    assert sea.last("NAV_SPEED") == 2.0
    assert "ang=180" in sea.last("VIEW_ARROW")
    sea.post("WIND_CONDITIONS", "spd=2, dir=0")
    sea.run(20.0)
    assert sea.last("NAV_SPEED") == 1.0
    sea, _ = sea_with(f"{sail}\n{MAP}\nthrust_map_fan = 100:1", SimulatorV23)
    sea.post("DESIRED_THRUST", 100)
    sea.post("DESIRED_FAN", 50)
    sea.run(10.0)
    assert sea.last("NAV_SPEED") == 2.5


def test_a_polar_plot_is_the_same_on_both_sides_of_the_wind() -> None:
    polar, wind = parse_polar("30,20: 90,80: 150,60"), Wind(5.0, 350.0)
    assert sail_speed(polar, wind, 20.0) == sail_speed(polar, wind, 320.0) == pytest.approx(1.0)
    assert sail_speed(polar, wind, 50.0) == pytest.approx(2.5)
    assert sail_speed(polar, wind, 350.0) == pytest.approx(1.0)
    assert sail_speed(polar, wind, 170.0) == pytest.approx(3.0)
    for bad in ("190,2", "10,-1", "10,1: 10,2", "banana", "10"):
        with pytest.raises(ValueError):
            parse_polar(bad)
    for bad in ("spd=4", "spd=-1, dir=3", "spd=x, dir=3", "banana"):
        with pytest.raises(ValueError):
            parse_wind(bad)


def test_a_wormhole_fades_the_vessel_out_and_lets_it_come_back_elsewhere() -> None:
    sea, app = sea_with(
        "wormhole = tag=one, madrid_poly={-5,5:5,5:5,25:-5,25}\n"
        "wormhole = tag=one, weber_poly={95,5:105,5:105,25:95,25}, connection=both, delay=3\n"
        f"{MAP}"
    )
    sea.post("DESIRED_THRUST", 20)
    sea.run(30.0)
    assert sea.last("NAV_X") == pytest.approx(100.0)
    opacity = sea.heard("NAV_TRANSP")
    assert min(opacity) < 0.05
    assert opacity[-1] == 1.0
    assert opacity[0] > 0.95
    assert len(app.log.events) == 1  # it does not fall back into the mouth that it came out of
    assert {text.rpartition("label=")[2].split(",")[0] for text in sea.heard("VIEW_POLYGON")} == {
        "one_madrid",
        "one_weber",
    }


@pytest.mark.parametrize(
    "text",
    ["madrid_poly={0,0:9,0:9,9}", "tag=a, colour=red", "tag=a, weber_poly={0,0:1,1}", "tag=a, connection=up"],
)
def test_a_faulty_wormhole_is_refused(text: str) -> None:
    with pytest.raises(ValueError):
        parse_wormhole(text)


def test_buoyancy_and_trim_requests_are_answered_as_they_progress() -> None:
    sea, app = sea_with()
    sea.post("BUOYANCY_CONTROL", "true")
    sea.post("TRIM_CONTROL", "true")
    sea.run(1.0)
    assert sea.heard("BUOYANCY_REPORT") == ["status=1,error=0,progressing,buoyancy=0.0"]
    assert app.vessel.parameters.buoyancy_rate == 0.0
    sea.run(6.0)
    assert sea.last("BUOYANCY_REPORT") == "status=2,error=0,completed,buoyancy=0.0"
    assert sea.last("TRIM_REPORT") == "status=2,error=0,completed,trim_pitch=0.00000,trim_roll=0.0"


def test_trim_of_a_vessel_that_stays_tilted_ends_at_its_delay() -> None:
    jobs = BuoyancyJobs(trim_tolerance=5.0, max_trim_delay=12.0)
    jobs.start_trim(100.0)
    posts = [post for t in range(1, 20) for post in jobs.step(0.5, 100.0 + t)]
    assert [text.split(",")[0] for _, text in posts] == ["status=1", "status=1", "status=2"]
    assert "trim_pitch=28.64789" in posts[-1][1]


def test_old_names_of_the_deprecated_simulator_still_work() -> None:
    config = "startheading = 40\nstartspeed = 1\nforce_vector = 90,0.5\nforce_theta = 3"
    sea, app = sea_with(config, LegacySimulator)
    assert (app.vessel.heading, app.vessel.speed) == (40.0, 1.0)
    assert app.vessel.drift_x == pytest.approx(0.5)
    assert app.vessel.rotate_speed == 3.0
    sea.run(0.2)
    assert any("deprecated" in text for text in warnings_of(app))


def test_mail_that_makes_no_sense_is_a_run_warning_and_nothing_else() -> None:
    sea, app = sea_with("MAX_APPCAST_RUN_WARNINGS = 100")
    before = app.vessel.pose()
    for name, value in (
        ("DESIRED_THRUST", "full"),
        ("DESIRED_RUDDER", math.nan),
        ("DESIRED_ELEVATOR", math.inf),
        ("DRIFT_VECTOR", "north"),
        ("DRIFT_VECTOR_ADD", "1,2,3"),
        ("DRIFT_VECTOR_MULT", "inf"),
        ("USM_RESET", "nowhere"),
        ("USM_SIM_PAUSED", "perhaps"),
        ("THRUST_MODE_REVERSE", "sideways"),
        ("WIND_CONDITIONS", "breezy"),
        ("ROTATE_SPEED", "1e999"),
    ):
        sea.post(name, value)
    sea.run(1.0)
    assert app.vessel.pose() == before
    assert len(warnings_of(app)) == 11


def test_an_elephantine_drift_is_refused() -> None:
    sea, app = sea_with()
    sea.post("DRIFT_X", 1e300)
    sea.run(0.2)
    for _ in range(200):
        sea.post("DRIFT_VECTOR", "0,100")
        sea.post("DRIFT_VECTOR_MULT", 9)
        sea.run(0.05)
    sea.run(1.0)
    assert math.hypot(app.vessel.drift_x, app.vessel.drift_y) <= 1000.0
    assert math.isfinite(sea.last("NAV_Y"))


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(
                [
                    "DESIRED_THRUST",
                    "DESIRED_RUDDER",
                    "DESIRED_ELEVATOR",
                    "DRIFT_VECTOR",
                    "DRIFT_VECTOR_MULT",
                    "DRIFT_X",
                    "USM_RESET",
                    "USM_ENABLED",
                    "OBSTACLE_HIT",
                    "USM_TURN_RATE",
                    "USM_TURN_RADIUS",
                    "ROTATE_SPEED",
                    "BUOYANCY_RATE",
                    "WATER_DEPTH",
                    "THRUST_MODE_REVERSE",
                    "THRUST_MODE_DIFFERENTIAL",
                    "WIND_CONDITIONS",
                    "NAV_X",
                ]
            ),
            st.one_of(
                st.floats(),
                st.text(max_size=30),
                st.binary(max_size=5),
                st.sampled_from(["true", "false", "1,2", "90,5", "x=1,y=2", "spd=3,dir=9", "reverse"]),
            ),
        ),
        max_size=12,
    )
)
def test_no_mail_whatever_makes_the_simulator_fall_over(mail: list[tuple[str, float | str | bytes]]) -> None:
    sea, app = sea_with("polar_plot = 0,10: 180,90")
    app.now = sea.now
    for name, value in mail:
        app.on_mail([Message(name, value, sea.now, "tester")])
        sea.run(0.1)
    sea.run(0.5)
    assert all(math.isfinite(part) for part in app.vessel.pose())
    assert all(isinstance(line, str) for line in app.report())


@pytest.mark.parametrize("name", ["thrust_step", "rudder_step", "pid_embedded"])
def test_the_app_with_the_recorded_configuration_sails_the_recorded_track(name: str) -> None:
    recording = load(name, steps_per_row=1)
    sea, _ = sea_with(
        "\n".join(f"{key} = {value}" for key, value in recording.config.items() if key != "prefix")
    )
    names = {"DESIRED_THRUST", "DESIRED_RUDDER", "DESIRED_HEADING", "DESIRED_SPEED", "MOOS_MANUAL_OVERRIDE"}
    start = sea.now
    for stamp, variable, text in recording.inputs:
        if variable in names:
            sea.host.poke(stamp, variable, text if variable.startswith("MOOS") else float(text))
    sea.run(recording.rows[-1]["t"] + 0.5)
    times = [m.time - start for m in sea.recorder.heard if m.name == "NAV_X"]
    track = list(zip(sea.heard("NAV_X"), sea.heard("NAV_Y"), strict=True))
    distance_run = 0.0
    former = recording.rows[0]
    index = 0
    for row in recording.rows:
        distance_run += math.hypot(row["NAV_X"] - former["NAV_X"], row["NAV_Y"] - former["NAV_Y"])
        former = row
        while index + 1 < len(times) and times[index + 1] <= row["t"]:
            index += 1
        off = math.hypot(track[index][0] - row["NAV_X"], track[index][1] - row["NAV_Y"])
        assert off <= 0.5 + 0.02 * distance_run + 0.3, f"{name} at {row['t']} s"
    assert distance_run > 40.0


def test_the_report_names_state_and_position() -> None:
    sea, app = sea_with(f"{PID}\nwind_conditions = spd=4,dir=90\nthrust_mode_diff = true\ndual_state = true")
    sea.post("USM_SIM_PAUSED", "true")
    sea.run(0.5)
    text = "\n".join(app.report())
    assert "paused" in text
    assert "x=0, y=0" in text
    assert "4 m/s from 90" in text
