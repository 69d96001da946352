"""The PID controller as an app: what it posts, when it stops, what it ignores."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from marine_harness import Sea, warnings_of

from pymoos_lite.core.message import Message
from pymoos_lite.marine.pid_app import LegacyPidController, PidController
from pymoos_lite.marine.simulator import Simulator

GAINS = """
AppTick = 20
yaw_pid_kp = 0.9
yaw_pid_kd = 0.3
yaw_pid_ki = 0.3
yaw_pid_integral_limit = 0.07
speed_pid_kp = 1.0
speed_pid_kd = 0
speed_pid_ki = 0
speed_pid_integral_limit = 0.07
depth_control = false
speed_factor = 20
"""


def sea_with(config: str = "", cls: type[PidController] = PidController) -> tuple[Sea, PidController]:
    sea = Sea()
    return sea, sea.add(cls, "pMarinePIDV22", GAINS + config)


def feed(sea: Sea, heading: float = 80.0, speed: float = 1.5) -> None:
    for name, value in (
        ("DESIRED_HEADING", 90.0),
        ("DESIRED_SPEED", 2.0),
        ("NAV_HEADING", heading),
        ("NAV_SPEED", speed),
    ):
        sea.post(name, value)


def test_zeros_are_posted_once_at_start_up_and_then_nothing_until_control() -> None:
    sea, _ = sea_with()
    sea.run(5.0)
    assert sea.heard("DESIRED_RUDDER") == [0.0]
    assert sea.heard("DESIRED_THRUST") == [0.0]
    assert sea.heard("DESIRED_ELEVATOR") == []


def test_with_control_the_outputs_go_out_at_every_iteration() -> None:
    sea, _ = sea_with()
    sea.post("MOOS_MANUAL_OVERRIDE", "false")
    sea.run(0.2)
    feed(sea)
    sea.run(1.0)
    assert 18 <= len(sea.heard("DESIRED_RUDDER")) - 1 <= 20
    assert sea.heard("DESIRED_RUDDER")[1] == pytest.approx(9.0)
    assert sea.last("DESIRED_THRUST") == 40.0
    assert sea.heard("PID_HAS_CONTROL") == ["true"]


def test_stale_inputs_are_named_and_stop_the_vessel_once() -> None:
    sea, _ = sea_with()
    sea.post("MOOS_MANUAL_OVERRIDE", "false")
    sea.run(0.2)
    feed(sea)
    sea.run(5.0)
    assert sea.last("DESIRED_THRUST") == 0.0
    assert sea.heard("DESIRED_THRUST")[-2] == 40.0
    texts = {text.split(":")[0] for text in sea.heard("PID_STALE")}
    assert texts == {"Stale DesHdg", "Stale DesSpd", "Stale NavHdg", "Stale NavSpd"}
    feed(sea)
    sea.run(0.3)
    assert sea.last("DESIRED_THRUST") == 40.0


def test_an_override_stops_the_vessel_and_is_told_only_when_it_changes() -> None:
    sea, _ = sea_with()
    for word in ("false", "false", "true", "true", "FALSE"):
        sea.post("MOOS_MANUAL_OVERRIDE", word)
        sea.run(0.2)
    assert sea.heard("PID_HAS_CONTROL") == ["true", "true", "false", "true"]
    feed(sea)
    sea.run(0.5)
    assert sea.last("DESIRED_THRUST") == 40.0
    sea.post("MOOS_MANUAL_OVERIDE", "true")
    sea.run(0.5)
    assert sea.heard("DESIRED_THRUST")[-2:] == [40.0, 0.0]


def test_simulation_mode_drives_without_fresh_inputs() -> None:
    sea, _ = sea_with("simulation = true")
    sea.post("MOOS_MANUAL_OVERRIDE", "false")
    sea.run(0.2)
    feed(sea)
    sea.run(20.0)
    assert sea.last("DESIRED_THRUST") == 40.0
    assert not sea.heard("PID_STALE")


def test_yaw_gives_the_heading_unless_it_is_to_be_ignored() -> None:
    for ignore, expected in (("false", 90.0), ("true", 80.0)):
        sea, app = sea_with(f"ignore_nav_yaw = {ignore}")
        sea.run(0.1)
        sea.post("NAV_HEADING", 80)
        sea.run(0.1)
        sea.post("NAV_YAW", -math.pi / 2)
        sea.run(0.1)
        assert app.engine.nav_heading == pytest.approx(expected)


def test_outputs_can_carry_a_suffix() -> None:
    sea, _ = sea_with("output_suffix = _aux")
    sea.run(0.2)
    assert sea.heard("DESIRED_THRUST_AUX") == [0.0]


def test_a_thrust_cap_holds_between_20_and_100_when_enabled() -> None:
    for enabled, expected in (("true", 25.0), ("false", 40.0)):
        sea, _ = sea_with(f"enable_thrust_cap = {enabled}")
        sea.post("MOOS_MANUAL_OVERRIDE", "false")
        sea.run(0.2)
        feed(sea)
        if enabled == "true":
            sea.post("PID_THRUST_CAP", "25")
        sea.run(0.2)
        assert sea.last("DESIRED_THRUST") == expected
    sea, app = sea_with("enable_thrust_cap = true")
    sea.post("PID_THRUST_CAP", 3)
    sea.run(0.1)
    assert app.engine.thrust_cap == 20.0


def test_a_speed_factor_by_mail_replaces_the_configured_one() -> None:
    sea, app = sea_with()
    sea.post("SPEED_FACTOR", 33)
    sea.run(0.1)
    assert app.engine.speed_factor == 33.0
    sea.post("SPEED_FACTOR", -1)
    sea.run(0.1)
    assert app.engine.speed_factor == 33.0
    assert warnings_of(app)


def test_mail_from_another_clock_and_mail_without_a_number_is_not_believed() -> None:
    sea, app = sea_with()
    sea.run(0.1)
    sea.post("NAV_SPEED", 5, time=sea.now - 400.0)
    sea.post("NAV_HEADING", "north")
    sea.post("DESIRED_SPEED", math.nan)
    sea.run(0.1)
    assert app.engine.nav_speed == 0.0
    assert len(warnings_of(app)) == 3


def test_depth_control_drives_the_elevator() -> None:
    sea, _ = sea_with("depth_control = true\nz_to_pitch_pid_kp = 0.2\npitch_pid_kp = 0.5\nmaxelevator = 13")
    sea.post("MOOS_MANUAL_OVERRIDE", "false")
    sea.run(0.2)
    feed(sea)
    for name, value in (("DESIRED_DEPTH", 10), ("NAV_DEPTH", 0), ("NAV_PITCH", 0)):
        sea.post(name, value)
    sea.run(0.2)
    # 2 rad of pitch asked for, held to 15 degrees; half of it as elevator
    assert sea.last("DESIRED_ELEVATOR") == pytest.approx(7.5)


def test_debug_posts_appear_only_on_request() -> None:
    for switch, wanted in (("heading_debug = true", True), ("", False)):
        sea, _ = sea_with(f"{switch}\nmaxrudder = 5")
        sea.post("MOOS_MANUAL_OVERRIDE", "false")
        sea.run(0.2)
        feed(sea)
        sea.run(0.06)
        assert bool(sea.heard("PID_HDG_DEBUG")) == wanted
        assert bool(sea.heard("PID_MAX_SAT_HDG_DEBUG")) == wanted


def test_gains_of_a_loop_in_use_that_are_missing_are_mentioned() -> None:
    sea = Sea()
    app = sea.add(PidController, "pid", "yaw_pid_kp = 1\nspeed_factor = 20\ndepth_control = false")
    assert app.log.config_warnings == ["yaw_pid_kd, yaw_pid_ki, yaw_pid_integral_limit not given: 0 is used"]


def test_the_old_pid_repeats_thrust_zero_while_tardy_and_judges_freshness_by_groups() -> None:
    sea, app = sea_with(cls=LegacyPidController)
    sea.post("MOOS_MANUAL_OVERRIDE", "false")
    sea.run(0.2)
    feed(sea)
    for _ in range(8):
        sea.post("DESIRED_HEADING", 90)
        sea.post("NAV_HEADING", 80)
        sea.run(0.5)
    assert app.engine.has_control  # speeds are old, but something of each group came
    sea.forget()
    sea.run(4.0)
    assert sea.heard("DESIRED_THRUST")[-10:] == [0.0] * 10


def test_simulator_and_controller_together_hold_course_and_speed() -> None:
    sea, app = sea_with()
    sea.add(Simulator, "uSimMarineV22", "prefix = NAV\nAppTick = 10\nthrust_map = 0:0, 100:5")
    sea.post("MOOS_MANUAL_OVERRIDE", "false")
    sea.run(0.2)
    for _ in range(120):
        sea.post("DESIRED_HEADING", 135)
        sea.post("DESIRED_SPEED", 2)
        sea.run(0.5)
    assert sea.last("NAV_HEADING") == pytest.approx(135.0, abs=2.0)
    assert sea.last("NAV_SPEED") == pytest.approx(2.0, abs=0.05)
    assert "in control" in "\n".join(app.report())


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(
                [
                    "DESIRED_HEADING",
                    "DESIRED_SPEED",
                    "NAV_HEADING",
                    "NAV_SPEED",
                    "NAV_YAW",
                    "SPEED_FACTOR",
                    "MOOS_MANUAL_OVERRIDE",
                    "PID_THRUST_CAP",
                    "PID_VERBOSE",
                ]
            ),
            st.one_of(st.floats(), st.text(max_size=20), st.binary(max_size=4), st.just("false")),
            st.sampled_from([0.0, -500.0, 1e18, -1e18]),
        ),
        max_size=12,
    )
)
def test_no_mail_whatever_makes_the_controller_fall_over(
    mail: list[tuple[str, float | str | bytes, float]],
) -> None:
    sea, app = sea_with("enable_thrust_cap = true\nheading_debug = true\nspeed_debug = true")
    for name, value, skew in mail:
        app.on_mail([Message(name, value, sea.now + skew, "tester")])
        sea.run(0.1)
    sea.run(0.2)
    assert all(-100.0 <= value <= 100.0 for value in sea.heard("DESIRED_RUDDER"))
    assert all(0.0 <= value <= 100.0 for value in sea.heard("DESIRED_THRUST"))
    assert all(isinstance(line, str) for line in app.report())
