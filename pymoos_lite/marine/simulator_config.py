"""Declared parameters of the simulators, and the vessel they describe (marine_apps.md 1.1, 1.9)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pymoos_lite.config.mission import ConfigLine
from pymoos_lite.config.parameters import Declaration, Parameter, Values
from pymoos_lite.marine.drift import Drift
from pymoos_lite.marine.pid_config import PID_DECLARATION
from pymoos_lite.marine.sailing import parse_polar, parse_wind
from pymoos_lite.marine.thrust_map import ThrustMap, parse_thrust_map
from pymoos_lite.marine.vessel_model import DepthModel, RudderSlew, TurnLaw, VesselParameters
from pymoos_lite.marine.wormholes import parse_wormhole
from pymoos_lite.records.csp import clip, parse_number

_POSE_KEYS = {
    "x": "x",
    "y": "y",
    "heading": "heading",
    "deg": "heading",
    "hdg": "heading",
    "speed": "speed",
    "spd": "speed",
    "depth": "depth",
    "dep": "depth",
}
_POSE_ORDER = ("x", "y", "heading", "speed", "depth")


@dataclass(frozen=True, slots=True)
class PoseChange:
    """Named parts of a pose, and what was wrong with the rest of the text that gave them."""

    parts: dict[str, float]
    problem: str | None = None


def read_pose(text: str) -> PoseChange:
    """`x=0,y=-20,heading=180,0,depth=2`: an element without `=` takes its meaning from its place.

    The places are x, y, heading, speed, depth. Elements before a bad one count, those after it do not.
    """
    parts: dict[str, float] = {}
    for place, element in enumerate(text.split(",")):
        key, equals, value = (part.strip() for part in element.partition("="))
        if not equals:
            key, value = (_POSE_ORDER[place], key) if place < len(_POSE_ORDER) else ("", key)
        name = _POSE_KEYS.get(key.lower())
        number = parse_number(value)
        if name is None or number is None:
            shown = clip(element.strip(), 40)
            return PoseChange(parts, f"'{shown}' is none of x, y, heading, speed, depth with a number")
        parts[name] = number
    return PoseChange(parts)


def _strict_pose(text: str) -> PoseChange:
    pose = read_pose(text)
    if pose.problem is not None:
        raise ValueError(pose.problem)
    return pose


def _strict_thrust_map(text: str) -> ThrustMap:
    thrust_map, problem = parse_thrust_map(text)
    if problem is not None:
        raise ValueError(problem)
    return thrust_map


def read_differential(text: str) -> bool:
    """true or differential, false or normal."""
    return _mode(text, "differential")


def read_reverse(text: str) -> bool:
    """true or reverse, false or normal."""
    return _mode(text, "reverse")


def _mode(text: str, word: str) -> bool:
    told = text.strip().lower()
    if told in ("true", word):
        return True
    if told in ("false", "normal"):
        return False
    raise ValueError(f"expected true, {word}, false or normal")


def _mirror_name(text: str) -> str:
    name = text.strip()
    if not name or any(c.isspace() for c in name) or name.upper() in ("DESIRED_THRUST", "DESIRED_RUDDER"):
        raise ValueError("expected a variable name other than DESIRED_THRUST and DESIRED_RUDDER")
    return name


def _number(name: str, default: float | None, unit: str, doc: str, **more: Any) -> Parameter:
    return Parameter(name, "number", default, unit, doc, **more)


_COMMON = Declaration(
    (
        Parameter(
            "start_pos",
            "custom",
            None,
            "m, deg, m/s",
            "Where the vessel starts.",
            parse=_strict_pose,
            example="x=0,y=0,heading=0,speed=0,depth=0",
        ),
        _number("start_x", None, "m", "Start position, east."),
        _number("start_y", None, "m", "Start position, north."),
        _number("start_heading", None, "deg", "Start heading.", aliases=("startheading",)),
        _number("start_speed", None, "m/s", "Start speed.", aliases=("startspeed",)),
        _number("start_depth", None, "m", "Start depth.", low=0.0, clip=True, aliases=("startdepth",)),
        Parameter("prefix", "variable", "USM", "", "Outputs are <prefix>_X and so on; missions set NAV."),
        _number("turn_rate", 70.0, "", "How sharply the vessel turns.", low=0.0, high=100.0, clip=True),
        Parameter(
            "thrust_map",
            "custom",
            None,
            "%:m/s",
            "Speed by thrust, piecewise linear.",
            parse=_strict_thrust_map,
            example="0:0, 20:1, 100:5",
        ),
        _number(
            "thrust_factor", 20.0, "% per m/s", "Speed is thrust / factor without a thrust_map.", low=0.0
        ),
        Parameter("thrust_reflect", "boolean", False, "", "Negative thrust mirrors the positive map."),
        _number("max_acceleration", 0.0, "m/s^2", "0 is no limit; the vessel reaches half of it.", low=0.0),
        _number("max_deceleration", 0.5, "m/s^2", "0 is no limit; the vessel reaches half of it.", low=0.0),
        _number("max_rudder_degs_per_sec", 0.0, "%/s", "Slew rate of the rudder; 0 is no limit.", low=0.0),
        Parameter(
            "rudder_slew",
            "choice",
            "mail",
            "",
            "mail: the rudder moves when a request arrives, as in MOOS-IvP. steady: at every step.",
            choices=("mail", "steady"),
        ),
        _number("drift_x", 0.0, "m/s", "Drift to the east.", low=-500.0, high=500.0),
        _number("drift_y", 0.0, "m/s", "Drift to the north.", low=-500.0, high=500.0),
        Parameter(
            "drift_vector",
            "custom",
            None,
            "deg, m/s",
            "Drift as heading (to which the water flows) and magnitude.",
            parse=Drift.parse,
            example="90,0.5",
        ),
        _number("rotate_speed", 0.0, "deg/s", "Rotation from outside."),
        _number("buoyancy_rate", 0.025, "m/s", "How fast the vessel rises by itself."),
        _number("max_depth_rate", 0.5, "m/s", "Depth rate at full elevator.", low=0.0),
        _number("max_depth_rate_speed", 2.0, "m/s", "Speed from which the elevator works fully.", low=0.0),
        Parameter(
            "depth_model",
            "choice",
            "compat",
            "",
            "compat: pitch changes per step, as in MOOS-IvP. steady: the same dive at any AppTick.",
            choices=("compat", "steady"),
        ),
        _number("default_water_depth", 0.0, "m", "Above 0: altitude is published.", low=0.0),
        Parameter(
            "dual_state", "boolean", False, "", "Publish a ground truth that alone receives the drift."
        ),
        Parameter("sim_pause", "boolean", False, "", "Start with the simulation paused."),
        Parameter(
            "thrust_mode_diff",
            "custom",
            False,
            "",
            "Two thrusters, DESIRED_THRUST_L and _R: true, differential, false or normal.",
            parse=read_differential,
        ),
        Parameter(
            "thrust_mode_reverse",
            "custom",
            False,
            "",
            "Sail backwards: true, reverse, false or normal.",
            parse=read_reverse,
        ),
        _number("trim_tolerance", 5.0, "deg", "Pitch at which trimming is complete.", low=0.0),
        _number("max_trim_delay", 10.0, "s", "Time after which trimming is called complete.", low=0.0),
    )
)
_TURN_MAP = Declaration(
    (
        _number(
            "turn_spd_map_full_speed", 5.0, "m/s", "Speed of the full turn rate.", low=0.0, open_low=True
        ),
        _number(
            "turn_spd_map_full_rate",
            None,
            "",
            "Full turn rate; turn_rate if not given.",
            low=0.0,
            high=100.0,
            open_low=True,
        ),
        _number("turn_spd_map_null_speed", 0.0, "m/s", "Speed up to which the null rate holds.", low=0.0),
        _number("turn_spd_map_null_rate", 0.0, "", "Turn rate at the null speed.", low=0.0, high=100.0),
    )
)
_SAILING = Declaration(
    (
        Parameter(
            "wind_conditions",
            "custom",
            None,
            "m/s, deg",
            "Wind speed and the direction it comes from.",
            parse=parse_wind,
            example="spd=4, dir=180",
        ),
        Parameter(
            "polar_plot",
            "custom",
            None,
            "deg,%",
            "Speed under sail, in percent of wind speed, by angle off the wind.",
            parse=parse_polar,
            example="0,0: 45,60: 90,85: 180,70",
        ),
    )
)
_MIRRORS = Declaration(
    (
        Parameter(
            "post_des_thrust",
            "custom",
            "",
            "",
            "With a PID on board: post its thrust to this variable.",
            parse=_mirror_name,
        ),
        Parameter(
            "post_des_rudder",
            "custom",
            "",
            "",
            "With a PID on board: post its rudder to this variable.",
            parse=_mirror_name,
        ),
    )
)
_WORMHOLES = Declaration(
    (
        Parameter(
            "wormhole",
            "custom",
            None,
            "",
            "A polygon that leads to another; lines of one tag add up.",
            parse=parse_wormhole,
            repeated=True,
            example="tag=one, madrid_poly={0,0:9,0:9,9}, weber_poly={50,0:59,0:59,9}, connection=both",
        ),
    )
)
_V22_ONLY = Declaration(
    (
        _number("turn_spd_loss", 0.85, "", "Share of speed lost at full rudder.", low=0.0, high=1.0),
        _number(
            "max_speed",
            5.0,
            "m/s",
            "Cap of the published speed, scale of turn_radius.",
            low=0.0,
            open_low=True,
        ),
        _number("turn_radius", 0.0, "m", "Smallest turn radius, at max_speed; 0 is none.", low=0.0),
        Parameter("post_navpos_summary", "boolean", False, "", "Post USM_NAVPOS_SUMMARY."),
    )
)
_V23_ONLY = Declaration(
    (
        Parameter(
            "thrust_map_fan",
            "custom",
            None,
            "%:m/s",
            "Speed that the fan adds under sail, by DESIRED_FAN.",
            parse=_strict_thrust_map,
            example="0:0, 100:1",
        ),
        Parameter("depth_info_acast", "boolean", False, "", "Show depth in the report."),
    )
)
_LEGACY_ONLY = Declaration(
    (
        _number("force_x", None, "m/s", "Old name of drift_x.", low=-500.0, high=500.0),
        _number("force_y", None, "m/s", "Old name of drift_y.", low=-500.0, high=500.0),
        _number("force_theta", None, "deg/s", "Old name of rotate_speed."),
        Parameter(
            "force_vector",
            "custom",
            None,
            "deg, m/s",
            "Old name of drift_vector.",
            parse=Drift.parse,
            example="90,0.5",
        ),
    )
)

_MODERN = _COMMON + _TURN_MAP + _SAILING + _MIRRORS + _WORMHOLES + PID_DECLARATION
V22_DECLARATION = _MODERN + _V22_ONLY
V23_DECLARATION = _MODERN + _V23_ONLY
LEGACY_DECLARATION = _COMMON + _LEGACY_ONLY


def vessel_parameters(values: Values, turn_law: TurnLaw, thrust_map: ThrustMap) -> VesselParameters:
    """The vessel that bound `values` describe; what a variant does not declare keeps its default."""
    plain = VesselParameters()
    known = vars(values)
    return VesselParameters(
        thrust_map=thrust_map,
        turn_rate=values.turn_rate,
        turn_spd_loss=known.get("turn_spd_loss", plain.turn_spd_loss),
        turn_law=turn_law,
        turn_full_speed=known.get("turn_spd_map_full_speed", plain.turn_full_speed),
        turn_full_rate=known.get("turn_spd_map_full_rate"),
        turn_null_speed=known.get("turn_spd_map_null_speed", 0.0),
        turn_null_rate=known.get("turn_spd_map_null_rate", 0.0),
        max_acceleration=values.max_acceleration,
        max_deceleration=values.max_deceleration,
        max_speed=known.get("max_speed", plain.max_speed),
        turn_radius=known.get("turn_radius", 0.0),
        max_rudder_rate=values.max_rudder_degs_per_sec,
        rudder_slew=RudderSlew(values.rudder_slew),
        buoyancy_rate=values.buoyancy_rate,
        max_depth_rate=values.max_depth_rate,
        max_depth_rate_speed=values.max_depth_rate_speed,
        depth_model=DepthModel(values.depth_model),
    )


def configured_thrust_map(values: Values, lines: Sequence[ConfigLine], keep_on_error: bool) -> ThrustMap:
    """The thrust map with its factor and reflection.

    A faulty `thrust_map` line has been reported when the block was bound. If the mission starts all the
    same, V22 keeps the pairs before the fault (`keep_on_error`), while V23 is left without any way to move.
    """
    base = ThrustMap(factor=values.thrust_factor, reflect=values.thrust_reflect)
    line = _last(lines, "thrust_map")
    if line is None:
        return base
    thrust_map, problem = parse_thrust_map(line.value, base)
    if problem is not None and not keep_on_error:
        return ThrustMap(factor=0.0)
    return thrust_map


def start_pose(values: Values, lines: Sequence[ConfigLine]) -> dict[str, float]:
    """The configured start, by the names of `VesselModel.place`."""
    line = _last(lines, "start_pos")
    parts = dict.fromkeys(_POSE_ORDER, 0.0)
    if line is not None:
        parts |= read_pose(line.value).parts
    for name in _POSE_ORDER:
        value = getattr(values, f"start_{name}")
        if value is not None:
            parts[name] = value
    return parts


def _last(lines: Sequence[ConfigLine], name: str) -> ConfigLine | None:
    found = [line for line in lines if line.name == name]
    return found[-1] if found else None
