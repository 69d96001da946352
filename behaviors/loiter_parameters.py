"""The parameters of BHV_Loiter, declared once (behaviors.md C2)."""

from __future__ import annotations

from behaviors import forms
from pymoos_lite.config.parameters import Declaration, Parameter, parse_boolean, parse_number
from pymoos_lite.geometry.specs import parse_point
from pymoos_lite.geometry.text import fields


def _clockwise(text: str) -> str:
    if text.strip().lower() == "best":
        return "best"
    return "true" if parse_boolean(text) else "false"


def _center(text: str) -> tuple[float | None, float | None] | None:
    """None for the present position, else x and y, either of which may be left out (None)."""
    if text.strip().lower() == "present_position":
        return None
    pairs = {key.lower(): value for key, value in fields(text)}
    if len(pairs) == 1 and set(pairs) <= {"x", "y"}:
        return tuple(parse_number(pairs[k]) if k in pairs else None for k in ("x", "y"))  # type: ignore[return-value]
    point = parse_point(text)
    return point.x, point.y


def _slingshot(text: str) -> float:
    value = parse_number(text)
    if value < 0.0 and value != -1.0:
        raise ValueError("give degrees of at least 0, or -1 for off")
    return value


def _suffix(text: str) -> str:
    return forms.read_suffix(text).upper()


LOITER_PARAMETERS = Declaration(
    (
        forms.polygon("polygon", "The convex polygon to go around."),
        forms.number("speed", 0.0, "m/s", "Speed to go at."),
        forms.number("speed_alt", -1.0, "m/s", "Another speed; negative for none.", low=None),
        Parameter("use_alt_speed", "boolean", False, "", "Whether the other speed is in force."),
        forms.custom(
            "clockwise", _clockwise, "true", "Way around; best: what turns least on arrival.", "true"
        ),
        forms.number(
            "acquire_dist",
            10.0,
            "m",
            "Further outside than this, the vertex to join at is chosen anew all the time.",
            aliases=("acquire_distance",),
        ),
        forms.number(
            "capture_radius", 3.0, "m", "A vertex is reached within this distance.", aliases=("radius",)
        ),
        forms.number(
            "slip_radius",
            15.0,
            "m",
            "A vertex is reached when the distance grows again within this one.",
            aliases=("nm_radius",),
        ),
        Parameter(
            "patience", "number", 50.0, "percent", "Weight of course against speed.", low=1.0, high=99.0
        ),
        Parameter("ipf_type", "choice", "zaic", "", "Shape of the function.", choices=("zaic", "zaic_spd")),
        forms.custom(
            "center_assign", _center, None, "Move the polygon here: present_position, x,y or one.", "x=5,y=6"
        ),
        forms.number("xcenter_assign", 0.0, "m", "Move the polygon's centre to this x.", low=None),
        forms.number("ycenter_assign", 0.0, "m", "Move the polygon's centre to this y.", low=None),
        Parameter(
            "center_activate", "boolean", False, "", "Move the polygon to own ship on starting to run."
        ),
        forms.number("mod_poly_rad", 0.0, "m", "Grow (or, negative, shrink) the polygon.", low=None),
        Parameter(
            "spiral_factor",
            "number",
            None,
            "",
            "From inside: how much to prefer any vertex to the one ahead.",
            low=0.0,
            high=100.0,
        ),
        forms.custom(
            "slingshot", _slingshot, -1.0, "Complete after so much of a circuit; -1: never.", "-1", unit="deg"
        ),
        forms.custom("post_suffix", _suffix, "", "Put behind the names of posted variables."),
        forms.hint_lines("nextpt_color=red"),
    )
)
