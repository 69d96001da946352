"""The parameters of BHV_Waypoint, declared once (behaviors.md C1)."""

from __future__ import annotations

import re

from ivp_helm.base_parameters import flag_parameter, read_condition
from pymoos_lite.config.parameters import Declaration, Parameter, ParameterError, parse_boolean, parse_number
from pymoos_lite.geometry.text import split_protected

ORDERS = ("normal", "reverse", "reversed", "toggle")


def reversed_order(word: str, reverse: bool) -> bool:
    """Whether points run backwards after this order, being so before or not."""
    return not reverse if word == "toggle" else word != "normal"


def _order(text: str) -> str:
    if text not in ORDERS:
        raise ParameterError(f"order = {text!r}: expected one of {', '.join(ORDERS)}, in lower case")
    return text


def _repeat(text: str) -> int | None:
    if text.lower() == "forever":
        return None
    value = parse_number(text)
    if value < 0 or value != int(value):
        raise ParameterError(f"repeat = {text!r}: give a whole number of at least 0, or forever")
    return int(value)


def _capture_line(text: str) -> str:
    if text.lower() == "absolute":
        return "absolute"
    return "true" if parse_boolean(text) else "false"


def _off_or_positive(text: str) -> float:
    """A number above 0, else switched off (0)."""
    if text.lower() == "off":
        return 0.0
    return max(0.0, parse_number(text))


def _positive(text: str) -> float:
    if text.lower() == "off":
        return 0.0
    value = parse_number(text)
    if value <= 0.0:
        raise ParameterError(f"lead_damper = {text!r}: give metres above 0")
    return value


_IPF_TYPES = {
    "zaic": "zaic",
    "zaic_spd": "zaic_spd",
    "roc": "roc",
    "rate_of_closure": "roc",
}


def _ipf_type(text: str) -> str:
    kind = _IPF_TYPES.get(text.lower())
    if kind is None:
        raise ParameterError(f"ipf_type = {text!r}: expected one of {', '.join(_IPF_TYPES)}")
    return kind


def _end_spd(text: str) -> tuple[float, float]:
    pairs = dict(piece.partition("=")[::2] for piece in split_protected(text, ","))
    if set(pairs) != {"slow_dist", "stop_dist"}:
        raise ParameterError(f"end_spd = {text!r}: expected slow_dist=A,stop_dist=B")
    slow, stop = parse_number(pairs["slow_dist"]), parse_number(pairs["stop_dist"])
    if not (slow > 0.0 and 0.0 <= stop <= slow):
        raise ParameterError(f"end_spd = {text!r}: slow_dist must be above 0 and stop_dist between 0 and it")
    return slow, stop


def _suffix(text: str) -> str:
    word = text.strip()
    if re.search(r"\s", word):
        raise ParameterError(f"post_suffix = {text!r}: no blanks are allowed")
    return word if not word or word.startswith("_") else f"_{word}"


def _custom(
    name: str, parse: object, default: object, doc: str, example: str = "", **more: object
) -> Parameter:
    return Parameter(name, "custom", default, doc=doc, parse=parse, example=example, **more)  # type: ignore[arg-type]


WAYPOINT_PARAMETERS = Declaration(
    (
        Parameter(
            "points",
            "text",
            "",
            "",
            "The points, a polygon to go around, empty, or start (where it first is).",
            aliases=("polygon", "point"),
            example="0,0:60,-40:60,-160",
        ),
        Parameter("xpoints", "text", "", "", "Other points of the same number; the index is kept."),
        Parameter("newpt", "text", "", "", "One more point at the end."),
        Parameter("speed", "number", 0.0, "m/s", "Speed to go at.", low=0.0),
        Parameter("speed_alt", "number", -1.0, "m/s", "Another speed; negative for none."),
        Parameter("use_alt_speed", "boolean", False, "", "Whether the other speed is in force."),
        Parameter(
            "capture_radius",
            "number",
            3.0,
            "m",
            "A point is reached within this distance.",
            low=0.0,
            open_low=True,
            aliases=("radius",),
        ),
        Parameter(
            "slip_radius",
            "number",
            15.0,
            "m",
            "A point is reached when the distance grows again within this one.",
            low=0.0,
            aliases=("nm_radius",),
        ),
        _custom(
            "capture_line",
            _capture_line,
            "false",
            "Reached on crossing the line through the point across the track; absolute: only so.",
            "true, false or absolute",
        ),
        _custom("order", _order, "normal", "Direction along the points.", "normal"),
        _custom("repeat", _repeat, 0, "Further rounds after the first.", "0"),
        _custom(
            "lead", _off_or_positive, 0.0, "Steer for a point of the track line so far ahead.", "8", unit="m"
        ),
        _custom(
            "lead_damper",
            _positive,
            0.0,
            "Nearer to the track line than this, the lead is lengthened up to three times.",
            "1",
            unit="m",
        ),
        Parameter("lead_to_start", "boolean", False, "", "Use a track line on the first leg too."),
        _custom(
            "lead_condition",
            read_condition,
            None,
            "Must hold for the lead to apply.",
            "DEPLOY = true",
            repeated=True,
        ),
        Parameter(
            "greedy_tour",
            "boolean",
            False,
            "",
            "Once reorder the points, always to the nearest.",
            aliases=("shortest_tour",),
        ),
        Parameter(
            "patience",
            "number",
            50.0,
            "percent",
            "Weight of course against speed.",
            low=1.0,
            high=99.0,
            aliases=("crs_spd_zaic_ratio",),
        ),
        _custom("ipf_type", _ipf_type, "zaic", "Shape of the function.", "zaic", aliases=("ipf-type",)),
        _custom(
            "end_spd", _end_spd, None, "Slow down to the end of the last round.", "slow_dist=50,stop_dist=5"
        ),
        Parameter("currix", "integer", 0, "", "Go for the point of this number.", low=0),
        Parameter(
            "wpt_status",
            "variable",
            "WPT_STAT",
            "",
            "Status variable, or silent.",
            aliases=("wpt_status_var",),
        ),
        Parameter(
            "wpt_index", "variable", "WPT_INDEX", "", "Index variable, or silent.", aliases=("wpt_index_var",)
        ),
        Parameter("cycle_index_var", "variable", "CYCLE_INDEX", "", "Variable of rounds done, or silent."),
        _custom("post_suffix", _suffix, "", "Put behind the names of posted variables."),
        Parameter("wpt_dist_to_prev", "text", "", "", "Variable for the distance to the point before."),
        Parameter("wpt_dist_to_next", "text", "", "", "Variable for the distance to the point ahead."),
        flag_parameter("wptflag", "Posted when a point is reached."),
        flag_parameter("cycleflag", "Posted when a round is complete."),
        Parameter("wptflag_on_start", "boolean", False, "", "Post wptflags on the first run too."),
        Parameter("reset_on_idle", "boolean", False, "", "Begin with the first point again after idling."),
        Parameter("eager_prev_index_flag", "boolean", False, "", "Move $[PI] on together with $[PX]."),
        Parameter(
            "efficiency_measure",
            "choice",
            "off",
            "",
            "Post how straight legs are sailed.",
            choices=("off", "all"),
        ),
        Parameter("draw_path_loop", "boolean", False, "", "Draw the closed path as a polygon too."),
        _custom(
            "visual_hints",
            str,
            None,
            "Colours and sizes of what is drawn.",
            "nextpt_color=red",
            repeated=True,
        ),
    )
)
