"""The vessel model against recordings of the reference simulator, and by its own laws."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from golden_replay import load, replay
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.marine.thrust_map import ThrustMap, parse_thrust_map
from pymoos_lite.marine.vessel_model import (
    DepthModel,
    Pose,
    RudderSlew,
    TurnLaw,
    VesselModel,
    VesselParameters,
)

_NUMERIC = {
    "max_acceleration": "max_acceleration",
    "max_deceleration": "max_deceleration",
    "turn_radius": "turn_radius",
    "max_speed": "max_speed",
    "max_rudder_degs_per_sec": "max_rudder_rate",
    "turn_rate": "turn_rate",
    "buoyancy_rate": "buoyancy_rate",
    "max_depth_rate": "max_depth_rate",
    "max_depth_rate_speed": "max_depth_rate_speed",
}
_INPUTS = frozenset(
    [f"DESIRED_{name}" for name in ("THRUST", "RUDDER", "ELEVATOR", "THRUST_L", "THRUST_R")]
    + [f"DRIFT_{name}" for name in ("VECTOR", "VECTOR_ADD", "VECTOR_MULT", "X", "Y")]
    + ["ROTATE_SPEED"]
)


def angle_between(a: float, b: float) -> float:
    return abs((a - b + 180.0) % 360.0 - 180.0)


def parameters_of(config: dict[str, str], **more: object) -> VesselParameters:
    thrust_map, problem = parse_thrust_map(config["thrust_map"])
    assert problem is None
    numbers = {_NUMERIC[key]: float(text) for key, text in config.items() if key in _NUMERIC}
    return replace(VesselParameters(thrust_map=thrust_map, **numbers), **more)  # type: ignore[arg-type]


class RecordedVessel:
    """A vessel model that listens to the variables of the recordings."""

    def __init__(self, model: VesselModel, start: float) -> None:
        self.model = model
        self.now = start

    def receive(self, variable: str, text: str, now: float) -> None:
        model = self.model
        if variable.startswith("DRIFT_VECTOR"):
            numbers = [float(part) for part in text.split(",")]
            if variable == "DRIFT_VECTOR_MULT":
                model.drift_x *= numbers[0]
                model.drift_y *= numbers[0]
                return
            keep = 1.0 if variable == "DRIFT_VECTOR_ADD" else 0.0
            toward = math.radians(numbers[0])
            model.drift_x = keep * model.drift_x + numbers[1] * math.sin(toward)
            model.drift_y = keep * model.drift_y + numbers[1] * math.cos(toward)
        elif variable == "DESIRED_RUDDER":
            model.ask_rudder(float(text), now)
        else:
            name = {
                "DESIRED_THRUST": "thrust",
                "DESIRED_ELEVATOR": "elevator",
                "DESIRED_THRUST_L": "thrust_left",
                "DESIRED_THRUST_R": "thrust_right",
                "DRIFT_X": "drift_x",
                "DRIFT_Y": "drift_y",
                "ROTATE_SPEED": "rotate_speed",
            }[variable]
            setattr(model, name, float(text))

    def step(self, now: float) -> None:
        self.model.step(now - self.now)
        self.now = now

    def misfit(self, row: dict[str, float]) -> float:
        pose = self.model.pose()
        return (
            math.hypot(pose.x - row["NAV_X"], pose.y - row["NAV_Y"])
            + angle_between(pose.heading, row["NAV_HEADING"])
            + abs(min(pose.speed, self.model.parameters.max_speed) - row["NAV_SPEED"])
            + 10.0 * abs(pose.depth - row["NAV_DEPTH"])
        )


SCENARIOS = {
    "thrust_step": {},
    "rudder_step": {},
    "drift_step": {},
    "depth_step": {},
    "thrust_neg": {},
    "differential": {},
    "turn_radius": {},
    "rudder_rate": {},
    "rudder_step_v23": {},
    "rudder_step_legacy": {"turn_law": TurnLaw.ANY_SPEED},
}


def replayed(name: str, **changes: object) -> list[tuple[Pose, dict[str, float]]]:
    recording = load(name, steps_per_row=1 if name.endswith("legacy") else 2)
    model = VesselModel(
        parameters_of(recording.config, **{**SCENARIOS[name], **changes}),
        heading=recording.rows[0]["NAV_HEADING"],
    )
    model.differential = "thrust_mode_diff" in recording.config
    pairs = replay(RecordedVessel(model, recording.rows[0]["t"]), recording, _INPUTS)
    return [(system.model.pose(), row) for system, row in pairs]


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_recorded_run_is_reproduced_within_its_tolerances(name: str) -> None:
    pairs = replayed(name)
    assert len(pairs) > 400
    distance_run = 0.0
    former = pairs[0][1]
    speeds = [row["NAV_SPEED"] for _, row in pairs]
    for index, (pose, row) in enumerate(pairs):
        if row["NAV_HEADING"] != pairs[0][1]["NAV_HEADING"]:
            distance_run += math.hypot(row["NAV_X"] - former["NAV_X"], row["NAV_Y"] - former["NAV_Y"])
        former = row
        where = f"{name} at {row['t']} s"
        off = math.hypot(pose.x - row["NAV_X"], pose.y - row["NAV_Y"])
        assert off <= 0.5 + 0.02 * distance_run, where
        assert angle_between(pose.heading, row["NAV_HEADING"]) <= 1.5, where
        assert abs(pose.depth - row["NAV_DEPTH"]) <= 0.05, where
        steady = (
            max(speeds[max(0, index - 5) : index + 6]) - min(speeds[max(0, index - 5) : index + 6]) <= 0.02
        )
        if steady:
            assert abs(min(pose.speed, 5.0) - row["NAV_SPEED"]) <= 0.02, where


@pytest.mark.parametrize("name", ["thrust_step", "drift_step", "depth_step", "thrust_neg", "differential"])
def test_where_the_recording_fixes_the_timing_every_column_agrees_to_its_last_digits(name: str) -> None:
    for pose, row in replayed(name):
        where = f"{name} at {row['t']} s"
        assert abs(pose.x - row["NAV_X"]) < 0.01, where
        assert abs(pose.y - row["NAV_Y"]) < 0.01, where
        assert angle_between(pose.heading, row["NAV_HEADING"]) < 0.01, where
        assert abs(pose.depth - row["NAV_DEPTH"]) < 0.01, where
        assert abs(pose.speed_over_ground - row["NAV_SPEED_OVER_GROUND"]) < 0.001, where
        if row["NAV_SPEED_OVER_GROUND"] > 0.01:
            assert angle_between(pose.heading_over_ground, row["NAV_HEADING_OVER_GROUND"]) < 0.3, where
        assert abs(pose.pitch - row.get("NAV_PITCH", 0.0)) < 0.001, where


def test_a_rudder_that_slews_by_itself_turns_later_than_the_one_that_waits_for_mail() -> None:
    waits, slews = (
        VesselModel(VesselParameters(max_rudder_rate=15.0)),
        VesselModel(VesselParameters(max_rudder_rate=15.0, rudder_slew=RudderSlew.STEADY)),
    )
    for model in (waits, slews):
        model.thrust = 50.0
        model.ask_rudder(0.0, 0.0)
        model.ask_rudder(30.0, 0.1)
        for _ in range(10):
            model.step(0.1)
    assert waits.rudder == pytest.approx(1.5)
    assert slews.rudder == pytest.approx(15.0)


def test_real_acceleration_is_half_of_the_configured_one() -> None:
    model = VesselModel(VesselParameters(thrust_map=ThrustMap(((100.0, 5.0),)), max_acceleration=0.25))
    model.thrust = 100.0
    for _ in range(100):
        model.step(0.1)
    assert model.speed == pytest.approx(10.0 * 0.125, rel=0.01)


def test_without_thrust_a_coasting_vessel_does_not_turn() -> None:
    model = VesselModel(speed=3.0)
    model.rudder = 50.0
    model.step(0.1)
    assert model.heading == 0.0
    assert model.y > 0.0


def test_a_turn_rate_of_zero_means_no_turn() -> None:
    model = VesselModel(VesselParameters(turn_rate=0.0), speed=3.0)
    model.thrust, model.rudder = 60.0, 100.0
    for _ in range(20):
        model.step(0.1)
    assert model.heading == 0.0


def test_full_opposite_thrust_turns_36_degrees_a_second_on_the_spot() -> None:
    model = VesselModel()
    model.differential = True
    model.thrust_left, model.thrust_right = 100.0, -100.0
    for _ in range(25):
        model.step(0.1)
    assert model.heading == pytest.approx(90.0)
    assert (model.x, model.y) == (0.0, 0.0)


def test_reverse_thrust_mode_negates_thrust_and_rudder() -> None:
    forward, backward = VesselModel(), VesselModel()
    backward.reverse = True
    forward.change(thrust_map=ThrustMap(reflect=True))
    backward.change(thrust_map=ThrustMap(reflect=True))
    forward.thrust, backward.thrust = -40.0, 40.0
    for model in (forward, backward):
        model.step(0.5)
    assert forward.pose() == backward.pose()
    assert backward.speed < 0.0


def test_the_steady_depth_model_dives_the_same_at_any_tick() -> None:
    depths = []
    for tick in (4, 20, 100):
        model = VesselModel(VesselParameters(depth_model=DepthModel.STEADY), speed=1.5)
        model.thrust, model.elevator = 30.0, 50.0
        for _ in range(10 * tick):
            model.step(1.0 / tick)
        depths.append(model.depth)
    assert max(depths) - min(depths) < 0.05
    assert 1.0 < depths[0] < 5.0


def test_the_compatible_depth_model_dives_deeper_the_faster_the_tick_as_the_reference_does() -> None:
    depths = []
    for tick in (4, 20):
        model = VesselModel(speed=1.5)
        model.thrust, model.elevator = 30.0, 50.0
        for _ in range(10 * tick):
            model.step(1.0 / tick)
        depths.append(model.depth)
    assert abs(depths[0] - depths[1]) > 0.05


def test_a_surfaced_vessel_stays_at_the_surface() -> None:
    model = VesselModel(depth=0.05)
    for _ in range(50):
        model.step(0.1)
    assert model.depth == 0.0


def test_a_heading_a_hair_left_of_north_is_zero_not_360() -> None:
    assert VesselModel(heading=-1e-17).heading == 0.0
    assert VesselModel(heading=-1e-3).heading == pytest.approx(359.999)


def test_no_time_no_change() -> None:
    model = VesselModel(x=1.0, y=2.0, heading=30.0, speed=2.0)
    model.thrust = 50.0
    before = model.pose()
    model.step(0.0)
    model.step(-1.0)
    assert model.pose() == before


def test_placing_a_vessel_changes_only_what_is_named() -> None:
    model = VesselModel(x=1.0, y=2.0, heading=30.0, speed=2.0, depth=3.0)
    model.place(heading=-90.0)
    assert model.pose()[:5] == (1.0, 2.0, 270.0, 2.0, 3.0)
    model.place(x=5.0, y=6.0, speed=0.0, depth=-1.0)
    assert model.pose()[:5] == (5.0, 6.0, 270.0, 0.0, 0.0)


def test_a_sail_caps_what_thrust_gives_and_a_fan_adds_to_it() -> None:
    model = VesselModel(VesselParameters(max_deceleration=0.0))
    model.thrust, model.sail_limit = 100.0, 2.0
    for _ in range(60):
        model.step(0.1)
    assert model.speed == pytest.approx(2.0)
    model.sail_bonus = 0.5
    for _ in range(60):
        model.step(0.1)
    assert model.speed == pytest.approx(2.5)


def test_turn_map_parameters_shape_the_turn_rate() -> None:
    def rate(speed: float) -> float:
        model = VesselModel(
            VesselParameters(
                turn_full_speed=2.0,
                turn_full_rate=60.0,
                turn_null_speed=1.0,
                turn_null_rate=20.0,
                max_deceleration=1e-9,
                turn_spd_loss=0.0,
                thrust_map=ThrustMap(factor=0.0),
            ),
            speed=speed,
        )
        model.thrust, model.rudder = 50.0, 100.0
        model.step(0.01)
        return model.heading / 0.01

    assert rate(0.5) == pytest.approx(20.0, rel=1e-3)
    assert rate(1.5) == pytest.approx(40.0, rel=1e-3)
    assert rate(4.0) == pytest.approx(60.0, rel=1e-3)


finite = st.floats(-1e4, 1e4, allow_nan=False)


@given(
    thrust=finite,
    rudder=finite,
    elevator=finite,
    drift=st.tuples(st.floats(-5, 5), st.floats(-5, 5)),
    turn_radius=st.sampled_from([0.0, 5.0, 50.0]),
    differential=st.booleans(),
    reverse=st.booleans(),
    depth_model=st.sampled_from(DepthModel),
    dt=st.floats(1e-4, 10.0),
)
def test_whatever_the_actuators_say_the_state_stays_finite_and_in_range(
    thrust: float,
    rudder: float,
    elevator: float,
    drift: tuple[float, float],
    turn_radius: float,
    differential: bool,
    reverse: bool,
    depth_model: DepthModel,
    dt: float,
) -> None:
    model = VesselModel(VesselParameters(turn_radius=turn_radius, depth_model=depth_model))
    model.thrust, model.elevator = thrust, elevator
    model.thrust_left, model.thrust_right = thrust, rudder
    model.ask_rudder(rudder, 0.0)
    model.drift_x, model.drift_y = drift
    model.differential, model.reverse = differential, reverse
    for _ in range(5):
        model.step(dt)
        pose = model.pose()
        assert all(math.isfinite(value) for value in pose)
        assert 0.0 <= pose.heading < 360.0
        assert pose.depth >= 0.0


@given(st.lists(st.tuples(st.floats(-100, 100), st.floats(-10, 10)), max_size=6), st.floats(-100, 100))
def test_a_thrust_map_never_goes_faster_than_its_fastest_pair(
    pairs: list[tuple[float, float]], thrust: float
) -> None:
    thrust_map = ThrustMap(factor=0.0)
    for pair in pairs:
        try:
            thrust_map = thrust_map.with_pair(*pair)
        except ValueError:
            continue
    speeds = [speed for _, speed in (*thrust_map.positive, *thrust_map.negative, (0.0, 0.0))]
    assert min(speeds) <= thrust_map.speed(thrust) <= max(speeds)
    assert list(thrust_map.positive) == sorted(thrust_map.positive)
    for known_thrust, known_speed in (*thrust_map.positive, *thrust_map.negative):
        assert thrust_map.speed(known_thrust) == pytest.approx(known_speed)


@pytest.mark.parametrize(
    ("text", "kept", "complaint"),
    [
        ("20:1, 100:5", 2, None),
        ("0:0, 20:1", 1, None),
        ("", 0, "empty"),
        ("20:1, 40:0.5, 60:3", 1, "fall"),
        ("20:1, 140:2", 1, "outside"),
        ("20:-1", 0, "opposite"),
        ("0:1", 0, "thrust 0"),
        ("20:1, banana", 1, "expected thrust:speed"),
        ("20:nan", 0, "outside"),
        ("20:one", 0, "rejected"),
    ],
)
def test_a_bad_thrust_map_pair_is_named_and_earlier_pairs_stay(
    text: str, kept: int, complaint: str | None
) -> None:
    thrust_map, problem = parse_thrust_map(text)
    assert len(thrust_map.positive) + len(thrust_map.negative) == kept
    assert (problem is None) == (complaint is None)
    if complaint is not None and problem is not None:
        assert complaint in problem


def test_without_a_positive_pair_thrust_is_divided_by_the_factor() -> None:
    assert ThrustMap().speed(40.0) == 2.0
    assert ThrustMap(factor=0.0).speed(40.0) == 0.0
    assert ThrustMap().speed(-40.0) == 0.0
    assert ThrustMap(reflect=True).speed(-40.0) == -2.0
