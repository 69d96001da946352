"""The declared parameters of the PID controller, shared by the stand-alone app and the simulator."""

from __future__ import annotations

from collections.abc import Callable, Collection

from pymoos_lite.config.parameters import Declaration, Parameter, Values
from pymoos_lite.marine.pid import PidGains, PidParameters

_LOOPS = {
    "yaw_pid": "heading error, deg, to rudder",
    "speed_pid": "speed error, m/s, to a change of thrust",
    "z_to_pitch_pid": "depth error, m, to pitch, rad",
    "pitch_pid": "pitch error, rad, to elevator, rad",
}


def _loop_parameters(loop: str, does: str) -> tuple[Parameter, ...]:
    return (
        Parameter(f"{loop}_kp", "number", 0.0, "", f"Proportional gain from {does}."),
        Parameter(f"{loop}_kd", "number", 0.0, "s", f"Derivative gain from {does}."),
        Parameter(f"{loop}_ki", "number", 0.0, "1/s", f"Integral gain from {does}; 0 is no integral."),
        Parameter(
            f"{loop}_integral_limit",
            "number",
            0.0,
            "output units",
            "Bound on the integral term, after its gain.",
            aliases=(f"{loop}_ki_limit",),
        ),
    )


PID_DECLARATION = Declaration(
    (
        *(parameter for loop, does in _LOOPS.items() for parameter in _loop_parameters(loop, does)),
        Parameter("maxrudder", "number", 100.0, "%", "Largest rudder.", low=0.0),
        Parameter("maxthrust", "number", 100.0, "%", "Largest thrust.", low=0.0),
        Parameter("maxpitch", "number", 15.0, "deg", "Largest pitch asked for by the depth loop.", low=0.0),
        Parameter("maxelevator", "number", 13.0, "deg", "Largest elevator.", low=0.0),
        Parameter(
            "speed_factor",
            "number",
            0.0,
            "% per m/s",
            "Other than 0: thrust is desired speed times this, without a speed loop.",
            low=0.0,
        ),
        Parameter(
            "depth_control",
            "boolean",
            True,
            "",
            "Drive the elevator; needs depth, pitch and a desired depth.",
        ),
        Parameter("simulation", "boolean", False, "", "Never call a quantity stale."),
        Parameter(
            "sim_instability",
            "number",
            0.0,
            "%",
            "Amplitude of an artificial rudder bias that swings from side to side.",
            low=0.0,
            high=100.0,
        ),
        Parameter(
            "tardy_helm_threshold", "number", 2.0, "s", "Age at which desired values are stale.", low=0.0
        ),
        Parameter("tardy_nav_threshold", "number", 2.0, "s", "Age at which navigation is stale.", low=0.0),
        Parameter("ignore_nav_yaw", "boolean", False, "", "Take heading from NAV_HEADING alone."),
        Parameter("enable_thrust_cap", "boolean", False, "", "Heed PID_THRUST_CAP, 20 to 100."),
        Parameter("output_suffix", "text", "", "", "Appended, in upper case, to the names of the outputs."),
        Parameter("heading_debug", "boolean", False, "", "Post PID_HDG_DEBUG each iteration."),
        Parameter("speed_debug", "boolean", False, "", "Post PID_SPD_DEBUG each iteration."),
        Parameter("depth_debug", "boolean", False, "", "Post PID_DEP_DEBUG each iteration."),
    ),
    ignored=("active_start", "verbose", "pid_verbose"),
)
"""Parameters of marine_apps.md 2.1."""

_TURNS_PID_ON = frozenset(f"yaw_pid_{name}" for name in ("kp", "kd", "ki", "integral_limit"))


def wants_pid(given: Collection[str]) -> bool:
    """Whether a simulator's block asks for a controller on board: any yaw gain does."""
    return not _TURNS_PID_ON.isdisjoint(given)


def pid_parameters(values: Values, legacy: bool = False) -> PidParameters:
    """The controller that bound `values` of `PID_DECLARATION` describe."""

    def gains(loop: str) -> PidGains:
        return PidGains(
            *(getattr(values, f"{loop}_{name}") for name in ("kp", "kd", "ki", "integral_limit")),
        )

    return PidParameters(
        yaw=gains("yaw_pid"),
        speed=gains("speed_pid"),
        z_to_pitch=gains("z_to_pitch_pid"),
        pitch=gains("pitch_pid"),
        max_rudder=values.maxrudder,
        max_thrust=values.maxthrust,
        max_pitch=values.maxpitch,
        max_elevator=values.maxelevator,
        speed_factor=values.speed_factor,
        depth_control=values.depth_control,
        simulation=values.simulation,
        tardy_helm=values.tardy_helm_threshold,
        tardy_nav=values.tardy_nav_threshold,
        sim_instability=values.sim_instability,
        legacy=legacy,
    )


def warn_of_missing_gains(values: Values, given: Collection[str], warn: Callable[[str], None]) -> None:
    """Say which gains of a loop in use are not given: they are 0, which is seldom meant."""
    loops = ["yaw_pid"]
    if values.speed_factor == 0.0:
        loops.append("speed_pid")
    if values.depth_control:
        loops += ["z_to_pitch_pid", "pitch_pid"]
    for loop in loops:
        missing = [f"{loop}_{n}" for n in ("kp", "kd", "ki", "integral_limit") if f"{loop}_{n}" not in given]
        if missing:
            warn(f"{', '.join(missing)} not given: 0 is used")
