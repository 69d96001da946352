"""The parameters of BHV_LegRun, declared once (behaviors.md C17)."""

from __future__ import annotations

from typing import NamedTuple

from behaviors import forms
from behaviors.speed_schedule import read_leg_speeds
from pymoos_lite.config.parameters import Declaration, Parameter, parse_boolean, parse_number
from pymoos_lite.geometry.text import fields

LEG_KEYS = ("x", "y", "ang", "len")


class LegSpec(NamedTuple):
    """A leg by its centre; angle is the bearing from p1 to p2."""

    x: float
    y: float
    angle: float
    length: float


def _leg(text: str) -> LegSpec:
    if "=" in text:
        pairs = {key.lower(): value for key, value in fields(text)}
        if set(pairs) != set(LEG_KEYS):
            raise ValueError("expected x=..,y=..,ang=..,len=..")
        numbers = [parse_number(pairs[key]) for key in LEG_KEYS]
    else:
        numbers = [parse_number(piece.strip()) for piece in text.split(":")]
        if len(numbers) != 4:
            raise ValueError("expected x:y:ang:len")
    if not numbers[3] > 0.0:
        raise ValueError("the length must be above 0")
    return LegSpec(*numbers)


def _capture_line(text: str) -> str:
    if text.strip().lower() == "absolute":
        return "absolute"
    return "true" if parse_boolean(text) else "false"


def _turn_dir(text: str) -> str:
    words = {"port": "port", "star": "star", "starboard": "star", "toggle": "toggle"}
    word = words.get(text.strip().lower())
    if word is None:
        raise ValueError(f"expected one of {', '.join(words)}")
    return word


def _above(name: str, unit: str, doc: str, **more: object) -> Parameter:
    return Parameter(name, "number", None, unit, doc, low=0.0, open_low=True, **more)  # type: ignore[arg-type]


def _change(name: str, unit: str, doc: str) -> Parameter:
    return Parameter(name, "number", None, unit, doc)


def _turns() -> list[Parameter]:
    found: list[Parameter] = []
    for prefix, where in (("turn", "both turns"), ("turn1", "turn 1"), ("turn2", "turn 2")):
        found += [
            _above(f"{prefix}_rad", "m", f"Radius of {where}; required."),
            _change(f"{prefix}_rad_mod", "m", f"Change the radius of {where}."),
            Parameter(
                f"{prefix}_bias",
                "number",
                None,
                "percent",
                f"Shift the circle of {where} sideways.",
                low=-100.0,
                high=100.0,
            ),
            _change(f"{prefix}_bias_mod", "percent", f"Change the shift of {where}."),
            Parameter(
                f"{prefix}_ext", "number", None, "m", f"Go straight on so far before {where}.", low=0.0
            ),
            _change(f"{prefix}_ext_mod", "m", f"Change how far to go straight on before {where}."),
            forms.custom(f"{prefix}_dir", _turn_dir, None, f"Side of {where}.", "port"),
        ]
    return found


LEG_RUN_PARAMETERS = Declaration(
    (
        Parameter("speed", "number", 0.0, "m/s", "Cruise speed; within the domain.", low=0.0),
        forms.point("p1", "End of leg 1.", "vx1"),
        forms.point("p2", "End of leg 2.", "vx2"),
        forms.custom("leg", _leg, None, "Both ends by centre, angle and length.", "0:0:90:100"),
        _above("leg_len", "m", "New length about the same centre."),
        _change("leg_len_mod", "m", "Change the length."),
        _change("leg_ang", "deg", "New direction from p1 to p2."),
        _change("leg_ang_mod", "deg", "Change the direction."),
        forms.point("shift_pt", "New centre."),
        *_turns(),
        forms.number("turn_rad_min", 2.0, "m", "No radius gets smaller.", open_low=True),
        forms.number("turn_pt_gap", 20.0, "deg", "Angle between the points of a turn.", low=0.5, high=180.0),
        Parameter("id", "text", "", "", "A name for these legs."),
        forms.custom(
            "capture_line",
            _capture_line,
            "false",
            "Reached on crossing the line through the point across the track; absolute: only so.",
            "true, false or absolute",
        ),
        forms.number(
            "capture_radius", 3.0, "m", "A point is reached within this.", open_low=True, aliases=("radius",)
        ),
        forms.number(
            "slip_radius",
            15.0,
            "m",
            "A point is reached when the distance grows again within this.",
            aliases=("nm_radius",),
        ),
        forms.number("lead", 0.0, "m", "Steer for a point of the track line so far ahead; 0: off.", low=None),
        forms.number("lead_damper", 0.0, "m", "Nearer to the line than this the lead is lengthened."),
        forms.custom("repeat", forms.read_repeat, 0, "Further rounds after the first.", "0"),
        Parameter(
            "init_leg_mode",
            "choice",
            "fixed",
            "",
            "Where to begin: leg 1, the end nearer or farther; resume is as fixed.",
            choices=("fixed", "close_turn", "far_turn", "resume"),
        ),
        Parameter(
            "patience",
            "number",
            50.0,
            "percent",
            "Weight of course against speed.",
            low=1.0,
            high=99.0,
            clip=True,
        ),
        forms.custom(
            "leg_spds", read_leg_speeds, None, "Speeds of the legs to come.", "2:1.2,1.5", unit="m/s"
        ),
        Parameter("leg_spds_repeat", "boolean", False, "", "After the last speed begin with the first."),
        Parameter("leg_spds_onturn", "boolean", False, "", "Turn at the speed of the leg too."),
        forms.flag("leg_end_flag", "Posted at the end of each leg."),
        forms.flag("leg1_end_flag", "Posted at the end of leg 1.", "leg1_flag"),
        forms.flag("leg2_end_flag", "Posted at the end of leg 2.", "leg2_flag"),
        forms.flag("turn_end_flag", "Posted at the end of each turn."),
        forms.flag("turn1_end_flag", "Posted at the end of turn 1.", "turn1_flag"),
        forms.flag("turn2_end_flag", "Posted at the end of turn 2.", "turn2_flag"),
        forms.flag("mid_leg_flag", "Posted when a part of a leg is done."),
        forms.flag("mid_turn_flag", "Posted when a part of a turn is done."),
        forms.number("mid_leg_pct", 25.0, "percent", "That part of the leg.", high=100.0),
        forms.number("mid_turn_pct", 25.0, "percent", "That part of the turn.", high=100.0),
        forms.hint_lines("nextpt_color=red"),
    )
)
