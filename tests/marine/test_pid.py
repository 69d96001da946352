"""The PID controller against recordings of the reference applications, and by its own rules."""

from __future__ import annotations

import math

import pytest
from golden_replay import Recording, load, replay
from hypothesis import example, given
from hypothesis import strategies as st

from pymoos_lite.marine.pid import PidEngine, PidGains, PidParameters, ScalarPid
from pymoos_lite.marine.thrust_map import parse_thrust_map
from pymoos_lite.marine.vessel_model import VesselModel, VesselParameters

_INPUTS = frozenset(
    ["DESIRED_HEADING", "DESIRED_SPEED", "NAV_HEADING", "NAV_SPEED", "MOOS_MANUAL_OVERRIDE"],
)


def controller_of(config: dict[str, str]) -> PidEngine:
    def gains(prefix: str) -> PidGains:
        names = ("kp", "kd", "ki", "integral_limit")
        return PidGains(*(float(config[f"{prefix}_pid_{name}"]) for name in names))

    return PidEngine(
        PidParameters(
            yaw=gains("yaw"),
            speed=gains("speed"),
            max_rudder=float(config["maxrudder"]),
            max_thrust=float(config["maxthrust"]),
            depth_control=config["depth_control"] == "true",
            speed_factor=float(config["speed_factor"]),
        )
    )


class RecordedPid:
    """A controller alone, hearing what the script posted."""

    def __init__(self, controller: PidEngine) -> None:
        self.controller = controller

    def receive(self, variable: str, text: str, now: float) -> None:
        controller = self.controller
        if variable == "MOOS_MANUAL_OVERRIDE":
            controller.set_override(text == "true")
        else:
            {
                "DESIRED_HEADING": controller.hear_desired_heading,
                "DESIRED_SPEED": controller.hear_desired_speed,
                "NAV_HEADING": controller.hear_heading,
                "NAV_SPEED": controller.hear_speed,
            }[variable](float(text))

    def step(self, now: float) -> None:
        self.controller.step(now)

    def misfit(self, row: dict[str, float]) -> float:
        return abs(self.controller.rudder - row["DESIRED_RUDDER"])


class RecordedBoat(RecordedPid):
    """A vessel with a controller on board, as uSimMarineV22 runs it: steer, then move."""

    def __init__(self, controller: PidEngine, model: VesselModel, start: float) -> None:
        super().__init__(controller)
        self.model = model
        self.now = start

    def step(self, now: float) -> None:
        controller, model = self.controller, self.model
        controller.hear_heading(model.heading)
        controller.hear_speed(model.speed)
        controller.step(now)
        model.thrust, model.rudder = controller.thrust, controller.rudder
        model.step(now - self.now)
        self.now = now

    def misfit(self, row: dict[str, float]) -> float:
        pose = self.model.pose()
        return math.hypot(pose.x - row["NAV_X"], pose.y - row["NAV_Y"]) + abs(pose.speed - row["NAV_SPEED"])


def with_idle_steps(recording: Recording, until: float) -> Recording:
    """Steps that published nothing: before the first output and after the last."""
    times = recording.step_times
    early = [times[0] - 0.05 * i for i in range(20, 0, -1)]
    late = [times[-1] + 0.05 * i for i in range(1, int((until - times[-1]) / 0.05))]
    recording.step_times = early + times + late
    recording.row_at = {index + len(early): row for index, row in recording.row_at.items()}
    return recording


def test_the_controller_alone_reproduces_the_recorded_rudder_and_thrust() -> None:
    recording = load("pid_open", steps_per_row=1)
    recording.rows = [row for row in recording.rows if row["t"] > 5.0]  # drop the all-stop of start-up
    recording.step_times = [row["t"] for row in recording.rows]
    recording.row_at = dict(enumerate(recording.rows))
    recording = with_idle_steps(recording, until=56.0)
    pairs = replay(RecordedPid(controller_of(recording.config)), recording, _INPUTS)
    assert len(pairs) > 500
    assert max(abs(system.controller.rudder - row["DESIRED_RUDDER"]) for system, row in pairs) < 0.01
    thrust_errors = sorted(abs(system.controller.thrust - row["DESIRED_THRUST"]) for system, row in pairs)
    assert thrust_errors[-1] <= 0.51  # the log pairs some rudders with the thrust of the step before
    assert thrust_errors[len(pairs) // 2] == 0.0


def test_outputs_stop_one_step_after_the_recorded_mail_became_stale() -> None:
    recording = with_idle_steps(load("pid_open", steps_per_row=1), until=51.0)
    last_drive = recording.rows[-2]["t"]
    controller = controller_of(recording.config)
    inputs = [entry for entry in recording.inputs if entry[1] in _INPUTS]
    system = RecordedPid(controller)
    lost_at = None
    for now in recording.step_times:
        while inputs and inputs[0][0] <= now:
            stamp, variable, text = inputs.pop(0)
            system.receive(variable, text, stamp)
        system.step(now)
        if now > 20.0 and lost_at is None and not controller.has_control:
            lost_at = now
    assert lost_at is not None
    assert abs(lost_at - last_drive) < 0.2
    assert {name for name, _ in controller.stale_reports} <= {"DesHdg", "DesSpd", "NavHdg", "NavSpd"}
    assert controller.rudder == controller.thrust == 0.0


@pytest.mark.parametrize("name", ["pid_embedded"])
def test_a_vessel_with_its_controller_on_board_sails_the_recorded_track(name: str) -> None:
    recording = load(name, steps_per_row=2)
    thrust_map, _ = parse_thrust_map(recording.config["thrust_map"])
    boat = RecordedBoat(
        controller_of(recording.config),
        VesselModel(VesselParameters(thrust_map=thrust_map)),
        recording.rows[0]["t"],
    )
    pairs = replay(boat, recording, _INPUTS)
    distance_run = 0.0
    former = pairs[0][1]
    for system, row in pairs:
        pose = system.model.pose()
        distance_run += math.hypot(row["NAV_X"] - former["NAV_X"], row["NAV_Y"] - former["NAV_Y"])
        former = row
        where = f"{name} at {row['t']} s"
        assert math.hypot(pose.x - row["NAV_X"], pose.y - row["NAV_Y"]) <= 0.5 + 0.02 * distance_run, where
        assert abs((pose.heading - row["NAV_HEADING"] + 180.0) % 360.0 - 180.0) <= 1.5, where
    assert distance_run > 50.0


def test_a_recorded_vessel_driven_by_the_recorded_stand_alone_controller_sails_the_recorded_track() -> None:
    recording = load("pid_standalone", steps_per_row=2)
    thrust_map, _ = parse_thrust_map(recording.config["thrust_map"])
    model = VesselModel(VesselParameters(thrust_map=thrust_map, max_acceleration=0.5))
    inputs = [entry for entry in recording.inputs if entry[1] in ("DESIRED_RUDDER", "DESIRED_THRUST")]
    before = recording.rows[0]["t"]
    distance_run = 0.0
    former = recording.rows[0]
    for index, now in enumerate(recording.step_times):
        while inputs and inputs[0][0] + 0.01 <= now:
            _, variable, text = inputs.pop(0)
            setattr(model, "rudder" if variable == "DESIRED_RUDDER" else "thrust", float(text))
        model.step(now - before)
        before = now
        row = recording.row_at.get(index)
        if row is not None:
            distance_run += math.hypot(row["NAV_X"] - former["NAV_X"], row["NAV_Y"] - former["NAV_Y"])
            former = row
            off = math.hypot(model.x - row["NAV_X"], model.y - row["NAV_Y"])
            assert off <= 0.5 + 0.02 * distance_run
            assert abs((model.heading - row["NAV_HEADING"] + 180.0) % 360.0 - 180.0) <= 1.5
    assert distance_run > 60.0


def in_control(controller: PidEngine) -> bool:
    return controller.has_control


def ready(**changes: object) -> PidEngine:
    """A controller that has heard everything and has control at time 1."""
    controller = PidEngine(
        PidParameters(**{"yaw": PidGains(kp=1.0), "depth_control": False, "speed_factor": 20.0, **changes})  # type: ignore[arg-type]
    )
    controller.set_override(False)
    controller.step(1.0)
    controller.hear_desired_heading(90.0)
    controller.hear_desired_speed(2.0)
    controller.hear_desired_depth(5.0)
    controller.hear_heading(80.0)
    controller.hear_speed(1.0)
    controller.hear_depth(0.0)
    controller.hear_pitch(0.0)
    return controller


def test_nothing_is_driven_before_every_quantity_has_arrived() -> None:
    controller = PidEngine(PidParameters(depth_control=False, speed_factor=20.0))
    controller.set_override(False)
    controller.step(1.0)
    controller.hear_desired_heading(90.0)
    controller.hear_desired_speed(2.0)
    controller.hear_heading(80.0)
    controller.step(1.1)
    assert not in_control(controller)
    controller.hear_speed(1.0)
    controller.step(1.2)
    assert in_control(controller)
    assert controller.thrust == 40.0


def test_a_value_heard_before_the_first_step_does_not_count() -> None:
    controller = PidEngine(PidParameters(depth_control=False, speed_factor=20.0, simulation=True))
    controller.set_override(False)
    for hear in (
        controller.hear_desired_heading,
        controller.hear_desired_speed,
        controller.hear_heading,
        controller.hear_speed,
    ):
        hear(1.0)
    controller.step(0.0)
    controller.step(0.1)
    assert not in_control(controller)


def test_each_stale_quantity_is_named_with_its_age_and_outputs_drop_to_zero() -> None:
    controller = ready()
    controller.step(1.1)
    assert in_control(controller)
    controller.hear_heading(81.0)
    controller.step(3.05)
    assert not in_control(controller)
    assert [name for name, _ in controller.stale_reports] == ["DesHdg", "DesSpd", "NavSpd"]
    assert controller.stale_reports[0][1] == pytest.approx(2.05)
    assert controller.rudder == controller.thrust == 0.0


def test_simulation_mode_never_calls_anything_stale() -> None:
    controller = ready(simulation=True)
    controller.step(1000.0)
    assert in_control(controller)
    assert controller.thrust == 40.0


def test_rudder_and_elevator_rest_while_thrust_is_zero() -> None:
    controller = ready(depth_control=True, z_to_pitch=PidGains(kp=0.1), pitch=PidGains(kp=0.5))
    controller.hear_desired_speed(0.0)
    controller.step(1.1)
    assert in_control(controller)
    assert (controller.thrust, controller.rudder, controller.elevator) == (0.0, 0.0, 0.0)
    controller.hear_desired_speed(1.0)
    controller.step(1.2)
    assert controller.rudder == pytest.approx(10.0)
    assert controller.elevator > 0.0


def test_depth_control_waits_for_depth_and_pitch() -> None:
    controller = PidEngine(PidParameters(speed_factor=20.0, simulation=True))
    controller.set_override(False)
    controller.step(1.0)
    controller.hear_desired_heading(90.0)
    controller.hear_desired_speed(2.0)
    controller.hear_heading(80.0)
    controller.hear_speed(1.0)
    controller.step(1.1)
    assert not in_control(controller)
    controller.hear_desired_depth(5.0)
    controller.hear_depth(0.0)
    controller.hear_pitch(0.0)
    controller.step(1.2)
    assert in_control(controller)


def test_after_an_override_every_quantity_must_arrive_anew() -> None:
    controller = ready()
    controller.step(1.1)
    assert controller.set_override(True)
    assert not controller.set_override(True)
    assert not in_control(controller)
    assert controller.set_override(False)
    controller.step(1.2)
    assert controller.thrust == 0.0


def test_the_shorter_way_round_decides_the_rudder_side() -> None:
    controller = ready()
    controller.hear_desired_heading(350.0)
    controller.hear_heading(10.0)
    controller.step(1.1)
    assert controller.rudder == pytest.approx(-20.0)
    controller.hear_desired_heading(-10.0)
    controller.hear_heading(340.0)
    controller.step(1.2)
    assert controller.rudder == pytest.approx(10.0)


def test_the_thrust_loop_never_reverses_unless_it_is_the_old_application() -> None:
    forward = ready(speed_factor=0.0, speed=PidGains(kp=10.0))
    backward = ready(speed_factor=0.0, speed=PidGains(kp=10.0), legacy=True)
    for controller in (forward, backward):
        controller.hear_speed(4.0)
        controller.step(1.1)
    assert forward.thrust == 0.0
    assert backward.thrust == -20.0
    backward.hear_desired_speed(0.0)
    backward.step(1.2)
    assert backward.thrust == 0.0


def test_a_thrust_cap_holds() -> None:
    controller = ready()
    controller.thrust_cap = 25.0
    controller.step(1.1)
    assert controller.thrust == 25.0


def test_the_artificial_instability_swings_from_side_to_side() -> None:
    controller = ready(yaw=PidGains(), sim_instability=40.0, simulation=True)
    seen = []
    for now in (10.0, 15.0, 19.9, 25.0, 29.9, 35.0):
        controller.step(now)
        seen.append(round(controller.rudder, 1))
    assert seen == [0.0, 20.0, 39.6, -20.0, -39.6, 20.0]


def test_the_derivative_is_the_mean_of_nine_slopes() -> None:
    loop = ScalarPid(PidGains(kd=1.0), 1000.0)
    errors = [0.0, 1.0, 3.0, 6.0, 10.0, 15.0, 21.0, 28.0, 36.0, 45.0, 55.0, 66.0]
    outputs = [loop.step(error, float(now)) for now, error in enumerate(errors)]
    for now in range(1, len(errors)):
        slopes = [errors[i] - errors[i - 1] for i in range(max(1, now - 8), now + 1)]
        assert outputs[now] == pytest.approx(sum(slopes) / len(slopes))


def test_the_integral_limit_bounds_the_term_after_ki() -> None:
    loop = ScalarPid(PidGains(ki=0.5, integral_limit=0.3), 100.0)
    outputs = [loop.step(1.0, 0.1 * i) for i in range(20)]
    assert outputs[:3] == [0.0, pytest.approx(0.05), pytest.approx(0.1)]
    assert outputs[-1] == pytest.approx(0.3)


def test_a_loop_keeps_its_output_when_no_time_passes_and_abstains_when_time_runs_back() -> None:
    loop = ScalarPid(PidGains(kp=1.0), 100.0)
    assert loop.step(3.0, 5.0) == 3.0
    assert loop.step(9.0, 5.0) == 3.0
    assert loop.step(9.0, 4.0) is None
    assert loop.step(9.0, 6.0) == 9.0


@given(
    st.lists(st.tuples(st.floats(-1e6, 1e6), st.floats(0.0, 100.0)), min_size=1, max_size=30),
    st.tuples(*[st.floats(-50, 50)] * 4),
    st.floats(0.0, 100.0),
)
@example([(0.0, 0.0), (1.0, 5e-324)], (0.0, 0.0, 0.0, 0.0), 0.0)
def test_a_loop_never_exceeds_its_output_limit(
    steps: list[tuple[float, float]], gains: tuple[float, float, float, float], limit: float
) -> None:
    loop = ScalarPid(PidGains(*gains), limit)
    now = 0.0
    for error, gap in steps:
        now += gap
        output = loop.step(error, now)
        assert output is not None
        assert -limit <= output <= limit
